"""What accuracy costs in time, and what a scene needs for the accuracy that is asked of it.

Input: scenes, and ray maps. Output, by what one wants to know:

`trace`, `Planner`     a map as accurate as its scene asks, by the cheapest way there is, and what it `Achieved`
`measure_front`        every way to trace a scene, its time and its error, and which of them nothing beats
`error_map`            a bound on the error of every place of a map
`check_map`            whether a sample of a map's rays obeys the laws of every path; nothing is compared
`Bench`                time and error of a row, kept by a `Store` and held by `compare` against those of another day

Errors are against certified answers, or against double precision with its error bounds; those of a `Bench` against the
float64 twin (`Expected`), and its times next to the `FrozenKernel` run just before and after.
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
