"""Bounds of an expression over a box, by interval arithmetic."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from lenscl.expr import intervals
from lenscl.expr.graph import Expr, walk
from lenscl.expr.intervals import Array, Interval
from lenscl.expr.operations import OPERATIONS


def bounds(expr: Expr, box: Mapping[str, tuple[ArrayLike, ArrayLike]]) -> tuple[Array, Array]:
    """Enclose the values that an expression takes over boxes.

    Parameters
    ----------
    expr : Expr
        Any expression.
    box : mapping of str to (low, high)
        The range of every symbol that occurs; arrays broadcast, for many boxes at once.

    Returns
    -------
    low, high : float64 array
        Every defined value over the box lies in [low, high], exactly and as computed by `evaluate`. Never NaN; where
        nothing is known (a division through 0, nowhere defined) they are -inf and inf.

    Raises
    ------
    KeyError
        If a symbol has no range.
    """
    given = {
        name: intervals.interval(np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64))
        for name, (low, high) in box.items()
    }
    at: dict[Expr, Interval] = {}
    with np.errstate(all="ignore"):
        for each in walk([expr]):
            if each.op == "symbol":
                at[each] = given[str(each.name)]
            elif each.op == "number":
                value = np.asarray(each.value, dtype=np.float64)
                at[each] = intervals.interval(value, value)
            elif each.op == "*" and each.args[0] is each.args[1]:  # a power that has become a product
                at[each] = intervals.integer_power(at[each.args[0]], 2)
            else:
                at[each] = OPERATIONS[each.op].interval(intervals, *(at[arg] for arg in each.args))
    shape = np.broadcast_shapes(*(part.shape for each in given.values() for part in (each.lo, each.hi)))
    return np.array(np.broadcast_to(at[expr].lo, shape)), np.array(np.broadcast_to(at[expr].hi, shape))


def least(expr: Expr, floors: Mapping[str, float] | None = None) -> float:
    """Return what an expression is never below, whatever its symbols are; -inf where nothing is known.

    `floors` says what symbols are never below themselves.
    """
    known = floors or {}
    names = {str(each.name) for each in walk([expr]) if each.op == "symbol"}
    return float(bounds(expr, {name: (known.get(name, -np.inf), np.inf) for name in names})[0])
