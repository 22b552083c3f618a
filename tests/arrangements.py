"""Solids in solids, overlapping and in contact, that several test modules share; lenses for `scenes.make_scene`."""

from __future__ import annotations

from typing import Any

import numpy as np
from scenes import make_scene

from lenscl.config import Scene

Tables = list[dict[str, Any]]

_HALF = 0.35  # of the cubes


def bubble(n: float = 1.0, **inner: Any) -> Tables:
    """Return a ball of glass with a ball of something else in it, off its centre."""
    outer = {"surface": "sphere", "name": "glass", "r": 0.5, "n": 1.5}
    return [outer, {"surface": "sphere", "name": "bubble", "r": 0.2, "centre": [0.1, 0.05, 0.1], "n": n} | inner]


def doublet() -> Tables:
    """Return two singlets cemented at a face of one curvature."""
    one = {"surface": "conic_singlet", "c1": 0.9, "c2": -1.1, "thickness": 0.5, "diameter": 0.9}
    other = {"surface": "conic_singlet", "c1": -1.1, "c2": -0.2, "thickness": 0.25, "diameter": 0.9}
    return [
        one | {"name": "crown", "n": 1.5168, "centre": [0.0, 0.0, 0.0], "rotate": [180.0, 0.0, 0.0]},
        other | {"name": "flint", "n": 1.6727, "centre": [0.0, 0.0, -0.375], "rotate": [180.0, 0.0, 0.0]},
    ]


def stack(gap: float = 0.0) -> Tables:
    """Return two slabs of glass, one on the other or a gap apart, along z."""
    slab = {"surface": "max(abs(x), abs(y), abs(z)) - h", "h": _HALF, "bounds": [[-0.4] * 3, [0.4] * 3]}
    return [
        slab | {"name": "upper", "centre": [0.0, 0.0, _HALF + gap], "n": 1.7},
        slab | {"name": "lower", "centre": [0.0, 0.0, -_HALF], "n": 1.5},
    ]


def drawn(rng: np.random.Generator) -> Scene:
    """Return a scene of two to four solids, drawn at random, of which most overlap, and some lie in others."""
    return make_scene(*(_solid(rng, number) for number in range(int(rng.integers(2, 5)))))


def _solid(rng: np.random.Generator, number: int) -> dict[str, Any]:
    shapes: Tables = [
        {"surface": "sphere", "r": float(rng.choice([0.15, 0.3, 0.5]))},
        {"surface": "torus", "R": 0.4, "r": 0.15},
        {"surface": "ellipsoid", "a": 0.5, "b": 0.3, "c": 0.4},
        {"surface": "max(abs(x), abs(y), abs(z)) - 0.3", "bounds": [[-0.4] * 3, [0.4] * 3]},
        {"surface": "max(x^2 + y^2 - 0.09, abs(z) - 0.25)", "bounds": [[-0.4] * 3, [0.4] * 3]},
    ]
    shape = shapes[int(rng.integers(len(shapes)))]
    stand = {
        "centre": np.round(rng.uniform(-0.25, 0.25, 3), 2).tolist(),
        "rotate": rng.choice([0.0, 30.0, 45.0, 90.0], 3).tolist(),
    }
    rank = {"priority": float(rng.choice([-1.0, 1.0, 2.0]))} if rng.random() < 0.4 else {}
    opaque = {"absorbs": True} if rng.random() < 0.1 else {}
    return shape | stand | rank | opaque | {"name": f"s{number}", "n": float(rng.choice([1.0, 1.3, 1.5, 1.7]))}
