"""How accurate a ray map is that was asked to be so, seen on its own rays.

Rays are held against double precision with its error bounds; where these are too wide for the wish, against certified
answers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.combination import Combination
from lenscl.accuracy.judgement import LEVEL, MOST_DIFFER, Judgement, judge
from lenscl.accuracy.sample import EDGE, FREE, LENS, MANY, NEIGHBOURS, STEEP, Sample
from lenscl.accuracy.statistics import Strata, quantile
from lenscl.accuracy.truth import Truth
from lenscl.config import Accuracy, Scene
from lenscl.errors import StudyError
from lenscl.tracing import RayMap

CERTIFIED_RAYS = {EDGE: 30, MANY: 40, STEEP: 60, LENS: 330, FREE: 10}  # where bounds are too wide
_WIDE = 0.1  # of the wish: error bounds that are wider are replaced by certified answers
_CHECKED = (2**13, 2**15)  # rays of a map that are looked at again; fewer of one that takes over `_SLOW` seconds a ray
_SLOW = 1e-6
_OTHERS = 8  # so many times fewer of the rays that meet no lens
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
        In the unit of the wish: 99 % of the rays land within it, errors of what they were held against included; 0
        where there is no ray to judge.
    differ : float
        Share of the rays through a lens that end otherwise.
    rays, unknown : int
        Rays that `error` is of; and those looked at of which nothing can be said, for rounding may decide their paths.
    against : str
    """

    wanted: Accuracy
    combination: Combination
    error: float
    differ: float
    rays: int
    unknown: int
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
            "unknown": self.unknown,
            "against": self.against,
        }

    def __str__(self) -> str:
        if not self.rays:
            return f"{self.combination}: no ray meets a lens and lands, so there is no error to speak of"
        unit = "px" if self.wanted.unit == "px" else "scene units"
        unsure = f", {self.unknown} may by rounding" if self.unknown else ""
        return (
            f"{self.combination}: 99 % of {self.rays} rays within {self.error:.2g} {unit}, "
            f"{100 * self.differ:.2g} % end otherwise{unsure}"
        )


def wanted_of(scene: Scene) -> Accuracy:
    """Return the accuracy that a scene asks for."""
    assert scene.numerics.accuracy is not None, "only scenes that ask for an accuracy are planned"
    return scene.numerics.accuracy


def check(raymap: RayMap, wanted: Accuracy, combination: Combination, size: tuple[int, int] | None) -> Achieved:
    """Return how accurate a map is, from many of its rays; size as for `Planner.trace`.

    All rays through a lens are looked at, and those beside them, where a lens may have been lost, or some ten thousand;
    and some of the others. Where only some were drawn, the figures are their upper bounds.
    """
    few, many = _CHECKED
    most = few if raymap.trace_seconds > _SLOW * raymap.status.size else many
    pixels, drawn = _drawn(raymap, most)
    truth = Truth.bounded(raymap.scene, pixels, raymap.device)
    judgement = judge(raymap, truth, drawn, size)
    achieved = achieved_by(judgement, wanted, combination)
    if drawn is not None:
        differ = judgement.differ.high
        achieved = replace(achieved, error=_upper(judgement, wanted), differ=1.0 if differ is None else differ)
    if achieved.error <= wanted.value or not is_too_wide(truth, raymap.scene, wanted, size):
        return achieved
    sample = Sample.of(raymap, CERTIFIED_RAYS)
    certified = Truth.certified(raymap.scene, sample.pixels)
    return with_certified_error(achieved, judge(raymap, certified, sample.drawn, size))


def _drawn(raymap: RayMap, most: int) -> tuple[NDArray[np.intp], Strata | None]:
    """Return the pixels to look at, and how they were drawn; None where they are all that meet a lens, or may.

    The others, far from every lens, count for nothing: a ray that meets none is neither off nor through a lens.
    """
    near = raymap.events > 0
    for here, there in NEIGHBOURS:
        beside = near.copy()
        beside[here] |= near[there]
        beside[there] |= near[here]
        near = beside
    lens, others = np.flatnonzero(near), np.flatnonzero(~near)
    random = np.random.default_rng(_SEED)
    some = random.choice(others, min(len(others), most // _OTHERS), replace=False)
    if len(lens) <= most:
        return np.sort(np.concatenate([lens, some])), None
    taken = random.choice(lens, most, replace=False)
    weights = np.concatenate([np.full(most, len(lens) / most), np.full(len(some), len(others) / max(len(some), 1))])
    stratum = np.concatenate([np.zeros(most, np.intp), np.ones(len(some), np.intp)])
    return np.concatenate([taken, some]), Strata(weights, stratum)


def achieved_by(judgement: Judgement, wanted: Accuracy, combination: Combination) -> Achieved:
    """Return what a judgement comes to, in the unit of a wish."""
    return Achieved(
        wanted=wanted,
        combination=combination,
        error=judgement.distances(wanted.unit).high.value,
        differ=judgement.differ.value,
        rays=judgement.compared,
        unknown=judgement.unknown,
        against=judgement.against,
    )


def with_certified_error(achieved: Achieved, judgement: Judgement) -> Achieved:
    """Return the same with the error against certified answers; `differ` is told better by more rays.

    Some hundred rays leave the 99 % quantile uncertain by a factor of two or three: its upper bound is taken.
    """
    error = _upper(judgement, achieved.wanted)
    return replace(achieved, error=error, rays=judgement.compared, against=judgement.against)


def _upper(judgement: Judgement, wanted: Accuracy) -> float:
    """Return the largest that a sample's 99 % error may be, or the largest of all where too few tell."""
    distances = judgement.distances(wanted.unit)
    return distances.largest if distances.high.high is None else distances.high.high


def is_too_wide(truth: Truth, scene: Scene, wanted: Accuracy, size: tuple[int, int] | None) -> bool:
    """Whether the bounds alone are a good part of the wish, so that an error within them says little."""
    lens = truth.is_known & (truth.events > 0)
    bound = quantile(truth.radius[lens], np.ones(np.count_nonzero(lens)), LEVEL)
    picture = scene.picture
    unit = max(size or picture.size) if wanted.unit == "px" else math.hypot(*picture.right) + math.hypot(*picture.down)
    return bound * unit > _WIDE * wanted.value


def unreachable(best: Achieved) -> StudyError:
    """Return the error of a wish that nothing fulfils."""
    if best.differ > MOST_DIFFER:
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
