"""Whether a surface point lies on a mirrored face: twin of kernels/lens_coat.cl, in float64."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens
from lenscl.expr import Expr, evaluate, evaluate_with_error, gradient
from lenscl.lenses import coat_functions
from lenscl.reference.placement import Placement

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_PLACING = 16 * np.finfo(float).eps  # of the lengths at hand: what placing a point in a lens's space may lose


def on_mirror(
    lens: Lens, placement: Placement, point: Array, direction: Array, reach: Array, coarser: float = 1.0
) -> tuple[Mask, Mask]:
    """Return which points of a lens's surface lie on a mirrored face, and of which that cannot be told.

    Parameters
    ----------
    lens : Lens
    placement : Placement
        Its own.
    point, direction : float64 array, shape (N, 3)
        World: the points, and along the rays that came to them.
    reach : float64 array, shape (N,)
        The largest coordinate on the way of each.
    coarser : float
        How many times as much as double precision rounds the numbers of the points are rounded.

    Returns
    -------
    is_coated, unsure : bool array, shape (N,)
    """
    everywhere, nowhere = np.ones(len(point), np.bool_), np.zeros(len(point), np.bool_)
    if lens.is_mirror:
        return everywhere, nowhere
    if not lens.mirror:
        return nowhere, nowhere
    local = placement.point_to_local(point)
    values: dict[str, Any] = {**lens.values, **dict(zip("xyz", local.T, strict=True))}
    (coat, coat_error, coat_slope), (rest, rest_error, rest_slope) = (
        _on_face(face, values, placement, len(point)) for face in coat_functions(lens.surface, lens.coated)
    )
    is_coated = coat > rest
    slope = np.where(is_coated[:, None], coat_slope, rest_slope)
    between, rounding = coat_slope - rest_slope, coarser * (coat_error + rest_error)
    moved = coarser * _PLACING * (reach + np.abs(placement.centre).max())
    with np.errstate(all="ignore"):
        level = np.abs(np.where(is_coated, coat, rest)) + rounding + moved * np.linalg.norm(slope, axis=1)
        along = level / np.abs(np.sum(slope * direction, axis=1))
        error = rounding + moved * np.linalg.norm(between, axis=1)
        error = error + along * np.abs(np.sum(between * direction, axis=1))
    return is_coated, ~(np.abs(coat - rest) > error)


def _on_face(face: Expr, values: dict[str, Any], placement: Placement, count: int) -> tuple[Array, Array, Array]:
    """Return a face's function at points, its rounding, and its gradient in the world."""
    value, error = (np.broadcast_to(each, count) for each in evaluate_with_error(face, values))
    slopes = np.stack([np.broadcast_to(evaluate(slope, values), count) for slope in gradient(face)], axis=-1)
    return value, error, placement.normal_to_world(slopes)
