"""The rules of `sign_form` that keep the value of an expression: one row each, for roots of squares and the like.

A row of `IDENTITIES` replaces an operation by an expression of the same value and the same domain. A rule applies only
where `facts` proves its condition.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

from lenscl.expr.facts import Facts
from lenscl.expr.graph import MAX_POWER, Expr, build, number
from lenscl.expr.operations import whole
from lenscl.expr.simplify import power

_LARGEST_POWER = 1e300  # of an exponent: its products with small integers do not overflow


@dataclass(frozen=True, slots=True)
class Identity:
    """A rule that keeps an operation's value and its domain."""

    op: str
    identity: str
    condition: str
    apply: Callable[[Facts, Expr], Expr | None]


def _root_of_power(_: Facts, w: Expr) -> Expr | None:
    (u,) = w.args
    if u.op != "power" or whole(u.args[1]) % 2:
        return None
    half = whole(u.args[1]) // 2
    return power(u.args[0] if half % 2 == 0 else build("abs", u.args[0]), half)


def _power_of_root(facts: Facts, w: Expr) -> Expr | None:
    base, n = w.args[0], whole(w.args[1])
    match base.op:
        case "sqrt" if n % 2 == 0 and facts.is_nonnegative(base.args[0]):
            return power(base.args[0], n // 2)
        case "cbrt" if n % 3 == 0:
            return power(base.args[0], n // 3)
        case "abs" if n % 2 == 0:
            return power(base.args[0], n)
        case "hypot" if n % 2 == 0:
            return power(power(base.args[0], 2) + power(base.args[1], 2), n // 2)
    return None


def _root_of_cube(_: Facts, w: Expr) -> Expr | None:
    (u,) = w.args
    return power(u.args[0], whole(u.args[1]) // 3) if u.op == "power" and whole(u.args[1]) % 3 == 0 else None


def _size(facts: Facts, w: Expr) -> Expr | None:
    low = facts.low(w.args[0])
    return w.args[0] if low is not None and low >= 0 else None


def _real_power_of_square(facts: Facts, w: Expr) -> Expr | None:
    u, p = w.args
    if p.value == 0.5:
        root = build("sqrt", u)
        return _root_of_power(facts, root) or root
    if u.op != "power" or whole(u.args[1]) % 2 or abs(p.value or 0.0) > _LARGEST_POWER:
        return None
    n = whole(u.args[1])
    size = build("abs", u.args[0])
    size = _size(facts, size) or size
    if p.value is None:
        return build("pow", size, number(float(n)) * p)
    total = Fraction(p.value) * n
    if total.denominator == 1 and 0 < total <= MAX_POWER:
        return power(u.args[0] if total % 2 == 0 else size, int(total))
    return build("pow", size, number(float(total)))


def _inverse(_: Facts, w: Expr) -> Expr | None:
    (u,) = w.args
    return u.args[0] if u.op == "exp" else None


IDENTITIES: tuple[Identity, ...] = (
    Identity("sqrt", "sqrt(u^2) = |u|, sqrt(u^(2 n)) = |u|^n", "", _root_of_power),
    Identity("power", "sqrt(u)^(2 n) = u^n; hypot and |u| and cbrt likewise", "sqrt: u >= 0", _power_of_root),
    Identity("cbrt", "cbrt(u^(3 n)) = u^n", "", _root_of_cube),
    Identity("abs", "|u| = u", "u >= 0", _size),
    Identity("pow", "u^0.5 = sqrt(u), (u^(2 m))^p = |u|^(2 m p)", "", _real_power_of_square),
    Identity("log", "log(exp(u)) = u", "", _inverse),
)
