"""Random trees of all operations as texts, and what they mean in three other programs: numpy, mpmath and flint.

Nothing of `lenscl.expr` takes part in the meaning: a text is run by Python itself, with `^` written `**` and with the
functions of the one or the other program. Of flint's balls it says what a text may be on a piece of a ray.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping
from functools import reduce
from typing import Any

import mpmath
import numpy as np
from flint import arb
from numpy.typing import NDArray

Array = NDArray[Any]

DEPTH = 5
DIGITS = 60  # of mpmath's arithmetic
_CALLS = {"sqrt": 1, "cbrt": 1, "abs": 1, "exp": 1, "log": 1, "sin": 1, "cos": 1, "tan": 1, "tanh": 1, "atan2": 2,
          "hypot": 2, "min": 2, "max": 2, "pow": 2, "asin": 1, "acos": 1, "atan": 1, "sinh": 1, "cosh": 1, "sign": 1,
          "floor": 1, "mod": 2}  # fmt: skip
_NAMES = tuple(_CALLS)
_OFTEN = ("min", "max", "sqrt", "abs")  # where what is not known may be taken for what is
_NUMBERS = ("0.3", "0.5", "1", "2", "3", "0.7", "1.5", "4", "0.1", "5", "pi")
_POWERS = ("^2", "^2", "^3", "^4", "^-1", "^-2", "^0.5", "^1.5", "^(-0.5)", "^(1/3)")
_ABOUT = ("x", "y", "z", "x", "y", "z", "(x - 0.3)", "(x + y)", "(2*z - 0.4)", "(y - 0.5*z)", "(x^2 + y^2)",
          "(x^2 + y^2 + z^2)", "(x*y)")  # fmt: skip


def tree(rng: random.Random, depth: int = DEPTH) -> str:
    """Return the text of a tree so deep at most, with poles and ends of domains anywhere."""
    if depth == 0 or rng.random() < 0.08:
        return rng.choice(_ABOUT) if rng.random() < 0.8 else rng.choice(_NUMBERS)
    way = rng.random()
    if way < 0.42:
        return f"({tree(rng, depth - 1)} {rng.choice('++--**/')} {tree(rng, depth - 1)})"
    if way < 0.52:
        return f"({tree(rng, depth - 1)}){rng.choice(_POWERS)}"
    if way < 0.57:
        return f"(-{tree(rng, depth - 1)})"
    name = rng.choice(_OFTEN if rng.random() < 0.3 else _NAMES)
    if name == "pow":
        return f"pow({tree(rng, depth - 1)}, {rng.choice(('1.5', '0.3', '-0.7', '2.5', tree(rng, 1)))})"
    return f"{name}({', '.join(tree(rng, depth - 1) for _ in range(_CALLS[name]))})"


def _function(text: str, words: Mapping[str, Callable[..., Any]]) -> Callable[[Any, Any, Any], Any]:
    source = f"lambda x, y, z: {text.replace('^', '**')}"
    function: Callable[[Any, Any, Any], Any] = eval(source, {"__builtins__": {}, **words})
    return function


_NUMPY: dict[str, Callable[..., Any]] = {
    **{name: getattr(np, name) for name in ("sqrt", "cbrt", "abs", "exp", "log", "sin", "cos", "tan", "tanh", "hypot")},
    **{name: getattr(np, name) for name in ("sinh", "cosh", "sign", "floor", "mod")},
    "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "atan2": np.arctan2, "pi": math.pi,
    "min": lambda *some: reduce(np.minimum, some), "max": lambda *some: reduce(np.maximum, some),
    "pow": lambda u, p: np.power(np.where(u >= 0, u, np.nan), p),
}  # fmt: skip


def by_numpy(text: str, dtype: Any = np.longdouble) -> Callable[[Array, Array, Array], Array]:
    """Return a text's meaning on arrays; NaN where it is undefined, also in part: min(nan, 1) is NaN."""
    function = _function(text, _NUMPY)

    def value(x: Array, y: Array, z: Array) -> Array:
        with np.errstate(all="ignore"):
            return np.asarray(function(*(np.asarray(each, dtype) for each in (x, y, z))))

    return value


class _UndefinedError(ArithmeticError):
    pass


class Real:
    """A real number of mpmath; an operation that leaves the real numbers raises."""

    __slots__ = ("value",)

    def __init__(self, value: Any) -> None:
        if isinstance(value, mpmath.mpc) or not mpmath.isfinite(value):
            raise _UndefinedError
        self.value = value

    def __add__(self, other: Any) -> Real:
        return Real(self.value + _of(other))

    def __radd__(self, other: Any) -> Real:
        return Real(_of(other) + self.value)

    def __sub__(self, other: Any) -> Real:
        return Real(self.value - _of(other))

    def __rsub__(self, other: Any) -> Real:
        return Real(_of(other) - self.value)

    def __mul__(self, other: Any) -> Real:
        return Real(self.value * _of(other))

    def __rmul__(self, other: Any) -> Real:
        return Real(_of(other) * self.value)

    def __truediv__(self, other: Any) -> Real:
        return _divided(self.value, _of(other))

    def __rtruediv__(self, other: Any) -> Real:
        return _divided(_of(other), self.value)

    def __neg__(self) -> Real:
        return Real(-self.value)

    def __pow__(self, power: Any) -> Real:
        p = _of(power)
        if (p != int(p) and self.value < 0) or (self.value == 0 and p < 0):
            raise _UndefinedError
        return Real(mpmath.power(self.value, int(p) if p == int(p) else p))


def _of(value: Any) -> Any:
    return value.value if isinstance(value, Real) else mpmath.mpf(value)


def _divided(u: Any, v: Any) -> Real:
    if v == 0:
        raise _UndefinedError
    return Real(u / v)


def _word(function: Callable[..., Any]) -> Callable[..., Real]:
    return lambda *args: Real(function(*(_of(arg) for arg in args)))


def _angle(u: Any, v: Any) -> Any:
    if u == 0 and v == 0:
        raise _UndefinedError
    return mpmath.atan2(u, v)


def _within_one(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    def arc(u: Any) -> Any:
        if abs(u) > 1:
            raise _UndefinedError
        return function(u)

    return arc


def _remainder(u: Any, v: Any) -> Any:
    if v == 0:
        raise _UndefinedError
    return u - v * mpmath.floor(u / v)


def _logarithm(u: Any) -> Any:
    if u <= 0:
        raise _UndefinedError
    return mpmath.log(u)


_MPMATH: dict[str, Callable[..., Any]] = {
    **{name: _word(getattr(mpmath, name)) for name in ("sqrt", "exp", "sin", "cos", "tan", "tanh", "hypot")},
    "abs": _word(abs), "min": _word(min), "max": _word(max), "atan2": _word(_angle), "log": _word(_logarithm),
    **{name: _word(getattr(mpmath, name)) for name in ("atan", "sinh", "cosh", "sign", "floor")},
    **{name: _word(_within_one(getattr(mpmath, name))) for name in ("asin", "acos")},
    "mod": _word(_remainder), "pi": math.pi,
    "cbrt": _word(lambda u: mpmath.sign(u) * mpmath.cbrt(abs(u))),
    "pow": lambda u, p: Real(_of(u)) ** p if _of(u) >= 0 else _refused(),
}  # fmt: skip


def _refused() -> Real:
    raise _UndefinedError


def by_mpmath(text: str) -> Callable[[Any, Any, Any], Any]:
    """Return a text's meaning at a point, to many digits; None where it is undefined or a pole."""
    function = _function(text, _MPMATH)

    def value(x: Any, y: Any, z: Any) -> Any:
        with mpmath.workdps(DIGITS):
            try:
                return _of(function(*(Real(mpmath.mpf(each)) for each in (x, y, z))))
            except (ArithmeticError, ValueError, MemoryError):
                return None

    return value


class Ball:
    """All that a real number may be; where it is not known, also one that is not defined, its ball is not finite."""

    __slots__ = ("ball",)

    def __init__(self, ball: arb) -> None:
        self.ball = ball

    def __add__(self, other: Any) -> Ball:
        return Ball(self.ball + _ball(other))

    __radd__ = __add__

    def __sub__(self, other: Any) -> Ball:
        return Ball(self.ball - _ball(other))

    def __rsub__(self, other: Any) -> Ball:
        return Ball(_ball(other) - self.ball)

    def __mul__(self, other: Any) -> Ball:
        return Ball(self.ball * _ball(other))

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Ball:
        return Ball(self.ball / _ball(other))

    def __rtruediv__(self, other: Any) -> Ball:
        return Ball(_ball(other) / self.ball)

    def __neg__(self) -> Ball:
        return Ball(-self.ball)

    def __pow__(self, power: Any) -> Ball:
        p = float(_ball(power).mid())
        return Ball(self.ball ** int(p)) if p == int(p) else Ball(_risen(self.ball, _ball(power)))


def _ball(value: Any) -> arb:
    return value.ball if isinstance(value, Ball) else arb(str(value))


def _ends(function: Callable[[arb], arb], u: arb) -> arb:
    """Return what a function that never falls may be."""
    return function(u.lower()).union(function(u.upper()))


def _risen(u: arb, p: arb) -> arb:
    return (u.log() * p).exp() if u > 0 else arb("nan")


def _cube_root(u: arb) -> arb:
    def root(end: arb) -> arb:
        return end.root(3) if end > 0 else -((-end).root(3)) if end < 0 else arb(0)

    return _ends(root, u) if u.is_finite() else u


def _lesser(u: arb, v: arb) -> arb:
    return u if u < v else v if v < u else (u + v - abs(u - v)) / 2


def _ball_word(function: Callable[..., arb]) -> Callable[..., Ball]:
    return lambda *some: Ball(reduce(function, map(_ball, some)) if len(some) > 1 else function(_ball(some[0])))


_FLINT: dict[str, Callable[..., Any]] = {
    **{name: _ball_word(getattr(arb, name)) for name in ("sqrt", "exp", "log", "sin", "cos", "tan", "tanh", "atan2")},
    **{name: _ball_word(getattr(arb, name)) for name in ("asin", "acos", "atan", "sinh", "cosh", "floor")},
    "sign": _ball_word(lambda u: u.sgn() if u.is_finite() else arb("nan")),
    "mod": _ball_word(lambda u, v: u - v * (u / v).floor()), "pi": math.pi,
    "abs": _ball_word(abs), "cbrt": _ball_word(_cube_root), "min": _ball_word(_lesser),
    "max": _ball_word(lambda u, v: -_lesser(-u, -v)), "pow": _ball_word(_risen),
    "hypot": _ball_word(lambda u, v: (u**2 + v**2).sqrt()),
}  # fmt: skip


def by_balls(text: str) -> Callable[[arb, arb, arb], arb]:
    """Return what a text may be anywhere in a box of balls."""
    function = _function(text, _FLINT)
    return lambda x, y, z: _ball(function(Ball(x), Ball(y), Ball(z)))
