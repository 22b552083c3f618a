"""Boxes of a lens's own space, parted again and again, and what expressions are on them: for looking at its shape."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from lenscl.expr import Expr, bounds, evaluate
from lenscl.expr.graph import walk

Array = NDArray[np.float64]
Points = tuple[tuple[float, float, float], ...]
Values = Mapping[str, float]

_MOST_BOXES = 1500
_MOST_OPERATIONS = 150_000  # on as many boxes, one each: a hundredth of a second or two
_OCTANTS = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)], dtype=np.float64)


def most_boxes(expr: Expr) -> int:
    """Return of how many boxes an expression may be asked: where more are left they are not parted again."""
    return min(_MOST_BOXES, _MOST_OPERATIONS // sum(1 for _ in walk([expr])))


def parted(lows: Array, side: Array) -> Array:
    """Return the lowest corners of the eight parts of each box; `side` is that of the parts."""
    return (lows[:, None] + _OCTANTS * side).reshape(-1, 3)


def enclosed(expr: Expr, given: Values, lows: Array, side: Array) -> tuple[Array, Array]:
    """Return bounds of an expression in x, y, z and the names of `given`, one of each a box; `side` may be, too."""
    ranges = {name: (value, value) for name, value in given.items()}
    return bounds(expr, {**ranges, **{name: (lows[:, i], lows[:, i] + side[..., i]) for i, name in enumerate("xyz")}})


def may_be_zero(expr: Expr, given: Values, lows: Array, side: Array) -> NDArray[np.bool_]:
    """Whether an expression may be zero somewhere in each box."""
    low, high = enclosed(expr, given, lows, side)
    return (low <= 0.0) & (high >= 0.0)


def value_at(expr: Expr, given: Values, points: Array) -> Array:
    """Return an expression's values at points, shape (N, 3)."""
    return evaluate(expr, {**given, **dict(zip("xyz", points.T, strict=True))})


def vectors_at(slopes: tuple[Expr, ...], given: Values, points: Array) -> Array:
    """Return the values of three expressions at points, shape (N, 3)."""
    return np.stack([value_at(slope, given, points) for slope in slopes], axis=1)
