"""Time and error of a trace, side by side, kept from day to day.

Input: rows, each a scene with a method and a precision. Output: a `Run` of `Measurement`s, which a `Store` keeps as
JSON and `compare` holds against another. Times are the device's own, each next to the `FrozenKernel` run just before
and after, and to the device's `multiply_add_peak`; errors are against the float64 twin (`Expected`).
"""

from __future__ import annotations

from lenscl.accuracy.bench.compare import Change, Comparison, compare
from lenscl.accuracy.bench.error import Expected
from lenscl.accuracy.bench.frozen import FrozenKernel
from lenscl.accuracy.bench.measurement import Circumstances, Error, Measurement, Quantiles, Run
from lenscl.accuracy.bench.peak import multiply_add_peak
from lenscl.accuracy.bench.scenes import Row, plan_rows, scene_files
from lenscl.accuracy.bench.store import Store
from lenscl.accuracy.bench.timing import ROUNDS, Bench, Timing

__all__ = [
    "ROUNDS",
    "Bench",
    "Change",
    "Circumstances",
    "Comparison",
    "Error",
    "Expected",
    "FrozenKernel",
    "Measurement",
    "Quantiles",
    "Row",
    "Run",
    "Store",
    "Timing",
    "compare",
    "multiply_add_peak",
    "plan_rows",
    "scene_files",
]
