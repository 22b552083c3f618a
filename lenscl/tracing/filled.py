"""What a solid fills, as bounds of its F tell: cells that may hold it, a box, a ball, how far it goes in a direction.

All is about a lens's solid at the origin, `Lens.solid`, and so is found once for all lenses that share it.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens
from lenscl.expr import bounds, evaluate
from lenscl.lenses import Vec3
from lenscl.tracing.placement import Placement

_MOST_CELLS = 2**12  # that are left at a time
_MOST_STEPS = 120  # each halves one side of every cell
_MOST_FRONT = 2**10  # cells that are parted on, where the farthest point of a solid is sought
_PARTINGS = 90
_MARGIN = 1e-12  # of the lengths at hand: far more than rounding loses
_ROUNDINGS = 4 * 2.0**-52  # by which semi-axes of a sphere may seem to differ

Array = NDArray[np.float64]


def extent(lens: Lens) -> tuple[Array, Array]:
    """Return the corners of a box in the lens's space that holds all that bounds do not exclude from the solid.

    A user's box may be far larger than the solid in it.
    """
    return _extent(lens.solid)


@lru_cache(maxsize=4096)
def _extent(solid: Lens) -> tuple[Array, Array]:
    low, high = Placement.of(solid).box
    found = _cells(solid)
    if found is None:
        return low, high
    middles, half = found
    return np.maximum(low, middles.min(axis=0) - half), np.minimum(high, middles.max(axis=0) + half)


def _cells(solid: Lens) -> tuple[Array, Array] | None:
    """Return the middles of the cells that bounds do not exclude from a solid, and their half sides; None for none."""
    low, high = Placement.of(solid).box
    middles, half = ((low + high) / 2)[None], (high - low) / 2
    for step in range(_MOST_STEPS):
        keeps = may_hold(solid, middles, np.broadcast_to(half, middles.shape))
        if not keeps.any():
            return None
        middles = middles[keeps]
        if len(middles) > _MOST_CELLS:
            break
        axis = step % 3
        half[axis] /= 2
        moved = np.eye(3)[axis] * half[axis]
        middles = np.concatenate([middles - moved, middles + moved])
    return middles, half


@lru_cache(maxsize=4096)
def ball(solid: Lens) -> tuple[Array, float]:
    """Return the centre and the radius of a ball of the world that holds a solid at the origin."""
    placed, found = Placement.of(solid), _cells(solid)
    low, high = placed.box if found is None else _extent(solid)
    if is_sphere(solid):
        low, high = np.array(solid.surface.box(solid.values))
        widest = np.abs((high - low) / 2 * solid.stretch).max()
        return placed.to_world @ ((low + high) / 2), float(widest) * (1.0 + _MARGIN)
    if found is None:
        middles, half = ((low + high) / 2)[None], (high - low) / 2
    else:
        middles, half = found
    signs = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T
    corners = (middles[:, None] + signs * half).reshape(-1, 3) - (low + high) / 2
    radius = np.linalg.norm(corners @ placed.to_world.T, axis=1).max()
    return placed.to_world @ ((low + high) / 2), float(radius) * (1.0 + _MARGIN)


def is_sphere(lens: Lens) -> bool:
    """Say whether a lens is a sphere: every chord of it makes the same angle with both normals."""
    if lens.formula not in ("sphere", "ball", "ellipsoid"):
        return False
    axes = [lens.values.get(name, 1.0) for name in "abc"]  # an ellipsoid's
    sizes = np.abs(np.multiply(axes, lens.stretch))
    return bool(np.ptp(sizes) <= _ROUNDINGS * sizes.max())


@lru_cache(maxsize=4096)
def farthest(solid: Lens, direction: Vec3) -> float:
    """Return a bound on how far a solid at the origin goes in a direction of the world, in its length."""
    placed = Placement.of(solid)
    along = np.asarray(direction, dtype=np.float64) @ placed.to_world
    low, high = placed.box
    middles, half = ((low + high) / 2)[None], (high - low) / 2
    aside = -np.inf  # what cells that are parted no further reach
    for step in range(_PARTINGS):
        keeps = may_hold(solid, middles, np.broadcast_to(half, middles.shape))
        middles = middles[keeps]
        if not len(middles):
            break
        reach = middles @ along + half @ np.abs(along)
        order = np.argsort(-reach)
        if len(order) > _MOST_FRONT:
            aside = max(aside, float(reach[order[_MOST_FRONT]]))
        middles = middles[order[:_MOST_FRONT]]
        middles = middles[reach[order[:_MOST_FRONT]] > aside]
        # Twice the side that reaches most, then the longest: bounds over long cells are too wide
        axis = int(np.argmax(half * np.abs(along))) if step % 3 else int(np.argmax(half / (high - low)))
        half[axis] /= 2
        moved = np.eye(3)[axis] * half[axis]
        middles = np.concatenate([middles - moved, middles + moved])
    reach = middles @ along + half @ np.abs(along)
    most = max(aside, float(reach.max(initial=-np.inf)))
    corners = placed.corners() @ np.asarray(direction, dtype=np.float64)
    return float(corners.max()) if most == -np.inf else most + _MARGIN * float(np.abs(corners).max())


def may_hold(lens: Lens, middles: Array, halves: Array) -> NDArray[np.bool_]:
    """Say in which cells of a lens's space bounds do not exclude its solid."""
    cells = zip("xyz", (middles - halves).T, (middles + halves).T, strict=True)
    box = {**{name: (value, value) for name, value in lens.values.items()}, **{name: (a, b) for name, a, b in cells}}
    low, _ = bounds(lens.surface.expression, box)
    return ~(low > 0.0)


def value(lens: Lens, points: Array) -> Array:
    """Return F at points of a lens's space, shape (N, 3)."""
    f = evaluate(lens.surface.expression, {**lens.values, **dict(zip("xyz", points.T, strict=True))})
    return np.broadcast_to(f, len(points))
