"""Interval arithmetic on float64 arrays, rounded outward: what the interval rules of the table are made of.

Every function takes and gives `Interval`s and holds two promises for points within its operands: the exact value of the
operation, and the one that `evaluate` computes, lie within the result. `undefined` marks where the operation may be
NaN; NaN itself is in no interval.

Source: R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis, SIAM 2009. Outward rounding is by
`nextafter`, since numpy has no rounding modes; numpy's functions are taken to be within 4 ulp (it states that for its
vector routines).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lenscl.expr import norms

Array = NDArray[np.float64]

_EPS = 2.0**-52
_NORM_ULP = 9  # a power of 4 ulp, and of another one, which is at most half of the base, what the p-th root leaves
_LEAN_ULP = 18  # of a norm's slope for p <= 10, made of two powers
_QUARTER_TURN = float(np.nextafter(np.pi / 2, 4.0))  # pi / 2 itself lies above the nearest number
_REDUCIBLE = 2.0**40  # beyond it the period of sin cannot be told apart well enough to be worth it


class Interval(NamedTuple):
    """All values from `lo` to `hi`, float64 arrays; `undefined`: NaN is possible."""

    lo: Array
    hi: Array
    undefined: NDArray[np.bool_]


def interval(lo: Array, hi: Array) -> Interval:
    """Make an interval of defined values."""
    return Interval(lo, hi, np.zeros(np.broadcast_shapes(np.shape(lo), np.shape(hi)), dtype=bool))


def around(value: Array, error: Array) -> Interval:
    """Make the interval of all that differs from `value` by at most `error`; everything where either is not finite."""
    exact = error == 0.0
    lo = np.where(exact, value, np.nextafter(value - error, -np.inf))
    hi = np.where(exact, value, np.nextafter(value + error, np.inf))
    unknown = ~(np.isfinite(value) & np.isfinite(error))
    return Interval(np.where(unknown, -np.inf, lo), np.where(unknown, np.inf, hi), unknown)


def _outward(lo: Array, hi: Array, undefined: NDArray[np.bool_], ulps: int = 1) -> Interval:
    """Widen computed ends that are each wrong by at most so many ulp; a NaN end is unknown."""
    if ulps > 1:
        lo = np.where(np.isfinite(lo), lo - ulps * _EPS * np.abs(lo), lo)
        hi = np.where(np.isfinite(hi), hi + ulps * _EPS * np.abs(hi), hi)
    lo, hi = np.nextafter(lo, -np.inf), np.nextafter(hi, np.inf)
    return Interval(np.where(np.isnan(lo), -np.inf, lo), np.where(np.isnan(hi), np.inf, hi), undefined)


def _has(u: Interval, value: float) -> NDArray[np.bool_]:
    return (u.lo <= value) & (value <= u.hi)


def _unbounded(u: Interval) -> NDArray[np.bool_]:
    return np.isinf(u.lo) | np.isinf(u.hi)


def negate(u: Interval) -> Interval:
    """Enclose -u."""
    return Interval(-u.hi, -u.lo, u.undefined)


def add(u: Interval, v: Interval) -> Interval:
    """Enclose u + v."""
    lo, hi = u.lo + v.lo, u.hi + v.hi
    clash = (np.isposinf(u.hi) & np.isneginf(v.lo)) | (np.isneginf(u.lo) & np.isposinf(v.hi))
    wide = _outward(lo, hi, u.undefined | v.undefined | clash)
    # A sum that is 0 is exact: this keeps sums of squares from reaching below it
    return Interval(np.where(lo == 0.0, 0.0, wide.lo), np.where(hi == 0.0, 0.0, wide.hi), wide.undefined)


def multiply(u: Interval, v: Interval) -> Interval:
    """Enclose u v."""
    ends = [np.asarray(a * b) for a in (u.lo, u.hi) for b in (v.lo, v.hi)]
    ends = [np.where(np.isnan(each), 0.0, each) for each in ends]  # 0 times an end at infinity, which is no value
    lo, hi = np.minimum.reduce(ends), np.maximum.reduce(ends)
    clash = (_unbounded(u) & _has(v, 0.0)) | (_unbounded(v) & _has(u, 0.0))
    wide = _outward(lo, hi, u.undefined | v.undefined | clash)
    same_side = ((u.lo >= 0.0) & (v.lo >= 0.0)) | ((u.hi <= 0.0) & (v.hi <= 0.0))
    other_side = ((u.lo >= 0.0) & (v.hi <= 0.0)) | ((u.hi <= 0.0) & (v.lo >= 0.0))
    return Interval(
        np.where(same_side, np.maximum(wide.lo, 0.0), wide.lo),
        np.where(other_side, np.minimum(wide.hi, 0.0), wide.hi),
        wide.undefined,
    )


def divide(u: Interval, v: Interval) -> Interval:
    """Enclose u / v; unknown where v may be 0."""
    through_zero = _has(v, 0.0)
    one = np.where(through_zero, 1.0, v.lo), np.where(through_zero, 1.0, v.hi)
    ends = [np.asarray(a / b) for a in (u.lo, u.hi) for b in one]
    lo, hi = np.minimum.reduce(ends), np.maximum.reduce(ends)
    clash = (through_zero & _has(u, 0.0)) | (_unbounded(u) & _unbounded(v))
    wide = _outward(lo, hi, u.undefined | v.undefined | clash)
    never_below = ((u.lo >= 0.0) & (v.lo > 0.0)) | ((u.hi <= 0.0) & (v.hi < 0.0))
    never_above = ((u.lo >= 0.0) & (v.hi < 0.0)) | ((u.hi <= 0.0) & (v.lo > 0.0))
    lo = np.where(never_below, np.maximum(wide.lo, 0.0), np.where(through_zero, -np.inf, wide.lo))
    hi = np.where(never_above, np.minimum(wide.hi, 0.0), np.where(through_zero, np.inf, wide.hi))
    return Interval(lo, hi, wide.undefined)


def integer_power(u: Interval, n: int) -> Interval:
    """Enclose u^n, n >= 1."""
    if n == 1:
        return u
    if n % 2 == 0:
        size = magnitude(u)
        lo, hi = _chain(size.lo, n), _chain(size.hi, n)
        wide = _outward(lo, hi, u.undefined, ulps=n)
        return Interval(np.maximum(wide.lo, 0.0), wide.hi, u.undefined)
    wide = _outward(_chain(u.lo, n), _chain(u.hi, n), u.undefined, ulps=n)
    return Interval(
        np.where(u.lo >= 0.0, np.maximum(wide.lo, 0.0), wide.lo),
        np.where(u.hi <= 0.0, np.minimum(wide.hi, 0.0), wide.hi),
        u.undefined,
    )


def _chain(u: Array, n: int) -> Array:
    """u^n by n - 1 products: at most n ulp off."""
    result = u
    for _ in range(n - 1):
        result = result * u
    return result


def magnitude(u: Interval) -> Interval:
    """Enclose |u|."""
    lo = np.where(_has(u, 0.0), 0.0, np.minimum(np.abs(u.lo), np.abs(u.hi)))
    return Interval(lo, np.maximum(np.abs(u.lo), np.abs(u.hi)), u.undefined)


def least(u: Interval, v: Interval) -> Interval:
    """Enclose `u < v ? u : v`, which is v where u is NaN."""
    hi = np.where(u.undefined, v.hi, np.minimum(u.hi, v.hi))
    return Interval(np.minimum(u.lo, v.lo), hi, v.undefined)


def where(a: Interval, b: Interval, u: Interval, v: Interval) -> Interval:
    """Enclose `a < b ? u : v`."""
    first = (a.hi < b.lo) & ~a.undefined & ~b.undefined
    second = a.lo >= b.hi
    lo = np.where(first, u.lo, np.where(second, v.lo, np.minimum(u.lo, v.lo)))
    hi = np.where(first, u.hi, np.where(second, v.hi, np.maximum(u.hi, v.hi)))
    return Interval(lo, hi, (u.undefined & ~second) | (v.undefined & ~first))


def rising(
    u: Interval,
    function: str,
    *,
    ulps: int,
    domain: float = -np.inf,
    least: float = -np.inf,
    greatest: float = np.inf,
) -> Interval:
    """Enclose a function of numpy that never falls, from the start of its domain on, with known extremes."""
    of = getattr(np, function)
    lo, hi = of(np.maximum(u.lo, domain)), of(np.maximum(u.hi, domain))
    wide = _outward(lo, hi, u.undefined | (u.lo < domain), ulps)
    nowhere = u.hi < domain
    lo = np.where(nowhere, -np.inf, np.clip(wide.lo, least, greatest))
    return Interval(lo, np.where(nowhere, np.inf, np.clip(wide.hi, least, greatest)), wide.undefined)


def _reaches(u: Interval, start: float, period: float) -> NDArray[np.bool_]:
    """Say whether `start + k period` may lie within, for any whole k; generously at the ends."""
    slack = 8 * _EPS * (np.maximum(np.abs(u.lo), np.abs(u.hi)) + period)
    return np.asarray(np.floor((u.hi + slack - start) / period) >= np.ceil((u.lo - slack - start) / period))


def _wave(u: Interval, function: str, crest: float) -> Interval:
    lo, hi = getattr(np, function)(u.lo), getattr(np, function)(u.hi)
    wide = _outward(np.minimum(lo, hi), np.maximum(lo, hi), u.undefined | _unbounded(u), ulps=4)
    far = ~(np.maximum(np.abs(u.lo), np.abs(u.hi)) < _REDUCIBLE)
    top = far | _reaches(u, crest, 2 * np.pi)
    bottom = far | _reaches(u, crest + np.pi, 2 * np.pi)
    return Interval(
        np.where(bottom, -1.0, np.maximum(wide.lo, -1.0)), np.where(top, 1.0, np.minimum(wide.hi, 1.0)), wide.undefined
    )


def sine(u: Interval) -> Interval:
    """Enclose sin u."""
    return _wave(u, "sin", np.pi / 2)


def cosine(u: Interval) -> Interval:
    """Enclose cos u."""
    return _wave(u, "cos", 0.0)


def tangent(u: Interval) -> Interval:
    """Enclose tan u; unknown across a pole."""
    wide = _outward(np.tan(u.lo), np.tan(u.hi), u.undefined | _unbounded(u), ulps=4)
    far = ~(np.maximum(np.abs(u.lo), np.abs(u.hi)) < _REDUCIBLE)
    pole = far | _reaches(u, np.pi / 2, np.pi)
    return Interval(np.where(pole, -np.inf, wide.lo), np.where(pole, np.inf, wide.hi), wide.undefined)


def angle(y: Interval, x: Interval) -> Interval:
    """Enclose atan2(y, x). Off its cut it is monotone along both axes, so the corners hold its extremes."""
    corners = [np.asarray(np.arctan2(a, b)) for a in (y.lo, y.hi) for b in (x.lo, x.hi)]
    wide = _outward(np.minimum.reduce(corners), np.maximum.reduce(corners), y.undefined | x.undefined, ulps=4)
    cut = _has(y, 0.0) & (x.lo <= 0.0)
    half_turn = np.nextafter(np.pi, 4.0)
    return Interval(np.where(cut, -half_turn, wide.lo), np.where(cut, half_turn, wide.hi), wide.undefined)


def _arc(u: Interval) -> Interval:
    """Leave of an operand of asin or acos what lies between -1 and 1."""
    beyond = (u.lo < -1.0) | (u.hi > 1.0)
    return Interval(np.clip(u.lo, -1.0, 1.0), np.clip(u.hi, -1.0, 1.0), u.undefined | beyond)


def _turned(u: Interval, lo: Array, hi: Array, least: float, greatest: float) -> Interval:
    """Return the enclosure of an arc sine or cosine of u, from computed ends; unknown where it is defined nowhere."""
    wide = _outward(lo, hi, _arc(u).undefined, ulps=4)
    nowhere = (u.hi < -1.0) | (u.lo > 1.0)
    lo, hi = np.clip(wide.lo, least, greatest), np.clip(wide.hi, least, greatest)
    return Interval(np.where(nowhere, -np.inf, lo), np.where(nowhere, np.inf, hi), wide.undefined)


def arc_sine(u: Interval) -> Interval:
    """Enclose asin u."""
    within = _arc(u)
    return _turned(u, np.arcsin(within.lo), np.arcsin(within.hi), -_QUARTER_TURN, _QUARTER_TURN)


def arc_cosine(u: Interval) -> Interval:
    """Enclose acos u."""
    within = _arc(u)
    return _turned(u, np.arccos(within.hi), np.arccos(within.lo), 0.0, 2.0 * _QUARTER_TURN)


def arc_tangent(u: Interval) -> Interval:
    """Enclose atan u."""
    return rising(u, "arctan", ulps=4, least=-_QUARTER_TURN, greatest=_QUARTER_TURN)


def stepping(u: Interval, function: str) -> Interval:
    """Enclose a function of numpy that never falls and whose values are whole numbers: they are exact."""
    of = getattr(np, function)
    return Interval(of(u.lo), of(u.hi), u.undefined)


def distance(u: Interval, v: Interval) -> Interval:
    """Enclose hypot(u, v)."""
    a, b = magnitude(u), magnitude(v)
    wide = _outward(np.hypot(a.lo, b.lo), np.hypot(a.hi, b.hi), u.undefined | v.undefined, ulps=4)
    return Interval(np.maximum(wide.lo, 0.0), wide.hi, wide.undefined)


def real_power(u: Interval, p: Interval) -> Interval:
    """Enclose u^p for u >= 0. It is monotone along both axes, so the corners hold its extremes."""
    lo, hi = np.maximum(u.lo, 0.0), np.maximum(u.hi, 0.0)
    corners = [np.asarray(np.power(a, b)) for a in (lo, hi) for b in (p.lo, p.hi)]
    wide = _outward(
        np.minimum.reduce(corners), np.maximum.reduce(corners), u.undefined | p.undefined | (u.lo < 0.0), ulps=4
    )
    nowhere = u.hi < 0.0
    unknown = nowhere | _unbounded(p)
    least = np.where(_unbounded(p), 0.0, np.maximum(wide.lo, 0.0))
    return Interval(np.where(nowhere, -np.inf, least), np.where(unknown, np.inf, wide.hi), wide.undefined)


def _promised(p: Interval) -> Interval:
    """Leave out exponents below 1, which a norm's never is: enclosures of 2 / 2 reach there by rounding alone."""
    return Interval(np.where(p.lo >= 1.0 - 8 * _EPS, np.maximum(p.lo, 1.0), p.lo), p.hi, p.undefined)


def norm(u: Interval, v: Interval, p: Interval) -> Interval:
    """Enclose (|u|^p + |v|^p)^(1/p), p >= 1. It rises with |u| and |v| and falls with p."""
    a, b, p = magnitude(u), magnitude(v), _promised(p)
    low, high = norms.value(np, a.lo, b.lo, p.hi), norms.value(np, a.hi, b.hi, p.lo)
    unknown = ~(p.lo >= 1.0) | _unbounded(p)
    wide = _outward(low, high, u.undefined | v.undefined | p.undefined | unknown, ulps=_NORM_ULP)
    lo = np.where(unknown, 0.0, np.maximum(wide.lo, 0.0))
    return Interval(lo, np.where(unknown, np.inf, wide.hi), wide.undefined)


def norm_slope(u: Interval, v: Interval, p: Interval) -> Interval:
    """Enclose sign(u) (|u| / norm)^(p - 1). It rises with u and is nearer to zero the larger |v| is."""
    b, p = magnitude(v), _promised(p)
    unknown = ~(p.lo >= 1.0) | _unbounded(u) | _unbounded(v)
    ends = []
    outward = ((u.lo, np.where(u.lo >= 0.0, b.hi, b.lo), -1.0), (u.hi, np.where(u.hi >= 0.0, b.lo, b.hi), 1.0))
    for end, other, sign in outward:
        # Another exponent changes a slope by its change times log(|u| / norm), or less, and 0 stays 0
        ratio = np.abs(end) / np.maximum(np.hypot(end, other), 5e-324)
        moved = np.where(end == 0.0, 0.0, (p.hi - p.lo) * (2.0 - np.log(np.maximum(ratio, 5e-324))))
        # Where the ratio underflows the slope may still be far from 0
        underflown = np.where(end == 0.0, 0.0, np.sign(end) * np.power(np.maximum(ratio, 5e-324), p.lo - 1.0))
        slope = norms.slope(np, end, other, p.lo)
        ends.append((np.where((ratio < 1e-300) & (end * sign > 0.0), underflown, slope), moved))
    (low, below), (high, above) = ends
    low = np.where(unknown, np.where(u.lo < 0.0, -1.0, 0.0), low - below)
    high = np.where(unknown, np.where(u.hi > 0.0, 1.0, 0.0), high + above)
    wide = _outward(low, high, u.undefined | v.undefined | p.undefined | ~(p.lo >= 1.0), ulps=_LEAN_ULP)
    return Interval(np.maximum(wide.lo, -1.0), np.minimum(wide.hi, 1.0), wide.undefined)
