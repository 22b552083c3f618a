"""Expressions on balls: values and slopes that enclose the exact ones, at any number of bits.

Input: an expression and a jet for each of its symbols. Output: its jet. A jet is a ball about the value and one about
each slope; where a ball straddles a crease of `abs`, `min`, `max` or `where` the slopes of both sides are enclosed, so
that the mean value theorem holds across it. The rules of differentiation are written here once more, forward, and share
nothing with `expr.gradient`. What is undefined on a part of a ball encloses everything: it is not finite. A ball about
what is never negative may reach below 0 all the same: roots and powers are told so, and take of it what there is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, cast

from lenscl.expr import Expr
from lenscl.expr.graph import Row, listing

if TYPE_CHECKING:
    from flint import arb


@dataclass(frozen=True, slots=True)
class Jet:
    """A value and its slopes, each a ball; and whether the function is known to be nowhere negative on it."""

    value: arb
    slopes: tuple[arb, ...]
    never_negative: bool = False

    @property
    def is_nonnegative(self) -> bool:
        """Whether no value of the function on its ball is negative."""
        return self.never_negative or bool(self.value >= 0)

    def by(self, value: arb, slope: arb) -> Jet:
        """Return a function of this: its value, and its slope times these."""
        return Jet(value, tuple(slope * each for each in self.slopes))


def jet(expression: Expr, given: Mapping[str, Jet]) -> Jet:
    """Enclose an expression and its slopes.

    Parameters
    ----------
    expression : Expr
        Any expression.
    given : mapping of str to Jet
        For every symbol that occurs, all with as many slopes.
    """
    from flint import arb

    nothing = (arb(0),) * len(next(iter(given.values())).slopes)
    at: list[Jet] = []
    rows = _rows(expression)
    for op, places, value, name in rows:
        if op == "symbol":
            at.append(given[str(name)])
        elif value is not None:
            at.append(Jet(arb(value), nothing))
        elif op == "power":
            at.append(_power(at[places[0]], int(cast(float, rows[places[1]][2]))))
        else:
            at.append(_RULES[op](*(at[place] for place in places)))
    return at[-1]


@lru_cache(maxsize=256)
def _rows(expression: Expr) -> tuple[Row, ...]:
    """Return an expression's operations in order; it is asked for thousands of times a ray."""
    return listing(expression)


def contains_zero(ball: arb) -> bool:
    """Say whether a ball may be zero; one that is not finite may."""
    return not (ball > 0 or ball < 0)


def _sum(u: Jet, v: Jet) -> Jet:
    slopes = tuple(a + b for a, b in zip(u.slopes, v.slopes, strict=True))
    return Jet(u.value + v.value, slopes, u.is_nonnegative and v.is_nonnegative)


def _difference(u: Jet, v: Jet) -> Jet:
    return Jet(u.value - v.value, tuple(a - b for a, b in zip(u.slopes, v.slopes, strict=True)))


def _negative(u: Jet) -> Jet:
    return Jet(-u.value, tuple(-each for each in u.slopes))


def _product(u: Jet, v: Jet) -> Jet:
    slopes = tuple(a * v.value + u.value * b for a, b in zip(u.slopes, v.slopes, strict=True))
    return Jet(u.value * v.value, slopes, u is v or (u.is_nonnegative and v.is_nonnegative))


def _quotient(u: Jet, v: Jet) -> Jet:
    w = u.value / v.value
    slopes = tuple((a - w * b) / v.value for a, b in zip(u.slopes, v.slopes, strict=True))
    return Jet(w, slopes, u.is_nonnegative and bool(v.value > 0))


def _power(u: Jet, n: int) -> Jet:
    slope = n * _whole_power(u.value, n - 1) if n else 0 * u.value
    raised = u.by(_whole_power(u.value, n), slope)
    return Jet(raised.value, raised.slopes, n % 2 == 0)


def _whole_power(x: arb, n: int) -> arb:
    """Raise a ball; where its middle is 0 python-flint takes the logarithm, and finds none."""
    if n <= 0 or not x.mid().is_zero() or not x.is_finite():
        return x**n
    most = x.upper() ** n
    return most.union(-most if n % 2 else 0 * most)


def _sqrt(u: Jet) -> Jet:
    w = _rising(u, lambda x: x.sqrt())
    return u.by(w, 1 / (2 * w))


def _rising(u: Jet, f: Callable[[arb], arb]) -> arb:
    """Enclose a function that rises from 0 at 0 and has no value below, on what a ball has of where it has some."""
    if u.is_nonnegative and not u.value > 0 and u.value.is_finite():
        nothing = u.value * 0
        return nothing.union(f(u.value.upper().max(nothing)))
    return f(u.value)


def _cbrt(u: Jet) -> Jet:
    low, high = (_cube_root(end) for end in (u.value.lower(), u.value.upper()))
    w = low.union(high)
    return u.by(w, 1 / (3 * w**2))


def _cube_root(x: Any) -> Any:
    if x.is_zero():  # of which python-flint has no root
        return x
    return -((-x).root(3)) if x < 0 else x.root(3)


def _either(u: Jet, v: Jet, value: arb | None = None) -> Jet:
    slopes = tuple(a.union(b) for a, b in zip(u.slopes, v.slopes, strict=True))
    return Jet(u.value.union(v.value) if value is None else value, slopes)


def _abs(u: Jet) -> Jet:
    if u.value > 0 or u.value < 0:
        return u if u.value > 0 else _negative(u)
    either = _either(u, _negative(u), abs(u.value))
    return Jet(either.value, either.slopes, never_negative=True)


def _least(u: Jet, v: Jet) -> Jet:
    if u.value < v.value or u.value > v.value:
        return u if u.value < v.value else v
    least = _either(u, v, u.value.min(v.value))
    return replace(least, never_negative=u.is_nonnegative and v.is_nonnegative)


def _greatest(u: Jet, v: Jet) -> Jet:
    if u.value < v.value or u.value > v.value:
        return u if u.value > v.value else v
    greatest = _either(u, v, u.value.max(v.value))
    return replace(greatest, never_negative=u.is_nonnegative or v.is_nonnegative)


def _where(a: Jet, b: Jet, u: Jet, v: Jet) -> Jet:
    if a.value < b.value or a.value >= b.value:
        return u if a.value < b.value else v
    return _either(u, v)


def _tanh(u: Jet) -> Jet:
    w = u.value.tanh()
    return u.by(w, 1 - w**2)


def _tan(u: Jet) -> Jet:
    w = u.value.tan()
    return u.by(w, 1 + w**2)


def _arc_sine(u: Jet) -> Jet:
    return u.by(u.value.asin(), 1 / (1 - u.value**2).sqrt())


def _arc_cosine(u: Jet) -> Jet:
    return u.by(u.value.acos(), -1 / (1 - u.value**2).sqrt())


def _hyperbolic_sine(u: Jet) -> Jet:
    return u.by(u.value.sinh(), u.value.cosh())


def _hyperbolic_cosine(u: Jet) -> Jet:
    return u.by(u.value.cosh(), u.value.sinh())


def _sign(u: Jet) -> Jet:
    return _step(u, lambda x: (x > 0) - (x < 0), jumps_at=0)


def _floor(u: Jet) -> Jet:
    return _step(u, lambda x: x.floor())


def _step(u: Jet, f: Callable[[Any], Any], jumps_at: int | None = None) -> Jet:
    """Enclose a function that never falls and whose values are whole numbers: where it jumps no slope bounds that.

    `jumps_at` is the value that it has in the midst of a jump, if it has another one there than on both sides.
    """
    from flint import arb

    if not u.value.is_finite():
        return u.by(arb("nan"), arb("nan"))
    low, high = (arb(f(end)) for end in (u.value.lower(), u.value.upper()))
    is_level = low == high and not (jumps_at is not None and low == jumps_at)
    is_still = all(each.is_zero() for each in u.slopes)  # made of numbers and parameters alone
    return u.by(low.union(high), arb(0) if is_level or is_still else arb("nan"))


def _hypot(u: Jet, v: Jet) -> Jet:
    return _sqrt(_sum(_power(u, 2), _power(v, 2)))


def _angle(y: Jet, x: Jet) -> Jet:
    from flint import arb

    square = x.value**2 + y.value**2
    if contains_zero(y.value) and not x.value > 0:  # on its cut it jumps by a full turn: no slope bounds that
        square = square * arb("nan")
    slopes = ((x.value * a - y.value * b) / square for a, b in zip(y.slopes, x.slopes, strict=True))
    known = y.value.is_finite() and x.value.is_finite()  # python-flint has an angle of what is undefined, too
    return Jet(arb.atan2(y.value, x.value) if known else y.value * x.value, tuple(slopes))


def _pow(u: Jet, p: Jet) -> Jet:
    if not u.is_nonnegative or not u.value.is_finite():  # python-flint has whole powers of negative numbers, too
        undefined = u.value / 0
        return u.by(undefined, undefined)
    if p.value > 0 and all(b.is_zero() for b in p.slopes):
        slope = p.value * (_rising(u, lambda x: x ** (p.value - 1)) if p.value > 1 else u.value ** (p.value - 1))
        return u.by(_rising(u, lambda x: x**p.value), slope)
    w = u.value**p.value
    slopes = (w * (b * u.value.log() + p.value * a / u.value) for a, b in zip(u.slopes, p.slopes, strict=True))
    return Jet(w, tuple(slopes))


def _norm(u: Jet, v: Jet, p: Jet) -> Jet:
    """Enclose (|u|^p + |v|^p)^(1/p), p >= 1; of its slopes none is steeper than u's and v's together."""
    size = _rising(_sum(_size_power(u, p), _size_power(v, p)), lambda x: x ** (1 / p.value))
    first, second = _norm_slope(u, size, p), _norm_slope(v, size, p)
    slopes = (first * a + second * b for a, b in zip(u.slopes, v.slopes, strict=True))
    return Jet(size, tuple(slopes), never_negative=True)


def _size_power(u: Jet, p: Jet) -> Jet:
    """Enclose |u|^p, without a slope."""
    size = Jet(abs(u.value), (), never_negative=True)
    return Jet(_rising(size, lambda x: x**p.value), (), never_negative=True)


def _norm_slope(u: Jet, norm: arb, p: Jet) -> arb:
    """Enclose sign(u) (|u| / norm)^(p - 1), which is between -1 and 1."""
    from flint import arb

    if not u.value.is_finite() or not norm.is_finite():
        return arb("nan")
    most = arb(0, 1)  # nothing more is known about u = v = 0, nor of an edge that u = 0 is, p = 1
    if u.value > 0 or u.value < 0:
        steep = (abs(u.value) / norm) ** (p.value - 1) if norm > 0 else most
        return _within(steep if u.value > 0 else -steep)
    if not (p.value > 1 and norm > 0):
        return most
    steep = _within((u.value.abs_upper() / norm) ** (p.value - 1))
    return steep.union(-steep)


def _within(ball: arb) -> arb:
    """Return a ball's part between -1 and 1, for what is known to lie there."""
    from flint import arb

    return ball.min(arb(1)).max(arb(-1)) if ball.is_finite() else arb(0, 1)


_RULES: dict[str, Callable[..., Jet]] = {
    "+": _sum,
    "-": _difference,
    "neg": _negative,
    "*": _product,
    "/": _quotient,
    "sqrt": _sqrt,
    "cbrt": _cbrt,
    "abs": _abs,
    "min": _least,
    "max": _greatest,
    "where": _where,
    "exp": lambda u: u.by(u.value.exp(), u.value.exp()),
    "log": lambda u: u.by(u.value.log(), 1 / u.value),
    "sin": lambda u: u.by(u.value.sin(), u.value.cos()),
    "cos": lambda u: u.by(u.value.cos(), -u.value.sin()),
    "tan": _tan,
    "asin": _arc_sine,
    "acos": _arc_cosine,
    "atan": lambda u: u.by(u.value.atan(), 1 / (1 + u.value**2)),
    "sinh": _hyperbolic_sine,
    "cosh": _hyperbolic_cosine,
    "sign": _sign,
    "floor": _floor,
    "tanh": _tanh,
    "atan2": _angle,
    "hypot": _hypot,
    "pow": _pow,
    "norm": _norm,
}
