"""Hold a ray map against the truth: how far off its rays land, how many end otherwise, how many show another colour.

A ray that the truth does not know is no success: it counts as one that is infinitely far off and that ends otherwise.
So what a figure promises holds, wherever such rays end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.statistics import Estimate, Strata, quantile_estimate, share_estimate
from lenscl.accuracy.truth import Truth
from lenscl.config.scene import Picture
from lenscl.status import RayStatus
from lenscl.tracing import RayMap, RayPaths

Array = NDArray[np.float64]

LEVEL = 0.99  # of the rays land within the error that a map is known by
MOST_DIFFER = 1e-3  # share of the rays through a lens that may end otherwise where an accuracy is asked for
SEEN = 0.5 / 255  # pixels: between a black and a white pixel, half a step of 8 bits
NOTHING = Estimate.exact(0.0)
_LANDS = tuple(int(status) for status in RayStatus if status.lands)


@dataclass(frozen=True, slots=True, kw_only=True)
class Distances:
    """Errors of the rays that meet a lens and land on the picture's plane, there and here, and of the unknown ones.

    Those of unknown rays are infinite, so that a quantile is infinite where too many rays are unknown.
    """

    median: Estimate
    high: Estimate  # 99 %
    largest: float  # of those looked at whose error is known


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """What a map is worth.

    Attributes
    ----------
    against : str
        What it was held against.
    sampled, unknown, compared : int
        Rays looked at; those of them whose end the truth does not know; those that finite errors are of.
    pixels : Distances
        max(|ds| W, |dt| H) on the picture of W x H pixels.
    units : Distances
        Distance on the picture's plane, scene units.
    differ : Estimate
        Share of the rays through a lens, there or here, that end otherwise: another status, or other events. A ray
        that is undecided here ends otherwise, too, unless it is proved that nobody can tell. An unknown ray may have
        gone through a lens and ended otherwise, and counts as one that did.
    colours : Estimate
        Share of all rays that may show another colour: they end otherwise, or land more than `SEEN` off.
    unknown_share : Estimate
        Share of the rays through a lens, there or here, or unknown, that are unknown.
    """

    against: str
    sampled: int
    unknown: int
    compared: int
    pixels: Distances
    units: Distances
    differ: Estimate
    colours: Estimate
    unknown_share: Estimate = NOTHING

    def distances(self, unit: str) -> Distances:
        """Return the errors in the unit of an `Accuracy`."""
        return self.pixels if unit == "px" else self.units


def judge(
    traced: RayMap | RayPaths, truth: Truth, drawn: Strata | None = None, size: tuple[int, int] | None = None
) -> Judgement:
    """Compare a map, or given rays, of the same scene.

    Parameters
    ----------
    traced : RayMap or RayPaths
    truth : Truth
        Of any of its rays.
    drawn : Strata, optional
        How the rays were drawn; left out: they are all there are.
    size : (int, int), optional
        Columns and rows of the picture; default: the scene's.
    """
    st = traced.st.reshape(-1, 2)[truth.pixels].astype(np.float64)
    status, events = traced.status.ravel()[truth.pixels], traced.events.ravel()[truth.pixels]
    picture, known = traced.scene.picture, truth.is_known
    size = picture.size if size is None else size

    # A ray that is labelled undecided, and of which it is proved that nobody can tell, is as it should be
    agreed = truth.is_undecidable & (status == RayStatus.UNDECIDED)
    differs = np.where(known, (status != truth.status) | (events != truth.events), ~agreed)
    lens = ~known | (events > 0) | (truth.events > 0)
    both = known & (truth.events > 0) & np.isin(status, _LANDS) & np.isin(truth.status, _LANDS)
    apart = (st - truth.st) - truth.rest
    pixels_apart = np.abs(apart * size).max(axis=-1) + truth.radius * max(size)
    units_apart = lengths(apart, picture) + truth.radius * (math.hypot(*picture.right) + math.hypot(*picture.down))
    other = differs | (known & (status == RayStatus.PICTURE) & (pixels_apart > SEEN))
    return Judgement(
        against=truth.against,
        sampled=len(status),
        unknown=int(np.count_nonzero(~known)),
        compared=int(both.sum()),
        pixels=_distances(pixels_apart, both, known, drawn),
        units=_distances(units_apart, both, known, drawn),
        differ=share_estimate(differs[lens], _of(drawn, lens)),
        colours=share_estimate(other, drawn),
        unknown_share=share_estimate(~known[lens], _of(drawn, lens)),
    )


def lengths(apart: Array, picture: Picture) -> Array:
    """Return how long differences of picture coordinates are on the plane, scene units."""
    s, t = apart.T
    squares = ((s * right + t * down) ** 2 for right, down in zip(picture.right, picture.down, strict=True))
    length: Array = np.sqrt(sum(squares))
    return length


def _of(drawn: Strata | None, chosen: NDArray[np.bool_]) -> Strata | None:
    return None if drawn is None else drawn.of(chosen)


def _distances(errors: Array, both: NDArray[np.bool_], known: NDArray[np.bool_], drawn: Strata | None) -> Distances:
    counted = both | ~known
    each, of_them = np.where(known, errors, math.inf)[counted], _of(drawn, counted)
    return Distances(
        median=quantile_estimate(each, of_them, 0.5),
        high=quantile_estimate(each, of_them, LEVEL),
        largest=float(errors[both].max(initial=0.0)),
    )
