"""Trace a scene: where the ray of every film pixel lands on the picture.

Input: a `Scene` (and a device). Output: a `RayMap`, or `RayPaths` for rays of the caller's own. The map does not depend
on any image; painting with it is `lenscl.imaging`'s work.
"""

from __future__ import annotations

from lenscl.tracing.apart import MOST_PAIRS, may_touch, touching
from lenscl.tracing.beside import BESIDE, complete
from lenscl.tracing.boxes import near_legs, near_points, pairs_by_table, world_boxes
from lenscl.tracing.called import Call, calls, findings, reach_of, stopping, study_needs, with_needs
from lenscl.tracing.film import film_rays
from lenscl.tracing.follow import Ends, Follower, PixelFollower, pixel_effects
from lenscl.tracing.judge import Judge, Meetings, Nudge
from lenscl.tracing.launch import checked_rays, kernel_source, trace, trace_rays, trace_without
from lenscl.tracing.numbers import TOLERANCE, picture_numbers
from lenscl.tracing.placement import Placement
from lenscl.tracing.raymap import Caustic, RayMap, RayPaths, Samples
from lenscl.tracing.reach import out_of_view
from lenscl.tracing.start import holding, locate, locate_sets
from lenscl.tracing.steps import StepCount, count_steps
from lenscl.tracing.structure import methods_of
from lenscl.tracing.tight import tightened

__all__ = [
    "BESIDE",
    "MOST_PAIRS",
    "TOLERANCE",
    "Call",
    "Caustic",
    "Ends",
    "Follower",
    "Judge",
    "Meetings",
    "Nudge",
    "PixelFollower",
    "Placement",
    "RayMap",
    "RayPaths",
    "Samples",
    "StepCount",
    "calls",
    "checked_rays",
    "complete",
    "count_steps",
    "film_rays",
    "findings",
    "holding",
    "kernel_source",
    "locate",
    "locate_sets",
    "may_touch",
    "methods_of",
    "near_legs",
    "near_points",
    "out_of_view",
    "pairs_by_table",
    "picture_numbers",
    "pixel_effects",
    "reach_of",
    "stopping",
    "study_needs",
    "tightened",
    "touching",
    "trace",
    "trace_rays",
    "trace_without",
    "with_needs",
    "world_boxes",
]
