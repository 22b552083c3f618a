"""Moves of rays by what is rounded: the size of a scene's numbers, and the directions of the moves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
from lenscl.tracing import world_boxes

Array = NDArray[np.float64]

# The corners of a regular simplex: whatever decides a path, one of five moves goes a quarter of its length against it;
# and along any direction the squares of the five add up to 4
_LAST = 1.0 / np.sqrt(5.0)
MOVES = (
    (1.0, 1.0, 1.0, -_LAST),
    (1.0, -1.0, -1.0, -_LAST),
    (-1.0, 1.0, -1.0, -_LAST),
    (-1.0, -1.0, 1.0, -_LAST),
    (0.0, 0.0, 0.0, 4.0 * _LAST),
)


def reach(scene: Scene) -> float:
    """Return the largest coordinate of the lenses: a hit is computed from numbers of that size."""
    return float(np.abs(world_boxes(scene.lenses)).max()) if len(scene.lenses) else 0.0


def moves(units: Array) -> Iterator[tuple[Array, Array]]:
    """Yield moves of origins and of unit directions, across them, by one unit of each of the four numbers of a ray."""
    u, v = _across(units)
    (a, b), (c, d) = ((x * u + y * v, x * v - y * u) for x, y in _angles(units))
    for first, second, third, fourth in MOVES:
        yield first * a + second * b, third * c + fourth * d


def _across(units: Array) -> tuple[Array, Array]:
    """Return two unit vectors across each direction and each other (Duff et al., JCGT 6(1), 2017)."""
    x, y, z = units.T
    sign = np.where(z < 0.0, -1.0, 1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    u = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=1)
    v = np.stack([b, sign + y * y * a, -y], axis=1)
    return u, v


def _angles(units: Array) -> Iterator[tuple[Array, Array]]:
    """Yield cosine and sine of two angles a ray, which follow no symmetry of a scene and are the same every time."""
    odd = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)
    mixed = (np.ascontiguousarray(units).view(np.uint64) * odd).sum(axis=1, dtype=np.uint64)
    for factor in odd[:2]:
        angle = 2.0 * np.pi * ((mixed * factor) >> np.uint64(11)) / 2.0**53
        yield np.cos(angle)[:, None], np.sin(angle)[:, None]
