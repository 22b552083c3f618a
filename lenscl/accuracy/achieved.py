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
from lenscl.accuracy.sample import EDGE, FREE, LENS, MANY, STEEP, Sample
from lenscl.accuracy.statistics import Strata, quantile
from lenscl.accuracy.truth import Truth
from lenscl.config import Accuracy, Scene
from lenscl.errors import StudyError
from lenscl.tracing import RayMap

CERTIFIED_RAYS = {EDGE: 30, MANY: 40, STEEP: 60, LENS: 330, FREE: 10}  # where bounds are too wide
_WIDE = 0.1  # of the wish: error bounds that are wider are replaced by certified answers
_CHECKED = (2**13, 2**15)  # rays of a map that are looked at again; fewer of one that takes over `_SLOW` seconds a ray
_SLOW = 1e-6
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
    achieved = achieved_by(judge(raymap, truth, drawn, size), wanted, combination)
    if achieved.error <= wanted.value or not is_too_wide(truth, raymap.scene, wanted, size):
        return achieved
    sample = Sample.of(raymap, CERTIFIED_RAYS)
    certified = Truth.certified(raymap.scene, sample.pixels)
    return with_certified_error(achieved, judge(raymap, certified, sample.drawn, size))


def _spread(count: int, looked_at: int) -> NDArray[np.intp]:
    """Return pixels all over a film, one at random of each of equal runs of them."""
    edges = np.linspace(0, count, looked_at + 1)
    places = np.random.default_rng(_SEED).uniform(edges[:-1], edges[1:])
    return np.minimum(places.astype(np.intp), count - 1)


def achieved_by(judgement: Judgement, wanted: Accuracy, combination: Combination) -> Achieved:
    """Return what a judgement comes to, in the unit of a wish."""
    distances = judgement.pixels if wanted.unit == "px" else judgement.units
    return Achieved(
        wanted=wanted,
        combination=combination,
        error=distances.high.value,
        differ=judgement.differ.value,
        rays=judgement.compared,
        against=judgement.against,
    )


def with_certified_error(achieved: Achieved, judgement: Judgement) -> Achieved:
    """Return the same with the error against certified answers; `differ` is told better by more rays."""
    exact = achieved_by(judgement, achieved.wanted, achieved.combination)
    return replace(achieved, error=exact.error, rays=exact.rays, against=exact.against)


def is_too_wide(truth: Truth, scene: Scene, wanted: Accuracy, size: tuple[int, int] | None) -> bool:
    """Whether the bounds alone are a good part of the wish, so that an error within them says little."""
    lens = truth.is_known & (truth.events > 0)
    bound = quantile(truth.radius[lens], np.ones(np.count_nonzero(lens)), LEVEL)
    picture = scene.picture
    unit = max(size or picture.size) if wanted.unit == "px" else math.hypot(*picture.right) + math.hypot(*picture.down)
    return bound * unit > _WIDE * wanted.value


def unreachable(best: Achieved) -> StudyError:
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
