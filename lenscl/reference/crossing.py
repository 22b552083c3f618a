"""The first crossing of a function along a ray, proved by balls.

Input: a function that encloses value and slope over any stretch of t. Output: a ball that holds its first change of
sign and no other, or that there is none. A stretch is settled when the value cannot be zero on it, or when the slope
cannot be and the signs at its ends are known; all else is halved, the near half first.

source    Moore, Interval Analysis, 1966: the mean value form and Newton's method on intervals
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from lenscl.reference.jets import Jet, contains_zero

if TYPE_CHECKING:
    from flint import arb

_PLACES = (0.5, 0.4375, 0.5625, 0.34375, 0.65625)  # where to part a stretch: the first at which the sign is certain
_MOST_STRETCHES = 20_000
_TO_THE_END = 64  # bits: so near to where F ends no crossing is looked for
_TOUCH = "the ray touches the surface, two of its roots are too close to be told apart, or F jumps"
_NO_VALUE = "F has no value, or none that is finite, on the ray's way"


class UndecidableError(Exception):
    """What cannot be told at this number of bits; perhaps at no number of them."""


def first_crossing(along: Callable[[arb], Jet], length: arb, bits: int, *, departs: bool, side: int) -> arb | None:
    """Prove the first change of sign of a function on (0, length].

    Parameters
    ----------
    along : callable
        From a ball of t to the function's jet, with one slope, over it.
    length : arb
        Exact, > 0.
    bits : int
        A stretch shorter than `2^(-bits / 2)` of the length that cannot be told is a touch, or none.
    departs : bool
        t = 0 is a root, exactly, and is not asked for.
    side : int
        The sign that the function has before its first crossing.

    Returns
    -------
    arb or None

    Raises
    ------
    UndecidableError
        With the reason.
    """
    from flint import arb

    lacking: list[arb] = []  # points at which F has no value

    def sign(t: arb) -> int:
        value = along(t).value
        if not value.is_finite():
            lacking.append(t)
        return int(value > 0) - int(value < 0)

    start = arb(0)
    at_start = 0 if departs else sign(start)
    at_end = sign(length)
    # Where F ends before the box does, there may be a crossing before that
    if not departs and not at_start and start in lacking:
        raise UndecidableError(_NO_VALUE)
    if (not at_end and length not in lacking) or (not departs and not at_start):
        raise UndecidableError("an end of the ray's way through the bounding box lies on the surface")
    if at_start == -side:
        raise UndecidableError("F has the other side's sign where the search begins")
    shortest, last = length / 2 ** (bits // 2), length / 2**_TO_THE_END
    stack = [(start, at_start, length, at_end)]
    for _ in range(_MOST_STRETCHES):
        if not stack:
            return None
        low, at_low, high, at_high = stack.pop()
        whole, middle = low.union(high), ((low + high) / 2).mid()
        over = along(whole)
        nearer = along(middle).value + over.slopes[0] * (whole - middle)
        known = at_low != 0  # else the root at 0 is on this stretch: only a slope tells that there is no other
        if known and not (contains_zero(over.value) and contains_zero(nearer)):
            continue
        if at_high and not contains_zero(over.slopes[0]):
            if not known and bool(over.slopes[0] > 0) != (side > 0):
                raise UndecidableError("F falls where it should rise behind the surface just met, or the reverse")
            if known and at_low != at_high:
                return _refined(along, whole)
            continue
        if high - low < (shortest if at_high else last):
            raise UndecidableError(_TOUCH if over.value.is_finite() else _NO_VALUE)
        for place in _PLACES:
            cut = (low + place * (high - low)).mid()
            at_cut = sign(cut)
            if at_cut:
                stack += [(cut, at_cut, high, at_high), (low, at_low, cut, at_cut)]
                break
        else:
            if cut not in lacking:
                raise UndecidableError(_TOUCH)
            # F has ended: only a crossing before that can be told, and what is behind is never reached
            stack = [(low, at_low, cut, 0)]
    raise UndecidableError(f"more than {_MOST_STRETCHES} stretches of the ray")


def _refined(along: Callable[[arb], Jet], bracket: arb) -> arb:
    """Shrink a ball that holds one root, where the slope cannot be zero, as far as the bits go."""
    rises = bool(along(bracket).slopes[0] > 0)
    while True:
        middle = bracket.mid()
        value, slope = along(middle).value, along(bracket).slopes[0]
        # Radii are rounded up, so that the slope over a part may seem to be zero where that over the whole cannot
        smaller = bracket if contains_zero(slope) else bracket.intersection(middle - value / slope)
        if smaller.rad() >= bracket.rad() * 0.75:
            # Newton's ball is as wide: take the half that holds the root, if that can be told
            if contains_zero(value):
                return smaller
            end = bracket.upper() if rises == bool(value < 0) else bracket.lower()
            smaller = bracket.intersection(middle.union(end))
            if smaller.rad() >= bracket.rad() * 0.75:
                return smaller
        bracket = smaller
