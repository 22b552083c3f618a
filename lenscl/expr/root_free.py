"""Replace a sum with one square root, such as a torus, by a polynomial of the same sign.

Let s = sqrt(q). The sum is written as A + L s, where A and L do not contain s (s^2 becomes q), and L does not depend on
x, y and z. A ring around an axis is (s - R)^2 + w, so A = q + R^2 + w and L = -2 R. The sum has the same sign as

  A^2 - L^2 q            if L < 0 and A >= 0 everywhere
  L^2 q - A^2            if L > 0 and A < 0 everywhere
  min(A^2 - L^2 q, A)    if L < 0 and q > 0 everywhere
  max(L^2 q - A^2, A)    if L > 0 and q > 0 everywhere

If A and L have the same sign, so has the sum. If not, |A| and |L| s are compared by their squares. For a ring, the
first polynomial is written as (q - R^2 + w)^2 + 4 R^2 w, in which nothing cancels if the tube is thin. No rule applies
if A and q may be 0 at the same place, as at the tip of a cone: there the polynomial would lose digits by cancellation.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from lenscl.expr.derive import degree
from lenscl.expr.facts import Facts
from lenscl.expr.graph import Expr, build, number, walk
from lenscl.expr.operations import whole
from lenscl.expr.simplify import ONE, ZERO, power

_COORDINATES = ("x", "y", "z")
_MOST_DEGREE = 8  # of polynomials that can be searched


def without_root(t: Expr, facts: Facts) -> Expr | None:
    """Return an expression of t's sign without its square root; None if it has not exactly one, or no rule applies."""
    found = _taken_apart(t, facts)
    if found is None:
        return None
    q, A, L, squared = found
    if L.value is None:
        return None
    if L.value < 0.0 and facts.is_nonnegative(A):
        return squared
    if L.value > 0.0 and facts.is_positive(-A):
        return -squared
    if not facts.is_positive(q):
        return None
    return build("min", squared, A) if L.value < 0.0 else build("max", -squared, A)


def root_polynomial(t: Expr) -> tuple[Expr, tuple[Expr, ...]] | None:
    """Return a polynomial and conditions: it has t's sign for parameters with which no condition is ever negative.

    None if t has no such form, or if L is a number: `without_root` treats that.
    """
    found = _taken_apart(t, Facts())
    if found is None:
        return None
    _, A, L, squared = found
    return None if L.value is not None else (squared, (-L, A))


def _taken_apart(t: Expr, facts: Facts) -> tuple[Expr, Expr, Expr, Expr] | None:
    """Return q, A, L and A^2 - L^2 q; None unless q and the last are polynomials of low degree."""
    roots = [each for each in walk([t]) if each.op in ("sqrt", "hypot") and each.depends_on(_COORDINATES)]
    if len(roots) != 1 or not _is_polynomial(roots[0].args, 4) or not facts.is_total(roots[0]):
        return None
    (s,) = roots
    q = s.args[0] if s.op == "sqrt" else power(s.args[0], 2) + power(s.args[1], 2)
    parts = _linear(t, s, q)
    if parts is None or parts[1] is ZERO or parts[1].depends_on(_COORDINATES):
        return None
    A, L = parts
    ring = _ring(t, s)
    if ring is not None:
        R, w = ring
        squared = power((q - power(R, 2)) + w, 2) + 4.0 * power(R, 2) * w
        A = (q + power(R, 2)) + w
    else:
        squared = power(A, 2) - power(L, 2) * q
    return (q, A, L, squared) if _is_polynomial([squared], _MOST_DEGREE) else None


def _is_polynomial(exprs: list[Expr] | tuple[Expr, ...], most: int) -> bool:
    degrees = [degree(each, _COORDINATES) for each in exprs]
    return all(found is not None and found <= most for found in degrees)


def _linear(t: Expr, s: Expr, q: Expr) -> tuple[Expr, Expr] | None:
    """Return A and L of t = A + L s, where s^2 = q; None if t has no such form."""
    at: dict[Expr, tuple[Expr, Expr] | None] = {}
    for each in walk([t]):
        parts = [at[arg] for arg in each.args]
        at[each] = (ZERO, ONE) if each is s else _linear_node(each, parts, q)
    return at[t]


def _linear_node(each: Expr, parts: list[tuple[Expr, Expr] | None], q: Expr) -> tuple[Expr, Expr] | None:
    if all(part is not None and part[1] is ZERO for part in parts):
        return each, ZERO
    known = [part for part in parts if part is not None]
    if len(known) < len(parts):
        return None
    match each.op:
        case "+" | "-":
            (a, b), (c, d) = known
            return build(each.op, a, c), build(each.op, b, d)
        case "neg":
            return -known[0][0], -known[0][1]
        case "*":
            (a, b), (c, d) = known
            return a * c + b * d * q, a * d + b * c
        case "/" if known[1][1] is ZERO:
            return known[0][0] / known[1][0], known[0][1] / known[1][0]
        case "power" if whole(each.args[1]) == 2:
            a, b = known[0]
            return power(a, 2) + power(b, 2) * q, 2.0 * a * b
    return None


def _ring(t: Expr, s: Expr) -> tuple[Expr, Expr] | None:
    """Return R and w of t = (s - R)^2 + w, w without s; None if t has no such form."""
    terms = _terms(t)
    with_root = [(sign, each) for sign, each in terms if s in walk([each])]
    if len(with_root) != 1:
        return None
    sign, square = with_root[0]
    if sign < 0 or square.op != "power" or whole(square.args[1]) != 2 or square.args[0].op not in ("+", "-"):
        return None
    u, v = square.args[0].args
    if s not in (u, v):
        return None
    R = v if u is s else u
    if R.depends_on(_COORDINATES):
        return None
    w = number(0.0)
    for sign, each in terms:
        if each is not square:
            w = w + each if sign > 0 else w - each
    return (R if square.args[0].op == "-" else -R), w


def _terms(t: Expr) -> list[tuple[int, Expr]]:
    """Return the terms of a sum with their signs, from left to right."""
    found: list[tuple[int, Expr]] = []
    stack = [(1, t)]
    while stack:
        sign, each = stack.pop()
        if each.op == "neg":
            stack.append((-sign, each.args[0]))
        elif each.op in ("+", "-"):
            u, v = each.args
            stack += [(sign if each.op == "+" else -sign, v), (sign, u)]
        else:
            found.append((sign, each))
    return found


def never_negative(expr: Expr, values: Mapping[str, float]) -> bool:
    """Say whether an expression is proved never to be negative, for given values of the parameters."""
    low = Facts(values=values).low(expr)
    return low is not None and low >= Fraction(0)
