"""Why rays may be left undecided: what the oracle says of them, or what becomes of their path where numbers are moved.

The oracle's word is stored with the pack. Where it decides the ray and all its moves, the paths that those take tell.
"""

from __future__ import annotations

import tomllib

import numpy as np

from lenscl.hardcases.case import Case, Expected, Level
from lenscl.status import RayStatus

# What is stored is a place in this tuple: new reasons go to its end
REASONS = (
    "",
    "no value of F",  # it is undefined on the ray's way, or beyond the largest double
    "multiple root",  # the ray touches the surface, or F jumps, or two roots are one to 2048 bits
    "grazing",
    "edge",  # there is no normal
    "start on a surface",
    "critical angle",
    "event limit",
    "rim",  # which surfaces the ray meets hangs on rounding
    "rim before another lens",
    "lenses touch",
    "screen",  # parallel to the picture, or on its edge
    "proof too long",
)
_SAID = {  # what the oracle says contains these words
    "has no value": "no value of F",
    "touches the surface": "multiple root",
    "grazes": "grazing",
    "an edge of the surface": "edge",
    "starts on a surface": "start on a surface",
    "where the search begins": "start on a surface",
    "where it should rise": "start on a surface",
    "meets no surface of it": "start on a surface",
    "bounding box lies on the surface": "rim",
    "critical angle": "critical angle",
    "met at the same place": "lenses touch",
    "parallel to the picture": "screen",
    "on the picture's plane": "screen",
    "lands on an edge of the picture": "screen",
    "stretches of the ray": "proof too long",
}


def number_of(said: str) -> int:
    """Return the number of the reason for what the oracle says of a ray; 0 where it decides it.

    >>> REASONS[number_of("the ray grazes the surface")]
    'grazing'
    """
    if not said:
        return 0
    found = [reason for words, reason in _SAID.items() if words in said]
    if len(found) != 1:
        raise ValueError(f"expected one reason for what the oracle says, {said!r}; found {found}")
    return REASONS.index(found[0])


def reason(case: Case, expected: Expected, ray: int, level: Level) -> str:
    """Return why a ray need not be decided.

    Parameters
    ----------
    case : Case
    expected : Expected
        Of its rays.
    ray : int
        One that is not stable under moves of `level`, or that the oracle does not decide, or whose F has no value.
    level : "double" or "single"
        The finest precision that it was traced in.
    """
    if case.lacks_values is not None and case.lacks_values[ray]:
        return "no value of F"
    if expected.reasons is not None and expected.reasons[ray]:
        return REASONS[expected.reasons[ray]]
    exact, beside = expected.answers, expected.moved[level].beside
    mine = expected.moved[level].ray == ray
    ends = {(int(exact.status[ray]), int(exact.events[ray]))}
    ends |= set(zip(beside.status[mine].tolist(), beside.events[mine].tolist(), strict=True))
    ends = {end for end in ends if end[0] != RayStatus.UNDECIDED}
    # All meet as many surfaces as are allowed, and some would meet another
    if RayStatus.TRAPPED in {status for status, _ in ends} and len({events for _, events in ends}) == 1 < len(ends):
        return "event limit"
    if {status for status, _ in ends} > {int(RayStatus.TOTAL_REFLECTION)}:
        return "critical angle"
    return "rim before another lens" if len(tomllib.loads(case.scene).get("lens", ())) > 1 else "rim"


def counted(case: Case, expected: Expected, rays: np.ndarray, level: Level) -> dict[str, int]:
    """Return how many of some rays need not be decided for which reason; the most frequent first."""
    found = [reason(case, expected, ray, level) for ray in rays.tolist()]
    return {why: found.count(why) for why in sorted(set(found), key=lambda why: (-found.count(why), why))}
