"""Whether a solid keeps inside the bounds that were promised for it."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from lenscl.expr import Expr, evaluate

_SIDE = 33  # samples along each edge of a face; odd, so that its middle is one


Vec3 = tuple[float, float, float]


def face_problem(expression: Expr, values: Mapping[str, float], box: tuple[Vec3, Vec3]) -> str | None:
    """Look for F <= 0 on the faces of a box, on 33 x 33 points of each.

    Parameters
    ----------
    expression : Expr
        F in x, y, z and the names of `values`.
    values : mapping of str to float
        The parameters.
    box : pair of corners
        Lowest and highest, local coordinates.

    Returns
    -------
    str or None
        What is wrong, where, and what to do; None where nothing was found, which is no proof that nothing is there.
    """
    low, high = box
    if not all(math.isfinite(end) for end in (*low, *high)) or not all(a < b for a, b in zip(low, high, strict=True)):
        return f"must be two corners of finite numbers, each low below its high, got {[list(low), list(high)]}"
    x, y, z = np.concatenate([_face(low, high, axis, end) for axis in range(3) for end in (low, high)], axis=1)
    F = evaluate(expression, {**values, "x": x, "y": y, "z": z})
    F = np.where(np.isnan(F), np.inf, F)  # no solid is found where F is no number; a ray that comes there is undecided
    reached = np.flatnonzero(F <= 0.0)
    if not reached.size:
        return None
    place = int(reached[0])
    axis, which = divmod(place // _SIDE**2, 2)
    return (
        f"the solid must lie strictly inside, but on the face {'xyz'[axis]} = {box[which][axis]:g} it holds the point "
        f"({x[place]:g}, {y[place]:g}, {z[place]:g}), where F = {F[place]:.3g}; widen the bounds, or end "
        "the solid by a ball, max(F, x^2 + y^2 + z^2 - radius^2), or a box, max(F, abs(x) - side, ...)"
    )


def _face(low: Vec3, high: Vec3, axis: int, end: Vec3) -> NDArray[np.float64]:
    """Return the samples of one face, shape (3, 33 * 33)."""
    ticks = [np.array([end[k]]) if k == axis else np.linspace(low[k], high[k], _SIDE) for k in range(3)]
    return np.stack([part.ravel() for part in np.meshgrid(*ticks, indexing="ij")])
