"""Derivatives, and polynomials along a ray: both read their rules from the table, node by node."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import count

from lenscl.expr.graph import Expr, build, node, symbol, walk
from lenscl.expr.operations import OPERATIONS, Coefficients, whole
from lenscl.expr.simplify import ONE, ZERO, power


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


def polynomial(expr: Expr, along: Mapping[str, Coefficients]) -> Coefficients | None:
    """Write an expression as a polynomial in t.

    Parameters
    ----------
    expr : Expr
        Any expression.
    along : mapping of str to tuple of Expr
        Each symbol given is replaced by a polynomial in t, its coefficients; by `origin + t direction` on a ray.

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


def degree(expr: Expr, along: Collection[str]) -> int | None:
    """Return the degree as a polynomial in some symbols, before anything cancels; None where it is none."""
    return _degrees([expr], along)[expr]


def pieces(exprs: Sequence[Expr], along: Collection[str], top: int) -> tuple[tuple[Expr, ...], dict[str, Expr]]:
    """Take expressions apart into their largest polynomial parts and the rest.

    Parameters
    ----------
    exprs : sequence of Expr
        Any expressions.
    along : collection of str
        The symbols of which the parts are polynomials.
    top : int
        The highest degree that a part may have, 1 or more.

    Returns
    -------
    rests : tuple of Expr
        The expressions with a symbol in the place of every part; none of `along` occurs in them.
    parts : dict of str to Expr
        By the symbol's name, in the order of use: "part_0", "part_1", ...; but no name that an expression has.
    """
    degrees = _degrees(exprs, along)
    taken = {each.name for each in degrees if each.op == "symbol"}
    free = (name for name in (f"part_{i}" for i in count()) if name not in taken)
    parts: dict[str, Expr] = {}
    rest: dict[Expr, Expr] = {}

    def is_part(each: Expr) -> bool:
        return 1 <= (degrees[each] or 0) <= top

    seen = {arg for each in degrees if not is_part(each) for arg in each.args} | set(exprs)  # from outside the parts
    for each in degrees:
        if not is_part(each):
            rest[each] = node(each.op, *(rest[arg] for arg in each.args)) if each.args else each
        elif each in seen:
            name = next(free)
            parts[name], rest[each] = each, symbol(name)
    return tuple(rest[expr] for expr in exprs), parts


def _degrees(exprs: Iterable[Expr], along: Collection[str]) -> dict[Expr, int | None]:
    """Return every node's degree, operands first."""
    degrees: dict[Expr, int | None] = {}
    for each in walk(exprs):
        parts = [degrees[arg] for arg in each.args]
        known = [part for part in parts if part is not None]
        if not each.args:
            degrees[each] = int(each.op == "symbol" and each.name in along)
        elif len(known) < len(parts):
            degrees[each] = None
        elif not any(known):
            degrees[each] = 0
        elif each.op in ("+", "-", "neg"):
            degrees[each] = max(known)
        elif each.op == "*":
            degrees[each] = sum(known)
        elif each.op == "power":
            degrees[each] = known[0] * whole(each.args[1])
        elif each.op == "/" and not known[1]:
            degrees[each] = known[0]
        else:
            degrees[each] = None
    return degrees


def magnitude(expr: Expr, along: Collection[str]) -> tuple[Expr, int]:
    """Return what bounds the rounding of a polynomial, however it is computed along a ray.

    Parameters
    ----------
    expr : Expr
        A polynomial in the symbols `along`.
    along : collection of str
        The coordinates; they are to be given their largest sizes.

    Returns
    -------
    size : Expr
        The polynomial with every term made positive: its value at |o| + |d| L bounds the sum of the terms of every
        coefficient of t^k L^k.
    roundings : int
        The longest chain of roundings from a coordinate to a coefficient: products add their operands' chains and one
        of their own, sums of k terms take the longest and k - 1. The error of the coefficients, summed, is at most
        roundings u size, u being the unit roundoff (Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed.,
        sec. 3.1; terms of order u^2 are covered by callers, who double it).
    """
    sizes: dict[Expr, tuple[Expr, int, int]] = {}  # size, roundings, degree
    for each in walk([expr]):
        parts = [sizes[arg] for arg in each.args]
        if not each.depends_on(along):
            sizes[each] = build("abs", each), 4, 0  # a few roundings: it is computed once from the parameters
        elif each.op == "symbol":
            sizes[each] = each, 0, 1
        elif each.op in ("+", "-"):
            (u, chain, m), (v, other, n) = parts
            sizes[each] = u + v, max(chain, other) + 1, max(m, n)
        elif each.op == "neg":
            sizes[each] = parts[0]
        elif each.op == "*":
            (u, chain, m), (v, other, n) = parts
            sizes[each] = u * v, chain + other + 1 + min(m, n), m + n
        elif each.op == "/":
            (u, chain, m), (v, other, _) = parts
            sizes[each] = u / v, chain + other + 1, m
        elif each.op == "power":
            (u, chain, m), n = parts[0], whole(each.args[1])
            sizes[each] = power(u, n), n * chain + (n - 1) * (1 + m), n * m
        else:
            raise ValueError(f"{each.op} is no part of a polynomial")
    size, roundings, _ = sizes[expr]
    return size, roundings
