"""Which solids of a scene are proved apart: no point lies in two of them, or on the surfaces of two.

Where two boxes overlap, the part that they share is cut into ever smaller cells, until bounds show of each cell that
one solid or the other is not in it. Solids that touch are never proved apart, nor are those with a gap finer than the
cells.
"""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens
from lenscl.expr import bounds, evaluate
from lenscl.lenses import Vec3
from lenscl.tracing.placement import Placement

_MOST_CELLS = 2**14  # that are left at a time; a face that two solids share is in more of them at every step
_MOST_PATCHES = 2**12  # of a parallelogram that are left at a time
# Of the box, and of the parallelogram: a solid as near is on the picture, or beside it by what single precision may not
# tell
_NEAR = 1e-5
_MOST_STEPS = 40  # each halves every cell
_MARGIN = 1e-12  # of the lengths at hand: far more than mapping a cell to the other lens's space loses

Array = NDArray[np.float64]


def touching(lenses: tuple[Lens, ...], some: Collection[int]) -> tuple[tuple[int, int], ...]:
    """Return the pairs, by number, of some of a scene's lenses whose solids may touch or overlap."""
    return _touching(lenses, tuple(sorted(some)))


@lru_cache(maxsize=256)
def _touching(lenses: tuple[Lens, ...], some: tuple[int, ...]) -> tuple[tuple[int, int], ...]:
    if len(some) < 2:
        return ()
    corners = np.stack([Placement.of(lenses[number]).corners() for number in some])
    low, high = corners.min(axis=1), corners.max(axis=1)
    slack = _MARGIN * np.abs(corners).max(axis=(1, 2))[:, np.newaxis]
    low, high = low - slack, high + slack
    meets = ((low[:, np.newaxis] <= high) & (low <= high[:, np.newaxis])).all(axis=-1)
    pairs = ((some[i], some[j]) for i, j in np.argwhere(np.triu(meets, 1)).tolist())
    return tuple(pair for pair in pairs if not _apart(lenses[pair[0]], lenses[pair[1]]))


@lru_cache(maxsize=4096)
def _apart(a: Lens, b: Lens) -> bool:
    here, there = Placement.of(a), Placement.of(b)
    corners = here.local(there.corners())
    low, high = np.maximum(here.box[0], corners.min(axis=0)), np.minimum(here.box[1], corners.max(axis=0))
    if not (low <= high).all():
        return True
    # From a's space to b's, and what that loses
    linear = there.to_local @ here.to_world
    offset = there.to_local @ (here.centre - there.centre)
    lost = _MARGIN * (
        np.abs(there.to_local) @ (np.abs(here.centre) + np.abs(there.centre)) + np.abs(there.box).max(axis=0)
    )
    middles, halves = ((low + high) / 2)[None], ((high - low) / 2)[None] * (1.0 + _MARGIN)
    for step in range(_MOST_STEPS):
        keeps = _may_hold(a, middles, halves)
        middles, halves = middles[keeps], halves[keeps]
        mapped = middles @ linear.T + offset
        reach = halves @ np.abs(linear).T + lost
        keeps = ((mapped + reach >= there.box[0]) & (mapped - reach <= there.box[1])).all(axis=1)
        keeps[keeps] = _may_hold(b, mapped[keeps], reach[keeps])
        middles, halves, mapped = middles[keeps], halves[keeps], mapped[keeps]
        if not len(middles):
            return True
        if len(middles) > _MOST_CELLS or ((_value(a, middles) < 0.0) & (_value(b, mapped) < 0.0)).any():
            return False
        axis = step % 3
        halves[:, axis] /= 2
        moved = np.zeros_like(halves)
        moved[:, axis] = halves[:, axis]
        middles, halves = np.concatenate([middles - moved, middles + moved]), np.concatenate([halves, halves])
    return False


@lru_cache(maxsize=4096)
def extent(lens: Lens) -> tuple[Array, Array]:
    """Return the corners of a box in the lens's space that holds all that bounds do not exclude from the solid.

    A user's box may be far larger than the solid in it.
    """
    low, high = Placement.of(lens).box
    middles, half = ((low + high) / 2)[None], (high - low) / 2
    for step in range(3 * _MOST_STEPS):
        keeps = _may_hold(lens, middles, np.broadcast_to(half, middles.shape))
        if not keeps.any():
            return low, high
        middles = middles[keeps]
        if len(middles) > _MOST_PATCHES:
            break
        axis = step % 3
        half[axis] /= 2
        moved = np.eye(3)[axis] * half[axis]
        middles = np.concatenate([middles - moved, middles + moved])
    return np.maximum(low, middles.min(axis=0) - half), np.minimum(high, middles.max(axis=0) + half)


@lru_cache(maxsize=4096)
def reaches(lens: Lens, corner: Vec3, right: Vec3, down: Vec3) -> bool:
    """Return whether a solid may come nearer to a parallelogram than `_NEAR` of its box or of that: False is proved."""
    placed = Placement.of(lens)
    start = placed.local(np.asarray(corner, dtype=np.float64))
    spans = np.array([right, down]) @ placed.to_local.T
    far = np.abs(placed.to_local) @ (np.abs(corner) + np.abs(right) + np.abs(down) + np.abs(placed.centre))
    near = _NEAR * max(np.linalg.norm(right), np.linalg.norm(down)) * np.abs(placed.to_local).sum(axis=1)
    lost = _MARGIN * far + np.minimum(near, _NEAR * (placed.box[1] - placed.box[0]).max())
    at, size = np.array([[0.5, 0.5]]), np.array([0.5, 0.5])
    for step in range(_MOST_STEPS):
        middles, halves = start + at @ spans, np.broadcast_to(size @ np.abs(spans) + lost, (len(at), 3))
        keeps = ((middles + halves >= placed.box[0]) & (middles - halves <= placed.box[1])).all(axis=1)
        keeps[keeps] = _may_hold(lens, middles[keeps], halves[keeps])
        at, middles = at[keeps], middles[keeps]
        if not len(at):
            return False
        if len(at) > _MOST_PATCHES or (_value(lens, middles) < 0.0).any():
            return True
        axis = step % 2
        size[axis] /= 2
        moved = np.eye(2)[axis] * size[axis]
        at = np.concatenate([at - moved, at + moved])
    return True


def _may_hold(lens: Lens, middles: Array, halves: Array) -> NDArray[np.bool_]:
    """Say in which cells of a lens's space bounds do not exclude its solid."""
    cells = zip("xyz", (middles - halves).T, (middles + halves).T, strict=True)
    box = {**{name: (value, value) for name, value in lens.values.items()}, **{name: (a, b) for name, a, b in cells}}
    low, _ = bounds(lens.surface.expression, box)
    return ~(low > 0.0)


def _value(lens: Lens, points: Array) -> Array:
    value = evaluate(lens.surface.expression, {**lens.values, **dict(zip("xyz", points.T, strict=True))})
    return np.broadcast_to(value, len(points))
