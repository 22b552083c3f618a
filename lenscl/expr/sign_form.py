"""Replace an expression by one of the same sign that is easier to search: remove monotonic functions from its outside.

tanh(5 F), exp(F) - 1, sqrt(F + 1/4) - 1/2, F^3 and log(1 + F) have the sign of F, so their surface is that of F. F is
often a polynomial. Its roots may be simple, and its normal defined, where those of F^3 are not. Inside an expression,
sqrt(u^2) becomes |u|, and sqrt(u)^2 becomes u.

The result is called a sign form. Two properties are proved of it. It has the sign of the written expression wherever
that has a value. Its domain is the same, but for places where the sign has a limit, as at a logarithm's pole. So a
square root or a logarithm is removed only if its operand is proved never to be negative (`facts`). A divisor is removed
only if it is proved never to be 0. A number that moves through a function is rounded once. Parameters may have any
value.

`sign_rules` has the rules that keep the sign, `identities` those that keep the value.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from lenscl.expr.facts import Facts
from lenscl.expr.graph import Expr, build, walk
from lenscl.expr.identities import IDENTITIES
from lenscl.expr.root_free import without_root
from lenscl.expr.sign_rules import NOTHING, OUTER, Level, Step

_DEEPEST = 100  # functions that are removed one after the other
_MOST_PARTS = 200  # of max, min and abs
_MOST_CHOICES = 4  # of max and min: with more it is not tried whether an operand is redundant


def sign_form(expr: Expr, facts: Facts) -> Expr:
    """Return an expression of the same sign; the same expression if no rule applies.

    Parameters
    ----------
    expr : Expr
        F in x, y, z and parameters, whose values `facts` must not know.
    facts : Facts
        Proofs of signs over the box in which F is searched.
    """
    plain = _rewritten(expr, facts)
    if sum(each.op in ("max", "min", "abs") for each in walk([plain])) > _MOST_PARTS:
        return plain  # a solid of many faces: each would have to be treated in turn
    found = _sign(plain, NOTHING, facts)
    form = plain if found is None else _rewritten(found, facts)
    choices = sum(each.op in ("max", "min") for each in walk([form]))
    return _decisive(form, facts) if choices <= _MOST_CHOICES else form


def _decisive(t: Expr, facts: Facts) -> Expr:
    """Remove operands of max and min that never decide the sign, such as a ball around the whole solid."""
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
    """Return an expression of the sign of t - c, None if no rule applies; `depth`: functions removed around t."""
    if depth > _DEEPEST:
        return None
    outer, sign = t, 1
    while depth and c == 0 and t.op in ("*", "/", "neg") and (step := _first(facts, t, c, is_affine=True)):
        t, sign = step.u, sign * step.sign  # inside a removed function the scale of t has no meaning
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
    """Return an expression of the sign of max(args) - c or min(args) - c; None if no rule applies to either operand."""
    parts = [_sign(arg, c, facts, depth) for arg in args]
    if parts == [None, None]:
        return None
    return build(op, *(_difference(arg, c) if part is None else part for arg, part in zip(args, parts, strict=True)))


def _difference(t: Expr, c: Level) -> Expr:
    """Return t - c. The numbers added in t and c become one number, rounded once."""
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
