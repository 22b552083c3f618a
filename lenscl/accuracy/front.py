"""Time against error for every way to trace a scene, and which of them nothing beats.

Input: a scene and a device. Output: a `Front`. All are traced in turn, round after round, in an order that changes, so
that a machine that slows down slows all of them; two are told apart by the ratios of their times within the rounds.
Errors are those of a stratified sample, against certified answers.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import isfinite, sqrt
from typing import Any, Literal

import numpy as np

from lenscl.accuracy.combination import Combination, every_combination, forerunner, precisions_of
from lenscl.accuracy.judgement import MOST_DIFFER, Judgement, judge
from lenscl.accuracy.sample import Sample
from lenscl.accuracy.statistics import median, median_bounds
from lenscl.accuracy.truth import Truth
from lenscl.config import Accuracy, Scene
from lenscl.device import Device
from lenscl.errors import BuildError, StudyError, TraceError
from lenscl.status import RayStatus
from lenscl.tracing import RayMap, trace
from lenscl.version import program_version

ROUNDS = 15
MOST_PIXELS = 2**18  # of the film that is timed; a larger one is made coarser
_SEED = 4  # of the order within the rounds


@dataclass(frozen=True, slots=True, kw_only=True)
class Tried:
    """One combination's time and error.

    Attributes
    ----------
    combination : Combination
    searches : tuple of str
        The method of each lens.
    ns : tuple of float
        Nanoseconds a ray by the device's clock, escalation included, round by round; rounds of one `Front` are paired.
    first_seconds : float
        Wall time of the row's first trace: it built the program, or fetched it from the driver's cache, unless an
        earlier row had.
    judgement : Judgement
        Against certified answers.
    differ : float
        Share of all rays through a lens that end otherwise than in double precision by `auto`.
    undecided, escalated : float
        Shares of the film's rays: without an answer, and traced again in a higher precision.
    width : int
        Rays to a packet.
    kernel_key : str
    """

    combination: Combination
    searches: tuple[str, ...]
    ns: tuple[float, ...] = field(repr=False)
    first_seconds: float
    judgement: Judgement
    differ: float
    undecided: float
    escalated: float
    width: int
    kernel_key: str

    @property
    def time(self) -> float:
        """Nanoseconds a ray; the median of the rounds."""
        return median(self.ns)

    @property
    def time_bounds(self) -> tuple[float, float]:
        """What the rounds say of `time`; see `median_bounds`."""
        return median_bounds(self.ns)

    @property
    def error(self) -> float:
        """Picture pixels that 99 % of the rays land within, unknown ones being infinitely far off."""
        return self.judgement.pixels.high.value

    @property
    def most_error(self) -> float:
        """Up to what `error` may be, by the sample."""
        bound = self.judgement.pixels.high.high
        return max(self.judgement.pixels.largest, self.error) if bound is None else bound

    @property
    def is_eligible(self) -> bool:
        """Whether so few rays end otherwise or are unknown, by both comparisons, that its error says something."""
        by_sample, unknown = self.judgement.differ.low, self.judgement.unknown_share.value
        few_differ = self.differ <= MOST_DIFFER and (by_sample is None or by_sample <= MOST_DIFFER)
        return few_differ and unknown <= MOST_DIFFER and isfinite(self.error)

    def ratio_bounds(self, other: Tried) -> tuple[float, float]:
        """Return between what its time over another's lies, by the rounds."""
        return median_bounds([own / beside for own, beside in zip(self.ns, other.ns, strict=True)])

    def meets(self, accuracy: Accuracy) -> bool:
        """Whether it is as accurate as asked for."""
        return self.is_eligible and self.judgement.distances(accuracy.unit).high.value <= accuracy.value


Place = Literal["front", "noise", "behind", "not eligible"]


@dataclass(frozen=True, kw_only=True)
class Front:
    """Every combination that was tried, and how they stand.

    Attributes
    ----------
    tried : tuple of Tried
        The most accurate first.
    left_out : tuple of str
        What could not be traced, and why.
    title : str
    film, picture : (int, int)
        Columns and rows of the film that was traced, and of the picture that pixels are of.
    sampled : mapping
        Rays of each stratum that were certified.
    forerunner : Combination
        What stands for the program that this one follows.
    circumstances : mapping
        Of the device: platform, device, driver, kind, units.
    rounds : int
    program, made, scene_key : str
        What measured it, when (ISO 8601, UTC), and a digest of the scene.
    """

    tried: tuple[Tried, ...]
    left_out: tuple[str, ...]
    title: str
    film: tuple[int, int]
    picture: tuple[int, int]
    sampled: dict[str, int]
    forerunner: Combination
    circumstances: dict[str, Any]
    rounds: int
    program: str
    made: str
    scene_key: str

    @cached_property
    def places(self) -> Mapping[Combination, Place]:
        """Where each combination stands.

        From the most accurate on: what cannot be told from it by the bounds of its error is as accurate, and the
        fastest of these stands on the front; what cannot be told from that in time, either, is there but for the
        noise. What is not faster than it by more than the rounds scatter is behind. Then the same of what is left.
        One that loses too many rays has no place.
        """
        found: dict[Combination, Place] = {}
        left = [each for each in self.tried if each.is_eligible]
        while left:
            alike = [each for each in left if each.error <= left[0].most_error]
            fastest = min(alike, key=lambda each: each.time)
            level = [each for each in alike if each.ratio_bounds(fastest)[0] <= 1.0]
            for each in left:
                if each in level:
                    found[each.combination] = "front" if each is fastest else "noise"
                elif each.ratio_bounds(fastest)[1] >= 1.0:
                    found[each.combination] = "behind"
            left = [each for each in left if each.combination not in found]
        return {each.combination: found.get(each.combination, "not eligible") for each in self.tried}

    def on_front(self) -> list[Tried]:
        """Return what stands on the front, the most accurate first."""
        return [each for each in self.tried if self.places[each.combination] == "front"]

    def cheapest(self, accuracy: Accuracy) -> Tried | None:
        """Return the fastest that is as accurate as asked for, None where nothing is."""
        return min((each for each in self.tried if each.meets(accuracy)), key=lambda each: each.time, default=None)


def measure_front(
    scene: Scene,
    device: Device,
    *,
    title: str,
    made: str,
    size: tuple[int, int] | None = None,
    rounds: int = ROUNDS,
    report: Callable[[str], None] = lambda _: None,
) -> Front:
    """Trace a scene in every way, and judge each.

    Parameters
    ----------
    scene : Scene
        Its method, precision, Snell's rule, step, tolerance and accuracy play no part. It is traced at the d line.
    device : Device
    title, made : str
        As in `Front`.
    size : (int, int), optional
        Columns and rows of the picture that errors are measured in; default: the scene's.
    rounds : int
    report : callable
        Told what is being done.

    Raises
    ------
    StudyError
        If no ray meets a lens, so that there is nothing to judge; or nobody can tell where too many end.
    LensclError
        If python-flint is missing or broken.
    """
    scene = coarser(scene.at_d_line())
    best = Combination(method="auto", precision=precisions_of(device)[-1])
    reference = trace(best.of(scene), device=device)
    require_lens(reference)
    sample = Sample.of(reference)
    report(f"certifying {len(sample.pixels)} rays")
    truth = Truth.certified(best.of(scene), sample.pixels)
    require_known(judge(reference, truth, sample.drawn, size), truth)
    whole = Truth.traced(reference)

    wanted = every_combination(scene, device)
    ready, left_out = [], []
    for number, combination in enumerate(wanted, start=1):
        report(f"{number} of {len(wanted)}: {combination}")
        start = time.perf_counter()
        try:
            raymap = trace(combination.of(scene), device=device)
        except (StudyError, BuildError, TraceError) as error:
            left_out.append(f"{combination}: left out: {error}")
            continue
        first = time.perf_counter() - start
        judgement, differ = judge(raymap, truth, sample.drawn, size), judge(raymap, whole).differ.value
        ready.append((combination, first, raymap, judgement, differ))

    report(f"timing, {rounds} rounds")
    times = _times([combination.of(scene) for combination, *_ in ready], device, rounds)
    tried = [
        _tried(raymap, ns, combination=combination, first_seconds=first, judgement=judgement, differ=differ)
        for (combination, first, raymap, judgement, differ), ns in zip(ready, times, strict=True)
    ]
    return Front(
        tried=tuple(sorted(tried, key=lambda each: each.error)),
        left_out=tuple(left_out),
        title=title,
        film=scene.film.size,
        picture=size or scene.picture.size,
        sampled=sample.counts(),
        forerunner=forerunner(device),
        circumstances={**device.circumstances(), "units": device.units},
        rounds=rounds,
        program=program_version(),
        made=made,
        scene_key=hashlib.sha256(best.of(scene).to_toml().encode()).hexdigest()[:12],
    )


def require_lens(raymap: RayMap) -> None:
    """Raise where no ray of a map meets a lens, as far as is known."""
    if raymap.events.any():
        return
    if undecided := int(np.count_nonzero(raymap.status == RayStatus.UNDECIDED)):
        raise StudyError(
            [
                f"film: no ray is known to meet a lens and {undecided} are undecided, so no accuracy can be told; "
                "write lens.surface without differences of large numbers, whose last digits are noise"
            ]
        )
    raise StudyError(["film: no ray meets a lens, so no accuracy can be told; look at the film's place and size"])


def require_known(judgement: Judgement, truth: Truth) -> None:
    """Raise where nobody can tell the ends of so many rays that no way to trace them has an error."""
    if judgement.unknown and not isfinite(judgement.pixels.high.value):
        share = 100 * judgement.unknown_share.value
        raise StudyError(
            [
                f"film: of {share:.3g} % of the rays through a lens nobody can tell where they end ({truth.doubt}), so "
                "no accuracy can be told; move the film or the lens a little"
            ]
        )


def coarser(scene: Scene, most: int = MOST_PIXELS) -> Scene:
    """Return a scene whose film has at most so many pixels, of the same shape."""
    columns, rows = scene.film.size
    if columns * rows <= most:
        return scene
    shrink = sqrt(most / (columns * rows))
    wide = min(max(1, int(columns * shrink)), most)
    wide = max(wide, most // rows)  # of a film with few rows, more of its columns
    return scene.replace({"film.size": [wide, max(1, min(rows, most // wide))]})


def _times(scenes: Sequence[Scene], device: Device, rounds: int) -> list[tuple[float, ...]]:
    """Trace scenes in turn; nanoseconds a ray, round by round."""
    random, times = np.random.default_rng(_SEED), [[0.0] * rounds for _ in scenes]
    for turn in range(rounds):
        for number in random.permutation(len(scenes)):
            raymap = trace(scenes[number], device=device)
            times[number][turn] = raymap.trace_seconds / raymap.status.size * 1e9
    return [tuple(each) for each in times]


def _tried(raymap: RayMap, ns: tuple[float, ...], **known: Any) -> Tried:
    structure, rays = raymap.kernel.structure, raymap.status.size
    return Tried(
        **known,
        searches=tuple(method.name for method in structure.methods.values()),
        ns=ns,
        undecided=float((raymap.status == RayStatus.UNDECIDED).mean()),
        escalated=raymap.escalated / rays,
        width=structure.width,
        kernel_key=raymap.kernel.key,
    )
