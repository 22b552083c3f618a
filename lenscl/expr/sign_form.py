"""Expressions of the same sign that are easier to search: what rises with F and is 0 with it is taken off from outside.

tanh(5 F), exp(F) - 1, sqrt(F + 1/4) - 1/2, F^3 and log(1 + F) are negative, 0 and positive where F is, so a surface
given by one of them is that of F: with a simple root and a normal where F^3 has none, and often a polynomial. Square
roots of squares become sizes, and squares of square roots what they are of.

A form is taken only where it is proved to have the sign of what was written wherever that has a value, and to have
a value only where that has one or where its sign is settled, as at a logarithm's pole. So what a function's domain
leaves out stays left out: a root or a logarithm goes only if what it is taken of is proved never negative (`facts`), a
divisor only if it is proved never 0. Numbers moved through a function are rounded once. Parameters may have any value.

The rules are the rows of `sign_rules`.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from lenscl.expr.facts import Facts
from lenscl.expr.graph import Expr, build, walk
from lenscl.expr.identities import IDENTITIES
from lenscl.expr.root_free import without_root
from lenscl.expr.sign_rules import NOTHING, OUTER, Level, Step

_DEEPEST = 100  # of what is taken off one from the other
_MOST_PARTS = 200  # of max, min and abs
_MOST_CHOICES = 4  # of max and min, of which it is tried whether one is needless


def sign_form(expr: Expr, facts: Facts) -> Expr:
    """Return an expression of the same sign, the same one where nothing is gained.

    Parameters
    ----------
    expr : Expr
        F in x, y, z and parameters, of which `facts` knows no value.
    facts : Facts
        What is known over the box that F is searched in.
    """
    plain = _rewritten(expr, facts)
    if sum(each.op in ("max", "min", "abs") for each in walk([plain])) > _MOST_PARTS:
        return plain  # a solid of many faces, each of which would have to be looked at in turn
    found = _sign(plain, NOTHING, facts)
    form = plain if found is None else _rewritten(found, facts)
    choices = sum(each.op in ("max", "min") for each in walk([form]))
    return _decisive(form, facts) if choices <= _MOST_CHOICES else form


def _decisive(t: Expr, facts: Facts) -> Expr:
    """Leave out of max and min what never decides their sign: a ball that the solid lies in anyway."""
    if t.op not in ("max", "min"):
        return t
    u, v = (_decisive(arg, facts) for arg in t.args)
    for one, other in ((u, v), (v, u)):
        if facts.decides(t.op, one, other):
            return one
    return build(t.op, u, v)


def _rewritten(expr: Expr, facts: Facts) -> Expr:
    """Apply the identities, operands first."""
    made: dict[Expr, Expr] = {}
    for each in walk([expr]):
        here = build(each.op, *(made[arg] for arg in each.args)) if each.args else each
        rules = (rule.apply(facts, here) for rule in IDENTITIES if rule.op == here.op)
        made[each] = next((result for result in rules if result is not None), here)
    return made[expr]


def _sign(t: Expr, c: Level, facts: Facts, depth: int = 0) -> Expr | None:
    """Return an expression of the sign of t - c, None where none is gained; `depth`: what was taken off round it."""
    if depth > _DEEPEST:
        return None
    outer, sign = t, 1
    while depth and c == 0 and t.op in ("*", "/", "neg") and (step := _first(facts, t, c, is_affine=True)):
        t, sign = step.u, sign * step.sign  # inside something else its number of units means nothing
    scaled, its_sign = t, sign
    while (step := _first(facts, t, c, is_affine=True)) is not None:
        t, c, sign = step.u, step.d, sign * step.sign
    if t.op in ("max", "min"):
        found = _chosen(t.op, t.args, c, facts, depth)
    elif t.op == "abs":
        found = _chosen("max", (t.args[0], -t.args[0]), c, facts, depth)
    elif (step := _first(facts, t, c, is_affine=False)) is not None:
        sign *= step.sign
        found = _sign(step.u, step.d, facts, depth + 1)
        found = _difference(step.u, step.d) if found is None else found
    else:
        found = without_root(_difference(t, c), facts)
        if found is None and scaled is not outer:
            found, sign = scaled, its_sign
    return found if found is None or sign > 0 else -found


def _first(facts: Facts, t: Expr, c: Level, *, is_affine: bool) -> Step | None:
    steps = (rule.apply(facts, t, c) for rule in OUTER if rule.op == t.op and rule.is_affine == is_affine)
    return next((step for step in steps if step is not None), None)


def _chosen(op: str, args: Sequence[Expr], c: Level, facts: Facts, depth: int) -> Expr | None:
    """Return an expression of the sign of the greater of two less c, or of the lesser."""
    parts = [_sign(arg, c, facts, depth) for arg in args]
    if parts == [None, None]:
        return None
    return build(op, *(_difference(arg, c) if part is None else part for arg, part in zip(args, parts, strict=True)))


def _difference(t: Expr, c: Level) -> Expr:
    """Return t - c, its numbers added up and rounded once."""
    if isinstance(c, Expr):
        return t - c
    if c == 0:
        return t
    moved = c
    while t.op in ("+", "-") and any(arg.value is not None for arg in t.args):
        u, v = t.args
        if v.value is not None:
            t, moved = u, moved - (1 if t.op == "+" else -1) * Fraction(v.value)
        elif t.op == "+":
            t, moved = v, moved - Fraction(u.value or 0.0)
        else:
            break
    value = float(abs(moved))
    return t + value if moved < 0 else t - value
