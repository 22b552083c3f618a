"""A unit of work of a sweep: a value that goes out, a value that comes back, and no map that outlives it."""

from __future__ import annotations

import gc
import os
import pickle
import re
import subprocess
import sys
import threading
import weakref
from collections.abc import Callable
from dataclasses import FrozenInstanceError, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from patience import PATIENCE

from lenscl.accuracy import Planner, SelfCheck, check_map
from lenscl.config import Scene, load_study
from lenscl.imaging import read_metadata, write_image
from lenscl.sweep import ImageResult, PointWork, Steps, SweepPlan, Tools, make_point, plan_sweep, run_sweep
from lenscl.tracing import RayMap

Outputs = Callable[[Path], dict[str, bytes]]

WORKER = """
import pickle, sys
from probe import plain_device
from lenscl.sweep import Tools, make_point
works = pickle.load(open(sys.argv[1], "rb"))
with Tools(plain_device()) as tools:
    pickle.dump([make_point(work, tools) for work in works], open(sys.argv[2], "wb"))
"""


def works_of(plan: SweepPlan) -> list[PointWork]:
    return [plan.work_at(point, range(len(plan.pictures))) for point in plan.study.points()]


def timeless(image: ImageResult) -> ImageResult:
    """Return what is the same in every run."""
    stamp = None if image.stamp is None else replace(image.stamp, changed_ns=0)
    return replace(image, stamp=stamp, paint_seconds=0.0, write_seconds=0.0, spans={})


def accurate(study_path: Path) -> Path:
    text = re.sub(r"\[numerics\][^\[]*", "", study_path.read_text())
    study_path.write_text(f'{text}\n[numerics]\naccuracy = "0.1 px"\n')
    return study_path


def test_works_go_to_another_process_and_its_results_are_those_of_a_sweep_here(
    study_path: Path, outputs: Outputs, tmp_path: Path
) -> None:
    here, there = study_path.parent / "here", study_path.parent / "there"
    rows = list(run_sweep(plan_sweep(load_study(study_path), here)))
    works = works_of(plan_sweep(load_study(study_path), there))
    assert pickle.loads(pickle.dumps(works)) == works
    assert len(pickle.dumps(works)) < 40_000  # paths, numbers and texts: no pixels

    there.mkdir()
    (tmp_path / "works").write_bytes(pickle.dumps(works))
    line = [sys.executable, "-c", WORKER, tmp_path / "works", tmp_path / "results"]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}  # of `probe`
    done = subprocess.run(line, capture_output=True, text=True, timeout=PATIENCE, env=environment)
    assert done.returncode == 0, done.stderr
    results = pickle.loads((tmp_path / "results").read_bytes())
    assert outputs(there) == outputs(here)
    assert len(outputs(there)) == 12
    assert [result.index for result in results] == [0, 1, 2, 3]
    assert len(pickle.dumps(results)) < 20_000  # a summary, no map
    for row, (result, image) in zip(rows, ((r, image) for r in results for image in r.images), strict=True):
        assert (image.output, image.state, image.error) == (row.output, "done", None)
        assert image.stamp.matches(there / image.output)
        assert result.map.counts == row.counts
        assert result.map.checks.as_json() == row.checks
        assert result.map.achieved is None


def test_what_fails_alone_is_told_in_the_result_of_its_point(study_path: Path) -> None:
    pictures = study_path.parent / "pictures"
    (pictures / "aa-text.png").write_text("I am a text.")
    write_image(pictures / "zz-deep.tif", np.zeros((8, 8, 3), np.float32), metadata={})
    plan = plan_sweep(load_study(study_path), study_path.parent / "out")
    plan.out.mkdir()
    first, second, *_ = works_of(plan)

    def traces(planner: Any, scene: Any, **options: Any) -> Any:
        if scene == second.scene:
            raise RuntimeError("a bug")
        return planner.trace(scene, **options)

    with Tools(steps=Steps(trace=traces)) as tools:
        one, other = make_point(first, tools), make_point(second, tools)
        again = make_point(first, tools)
    assert [image.state for image in one.images] == ["failed", "done", "done", "done", "failed"]
    assert "aa-text.png" in one.images[0].error
    assert "png cannot hold the picture's float32 without loss" in one.images[4].error
    assert one.map is not None
    assert other.map is None
    assert [image.state for image in other.images] == ["failed"] * 5
    assert [image.error for image in other.images[1:4]] == ["RuntimeError: a bug"] * 3
    assert [timeless(image) for image in again.images] == [timeless(image) for image in one.images]
    for result in (one, other, again):
        assert pickle.loads(pickle.dumps(result)) == result
        with pytest.raises(FrozenInstanceError):
            result.index = 7
    for image in one.images[1:4]:
        assert read_metadata(plan.out / image.output)["parameters"] == {"lens.c": 0.4, "lens.n": 1.3}


def test_seconds_by_stage_count_what_a_points_images_share_once(study_path: Path) -> None:
    plan = plan_sweep(load_study(study_path), study_path.parent / "out")
    plan.out.mkdir()
    with Tools() as tools:
        result = make_point(works_of(plan)[0], tools)
    shared = {"trace", "check", "upload"}
    each = {"wait", "paint", "encode", "digest", "decode"}
    assert set(result.images[0].spans) == shared | each
    assert set(result.images[1].spans) == set(result.images[2].spans) == each
    for stage, seconds in result.spans.items():
        assert seconds == pytest.approx(sum(image.spans.get(stage, 0.0) for image in result.images))
        assert seconds > 0
    for image in result.images:
        assert (image.paint_seconds, image.write_seconds) == (image.spans["paint"], image.spans["encode"])


def alive() -> int:
    """Return how many maps there are, those that a trace makes on its way included."""
    gc.collect()
    return sum(isinstance(each, RayMap) for each in gc.get_objects())


SLOW = pytest.mark.slow


@pytest.mark.parametrize(
    "kind", ["plain", "samples", pytest.param("accuracy", marks=SLOW), pytest.param("caustics", marks=SLOW)]
)
def test_one_map_is_alive_at_most_however_slow_the_disk(study_path: Path, kind: str) -> None:
    """A write goes on when all is begun that may be begun: so many points are on their way as can be."""
    if kind == "accuracy":
        accurate(study_path)
    elif kind != "plain":
        effect = {"samples": "antialias = 2", "caustics": "caustics = true"}[kind]
        text = study_path.read_text().replace('images = "pictures/*"', 'images = "pictures/*"\nsize = [8, 8]')
        study_path.write_text(f"{text}\n[effects]\n{effect}\n")
    for path in sorted((study_path.parent / "pictures").iterdir())[1:]:  # an image a point: the most points at once
        path.unlink()
    before, points = alive(), 4
    maps: list[weakref.ref[RayMap]] = []  # of all points
    at_checks, at_writes = [], []
    changed = threading.Condition()

    def traces(planner: Planner, scene: Scene, **options: Any) -> Any:
        raymap, achieved = planner.trace(scene, **options)
        with changed:
            maps.append(weakref.ref(raymap))
            changed.notify_all()
        return raymap, achieved

    def checks(raymap: RayMap) -> SelfCheck:
        at_checks.append(alive() - before)
        return check_map(raymap)

    def writes(*arguments: Any, **options: Any) -> None:
        with changed:
            assert changed.wait_for(lambda: len(maps) >= min(points, len(at_writes) + 3), PATIENCE)
            gc.collect()
            at_writes.append(sum(each() is not None for each in maps))
        write_image(*arguments, **options)

    steps = Steps(trace=traces, check=checks, write=writes)
    rows = list(run_sweep(plan_sweep(load_study(study_path), study_path.parent / "out"), steps=steps, encoders=1))
    assert [row.state for row in rows] == ["done"] * points
    assert at_checks == [1] * points  # a trace leaves no other map
    assert len(at_writes) == points
    assert max(at_writes) <= 1
    assert alive() == before
