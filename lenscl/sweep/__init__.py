"""Run a study over its points and pictures: trace once a point, paint every picture with it, resume after anything.

Input: a `Study`. Output: images, and one `Row` for each in the order of the work list, kept in a table beside them.

    plan_sweep -> SweepPlan (points x pictures) -> run_sweep -> Row, Row, ...  ->  sweep.sqlite, <index>-<picture>.<ext>

The plan gives units of work, `run_sweep` schedules them and keeps the table, `make_point` does one.
"""

from __future__ import annotations

from lenscl.sweep.errors import SweepError
from lenscl.sweep.hardspots import HardSpot, hard_spots, study_hard_spots
from lenscl.sweep.making import make_point
from lenscl.sweep.painting import paint_as_told, refused_format
from lenscl.sweep.pictures import SourcePicture
from lenscl.sweep.plan import SweepPlan, plan_sweep
from lenscl.sweep.rows import Row, cells, csv_line, csv_lines, header
from lenscl.sweep.runner import run_sweep
from lenscl.sweep.spans import Stage, total_spans
from lenscl.sweep.store import Store
from lenscl.sweep.stretch import shown_scenes, stretch_notes
from lenscl.sweep.tools import Steps, Tools
from lenscl.sweep.work import ImageResult, ImageWork, MapSummary, PointResult, PointWork

__all__ = [
    "HardSpot",
    "ImageResult",
    "ImageWork",
    "MapSummary",
    "PointResult",
    "PointWork",
    "Row",
    "SourcePicture",
    "Stage",
    "Steps",
    "Store",
    "SweepError",
    "SweepPlan",
    "Tools",
    "cells",
    "csv_line",
    "csv_lines",
    "hard_spots",
    "header",
    "make_point",
    "paint_as_told",
    "plan_sweep",
    "refused_format",
    "run_sweep",
    "shown_scenes",
    "stretch_notes",
    "study_hard_spots",
    "total_spans",
]
