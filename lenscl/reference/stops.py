"""Whether a scene's picture is a screen: what `picture.stops` says, and for "auto" whether a solid reaches it."""

from __future__ import annotations

from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens, Scene
from lenscl.expr import bounds
from lenscl.reference.near import balls
from lenscl.reference.placement import Placement

_NEAR = 1e-5  # of the lens's box, and of the picture: so near to the picture a solid is on it
_HALVINGS = 12  # of each side of the picture
_ROOM = 1.5  # times a ball, within which any solid that may reach the picture keeps
_MOST = 2**12  # parts of the picture that are left at a time

Array = NDArray[np.float64]


@lru_cache(maxsize=64)
def picture_stops(scene: Scene) -> bool:
    """Say whether rays end on the picture where they meet it first."""
    if scene.picture.stops == "auto":
        return any(_reaches(scene.lenses[number], scene) for number in _near_the_plane(scene))
    return bool(scene.picture.stops)


def _near_the_plane(scene: Scene) -> list[int]:
    """Return the lenses, by number, whose balls come near to the picture's plane."""
    middles, radii = balls(scene.lenses)
    picture = scene.picture
    corner, right, down = (np.asarray(v, dtype=np.float64) for v in (picture.corner, picture.right, picture.down))
    normal = np.cross(right, down)
    away = np.abs((middles - corner) @ normal) / np.linalg.norm(normal)
    found: list[int] = np.flatnonzero(away <= radii * _ROOM).tolist()
    return found


def _reaches(lens: Lens, scene: Scene) -> bool:
    placement, picture = Placement.of(lens), scene.picture
    low, high = (np.asarray(side, dtype=np.float64) for side in lens.surface.box(lens.values))
    corner, right, down = (np.asarray(v, dtype=np.float64) for v in (picture.corner, picture.right, picture.down))
    parts, span = np.zeros((1, 2)), max(np.linalg.norm(right), np.linalg.norm(down))
    for halving in range(_HALVINGS):
        side = 0.5**halving
        corners = [
            placement.point_to_local(corner + (parts + side * np.array(end)) @ np.stack([right, down]))
            for end in product((0.0, 1.0), repeat=2)
        ]
        slack = np.minimum(_NEAR * (high - low).max(), _NEAR * span / np.abs(placement.stretch).min())
        least, most = np.min(corners, axis=0) - slack, np.max(corners, axis=0) + slack
        box = {name: (least[:, axis], most[:, axis]) for axis, name in enumerate("xyz")}
        below, _ = bounds(lens.surface.expression, {**{n: (v, v) for n, v in lens.values.items()}, **box})
        parts = parts[((least <= high) & (most >= low)).all(axis=1) & ~(below > 0.0)]
        if not len(parts):
            return False
        if len(parts) > _MOST:
            return True
        halves = [parts + side / 2 * np.array(by) for by in product((0.0, 1.0), repeat=2)]
        parts = np.concatenate(halves)
    return True
