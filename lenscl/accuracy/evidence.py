"""What there is to judge traced rays by: error bounds of many, and certified answers where bounds are missing.

A ray has no bound where rounding may decide its path, or where F leaves too little of its digits. Few such rays are
proved one by one. Many such rays are a scene where double precision says little: then rays are drawn, and each is
proved.
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

FEW_PROVED = 512  # rays of a scene without bounds: enough to see that a wish is far off, or to plan by
MOST_PROVED = 3000  # rays: where none of them ends otherwise, no more than 0.1 % of all do, with 95 % confidence
MOST_LOOKS = 1_000_000  # at F along the rays that are proved at once: most rays take some hundred, a few dear ones 10^5
_SPARE = 0.5  # of what may end otherwise: so few rays without a bound are not proved
_SEED = 8


class Looked(Protocol):
    """Traced rays, by their numbers, with both truths of them."""

    @property
    def traced(self) -> RayMap | RayPaths:
        """The rays as they were traced."""

    def bounded(self, numbers: Numbers) -> Truth:
        """Return what double precision and its error bounds say of some rays."""

    def certified(self, numbers: Numbers) -> Truth:
        """Return what is proved of some rays."""

    def near(self) -> Numbers:
        """Return the rays that meet a lens, or may; the others count for nothing."""

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
        """Return those that meet a lens, are undecided, or have a neighbour that is either."""
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
        """Return all of them: given rays have no neighbours."""
        return np.arange(self.traced.status.size)

    def sample(self, wanted: dict[str, int]) -> tuple[Numbers, Strata | None]:
        """Return so many of all alike."""
        return drawn_of(self.near(), sum(wanted.values()))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Evidence:
    """A truth of some rays, how they were drawn, and for how many of those through a lens there was no bound at first.

    Attributes
    ----------
    truth : Truth
    drawn : Strata or None
        None where they are all that count.
    unbounded : float
        Share of the rays through a lens, or that may be, that double precision has no error bound for.
    """

    truth: Truth
    drawn: Strata | None
    unbounded: float

    def of(self, traced: RayMap | RayPaths, size: tuple[int, int] | None) -> Judgement:
        """Hold rays against it."""
        return judge(traced, self.truth, self.drawn, size)


def gathered(looked: Looked, numbers: Numbers, drawn: Strata | None, most: int) -> Evidence:
    """Return what there is to judge some rays by.

    Parameters
    ----------
    looked : Looked
    numbers : int array
        Of the rays to look at.
    drawn : Strata, optional
        How they were drawn; None: they are all that count.
    most : int
        Rays to prove at the most, of a scene where many have no bound.

    Returns
    -------
    Evidence
        Without python-flint, rays without a bound stay unknown.
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
    """Return certified answers of at most so many rays, drawn from all that count."""
    numbers, drawn = drawn_of(looked.near(), most)
    return Evidence(truth=looked.certified(numbers), drawn=drawn, unbounded=unbounded)


def drawn_of(numbers: Numbers, most: int) -> tuple[Numbers, Strata | None]:
    """Return at most so many of some rays, and how they were drawn; None where that is all of them.

    Which ones are drawn hangs on their numbers alone: of nearly the same rays nearly the same ones are drawn, and of
    more rays all that are drawn of fewer.
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
    """Return given rays of each wavelength as ones without that axis; themselves, alone, where they have none."""
    if "wavelengths" not in paths.added:
        return (paths,)
    arrays = ("st", "status", "events", "origin", "direction")
    return tuple(
        replace(paths, scene=scene, added=Frozen(), **{name: getattr(paths, name)[number] for name in arrays})
        for number, scene in enumerate(paths.scene.layers())
    )
