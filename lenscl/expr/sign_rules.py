"""The rules of `sign_form` that keep the sign of an expression, not its value: one row each.

A row of `OUTER` states for an operation t and a level c that t - c has the sign of u - d, or of d - u. A rule applies
only where `facts` proves its condition.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import TypeAlias

from lenscl.expr.facts import Facts
from lenscl.expr.graph import Expr, build, number, walk
from lenscl.expr.operations import whole
from lenscl.expr.simplify import power

Level: TypeAlias = "Fraction | Expr"  # an exact number, or an expression of parameters alone
NOTHING = Fraction(0)
_ANALYTIC = (
    *("+", "-", "neg", "*", "/", "power", "exp", "log", "sin", "cos", "tan"),
    *("asin", "acos", "atan", "sinh", "cosh", "tanh"),
)
_QUARTER_TURN = 1.57  # and a little less
_COORDINATES = ("x", "y", "z")
_ODD = ("tanh", "cbrt", "atan", "sinh")  # increasing, odd, and defined for all numbers


@dataclass(frozen=True, slots=True)
class Step:
    """t - c has the sign of `sign` (u - d)."""

    sign: int
    u: Expr
    d: Level


@dataclass(frozen=True, slots=True)
class Outer:
    """A rule for the sign of t - c, t an operation; ~ in `identity` stands for "has the sign of".

    `apply` applies the rule to t and c, and returns None if it does not fit. `is_affine`: t is an affine function of u.
    Such rules alone make no expression easier to search.
    """

    op: str
    identity: str
    condition: str
    apply: Callable[[Facts, Expr, Level], Step | None]
    is_affine: bool = False


def _level(of: Expr) -> Level | None:
    """Return an expression as a level, None if it depends on x, y or z."""
    if of.value is not None:
        return Fraction(of.value)
    return None if of.depends_on(_COORDINATES) else of


def _add(c: Level, d: Level, sign: int = 1) -> Level:
    if isinstance(c, Fraction) and isinstance(d, Fraction):
        return c + sign * d
    a, b = _expr(c), _expr(d)
    return a + b if sign > 0 else a - b


def _expr(c: Level) -> Expr:
    return c if isinstance(c, Expr) else number(float(c))


def _by(c: Level, function: Callable[[float], float]) -> Fraction | None:
    """Return a function of a number, rounded; None for a level with parameters, and where it has no finite value."""
    if isinstance(c, Expr):
        return None
    try:
        return Fraction(function(float(c)))
    except (ArithmeticError, ValueError):
        return None


# --- t - c


def _negation(_: Facts, t: Expr, c: Level) -> Step | None:
    return Step(-1, t.args[0], -c)


def _sum(_: Facts, t: Expr, c: Level) -> Step | None:
    u, v = t.args
    if (level := _level(v)) is not None:
        return Step(1, u, _add(c, level, -1))
    level = _level(u)
    return None if level is None else Step(1, v, _add(c, level, -1))


def _less(_: Facts, t: Expr, c: Level) -> Step | None:
    u, v = t.args
    if (level := _level(v)) is not None:
        return Step(1, u, _add(c, level))
    level = _level(u)
    return None if level is None else Step(-1, v, _add(level, c, -1))


def _multiple(_: Facts, t: Expr, c: Level) -> Step | None:
    for factor, u in (t.args, t.args[::-1]):
        if factor.value:
            d = c / Fraction(factor.value) if isinstance(c, Fraction) else c / factor
            return Step(1 if factor.value > 0.0 else -1, u, d)
    return None


def _share(_: Facts, t: Expr, c: Level) -> Step | None:
    u, v = t.args
    if not v.value:
        return None
    d = c * Fraction(v.value) if isinstance(c, Fraction) else c * v
    return Step(1 if v.value > 0.0 else -1, u, d)


def _factor(facts: Facts, t: Expr, c: Level) -> Step | None:
    if c != 0:
        return None
    for factor, u in (t.args[::-1], t.args):
        sign = _sure_sign(facts, factor) if factor.value is None else 0
        if sign:
            return Step(sign, u, NOTHING)
    return None


def _signed_size(facts: Facts, t: Expr, c: Level) -> Step | None:
    for size, u in (t.args[::-1], t.args):
        if c == 0 and u.depends_on(_COORDINATES) and _is_size(facts, size, _core(u)):
            return Step(1, u, NOTHING)
        if isinstance(c, Fraction) and size.op == "abs" and size.args[0] is u:
            root = _by(abs(c), math.sqrt)
            return None if root is None else Step(1, u, root if c > 0 else -root)
    return None


def _is_size(facts: Facts, w: Expr, core: Expr) -> bool:
    """Say whether w is 0 where `core` is 0, and positive where `core` has any other value."""
    match w.op:
        case "abs":
            return _core(w.args[0]) is core
        case "power":
            return _is_size(facts, w.args[0], core) or (whole(w.args[1]) % 2 == 0 and _core(w.args[0]) is core)
        case "sqrt" | "cbrt" | "tanh" | "atan" | "sinh":
            return _is_size(facts, w.args[0], core)
        case "pow":
            return (w.args[1].value or 0.0) > 0.0 and _is_size(facts, w.args[0], core)
        case "*" | "/":
            u, v = w.args
            if w.op == "*" and _is_size(facts, v, core):
                u, v = v, u
            is_kept = w.op == "*" and _is_size(facts, v, core)  # the other factor is such a size, too
            return _is_size(facts, u, core) and (is_kept or _sure_sign(facts, v) > 0)
    return False


def _core(u: Expr) -> Expr:
    """Return an expression with the zeros and the domain of u: u without constant factors, odd powers and the like."""
    while True:
        is_multiple = u.op in ("*", "/") and bool(u.args[1].value)
        if is_multiple or u.op in ("neg", *_ODD) or (u.op == "power" and whole(u.args[1]) % 2):
            u = u.args[0]
        elif u.op == "*" and u.args[0].value:
            u = u.args[1]
        else:
            return u


def _quotient(facts: Facts, t: Expr, c: Level) -> Step | None:
    u, v = t.args
    sign = _sure_sign(facts, v) if v.depends_on(_COORDINATES) else 0
    if not sign:
        return None
    return Step(sign, u if c == 0 else u - _expr(c) * v, NOTHING)


def _sure_sign(facts: Facts, u: Expr) -> int:
    """Return 1 or -1 if u is proved to have that sign at every place, else 0."""
    sign = 1 if facts.is_positive(u) else (-1 if facts.is_negative(u) else 0)
    return sign if sign and facts.is_total(u) else 0


def _reciprocal(facts: Facts, t: Expr, c: Level) -> Step | None:
    k, v = t.args
    if not k.value or isinstance(c, Expr) or k.value * c <= 0 or not facts.is_nonnegative(v):
        return None
    return Step(-1 if k.value > 0.0 else 1, v, Fraction(k.value) / c)


def _odd_power(_: Facts, t: Expr, c: Level) -> Step | None:
    u, n = t.args[0], whole(t.args[1])
    if n % 2 == 0 or n < 3:
        return None
    if isinstance(c, Expr):
        return Step(1, u, build("cbrt", c)) if n == 3 else None
    root = round(float(abs(c)) ** (1.0 / n)) if abs(c) < 2**53 else 0
    exact = Fraction(root) if Fraction(root) ** n == abs(c) else _by(abs(c), lambda size: size ** (1.0 / n))
    return None if exact is None else Step(1, u, exact if c >= 0 else -exact)


def _cube_root(_: Facts, t: Expr, c: Level) -> Step | None:
    return Step(1, t.args[0], c**3 if isinstance(c, Fraction) else power(c, 3))


def _tanh(_: Facts, t: Expr, c: Level) -> Step | None:
    d = _by(c, math.atanh)
    return None if d is None else Step(1, t.args[0], d)


def _arc_sine(facts: Facts, t: Expr, c: Level) -> Step | None:
    d = _by(c, lambda angle: math.sin(angle) if abs(angle) < _QUARTER_TURN else math.nan)
    return Step(1, t.args[0], d) if d is not None and facts.is_within_one(t.args[0]) else None


def _arc_cosine(facts: Facts, t: Expr, c: Level) -> Step | None:
    d = _by(c, lambda angle: math.cos(angle) if 0.0 < angle < 2.0 * _QUARTER_TURN else math.nan)
    return Step(-1, t.args[0], d) if d is not None and facts.is_within_one(t.args[0]) else None


def _arc_tangent(_: Facts, t: Expr, c: Level) -> Step | None:
    d = _by(c, lambda angle: math.tan(angle) if abs(angle) < _QUARTER_TURN else math.nan)
    return None if d is None else Step(1, t.args[0], d)


def _hyperbolic_sine(_: Facts, t: Expr, c: Level) -> Step | None:
    d = _by(c, math.asinh)
    return None if d is None else Step(1, t.args[0], d)


def _hyperbolic_cosine(_: Facts, t: Expr, c: Level) -> Step | None:
    d = _by(c, lambda level: math.acosh(level) if level > 1.0 else math.nan)
    return None if d is None else Step(1, build("abs", t.args[0]), d)


def _side(_: Facts, t: Expr, c: Level) -> Step | None:
    is_told = isinstance(c, Fraction) and abs(c) < 1 and (c == 0 or _is_nowhere_level(t.args[0]))
    return Step(1, t.args[0], NOTHING) if is_told else None


def _is_nowhere_level(u: Expr) -> bool:
    """Say whether u takes a value in no part of space, but on surfaces at most: it is analytic.

    max(u, 0) is 0 in a whole region. There sign(max(u, 0)) - 1/2 is negative, and max(u, 0) is not.
    """
    return all(not each.args or each.op in _ANALYTIC for each in walk([u]))


def _whole_part(_: Facts, t: Expr, c: Level) -> Step | None:
    # On a whole level the floor stays for a whole unit
    if isinstance(c, Expr) or c.denominator == 1 or not _is_nowhere_level(t.args[0]):
        return None
    return Step(1, t.args[0], Fraction(math.ceil(c)))


def _exponential(_: Facts, t: Expr, c: Level) -> Step | None:
    d = _by(c, math.log)
    return None if d is None else Step(1, t.args[0], d)


def _logarithm(facts: Facts, t: Expr, c: Level) -> Step | None:
    d = build("exp", c) if isinstance(c, Expr) else _by(c, math.exp)
    return Step(1, t.args[0], d) if d is not None and d != 0 and facts.is_nonnegative(t.args[0]) else None


def _square(c: Level) -> Level | None:
    """Return what a root of u >= 0 is compared by: u - c |c| has the sign of sqrt(u) - c. None for a number c <= 0."""
    if isinstance(c, Expr):
        return c * build("abs", c)
    return c * c if c > 0 else None


def _root(facts: Facts, t: Expr, c: Level) -> Step | None:
    d = _square(c)
    return Step(1, t.args[0], d) if d is not None and facts.is_nonnegative(t.args[0]) else None


def _distance(_: Facts, t: Expr, c: Level) -> Step | None:
    d, (u, v) = _square(c), t.args
    return None if d is None else Step(1, power(u, 2) + power(v, 2), d)


def _real_power(facts: Facts, t: Expr, c: Level) -> Step | None:
    u, p = t.args
    if not p.value or isinstance(c, Expr) or c <= 0 or not facts.is_nonnegative(u):
        return None
    exponent = 1.0 / p.value
    d = _by(c, lambda size: size**exponent)
    return Step(1 if p.value > 0.0 else -1, u, d) if d else None


def _angle(facts: Facts, t: Expr, c: Level) -> Step | None:
    u, v = t.args
    d = _by(c, lambda angle: math.tan(angle) if abs(angle) < _QUARTER_TURN else math.nan)
    if d is None or not (facts.is_positive(v) and facts.is_total(v)):
        return None
    return Step(1, u if d == 0 else u - _expr(d) * v, NOTHING)


def _alike(facts: Facts, t: Expr, c: Level) -> Step | None:
    u, v = t.args
    if c != 0 or u.op != v.op or not (u.depends_on(_COORDINATES) and v.depends_on(_COORDINATES)):
        return None
    if u.op in ("exp", *_ODD):
        return Step(1, u.args[0] - v.args[0], NOTHING)
    if u.op == "sqrt" and all(facts.is_nonnegative(each.args[0]) for each in (u, v)):
        return Step(1, u.args[0] - v.args[0], NOTHING)
    if u.op == "log" and all(facts.is_positive(each.args[0]) for each in (u, v)):
        return Step(1, u.args[0] - v.args[0], NOTHING)
    return None


def _opposite(_: Facts, t: Expr, c: Level) -> Step | None:
    u, v = t.args
    if c != 0 or u.op != v.op or u.op not in _ODD:
        return None
    return Step(1, u.args[0] + v.args[0], NOTHING)


OUTER: tuple[Outer, ...] = (
    Outer("neg", "-u - c ~ -(u + c)", "", _negation, is_affine=True),
    Outer("+", "tanh(u) + tanh(v) ~ u + v; cbrt, atan and sinh likewise", "c = 0", _opposite),
    Outer("+", "(u + k) - c ~ u - (c - k)", "k does not depend on the place", _sum, is_affine=True),
    Outer(
        "-",
        "h(u) - h(v) ~ u - v, h = exp, tanh, cbrt, atan, sinh, sqrt, log",
        "c = 0; sqrt: u, v >= 0; log: u, v > 0",
        _alike,
    ),
    Outer(
        "-",
        "(u - k) - c ~ u - (c + k), (k - u) - c ~ -(u - (k - c))",
        "k does not depend on the place",
        _less,
        is_affine=True,
    ),
    Outer("*", "k u - c ~ k (u - c / k)", "k a number, not 0", _multiple, is_affine=True),
    Outer("*", "u v ~ u", "c = 0; v > 0 everywhere; ~ -u where v < 0 everywhere", _factor),
    Outer("*", "u |u| - c ~ u - sign(c) sqrt(|c|); c = 0: sqrt(|u|), u^2 and the like for |u|", "", _signed_size),
    Outer("/", "u / k - c ~ k (u - c k)", "k a number, not 0", _share, is_affine=True),
    Outer("/", "u / v - c ~ u - c v", "v > 0 everywhere; ~ c v - u where v < 0 everywhere", _quotient),
    Outer("/", "k / u - c ~ k / c - u", "k and c of one sign, u >= 0; at u = 0 it is infinite", _reciprocal),
    Outer("power", "u^n - c ~ u - c^(1/n)", "n odd", _odd_power),
    Outer("cbrt", "cbrt(u) - c ~ u - c^3", "", _cube_root),
    Outer("tanh", "tanh(u) - c ~ u - artanh(c)", "|c| < 1", _tanh),
    Outer("asin", "asin(u) - c ~ u - sin(c)", "-1 <= u <= 1, |c| < 1.57", _arc_sine),
    Outer("acos", "acos(u) - c ~ -(u - cos(c))", "-1 <= u <= 1, 0 < c < 3.14", _arc_cosine),
    Outer("atan", "atan(u) - c ~ u - tan(c)", "|c| < 1.57", _arc_tangent),
    Outer("sinh", "sinh(u) - c ~ u - arsinh(c)", "", _hyperbolic_sine),
    Outer("cosh", "cosh(u) - c ~ |u| - arcosh(c)", "c > 1", _hyperbolic_cosine),
    Outer("sign", "sign(u) - c ~ u", "c = 0; |c| < 1 where u is analytic: at u = 0 it jumps", _side),
    Outer("floor", "floor(u) - c ~ u - ceil(c)", "c no whole number, u analytic", _whole_part),
    Outer("atan2", "atan2(u, v) - c ~ u - tan(c) v", "v > 0, |c| < 1.57", _angle),
    Outer("exp", "exp(u) - c ~ u - log(c)", "c > 0", _exponential),
    Outer("log", "log(u) - c ~ u - exp(c)", "u >= 0; at u = 0 it is minus infinity", _logarithm),
    Outer("sqrt", "sqrt(u) - c ~ u - c |c|", "u >= 0; no number c <= 0", _root),
    Outer("hypot", "hypot(u, v) - c ~ u^2 + v^2 - c |c|", "no number c <= 0", _distance),
    Outer("pow", "u^p - c ~ p (u - c^(1/p))", "u >= 0, c > 0, p a number", _real_power),
)
