"""The simplification rules, one row each: operation, identity, and what does it.

They fold numbers, drop neutral elements, and lead products with their number, so that derivatives read as a person
would write them. They never expand, factor or re-order: a surface is written in the form that is best conditioned.
Only `0 u = 0`, `0 / u = 0` and `u - u = 0` may turn a value that is not finite into one that is.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce

from lenscl.expr.graph import MAX_POWER, Expr, build, node, number

ZERO, ONE = number(0.0), number(1.0)


@dataclass(frozen=True, slots=True)
class Rule:
    """One identity. `apply` takes the operands and gives the simpler node, or None where it does not fit."""

    op: str
    identity: str
    apply: Callable[..., Expr | None]


def _folded(*args: Expr, by: Callable[..., float]) -> Expr | None:
    values = [each.value for each in args]
    if None in values:
        return None
    try:
        result = by(*values)
    except (ArithmeticError, ValueError):
        return None  # left as written: the reader reports it, evaluation gives what IEEE 754 says
    return number(result) if math.isfinite(result) else None


def _lead(u: Expr) -> float:
    """Return the number at the head of a product, or 1."""
    while u.op == "*":
        u = u.args[0]
    return 1.0 if u.value is None else u.value


def _times(u: Expr, v: Expr) -> Expr:
    return build("*", u, v)


def _factors(u: Expr) -> tuple[Expr, list[Expr]]:
    """Split a product into its head and the factors after it, in a loop: products may be thousands long."""
    factors = []
    while u.op == "*":
        u, factor = u.args
        factors.append(factor)
    return u, factors[::-1]


def _scaled(factor: float, u: Expr) -> Expr:
    """Multiply by a number, at the head of the product; in front of it where the two have no product that is finite."""
    if u.op == "neg":
        return _scaled(-factor, u.args[0])
    head, factors = _factors(u)
    if head.value is not None:
        merged = factor * head.value
        if not math.isfinite(merged) or (merged == 0.0 and head is not ZERO):
            return node("*", number(factor), u)
        return reduce(_times, factors, number(merged))
    if factor == 1.0:
        return u
    if factor == -1.0:
        return build("neg", u)
    return reduce(_times, factors, node("*", number(factor), head))


def _rest(u: Expr) -> Expr:
    """Return a product without the number at its head."""
    head, factors = _factors(u)
    if head.value is None:
        return u
    return reduce(_times, factors, ONE)


def _merged(u: Expr, v: Expr) -> Expr | None:
    if v.value is None and _lead(v) == 1.0:
        return None  # looked at first, so that long products are built in linear time
    factor = _lead(u) * _lead(v)
    if not math.isfinite(factor) or factor == 0.0:
        return None
    if u.value is not None and v.op != "*":
        return None
    return _scaled(factor, build("*", _rest(u), _rest(v)))


def _base_power(u: Expr) -> tuple[Expr, int]:
    if u.op == "power":
        assert u.args[1].value is not None
        return u.args[0], int(u.args[1].value)
    return u, 1


def power(u: Expr, n: int) -> Expr:
    """Raise to an integer power; a negative one is the reciprocal.

    Raises
    ------
    ValueError
        If |n| > MAX_POWER.
    """
    if abs(n) > MAX_POWER:
        raise ValueError(f"an integer power may be at most {MAX_POWER}, got {n}")
    return build("power", u, number(n)) if n >= 0 else build("/", ONE, build("power", u, number(-n)))


def _like_powers(u: Expr, v: Expr) -> Expr | None:
    (base, m), (other, n) = _base_power(u), _base_power(v)
    return power(base, m + n) if base is other and base.value is None and m + n <= MAX_POWER else None


def _last_like(u: Expr, v: Expr) -> Expr | None:
    like = _like_powers(u.args[1], v) if u.op == "*" else None
    return None if like is None else build("*", u.args[0], like)


def _nested_power(u: Expr, n: Expr) -> Expr | None:
    base, m = _base_power(u)
    assert n.value is not None
    return power(base, m * int(n.value)) if u.op == "power" and m * n.value <= MAX_POWER else None


def _negative_base(u: Expr, n: Expr) -> Expr | None:
    if u.op != "neg":
        return None
    assert n.value is not None
    result = build("power", u.args[0], n)
    return result if n.value % 2 == 0 else -result


def _whole_ratio(u: Expr, v: Expr) -> Expr | None:
    above, below = _lead(u), _lead(v)
    if below in (0.0, 1.0) or above % below != 0.0 or not math.isfinite(above / below):
        return None
    return build("/", _scaled(above / below, _rest(u)), _rest(v))


def _halved(u: Expr, v: Expr) -> Expr | None:
    if v.value is None or not 2.0**-1000 <= abs(v.value) <= 2.0**1000 or abs(math.frexp(v.value)[0]) != 0.5:
        return None
    return number(1.0 / v.value) * u


def _real_power(u: Expr, p: Expr) -> Expr | None:
    if p.value is None or p.value != int(p.value):
        return None
    return power(u, int(p.value))


def _negated_lead(u: Expr) -> Expr | None:
    """Return -u where that is simpler than u: u is a negative number or led by one, or a negation."""
    if u.op == "neg":
        return u.args[0]
    if u.op == "/" and _lead(u.args[0]) < 0.0:
        return _negated_ratio(u)
    return _scaled(-1.0, u) if _lead(u) < 0.0 else None


def _negated_ratio(u: Expr) -> Expr:
    return build("/", _scaled(-1.0, u.args[0]), u.args[1])


def _plus_negative(u: Expr, v: Expr) -> Expr | None:
    positive = _negated_lead(v)
    return None if positive is None else build("-", u, positive)


def _negative_plus(u: Expr, v: Expr) -> Expr | None:
    positive = None if u.value is not None else _negated_lead(u)
    return None if positive is None else build("-", v, positive)


def _minus_negative(u: Expr, v: Expr) -> Expr | None:
    positive = _negated_lead(v)
    return None if positive is None else build("+", u, positive)


_TABLE: tuple[Rule, ...] = (
    Rule("neg", "-(number) is a number", lambda u: _folded(u, by=lambda a: -a)),
    Rule("neg", "-(-u) = u, -(c u) = (-c) u", lambda u: _scaled(-1.0, u) if u.op == "*" and _lead(u) != 1.0 else None),
    Rule("neg", "-(-u) = u", lambda u: u.args[0] if u.op == "neg" else None),
    Rule(
        "neg",
        "-(c u / v) = (-c u) / v",
        lambda u: _negated_ratio(u) if u.op == "/" and _lead(u.args[0]) != 1.0 else None,
    ),
    Rule("neg", "-(u - v) = v - u", lambda u: u.args[1] - u.args[0] if u.op == "-" else None),
    Rule("+", "number + number", lambda u, v: _folded(u, v, by=lambda a, b: a + b)),
    Rule("+", "0 + u = u", lambda u, v: v if u is ZERO else None),
    Rule("+", "u + 0 = u", lambda u, v: u if v is ZERO else None),
    Rule("+", "u + u = 2 u", lambda u, v: _scaled(2.0, u) if u is v else None),
    Rule("+", "u + (-v) = u - v", _plus_negative),
    Rule("+", "-u + v = v - u, -c u + v = v - c u", _negative_plus),
    Rule("-", "number - number", lambda u, v: _folded(u, v, by=lambda a, b: a - b)),
    Rule("-", "u - 0 = u", lambda u, v: u if v is ZERO else None),
    Rule("-", "0 - u = -u", lambda u, v: -v if u is ZERO else None),
    Rule("-", "u - u = 0", lambda u, v: ZERO if u is v else None),
    Rule("-", "u - (-v) = u + v", _minus_negative),
    Rule("*", "number number", lambda u, v: _folded(u, v, by=lambda a, b: a * b)),
    Rule("*", "0 u = u 0 = 0", lambda u, v: ZERO if ZERO in (u, v) else None),
    Rule("*", "1 u = u", lambda u, v: v if u is ONE else None),
    Rule("*", "u 1 = u", lambda u, v: u if v is ONE else None),
    Rule("*", "(-1) u = -u", lambda u, v: -v if u.value == -1.0 else None),
    Rule("*", "(-u) v = -(u v)", lambda u, v: -(u.args[0] * v) if u.op == "neg" else None),
    Rule("*", "u (-v) = -(u v)", lambda u, v: -(u * v.args[0]) if v.op == "neg" else None),
    Rule("*", "(c u) (d v) = (c d u) v", _merged),
    Rule("*", "u^m u^n = u^(m + n)", _like_powers),
    Rule("*", "(v u^m) u^n = v u^(m + n)", _last_like),
    Rule("/", "number / number", lambda u, v: _folded(u, v, by=lambda a, b: a / b)),
    Rule("/", "0 / u = 0", lambda u, v: ZERO if u is ZERO and v is not ZERO else None),
    Rule("/", "u / 1 = u", lambda u, v: u if v is ONE else None),
    Rule("/", "(-u) / v = -(u / v)", lambda u, v: -(u.args[0] / v) if u.op == "neg" else None),
    Rule("/", "(c u) / (d v) = (c / d u) / v, c / d whole", _whole_ratio),
    Rule("/", "u / 2^k = 2^-k u", _halved),
    Rule("power", "number^n", lambda u, n: _folded(u, n, by=lambda a, b: a ** int(b))),
    Rule("power", "u^0 = 1", lambda u, n: ONE if n is ZERO else None),
    Rule("power", "u^1 = u", lambda u, n: u if n is ONE else None),
    Rule("power", "(u^m)^n = u^(m n)", _nested_power),
    Rule("power", "(-u)^n = +- u^n", _negative_base),
    Rule("pow", "u^p, p whole, is an integer power", _real_power),
    Rule("abs", "|number|", lambda u: _folded(u, by=abs)),
    Rule("abs", "||u|| = |u|", lambda u: u if u.op == "abs" else None),
    Rule("abs", "|-u| = |u|", lambda u: build("abs", u.args[0]) if u.op == "neg" else None),
    Rule("min", "min(u, u) = u", lambda u, v: u if u is v else None),
    Rule("max", "max(u, u) = u", lambda u, v: u if u is v else None),
    Rule("where", "u on both branches", lambda a, b, u, v: u if u is v else None),
)

RULES: dict[str, tuple[Rule, ...]] = {op: tuple(r for r in _TABLE if r.op == op) for op in {r.op for r in _TABLE}}
