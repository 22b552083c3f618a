"""The prelude's pow_v: no lane changes another."""

from __future__ import annotations

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
