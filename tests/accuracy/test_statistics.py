"""Quantiles and shares of weighted, stratified samples, and that their bounds hold as often as they say."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from lenscl.accuracy.statistics import Strata, quantile, quantile_estimate, share_estimate

DRAWS = 400
Array = NDArray[np.float64]


@given(st.lists(st.floats(0, 1e6), min_size=1, max_size=60), st.floats(0.01, 1.0))
def test_equal_weights_give_the_usual_quantile(values: list[float], level: float) -> None:
    array = np.array(values)
    assert quantile(array, np.full(array.size, 3.0), level) == pytest.approx(
        np.quantile(array, max(level - 1e-9, 0.0), method="inverted_cdf")
    )


@given(st.lists(st.tuples(st.floats(0, 10), st.integers(1, 5)), min_size=1, max_size=20), st.floats(0.05, 1.0))
def test_a_weight_is_so_many_of_a_value(pairs: list[tuple[float, int]], level: float) -> None:
    values, weights = (np.array(each, float) for each in zip(*pairs, strict=True))
    spread = np.repeat(values, weights.astype(int))
    assert quantile(values, weights, level) == quantile(spread, np.ones(spread.size), level)


def population() -> tuple[Array, NDArray[np.intp]]:
    """A film: most rays are good, some are bad, and few are very bad."""
    random = np.random.default_rng(1)
    sizes, scales = (40_000, 2_000, 300), (1e-6, 1e-3, 1.0)
    values = np.concatenate([scale * random.lognormal(0, 1, n) for n, scale in zip(sizes, scales, strict=True)])
    return values, np.repeat(np.arange(3), sizes)


def drawn_again(kinds: NDArray[np.intp], wanted: tuple[int, ...], seed: int) -> tuple[NDArray[np.intp], Strata]:
    random = np.random.default_rng(seed)
    places, weights = [], []
    for kind, number in enumerate(wanted):
        members = np.flatnonzero(kinds == kind)
        places.append(random.choice(members, number, replace=False))
        weights.append(np.full(number, members.size / number))
    chosen = np.concatenate(places)
    return chosen, Strata(np.concatenate(weights), kinds[chosen])


@pytest.mark.parametrize("level", [0.5, 0.95, 0.99])
def test_bounds_of_a_quantile_hold_as_often_as_they_say(level: float) -> None:
    values, kinds = population()
    exact = float(np.quantile(values, level, method="inverted_cdf"))
    held = bounded = 0
    for seed in range(DRAWS):
        chosen, strata = drawn_again(kinds, (300, 100, 100), seed)
        estimate = quantile_estimate(values[chosen], strata, level)
        if estimate.low is not None and estimate.high is not None:
            bounded += 1
            held += estimate.low <= exact <= estimate.high
    assert bounded > 0.95 * DRAWS
    assert held > 0.92 * bounded


def test_without_the_strata_they_would_not_hold() -> None:
    values, kinds = population()
    exact = float(np.quantile(values, 0.99, method="inverted_cdf"))
    held = 0
    for seed in range(40):
        chosen, _ = drawn_again(kinds, (300, 100, 100), seed)
        blind = quantile_estimate(values[chosen], Strata(np.ones(chosen.size), np.zeros(chosen.size, int)), 0.99)
        held += (blind.low or 0.0) <= exact <= (blind.high or np.inf)
    assert held == 0


@pytest.mark.parametrize("share", [0.0, 0.002, 0.3])
def test_bounds_of_a_share_hold(share: float) -> None:
    random = np.random.default_rng(2)
    _, kinds = population()
    is_so = random.uniform(size=kinds.size) < share * np.array([1.0, 2.0, 3.0])[kinds]
    held = 0
    for seed in range(DRAWS):
        chosen, strata = drawn_again(kinds, (300, 100, 100), seed)
        estimate = share_estimate(is_so[chosen], strata)
        assert estimate.low is not None
        assert estimate.high is not None
        held += estimate.low <= is_so.mean() <= estimate.high
    assert held > 0.92 * DRAWS


def test_what_was_looked_at_whole_is_exact() -> None:
    values = np.array([1.0, 2.0, 3.0, 4.0])
    assert quantile_estimate(values, None, 0.5) == quantile_estimate(values[::-1], None, 0.5)
    estimate = share_estimate(values > 3, None)
    assert (estimate.value, estimate.low, estimate.high) == (0.25, 0.25, 0.25)


def test_too_small_a_sample_has_no_upper_bound() -> None:
    few = Strata(np.ones(20), np.zeros(20, int))
    assert quantile_estimate(np.arange(20.0), few, 0.99).high is None
