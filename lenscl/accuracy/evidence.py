"""Gather the truth that traced rays are judged by: error bounds, and certified answers where bounds are missing.

A ray has no error bound if rounding may decide its path, or if F loses too many digits. If few rays have no bound, a
certified answer is computed for each of these. If many have none, double precision says little about the scene: then
rays are drawn at random, and a certified answer is computed for each ray drawn.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.judgement import LEVEL, MOST_DIFFER, Judgement, judge
from lenscl.accuracy.sample import NEIGHBOURS, Sample
from lenscl.accuracy.statistics import Strata
from lenscl.accuracy.truth import Truth
from lenscl.config.scene import Frozen
from lenscl.reference import flint_trouble
from lenscl.status import RayStatus
from lenscl.tracing import RayMap, RayPaths

Array = NDArray[np.float64]
Numbers = NDArray[np.intp]

FEW_PROVED = 512  # rays with certified answers: enough to plan, and to see that an accuracy is far out of reach
MOST_PROVED = 3000  # rays: if none of them ends otherwise, at most 0.1 % of all do, with 95 % confidence
MOST_LOOKS = 1_000_000  # evaluations of F for certified answers: most rays take some hundred, a few 10^5
_SPARE = 0.5  # of MOST_DIFFER: if no larger share of rays has no bound, none of them is certified
_SEED = 8


class Looked(Protocol):
    """Traced rays, by their numbers, with their error bounds and certified answers."""

    @property
    def traced(self) -> RayMap | RayPaths:
        """The rays as they were traced."""

    def bounded(self, numbers: Numbers) -> Truth:
        """Return some rays in double precision, with error bounds."""

    def certified(self, numbers: Numbers) -> Truth:
        """Return certified answers of some rays."""

    def near(self) -> Numbers:
        """Return the rays that meet a lens, or may meet one: only these are judged."""

    def sample(self, wanted: dict[str, int]) -> tuple[Numbers, Strata | None]:
        """Return about so many rays of each stratum of a `Sample`, and how they were drawn."""


@dataclass(frozen=True, slots=True)
class FilmRays:
    """The rays of a film."""

    traced: RayMap

    def bounded(self, numbers: Numbers) -> Truth:
        """As `Looked` has it."""
        return Truth.bounded(self.traced.scene, numbers, self.traced.device)

    def certified(self, numbers: Numbers) -> Truth:
        """As `Looked` has it."""
        return Truth.certified(self.traced.scene, numbers, MOST_LOOKS)

    def near(self) -> Numbers:
        """Return the rays that meet a lens or are undecided, and their neighbours."""
        own = (self.traced.events > 0) | (self.traced.status == RayStatus.UNDECIDED)
        near = own.copy()
        for here, there in NEIGHBOURS:
            near[here] |= own[there]
            near[there] |= own[here]
        return np.flatnonzero(near)

    def sample(self, wanted: dict[str, int]) -> tuple[Numbers, Strata | None]:
        """As `Looked` has it."""
        found = Sample.of(self.traced, wanted)
        return found.pixels, found.drawn


@dataclass(frozen=True, slots=True)
class GivenRays:
    """Rays that a caller gave: origins and directions, float64 arrays of shape (N, 3)."""

    traced: RayPaths
    origins: Array
    directions: Array

    def bounded(self, numbers: Numbers) -> Truth:
        """As `Looked` has it."""
        return Truth.bounded_rays(self.traced.scene, self.origins, self.directions, numbers, self.traced.device)

    def certified(self, numbers: Numbers) -> Truth:
        """As `Looked` has it."""
        return Truth.certified_rays(self.traced.scene, self.origins, self.directions, numbers, MOST_LOOKS)

    def near(self) -> Numbers:
        """Return all rays: given rays have no neighbours."""
        return np.arange(self.traced.status.size)

    def sample(self, wanted: dict[str, int]) -> tuple[Numbers, Strata | None]:
        """Return so many rays in all, drawn without strata."""
        return drawn_of(self.near(), sum(wanted.values()))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Evidence:
    """The truth about some rays, how they were drawn, and the share of rays without an error bound.

    Attributes
    ----------
    truth : Truth
    drawn : Strata or None
        None if they are all rays that are judged.
    unbounded : float
        Of the rays that meet a lens, or may, the share without an error bound in double precision.
    """

    truth: Truth
    drawn: Strata | None
    unbounded: float

    def of(self, traced: RayMap | RayPaths, size: tuple[int, int] | None) -> Judgement:
        """Compare traced rays with this truth."""
        return judge(traced, self.truth, self.drawn, size)


def gathered(looked: Looked, numbers: Numbers, drawn: Strata | None, most: int) -> Evidence:
    """Return the truth that some rays are judged by.

    Parameters
    ----------
    looked : Looked
    numbers : int array
        Of the rays to judge.
    drawn : Strata, optional
        How they were drawn; None if they are all rays that are judged.
    most : int
        Largest number of rays to certify.

    Returns
    -------
    Evidence
        Rays without a bound stay unknown if python-flint is not installed.
    """
    truth = looked.bounded(numbers)
    share = judge(looked.traced, truth, drawn).unknown_share.value
    if share <= _SPARE * MOST_DIFFER or flint_trouble() is not None:
        return Evidence(truth=truth, drawn=drawn, unbounded=share)
    unknown = numbers[~truth.is_known]
    if share <= 1.0 - LEVEL and len(unknown) <= most:
        return Evidence(truth=truth.with_known(looked.certified(unknown)), drawn=drawn, unbounded=share)
    return proved(looked, most, share)


def proved(looked: Looked, most: int, unbounded: float) -> Evidence:
    """Return certified answers of at most `most` rays, drawn from all that meet a lens or may meet one."""
    numbers, drawn = drawn_of(looked.near(), most)
    return Evidence(truth=looked.certified(numbers), drawn=drawn, unbounded=unbounded)


def drawn_of(numbers: Numbers, most: int) -> tuple[Numbers, Strata | None]:
    """Return at most `most` of some rays, and how they were drawn; None if none is left out.

    Only the rays' numbers decide which are drawn. So two calls with nearly the same rays draw nearly the same ones, and
    a call with a larger `most` draws all that one with a smaller `most` draws.
    """
    if len(numbers) <= most:
        return numbers, None
    # Order by a mixed number: SplitMix64, Steele, Lea & Flood, OOPSLA 2014
    mixed = (numbers.astype(np.uint64) + np.uint64(_SEED)) * np.uint64(0x9E3779B97F4A7C15)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        mixed = (mixed ^ (mixed >> np.uint64(shift))) * np.uint64(factor)
    taken = np.sort(numbers[np.argsort(mixed ^ (mixed >> np.uint64(31)), kind="stable")[:most]])
    return taken, Strata(np.full(most, len(numbers) / most), np.zeros(most, np.intp))


def given_layers(paths: RayPaths) -> tuple[RayPaths, ...]:
    """Return the rays of each wavelength, as rays without that axis; the rays as they are if they have no such axis."""
    if "wavelengths" not in paths.added:
        return (paths,)
    arrays = ("st", "status", "events", "origin", "direction")
    return tuple(
        replace(paths, scene=scene, added=Frozen(), **{name: getattr(paths, name)[number] for name in arrays})
        for number, scene in enumerate(paths.scene.layers())
    )
