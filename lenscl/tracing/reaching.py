"""Which solids may reach the picture: they lie on it, it cuts them, or they are as near as single precision tells."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens, Lenses, Picture
from lenscl.lenses import Vec3
from lenscl.tracing.boxes import world_boxes
from lenscl.tracing.filled import farthest, may_hold, value
from lenscl.tracing.placement import Placement

_MANY = 16  # solids whose boxes are near: of so many it pays to look how far they go
_MOST_PATCHES = 2**12  # of a parallelogram that are left at a time
# Of the box, and of the parallelogram: a solid as near is on the picture, or beside it by what single precision may not
# tell
_NEAR = 1e-5
_MOST_STEPS = 40  # each halves every patch
_MARGIN = 1e-12  # of the lengths at hand: far more than mapping a patch to the lens's space loses

Array = NDArray[np.float64]


def reaching(lenses: Lenses, picture: Picture) -> Iterator[int]:
    """Yield the lenses, by number, that may come as near to the picture as `reaches` says."""
    corner, right, down = (np.asarray(v, dtype=np.float64) for v in (picture.corner, picture.right, picture.down))
    corners = corner + np.array([0 * right, right, down, right + down])
    normal = np.cross(right, down)
    normal /= np.linalg.norm(normal)
    solids = lenses.solids
    low, high = world_boxes(solids)
    for group in solids.groups:
        part, centres = slice(group.first, group.first + len(group)), group.centres
        slack = _slack(group.lens, corner, right, down, float(np.abs(centres).max()))
        near = ((low[part] - slack <= corners.max(axis=0)) & (high[part] + slack >= corners.min(axis=0))).all(axis=1)
        if not near.any():
            continue
        if near.sum() > _MANY:  # along the normal the picture is at one height
            height = (centres - corner) @ normal
            solid, off = group.lens.solid, float(slack @ np.abs(normal)) + _MARGIN * float(np.abs(centres).max())
            near &= height - farthest(solid, tuple((-normal).tolist())) <= off
            near &= height + farthest(solid, tuple(normal.tolist())) >= -off
        for place in np.flatnonzero(near).tolist():
            if reaches(group.copy(place), picture.corner, picture.right, picture.down):
                yield group.first + place


def _slack(lens: Lens, corner: Array, right: Array, down: Array, far: float) -> Array:
    """Return by how much, along each axis of the world, `reaches` widens a solid of some place no farther than that."""
    placed = Placement.of(lens)
    most = np.abs(placed.to_local) @ (np.abs(corner) + np.abs(right) + np.abs(down) + far)
    widened: Array = np.abs(placed.to_world) @ (_MARGIN * most + _NEAR * (placed.box[1] - placed.box[0]).max())
    return widened


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
        keeps[keeps] = may_hold(lens, middles[keeps], halves[keeps])
        at, middles = at[keeps], middles[keeps]
        if not len(at):
            return False
        if len(at) > _MOST_PATCHES or (value(lens, middles) < 0.0).any():
            return True
        axis = step % 2
        size[axis] /= 2
        moved = np.eye(2)[axis] * size[axis]
        at = np.concatenate([at - moved, at + moved])
    return True
