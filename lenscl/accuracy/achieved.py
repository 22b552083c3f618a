"""How accurate rays are that were asked to be so, seen on these rays themselves.

Rays are held against double precision with its error bounds; where these are missing, or too wide for the wish, against
certified answers. What is unknown then is not fulfilled.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.combination import Combination
from lenscl.accuracy.effort import affordable
from lenscl.accuracy.evidence import (
    FEW_PROVED,
    MOST_PROVED,
    Evidence,
    FilmRays,
    GivenRays,
    Looked,
    drawn_of,
    gathered,
    given_layers,
    proved,
)
from lenscl.accuracy.judgement import LEVEL, MOST_DIFFER, Judgement
from lenscl.accuracy.sample import EDGE, FREE, LENS, MANY, STEEP
from lenscl.accuracy.statistics import Strata, quantile
from lenscl.accuracy.truth import CERTIFIED, Truth
from lenscl.config import Accuracy, Scene
from lenscl.errors import StudyError
from lenscl.reference import flint_trouble, oracle
from lenscl.tracing import RayMap, RayPaths

Array = NDArray[np.float64]

CERTIFIED_RAYS = {EDGE: 30, MANY: 40, STEEP: 60, LENS: 330, FREE: 10}  # where bounds are too wide
_WIDE = 0.1  # of the wish: error bounds that are wider are replaced by certified answers
_CHECKED = (2**13, 2**15)  # rays that are looked at again; fewer where a ray costs more
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
        Share of the rays through a lens that end otherwise, or may: unknown ones are among them.
    rays, unknown : int
        Rays whose errors are known; and those looked at of which nothing is known, for rounding may decide their paths.
    against : str
    unknown_share, unbounded : float
        Shares of the rays through a lens, or that may be: of which nothing is known; and those that double precision
        has no error bound for, whether certified answers took the place of one or not.
    doubt : str
        Why certified answers cannot tell the most of the unknown ones; empty where it is not they that cannot.
    """

    wanted: Accuracy
    combination: Combination
    error: float
    differ: float
    rays: int
    unknown: int
    against: str
    unknown_share: float = 0.0
    unbounded: float = 0.0
    doubt: str = ""

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
            "unknown_share": self.unknown_share,
            "unbounded": self.unbounded,
            "against": self.against,
        }

    def __str__(self) -> str:
        if not self.rays and not self.unknown:
            return f"{self.combination}: no ray meets a lens and lands, so there is no error to speak of"
        unit = "px" if self.wanted.unit == "px" else "scene units"
        unsure = f" or may: of {self.unknown} nothing is known" if self.unknown else ""
        return (
            f"{self.combination}: 99 % of {self.rays + self.unknown} rays within {self.error:.2g} {unit}, "
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
    looked = FilmRays(raymap)
    lens = max(int(np.count_nonzero(raymap.events)), 1)
    most = affordable(raymap.scene, min(raymap.escalated / lens, 1.0), *_CHECKED)
    return check_rays(looked, *_drawn(looked, most), wanted, combination, size)


def check_paths(
    paths: RayPaths, origins: Array, directions: Array, wanted: Accuracy, combination: Combination
) -> Achieved:
    """Return how accurate given rays are, (N, 3) float64 arrays, at the worst of their wavelengths."""
    checks = []
    for layer in given_layers(paths):
        most = affordable(layer.scene, min(layer.escalated / max(layer.status.size, 1), 1.0), *_CHECKED)
        looked = GivenRays(layer, origins, directions)
        checks.append(check_rays(looked, *drawn_of(looked.near(), most), wanted, combination, None))
    return worst_of(checks)


def check_rays(
    looked: Looked,
    numbers: NDArray[np.intp],
    drawn: Strata | None,
    wanted: Accuracy,
    combination: Combination,
    size: tuple[int, int] | None,
) -> Achieved:
    """Return how accurate rays are, from those of some numbers; `drawn` says how these were, None: all that count."""
    scene = looked.traced.scene
    evidence = gathered(looked, numbers, drawn, FEW_PROVED)
    achieved = achieved_by(evidence.of(looked.traced, size), wanted, combination, evidence)
    if evidence.truth.against == CERTIFIED:
        # Far from the wish some rays say so; for what seems to be near it, it takes more
        if evidence.drawn is None or not _may_be_met(evidence.of(looked.traced, size), wanted):
            return achieved
        evidence = proved(looked, MOST_PROVED, evidence.unbounded)
        return achieved_by(evidence.of(looked.traced, size), wanted, combination, evidence)
    if achieved.error <= wanted.value or achieved.unknown_share > MOST_DIFFER:
        return achieved
    if not is_too_wide(evidence.truth, scene, wanted, size):
        return achieved
    some, of_them = looked.sample(CERTIFIED_RAYS)
    certified = Evidence(truth=looked.certified(some), drawn=of_them, unbounded=evidence.unbounded)
    return with_certified_error(achieved, certified.of(looked.traced, size), certified.truth)


def _may_be_met(judgement: Judgement, wanted: Accuracy) -> bool:
    """Return whether a sample leaves it possible that the wish is met."""
    error, differ = judgement.distances(wanted.unit).high, judgement.differ
    return (error.low is None or error.low <= wanted.value) and (differ.low is None or differ.low <= MOST_DIFFER)


def _drawn(looked: FilmRays, most: int) -> tuple[NDArray[np.intp], Strata | None]:
    """Return the pixels to look at, and how they were drawn; None where they are all that meet a lens, or may.

    The others, far from every lens, count for nothing: a ray that meets none is neither off nor through a lens.
    """
    lens = looked.near()
    others = np.setdiff1d(np.arange(looked.traced.status.size), lens, assume_unique=True)
    random = np.random.default_rng(_SEED)
    some = random.choice(others, min(len(others), most // _OTHERS), replace=False)
    if len(lens) <= most:
        return np.sort(np.concatenate([lens, some])), None
    taken = random.choice(lens, most, replace=False)
    weights = np.concatenate([np.full(most, len(lens) / most), np.full(len(some), len(others) / max(len(some), 1))])
    stratum = np.concatenate([np.zeros(most, np.intp), np.ones(len(some), np.intp)])
    return np.concatenate([taken, some]), Strata(weights, stratum)


def achieved_by(judgement: Judgement, wanted: Accuracy, combination: Combination, evidence: Evidence) -> Achieved:
    """Return what a judgement comes to, in the unit of a wish; upper bounds where only some rays were drawn."""
    differ = judgement.differ
    return Achieved(
        wanted=wanted,
        combination=combination,
        error=_upper(judgement, wanted),
        differ=1.0 if differ.high is None else differ.high,
        rays=judgement.compared,
        unknown=judgement.unknown,
        against=judgement.against,
        unknown_share=judgement.unknown_share.value,
        unbounded=evidence.unbounded,
        doubt=evidence.truth.doubt,
    )


def with_certified_error(achieved: Achieved, judgement: Judgement, certified: Truth) -> Achieved:
    """Return the same with the error against certified answers; `differ` is told better by more rays.

    Some hundred rays leave the 99 % quantile uncertain by a factor of two or three: its upper bound is taken.
    """
    error = _upper(judgement, achieved.wanted)
    found = replace(achieved, error=error, rays=judgement.compared, against=judgement.against)
    if math.isfinite(error):
        return found
    share = judgement.unknown_share.value
    return replace(found, unknown=judgement.unknown, unknown_share=share, doubt=certified.doubt)


def _upper(judgement: Judgement, wanted: Accuracy) -> float:
    """Return the largest that a sample's 99 % error may be, or the largest of all where too few tell."""
    distances = judgement.distances(wanted.unit)
    if distances.high.high is not None:
        return distances.high.high
    return distances.largest if math.isfinite(distances.high.value) else math.inf


def is_too_wide(truth: Truth, scene: Scene, wanted: Accuracy, size: tuple[int, int] | None) -> bool:
    """Whether the bounds alone are a good part of the wish, so that an error within them says little."""
    lens = truth.is_known & (truth.events > 0)
    bound = quantile(truth.radius[lens], np.ones(np.count_nonzero(lens)), LEVEL)
    picture = scene.picture
    unit = max(size or picture.size) if wanted.unit == "px" else math.hypot(*picture.right) + math.hypot(*picture.down)
    return bound * unit > _WIDE * wanted.value


def best_of(some: Iterable[Achieved]) -> Achieved:
    """Return the most accurate of those that lose few rays, or of all."""
    return min(some, key=lambda each: (each.differ > MOST_DIFFER, each.error, each.differ))


def worst_of(some: Iterable[Achieved]) -> Achieved:
    """Return one that does not fulfil its wish, or the least accurate."""
    return max(some, key=lambda each: (not each.is_met, each.error, each.differ))


def unreachable(best: Achieved) -> StudyError:
    """Return the error of a wish that nothing fulfils."""
    if best.unknown and (math.isinf(best.error) or min(best.unknown_share, best.differ) > MOST_DIFFER):
        return StudyError([f"numerics.accuracy: {_unknown(best)}"])
    noise = "" if best.unbounded <= MOST_DIFFER else f". {_unbounded(best)}"
    if best.differ > MOST_DIFFER:
        return StudyError(
            [
                f"numerics.accuracy: {_percent(best.differ)} of the rays through a lens end otherwise than they "
                f"should, or may, even by {best.combination}; {100 * MOST_DIFFER:g} % may. "
                "Rounding decides the paths of so many; set numerics.method and numerics.precision to trace it so"
                f"{noise}"
            ]
        )
    unit = " px" if best.wanted.unit == "px" else ""
    return StudyError(
        [
            f'numerics.accuracy: "{best.wanted}" cannot be reached: the most accurate here, {best.combination}, lands '
            f"99 % of the rays within {best.error:.2g}{unit}; ask for no less than that{noise}"
        ]
    )


def _unknown(best: Achieved) -> str:
    """Say of how many rays nothing is known, why, and what to do."""
    share = f"of {_percent(best.unknown_share)} of the rays through a lens"
    by_hand = "set numerics.method and numerics.precision to trace it without a check"
    if best.doubt == oracle.TOO_LONG:
        return (
            f"{share} nothing is known: they have no error bound in double precision that is small enough, and "
            f"{best.doubt}; {100 * MOST_DIFFER:g} % may be so. {_CONDITION}, or {by_hand}"
        )
    if best.doubt:
        return (
            f"{share} nobody can tell where they end, certified answers included ({best.doubt}); "
            f"{100 * MOST_DIFFER:g} % may be so. Move the film or the lens a little, or {by_hand}"
        )
    trouble = flint_trouble()
    certified = "" if trouble is None else f"; {trouble}"
    return (
        f"{share} no error can be told: they have no error bound in double precision; {100 * MOST_DIFFER:g} % may be "
        f"so. {_CONDITION}, or {by_hand}{certified}"
    )


_CONDITION = "Write lens.surface without differences of large numbers, whose last digits are noise"


def _unbounded(best: Achieved) -> str:
    return (
        f"{_percent(best.unbounded)} of the rays through a lens have no error bound in double precision. {_CONDITION}"
    )


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"
