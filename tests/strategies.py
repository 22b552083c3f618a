"""What hypothesis draws: lenses, placements, and rays aimed at, past, along and from a lens, by a few small numbers.

Everything is built from what was drawn, which is what a failure shows: it shrinks to a ray that runs along z at a
sphere, one number a time. Lengths of aims are in parts of the lens's box, so every lens is aimed at alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from hypothesis import strategies as st
from methods.hostile import Aim, Array, unit
from scenes import CATALOGUE, make_scene

from lenscl.config import Lens, Scene
from lenscl.lenses import surface
from lenscl.reference import Placement

Triple = tuple[int, int, int]

USERS: dict[str, dict[str, Any]] = {  # a user's own expressions
    "quartic": {"surface": "x**4 + y**4 + z**4 - k", "k": 0.5, "bounds": [[-1.1] * 3, [1.1] * 3]},
    "shell": {"surface": "max(x**2 + y**2 + z**2 - 1, k**2 - x**2 - y**2 - z**2)", "k": 0.6,
              "bounds": [[-1.2] * 3, [1.2] * 3]},
    "waves": {"surface": "x**2 + y**2 + z**2 - 0.8 + 0.1*sin(5*x)*cos(5*y)", "bounds": [[-1.2] * 3, [1.2] * 3]},
}  # fmt: skip
NAMES = (*CATALOGUE, *USERS)
KINDS = ("at", "past", "tangent", "inside", "on", "axis")
INDICES = ((1.5, 1.0), (1.0, 1.0), (2.4, 1.0), (1.0, 1.5), (1.0 + 2.0**-20, 1.0))  # of the lens, of the medium
STRETCHES = (1.0, 0.75, 2.0, -1.0, 0.0625)
_GRID = 8  # steps of the box on each side of its middle
_FAR = 2.0  # boxes: from so far a ray comes
_ASIDE = np.array([0.36, 0.48, 0.8])
_AXES = ((0, 0, -1), (0, 0, 1), (0, 1, 0), (1, 0, 0), (0, -1, 0), (-1, 0, 0))


def _triples(most: int) -> st.SearchStrategy[Triple]:
    return st.tuples(*[st.integers(-most, most)] * 3)


@dataclass(frozen=True)
class Way:
    """A direction: a vector of small whole numbers, off by 10^-`power` of its size where `power` is not 0."""

    along: Triple = (0, 0, -1)
    power: int = 0

    @property
    def vector(self) -> Array:
        """Unit."""
        along = np.array(self.along if any(self.along) else (0, 0, -1), float)
        tilt = 10.0**-self.power * np.linalg.norm(along) if self.power else 0.0
        return unit((along + tilt * _ASIDE)[None])[0]


def ways() -> st.SearchStrategy[Way]:
    """Draw directions along an axis, nearly so, and any others."""
    return st.one_of(
        st.builds(Way, st.sampled_from(_AXES)),
        st.builds(Way, st.sampled_from(_AXES), st.integers(1, 12)),
        st.builds(Way, _triples(_GRID)),
    )


def unit_vectors() -> st.SearchStrategy[Array]:
    """Draw unit vectors, shape (3,): along an axis, nearly so, and any others."""
    return ways().map(lambda way: way.vector)


@dataclass(frozen=True)
class Stand:
    """How a lens stands: its centre in eighths, degrees, and factors."""

    centre: Triple = (0, 0, 0)
    rotate: Triple = (0, 0, 0)
    stretch: tuple[float, float, float] = (1.0, 1.0, 1.0)

    @property
    def table(self) -> dict[str, Any]:
        """The keys of the lens table."""
        return {
            "centre": [part / 8 for part in self.centre],
            "rotate": [float(angle) for angle in self.rotate],
            "stretch": list(self.stretch),
        }


def stands() -> st.SearchStrategy[Stand]:
    """Draw placements, most of them other than the first, which leaves a lens as it is."""
    return st.builds(Stand, _triples(4), _triples(180), st.tuples(*[st.sampled_from(STRETCHES)] * 3))


@dataclass(frozen=True)
class Shape:
    """A surface of the catalogue or a user's, with its parameters: `by` eighths above the usual, in their order."""

    name: str = "sphere"
    by: tuple[int, ...] = ()

    @property
    def table(self) -> dict[str, Any]:
        """The keys of the lens table; the usual parameters where those that were drawn do not go together."""
        if self.name in USERS:
            usual = USERS[self.name]
            numbers = [key for key in usual if key not in ("surface", "bounds")]
            return usual | {key: usual[key] * (1 + by / 32) for key, by in zip(numbers, self.by, strict=False)}
        row = surface(self.name)
        defaults = {parameter.name: parameter.default for parameter in row.parameters}
        drawn = {
            name: default * (1 + by / 8) if default else by / 32
            for (name, default), by in zip(defaults.items(), self.by, strict=False)
        }
        values = defaults | drawn
        return {"surface": self.name} | (defaults if any(row.problems(values)) else values)


def shapes(names: Sequence[str]) -> st.SearchStrategy[Shape]:
    """Draw surfaces of these names, of the catalogue or of `USERS`, with parameters."""
    return st.builds(Shape, st.sampled_from(list(names)), st.lists(st.integers(-4, 8), max_size=10).map(tuple))


@dataclass(frozen=True)
class Aimed:
    """A ray at a lens.

    at       through `place`, from outside the box
    past     through a point beside the surface, by a tenth or a hundredth of the box
    tangent  along the surface, through a point at 10^-`power` of the box from it: outside, on it, or within, by `side`
    inside   from a point so far within the surface
    on       from a point of the surface
    axis     along an axis through `place` on the axes and planes of symmetry, or 10^-`power` beside
    """

    kind: str = "at"
    place: Triple = (0, 0, 0)
    way: Way = Way()
    side: int = 0
    power: int = 2


def aimed(kinds: Sequence[str] = KINDS) -> st.SearchStrategy[Aimed]:
    """Draw rays at a lens."""
    return st.builds(
        Aimed, st.sampled_from(list(kinds)), _triples(_GRID), ways(), st.integers(-1, 1), st.integers(2, 12)
    )


@dataclass(frozen=True)
class Shot:
    """A scene of one lens and rays at it."""

    shape: Shape
    stand: Stand
    indices: tuple[float, float]
    rays: tuple[Aimed, ...] = field(default=(Aimed(),))

    @cached_property
    def lens(self) -> dict[str, Any]:
        """The lens's table."""
        return self.shape.table | self.stand.table | {"n": self.indices[0]}

    def scene(self, precision: str, **numerics: Any) -> Scene:
        """Return the scene."""
        return make_scene(self.lens, medium=self.indices[1], numerics={"precision": precision} | numerics)

    @cached_property
    def starts(self) -> tuple[Array, Array]:
        """Where the rays start, and unit directions: world, shape (N, 3)."""
        lens = self.scene("double").lenses[0]
        return aim(lens, self.rays)


def shots(
    names: Sequence[str], kinds: Sequence[str] = KINDS, stand: st.SearchStrategy[Stand] | None = None, most: int = 8
) -> st.SearchStrategy[Shot]:
    """Draw a lens of these names, and up to so many rays at it."""
    return st.builds(
        Shot,
        shapes(names),
        stands() if stand is None else stand,
        st.sampled_from(INDICES),
        st.lists(aimed(kinds), min_size=1, max_size=most).map(tuple),
    )


def aim(lens: Lens, rays: Sequence[Aimed]) -> tuple[Array, Array]:
    """Return where rays at a lens start and their unit directions: world, shape (N, 3)."""
    hostile = Aim(lens, 0)
    half = (hostile.high - hostile.low) / 2
    place = (hostile.high + hostile.low) / 2 + np.array([ray.place for ray in rays]) / _GRID * half
    # Newton's way to the surface starts beside the planes of symmetry, on which F may have no slope
    on, good = hostile.onto(place + half * np.array([0.0137, 0.0291, 0.0173]))
    on = np.where(good[:, None], on, place)
    with np.errstate(invalid="ignore", divide="ignore"):
        normal = np.where(good[:, None], unit(hostile.slopes(on)), [0.0, 0.0, 1.0])
    found = [_built(*each, hostile.size) for each in zip(rays, place, on, normal, strict=True)]
    origin, direction = (np.stack(part) for part in zip(*found, strict=True))
    placement = Placement.of(lens)
    return placement.point_to_world(origin), unit(placement.point_to_world(direction) - placement.centre)


def _built(ray: Aimed, place: Array, on: Array, normal: Array, size: float) -> tuple[Array, Array]:
    """Return a ray's start and direction in the lens's own space."""
    away, way = 10.0**-ray.power * size, ray.way.vector
    match ray.kind:
        case "at":
            return place - _FAR * size * way, way
        case "past":
            beside = on + (0.1 if ray.side else 0.01) * size * normal
            return beside - _FAR * size * way, way
        case "tangent":
            across = way - (way @ normal) * normal
            length = np.linalg.norm(across)
            along = across / length if length > 0.1 else _across(normal)
            return on + ray.side * away * normal - _FAR * size * along, along
        case "inside":
            return on - away * normal, way
        case "on":
            return on, way
        case "axis":
            axis = np.eye(3)[int(np.argmax(np.abs(way)))] * (1.0 if ray.side > 0 else -1.0)
            beside = np.where(np.array(ray.place) == 0, ray.side * away, place)
            return beside - _FAR * size * axis, axis
    raise ValueError(ray.kind)


def _across(normal: Array) -> Array:
    across: Array = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    return across / np.linalg.norm(across)


@dataclass(frozen=True)
class Seen:
    """A scene of one lens seen through a film: so many columns and rows, its pixels 2^-`power` wide."""

    shape: Shape
    stand: Stand
    indices: tuple[float, float]
    size: tuple[int, int] = (16, 16)
    power: int = 4

    def scene(self, precision: str, **numerics: Any) -> Scene:
        """Return the scene; no place of a film's pixel is rounded, in either precision."""
        pitch = 2.0**-self.power
        columns, rows = self.size
        film = {
            "corner": [-pitch * columns / 2, pitch * rows / 2, 2.5],
            "right": [pitch * columns, 0.0, 0.0],
            "down": [0.0, -pitch * rows, 0.0],
            "size": [columns, rows],
        }
        lens = self.shape.table | self.stand.table | {"n": self.indices[0]}
        return make_scene(lens, film=film, medium=self.indices[1], numerics={"precision": precision} | numerics)


def seen(names: Sequence[str], stand: st.SearchStrategy[Stand] | None = None) -> st.SearchStrategy[Seen]:
    """Draw scenes of one lens of these names, and films of one pixel to some hundred."""
    return st.builds(
        Seen,
        shapes(names),
        stands() if stand is None else stand,
        st.sampled_from(INDICES),
        st.tuples(st.sampled_from([16, 17, 3, 1]), st.sampled_from([16, 9, 2, 1])),
        st.integers(4, 5),
    )
