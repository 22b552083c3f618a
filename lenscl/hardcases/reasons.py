"""The reason why a ray may be left undecided: from the oracle's message, or from the paths of the moved rays.

If the oracle does not decide the ray, its message gives the reason, which is stored with the pack. If it does, the
reason follows from the paths that the ray takes when numbers of the problem are moved by rounding.
"""

from __future__ import annotations

import tomllib

import numpy as np

from lenscl.hardcases.case import Case, Expected, Level
from lenscl.status import RayStatus

# The pack stores indices into this tuple: new reasons go to its end
REASONS = (
    "",
    "no value of F",  # F is undefined on the ray's path, or larger than the largest double
    "multiple root",  # the ray touches the surface, or F jumps, or 2048 bits do not separate two roots
    "grazing",
    "edge",  # there is no normal
    "start on a surface",
    "critical angle",
    "event limit",
    "rim",  # rounding decides which surfaces the ray meets
    "rim before another lens",
    "lenses touch",
    "screen",  # parallel to the picture, or on its edge
    "proof too long",
    "shared edge",  # surfaces of two solids cross
)
_SAID = {  # words of the oracle's messages
    "has no value": "no value of F",
    "touches the surface": "multiple root",
    "grazes": "grazing",
    "an edge of the surface": "edge",
    "edge between a mirrored face": "edge",
    "starts on a surface": "start on a surface",
    "where the search begins": "start on a surface",
    "where it should rise": "start on a surface",
    "meets no surface of it": "start on a surface",
    "bounding box lies on the surface": "rim",
    "critical angle": "critical angle",
    "neither in contact nor apart": "lenses touch",
    "edge that two solids share": "shared edge",
    "parallel to the picture": "screen",
    "on the picture's plane": "screen",
    "an edge of the picture": "screen",
    "stretches of the ray": "proof too long",
}


def number_of(said: str) -> int:
    """Return the number of the reason that the oracle's message on a ray gives; 0 if it decides the ray.

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
        The expected answers of the case.
    ray : int
        A ray that is not stable under moves of `level`, or that the oracle does not decide, or whose F has no value.
    level : "double" or "single"
        The finest precision that the ray was traced in.
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
    # All moved rays meet as many surfaces as are allowed. Some would meet one more; the others would not
    if RayStatus.TRAPPED in {status for status, _ in ends} and len({events for _, events in ends}) == 1 < len(ends):
        return "event limit"
    if {status for status, _ in ends} > {int(RayStatus.TOTAL_REFLECTION)}:
        return "critical angle"
    return "rim before another lens" if len(tomllib.loads(case.scene).get("lens", ())) > 1 else "rim"


def counted(case: Case, expected: Expected, rays: np.ndarray, level: Level) -> dict[str, int]:
    """Return how many of some rays have which reason to be undecided; the most frequent first."""
    found = [reason(case, expected, ray, level) for ray in rays.tolist()]
    return {why: found.count(why) for why in sorted(set(found), key=lambda why: (-found.count(why), why))}
