"""Kernels broken on purpose: for every fault there is a case that finds it, and that is right where there is none."""

from __future__ import annotations

import pytest
from faults_in_kernels import FAULTS, Fault, broken
from probe import plain_device

from lenscl.hardcases import load_pack, run_pack

BALL, RING, FILM = "index of 2.417: a ball", "torus: all four roots", "screens: a film of 3 x 7"
FAR = "screens: nearly beyond reach"
NOT_FOUND = {  # why nothing is wrong after all
    "known root met again": "the rays are left undecided by it, and the last resort finds what they meet",
    "box left behind": "no expression of the pack goes on beyond its bounds; the law of the box finds it",
}
FOUND_BY = {
    "sign under the root of Snell's law": "air bubble: torus in 1.5",
    "total reflection missed": "critical angle: leaving a ball of 1.5",
    "total reflection too early": "critical angle: leaving a ball of 1.5",
    "index ratio inverted on exit": BALL,
    "normal not turned against the ray": BALL,
    "normal without the inverse transpose": "squash: sphere, 0.001 along z",
    "reflected not quite": "air bubble: sphere in 1.5",
    "direction not unit": FILM,
    "refracted longer than unit": BALL,
    "last roots dropped": RING,
    "first root passed over": BALL,
    "re-entry lost": RING,
    "side taken from the sign of F": "torus: all four roots",
    "farther lens met first": "lens after lens: 2",
    "point beside the surface": BALL,
    "picture closed at 1": "screens: ties at pixel edges",
    "s and t swapped": BALL,
    "screen behind the ray accepted": "screens: behind",
    "half a pixel off": FILM,
    "rows and columns of the film mixed up": FILM,
    "event limit off by one": "trapped: 7 events",
    "event limit without its status": "trapped: 7 events",
    "one doubt ends its whole packet": "short chord: a flat ellipsoid",
}
ALSO = {  # faults that need rays aimed at them, which are in the pack, and the precision that shows them
    Fault("doubt before what is met ignored", "trace.cl", "(not_lane(hit.found) | (hit.doubt <= hit.t))",
          "not_lane(hit.found)"): ("lens after lens: the rim of a torus, then a ball", "mixed"),
    Fault("doubt counted from where the search begins", "lens.cl", "min_v(hit->doubt, from + root.t)",
          "min_v(hit->doubt, root.t)"): ("lens after lens: a ball, and the rim of a torus behind", "mixed"),
    Fault("first root not proved to be the first", "search_polynomial.cl", "exact & (least > noise)", "exact"):
        ("first root of many", "double"),
    Fault("farthest place too near", "screen.cl", "NUMBER(1e30)", "NUMBER(1e20)"): (FAR, "double"),
    Fault("farthest place too far", "screen.cl", "NUMBER(1e30)", "NUMBER(2e30)"): (FAR, "double"),
    Fault("first step settles", "newton.cl", "realv last = (realv)0;", "realv last = high - low;"):
        ("bifolia: down the funnel", "mixed"),
}  # fmt: skip


# Faults after which a normal looks the wrong way, or nothing is proved: such rays are traced again, and are right then
TRACED_AGAIN = ("first root passed over", "side taken from the sign of F")


def verdict(name: str, precision: str) -> tuple[int, int]:
    """Return how many answers of a case are wrong, and how many rays were traced again for want of a proof."""
    found = run_pack(load_pack().having([name]), method="auto", precision=precision, device=plain_device())
    some = [each for each in found if name in each.case.name]
    return sum(len(each.wrong) for each in some), sum(each.again for each in some)


@pytest.mark.parametrize("fault", [*FAULTS, *ALSO], ids=lambda fault: fault.name)
def test_a_case_finds_the_fault(fault: Fault) -> None:
    if fault.name in NOT_FOUND:
        pytest.skip(NOT_FOUND[fault.name])
    case, precision = ALSO[fault] if fault in ALSO else (FOUND_BY[fault.name], "double")
    wrong, again = verdict(case, precision)
    assert wrong == 0
    with broken(fault):
        wrong, more = verdict(case, precision)
    if fault.name in TRACED_AGAIN:
        assert wrong == 0
        assert more >= again + 40
    else:
        assert wrong > 0


def test_every_fault_has_its_case() -> None:
    assert {fault.name for fault in FAULTS} == FOUND_BY.keys() | NOT_FOUND.keys()
    assert len(FOUND_BY) >= 12
    assert FOUND_BY.keys().isdisjoint(NOT_FOUND)
