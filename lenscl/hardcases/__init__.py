"""Hard cases: rays whose answers are known for certain, and how well a device finds them.

Input: the pack, made by bench/make_hard_cases.py from certified answers. Output: a `Verdict` a case. An answer is wrong
where no move of the problem's numbers by `ULPS` roundings explains it: the bound grows with the ray's own condition
number, which was computed by such moves, and a path may differ only where such a move changes it. A ray may be left
undecided only where double precision cannot decide it, and each has a reason. Cases that came later than the first
are of a later edition, and are summed up apart.
"""

from __future__ import annotations

from lenscl.hardcases.case import LEVELS, ROUNDING, ULPS, Answers, Array, Case, Expected, Level, Moved
from lenscl.hardcases.judge import Verdict, Wrong, judge
from lenscl.hardcases.pack import Pack, load_pack, most_undecided, write_pack
from lenscl.hardcases.reasons import REASONS, number_of
from lenscl.hardcases.run import FamilyResult, by_family, run_pack

__all__ = [
    "LEVELS",
    "REASONS",
    "ROUNDING",
    "ULPS",
    "Answers",
    "Array",
    "Case",
    "Expected",
    "FamilyResult",
    "Level",
    "Moved",
    "Pack",
    "Verdict",
    "Wrong",
    "by_family",
    "judge",
    "load_pack",
    "most_undecided",
    "number_of",
    "run_pack",
    "write_pack",
]
