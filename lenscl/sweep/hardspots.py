"""What is hard about a scene and can be told before tracing it.

Boxes, planes and points are looked at, and F on boxes: a spot is a reason to look twice, not a fault. Of solids that
are not proved apart it is said how they lie to each other, and which of them is the medium where both are.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Point, Scene, Study
from lenscl.errors import StudyError
from lenscl.imaging import refuse_unseen
from lenscl.sweep.arrangement import arrangement_spots
from lenscl.sweep.shapes import shape_spots
from lenscl.sweep.solids import solid_spots
from lenscl.sweep.values import value_spots
from lenscl.tracing import Placement, locate, methods_of, reach_of

Points = NDArray[np.float64]

_BENT_TO = "it is seen only if another lens bends light to it"
_LEFT_OUT = "nor can light that other lenses bend get to it, so that it is left out of the kernel"
_COARSE_RAYS = 2**14  # film rays looked at first; all are, in pieces of this size, where the first decide nothing
_ON_FILM = 1e-12  # of the film's size: a source so near to its plane lies in it
_NEVER_ZERO = 1e-300  # stands for a direction's zero: a quotient by it lies beyond every box, and is no NaN


@dataclass(frozen=True, slots=True)
class HardSpot:
    """One thing to look at twice."""

    key: str  # the part of the scene it is about, as the study's keys call it
    kind: str  # which rule found it
    message: str
    points: tuple[int, ...] = ()  # of the study, where it was found; the message is the first one's

    def __str__(self) -> str:
        return f"{self.key}: {self.message}"


def study_hard_spots(study: Study, *, most_points: int = 250) -> tuple[tuple[HardSpot, ...], int]:
    """Return the hard spots over a study's points, and how many points were looked at.

    Parameters
    ----------
    study : Study
        What to look at.
    most_points : int
        Of a longer study, this many points spread evenly from the first on.
    """
    stride = max(1, -(-study.point_count() // most_points))
    found: dict[tuple[str, str], HardSpot] = {}
    where: dict[tuple[str, str], list[int]] = {}
    looked_at = 0
    for point in study.points():
        if point.index % stride:
            continue
        looked_at += 1
        for spot in _spots_of(point):
            name = (spot.key, spot.kind)
            found.setdefault(name, spot)
            where.setdefault(name, []).append(point.index)
    spots = tuple(HardSpot(s.key, s.kind, s.message, tuple(where[name])) for name, s in found.items())
    return spots, looked_at


def _spots_of(point: Point) -> tuple[HardSpot, ...]:
    try:
        return tuple(hard_spots(point.scene))
    except StudyError as error:
        return (
            HardSpot("sweep", "impossible", f"values that do not go together; such a point fails: {error.problems[0]}"),
        )


def hard_spots(scene: Scene) -> Iterator[HardSpot]:
    """Yield the hard spots of one scene."""
    placed = [(scene.lens_key(number), Placement.of(lens)) for number, lens in enumerate(scene.lenses)]
    for number, lens in enumerate(scene.lenses):
        for kind, message in (*solid_spots(lens), *value_spots(scene, number), *shape_spots(scene, number)):
            yield HardSpot(scene.lens_key(number), kind, message)
    yield from _source_in_a_lens(scene)
    yield from _source_on_the_film(scene)
    yield from _arrangements(scene, placed)
    yield from _boxes_cut_screens(scene, placed)
    yield from _picture_out_of_the_way(scene)
    yield from _lenses_out_of_the_way(scene, placed)
    yield from _steps_too_long(scene)
    yield from _samples_not_seen(scene)
    yield from _environment_not_read(scene)
    yield from _light_not_seen(scene)


def _source_in_a_lens(scene: Scene) -> Iterator[HardSpot]:
    if scene.source.at is None:
        return
    inside, on = _holding(scene, scene.source.at)
    if inside:
        medium = max(inside, key=scene.by_priority().index)
        start = f"in {scene.lens_key(medium)}, the medium there" if len(inside) > 1 else "in its medium"
        yield HardSpot("source", "source-inside", f"lies inside {_listed(scene, inside)}; its rays start {start}")
    if on:
        yield HardSpot(
            "source", "source-on", f"lies on the surface of {_listed(scene, on)}; each ray's direction decides its side"
        )


def _holding(scene: Scene, at: Sequence[float]) -> tuple[list[int], list[int]]:
    """Return the lenses that a point of the world lies in, and those on whose surfaces it lies."""
    point = np.array([at], dtype=np.float64)
    each = [locate(replace(scene, lenses=(lens,)), point) for lens in scene.lenses]
    inside, on = ([number for number, found in enumerate(each) if found[i][0] >= 0] for i in (0, 1))
    return inside, on


def _listed(scene: Scene, numbers: Sequence[int]) -> str:
    return " and ".join(scene.lens_key(number) for number in numbers)


def _source_on_the_film(scene: Scene) -> Iterator[HardSpot]:
    if scene.source.at is None:
        return
    film = scene.film
    right, down, corner, at = (
        np.asarray(v, dtype=np.float64) for v in (film.right, film.down, film.corner, scene.source.at)
    )
    normal = np.cross(right, down)
    size = max(float(np.abs(v).max()) for v in (at, corner, right, down))
    if abs(float((at - corner) @ normal)) <= _ON_FILM * size * float(np.linalg.norm(normal)):
        yield HardSpot(
            "source",
            "source-on-film",
            "lies in the film's own plane, and so do all of its rays; that of a pixel whose centre it is has no "
            "direction, and ends undecided. Move the film away from the source",
        )


def _arrangements(scene: Scene, placed: list[tuple[str, Placement]]) -> Iterator[HardSpot]:
    for (i, (_, one)), (j, (_, other)) in combinations(enumerate(placed), 2):
        if not _boxes_overlap(one, other):
            continue
        for number, kind, message in arrangement_spots(scene, i, j):
            yield HardSpot(scene.lens_key(number), kind, message)


def _boxes_overlap(one: Placement, other: Placement) -> bool:
    axes = [*_normals(one), *_normals(other), *_crossed(one.to_world.T, other.to_world.T)]
    return _overlap(one.corners(), other.corners(), np.array(axes))


def _boxes_cut_screens(scene: Scene, placed: list[tuple[str, Placement]]) -> Iterator[HardSpot]:
    for name, screen in (("film", scene.film), ("picture", scene.picture)):
        corner, right, down = (np.asarray(v, dtype=np.float64) for v in (screen.corner, screen.right, screen.down))
        corners = corner + np.array([0 * right, right, down, right + down])
        normal = np.cross(right, down)
        edges = np.array([right, down])
        for key, lens in placed:
            # A flat figure is parted from a solid by its own normal, the solid's faces, or a plane along two edges
            axes = [normal, *_normals(lens), *_crossed(lens.to_world.T, edges), *_crossed(edges, normal[None])]
            if _overlap(corners, lens.corners(), np.array(axes)):
                yield HardSpot(
                    key,
                    f"cut-by-{name}",
                    f"its box is cut by the {name}; "
                    + (
                        "a film stops no light, and where the solid itself is cut, light enters it before the film"
                        if name == "film"
                        else "where the solid itself reaches it, rays end on it when they meet it first, in the solid "
                        "too; see picture.stops"
                    ),
                )


def _picture_out_of_the_way(scene: Scene) -> Iterator[HardSpot]:
    normal = np.cross(np.asarray(scene.picture.right, float), np.asarray(scene.picture.down, float))
    origins, directions = _film_rays(scene, _every(scene, _COARSE_RAYS))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        t = (np.asarray(scene.picture.corner, float) - origins) @ normal / (directions @ normal)
    # A film ray is at 0 at a point source and at 1 on the film; parallel ones come from as far as need be
    is_point = scene.source.at is not None
    never = ~np.isfinite(t) | (is_point & (t <= 0.0))
    early = ~never & (t < (1.0 if is_point else 0.0))
    if never.any():
        yield HardSpot(
            "picture",
            "behind",
            f"{_share(never)} of the straight rays through the film never meet its plane; "
            "they end BEHIND unless a lens turns them",
        )
    if early.any():
        yield HardSpot(
            "picture",
            "before-film",
            f"lies before the film, as seen from the source, for {_share(early)} of the film's rays",
        )


def _lenses_out_of_the_way(scene: Scene, placed: list[tuple[str, Placement]]) -> Iterator[HardSpot]:
    reached = reach_of(scene)
    for number, (key, lens) in enumerate(placed):
        if _is_aimed_at(scene, lens, _every(scene, _COARSE_RAYS)):
            continue
        pixels = scene.film.columns * scene.film.rows
        pieces = (np.arange(start, min(start + _COARSE_RAYS, pixels)) for start in range(0, pixels, _COARSE_RAYS))
        if not any(_is_aimed_at(scene, lens, piece) for piece in pieces):
            yield HardSpot(
                key,
                "not-aimed-at",
                f"no film ray is aimed at its box; {_LEFT_OUT if number not in reached else _BENT_TO}",
            )


def _steps_too_long(scene: Scene) -> Iterator[HardSpot]:
    for number, (lens, method) in enumerate(zip(scene.lenses, methods_of(scene), strict=True)):
        if "step" not in method.reads:
            continue
        low, high = np.asarray(lens.surface.box(lens.values), dtype=np.float64)
        thinnest = float(((high - low) * np.abs(lens.stretch)).min())
        step = scene.numerics.step
        yield HardSpot(
            scene.lens_key(number),
            "march-step",
            f"method {method.name} passes over chords shorter than its step of {step:g}; the thinnest extent of this "
            f"lens's box is {thinnest:.3g}, {thinnest / step:.3g} steps; a smaller numerics.step loses less",
        )


def _samples_not_seen(scene: Scene) -> Iterator[HardSpot]:
    if scene.effects["caustics"] and scene.effects["antialias"] != 1:
        yield HardSpot(
            "effects.antialias",
            "not-painted",
            "the picture is painted in the light of effects.caustics, which more rays a film pixel do not change; they "
            "are traced all the same, for maps. For a picture alone take it out; effects.footprint smooths its cells",
        )


def _environment_not_read(scene: Scene) -> Iterator[HardSpot]:
    if scene.environment != "picture" and scene.effects["fresnel"] != "split":
        yield HardSpot(
            "effects.environment", "not-read", 'nothing reflects it; only fresnel = "split" shows what lenses reflect'
        )


def _light_not_seen(scene: Scene) -> Iterator[HardSpot]:
    try:
        refuse_unseen(scene.wavelengths)
    except StudyError as error:
        yield HardSpot("effects.dispersion", "not-seen", error.problems[0].removeprefix("effects.dispersion: "))


def _film_rays(scene: Scene, pixels: NDArray[np.int64]) -> tuple[Points, Points]:
    """Return origins and directions, shape (N, 3), of the straight rays through the centres of some film pixels."""
    film = scene.film
    u, v = (pixels % film.columns + 0.5) / film.columns, (pixels // film.columns + 0.5) / film.rows
    right, down = np.asarray(film.right, dtype=np.float64), np.asarray(film.down, dtype=np.float64)
    on_film = np.asarray(film.corner, dtype=np.float64) + u[:, None] * right + v[:, None] * down
    if scene.source.at is not None:
        origins = np.broadcast_to(np.asarray(scene.source.at, dtype=np.float64), on_film.shape)
        return origins, on_film - origins
    return on_film, np.broadcast_to(np.asarray(scene.source.direction, dtype=np.float64), on_film.shape)


def _every(scene: Scene, most: int) -> NDArray[np.int64]:
    """Return film pixels, at most about so many, spread over the rows and columns."""
    stride = max(1, int(np.ceil(np.sqrt(scene.film.columns * scene.film.rows / most))))
    rows, columns = np.arange(0, scene.film.rows, stride), np.arange(0, scene.film.columns, stride)
    return (rows[:, None] * scene.film.columns + columns).ravel()


def _is_aimed_at(scene: Scene, lens: Placement, pixels: NDArray[np.int64]) -> bool:
    """Whether the line of any of these film rays, ahead of a point source, crosses a lens's box."""
    origins, directions = _film_rays(scene, pixels)
    origins, directions = lens.local(origins), directions @ lens.to_local.T
    directions = np.where(directions == 0.0, _NEVER_ZERO, directions)
    with np.errstate(over="ignore"):
        one, other = (lens.box[0] - origins) / directions, (lens.box[1] - origins) / directions
    enters, leaves = np.minimum(one, other).max(axis=1), np.maximum(one, other).min(axis=1)
    if scene.source.at is not None:
        enters = np.maximum(enters, 0.0)
    return bool((enters <= leaves).any())


def _normals(lens: Placement) -> Points:
    """Return the normals of a placed box's faces: the directions of its edges, as stretching comes before turning."""
    return lens.to_world.T


def _crossed(some: Points, others: Points) -> Points:
    return np.cross(some[:, None], others[None, :]).reshape(-1, 3)


def _overlap(some: Points, others: Points, axes: Points) -> bool:
    """Whether two convex figures meet, given their corners and every direction that might part them.

    Source: the separating axis theorem; Gottschalk, Lin & Manocha, OBBTree, SIGGRAPH 1996. An axis of length 0 (from
    parallel edges) parts nothing and does no harm.
    """
    one, other = some @ axes.T, others @ axes.T
    return bool(((one.min(axis=0) <= other.max(axis=0)) & (other.min(axis=0) <= one.max(axis=0))).all())


def _share(mask: NDArray[np.bool_]) -> str:
    return "all" if mask.all() else f"{max(0.1, 100.0 * mask.mean()):.1f} %"
