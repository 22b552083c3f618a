"""Find the cheapest way to trace one scene that is as accurate as the scene asks.

The plan is made on the part of the film that shows lenses, or on one of at most 2^18 pixels in its place: every ray
of it is traced in double precision with a bound on its error, and combinations are tried against that, the cheapest
first. Where bounds are missing, or too wide for the wish, certified answers take their place.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.achieved import (
    CERTIFIED_RAYS,
    Achieved,
    achieved_by,
    best_of,
    is_too_wide,
    unreachable,
    wanted_of,
    with_certified_error,
)
from lenscl.accuracy.calibration import Calibration, CalibrationCache, best_times, key_of, ns_of
from lenscl.accuracy.combination import MARCH, Combination, precisions_of, serving
from lenscl.accuracy.effort import affordable
from lenscl.accuracy.evidence import FEW_PROVED, Evidence, FilmRays, gathered
from lenscl.accuracy.front import coarser
from lenscl.accuracy.judgement import MOST_DIFFER, judge
from lenscl.accuracy.truth import CERTIFIED
from lenscl.codegen import Precision
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.errors import LensclError, TraceError
from lenscl.status import RayStatus
from lenscl.tracing import Placement, RayMap, trace

_PIXELS = (2**13, 2**18)  # of the film that a plan is made on
_MARGIN = 0.9  # of the wish, where a plan is made on another film: its 99 % quantile is another, by a few per cent
_MARGIN_OF_MARCH = 0.8  # the same of the share that may end otherwise: a march's steps would take all there is
_NEAR = 1.6  # times the best: within so much, combinations are timed again on the scene itself
_ALIKE = 1.08  # times the fastest: noise
_WORTH = 1.1  # a march must be faster than a guaranteed search by so much to be taken
_WEAK = 0.05  # indices that differ by so little: there alone the paraxial rule can be accurate
_USUAL_STEPS, _COARSER = 30, 2.0  # steps of a march that a calibration is of; coarser ones may be so much faster
_FEWEST_STEPS, _MOST_STEPS = 8, 2000  # of a march across the largest lens
_FINER = 1.09  # from one step of a march to the next


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
    ) -> None:
        self.without: frozenset[Combination] = frozenset()  # left out of a plan
        self.wanted, self.size, self.device, self.cache = wanted_of(scene), size, device, cache
        if not device.has_double:
            raise TraceError(
                f"numerics.accuracy: is judged in double precision, which {device.label} lacks; "
                "set numerics.method and numerics.precision, or choose another of `lenscl devices` by LENSCL_DEVICE"
            )
        self.best = Combination(method="auto")
        self.scene, self.is_itself = self._lens_film(scene)
        self.reference = trace(self.best.of(self.scene), device=device)
        looked = FilmRays(self.reference)
        self.evidence = gathered(looked, np.arange(self.reference.status.size), None, FEW_PROVED)
        self.maps: dict[Combination, RayMap] = {self.best: self.reference}

    def plan(self) -> Plan:
        """Return the cheapest combination that is accurate enough."""
        truth = self.evidence.truth
        if not self.reference.events.any() and not truth.events.any() and truth.is_known.all():
            # Nothing to judge others by, and nothing that could be off
            if self.best in self.without:
                raise unreachable(self._judged(self.best))
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
        if not near and self._is_too_wide():
            seen = self._by_certified_answers(seen)
            near = [each for each in seen if self._is_enough(each)]
        if not near:
            raise unreachable(best_of(seen))
        near += [each for each in self._paraxial(near) if self._is_enough(each)]
        plan = self._fastest(near)
        return self._march(plan, times, {each.combination.precision for each in near})

    def _lens_film(self, scene: Scene) -> tuple[Scene, bool]:
        """Return the scene with the part of its film that shows lenses, of so many pixels as can be traced repeatedly.

        Rays beside them would say nothing; and a lens of a few pixels is looked at by more rays than it has. The second
        says whether the pixels are those of the film itself.
        """
        fewest, most = _PIXELS
        film, coarse = scene.film, coarser(scene, most)
        overview = trace(self.best.of(coarse), device=self.device)
        if not _shows(overview).any() and coarse != scene:
            coarse, overview = scene, trace(self.best.of(scene), device=self.device)
        rows, columns = np.nonzero(_shows(overview))
        if not rows.size:
            return coarser(scene, fewest), False
        pixels = affordable(scene, overview.escalated / rows.size, fewest, most)
        (top, bottom), (left, right) = ((int(each.min()), int(each.max()) + 1) for each in (rows, columns))
        part = (
            (top / coarse.film.rows, bottom / coarse.film.rows),
            (left / coarse.film.columns, right / coarse.film.columns),
        )
        own = bottom - top, right - left
        if coarse == scene and fewest <= own[0] * own[1] <= pixels:
            return _part(scene, *part, own), True
        # As many columns to a row as the part has of the film's own pixels
        aspect = (right - left) / coarse.film.columns * film.columns / ((bottom - top) / coarse.film.rows * film.rows)
        wide = min(max(round(math.sqrt(pixels * aspect)), 1), pixels)
        return _part(scene, *part, (max(pixels // wide, 1), wide)), False

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
        across = max(Placement.of(group.lens).diagonal() for group in self.scene.lenses.groups)
        return replace(march, step=float(f"{across / parts:.2g}"))

    def _judged(self, combination: Combination) -> Achieved:
        return self._achieved(self._map(combination), combination)

    def _achieved(self, raymap: RayMap, combination: Combination) -> Achieved:
        """Return what a map of the plan's film achieves; of what ends otherwise the share that was seen."""
        judgement = self.evidence.of(raymap, self.size)
        achieved = achieved_by(judgement, self.wanted, combination, self.evidence)
        return replace(achieved, differ=judgement.differ.value)

    def _is_too_wide(self) -> bool:
        """Whether certified answers say more: not of unknown rays, which were proved if they could be."""
        truth = self.evidence.truth
        known = judge(self.reference, truth).unknown_share.value <= MOST_DIFFER
        return known and is_too_wide(truth, self.scene, self.wanted, self.size)

    def _map(self, combination: Combination) -> RayMap:
        if combination not in self.maps:
            self.maps[combination] = trace(combination.of(self.scene), device=self.device)
        return self.maps[combination]

    def _is_enough(self, achieved: Achieved) -> bool:
        margin, lost = _MARGIN, _MARGIN_OF_MARCH if achieved.combination.method == MARCH else _MARGIN
        if self.is_itself:
            margin = lost = 1.0
        if achieved.against == CERTIFIED:
            margin = 1.0  # its upper bound is held against the wish already
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
        looked = FilmRays(self.reference)
        some, drawn = looked.sample(CERTIFIED_RAYS)
        certified = Evidence(truth=looked.certified(some), drawn=drawn, unbounded=self.evidence.unbounded)
        return [
            with_certified_error(each, certified.of(self._map(each.combination), self.size), certified.truth)
            for each in exact or seen
        ]

    def _paraxial(self, near: list[Achieved]) -> list[Achieved]:
        """Return what the paraxial rule achieves, where the lenses are so weak that it may be enough."""
        medium = self.scene.n_medium
        if any(abs(math.log(group.lens.n / medium)) > _WEAK for group in self.scene.lenses.groups):
            return []
        return [self._judged(replace(each.combination, snell="paraxial")) for each in near]

    def _march(self, plan: Plan, times: dict[Combination, float], precisions: set[Precision]) -> Plan:
        """Return the march in the place of a guaranteed search, where it is accurate enough and so much faster.

        Its time is nearly that of its steps, so it is tried from coarse steps to fine ones, until it loses few enough
        rays or is too slow.
        """
        for march in (Combination(method=MARCH, precision=each) for each in precisions_of(self.device)):
            if march.precision not in precisions or times[march] > _COARSER * plan.ns:
                continue
            achieved = self._coarsest_enough(march, _COARSER * plan.ns)
            if achieved is None:
                continue
            both = [each.of(self.scene) for each in (plan.combination, achieved.combination)]
            now, ns = best_times(both, self.device)
            if ns * (1.0 if plan.combination.method == MARCH else _WORTH) < now:
                plan = Plan(achieved=achieved, ns=ns)
        return plan

    def _coarsest_enough(self, march: Combination, ns: float) -> Achieved | None:
        """Return what the march achieves with the coarsest steps that are enough, None where those take longer.

        What a march loses need not fall with its step, so they are tried one by one.
        """
        # Where one seemed good enough and was not, only finer ones are tried
        lost = min((each.step for each in self.without if each.step is not None), default=math.inf)
        parts = float(_FEWEST_STEPS)
        while parts <= _MOST_STEPS:
            combination = self._stepped(march, parts)
            parts *= _FINER
            if combination.step is not None and combination.step >= lost:
                continue
            achieved = self._marched(combination, ns)
            if achieved is None or self._is_enough(achieved):
                return achieved
        return None

    def _marched(self, march: Combination, ns: float) -> Achieved | None:
        """Return what a march achieves, None where it takes more nanoseconds a ray."""
        seen = trace(march.of(self.scene), device=self.device)
        return None if ns_of(seen) > ns else self._achieved(seen, march)


def _shows(raymap: RayMap) -> NDArray[np.bool_]:
    """Return which rays meet a lens, or may."""
    shows: NDArray[np.bool_] = (raymap.events > 0) | (raymap.status == RayStatus.UNDECIDED)
    return shows


def _part(scene: Scene, down: tuple[float, float], across: tuple[float, float], shape: tuple[int, int]) -> Scene:
    """Return the scene with a part of its film, given in shares of its spans, in so many rows and columns."""
    film = scene.film
    right, below = np.asarray(film.right), np.asarray(film.down)
    corner = np.asarray(film.corner) + across[0] * right + down[0] * below
    return scene.replace(
        {
            "film.corner": corner.tolist(),
            "film.right": ((across[1] - across[0]) * right).tolist(),
            "film.down": ((down[1] - down[0]) * below).tolist(),
            "film.scale": 1.0,
            "film.size": [shape[1], shape[0]],
        }
    )
