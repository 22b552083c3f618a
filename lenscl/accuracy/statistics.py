"""What a stratified sample says of all: quantiles and shares, with the bounds between which they lie.

>>> quantile(np.array([3.0, 1.0, 2.0]), np.array([1.0, 1.0, 8.0]), 0.5)
2.0
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_NORMAL = 1.959963984540054  # a normal variable lies within so many deviations with 95 % probability
_COVERED = 0.95  # of the interval about a median, at least, where the samples are enough
_LEAST = 1e-12  # of a weight: sums of weights round


@dataclass(frozen=True, slots=True)
class Estimate:
    """A figure of a whole film, from some of its rays.

    Attributes
    ----------
    value : float
    low, high : float or None
        Between these it lies with 95 % confidence; None where the sample is too small to bound it on that side.
    """

    value: float
    low: float | None
    high: float | None

    @classmethod
    def exact(cls, value: float) -> Estimate:
        """Return a figure that all rays were looked at for."""
        return cls(value, value, value)


@dataclass(frozen=True, slots=True, eq=False)
class Strata:
    """For how many rays each of a sample stands, and which of them were drawn together.

    Attributes
    ----------
    weights : float64 array, shape (N,)
    stratum : int array, shape (N,)
    """

    weights: Array
    stratum: NDArray[np.integer]

    def of(self, chosen: NDArray[np.bool_]) -> Strata:
        """Return those of some of the rays."""
        return Strata(self.weights[chosen], self.stratum[chosen])


def quantile(values: Array, weights: Array, level: float) -> float:
    """Return the least value that no more than 1 - `level` of the weight lies above; 0 of none."""
    if not values.size:
        return 0.0
    order = np.argsort(values)
    reached = np.cumsum(weights[order])
    place = int(np.searchsorted(reached, level * reached[-1] * (1.0 - _LEAST)))
    return float(values[order[min(place, len(values) - 1)]])


def quantile_estimate(values: Array, drawn: Strata | None, level: float) -> Estimate:
    """Return a quantile; with its bounds, whatever the distribution, where only some rays were drawn.

    Notes
    -----
    It lies below x with 95 % confidence where the share of values up to x, less its own deviation, reaches the level
    (Woodruff, J. Am. Stat. Assoc. 47 (1952) 635).
    """
    if drawn is None or not values.size:
        return Estimate.exact(quantile(values, np.ones(values.size), level))
    order = np.argsort(values)
    members = drawn.stratum[order, None] == np.unique(drawn.stratum)  # one column a stratum
    share, deviation = _shares(np.cumsum(members, axis=0), drawn)
    below, above = np.flatnonzero(share + deviation <= level), np.flatnonzero(share - deviation >= level)
    return Estimate(
        quantile(values, drawn.weights, level),
        float(values[order[below[-1]]]) if below.size else None,
        float(values[order[above[0]]]) if above.size else None,
    )


def share_estimate(is_so: NDArray[np.bool_], drawn: Strata | None) -> Estimate:
    """Return the share of a property; with its bounds where only some rays were drawn."""
    if not is_so.size:
        return Estimate.exact(0.0)
    if drawn is None:
        return Estimate.exact(float(is_so.mean()))
    _, place = np.unique(drawn.stratum, return_inverse=True)
    share, deviation = _shares(np.bincount(place, is_so).astype(np.int64), drawn)
    return Estimate(float(share), max(float(share - deviation), 0.0), min(float(share + deviation), 1.0))


def _shares(hits: NDArray[np.integer], drawn: Strata) -> tuple[Array, Array]:
    """Return weighted shares and 1.96 times their standard deviations, strata being independent.

    Two more successes and two more failures a stratum keep the deviation from being 0 where all of one are alike
    (Agresti & Coull, Am. Stat. 52 (1998) 119).

    Parameters
    ----------
    hits : int array, shape (..., S)
        How many of the rays of each stratum that was drawn from have the property, the strata in rising order.
    drawn : Strata
    """
    _, place, n = np.unique(drawn.stratum, return_inverse=True, return_counts=True)
    part = np.bincount(place, drawn.weights) / drawn.weights.sum()
    smooth = (hits + 2.0) / (n + 4.0)
    variance: Array = np.sum(part**2 * smooth * (1.0 - smooth) / (n + 4.0), axis=-1)
    share: Array = np.sum(part * hits / n, axis=-1)
    return share, _NORMAL * np.sqrt(variance)


def median(samples: Sequence[float]) -> float:
    """Return the middle sample, or the mean of the middle two."""
    ordered, n = sorted(samples), len(samples)
    return (ordered[(n - 1) // 2] + ordered[n // 2]) / 2


def median_bounds(samples: Sequence[float]) -> tuple[float, float]:
    """Return two samples between which the median lies with 95 % confidence, or all of them where they are too few.

    Notes
    -----
    The median of what is sampled lies below the k-th smallest of n samples with the probability of fewer than k heads
    in n tosses, whatever the distribution. Source: Conover, Practical Nonparametric Statistics, 3rd ed., sec. 3.2.

    >>> median_bounds([5, 1, 4, 2, 3, 9, 8, 7, 6])
    (2, 8)
    """
    ordered, n = sorted(samples), len(samples)
    k = 1
    while 2 * sum(comb(n, heads) for heads in range(k + 1)) <= (1 - _COVERED) * 2**n:
        k += 1
    return ordered[k - 1], ordered[n - k]
