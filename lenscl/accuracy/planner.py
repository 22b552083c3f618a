"""From a wanted accuracy to the cheapest way to trace a scene that meets it, and the proof that it did.

Input: a scene with `numerics.accuracy`. Output: a `Plan`, then a ray map with what it `Achieved`: what was planned is
checked again on the rays of the map itself.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.accuracy.achieved import Achieved, best_of, check, check_paths, unreachable, wanted_of, worst_of
from lenscl.accuracy.calibration import CalibrationCache
from lenscl.accuracy.combination import Combination
from lenscl.accuracy.judgement import MOST_DIFFER
from lenscl.accuracy.planning import Plan, Planning
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.errors import StudyError
from lenscl.tracing import RayMap, RayPaths, checked_rays, complete, trace, trace_rays

Array = NDArray[np.float64]
_Traced = TypeVar("_Traced", RayMap, RayPaths)

_MOST_PLANS = 256  # kept by a planner


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
        self._plans: dict[tuple[Scene, tuple[int, int] | None, frozenset[Combination]], Plan | StudyError] = {}
        self._planning: tuple[tuple[Scene, tuple[int, int] | None], Planning] | None = None

    def trace(
        self, scene: Scene, *, size: tuple[int, int] | None = None, like: Scene | None = None
    ) -> tuple[RayMap, Achieved | None]:
        """Trace a film as accurately as its scene asks.

        Parameters
        ----------
        scene : Scene
            Without `numerics.accuracy` it is traced as it says, and nothing is checked. A scene of several wavelengths
            is planned at the d line; its map is checked at each of them, and what is told is of the worst.
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
            As `lenscl.trace`; and where certified answers are needed and python-flint is missing or broken.
        """
        if scene.numerics.accuracy is None:
            return complete(trace(scene, device=self._device)), None
        if like is not None:
            try:
                raymap, achieved = self._traced(scene, self.plan(like, size), size)
            except StudyError:
                pass  # what cannot be reached there may be here
            else:
                if achieved.is_met:
                    self._planning = None  # its maps are large
                    return complete(raymap), achieved
        raymap, achieved = self._best(scene, size, lambda plan: self._traced(scene, plan, size))
        return complete(raymap), achieved

    def trace_rays(self, scene: Scene, origins: ArrayLike, directions: ArrayLike) -> tuple[RayPaths, Achieved | None]:
        """Trace given rays as accurately as their scene asks; of these rays, the wish holds as it does of a film's.

        Parameters
        ----------
        scene : Scene
            As for `trace`. The cheapest way that is accurate enough on its own film is tried first; where none is, the
            most accurate one is tried on the rays themselves.
        origins, directions : array_like, shape (N, 3)
            As for `lenscl.trace_rays`.

        Raises
        ------
        StudyError, LensclError
            As for `trace`.
        """
        if scene.numerics.accuracy is None:
            return trace_rays(scene, origins, directions, device=self._device), None
        checked_rays(origins, directions)
        points, vectors = np.asarray(origins, dtype=np.float64), np.asarray(directions, dtype=np.float64)
        try:
            self.plan(scene)
        except StudyError:  # what the film's rays cannot have, these may
            self._planning = None
            paths, achieved = self._traced_rays(scene, Combination(method="auto"), points, vectors)
            if not achieved.is_met:
                raise unreachable(achieved) from None
            return paths, achieved
        return self._best(scene, None, lambda plan: self._traced_rays(scene, plan.combination, points, vectors))

    def _best(
        self,
        scene: Scene,
        size: tuple[int, int] | None,
        traced: Callable[[Plan], tuple[_Traced, Achieved]],
    ) -> tuple[_Traced, Achieved]:
        """Trace by the cheapest plan whose rays fulfil the wish themselves."""
        failed: list[Achieved] = []
        try:
            while True:  # each turn leaves out one combination more, until none is left to plan with
                found, achieved = traced(self.plan(scene, size, frozenset(each.combination for each in failed)))
                if achieved.is_met:
                    return found, achieved
                failed.append(achieved)  # what was enough on the plan's film is not on this one
                if achieved.unknown_share > MOST_DIFFER:
                    raise unreachable(achieved)  # no other way to trace makes more known
        except StudyError:
            if not failed:
                raise
            raise unreachable(best_of(failed)) from None  # these rays say more than those of the plan's film
        finally:
            self._planning = None  # its maps are large

    def plan(
        self, scene: Scene, size: tuple[int, int] | None = None, without: frozenset[Combination] = frozenset()
    ) -> Plan:
        """Return the cheapest combination that meets `numerics.accuracy`, some left out; errors as for `trace`."""
        scene = scene.at_d_line()
        key = scene, size, without
        if key not in self._plans:
            if len(self._plans) >= _MOST_PLANS:
                self._plans.clear()
            try:
                self._plans[key] = self._planning_of(scene, size, without).plan()
            except StudyError as error:  # that a wish cannot be reached is not found out twice, either
                self._plans[key] = error
        found = self._plans[key]
        if isinstance(found, StudyError):
            raise found
        return found

    def _planning_of(self, scene: Scene, size: tuple[int, int] | None, without: frozenset[Combination]) -> Planning:
        """Return what plans for a scene; the last one is kept, for a plan may be asked for again without some."""
        if self._planning is None or self._planning[0] != (scene, size):
            self._planning = None  # let go of its maps before others are made
            self._planning = (scene, size), Planning(scene, size, self._device, self._cache)
        self._planning[1].without = without
        return self._planning[1]

    def _traced(self, scene: Scene, plan: Plan, size: tuple[int, int] | None) -> tuple[RayMap, Achieved]:
        raymap = trace(plan.combination.of(scene), device=self._device)
        return raymap, worst_of(check(layer, wanted_of(scene), plan.combination, size) for layer in raymap.layers())

    def _traced_rays(
        self, scene: Scene, combination: Combination, points: Array, vectors: Array
    ) -> tuple[RayPaths, Achieved]:
        paths = trace_rays(combination.of(scene), points, vectors, device=self._device)
        return paths, check_paths(paths, points, vectors, wanted_of(scene), combination)
