"""Derivatives, and polynomials along a ray: both read their rules from the table, node by node."""

from __future__ import annotations

from collections.abc import Mapping

from lenscl.expr.graph import Expr, build, walk
from lenscl.expr.operations import OPERATIONS, Coefficients
from lenscl.expr.simplify import ONE, ZERO


def differentiate(expr: Expr, name: str) -> Expr:
    """Differentiate with respect to a symbol.

    `abs`, `min` and `max` have the derivative of the branch that their value is on; where branches meet, of the one
    that the value is taken from. Infinities and NaN come out where a derivative has none (`cbrt` at 0).
    """
    return derivative_along(expr, {name: ONE})


def derivative_along(expr: Expr, direction: Mapping[str, Expr]) -> Expr:
    """Differentiate with respect to t where each symbol given is `origin + t direction`; the others are constant."""
    slope: dict[Expr, Expr] = {}
    for each in walk([expr]):
        if not each.args:
            slope[each] = direction.get(str(each.name), ZERO) if each.op == "symbol" else ZERO
        elif all(slope[arg] is ZERO for arg in each.args):
            slope[each] = ZERO
        else:
            slope[each] = OPERATIONS[each.op].derivative(each, *each.args, *(slope[arg] for arg in each.args))
    return slope[expr]


def gradient(expr: Expr) -> tuple[Expr, Expr, Expr]:
    """Return the derivatives with respect to x, y and z."""
    return differentiate(expr, "x"), differentiate(expr, "y"), differentiate(expr, "z")


def polynomial(expr: Expr, along: Mapping[str, tuple[Expr, Expr]]) -> Coefficients | None:
    """Write an expression along a ray as a polynomial in t.

    Parameters
    ----------
    expr : Expr
        Any expression.
    along : mapping of str to (origin, direction)
        Each symbol given is replaced by `origin + t direction`.

    Returns
    -------
    tuple of Expr or None
        Coefficients of 1, t, t^2, ...; None where the expression is no polynomial in t.
    """
    coefficients: dict[Expr, Coefficients] = {}
    for each in walk([expr]):
        if not each.args:
            coefficients[each] = along[str(each.name)] if each.op == "symbol" and each.name in along else (each,)
            continue
        parts = [coefficients[arg] for arg in each.args]
        rule = OPERATIONS[each.op].polynomial
        found = rule(*parts) if rule else None
        if found is None:
            if any(len(part) > 1 for part in parts):
                return None
            found = (build(each.op, *(part[0] for part in parts)),)
        coefficients[each] = _trimmed(found)
    return coefficients[expr]


def _trimmed(found: Coefficients) -> Coefficients:
    last = max((k for k, each in enumerate(found) if each is not ZERO), default=0)
    return found[: last + 1]
