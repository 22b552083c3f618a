"""asin, acos, atan, sinh, cosh, sign and floor in packets: right to a few ulp, whatever lies in other lanes."""

from __future__ import annotations

from functools import cache
from typing import Any

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray
from probe import FORMS, REALS, Probe
from thinned import thinned

Array = NDArray[Any]
WORDS = {
    "asin": 10,
    "acos": 10,
    "atan": 6,
    "sinh": 16,
    "cosh": 16,
    "sign": 0,
    "floor": 0,
}  # and their largest error, ulp
FRAGMENTS = ("arcs.cl", "hyperbolics.cl", "jumps.cl")
BODY = " ".join(f"out_{i} = {word}_v(in_0);" for i, word in enumerate(WORDS))
ALL = [*FORMS, ("double", 4)]
NUMPY = {"asin": "arcsin", "acos": "arccos", "atan": "arctan"}
SOME = [("single", 1), ("single", 8), ("single", 16), ("single", 32), ("double", 1), ("double", 4), ("double", 8)]


def numbers(precision: str) -> Array:
    """Return numbers beside the ends of domains and beside whole ones, and of all sizes; every fifth lane is odd."""
    rng, dtype = np.random.default_rng(0), REALS[precision]
    ends = np.array([0.0, 1.0, -1.0, 0.5, 2.0, -3.0, 17.0], dtype)
    beside = [np.nextafter(ends, dtype(side)) for side in (-np.inf, np.inf)]
    sizes = rng.choice([-1.0, 1.0], 600) * 10.0 ** rng.uniform(-12, 2, 600)
    near_one = rng.choice([-1.0, 1.0], 500) * (1.0 - 10.0 ** rng.uniform(-7, 0, 500))
    found = np.concatenate(
        [
            ends,
            *beside,
            sizes,
            near_one,
            rng.uniform(-80, 80, 500),
            *(2.0**k * rng.uniform(-1, 1, 99) for k in (22, 23, 51, 52)),
        ]
    ).astype(dtype)
    odd = rng.choice([np.nan, np.inf, -np.inf, 1e30, -1e30, 3e38, 1e-37, 0.0], found.size)
    return np.where(rng.random(found.size) < 0.2, odd, found).astype(dtype).astype(float)


@cache
def exact(precision: str, word: str) -> list[Any]:
    """Return a word's values at these numbers to 25 digits; None where it has none that is finite."""
    with mpmath.workdps(25):
        found = [getattr(mpmath, word)(mpmath.mpf(x)) if np.isfinite(x) else None for x in numbers(precision)]
    most = float(np.finfo(REALS[precision]).max)
    return [x if isinstance(x, mpmath.mpf) and abs(x) < 0.9 * most else None for x in found]


@pytest.mark.parametrize(("precision", "width"), thinned(ALL, SOME))
def test_no_lane_is_wrong_by_more_than_a_few_ulp(precision: str, width: int) -> None:
    dtype, given = REALS[precision], numbers(precision)
    got = Probe(FRAGMENTS, BODY, 1, len(WORDS), precision, width)(given)
    checked = 0
    for column, (word, most) in enumerate(WORDS.items()):
        with np.errstate(all="ignore"):
            rough = getattr(np, NUMPY.get(word, word))(given).astype(dtype)
        np.testing.assert_array_equal(np.isnan(got[:, column]), np.isnan(rough), word)
        np.testing.assert_array_equal(got[np.isinf(rough), column], rough[np.isinf(rough)], word)
        for x, value, right in zip(given, got[:, column], exact(precision, word), strict=True):
            if right is not None:
                ulp = float(np.spacing(np.abs(dtype(float(right))) or np.finfo(dtype).tiny))
                assert abs(value - right) <= most * ulp, (word, x)
                checked += 1
    assert checked > 5_000
