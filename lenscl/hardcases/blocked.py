"""Check rays that an opaque lens blocks: they end on its surface, with the direction in which they came.

Where solids overlap, that may be the surface of another: an opaque one is the medium behind it, or was before it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens, Scene
from lenscl.expr import evaluate, gradient
from lenscl.hardcases.case import Array, Case, Level
from lenscl.hardcases.judge import Wrong
from lenscl.status import RayStatus
from lenscl.tracing import Placement, RayMap, RayPaths

# Allowed distance of a point from the surface, relative to its largest coordinate or 1; allowed error of a direction
_BESIDE: dict[Level, float] = {"single": 1e-3, "double": 1e-9}


def misplaced(case: Case, scene: Scene, ends: RayMap | RayPaths, level: Level) -> Iterator[Wrong]:
    """Yield the blocked rays that end off every opaque surface, or with another direction than the one they came in."""
    blocked = np.flatnonzero(ends.status.ravel() == RayStatus.BLOCKED)
    if not blocked.size:
        return
    origin = ends.origin.reshape(-1, 3)[blocked].astype(np.float64)
    direction = ends.direction.reshape(-1, 3)[blocked].astype(np.float64)
    dark = [lens for number, lens in enumerate(scene.lenses) if scene.blocks(number)]
    apart = np.min([_distance(lens, origin) for lens in dark], axis=0)
    within = np.any([_value(lens, origin) < 0.0 for lens in dark], axis=0)
    apart = np.where(within, np.min([_distance(lens, origin) for lens in scene.lenses], axis=0), apart)
    far = ~(apart <= _BESIDE[level] * np.maximum(1.0, np.abs(origin).max(axis=1)))
    turned = ~(np.abs(np.linalg.norm(direction, axis=1) - 1.0) <= _BESIDE[level])
    if case.directions is not None:
        came = case.directions[blocked] / np.linalg.norm(case.directions[blocked], axis=1, keepdims=True)
        first = ends.events.ravel()[blocked] == 1
        turned |= first & ~(np.linalg.norm(direction - came, axis=1) <= _BESIDE[level])
    for number, ray in enumerate(blocked.tolist()):
        if far[number]:
            yield Wrong(ray=ray, what=f"is blocked {apart[number]:.3g} beside every opaque surface")
        if turned[number]:
            yield Wrong(ray=ray, what=f"is blocked, and its direction is {direction[number]}, not the one it came in")


def _distance(lens: Lens, points: Array) -> NDArray[np.float64]:
    """Return the distances of points from a lens's surface, to first order: |F| over the length of its gradient."""
    values = _values(lens, points)
    slopes = [np.broadcast_to(evaluate(slope, values), len(points)) for slope in gradient(lens.surface.expression)]
    normals = np.stack(slopes, axis=-1) @ Placement.of(lens).to_local
    with np.errstate(all="ignore"):
        apart: NDArray[np.float64] = np.abs(_value(lens, points)) / np.linalg.norm(normals, axis=-1)
    return apart


def _value(lens: Lens, points: Array) -> Array:
    return np.broadcast_to(evaluate(lens.surface.expression, _values(lens, points)), len(points))


def _values(lens: Lens, points: Array) -> dict[str, Any]:
    return {**lens.values, **dict(zip("xyz", Placement.of(lens).local(points).T, strict=True))}
