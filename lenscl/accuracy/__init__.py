"""What accuracy costs in time, and what a scene needs for the accuracy that is asked of it.

Input: scenes, and ray maps. Output, by what one wants to know:

`trace`, `Planner`     a map as accurate as its scene asks, by the cheapest way there is, and what it `Achieved`
`measure_front`        every way to trace a scene, its time and its error, and which of them nothing beats
`error_map`            a bound on the error of every place of a map
`check_map`            whether a sample of a map's rays obeys the laws of every path; nothing is compared
`lenscl.accuracy.path`  one ray's path, surface by surface, with what makes it hard
`lenscl.accuracy.bench` time and error of a row, kept and held against those of another day

Errors are against certified answers, or against double precision with its error bounds.
"""

from __future__ import annotations

from lenscl.accuracy.achieved import Achieved
from lenscl.accuracy.asked import planner_of, trace, trace_rays
from lenscl.accuracy.bounds import NO_BOUND, Places, error_at, error_map, pixel_bounds, place_bounds
from lenscl.accuracy.calibration import CalibrationCache
from lenscl.accuracy.combination import Combination
from lenscl.accuracy.front import Front, Tried, measure_front
from lenscl.accuracy.front_table import circumstances, front_csv, front_rows, front_sentence
from lenscl.accuracy.pictures import largest_size
from lenscl.accuracy.planner import Planner
from lenscl.accuracy.planning import Plan
from lenscl.accuracy.selfcheck import Failure, SelfCheck, check_map

__all__ = [
    "NO_BOUND",
    "Achieved",
    "CalibrationCache",
    "Combination",
    "Failure",
    "Front",
    "Places",
    "Plan",
    "Planner",
    "SelfCheck",
    "Tried",
    "check_map",
    "circumstances",
    "error_at",
    "error_map",
    "front_csv",
    "front_rows",
    "front_sentence",
    "largest_size",
    "measure_front",
    "pixel_bounds",
    "place_bounds",
    "planner_of",
    "trace",
    "trace_rays",
]
