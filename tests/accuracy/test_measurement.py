from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lenscl.accuracy.statistics import median, median_bounds

SAMPLES = st.lists(st.floats(1e-3, 1e3), min_size=1, max_size=40)


@given(SAMPLES)
def test_the_median_is_numpys(samples: list[float]) -> None:
    assert median(samples) == pytest.approx(np.median(samples), rel=1e-15)


@given(SAMPLES, st.randoms())
def test_bounds_are_samples_around_the_median_in_any_order(samples: list[float], random) -> None:
    low, high = median_bounds(samples)
    assert low <= median(samples) <= high
    assert {low, high} <= set(samples)
    random.shuffle(samples)
    assert median_bounds(samples) == (low, high)


@pytest.mark.parametrize("n", range(1, 15))
def test_bounds_hold_the_median_as_often_as_is_said_and_are_the_narrowest_that_do(n: int) -> None:
    """Every sample lies below the true median as a coin falls: count over all throws of n coins."""
    low, high = median_bounds(range(1, n + 1))
    assert low + high == n + 1

    def missed(k: int) -> float:
        """Return the share of throws in which the k-th smallest or k-th largest leaves the median out."""
        below = [sum(throw) for throw in product((0, 1), repeat=n)]
        return sum(count < k or count > n - k for count in below) / 2**n

    if n >= 6:
        assert missed(low) <= 0.05
    else:
        assert low == 1  # even all of them cover less
    assert missed(low + 1) > 0.05


def test_figures_follow_from_the_samples(measurement) -> None:
    ratios = (0.9, 1.1, 1.0, 1.2, 0.8, 1.3, 0.7, 1.4, 0.6)
    measured = measurement(ratios=ratios, ns_least=50.0, peak=2e11)
    assert measured.ratio == 1.0
    assert measured.ratio_bounds == (0.7, 1.3)
    assert measured.slots == pytest.approx(50e-9 * 2e11)


def test_the_march_beside_a_row_is_of_its_scene_and_precision(measurement, run) -> None:
    rows = [
        measurement(scene=scene, method=method, precision=precision)
        for scene in ("torus-close", "heart-close")
        for method in ("auto", "march")
        for precision in ("single", "double")
    ]
    made = run(*rows)
    for row in rows:
        beside = made.march_of(row)
        assert beside is not None
        assert beside.row == (row.scene, "march", row.precision)
    assert run(rows[0]).march_of(rows[0]) is None
