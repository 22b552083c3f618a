"""The values of expressions in float64, and bounds on their rounding errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.expr import intervals
from lenscl.expr.graph import Expr, walk
from lenscl.expr.intervals import Interval
from lenscl.expr.operations import OPERATIONS

Array = NDArray[np.float64]

_SLACK = 1.0 + 8 * 2.0**-53  # an error rule is itself a handful of rounded operations


def evaluate(expr: Expr, values: Mapping[str, ArrayLike]) -> Array:
    """Evaluate at points.

    Parameters
    ----------
    expr : Expr
        Any expression.
    values : mapping of str to array
        A value for every symbol that occurs; shapes broadcast.

    Returns
    -------
    float64 array
        Of the shape that `values` broadcast to. NaN and infinities come out where IEEE 754 gives them, without warning.

    Raises
    ------
    KeyError
        If a symbol has no value.
    """
    given, shape = _arrays(values)
    at: dict[Expr, Array] = {}
    with np.errstate(all="ignore"):
        for each in walk([expr]):
            at[each] = _leaf(each, given) if not each.args else _applied(each, at)
    return np.array(np.broadcast_to(at[expr], shape))


def evaluate_with_error(expr: Expr, values: Mapping[str, ArrayLike]) -> tuple[Array, Array]:
    """Evaluate at points, with a bound on the rounding error of each value.

    The values and the numbers in the expression are taken as exact. Arithmetic carries its error by identities such as
    `|(u + a)(v + b) - u v| <= |u||b| + |v||a| + |a||b|`, nothing dropped; functions by their interval rule over
    `u - error ... u + error`.

    Returns
    -------
    value, error : float64 array
        As `evaluate`, and e >= 0 with |value - exact| <= e; e is infinite where nothing is known.
    """
    (value,), (error,) = evaluate_together([expr], values, with_error=1)
    return value, error


def evaluate_together(
    exprs: Sequence[Expr], values: Mapping[str, ArrayLike], *, with_error: int = 0
) -> tuple[list[Array], list[Array]]:
    """Evaluate several expressions at points; what they share is computed once.

    Parameters
    ----------
    exprs : sequence of Expr
        Any expressions.
    values : mapping of str to array
        As for `evaluate`.
    with_error : int
        How many of them, from the first, get a bound on their rounding error, as by `evaluate_with_error`.

    Returns
    -------
    values, errors : list of float64 array
        One an expression; one for each that gets a bound.
    """
    given, shape = _arrays(values)
    at: dict[Expr, Array] = {}
    error: dict[Expr, Array] = {}
    with np.errstate(all="ignore"):
        for each in _order(tuple(exprs[:with_error])):
            if not each.args:
                at[each], error[each] = _leaf(each, given), np.zeros(())
                continue
            at[each] = _applied(each, at)
            found = _error(each, at, error) * _SLACK
            error[each] = np.where(np.isfinite(at[each]) & ~np.isnan(found), found, np.inf)
        for each in _order(tuple(exprs[with_error:])):
            if each not in at:
                at[each] = _leaf(each, given) if not each.args else _applied(each, at)
    found_values = [np.array(np.broadcast_to(at[expr], shape)) for expr in exprs]
    return found_values, [np.array(np.broadcast_to(error[expr], shape)) for expr in exprs[:with_error]]


@lru_cache(maxsize=64)
def _order(exprs: tuple[Expr, ...]) -> tuple[Expr, ...]:
    """Return the nodes as `walk` does; surfaces are evaluated again and again."""
    return tuple(walk(exprs))


def _arrays(values: Mapping[str, ArrayLike]) -> tuple[dict[str, Array], tuple[int, ...]]:
    given = {name: np.asarray(value, dtype=np.float64) for name, value in values.items()}
    return given, np.broadcast_shapes(*(each.shape for each in given.values()))


def _leaf(each: Expr, given: Mapping[str, Array]) -> Array:
    return given[str(each.name)] if each.op == "symbol" else np.asarray(each.value, dtype=np.float64)


def _applied(each: Expr, at: Mapping[Expr, Array]) -> Array:
    result: Array = OPERATIONS[each.op].evaluate(np, *(at[arg] for arg in each.args))
    return result


def _error(each: Expr, at: Mapping[Expr, Array], error: Mapping[Expr, Array]) -> Array:
    row = OPERATIONS[each.op]
    if row.rounding is not None:
        result: Array = row.rounding(np, at[each], *(at[arg] for arg in each.args), *(error[arg] for arg in each.args))
        return result
    reach = (intervals.around(at[arg], error[arg]) for arg in each.args)
    enclosure: Interval = row.interval(intervals, *reach)
    return np.maximum(enclosure.hi - at[each], at[each] - enclosure.lo)
