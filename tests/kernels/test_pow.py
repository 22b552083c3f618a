"""Powers of packets: no lane changes another, and they are right to the last bits."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from probe import FORMS, REALS, Probe


@pytest.mark.parametrize(("precision", "width"), FORMS)
def test_a_power_does_not_depend_on_the_lanes_beside_it(precision: str, width: int) -> None:
    rng = np.random.default_rng(0)
    base = rng.uniform(0.01, 2.0, 16_000)
    odd = rng.random(base.size) < 0.3
    smallest = 4 * np.finfo(REALS[precision]).tiny
    base = np.where(odd, rng.choice([0.0, -1.0, np.nan, np.inf, smallest], base.size), base)
    base = base.astype(REALS[precision]).astype(np.float64)
    exponent = rng.choice([4.0, 0.25, -0.75, 3.0], base.size)

    power = Probe((), "out_0 = pow_v(in_0, in_1);", 2, 1, precision, width)(base, exponent)[:, 0]
    alone = Probe((), "out_0 = pow_v(in_0, in_1);", 2, 1, precision, 1)(base, exponent)[:, 0]
    close = {"single": 4e-6, "double": 1e-14}[precision]  # 16 ulp each
    np.testing.assert_allclose(power, alone, rtol=close)
    with np.errstate(all="ignore"):
        right = np.power(base[~odd], exponent[~odd])
    np.testing.assert_allclose(power[~odd], right, rtol=close)


@pytest.mark.parametrize(("precision", "width"), [("single", 4), ("double", 4)])
def test_powers_are_right_to_two_ulp_where_they_are_usual(precision: str, width: int) -> None:
    """Against mpmath, near 1 and far from it; 0, infinity and what is no number as IEEE 754 has them."""
    rng = np.random.default_rng(3)
    count, kind = 900, REALS[precision]
    near = 1.0 + rng.normal(size=count) * 10.0 ** rng.uniform(-16, -1, count)
    limits = np.log10([float(np.finfo(kind).tiny), float(np.finfo(kind).max)])
    ends = np.concatenate([10.0 ** (limits[1] - rng.uniform(0.01, 1, 50)), 10.0 ** (limits[0] + rng.uniform(0, 1, 50))])
    base = [10.0 ** rng.uniform(-12, 3, count), rng.uniform(0, 2, count), near, 10.0 ** rng.uniform(*limits, 200), ends]
    base = np.concatenate(base)
    base = base.astype(kind).astype(np.float64)
    exponent = rng.choice([0.5, 1.5, 2.5, 0.7, -0.3, -1.5, 1 / 3, 7.25, 60.0, -64.0], base.size)
    exponent = exponent.astype(kind).astype(np.float64)
    odd = np.array([[0.0, 2.5], [0.0, 0.0], [0.0, -1.5], [np.inf, 0.5], [np.nan, 2.0], [1e-40, 0.5], [2.0, 70.5]])
    power = Probe((), "out_0 = pow_v(in_0, in_1);", 2, 1, precision, width, is_plain=True)
    special = power(*odd.astype(kind).T)[:, 0]
    np.testing.assert_allclose(special[:4], [0.0, 1.0, np.inf, np.inf])
    assert np.isnan(special[4])
    np.testing.assert_allclose(special[5:], [1e-20, 2.0**70.5], rtol=1e-5)
    found, worst, judged = power(base, exponent)[:, 0], 0.0, 0
    with mpmath.workprec(200):
        for a, b, value in zip(base, exponent, found, strict=True):
            right = mpmath.mpf(float(a)) ** mpmath.mpf(float(b))
            if a > 0.0 and np.finfo(kind).tiny < right < np.finfo(kind).max:
                worst = max(worst, float(abs(mpmath.mpf(float(value)) - right) / right / float(np.finfo(kind).eps)))
                judged += 1
    assert judged > 2000
    assert worst < 2.0
