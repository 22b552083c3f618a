"""The singular places of heart, bifolia and torus."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hard_cases.aims import (
    TINY,
    Rays,
    aimed_case,
    both_signs,
    down_on,
    from_afar,
    generator,
    joined,
    rays,
    tangents,
    unit,
)
from hard_cases.scenes import lens, scene
from lenscl.config import scene_from_toml
from lenscl.hardcases import Array, Case

_FEW = {"max_events": 8}
_UPRIGHT = {"corner": [6.0, -40.0, 40.0], "right": [0.0, 80.0, 0.0], "down": [0.0, 0.0, -80.0]}


def cases() -> Iterator[Case]:
    """Yield them."""
    yield from _heart()
    yield from _bifolia()
    yield from _torus()


def _about(point: tuple[float, float, float], random: np.random.Generator, sizes: Array, each: int) -> Rays:
    """Return rays past a point at given distances, from all round."""
    count = len(sizes) * each
    beside = np.asarray(point) + np.repeat(sizes, each)[:, None] * unit(random.normal(size=(count, 3)))
    return from_afar(beside, random.normal(size=(count, 3)), 4.0)


def _flat(random: np.random.Generator, heights: Array) -> Rays:
    """Return horizontal rays at heights z, towards the upright picture, past the axis."""
    turn = random.uniform(-1.0, 1.0, len(heights))
    along = np.column_stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)])
    aside = random.uniform(-0.6, 0.6, len(heights))
    through = aside[:, None] * np.column_stack([-along[:, 1], along[:, 0], 0.0 * turn]) + heights[:, None] * [0, 0, 1]
    return rays(through - 3.0 * along, along)


def _heart() -> Iterator[Case]:
    text, upright = (scene(lens("heart"), numerics=_FEW, picture=picture) for picture in (None, _UPRIGHT))
    name = "heart: the plane z = 0"
    yield aimed_case(
        name,
        "heart",
        "in the plane z = 0 the printed polynomial has a triple root and no gradient",
        upright,
        _flat(generator(name), np.zeros(100)),
    )
    name = "heart: beside the plane z = 0"
    heights = np.repeat(np.concatenate([10.0 ** -np.arange(2.0, 9.0), -(10.0 ** -np.arange(2.0, 9.0))]), 10)
    yield aimed_case(
        name, "heart", "|z| of 1e-2 to 1e-8: three roots of the printed polynomial meet", upright,
        _flat(generator(name), heights),
    )  # fmt: skip
    for title, point in (("dimple", (0.0, 0.0, 1.0)), ("tip", (0.0, 0.0, -1.0))):
        name = f"heart: the {title}"
        yield aimed_case(
            name,
            "heart",
            f"rays pass the cusp of the {title} at 1e-2 to 1e-12, where the surface has no normal",
            text,
            _about(point, generator(name), TINY, 12),
        )
    yield aimed_case(
        "heart: beside the axis",
        "heart",
        "rays down the axis through dimple and tip, 1e-2 to 1e-12 beside it",
        text,
        rays(np.column_stack([TINY, 0.5 * TINY, np.full_like(TINY, 3.0)]), [0.0, 0.0, -1.0]),
    )
    name = "heart: the folds beside the dimple"
    random = generator(name)
    place = np.column_stack([random.uniform(-0.15, 0.15, (150, 2)), random.uniform(1.0, 1.15, 150)])
    slant = np.column_stack([random.normal(size=(150, 2)), random.uniform(-0.4, 0.1, 150)])
    yield aimed_case(
        name, "heart", "rays skim the two humps on either side of the dimple", text, from_afar(place, slant, 3.0)
    )


def _bifolia() -> Iterator[Case]:
    text = scene(lens("bifolia"), numerics=_FEW)
    axis = np.column_stack([np.zeros(4), [2.0, 3.0, -1.0, -2.0], np.zeros(4)])
    yield aimed_case(
        "bifolia: the axis",
        "bifolia",
        "along its axis F has a root of multiplicity four at the pinch, and never changes sign",
        text,
        rays(axis, np.array([[0, -1, 0], [0, -1, 0], [0, 1, 0], [0, 1, 0]])),
    )
    name = "bifolia: the plane y = 0"
    random = generator(name)
    turn, aside = random.uniform(0, 2 * np.pi, 100), random.uniform(-0.9, 0.9, 100)
    along = np.column_stack([np.cos(turn), 0 * turn, np.sin(turn)])
    through = aside[:, None] * np.column_stack([-along[:, 2], 0 * turn, along[:, 0]])
    yield aimed_case(
        name,
        "bifolia",
        "in the plane y = 0 the solid is a single point, and F is its distance from it to the fourth",
        text,
        rays(through - 3.0 * along, along),
    )
    for size in (1e-2, 1e-4, 1e-6):
        name = f"bifolia: {size:g} from the pinch"
        yield aimed_case(
            name,
            "bifolia",
            "rays are aimed beside the point where the ring closes",
            text,
            _about((0.0, 0.0, 0.0), generator(name), np.array([size]), 100),
        )
    name = "bifolia: down the funnel"
    random = generator(name)
    target = 0.05 * random.uniform(-1, 1, (150, 3)) * [1, 0, 1]
    start = np.column_stack([random.uniform(-0.4, 0.4, 150), np.full(150, 2.0), random.uniform(-0.4, 0.4, 150)])
    yield aimed_case(
        name,
        "bifolia",
        "rays go down the funnel towards the pinch, and meet its walls again and again",
        scene(lens("bifolia"), numerics={"max_events": 12}),
        rays(start, target - start),
    )


def _torus() -> Iterator[Case]:
    few = {"numerics": _FEW}
    name = "torus: through the hole"
    random = generator(name)
    at = random.uniform(-0.3, 0.3, (100, 2))
    yield aimed_case(
        name,
        "torus",
        "rays through the hole: complex roots come close to the ray without a real one",
        scene(lens("torus"), **few),
        rays(np.column_stack([at, np.full(100, 3.0)]), np.column_stack([0.02 * at, np.full(100, -1.0)])),
    )
    yield aimed_case(
        "torus: the axis",
        "torus",
        "along its axis the ring's printed form has no gradient, and nothing is met",
        scene(lens("torus"), **few),
        rays([[0.0, 0.0, 3.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]], [[0, 0, -1], [0, 0, -1], [0, 0, -2]]),
        is_exact=True,
    )
    for title, radius in (("inner", 0.5), ("outer", 1.0)):
        beside = radius + both_signs(TINY)[both_signs(TINY) != 0]
        turn = generator(f"torus {title}").uniform(-1.0, 1.0, (5, 1)) - 0.5 * np.pi
        out = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1).reshape(5, 1, 3)
        along = np.stack([-np.sin(turn), np.cos(turn), 0 * turn], axis=-1).reshape(5, 1, 3)
        yield aimed_case(
            f"torus: tangent to the {title} equator",
            "torus",
            "rays in the plane of the ring pass its equator at 1e-2 to 1e-12",
            scene(lens("torus", R=0.75, r=0.25), picture=_UPRIGHT, **few),
            from_afar(beside[None, :, None] * out, np.broadcast_to(along, (5, len(beside), 3)), 4.0),
        )
    name = "torus: all four roots"
    random = generator(name)
    ahead = np.column_stack([np.ones(100), random.uniform(-0.1, 0.1, (100, 2))])
    yield aimed_case(
        name,
        "torus",
        "rays across the whole ring meet the tube twice, and leave it twice",
        scene(lens("torus", n=1.05), **few),
        from_afar(random.uniform(-0.1, 0.1, (100, 3)), ahead, 4.0),
    )
    for title, ring, tube in (("R = r", 0.5, 0.5), ("R < r: a spindle", 0.3, 0.6)):
        text = scene(lens("torus", R=ring, r=tube), **few)
        name = f"torus: {title}"
        random = generator(name)
        yield aimed_case(
            name,
            "torus",
            "the ring closes: there is a singular point on the axis, or a second sheet inside",
            text,
            joined(
                down_on(random, 100, 0.9),
                _about((0.0, 0.0, float(np.sqrt(max(tube**2 - ring**2, 0.0)))), random, TINY[:5], 12),
            ),
        )
    for tube in (1e-2, 1e-4, 1e-6):
        name = f"torus: a tube of {tube:g}"
        text = scene(lens("torus", R=0.7, r=tube), **few)
        offsets = tube * np.array([-0.9, -0.5, -0.1, 0.1, 0.5])
        yield aimed_case(
            name,
            "torus",
            "the tube is a thread: the quartic's terms cancel to its square",
            text,
            tangents(scene_from_toml(text).lenses[0], generator(name), 20, offsets, 3.0),
        )
    for ring, tube in ((1e3, 1e-2), (1e5, 1.0)):
        name = f"torus: R = {ring:g}, r = {tube:g}"
        text = scene(lens("torus", R=ring, r=tube, centre=[-ring, 0.0, 0.0]), **few)
        name_random = generator(name)
        turn = name_random.uniform(0, 2 * np.pi, (100, 1))
        at = tube * np.sqrt(name_random.random((100, 1))) * np.hstack([np.cos(turn), 0 * turn, np.sin(turn)])
        yield aimed_case(
            name,
            "torus",
            "ring and tube are five orders of magnitude apart",
            text,
            from_afar(at, np.array([0.0, 1.0, 0.0]) + 0.3 * name_random.normal(size=(100, 3)), 10 * tube),
        )
