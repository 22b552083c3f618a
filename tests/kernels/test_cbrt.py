"""The prelude's cube root: right to an ulp over the whole range of numbers, in every lane."""

from __future__ import annotations

import numpy as np
import pytest
from probe import FORMS, REALS, Probe


@pytest.mark.parametrize(("precision", "width"), FORMS)
def test_the_cube_root_is_right_to_an_ulp_over_all_numbers(precision: str, width: int) -> None:
    dtype = REALS[precision]
    info = np.finfo(dtype)
    rng = np.random.default_rng(0)
    lowest, highest = np.log(float(info.smallest_subnormal)), np.log(float(info.max))
    size = np.exp(rng.uniform(lowest, highest, 100_000))
    edges = [info.max, info.tiny, info.smallest_subnormal, 1.0, 8.0, np.nextafter(dtype(8), dtype(0))]
    numbers = np.concatenate([size * rng.choice([-1.0, 1.0], size.size), edges]).astype(dtype).astype(np.float64)
    numbers = numbers[(numbers != 0) & np.isfinite(numbers)]

    root = Probe((), "out_0 = cbrt_v(in_0);", 1, 1, precision, width)(numbers)[:, 0]
    exact = np.cbrt(numbers.astype(np.longdouble))
    ulp = np.spacing(np.abs(exact).astype(dtype)).astype(np.longdouble)
    assert np.max(np.abs(root - exact) / ulp) < 1.0


@pytest.mark.parametrize(("precision", "width"), FORMS)
def test_what_has_no_usual_cube_root_is_kept(precision: str, width: int) -> None:
    numbers = np.array([0.0, -0.0, np.inf, -np.inf, np.nan])
    root = Probe((), "out_0 = cbrt_v(in_0);", 1, 1, precision, width)(numbers)[:, 0]
    np.testing.assert_array_equal(root, numbers)
    assert np.signbit(root[1])
