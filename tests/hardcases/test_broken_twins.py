"""Kernels broken on purpose: for every fault there is a case that finds it, and that is right where there is none."""

from __future__ import annotations

import pytest
from faults_in_kernels import FAULTS, Fault, broken
from probe import plain_device

from lenscl.hardcases import load_pack, run_pack

BALL, RING, FILM = "index of 2.417: a ball", "torus: all four roots", "screens: a film of 3 x 7"
HEALED = ""  # nothing is wrong after all
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
    "known root met again": HEALED,
    "re-entry lost": RING,
    "side taken from the sign of F": "null lens: bifolia",
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


def wrong(name: str) -> int:
    """Return how many answers of a case are wrong."""
    found = run_pack(load_pack().having([name]), method="auto", precision="double", device=plain_device())
    return sum(len(verdict.wrong) for verdict in found if verdict.case.name == name)


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_case_finds_the_fault(fault: Fault) -> None:
    case = FOUND_BY[fault.name]
    if case == HEALED:
        pytest.skip("the rays are left undecided by it, and the last resort finds what they meet")
    assert wrong(case) == 0
    with broken(fault):
        assert wrong(case) > 0


def test_every_fault_has_its_case() -> None:
    assert set(FOUND_BY) == {fault.name for fault in FAULTS}
    assert sum(case != HEALED for case in FOUND_BY.values()) >= 12
