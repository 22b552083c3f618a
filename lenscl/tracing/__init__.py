"""Trace a scene: where the ray of every film pixel lands on the picture.

Input: a `Scene` (and a device). Output: a `RayMap`, or `RayPaths` for rays of the caller's own. The map does not depend
on any image; painting with it is `lenscl.imaging`'s work.
"""

from __future__ import annotations

from lenscl.tracing.film import film_rays
from lenscl.tracing.follow import Ends, Follower
from lenscl.tracing.job import methods_of
from lenscl.tracing.launch import kernel_source, trace, trace_rays
from lenscl.tracing.numbers import TOLERANCE
from lenscl.tracing.placement import Placement
from lenscl.tracing.raymap import RayMap, RayPaths
from lenscl.tracing.start import locate
from lenscl.tracing.steps import StepCount, count_steps

__all__ = [
    "TOLERANCE",
    "Ends",
    "Follower",
    "Placement",
    "RayMap",
    "RayPaths",
    "StepCount",
    "count_steps",
    "film_rays",
    "kernel_source",
    "locate",
    "methods_of",
    "trace",
    "trace_rays",
]
