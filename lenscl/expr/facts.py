"""Prove the sign and the domain of expressions over a box, by their structure or by interval arithmetic.

Input: an expression, and the box of x, y and z. Output: True if a statement is proved, False if not. The structure is
tried first: squares, absolute values, exponentials and numbers give exact bounds for all values of the parameters and
all places. If these prove nothing and no parameter occurs, the box is divided into eight parts, each part again into
eight, and so on, until interval bounds prove the statement on every part.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, TypeAlias

from lenscl.expr.derive import degree
from lenscl.expr.graph import Expr, walk
from lenscl.expr.operations import whole
from lenscl.expr.shares import is_share

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Mask = NDArray[np.bool_]

Bounds = tuple[Fraction | None, Fraction | None]  # lower and upper bound; None: unknown
Box = tuple[tuple[float, float, float], tuple[float, float, float]]
_Ends: TypeAlias = "Callable[[Expr], tuple[Array, Array]]"
_NEVER_NEGATIVE = ("sqrt", "hypot", "exp", "pow", "norm", "acos")
_ODD = ("cbrt", "sinh")  # of the sign of their operands
_ODD_BOUNDED = ("asin", "atan", "sign")
_WITHIN_ONE = ("sin", "cos", "tanh")
_WITHIN_TWO = Fraction(2)  # more than a quarter of a turn
_MAY_OVERFLOW = ("exp", "log", "pow", "/", "tan", "sinh", "cosh")  # of numbers of any size
_ZERO, _ONE = Fraction(0), Fraction(1)
_MOST_BITS = 65_536  # of an exact bound
_LEVELS = 7  # halvings of the box
_MOST_BOXES = 20_000
_WIDER = 1e-6  # of the box, added on every side: rays may leave it by rounding


@dataclass(frozen=True)
class Facts:
    """Proofs about expressions over a box; over all of space if there is none.

    Attributes
    ----------
    box : Box or None
        Lowest and highest corner.
    values : mapping of str to float
        Parameters whose values are known.
    """

    box: Box | None = None
    values: Mapping[str, float] = field(default_factory=dict)

    def is_nonnegative(self, u: Expr) -> bool:
        """Whether u >= 0 is proved wherever it is defined."""
        low = self.low(u)
        return (low is not None and low >= 0) or self._over_the_box(u)

    def is_positive(self, u: Expr) -> bool:
        """Whether u > 0 is proved wherever it is defined."""
        low = self.low(u)
        return (low is not None and low > 0) or self._never_zero(u) or self._over_the_box(u)

    def is_negative(self, u: Expr) -> bool:
        """Whether u < 0 is proved wherever it is defined."""
        high = self.high(u)
        return (high is not None and high < 0) or self._over_the_box(-u)

    def is_total(self, u: Expr) -> bool:
        """Whether u is proved to be defined everywhere."""
        return all(self._has_value(each) for each in walk([u]))

    def is_within_one(self, u: Expr) -> bool:
        """Whether -1 <= u <= 1 is proved wherever u is defined."""
        return is_share(u, Facts().is_nonnegative) or (self.is_nonnegative(1.0 - u) and self.is_nonnegative(1.0 + u))

    def low(self, u: Expr) -> Fraction | None:
        """Return a lower bound of u by its structure; None if none is known."""
        return self._bounds(u)[0]

    def high(self, u: Expr) -> Fraction | None:
        """Return an upper bound of u by its structure; None if none is known."""
        return self._bounds(u)[1]

    def _bounds(self, u: Expr) -> Bounds:
        at: dict[Expr, Bounds] = {}
        for each in walk([u]):
            at[each] = self._of_node(each, [at[arg] for arg in each.args])
        return at[u]

    def _of_node(self, each: Expr, parts: list[Bounds]) -> Bounds:
        value = each.value if each.op == "number" else self.values.get(str(each.name))
        if value is not None:
            return Fraction(value), Fraction(value)
        lows, highs = [low for low, _ in parts], [high for _, high in parts]
        match each.op:
            case "+":
                return _sum(*lows), _sum(*highs)
            case "-":
                return _sum(lows[0], _negative(highs[1])), _sum(highs[0], _negative(lows[1]))
            case "neg":
                return _negative(highs[0]), _negative(lows[0])
            case "*" if _exact(parts[0]) or _exact(parts[1]):
                first = _exact(parts[0])
                return _scaled(parts[1] if first else parts[0], first or _exact(parts[1]) or _ZERO)
            case "/" if divisor := _exact(parts[1]):
                return _scaled(parts[0], 1 / divisor)
            case "*" | "/":
                return (_ZERO if all(low is not None and low >= 0 for low in lows) else None), None
            case "power":
                return _of_power(parts[0], whole(each.args[1]))
            case "abs":
                return _of_size(parts[0])
            case op if op in _ODD:
                return _of_odd(parts[0], None)
            case op if op in _ODD_BOUNDED:
                return _of_odd(parts[0], _ONE if op == "sign" else _WITHIN_TWO)
            case "cosh":
                return _ONE, None
            case "floor":
                low, high = parts[0]
                return (
                    None if low is None else Fraction(math.floor(low)),
                    None if high is None else Fraction(math.floor(high)),
                )
            case "max":
                return max((low for low in lows if low is not None), default=None), _all(highs, max)
            case "min":
                return _all(lows, min), min((high for high in highs if high is not None), default=None)
            case op if op in _WITHIN_ONE:
                return -_ONE, _ONE
            case op if op in _NEVER_NEGATIVE:
                return _ZERO, None
        return None, None

    def _never_zero(self, u: Expr) -> bool:
        """Say whether u is proved positive by its structure, even without a positive lower bound."""
        bounds: dict[Expr, Bounds] = {}
        positive: dict[Expr, bool] = {}
        for each in walk([u]):
            bounds[each] = low, _ = self._of_node(each, [bounds[arg] for arg in each.args])
            positive[each] = (low is not None and low > 0) or self._is_positive_node(each, positive, bounds)
        return positive[u]

    def _is_positive_node(self, each: Expr, positive: Mapping[Expr, bool], bounds: Mapping[Expr, Bounds]) -> bool:
        args = each.args
        highs, lows = ([bounds[arg][end] for arg in args] for end in (1, 0))
        match each.op:
            case "exp" | "cosh":
                return True
            case "sqrt" | "pow" | "cbrt" | "asin" | "atan" | "sinh" | "sign":
                return positive[args[0]]
            case "abs" | "power":
                away = highs[0] is not None and highs[0] < 0 and (each.op == "abs" or whole(args[1]) % 2 == 0)
                return positive[args[0]] or away
            case "*" | "/" | "min":
                return all(positive[arg] for arg in args)
            case "+":
                never_negative = [
                    (low is not None and low >= 0) or positive[arg] for low, arg in zip(lows, args, strict=True)
                ]
                return any(positive[arg] for arg in args) and all(never_negative)
            case "max":
                return any(positive[arg] for arg in args)
        return False

    def _has_value(self, each: Expr) -> bool:
        """Say whether an operation has a value wherever its operands have one."""
        match each.op:
            case "/":
                return self.is_positive(each.args[1]) or self.is_negative(each.args[1])
            case "sqrt":
                return self.is_nonnegative(each.args[0])
            case "log":
                return self.is_positive(each.args[0])
            case "asin" | "acos":
                return self.is_within_one(each.args[0])
            case "pow":
                base, exponent = each.args
                rises = exponent.value is not None and exponent.value > 0.0
                return self.is_positive(base) or (rises and self.is_nonnegative(base))
            case "tan":
                return False
        return True

    def decides(self, op: str, u: Expr, v: Expr) -> bool:
        """Whether max(u, v), or min, is proved to have the sign of u at every place of the box where u has a value.

        If rounding or overflow may leave the sign of u unknown, v may still decide it. Then the answer is no.
        """
        way = 1.0 if op == "max" else -1.0

        def is_told(ends: _Ends) -> tuple[Mask, Mask]:
            (u_low, u_high), (v_low, v_high) = (ends(each) for each in (u, v))
            if way < 0.0:
                u_low, u_high, v_low, v_high = -u_high, -u_low, -v_high, -v_low
            return (u_low > 0.0) | (v_high < 0.0), (u_high <= 0.0) & (v_low >= 0.0)

        if any(each.op in _MAY_OVERFLOW for each in walk([u])):
            return False
        return degree(u, "xyz") is not None and self.is_total(v) and self._each_part([u, v], is_told)

    def _over_the_box(self, u: Expr) -> bool:
        """Whether interval bounds prove u > 0 on the box; not if u has parameters."""

        def is_told(ends: _Ends) -> tuple[Mask, Mask]:
            low, high = ends(u)
            return low > 0.0, high <= 0.0

        return self._each_part([u], is_told)

    def _each_part(self, exprs: list[Expr], is_told: Callable[[_Ends], tuple[Mask, Mask]]) -> bool:
        """Divide the box until a statement is proved on every part; False if it fails on one, or parts are too many.

        `is_told` is the statement. It takes a function from an expression to its bounds on all parts, and returns two
        masks: parts on which the statement is proved, and parts on which it is disproved.
        """
        names = {str(each.name) for each in walk(exprs) if each.op == "symbol"}
        if self.box is None or not names <= {"x", "y", "z"}:
            return False
        import numpy as np  # not at the top: reading a study should not wait for it

        from lenscl.expr.enclose import bounds

        low, high = (np.asarray(corner, dtype=np.float64) for corner in self.box)
        if not (np.isfinite(low).all() and np.isfinite(high).all() and (low < high).all()):
            return False
        side = (1.0 + 2.0 * _WIDER) * (high - low)
        corners = (low - _WIDER * (high - low))[None]
        for _ in range(_LEVELS + 1):
            ends = {name: (corners[:, i], corners[:, i] + side[i]) for i, name in enumerate("xyz")}
            middles = {name: (0.5 * (a + b),) * 2 for name, (a, b) in ends.items()}
            if is_told(partial(bounds, box=middles))[1].any():
                return False
            done, failed = is_told(partial(bounds, box=ends))
            corners = corners[~done]
            if failed.any() or 8 * len(corners) > _MOST_BOXES:
                return False
            if not len(corners):
                return True
            side = 0.5 * side
            corners = np.concatenate([corners + side * np.array(way) for way in product((0, 1), repeat=3)])
        return False


def _of_odd(bounds: Bounds, most: Fraction | None) -> Bounds:
    """Return the bounds of a function with the sign of its operand, whose size is at most `most`."""
    low, high = bounds
    return (
        _ZERO if low is not None and low >= 0 else _negative(most),
        _ZERO if high is not None and high <= 0 else most,
    )


def _exact(bounds: Bounds) -> Fraction | None:
    return bounds[0] if bounds[0] == bounds[1] else None


def _sum(a: Fraction | None, b: Fraction | None) -> Fraction | None:
    return None if a is None or b is None else a + b


def _negative(a: Fraction | None) -> Fraction | None:
    return None if a is None else -a


def _scaled(bounds: Bounds, by: Fraction) -> Bounds:
    low, high = (None if end is None else end * by for end in bounds)
    return (low, high) if by > 0 else (high, low)


def _all(ends: list[Fraction | None], choose: Callable[[list[Fraction]], Fraction]) -> Fraction | None:
    known = [end for end in ends if end is not None]
    return choose(known) if len(known) == len(ends) else None


def _of_power(bounds: Bounds, n: int) -> Bounds:
    if n % 2:
        return _raised(bounds[0], n), _raised(bounds[1], n)
    low, high = _of_size(bounds)
    return _raised(low, n) or _ZERO, _raised(high, n)


def _of_size(bounds: Bounds) -> tuple[Fraction, Fraction | None]:
    low, high = bounds
    if low is not None and low >= 0:
        return low, high
    if high is not None and high <= 0:
        return -high, _negative(low)
    return _ZERO, (None if low is None or high is None else max(-low, high))


def _raised(end: Fraction | None, n: int) -> Fraction | None:
    small = end is not None and n * max(end.numerator.bit_length(), end.denominator.bit_length()) <= _MOST_BITS
    return end**n if end is not None and small else None
