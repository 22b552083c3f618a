"""Details of a user's solid that are finer than a film pixel: what rays through pixel centres meet of them is chance.

Places within the solid are taken from a grid in its bounds. Where F is not below 0 half a film pixel away on either
side, in one of a few directions across the view, the solid is finer there than a pixel; where that is so at many of the
places, it is of such details.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
from lenscl.expr import Expr
from lenscl.lenses import Box
from lenscl.sweep.boxes import value_at
from lenscl.tracing import Placement

Array = NDArray[np.float64]

_PLACES = 24  # along each side of the bounds
_ASIDE = 0.137  # of a place's width: so that none lies on a symmetry of the expression
_WAYS = ((1.0, 0.0), (0.0, 1.0), (0.7, 0.7), (0.7, -0.7))  # across the view, in pixels right and down
_MANY = 0.1  # of the places within


def fine_share(scene: Scene, number: int) -> float:
    """Return the share of a lens's inside that is finer than a film pixel; 0 where it is small, or of the catalogue."""
    lens = scene.lenses[number]
    if lens.surface.promised is None:
        return 0.0
    values = tuple(sorted(lens.values.items()))
    local = _inside(lens.surface.expression, values, lens.surface.promised)
    if not len(local):
        return 0.0
    placement = Placement.of(lens)
    world = placement.centre + local @ placement.to_world.T
    film = scene.film
    right, down = np.asarray(film.right) / film.columns, np.asarray(film.down) / film.rows
    far = _distance(scene, world)
    looked_at = np.isfinite(far)
    if not looked_at.any():
        return 0.0
    world, far = world[looked_at], far[looked_at, None]
    fine = np.zeros(len(world), dtype=bool)
    for across, along in _WAYS:
        step = 0.5 * far * (across * right + along * down)
        sides = [
            value_at(lens.surface.expression, dict(values), placement.local(world + way * step)) for way in (1, -1)
        ]
        # Where F has no value nothing is known to end there
        fine |= np.logical_and.reduce([side >= 0.0 for side in sides])
    share = float(fine.mean())
    return share if share >= _MANY else 0.0


@lru_cache(maxsize=64)  # a sweep of anything else asks for the same solid at every point
def _inside(expression: Expr, values: tuple[tuple[str, float], ...], bounds: Box) -> Array:
    low, high = (np.asarray(corner, dtype=np.float64) for corner in bounds)
    unit = (np.stack(np.meshgrid(*[np.arange(_PLACES)] * 3), axis=-1).reshape(-1, 3) + 0.5 + _ASIDE) / _PLACES
    points = low + np.minimum(unit, 1.0) * (high - low)
    return points[value_at(expression, dict(values), points) < 0.0]


def _distance(scene: Scene, world: Array) -> Array:
    """Return how many times as large a film pixel is, seen at places of the world; Inf where it does not look."""
    if scene.source.at is None:
        return np.ones(len(world))
    source, film = np.asarray(scene.source.at, dtype=np.float64), scene.film
    normal = np.cross(np.asarray(film.right), np.asarray(film.down))
    with np.errstate(divide="ignore", invalid="ignore"):
        times: Array = (world - source) @ normal / ((np.asarray(film.corner) - source) @ normal)
    return np.where(times > 0.0, times, np.inf)
