"""Screens: parallel to the ray, edge-on, behind, sheared, mirrored; ties at pixel edges; films of one pixel or row."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hard_cases.aims import TINY, aimed_case, both_signs, down_on, generator, rays
from hard_cases.scenes import PLACED, Table, lens, scene
from lenscl.hardcases import Case


def cases() -> Iterator[Case]:
    """Yield them."""
    yield from _planes()
    yield from _spans()
    yield from _edges()
    yield from _films()


def _screen(corner: list[float], right: list[float], down: list[float]) -> Table:
    return {"corner": corner, "right": right, "down": down}


_FAR = lens("sphere", r=0.1, centre=[50.0, 50.0, 50.0])  # a lens that nothing is aimed at


def _planes() -> Iterator[Case]:
    upright = _screen([0.0, -4.0, 4.0], [0.0, 8.0, 0.0], [0.0, 0.0, -8.0])
    places = np.column_stack([np.linspace(-1.0, 1.0, 20), np.linspace(-0.5, 0.7, 20), np.full(20, 4.0)])
    yield aimed_case(
        "screens: parallel to the ray",
        "screens",
        "rays run along the picture's plane, beside it, and never meet it",
        scene(_FAR, picture=upright),
        rays(places, [0.0, 0.0, -1.0]),
        is_exact=True,
    )
    tilt = both_signs(10.0 ** -np.arange(1.0, 13.0))
    tilt = tilt[tilt != 0]
    yield aimed_case(
        "screens: edge-on",
        "screens",
        "rays meet the plane at 1e-1 to 1e-12 radians, far away or never",
        scene(_FAR, picture=upright),
        rays([0.5, 0.25, 4.0], np.column_stack([-tilt, 0.0 * tilt, -np.ones_like(tilt)])),
    )
    name = "screens: behind"
    yield aimed_case(
        name,
        "screens",
        "the picture lies behind the rays, and only what is turned round meets it",
        scene(lens("torus", 2.0, **PLACED), picture=_screen([-4.0, 4.0, 6.0], [8.0, 0.0, 0.0], [0.0, -8.0, 0.0])),
        down_on(generator(name), 120, 0.9),
    )
    yield aimed_case(
        "screens: nearly beyond reach",
        "screens",
        "coordinates of 2^86 to 2^106, exactly: beyond 1e30 a ray counts as one that never meets the plane",
        scene(_FAR, picture=upright),
        rays([0.5, 0.25, 4.0], np.column_stack([-(2.0 ** -np.arange(90.0, 111.0)), np.zeros(21), -np.ones(21)])),
        is_exact=True,
    )


def _spans() -> Iterator[Case]:
    spans = {
        "nearly parallel": ([8.0, 0.0, 0.0], [8.0, -1e-6, 0.0]),
        "very nearly parallel": ([8.0, 0.0, 0.0], [8.0, -1e-10, 0.0]),
        "sheared": ([8.0, 3.0, 1.0], [5.0, -2.0, 0.5]),
        "mirrored": ([-8.0, 0.0, 0.0], [0.0, 8.0, 0.0]),
        "of very different length": ([1e4, 0.0, 0.0], [0.0, -1e-4, 0.0]),
    }
    for title, (right, down) in spans.items():
        name = f"screens: spans {title}"
        corner = [-0.5 * (a + b) for a, b in zip(right, down, strict=True)]
        yield aimed_case(
            name,
            "screens",
            "the picture's spans are far from being square and upright",
            scene(lens("sphere", **PLACED), picture=_screen([*corner[:2], corner[2] - 3.0], right, down)),
            down_on(generator(name), 80, 0.9),
        )


def _edges() -> Iterator[Case]:
    """Rays straight down on a picture of 8 x 8 units: (s, t) are multiples of 1/64, exactly."""
    steps = np.arange(0.0, 65.0, 4.0) / 8.0
    x, y = (each.ravel() for each in np.meshgrid(steps, steps))
    yield aimed_case(
        "screens: ties at pixel edges",
        "screens",
        "s and t are exact: 0 belongs to the picture, 1 does not, and every tie to the pixel that begins there",
        scene(_FAR),
        rays(np.column_stack([x - 4.0, 4.0 - y, np.full_like(x, 2.0)]), [0.0, 0.0, -1.0]),
        is_exact=True,
    )
    beside = both_signs(TINY)
    ones = np.ones_like(beside)
    at = [
        np.column_stack([-4.0 + beside, 0.5 * ones, 2.0 * ones]),
        np.column_stack([4.0 + beside, 0.5 * ones, 2.0 * ones]),
    ]
    yield aimed_case(
        "screens: beside the edge",
        "screens",
        "rays land 1e-2 to 1e-12 on either side of the picture's edges",
        scene(_FAR),
        rays(np.concatenate(at), [0.0, 0.0, -1.0]),
    )


def _films() -> Iterator[Case]:
    yield Case(
        name="screens: a film through the source",
        family="screens",
        why="the source lies on the middle pixel, whose ray has no direction, and on the film's plane",
        scene=scene(
            lens("sphere", r=0.6),
            film={"corner": [-0.3125, 0.0, 6.5], "right": [0.625, 0.0, 0.0], "down": [0.0, 0.0, -5.0], "size": [5, 5]},
        ),
    )
    for columns, rows in ((1, 1), (1, 17), (19, 1), (3, 7), (7, 3)):
        yield Case(
            name=f"screens: a film of {columns} x {rows}",
            family="screens",
            why="films of one pixel, row or column, and no square ones",
            scene=scene(
                lens("torus", **PLACED),
                film={
                    "corner": [-0.6, 0.4, 2.0],
                    "right": [1.0, 0.1, 0.0],
                    "down": [0.1, -0.9, 0.2],
                    "size": [columns, rows],
                },
            ),
        )
    for title, direction in (("straight", [0.0, 0.0, -1.0]), ("slanting, not unit", [3.0, -1.0, -7.0])):
        yield Case(
            name=f"screens: parallel light, {title}",
            family="screens",
            why="rays start on a plane before everything, each through its own film pixel",
            scene=scene(
                lens("heart", **PLACED),
                source={"kind": "parallel", "direction": direction},
                film={"corner": [-1.0, 1.0, 2.0], "right": [2.0, 0.0, 0.0], "down": [0.0, -2.0, 0.0], "size": [12, 9]},
            ),
        )
