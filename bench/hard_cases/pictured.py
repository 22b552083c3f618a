"""Pictures on, in and before solids, and films and sources there: rays end on the picture where they meet it first."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from typing import Any

import numpy as np
import tomli_w
from random_arrangements import drawn

from hard_cases.aims import TINY, Rays, both_signs, from_afar, generator, joined, rays, unit
from hard_cases.scenes import GYROID, PLACED, Table, lens, scene, user
from lenscl.config import scene_from_toml
from lenscl.hardcases import Array, Case
from lenscl.tracing.start import locate_sets

_FAMILY, _EDITION = "pictures in glass", 4
_RAYS = 14
_DOME = lens("plano_convex", R=1.0, thickness=1.0, diameter=2.0, centre=[0.0, 0.0, -0.5], name="dome")
_SLAB = "max(abs(x) - 2, abs(y) - 2, abs(z) - 0.5)"
_BLOCK = "max(abs(x), abs(y), abs(z + 0.5)) - 0.5"  # its upper face lies at z = 0
_OTHER = "max(abs(x), abs(y), abs(z - 0.25) + 0.25) - 0.5"
_COUNTED = {"path_length": True}
_THROUGH_EDGES = {"flush": 4}  # the ray through an edge of an opaque solid: whichever face is met, it is blocked
_RANDOM = (
    "one in another",
    "overlap",
    "stacked slabs",
    "halves",
    "doublet",
    "lens on a window",
    "filled glass",
    "flush",
)


def cases() -> Iterator[Case]:
    """Yield them."""
    yield from _paperweights()
    yield from _apparent_depths()
    yield from _cut_solids()
    yield from _nested()
    yield from _contacts()
    yield from _edges()
    yield from _starts()
    yield from _asked()
    yield from _films()
    yield from _random()


def _case(name: str, why: str, text: str, some: Rays | None = None, **more: Any) -> Case:
    origins, directions = some or (None, None)
    return Case(
        name=f"pictures in glass: {name}", family=_FAMILY, why=why, scene=text, origins=origins, directions=directions,
        edition=_EDITION, **more,
    )  # fmt: skip


def _screen(z: float, half: float = 1.0, **more: Any) -> Table:
    """Return a square picture at a height, its edges at so much of the axis."""
    return {"corner": [-half, half, z], "right": [2 * half, 0.0, 0.0], "down": [0.0, -2 * half, 0.0], **more}


def _tilted(centre: list[float], right: list[float], down: list[float]) -> Table:
    corner = np.array(centre) - 0.5 * np.array(right) - 0.5 * np.array(down)
    return {"corner": corner.tolist(), "right": right, "down": down}


def _through(name: str, width: float, count: int = _RAYS, distance: float = 3.0) -> Rays:
    """Return rays from all sides through a cube about the origin."""
    random = generator(name)
    return from_afar(random.uniform(-width, width, (count, 3)), random.normal(size=(count, 3)), distance)


def _down(name: str, width: float, count: int = _RAYS, slant: float = 0.4, sign: float = -1.0) -> Rays:
    """Return rays down along z, or up, through a square at z = 0, from 3 before it."""
    random = generator(name)
    at = np.column_stack([random.uniform(-width, width, (count, 2)), np.zeros(count)])
    ahead = np.column_stack([random.uniform(-slant, slant, (count, 2)), np.full(count, sign)])
    return from_afar(at, ahead, 3.0)


def _paperweights() -> Iterator[Case]:
    """Rays come up through the dome, whose flat face lies at z = 0."""
    for gap in (0.0, 1e-12, -1e-12, 1e-9, -1e-9, 1e-3, -1e-3):
        where = "on its flat face" if gap == 0.0 else f"{gap:g} {'behind' if gap > 0 else 'before'} its flat face"
        name = f"half ball, {where}".replace("-", "", 1) if gap < 0 else f"half ball, {where}"
        why = "the picture lies on a face: rays end there, and do not pass it" if gap == 0.0 else "a gap is a gap"
        yield _case(name, why, scene(_DOME, picture=_screen(gap)), _down(name, 0.6, sign=1.0), keeps_contact=True)
    for name, turn in (("turned", [30.0, 0.0, 0.0]), ("turned anyhow", [25.0, -40.0, 110.0])):
        placed = scene_from_toml(scene(_DOME | {"centre": [0.0, 0.0, 0.0], "rotate": turn})).lenses[0]
        frame = _frame(placed.rotate)
        picture = _tilted(
            (frame @ [0.0, 0.0, 0.5]).tolist(), (1.6 * frame[:, 0]).tolist(), (1.6 * frame[:, 1]).tolist()
        )
        text = scene(_DOME | {"centre": [0.0, 0.0, 0.0], "rotate": turn}, picture=picture)
        origins, directions = _down(f"half ball {name}", 0.5, sign=1.0)
        yield _case(
            f"half ball, {name}, on its flat face",
            "face and picture are the same but for roundings of their numbers",
            text,
            (origins @ frame.T, directions @ frame.T),
            keeps_contact=True,
        )


def _frame(rotate: tuple[float, float, float]) -> Array:
    """Return the rotation of a lens, local to world."""
    (ca, cb, cc), (sa, sb, sc) = (f(np.radians(rotate)) for f in (np.cos, np.sin))
    x = np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]])
    y = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
    z = np.array([[cc, -sc, 0], [sc, cc, 0], [0, 0, 1]])
    turned: Array = z @ y @ x
    return turned


def _apparent_depths() -> Iterator[Case]:
    slab = user(_SLAB, [2.1, 2.1, 0.6], absorption=[0.3, 0.6, 1.2], name="slab")
    film = {"corner": [-0.6, 0.6, 2.0], "right": [1.2, 0.0, 0.0], "down": [0.0, -1.2, 0.0], "size": [4, 4]}
    for z, where in ((0.499, "just below the face"), (0.1, "in the middle"), (-0.5, "on its far face")):
        yield _case(
            f"slab, {where}",
            "path length and absorption count up to the picture, in the glass",
            scene(slab, picture=_screen(z, 1.5), film=film, effects=_COUNTED),
            counts_lengths=True, keeps_contact=z == -0.5,
        )  # fmt: skip
    for name, picture in (
        ("slab, half of it beside the glass", _tilted([2.0, 0.0, 0.1], [2.0, 0.0, 0.0], [0.0, -2.0, 0.0])),
        ("slab, tilted in it", _tilted([0.0, 0.0, 0.05], [1.4, 0.3, 0.4], [0.2, -1.6, 0.3])),
        ("slab, upright in it", _tilted([0.3, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, -0.8])),
        ("slab, upright and out of it", _tilted([0.3, 0.0, 0.2], [0.1, 2.0, 0.0], [0.0, 0.0, -2.4])),
    ):
        random = generator(name)
        aim = np.array(picture["corner"]) + random.uniform(-0.1, 1.1, (_RAYS, 2)) @ np.array(
            [picture["right"], picture["down"]]
        )
        ahead = np.column_stack([random.uniform(-0.6, 0.6, (_RAYS, 2)), -np.ones(_RAYS)])
        why = "the ray ends on the picture in whatever medium it is, or passes beside it"
        yield _case(name, why, scene(slab, picture=picture), from_afar(aim, ahead, 3.0))


def _cut_solids() -> Iterator[Case]:
    level, slope = _screen(0.1, 0.6), _tilted([0.05, 0.0, 0.1], [1.0, 0.2, 0.5], [0.1, -1.1, 0.3])
    for name, table in (
        ("ball", lens("sphere", r=0.5)),
        ("ring", lens("torus", R=0.5, r=0.2, **PLACED)),
        ("air bubble", lens("sphere", 1.0, r=0.5)),
        ("gyroid", user(GYROID, 1.1)),
        ("heart", lens("heart", stretch=[0.6, 0.6, 0.6])),
        ("opaque ring", lens("torus", R=0.5, r=0.2, absorbs=True)),
    ):
        for title, picture in (("level", level), ("tilted", slope)):
            where = f"cutting a solid, {name}, {title}"
            medium = 1.5 if name == "air bubble" else 1.0
            yield _case(
                where,
                "the picture cuts a solid: what comes first decides, surface or picture, after each reflection anew",
                scene(table, picture=picture, medium=medium, numerics={"max_events": 12}),
                _through(where, 0.4),
            )


def _nested() -> Iterator[Case]:
    ball, bubble = lens("sphere", r=0.5, name="ball"), lens("sphere", 1.0, r=0.4, name="bubble")
    resin = user("max(x^2 + y^2 - 0.49, abs(z) - 0.35)", 0.8, name="resin", absorption=[0.5, 0.7, 0.9])
    coin = user("max(x^2 + y^2 - 0.04, abs(z) - 0.05)", 0.3, name="coin", absorbs=True, rotate=[20.0, 10.0, 0.0])
    stain = lens("sphere", 1.4, r=0.3, name="stain", absorption=[2.0, 0.1, 1.0])
    film = {"corner": [-0.35, 0.35, 2.0], "right": [0.7, 0.0, 0.0], "down": [0.0, -0.7, 0.0], "size": [5, 5]}
    for name, lenses, picture in (
        ("in a bubble", (ball, bubble), _screen(0.1, 0.2)),
        ("in the wall of a bubble", (ball, bubble), _screen(0.45, 0.3)),
        ("cutting ball and bubble", (ball, bubble), _screen(-0.2, 0.6)),
        ("behind a coin in resin", (resin, coin), _screen(-0.2, 0.6)),
    ):
        yield _case(name, "a solid in a solid, with a picture", scene(*lenses, picture=picture), _through(name, 0.35))
    for name, first in (("a stain in resin", 0), ("a stain in resin that gives way", -1)):
        for z in (0.05, -0.33):
            yield _case(
                f"{name}, z = {z:g}",
                "each stretch is absorbed by the solid that is the medium there, the last one too",
                scene(resin, stain | {"priority": first}, picture=_screen(z, 0.6), film=film, effects=_COUNTED),
                counts_lengths=True,
            )
    yield _case(
        "absorbing solids that overlap",
        "each stretch is absorbed by the solid that is the medium there, without a picture in them too",
        scene(
            lens("sphere", r=0.5, name="left", centre=[-0.2, 0.0, 0.0], absorption=[1.0, 0.2, 0.5], priority=1),
            lens("sphere", r=0.5, name="right", centre=[0.2, 0.1, 0.0], absorption=[0.1, 1.5, 0.5]),
            film=film, effects=_COUNTED,
        ),
        counts_lengths=True,
    )  # fmt: skip


def _contacts() -> Iterator[Case]:
    below, above = user(_BLOCK, 1.1, name="below"), user(_OTHER, 1.1, 1.7, name="above")
    for name, lenses in (("two blocks", (below, above)), ("two blocks, the other first", (above, below))):
        for gap in (0.0, 1e-9, -1e-9):
            where = f"where {name} touch" if gap == 0.0 else f"{gap:+g} from where {name} touch"
            yield _case(
                where,
                "the picture lies on the interface of two solids: no event, wherever the ray comes from",
                scene(*lenses, picture=_screen(gap, 0.4)),
                joined(_down(where, 0.35, _RAYS // 2), _down(where, 0.35, _RAYS // 2, sign=1.0)),
                keeps_contact=True,
            )
    name = "a lenticular print"
    rods = [
        user("max(x^2 + z^2 - 0.09, abs(y) - 0.6, -z)", [0.4, 0.7, 0.4], centre=[x, 0.0, 0.0], name=f"rod{i}")
        for i, x in enumerate((-0.4, 0.2, 0.8))
    ]
    yield _case(
        name,
        "half cylinders overlap or stand apart, and lie flat on the picture",
        scene(*rods, picture=_screen(0.0)),
        _down(name, 0.5, _RAYS + 6),
        keeps_contact=True,
    )


def _edges() -> Iterator[Case]:
    beside = both_signs(TINY[::2])
    ahead = np.tile([0.0, 0.0, -1.0], (len(beside), 1))
    slab = user(_SLAB, [2.1, 2.1, 0.6], name="slab")
    edge = np.column_stack([0.5 + beside, np.full_like(beside, 0.1), np.full_like(beside, 3.0)])
    yield _case(
        "beside the picture's edge",
        "rays pass 1e-2 to 1e-12 on either side of an edge: they end on the picture, or go on through the slab",
        scene(slab, picture=_screen(0.1, 0.5)),
        rays(edge, ahead),
        keeps_contact=True,
    )
    slant = unit([-0.6, 0.05, -0.8])
    near = np.column_stack([0.3 + beside, np.full_like(beside, 0.1), np.full_like(beside, 0.5)])
    yield _case(
        "beside where it crosses a face",
        "rays meet the face and the picture that cuts it 1e-2 to 1e-12 apart, in either order",
        scene(slab, picture=_tilted([0.3, 0.0, 0.5], [0.0, 1.0, 0.0], [0.0, 0.0, -0.8])),
        from_afar(near, np.tile(slant, (len(near), 1)), 2.5),
        keeps_contact=True,
    )


def _starts() -> Iterator[Case]:
    slab = user(_SLAB, [2.1, 2.1, 0.6], name="slab")
    random = generator("starts")
    everywhere = unit(random.normal(size=(_RAYS, 3)))
    for name, at in (("from within, above it", [0.1, 0.2, 0.3]), ("from within, below it", [0.1, 0.2, -0.3])):
        yield _case(
            name,
            "the source lies in the glass with the picture: rays end on it at once, or are reflected first",
            scene(slab, picture=_screen(0.1, 0.8), numerics={"max_events": 8}),
            rays(at, everywhere),
        )
    yield _case(
        "from a face",
        "rays start on the slab's face, and go in or out; the picture lies in the slab",
        scene(slab, picture=_screen(0.1, 0.8)),
        rays([0.25, -0.125, 0.5], everywhere),
        starts_exactly=True,
    )
    off = np.array([1e-3, -1e-3, 1e-9, -1e-9, 1e-12, -1e-12])
    yield _case(
        "from beside the picture",
        "rays start 1e-3 to 1e-12 over or under the picture, in the glass, and go up and down",
        scene(slab, picture=_screen(0.0, 0.8)),
        rays(
            np.column_stack([np.full(12, 0.1), np.full(12, 0.2), np.tile(off, 2)]),
            np.repeat([[0.1, 0.2, 1.0], [0.1, 0.2, -1.0]], 6, axis=0),
        ),
        starts_exactly=True, keeps_contact=True,
    )  # fmt: skip


def _asked() -> Iterator[Case]:
    ball = lens("sphere", r=0.5)
    for stops in (True, False, "auto"):
        name = f"before a ball, stops = {str(stops).lower()}"
        why = "a picture that no solid reaches ends rays where it is told to, and else none before their last leg"
        yield _case(name, why, scene(ball, picture=_screen(1.0, 0.5, stops=stops)), _down("before a ball", 0.5))
    for stops in (True, "auto"):
        name = f"in a slab, stops = {str(stops).lower()}"
        slab = user(_SLAB, [2.1, 2.1, 0.6])
        yield _case(name, "both say the same", scene(slab, picture=_screen(0.1, stops=stops)), _down("in a slab", 1.2))
    name = "beside a ball that its plane cuts"
    picture = {"corner": [1.0, 1.0, 0.0], "right": [2.0, 0.0, 0.0], "down": [0.0, -2.0, 0.0]}
    yield _case(name, "a plane that is cut beside the parallelogram", scene(ball, picture=picture), _through(name, 0.5))


def _films() -> Iterator[Case]:
    slab = user(_SLAB, [2.1, 2.1, 0.6], name="slab")
    film = {"corner": [-0.4, 0.4, 0.5], "right": [0.8, 0.0, 0.0], "down": [0.0, -0.8, 0.0], "size": [4, 4]}
    for name, at, z, below in (
        ("a film on a face", [0.1, 0.0, 4.0], 0.5, 0.1),
        ("a film in the slab", [0.1, 0.0, 4.0], 0.3, 0.1),
        ("a film on the picture", [0.1, 0.0, 4.0], 0.1, 0.1),
        ("a source in the slab", [0.1, 0.0, 0.4], 0.3, 0.1),
        ("a source on the face", [0.1, 0.0, 0.5], 0.3, 0.1),
        ("a source under the picture", [0.1, 0.0, -0.2], 0.3, 0.1),
        ("a source on the picture", [0.1, 0.0, 0.1], 0.3, 0.1),
    ):
        yield _case(
            name,
            "film and source in the glass bend nothing: rays start along the line from source to pixel",
            scene(slab, source={"at": at}, film=film | {"corner": [-0.4, 0.4, z]}, picture=_screen(below, 0.8)),
            starts_exactly="source" in name,
        )
    name = "parallel light on half a ball"
    yield _case(
        name,
        "parallel light, which starts on a plane before everything",
        scene(
            _DOME, source={"kind": "parallel", "direction": [0.1, 0.05, 1.0]}, picture=_screen(-0.2, 0.8),
            film={"corner": [-0.8, 0.8, -2.0], "right": [1.6, 0.0, 0.0], "down": [0.0, -1.6, 0.0], "size": [5, 5]},
        ),
    )  # fmt: skip


def _random() -> Iterator[Case]:
    """Pictures anyhow through solids that touch or overlap."""
    for number, name in enumerate(_RANDOM):
        one = drawn(4000 + number, number, _RAYS, name)
        _, on = locate_sets(one.scene, one.origins)
        clear = np.flatnonzero(on == 0)
        clear = np.delete(clear, [_THROUGH_EDGES[name]] if name in _THROUGH_EDGES else [])
        random = generator(f"pictures in glass: {name}")
        u, v = np.linalg.qr(random.normal(size=(3, 2)))[0].T
        tables = tomllib.loads(one.text)
        middle = np.mean([table["centre"] for table in tables["lens"]], axis=0) + random.uniform(-0.1, 0.1, 3)
        tables["picture"] = _tilted(middle.tolist(), (0.9 * u).tolist(), (0.9 * v).tolist())
        yield _case(
            f"among solids, {name}",
            "a picture anyhow through solids that touch, overlap, or lie in one another",
            tomli_w.dumps(tables),
            (one.origins[clear], one.directions[clear]),
            keeps_contact=name not in ("one in another", "overlap"),
        )
