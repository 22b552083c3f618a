"""Hold a ray map against the truth: how far off its rays land, how many end otherwise, how many show another colour."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.statistics import Estimate, Strata, quantile_estimate, share_estimate
from lenscl.accuracy.truth import Truth
from lenscl.config.scene import Picture
from lenscl.status import RayStatus
from lenscl.tracing import RayMap

Array = NDArray[np.float64]

LEVEL = 0.99  # of the rays land within the error that a map is known by
MOST_DIFFER = 1e-3  # share of the rays through a lens that may end otherwise where an accuracy is asked for
SEEN = 0.5 / 255  # pixels: between a black and a white pixel, half a step of 8 bits
_LANDS = tuple(int(status) for status in RayStatus if status.lands)


@dataclass(frozen=True, slots=True, kw_only=True)
class Distances:
    """Errors of the rays that meet a lens and land on the picture's plane, there and here."""

    median: Estimate
    high: Estimate  # 99 %
    largest: float  # of those looked at


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """What a map is worth.

    Attributes
    ----------
    against : str
        What it was held against.
    sampled, unknown, compared : int
        Rays looked at; those of them of which nobody can tell the end; those that errors are of.
    pixels : Distances
        max(|ds| W, |dt| H) on the picture of W x H pixels.
    units : Distances
        Distance on the picture's plane, scene units.
    differ : Estimate
        Share of the rays through a lens, there or here, that end otherwise: another status, or other events. A ray
        that is undecided here ends otherwise, too.
    colours : Estimate
        Share of all rays that may show another colour: they end otherwise, or land more than `SEEN` off.
    """

    against: str
    sampled: int
    unknown: int
    compared: int
    pixels: Distances
    units: Distances
    differ: Estimate
    colours: Estimate

    def distances(self, unit: str) -> Distances:
        """Return the errors in the unit of an `Accuracy`."""
        return self.pixels if unit == "px" else self.units


def judge(raymap: RayMap, truth: Truth, drawn: Strata | None = None, size: tuple[int, int] | None = None) -> Judgement:
    """Compare a map of the same scene.

    Parameters
    ----------
    raymap : RayMap
    truth : Truth
        Of any of its pixels.
    drawn : Strata, optional
        How the pixels were drawn; left out: they are all there are.
    size : (int, int), optional
        Columns and rows of the picture; default: the scene's.
    """
    st = raymap.st.reshape(-1, 2)[truth.pixels].astype(np.float64)
    status, events = raymap.status.ravel()[truth.pixels], raymap.events.ravel()[truth.pixels]
    picture, known = raymap.scene.picture, truth.is_known
    size = picture.size if size is None else size

    lens = known & ((events > 0) | (truth.events > 0))
    differs = (status != truth.status) | (events != truth.events)
    both = known & (truth.events > 0) & np.isin(status, _LANDS) & np.isin(truth.status, _LANDS)
    apart = (st - truth.st) - truth.rest
    pixels_apart = np.abs(apart * size).max(axis=-1) + truth.radius * max(size)
    units_apart = lengths(apart, picture) + truth.radius * (math.hypot(*picture.right) + math.hypot(*picture.down))
    other = differs | ((status == RayStatus.PICTURE) & (pixels_apart > SEEN))
    return Judgement(
        against=truth.against,
        sampled=len(status),
        unknown=int(np.count_nonzero(~known)),
        compared=int(both.sum()),
        pixels=_distances(pixels_apart[both], _of(drawn, both)),
        units=_distances(units_apart[both], _of(drawn, both)),
        differ=share_estimate(differs[lens], _of(drawn, lens)),
        colours=share_estimate(other[known], _of(drawn, known)),
    )


def lengths(apart: Array, picture: Picture) -> Array:
    """Return how long differences of picture coordinates are on the plane, scene units."""
    s, t = apart.T
    squares = ((s * right + t * down) ** 2 for right, down in zip(picture.right, picture.down, strict=True))
    length: Array = np.sqrt(sum(squares))
    return length


def _of(drawn: Strata | None, chosen: NDArray[np.bool_]) -> Strata | None:
    return None if drawn is None else drawn.of(chosen)


def _distances(errors: Array, drawn: Strata | None) -> Distances:
    return Distances(
        median=quantile_estimate(errors, drawn, 0.5),
        high=quantile_estimate(errors, drawn, LEVEL),
        largest=float(errors.max(initial=0.0)),
    )
