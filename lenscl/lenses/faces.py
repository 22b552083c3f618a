"""Whether a solid keeps inside the bounds that were promised for it."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from lenscl.expr import Expr, evaluate

_SIDE = 33  # samples along each edge of a face; odd, so that its middle is one
_AXES = "xyz"


def face_problem(
    expression: Expr, values: Mapping[str, float], box: tuple[tuple[float, float, float], tuple[float, float, float]]
) -> str | None:
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
    for axis, name in enumerate(_AXES):
        for end in (low, high):
            ticks = [np.array([end[k]]) if k == axis else np.linspace(low[k], high[k], _SIDE) for k in range(3)]
            x, y, z = (part.ravel() for part in np.meshgrid(*ticks, indexing="ij"))
            F = evaluate(expression, {**values, "x": x, "y": y, "z": z})
            F = np.where(np.isnan(F), np.inf, F)  # NaN is outside: there is no solid where F has no value
            worst = int(np.argmin(F))
            if F[worst] <= 0.0:
                return (
                    f"the solid must lie strictly inside, but on the face {name} = {end[axis]:g} it holds the point "
                    f"({x[worst]:g}, {y[worst]:g}, {z[worst]:g}), where F = {F[worst]:.3g}; widen the bounds, or end "
                    "the solid by a ball, max(F, x^2 + y^2 + z^2 - radius^2), or a box, max(F, abs(x) - side, ...)"
                )
    return None
