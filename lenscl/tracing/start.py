"""Find out, once and in double precision, what the points lie in from which rays start."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
from lenscl.expr import bounds, evaluate, evaluate_with_error, gradient
from lenscl.tracing.placement import Placement

_NOWHERE = -1
_PLACING_ROUNDINGS = 8  # in (p - centre) to local: one subtraction, three products, two sums, and the map's own


def locate(scene: Scene, points: NDArray[np.float64]) -> tuple[NDArray[np.int8], NDArray[np.int8]]:
    """Return the number of the lens each point lies in, and of the lens on whose surface it lies; -1 for none.

    Parameters
    ----------
    scene : Scene
        The lenses.
    points : float64 array, shape (N, 3)
        World, scene units.

    Returns
    -------
    inside, on : int8 array, shape (N,)
        A point is on a surface where |F| is within the bound of its rounding error; it is inside where F < 0 beyond
        that. Whether a ray that starts on a surface travels inside is decided by its direction. Where F has no value,
        or none that is known, both are the lens's number: no ray from there is decided.
    """
    inside = np.full(len(points), _NOWHERE, dtype=np.int8)
    on = np.full(len(points), _NOWHERE, dtype=np.int8)
    unknown = on.copy()
    for number, lens in enumerate(scene.lenses):
        placement = Placement.of(lens)
        local = placement.local(points)
        near = np.flatnonzero(((local >= placement.box[0]) & (local <= placement.box[1])).all(axis=-1))
        if near.size == 0:
            continue
        values = {**lens.values, **dict(zip("xyz", local[near].T, strict=True))}
        f, rounding = evaluate_with_error(lens.surface.expression, values)

        # The local point is itself rounded: add what that does to F
        reach = (np.abs(points[near]) + np.abs(placement.centre)) @ np.abs(placement.to_local).T
        moved = _PLACING_ROUNDINGS * np.finfo(np.float64).eps * reach
        slopes = [evaluate(slope, values) for slope in gradient(lens.surface.expression)]
        with np.errstate(invalid="ignore", over="ignore"):
            bound = rounding + sum(np.abs(slope) * moved[:, axis] for axis, slope in enumerate(slopes))
        bound = np.where(np.isfinite(bound), bound, rounding)

        touches, is_inside = np.abs(f) <= bound, f < 0.0

        # Where F's rounding is not known its bounds about the point may tell the sign: max(known, log(0)) has one
        unsure = np.flatnonzero(np.isinf(rounding))
        if unsure.size:
            about = {
                axis: (at - by, at + by)
                for axis, at, by in zip("xyz", local[near[unsure]].T, moved[unsure].T, strict=True)
            }
            fixed = {name: (value, value) for name, value in lens.values.items()}
            low, high = bounds(lens.surface.expression, {**fixed, **about})
            touches[unsure], is_inside[unsure] = (low <= 0.0) & (high >= 0.0), high < 0.0
            untold = touches[unsure] & (np.isnan(f[unsure]) | np.isinf(low) | np.isinf(high))
            unknown[near[unsure[untold]]] = number
        on[near[touches]] = number
        inside[near[is_inside & ~touches]] = number
    is_unknown = unknown != _NOWHERE
    inside[is_unknown] = on[is_unknown] = unknown[is_unknown]
    return inside, on
