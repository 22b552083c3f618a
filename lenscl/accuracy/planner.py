"""From a wanted accuracy to the cheapest way to trace a scene that meets it, and the proof that it did.

Input: a scene with `numerics.accuracy`. Output: a `Plan`, then a ray map with what it `Achieved`. The plan is made on a
film of at most 2^18 pixels: every ray of it is traced in double precision with a bound on its error, and combinations
are tried against that, the cheapest first. Where the bounds are too wide for the wish, certified answers take their
place. What was planned is checked again on the rays of the map itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.calibration import Calibration, CalibrationCache, best_times, key_of
from lenscl.accuracy.combination import MARCH, Combination, precisions_of, serving
from lenscl.accuracy.front import coarser, require_lens
from lenscl.accuracy.judgement import LEVEL, MOST_DIFFER, Judgement, judge
from lenscl.accuracy.sample import EDGE, FREE, LENS, MANY, STEEP, Sample
from lenscl.accuracy.statistics import Strata, quantile
from lenscl.accuracy.truth import Truth
from lenscl.codegen import Precision
from lenscl.config import Accuracy, Scene
from lenscl.device import Device
from lenscl.errors import StudyError
from lenscl.tracing import Placement, RayMap, trace

_PIXELS = (2**13, 2**18)  # of the film that a plan is made on: the fewest that tell a share of 0.1 %, and the most
_SECONDS = 2.0  # that tracing it with error bounds may take
_BOUNDED_TRACES = 5  # of every ray, for its bound
_WIDE = 0.1  # of the wish: error bounds that are wider are replaced by certified answers
_MARGIN = 0.9  # of the wish: another film of the same scene has another 99 % quantile, by a few per cent
_MARGIN_OF_MARCH = 0.7  # of the share that may end otherwise, of which a march's steps would take all there is
_NEAR = 1.6  # times the best: within so much, combinations are timed again on the scene itself
_ALIKE = 1.08  # times the fastest: noise
_WORTH = 1.2  # a march must be faster than a guaranteed search by so much to be taken
_WEAK = 0.05  # indices that differ by so little: there alone the paraxial rule can be accurate
_USUAL_STEPS, _COARSER = 30, 2.0  # steps of a march that a calibration is of; coarser ones may be so much faster
_FEWEST_STEPS, _MOST_STEPS, _FINER = 8, 2000, 1.3  # of a march across the largest lens, and from one try to the next
_MOST_PLANS = 256  # kept by a planner
_CHECKED = (2**13, 2**15)  # rays of a map that are looked at again; fewer of one that takes over `_SLOW` seconds a ray
_SLOW = 1e-6
_CERTIFIED = {EDGE: 30, MANY: 40, STEEP: 60, LENS: 330, FREE: 10}  # where bounds are too wide
_SEED = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Achieved:
    """How accurate a map is that was asked to be so.

    Attributes
    ----------
    wanted : Accuracy
    combination : Combination
        That it was traced by.
    error : float
        In the unit of the wish: 99 % of the rays land within it, errors of what they were held against included.
    differ : float
        Share of the rays through a lens that end otherwise.
    rays : int
        That this was seen on.
    against : str
    """

    wanted: Accuracy
    combination: Combination
    error: float
    differ: float
    rays: int
    against: str

    @property
    def is_met(self) -> bool:
        """Whether the wish is fulfilled."""
        return self.error <= self.wanted.value and self.differ <= MOST_DIFFER

    def as_json(self) -> dict[str, Any]:
        """Return it as a plain dictionary."""
        return {
            "wanted": str(self.wanted),
            "numerics": self.combination.numerics(),
            "error": self.error,
            "unit": self.wanted.unit,
            "differ": self.differ,
            "rays": self.rays,
            "against": self.against,
        }

    def __str__(self) -> str:
        unit = "px" if self.wanted.unit == "px" else "scene units"
        return f"{self.combination}: 99 % within {self.error:.2g} {unit}, {100 * self.differ:.2g} % end otherwise"


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """The combination for a scene, with what was seen of it on the film that it was planned on."""

    achieved: Achieved
    ns: float

    @property
    def combination(self) -> Combination:
        """How to trace."""
        return self.achieved.combination


class Planner:
    """Plans and traces on one device; what it learns of a scene it keeps.

    Parameters
    ----------
    device : Device
    cache : CalibrationCache, optional
        Where times are kept; default: the user's cache folder.
    """

    def __init__(self, device: Device, cache: CalibrationCache | None = None) -> None:
        self._device, self._cache = device, cache or CalibrationCache()
        self._plans: dict[tuple[Scene, tuple[int, int] | None, frozenset[Combination]], Plan] = {}

    def trace(
        self, scene: Scene, *, size: tuple[int, int] | None = None, like: Scene | None = None
    ) -> tuple[RayMap, Achieved | None]:
        """Trace a film as accurately as its scene asks.

        Parameters
        ----------
        scene : Scene
            Without `numerics.accuracy` it is traced as it says, and nothing is checked.
        size : (int, int), optional
            Columns and rows of the largest picture, whose pixels an accuracy may be in; default: the scene's.
        like : Scene, optional
            A scene of the same structure whose plan is tried first; where its combination proves too coarse here, this
            scene gets a plan of its own.

        Raises
        ------
        StudyError
            If no combination is accurate enough; the message says what is.
        LensclError
            As `lenscl.trace`; and where certified answers are needed and python-flint is missing.
        """
        if scene.numerics.accuracy is None:
            return trace(scene, device=self._device), None
        if like is not None:
            try:
                raymap, achieved = self._traced(scene, self.plan(like, size), size)
            except StudyError:
                pass  # what cannot be reached there may be here
            else:
                if achieved.is_met:
                    return raymap, achieved
        tried: frozenset[Combination] = frozenset()
        while True:
            raymap, achieved = self._traced(scene, self.plan(scene, size, tried), size)
            if achieved.is_met:
                return raymap, achieved
            tried |= {achieved.combination}  # what was enough on the plan's film is not on this one

    def plan(
        self, scene: Scene, size: tuple[int, int] | None = None, without: frozenset[Combination] = frozenset()
    ) -> Plan:
        """Return the cheapest combination that meets `numerics.accuracy`, some left out; errors as for `trace`."""
        key = scene, size, without
        if key not in self._plans:
            if len(self._plans) >= _MOST_PLANS:
                self._plans.clear()
            self._plans[key] = _Planning(scene, size, self._device, self._cache, without).plan()
        return self._plans[key]

    def _traced(self, scene: Scene, plan: Plan, size: tuple[int, int] | None) -> tuple[RayMap, Achieved]:
        raymap = trace(plan.combination.of(scene), device=self._device)
        return raymap, check(raymap, wanted_of(scene), plan.combination, size)


def wanted_of(scene: Scene) -> Accuracy:
    """Return the accuracy that a scene asks for."""
    assert scene.numerics.accuracy is not None, "only scenes that ask for an accuracy are planned"
    return scene.numerics.accuracy


def check(raymap: RayMap, wanted: Accuracy, combination: Combination, size: tuple[int, int] | None) -> Achieved:
    """Return how accurate a map is, from some thousand of its rays; size as for `Planner.trace`."""
    count = raymap.status.size
    few, many = _CHECKED
    looked_at = few if raymap.trace_seconds > _SLOW * count else many
    pixels = np.arange(count) if count <= looked_at else _spread(count, looked_at)
    truth = Truth.bounded(raymap.scene, pixels, raymap.device)
    drawn = None if len(pixels) == count else Strata(np.ones(len(pixels)), np.zeros(len(pixels), np.intp))
    achieved = _achieved(judge(raymap, truth, drawn, size), wanted, combination)
    if achieved.error <= wanted.value or not _is_too_wide(truth, raymap.scene, wanted, size):
        return achieved
    sample = Sample.of(raymap, _CERTIFIED)
    certified = Truth.certified(raymap.scene, sample.pixels)
    return _certified(achieved, judge(raymap, certified, sample.drawn, size))


def _spread(count: int, looked_at: int) -> NDArray[np.intp]:
    """Return pixels all over a film, one at random of each of equal runs of them."""
    edges = np.linspace(0, count, looked_at + 1)
    places = np.random.default_rng(_SEED).uniform(edges[:-1], edges[1:])
    return np.minimum(places.astype(np.intp), count - 1)


def _achieved(judgement: Judgement, wanted: Accuracy, combination: Combination) -> Achieved:
    distances = judgement.pixels if wanted.unit == "px" else judgement.units
    return Achieved(
        wanted=wanted,
        combination=combination,
        error=distances.high.value,
        differ=judgement.differ.value,
        rays=judgement.compared,
        against=judgement.against,
    )


def _certified(achieved: Achieved, judgement: Judgement) -> Achieved:
    """Return the same with the error against certified answers; `differ` is told better by more rays."""
    exact = _achieved(judgement, achieved.wanted, achieved.combination)
    return replace(achieved, error=exact.error, rays=exact.rays, against=exact.against)


def _is_too_wide(truth: Truth, scene: Scene, wanted: Accuracy, size: tuple[int, int] | None) -> bool:
    """Whether the bounds alone are a good part of the wish, so that an error within them says little."""
    lens = truth.is_known & (truth.events > 0)
    bound = quantile(truth.radius[lens], np.ones(np.count_nonzero(lens)), LEVEL)
    picture = scene.picture
    unit = max(size or picture.size) if wanted.unit == "px" else math.hypot(*picture.right) + math.hypot(*picture.down)
    return bound * unit > _WIDE * wanted.value


def _unreachable(best: Achieved) -> StudyError:
    """Return the error of a wish that nothing fulfils."""
    if best.error <= best.wanted.value:
        return StudyError(
            [
                f"numerics.accuracy: {100 * best.differ:.2g} % of the rays through a lens end otherwise than they "
                f"should, even by {best.combination}; {100 * MOST_DIFFER:g} % may. "
                "Rounding decides the paths of so many; set numerics.method and numerics.precision to trace it so"
            ]
        )
    unit = " px" if best.wanted.unit == "px" else ""
    return StudyError(
        [
            f'numerics.accuracy: "{best.wanted}" cannot be reached: the most accurate here, {best.combination}, lands '
            f"99 % of the rays within {best.error:.2g}{unit}; ask for no less than that"
        ]
    )


class _Planning:
    """A plan in the making, for one scene."""

    def __init__(
        self,
        scene: Scene,
        size: tuple[int, int] | None,
        device: Device,
        cache: CalibrationCache,
        without: frozenset[Combination],
    ) -> None:
        self.without = without
        self.wanted, self.size, self.device, self.cache = wanted_of(scene), size, device, cache
        self.best = Combination(method="auto", precision=precisions_of(device)[-1])
        self.scene = self._small(scene)
        self.reference = trace(self.best.of(self.scene), device=device)
        require_lens(self.reference)
        self.truth = Truth.bounded(self.best.of(self.scene), np.arange(self.reference.status.size), device)
        self.maps: dict[Combination, RayMap] = {self.best: self.reference}

    def plan(self) -> Plan:
        """Return the cheapest combination that is accurate enough."""
        times = self._calibration()
        near: list[Achieved] = []
        seen: list[Achieved] = []
        first = math.inf
        for combination, ns in sorted(times.items(), key=lambda pair: pair[1]):
            if combination.method == MARCH or ns > _NEAR * first:
                continue
            seen.append(self._judged(combination))
            if self._is_enough(seen[-1]):
                near.append(seen[-1])
                first = min(first, ns)
        if not near and _is_too_wide(self.truth, self.scene, self.wanted, self.size):
            seen = self._by_certified_answers(seen)
            near = [each for each in seen if self._is_enough(each)]
        if not near:
            raise _unreachable(min(seen, key=lambda each: (each.differ > MOST_DIFFER, each.error)))
        near += [each for each in self._paraxial(near) if self._is_enough(each)]
        plan = self._fastest(near)
        return self._march(plan, times, {each.combination.precision for each in near})

    def _small(self, scene: Scene) -> Scene:
        """Return the scene with a film that can be traced again and again."""
        fewest, most = _PIXELS
        small = coarser(scene, fewest)
        ns = best_times([self.best.of(small)], self.device, rounds=1)[0]
        return coarser(scene, int(min(max(_SECONDS * 1e9 / (_BOUNDED_TRACES * ns), fewest), most)))

    def _calibration(self) -> dict[Combination, float]:
        """Return the times of all searches in all precisions; of the march with so many steps through the lens."""
        key = key_of(self.scene, self.device)
        kept = self.cache.get(key)
        if kept is None:
            tried = [
                Combination(method=name, precision=precision)
                for precision in precisions_of(self.device)
                for name in serving(self.scene)
            ]
            scenes = [self._usual(each).of(self.scene) for each in tried]
            times = best_times(scenes, self.device)
            kept = Calibration(about=key, ns=tuple(zip(tried, times, strict=True)))
            self.cache.keep(kept)
        return dict(kept.ns)

    def _usual(self, combination: Combination) -> Combination:
        return self._stepped(combination, _USUAL_STEPS) if combination.method == MARCH else combination

    def _stepped(self, march: Combination, parts: float) -> Combination:
        across = max(Placement.of(lens).diagonal() for lens in self.scene.lenses)
        return replace(march, step=float(f"{across / parts:.2g}"))

    def _judged(self, combination: Combination) -> Achieved:
        return _achieved(judge(self._map(combination), self.truth, None, self.size), self.wanted, combination)

    def _map(self, combination: Combination) -> RayMap:
        if combination not in self.maps:
            self.maps[combination] = trace(combination.of(self.scene), device=self.device)
        return self.maps[combination]

    def _is_enough(self, achieved: Achieved) -> bool:
        lost = _MARGIN_OF_MARCH if achieved.combination.method == MARCH else _MARGIN
        is_accurate = achieved.error <= _MARGIN * self.wanted.value and achieved.differ <= lost * MOST_DIFFER
        return is_accurate and achieved.combination not in self.without

    def _fastest(self, some: list[Achieved]) -> Plan:
        """Return the fastest; of several that are nearly as fast, the most accurate."""
        times = best_times([each.combination.of(self.scene) for each in some], self.device)
        as_fast = [pair for pair in zip(times, some, strict=True) if pair[0] <= _ALIKE * min(times)]
        ns, achieved = min(as_fast, key=lambda pair: pair[1].error)
        return Plan(achieved=achieved, ns=ns)

    def _by_certified_answers(self, seen: list[Achieved]) -> list[Achieved]:
        """Judge again, of what the error bounds were too wide for, what may be accurate to the last digits."""
        exact = [each for each in seen if each.combination.precision != "single"]
        sample = Sample.of(self.reference, _CERTIFIED)
        truth = Truth.certified(self.scene, sample.pixels)
        return [
            _certified(each, judge(self._map(each.combination), truth, sample.drawn, self.size))
            for each in exact or seen
        ]

    def _paraxial(self, near: list[Achieved]) -> list[Achieved]:
        """Return what the paraxial rule achieves, where the lenses are so weak that it may be enough."""
        medium = self.scene.n_medium
        if any(abs(math.log(lens.n / medium)) > _WEAK for lens in self.scene.lenses):
            return []
        return [self._judged(replace(each.combination, snell="paraxial")) for each in near]

    def _march(self, plan: Plan, times: dict[Combination, float], precisions: set[Precision]) -> Plan:
        """Return the march in the place of a guaranteed search, where it is accurate enough and so much faster.

        Its time is nearly that of its steps, so it is tried from coarse steps to fine ones, until it loses few enough
        rays or is too slow.
        """
        if any(each.method == MARCH for each in self.without):
            return plan  # one that seemed good enough was not: there is no relying on them here
        for march in (Combination(method=MARCH, precision=each) for each in precisions_of(self.device)):
            if march.precision not in precisions or times[march] > _COARSER * plan.ns:
                continue
            parts = float(_FEWEST_STEPS)
            while parts <= _MOST_STEPS:
                combination = self._stepped(march, parts)
                both = [each.of(self.scene) for each in (plan.combination, combination)]
                now, ns = best_times(both, self.device)
                if ns * (1.0 if plan.combination.method == MARCH else _WORTH) > now:
                    break
                if self._is_enough(achieved := self._judged(combination)):
                    plan = Plan(achieved=achieved, ns=ns)
                    break
                parts *= _FINER
        return plan
