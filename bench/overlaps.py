"""Scenes whose solids lie in one another, touch and overlap: for `validate_error_map.py`, which judges their bounds.

`arrangements` are those that people build. `overlaps` are drawn at random: two to four solids in any arrangement, some
of whose F lose digits to constants that cancel. `cements` are stacks of such solids with faces in common, some of them
far from the origin, or with a solid of lower priority in them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from long_paths import noisy

from lenscl.config import Scene

Rng = np.random.Generator
Lens = dict[str, Any]

_SIDE = 128  # of the films, in pixels
_CUBE = "max(max(abs(x), abs(y), abs(z)) - s, x - z)"


def _scene(*lenses: Lens, **changes: Any) -> Scene:
    from validate_error_map import made

    named = [{"name": f"lens{i}", **lens} for i, lens in enumerate(lenses)]
    return made(*named, **{"film.size": [_SIDE, _SIDE], "numerics.max_events": 24} | changes)


def _bounds(side: float, height: float) -> dict[str, Any]:
    return {"bounds": [[-side, -side, -height], [side, side, height]]}


def arrangements() -> Iterator[tuple[str, Scene]]:
    """Yield the scenes by name."""
    ball: Lens = {"surface": "sphere", "r": 0.6, "n": 1.5}
    turned = {"rotate": [20.0, 30.0, 10.0]}
    yield "bubble in a ball", _scene(ball, {"surface": "sphere", "r": 0.4, "centre": [0.1, 0.05, 0.0], "n": 1.0})
    yield "bubble of priority", _scene({**ball, "r": 0.4, "n": 1.0, "priority": 1}, ball)
    singlet: Lens = {"surface": "conic_singlet", "diameter": 1.2}
    yield (
        "cemented doublet",
        _scene(
            {**singlet, "c1": 0.4, "c2": -0.5, "thickness": 0.3, "centre": [0.0, 0.0, -0.15], "n": 1.5168},
            {**singlet, "c1": -0.5, "c2": -0.15, "thickness": 0.2, "centre": [0.0, 0.0, 0.1], "n": 1.6727},
            **{"picture.centre": [0.0, 0.0, -1.2]},
        ),
    )
    yield "cemented doublet, turned", _scene(
        {**singlet, **turned, "c1": 0.4, "c2": -0.5, "thickness": 0.3, "n": 1.5168},
        {**singlet, **turned, "c1": -0.5, "c2": -0.15, "thickness": 0.2, "n": 1.6727,
         "centre": _turned(turned["rotate"], [0.0, 0.0, 0.25])},
    )  # fmt: skip
    half: Lens = {"surface": _CUBE, "s": 0.5, **_bounds(0.55, 0.55), "n": 1.5}
    yield "prism cube", _scene(half, {**half, "rotate": [0.0, 180.0, 0.0]})
    yield (
        "prism cube of two glasses, turned",
        _scene({**half, **turned}, {**half, "surface": _CUBE.replace("x - z", "z - x"), "n": 1.8, **turned}),
    )
    coin: Lens = {"surface": "max(x**2 + y**2 - 0.04, abs(z) - 0.03)", **_bounds(0.25, 0.1), "n": 1.0, "absorbs": True}
    block: Lens = {"surface": "max(max(abs(x), abs(y)) - 0.6, abs(z) - 0.3)", **_bounds(0.7, 0.4), "n": 1.55}
    yield "coin in resin", _scene({**block, **turned}, {**coin, "centre": [0.1, 0.0, 0.1], "rotate": [0.0, 20.0, 0.0]})
    hollow = "max(x**2 + y**2 - 0.25, abs(z) - 0.6, min(0.16 - x**2 - y**2, z + 0.5))"
    yield (
        "liquid in a glass",
        _scene(
            {"surface": hollow, **_bounds(0.6, 0.7), "n": 1.5},
            {"surface": "max(x**2 + y**2 - 0.16, abs(z + 0.1) - 0.4)", **_bounds(0.5, 0.55), "n": 1.33},
        ),
    )
    yield (
        "liquid that overlaps its glass",
        _scene(
            {"surface": "max(x**2 + y**2 - 0.2, abs(z + 0.1) - 0.45)", **_bounds(0.5, 0.6), "n": 1.33},
            {"surface": hollow, **_bounds(0.6, 0.7), "n": 1.5},
        ),
    )
    rod: Lens = {"surface": "max(x**2 + y**2 - r**2, abs(z) - 1)", **_bounds(0.5, 1.1)}
    rod |= {"rotate": [0.0, 12.0, 0.0]}
    film = {"film.right": [0.5, 0.0, 0.0], "film.down": [0.0, -0.5, 0.0]}
    yield "fibre with its cladding", _scene({**rod, "r": 0.3, "n": 1.45}, {**rod, "r": 0.2, "n": 1.6}, **film)
    window: Lens = {"surface": "max(max(abs(x), abs(y)) - 0.7, abs(z) - t)", **_bounds(0.8, 0.4)}
    yield "three stacked windows", _scene(
        {**window, "t": 0.1, "n": 1.5}, {**window, "t": 0.2, "centre": [0.0, 0.0, 0.3], "n": 1.7},
        {**window, "t": 0.05, "centre": [0.0, 0.0, -0.15], "n": 1.5},
    )  # fmt: skip
    yield "ring within a ball of priority", _scene(
        {"surface": "torus", "R": 0.4, "r": 0.15, **turned, "n": 1.8}, {**ball, "n": 1.4, "priority": 1.0},
        {"surface": "torus", "R": 0.5, "r": 0.2, "n": 1.6, "priority": 0.5},
    )  # fmt: skip
    yield "bubble far from the origin", _far((1e4, -7e3, 3e3))


def _far(by: tuple[float, float, float]) -> Scene:
    def at(x: float, y: float, z: float) -> list[float]:
        return [x + by[0], y + by[1], z + by[2]]

    places = {"source.at": at(0, 0, 4), "film.centre": at(0, 0, 2.5), "picture.centre": at(0, 0, -2.5)}
    ball: Lens = {"surface": "sphere", "r": 0.6, "n": 1.5, "centre": at(0, 0, 0)}
    ring: Lens = {"surface": "torus", "R": 0.3, "r": 0.12, "rotate": [40.0, 20.0, 0.0], "n": 1.2, "centre": at(0, 0, 0)}
    return _scene(ball, ring, **places)


def _turned(degrees: list[float], vector: list[float]) -> list[float]:
    """Return a vector as `rotate` turns it."""
    a, b, c = np.radians(degrees)
    about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    about_z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    return [float(x) for x in about_z @ about_y @ about_x @ vector]


def overlaps(count: int, seed: int) -> Iterator[tuple[str, Scene]]:
    """Yield so many scenes, drawn at random; the first has a solid of which F loses digits, as has every third."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        solids = [_solid(rng, i) for i in range(int(rng.integers(2, 5)))]
        if number % 3 == 0:
            k = float(10.0 ** rng.uniform(2.0, 5.0))
            place = {"centre": solids[0]["centre"], "rotate": solids[0]["rotate"], "n": solids[0]["n"]}
            solids[int(rng.integers(len(solids)))] = {**noisy(rng, 0.5, k), **place}
        yield f"overlap {number}", _scene(*solids)


def _solid(rng: Rng, number: int) -> Lens:
    shapes: tuple[Lens, ...] = (
        {"surface": "sphere", "r": float(rng.choice([0.3, 0.4, 0.5]))},
        {"surface": "torus", "R": 0.4, "r": 0.15},
        {"surface": "ellipsoid", "a": 0.6, "b": 0.4, "c": 0.5},
        {"surface": "max(abs(x), abs(y), abs(z)) - 0.3", **_bounds(0.4, 0.4)},
        {"surface": "max(x**2 + y**2 - 0.09, abs(z) - 0.25)", **_bounds(0.4, 0.4)},
        {"surface": "x**4 + y**4 + z**4 - 0.03", **_bounds(0.5, 0.5)},
        {"surface": "heart", "stretch": [0.4, 0.4, 0.4]},
    )
    centre = np.zeros(3) if rng.random() < 0.25 else np.round(rng.uniform(-0.3, 0.3, 3), 2)
    angles = rng.choice([0.0, 30.0, 45.0, 90.0], 3) if rng.random() < 0.5 else np.zeros(3)
    lens: Lens = {
        **shapes[int(rng.integers(len(shapes)))],
        "name": f"lens{number}",
        "centre": [float(x) for x in centre],
        "rotate": [float(x) for x in angles],
        "n": float(rng.choice([1.0, 1.3, 1.5, 1.5, 1.7])),
    }
    if rng.random() < 0.3:
        lens["priority"] = float(rng.choice([-1.0, 1.0, 2.0]))
    return lens


def cements(count: int, seed: int) -> Iterator[tuple[str, Scene]]:
    """Yield so many scenes, drawn at random, of solids that touch along faces."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        is_far, is_turned, is_noisy, has_more = rng.random(4) < (0.3, 0.5, 0.4, 0.5)
        by = 10.0 ** rng.uniform(1.0, 5.0) * rng.uniform(-1.0, 1.0, 3) if is_far else np.zeros(3)
        rotate = [float(x) for x in np.round(rng.uniform(-25.0, 25.0, 3), 1)] if is_turned else [0.0] * 3
        lenses = _stack(rng, by, rotate, float(10.0 ** rng.uniform(1.0, 5.0)) if is_noisy else 0.0)
        if has_more:
            more = {**_solid(rng, len(lenses)), "priority": -1.0}
            lenses.append({**more, "centre": [float(x) for x in np.add(more["centre"], by)]})

        def at(z: float, by: np.ndarray = by) -> list[float]:
            return [float(x) for x in np.add(by, (0.0, 0.0, z))]

        places = {"source.at": at(4.0), "film.centre": at(2.5), "picture.centre": at(-2.5)}
        yield f"cement {number}", _scene(*lenses, **places)


def _stack(rng: Rng, by: np.ndarray, rotate: list[float], k: float) -> list[Lens]:
    """Return two or three solids between faces (z - a) = c (x^2 + y^2) / 2, one below the other; k costs F digits."""
    count = int(rng.integers(2, 4))
    heights = np.sort(np.round(rng.uniform(-0.4, 0.4, count + 1), 2))[::-1] + 0.15 * np.arange(count, -count - 2, -2)
    curvatures = np.round(rng.uniform(-0.5, 0.5, count + 1), 2) * (rng.random(count + 1) < 0.7)
    face = "(z + k) - k - a{i} - c{i}*(x**2 + y**2)/2"
    text = f"max({face.format(i=0)}, -({face.format(i=1)}), x**2 + y**2 - 0.3)"
    common = {"surface": text, "k": k, **_bounds(0.6, 2.0), "rotate": rotate, "centre": [float(x) for x in by]}
    return [
        {**common, "a0": float(heights[i]), "c0": float(curvatures[i]), "a1": float(heights[i + 1]),
         "c1": float(curvatures[i + 1]), "n": float(rng.choice([1.3, 1.5, 1.5, 1.7, 2.4]))}
        for i in range(count)
    ]  # fmt: skip
