"""From a wanted accuracy to the cheapest way to trace a scene that meets it, and the proof that it did.

Input: a scene with `numerics.accuracy`. Output: a `Plan`, then a ray map with what it `Achieved`: what was planned is
checked again on the rays of the map itself.
"""

from __future__ import annotations

from lenscl.accuracy.achieved import Achieved, check, wanted_of
from lenscl.accuracy.calibration import CalibrationCache
from lenscl.accuracy.combination import Combination
from lenscl.accuracy.planning import Plan, Planning
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.errors import StudyError
from lenscl.tracing import RayMap, complete, trace

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
                    return complete(raymap), achieved
        failed: frozenset[Combination] = frozenset()
        while True:  # each turn leaves out one combination more, until none is left to plan with
            raymap, achieved = self._traced(scene, self.plan(scene, size, failed), size)
            if achieved.is_met:
                return complete(raymap), achieved
            failed |= {achieved.combination}  # what was enough on the plan's film is not on this one

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
                self._plans[key] = Planning(scene, size, self._device, self._cache, without).plan()
            except StudyError as error:  # that a wish cannot be reached is not found out twice, either
                self._plans[key] = error
        found = self._plans[key]
        if isinstance(found, StudyError):
            raise found
        return found

    def _traced(self, scene: Scene, plan: Plan, size: tuple[int, int] | None) -> tuple[RayMap, Achieved]:
        raymap = trace(plan.combination.of(scene), device=self._device)
        checks = [check(layer, wanted_of(scene), plan.combination, size) for layer in raymap.layers()]
        return raymap, max(checks, key=lambda each: (not each.is_met, each.error, each.differ))
