"""One measurement and a run of them, as frozen values that JSON takes and gives back."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from lenscl.accuracy.statistics import median, median_bounds

_Positive: TypeAlias = Annotated[float, Field(gt=0, allow_inf_nan=False)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantiles:
    """Of the errors of some rays."""

    median: float
    high: float  # 99 %
    largest: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Error:
    """How far rays land from where they should.

    Attributes
    ----------
    against : str
        What says where they should.
    sampled : int
        Rays that meet a lens, there or here.
    compared : int
        Those of them that meet the picture's plane after the same events; the quantiles are theirs.
    differ : float
        Share of the sampled that end otherwise than they should. An undecided ray does not: it claims nothing.
    pixels : Quantiles
        max(|ds| W, |dt| H) on the picture of W x H pixels; 0, which says nothing, where nothing was compared.
    coordinates : Quantiles
        max(|ds|, |dt|), 1 being the picture's width or height.
    floor : float
        Pixels, 99 %: by what the expected places move when the rays' directions change in their last bit. Errors below
        it are errors of what is compared with, too.
    unknown : float
        Share of the rays that meet a lens, there or here, or may, that are undecided there or here: no figure is of
        them.
    """

    against: str
    sampled: int
    compared: int
    differ: float
    pixels: Quantiles
    coordinates: Quantiles
    floor: float
    unknown: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Circumstances:
    """What must be equal where times are to be compared, but for `kernel_key`: that is what is compared."""

    platform: str
    device: str
    driver: str
    kind: str
    units: int  # compute units of the device
    width: int  # rays to a packet
    rays: int  # of the film
    state: Literal["warm"]  # the kernel was built and run before
    scene_key: str  # digest of the scene as written
    reference_key: str  # of the frozen kernel
    kernel_key: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Measurement:
    """Time and error of a scene traced by a method in a precision.

    Attributes
    ----------
    scene, method, precision : str
        What was asked for; together they name the row.
    searches : tuple of str
        The method of each lens, as `auto` chose it.
    ns_least, ns_median : float
        Nanoseconds a ray by the device's clock, escalation included.
    peak : float
        Multiply-add peak of the device, flop/s: the most seen between the rounds.
    ratios : tuple of float
        Seconds a ray over those of the frozen kernel just before and after, round by round.
    error : Error
    steps : float
        Of a search, in the mean; see `lenscl.tracing.StepCount`.
    undecided, escalated : float
        Shares of the film's rays: without an answer, and traced again in double precision.
    circumstances : Circumstances
    """

    scene: str
    method: str
    precision: Literal["single", "double", "mixed"]
    searches: tuple[str, ...]
    ns_least: _Positive
    ns_median: _Positive
    peak: _Positive
    ratios: Annotated[tuple[_Positive, ...], Field(min_length=1)] = field(repr=False)
    error: Error
    steps: float
    undecided: float
    escalated: float
    circumstances: Circumstances

    @property
    def row(self) -> tuple[str, str, str]:
        """What is paired between two runs."""
        return self.scene, self.method, self.precision

    @property
    def slots(self) -> float:
        """Multiply-adds and the like that the device could have done for a ray: least seconds times peak."""
        return self.ns_least * 1e-9 * self.peak

    @property
    def ratio(self) -> float:
        """Time relative to the frozen kernel's; the median of the rounds."""
        return median(self.ratios)

    @property
    def ratio_bounds(self) -> tuple[float, float]:
        """What the rounds say of `ratio`; see `median_bounds`."""
        return median_bounds(self.ratios)


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """Measurements of one sitting."""

    form: Literal[2] = 2  # of the file
    program: str  # version and digest of what was measured
    made: str  # when, ISO 8601, UTC
    measurements: tuple[Measurement, ...]

    def march_of(self, measurement: Measurement) -> Measurement | None:
        """Return the row of the method `march` for the same scene and precision, if it was measured."""
        wanted = (measurement.scene, "march", measurement.precision)
        return next((each for each in self.measurements if each.row == wanted), None)
