"""Find the cheapest way to trace one scene that is as accurate as the scene asks.

The plan is made on a film of at most 2^18 pixels: every ray of it is traced in double precision with a bound on its
error, and combinations are tried against that, the cheapest first. Where the bounds are too wide for the wish,
certified answers take their place.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from lenscl.accuracy.achieved import (
    CERTIFIED_RAYS,
    Achieved,
    achieved_by,
    is_too_wide,
    unreachable,
    wanted_of,
    with_certified_error,
)
from lenscl.accuracy.calibration import Calibration, CalibrationCache, best_times, key_of
from lenscl.accuracy.combination import MARCH, Combination, precisions_of, serving
from lenscl.accuracy.front import coarser
from lenscl.accuracy.judgement import MOST_DIFFER, judge
from lenscl.accuracy.sample import Sample
from lenscl.accuracy.truth import CERTIFIED, Truth
from lenscl.codegen import Precision
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.errors import LensclError, TraceError
from lenscl.tracing import Placement, RayMap, trace

_PIXELS = (2**13, 2**18)  # of the film that a plan is made on
_SECONDS = 2.0  # that tracing it with error bounds may take
_BOUNDED_TRACES = 5  # of every ray, for its bound
_MARGIN = 0.9  # of the wish: the film itself has another 99 % quantile, by a few per cent
_MARGIN_OF_MARCH = 0.7  # of the share that may end otherwise, of which a march's steps would take all there is
_NEAR = 1.6  # times the best: within so much, combinations are timed again on the scene itself
_ALIKE = 1.08  # times the fastest: noise
_WORTH = 1.2  # a march must be faster than a guaranteed search by so much to be taken
_WEAK = 0.05  # indices that differ by so little: there alone the paraxial rule can be accurate
_USUAL_STEPS, _COARSER = 30, 2.0  # steps of a march that a calibration is of; coarser ones may be so much faster
_FEWEST_STEPS, _MOST_STEPS, _FINER = 8, 2000, 1.3  # of a march across the largest lens, and from one try to the next


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """The combination for a scene, with what was seen of it on the film that it was planned on."""

    achieved: Achieved
    ns: float

    @property
    def combination(self) -> Combination:
        """How to trace."""
        return self.achieved.combination


class Planning:
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
        if not device.has_double:
            raise TraceError(
                f"numerics.accuracy: is judged in double precision, which {device.label} lacks; "
                "set numerics.method and numerics.precision, or choose another of `lenscl devices` by LENSCL_DEVICE"
            )
        self.best = Combination(method="auto")
        self.scene = self._lens_film(scene)
        self.reference = trace(self.best.of(self.scene), device=device)
        self.truth = Truth.bounded(self.best.of(self.scene), np.arange(self.reference.status.size), device)
        self.maps: dict[Combination, RayMap] = {self.best: self.reference}

    def plan(self) -> Plan:
        """Return the cheapest combination that is accurate enough."""
        if not self.reference.events.any():  # nothing to judge others by, and nothing that could be off
            return Plan(achieved=self._judged(self.best), ns=best_times([self.best.of(self.scene)], self.device)[0])
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
        if not near and is_too_wide(self.truth, self.scene, self.wanted, self.size):
            seen = self._by_certified_answers(seen)
            near = [each for each in seen if self._is_enough(each)]
        if not near:
            raise unreachable(min(seen, key=lambda each: (each.differ > MOST_DIFFER, each.error)))
        near += [each for each in self._paraxial(near) if self._is_enough(each)]
        plan = self._fastest(near)
        return self._march(plan, times, {each.combination.precision for each in near})

    def _lens_film(self, scene: Scene) -> Scene:
        """Return the scene with a film of the part that shows lenses, of so many pixels as can be traced repeatedly.

        Rays beside them would say nothing; and a lens of a few pixels is looked at by more rays than it has.
        """
        fewest, most = _PIXELS
        overview = trace(self.best.of(coarser(scene, most)), device=self.device)
        if not overview.events.any() and overview.status.size < scene.film.columns * scene.film.rows:
            overview = trace(self.best.of(scene), device=self.device)
        rows, columns = np.nonzero(overview.events)
        if not rows.size:
            return coarser(scene, fewest)
        ns = overview.trace_seconds / rows.size * 1e9  # of those that meet a lens; the others cost little
        pixels = int(min(max(_SECONDS * 1e9 / (_BOUNDED_TRACES * ns), fewest), most))
        return _part(
            scene, overview.status.shape, (rows.min(), rows.max() + 1), (columns.min(), columns.max() + 1), pixels
        )

    def _calibration(self) -> dict[Combination, float]:
        """Return the times of all searches in all precisions; of the march with so many steps through the lens."""
        key = key_of(self.scene, self.device)
        tried = [
            Combination(method=name, precision=precision)
            for precision in precisions_of(self.device)
            for name in serving(self.scene)
        ]
        kept = self.cache.get(key)
        if kept is None or [combination for combination, _ in kept.ns] != tried:
            scenes = [self._usual(each).of(self.scene) for each in tried]
            times = best_times(scenes, self.device)
            kept = Calibration(about=key, ns=tuple(zip(tried, times, strict=True)))
            with suppress(LensclError):  # a cache that cannot be written costs time, and nothing else
                self.cache.keep(kept)
        return dict(kept.ns)

    def _usual(self, combination: Combination) -> Combination:
        return self._stepped(combination, _USUAL_STEPS) if combination.method == MARCH else combination

    def _stepped(self, march: Combination, parts: float) -> Combination:
        across = max(Placement.of(lens).diagonal() for lens in self.scene.lenses)
        return replace(march, step=float(f"{across / parts:.2g}"))

    def _judged(self, combination: Combination) -> Achieved:
        return achieved_by(judge(self._map(combination), self.truth, None, self.size), self.wanted, combination)

    def _map(self, combination: Combination) -> RayMap:
        if combination not in self.maps:
            self.maps[combination] = trace(combination.of(self.scene), device=self.device)
        return self.maps[combination]

    def _is_enough(self, achieved: Achieved) -> bool:
        lost = _MARGIN_OF_MARCH if achieved.combination.method == MARCH else _MARGIN
        margin = 1.0 if achieved.against == CERTIFIED else _MARGIN  # its upper bound is held against the wish already
        is_accurate = achieved.error <= margin * self.wanted.value and achieved.differ <= lost * MOST_DIFFER
        return is_accurate and achieved.combination not in self.without

    def _fastest(self, some: list[Achieved]) -> Plan:
        """Return the fastest; of several that are nearly as fast, always the same one."""
        times = best_times([each.combination.of(self.scene) for each in some], self.device)
        as_fast = [pair for pair in zip(times, some, strict=True) if pair[0] <= _ALIKE * min(times)]
        # Noise is not to choose: the most precise, and of those the method that auto would take
        precisions, methods = precisions_of(self.device), serving(self.scene)
        ns, achieved = min(
            as_fast,
            key=lambda pair: (
                -precisions.index(pair[1].combination.precision),
                methods.index(pair[1].combination.method),
                pair[1].combination.snell,
            ),
        )
        return Plan(achieved=achieved, ns=ns)

    def _by_certified_answers(self, seen: list[Achieved]) -> list[Achieved]:
        """Judge again, of what the error bounds were too wide for, what may be accurate to the last digits."""
        exact = [each for each in seen if each.combination.precision != "single"]
        sample = Sample.of(self.reference, CERTIFIED_RAYS)
        truth = Truth.certified(self.scene, sample.pixels)
        return [
            with_certified_error(each, judge(self._map(each.combination), truth, sample.drawn, self.size))
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
        # Where one seemed good enough and was not, only finer ones are tried
        coarsest = min((each.step / _FINER for each in self.without if each.step is not None), default=math.inf)
        for march in (Combination(method=MARCH, precision=each) for each in precisions_of(self.device)):
            if march.precision not in precisions or times[march] > _COARSER * plan.ns:
                continue
            parts = float(_FEWEST_STEPS)
            while parts <= _MOST_STEPS:
                combination = self._stepped(march, parts)
                parts *= _FINER
                if combination.step is not None and combination.step > coarsest:
                    continue
                achieved = self._judged(combination)
                seen = self.maps.pop(combination)
                if seen.trace_seconds * 1e9 > _COARSER * plan.ns * seen.status.size:
                    break
                if self._is_enough(achieved):
                    now, ns = best_times([each.of(self.scene) for each in (plan.combination, combination)], self.device)
                    if ns * (1.0 if plan.combination.method == MARCH else _WORTH) < now:
                        plan = Plan(achieved=achieved, ns=ns)
                    break
        return plan


def _part(scene: Scene, shape: tuple[int, ...], rows: tuple[int, int], columns: tuple[int, int], pixels: int) -> Scene:
    """Return the scene with a part of its film, given in pixels of a film of that shape, at so many pixels in all."""
    film = scene.film
    (top, bottom), (left, right) = (
        [place / n for place in span] for span, n in zip((rows, columns), shape, strict=True)
    )
    across, down = np.asarray(film.right), np.asarray(film.down)
    corner = np.asarray(film.corner) + left * across + top * down
    # As many columns to a row as the part has of the film's own pixels
    aspect = (right - left) * film.columns / ((bottom - top) * film.rows)
    wide = min(max(round(math.sqrt(pixels * aspect)), 1), pixels)
    return scene.replace(
        {
            "film.corner": corner.tolist(),
            "film.right": ((right - left) * across).tolist(),
            "film.down": ((bottom - top) * down).tolist(),
            "film.scale": 1.0,
            "film.size": [wide, max(pixels // wide, 1)],
        }
    )
