"""What accuracy costs in time, and what a scene needs for the accuracy that is asked of it.

Input: rows, each a scene with a method and a precision. Output: a `Run` of `Measurement`s, which a `Store` keeps as
JSON and `compare` holds against another. Times are the device's own, each next to the `FrozenKernel` run just before
and after, and to the device's `multiply_add_peak`; errors are against the float64 twin (`Expected`).

Without any reference, `check_map` holds a sample of a map's rays against the laws that every path obeys.
For any map, without a twin or an oracle at hand: `error_map`, a bound on the error of every place; `bounds` says how.
Input: scenes. Three things come of them. `trace` and the `Planner` behind it: from a wanted accuracy to the cheapest
way to trace that meets it, and a ray map with what it `Achieved`. `measure_front`: every way to trace a scene, its time
and its error against certified answers, and which of them nothing beats. `Bench`: time and error of a row, kept by a
`Store` and held by `compare` against those of another day, each next to the `FrozenKernel` run just before and after
and to the device's `multiply_add_peak`. Without any reference, `check_map` holds a sample of a map's rays against the
laws that every path obeys.
"""

from __future__ import annotations

from lenscl.accuracy.achieved import Achieved
from lenscl.accuracy.asked import planner_of, trace, trace_rays
from lenscl.accuracy.bounds import NO_BOUND, Places, error_at, error_map, pixel_bounds, place_bounds
from lenscl.accuracy.calibration import CalibrationCache
from lenscl.accuracy.combination import Combination
from lenscl.accuracy.compare import Change, Comparison, compare
from lenscl.accuracy.error import Expected
from lenscl.accuracy.findings import Failure, SelfCheck
from lenscl.accuracy.front import Front, Tried, measure_front
from lenscl.accuracy.front_table import circumstances, front_csv, front_rows, front_sentence
from lenscl.accuracy.frozen import FrozenKernel
from lenscl.accuracy.measurement import Circumstances, Error, Measurement, Quantiles, Run
from lenscl.accuracy.peak import multiply_add_peak
from lenscl.accuracy.pictures import largest_size
from lenscl.accuracy.planner import Planner
from lenscl.accuracy.planning import Plan
from lenscl.accuracy.scenes import Row, plan_rows, scene_files
from lenscl.accuracy.selfcheck import check_map
from lenscl.accuracy.store import Store
from lenscl.accuracy.timing import ROUNDS, Bench, Timing

__all__ = [
    "NO_BOUND",
    "ROUNDS",
    "Achieved",
    "Bench",
    "CalibrationCache",
    "Change",
    "Circumstances",
    "Combination",
    "Comparison",
    "Error",
    "Expected",
    "Failure",
    "Front",
    "FrozenKernel",
    "Measurement",
    "Places",
    "Plan",
    "Planner",
    "Quantiles",
    "Row",
    "Run",
    "SelfCheck",
    "Store",
    "Timing",
    "Tried",
    "check_map",
    "circumstances",
    "compare",
    "error_at",
    "error_map",
    "front_csv",
    "front_rows",
    "front_sentence",
    "largest_size",
    "measure_front",
    "multiply_add_peak",
    "pixel_bounds",
    "place_bounds",
    "plan",
    "plan_rows",
    "planner_of",
    "scene_files",
    "trace",
    "trace_rays",
]
