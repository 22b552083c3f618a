"""The vocabulary's sine, cosine and tangent: right to a few ulp, also beside their zeros, against ball arithmetic."""

from __future__ import annotations

import numpy as np
import pytest
from flint import arb, ctx
from probe import FORMS, REALS, Probe

REACH = {"single": 1024.0, "double": 1e6}
BODY = "out_0 = sin_v(in_0); out_1 = cos_v(in_0); out_2 = tan_v(in_0);"
ULPS = (2.0, 2.0, 8.0)


@pytest.mark.parametrize(("precision", "width"), FORMS)
def test_sine_cosine_and_tangent_are_right_to_a_few_ulp(precision: str, width: int) -> None:
    dtype = REALS[precision]
    rng = np.random.default_rng(0)
    quarters = (np.arange(-650, 651) * (np.pi / 2)).astype(dtype)  # the numbers nearest to the zeros
    beside = [np.nextafter(quarters, dtype(side)) for side in (-np.inf, np.inf)]
    reach = REACH[precision]
    anywhere = (
        rng.uniform(-reach, reach, 1500),
        rng.uniform(-1000, 1000, 1500),
        rng.uniform(-7, 7, 1500),
        rng.normal(size=500) * 1e-5,
    )
    numbers = np.concatenate([quarters, *beside, *anywhere]).astype(dtype)
    numbers = numbers[(np.abs(numbers) <= reach) & (numbers != 0)]
    waves = Probe((), BODY, 1, 3, precision, width)(numbers.astype(np.float64))

    before, ctx.prec = ctx.prec, 160
    try:
        balls = [(*arb(float(x)).sin_cos(), arb(float(x)).tan()) for x in numbers]
        for column, most in enumerate(ULPS):
            exact = np.array([float(ball[column].mid()) for ball in balls])
            rest = np.array([float((ball[column] - arb(float(e))).mid()) for ball, e in zip(balls, exact, strict=True)])
            ulp = np.spacing(np.abs(exact).astype(dtype)).astype(np.float64)
            assert np.max(np.abs((waves[:, column] - exact) - rest) / ulp) < most
    finally:
        ctx.prec = before
    assert len(numbers) > 5000


@pytest.mark.parametrize(("precision", "width"), FORMS)
def test_far_numbers_and_none_are_left_to_the_builtin(precision: str, width: int) -> None:
    far = np.array([1.1e6, -3e7, 2.0**30, np.nan, np.inf]).astype(REALS[precision]).astype(np.float64)
    waves = Probe((), BODY, 1, 3, precision, width)(far)
    with np.errstate(invalid="ignore"):
        expected = np.stack([np.sin(far), np.cos(far), np.tan(far)], axis=1)
    eps = np.finfo(REALS[precision]).eps
    np.testing.assert_allclose(waves, expected, rtol=8 * eps, atol=4 * eps)


@pytest.mark.parametrize(("precision", "width"), FORMS)
def test_no_number_is_touched_by_those_beside_it(precision: str, width: int) -> None:
    """PoCL's own functions of packets of floats are, beside numbers of 1e7 and more."""
    rng = np.random.default_rng(1)
    given = rng.uniform(-1.5, 1.5, 2048) * 10.0 ** rng.integers(-3, 1, 2048)
    beside = rng.choice([1e4, 1e7, 3e9, 1e20, 1e30, np.inf, np.nan], 2048) * rng.choice([-1.0, 1.0], 2048)
    is_far = rng.random(2048) < 0.2
    given = np.where(is_far, beside, given).astype(REALS[precision]).astype(float)
    waves = Probe((), BODY, 1, 3, precision, width)(given)[~is_far]
    near = given[~is_far]
    expected = np.stack([np.sin(near), np.cos(near), np.tan(near)], axis=1)
    np.testing.assert_allclose(waves, expected, rtol=16 * np.finfo(REALS[precision]).eps)
