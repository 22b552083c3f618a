from __future__ import annotations

import csv
import io
import json
import os
import re
import sqlite3
import threading
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from patience import PATIENCE

from lenscl.accuracy import Failure, Planner, SelfCheck, check_map
from lenscl.config import Scene, load_study
from lenscl.device import compile_count
from lenscl.errors import ImageError, TraceError
from lenscl.imaging import read_picture, write_image
from lenscl.imaging.encoding import encode
from lenscl.status import RayStatus
from lenscl.sweep import Row, Steps, Store, SweepError, csv_lines, paint_as_told, plan_sweep, run_sweep, total_spans
from lenscl.sweep.rows import COUNT_COLUMNS
from lenscl.sweep.schema import STORE_NAME
from lenscl.tracing import RayMap

Outputs = Callable[[Path], dict[str, bytes]]


def sweep(study_path: Path, out: Path, **options: object) -> list[Row]:
    return list(run_sweep(plan_sweep(load_study(study_path), out), **options))


def first_picture(study_path: Path) -> Path:
    return min((study_path.parent / "pictures").iterdir())


def test_every_point_and_picture_yields_an_image_and_a_row_in_work_order(study_path: Path, outputs: Outputs) -> None:
    out = study_path.parent / "out"
    rows = sweep(study_path, out)
    assert [row.state for row in rows] == ["done"] * 12
    assert [row.output for row in rows] == sorted(outputs(out))
    assert [row.index for row in rows] == [0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3]
    for row in rows:
        assert sum(row.counts.values()) == 20 * 12
        assert row.seconds > 0
        assert read_picture(out / row.output).pixels.shape == (12, 20, 3)
    assert len(set(outputs(out).values())) == 12  # every lens and every picture looks different


def test_a_sweep_over_numbers_builds_one_trace_program_and_traces_each_point_once(study_path: Path) -> None:
    traced = []

    def traces(planner: Planner, scene: Scene, **options: object) -> object:
        traced.append(scene)
        return planner.trace(scene, **options)

    before = compile_count()
    sweep(study_path, study_path.parent / "out", steps=Steps(trace=traces))
    assert compile_count() - before <= 1
    assert len(traced) == 4


def test_an_image_carries_its_parameters_but_no_clock_host_or_place(study_path: Path) -> None:
    from lenscl.imaging import read_metadata

    out = study_path.parent / "out"
    row = sweep(study_path, out)[4]
    about = read_metadata(out / row.output)
    assert about["parameters"] == {"lens.c": 0.4, "lens.n": 1.5}
    assert about["picture"] == row.picture
    assert "c = 0.4" in about["scene"]
    text = json.dumps(about)
    assert str(study_path.parent) not in text
    assert os.uname().nodename not in text


def test_two_undisturbed_runs_give_equal_bytes(study_path: Path, outputs: Outputs) -> None:
    sweep(study_path, study_path.parent / "a")
    sweep(study_path, study_path.parent / "b")
    a, b = outputs(study_path.parent / "a"), outputs(study_path.parent / "b")
    assert a == b
    assert len(a) == 12


def test_a_second_run_makes_nothing_and_lists_the_same_rows(study_path: Path) -> None:
    out = study_path.parent / "out"
    axes = load_study(study_path).axes
    first = list(csv_lines(sweep(study_path, out), axes))
    again = sweep(study_path, out, steps=Steps(trace=lambda *_, **__: pytest.fail("nothing needs tracing")))
    assert list(csv_lines(again, axes)) == first
    assert all(row.kept for row in again)


def test_only_what_is_missing_or_changed_is_made_again(study_path: Path, outputs: Outputs) -> None:
    out = study_path.parent / "out"
    rows = sweep(study_path, out)
    before = outputs(out)
    (out / rows[2].output).unlink()
    (out / rows[7].output).write_bytes(b"scribbled over")
    again = sweep(study_path, out)
    assert [number for number, row in enumerate(again) if not row.kept] == [2, 7]
    assert outputs(out) == before


def test_one_more_value_on_an_axis_makes_only_the_new_points(study_path: Path) -> None:
    out = study_path.parent / "out"
    sweep(study_path, out)
    study_path.write_text(study_path.read_text().replace("[0.4, 0.6]", "[0.4, 0.6, 0.7]"))
    again = sweep(study_path, out)
    assert [row.kept for row in again] == [True] * 12 + [False] * 6


def test_fresh_makes_everything_again(study_path: Path, outputs: Outputs) -> None:
    out = study_path.parent / "out"
    sweep(study_path, out)
    before = outputs(out)
    assert not any(row.kept for row in sweep(study_path, out, fresh=True))
    assert outputs(out) == before
    (out / STORE_NAME).write_text("damaged " * 1000)
    with pytest.raises(SweepError, match="--fresh"):
        sweep(study_path, out)
    assert not any(row.kept for row in sweep(study_path, out, fresh=True))


def test_bad_pictures_fail_alone_and_are_named(study_path: Path, outputs: Outputs) -> None:
    pictures = study_path.parent / "pictures"
    good = sweep(study_path, study_path.parent / "good")
    write_image(pictures / "zz-photo.jpg", np.zeros((64, 64, 3), np.uint8), metadata={})
    whole = (pictures / "zz-photo.jpg").read_bytes()
    (pictures / "zz-photo.jpg").write_bytes(whole[: len(whole) * 3 // 4])
    (pictures / "zz-text.png").write_text("I am a text.")
    (pictures / "zz-empty.tif").write_bytes(b"")
    (pictures / "zz-folder").mkdir()
    os.mkfifo(pictures / "zz-pipe.png")  # nobody writes into it: opening it would wait for ever
    rows = sweep(study_path, study_path.parent / "out")
    bad = {"zz-photo.jpg", "zz-text.png", "zz-empty.tif", "zz-folder", "zz-pipe.png"}
    assert {row.picture for row in rows if row.state == "failed"} == bad
    assert [row.state for row in rows].count("failed") == 4 * 5
    for row in rows:
        if row.state == "failed":
            assert row.picture in row.error
            assert row.seconds is None
    assert outputs(study_path.parent / "out") == outputs(study_path.parent / "good")
    assert len(good) == 12

    # Mended, they are made, and nothing else is
    (pictures / "zz-folder").rmdir()
    (pictures / "zz-pipe.png").unlink()
    bad -= {"zz-folder", "zz-pipe.png"}
    for name in bad:
        write_image(pictures / name, np.full((8, 8, 3), 99, np.uint8), metadata={})
    again = sweep(study_path, study_path.parent / "out")
    assert {row.picture for row in again if not row.kept} == bad
    assert all(row.state == "done" for row in again)


def test_a_picture_that_changes_while_the_sweep_runs_fails_alone(study_path: Path) -> None:
    plan = plan_sweep(load_study(study_path), study_path.parent / "out")
    path = first_picture(study_path)
    write_image(path, np.zeros((9, 9, 3), np.uint8), metadata={})
    rows = list(run_sweep(plan))
    assert {row.picture for row in rows if row.state == "failed"} == {path.name}
    assert "was changed while the sweep ran" in rows[0].error
    assert all(row.state == "done" for row in sweep(study_path, plan.out))


def test_a_point_that_cannot_be_traced_fails_alone(study_path: Path) -> None:
    def faulty(planner, scene, **options):
        if scene.lenses[0].values["c"] == 0.6 and scene.lenses[0].n == 1.3:
            raise RuntimeError("the driver\nstumbled")
        return planner.trace(scene, **options)

    rows = sweep(study_path, study_path.parent / "out", steps=Steps(trace=faulty))
    assert [row.index for row in rows if row.state == "failed"] == [2, 2, 2]  # nothing else is harmed
    assert rows[6].error == "RuntimeError: the driver stumbled"
    assert [row.kept for row in sweep(study_path, study_path.parent / "out")] == [True] * 6 + [False] * 3 + [True] * 3


def test_an_image_that_cannot_be_written_fails_alone(study_path: Path) -> None:
    def faulty(path, *arguments, **options):
        if path.name.startswith("00001"):
            raise ImageError(f"{path}: does not read back")
        write_image(path, *arguments, **options)

    rows = sweep(study_path, study_path.parent / "out", steps=Steps(write=faulty))
    assert [row.index for row in rows if row.state == "failed"] == [1, 1, 1]
    assert rows[3].error.endswith("does not read back")


def test_stopping_finishes_what_is_on_its_way_and_the_next_run_goes_on(study_path: Path, outputs: Outputs) -> None:
    out = study_path.parent / "out"
    plan = plan_sweep(load_study(study_path), out)
    asked = iter([False] * (12 + 5) + [True])  # once for each line of the work list, then for each image
    rows = list(run_sweep(plan, stop=lambda: next(asked)))
    assert len(rows) == 5
    assert all(row.state == "done" for row in rows)
    assert len(outputs(out)) == 5
    with Store.reading(out) as store:
        assert [row.state for row in store.rows()] == ["done"] * 5 + ["pending"] * 7
    again = sweep(study_path, out)
    assert [row.kept for row in again] == [True] * 5 + [False] * 7
    sweep(study_path, study_path.parent / "undisturbed")
    assert outputs(out) == outputs(study_path.parent / "undisturbed")


def test_stopping_while_the_work_list_is_written_leaves_the_folder_as_it_was(
    study_path: Path, outputs: Outputs
) -> None:
    out = study_path.parent / "out"
    sweep(study_path, out)
    study_path.write_text(study_path.read_text().replace("a = 1.0", "a = 1.1"))
    asked = iter([False] * 3 + [True])
    assert list(run_sweep(plan_sweep(load_study(study_path), out), stop=lambda: next(asked))) == []
    with Store.reading(out) as store:
        assert [row.state for row in store.rows()] == ["done"] * 12


def test_giving_up_the_iteration_notes_what_was_on_its_way(study_path: Path, outputs: Outputs) -> None:
    out = study_path.parent / "out"
    rows = run_sweep(plan_sweep(load_study(study_path), out))
    next(rows)
    rows.close()
    with Store.reading(out) as store:
        noted = {row.output for row in store.rows() if row.state == "done"}
    assert noted == set(outputs(out))
    assert noted


def test_images_on_their_way_are_few_however_slow_the_disk(study_path: Path) -> None:
    """A write goes on when nothing more can be begun before it has ended."""
    begun, ended, most = [], [], []
    changed = threading.Condition()
    most_on_their_way = 2 * 2

    def paints(*arguments):
        with changed:
            begun.append(1)
            most.append(len(begun) - len(ended))
            changed.notify_all()
        return paint_as_told(*arguments)

    def all_is_begun() -> bool:
        return len(begun) == 12 or len(begun) - len(ended) > most_on_their_way

    def writes(*arguments, **options):
        with changed:
            assert changed.wait_for(all_is_begun, PATIENCE)
        write_image(*arguments, **options)
        with changed:
            ended.append(1)
            changed.notify_all()

    rows = sweep(study_path, study_path.parent / "out", steps=Steps(paint=paints, write=writes), encoders=2)
    assert [row.state for row in rows] == ["done"] * len(begun) == ["done"] * 12
    assert max(most) == most_on_their_way + 1 < 12


def test_a_second_sweep_into_the_same_folder_is_refused_and_does_no_harm(study_path: Path, outputs: Outputs) -> None:
    out = study_path.parent / "out"
    rows = run_sweep(plan_sweep(load_study(study_path), out))
    next(rows)
    with pytest.raises(SweepError, match="another sweep is writing here"):
        sweep(study_path, out, fresh=True)
    assert len(list(rows)) == 11
    assert len(outputs(out)) == 12


def test_leftovers_of_dead_runs_are_removed(
    study_path: Path, outputs: Outputs, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = study_path.parent / "out"
    sweep(study_path, out)
    before = outputs(out)
    # Die, as far as files can tell, just before the rename
    monkeypatch.setattr(os, "replace", lambda *_: os._exit(9))
    child = os.fork()
    if child == 0:
        write_image(out / "00000-dead.png", np.zeros((4, 4, 3), np.uint8), metadata={})
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 9
    monkeypatch.undo()
    assert len(outputs(out)) == len(before) + 1
    sweep(study_path, out)
    assert outputs(out) == before


def test_the_table_as_csv_has_one_column_for_each_status_and_quotes_what_needs_it(study_path: Path) -> None:
    pictures = study_path.parent / "pictures"
    first_picture(study_path).rename(pictures / 'a "quoted", name.png')
    (pictures / "zz,\nbad.png").write_text("no picture")
    rows = sweep(study_path, study_path.parent / "out")
    axes = load_study(study_path).axes
    text = "\n".join(csv_lines(rows, axes, study_path.parent / "out"))
    table = list(csv.DictReader(io.StringIO(text)))
    assert len(table) == len(rows) == 16
    assert list(table[0]) == [
        "index", "lens.c", "lens.n", "picture",
        "on_picture", "off_picture", "behind", "total_reflection", "trapped", "undecided", "blocked",
        "seconds", "output", "error",
    ]  # fmt: skip
    for cells, row in zip(table, rows, strict=True):
        assert (int(cells["index"]), float(cells["lens.c"]), cells["picture"]) == (
            row.index, row.values["lens.c"], row.picture,
        )  # fmt: skip
        if row.state == "done":
            assert Path(cells["output"]).is_file()
            assert {status: int(cells[name]) for status, name in COUNT_COLUMNS.items()} == row.counts
        else:
            assert (cells["output"], cells["seconds"], cells["behind"]) == ("", "", "")
            assert "bad.png" in cells["error"]
    assert len(COUNT_COLUMNS) == len(RayStatus)


def with_format(study_path: Path, image_format: str) -> Path:
    study_path.write_text(f"{study_path.read_text()}\n[output]\nformat = '{image_format}'\n")
    return study_path


@pytest.mark.parametrize(("depth", "kind"), [("uint8", "float16"), ("uint16", "float32")])
def test_pictures_of_integers_become_linear_light_in_exr(study_path: Path, depth: str, kind: str) -> None:
    rng = np.random.default_rng(1)
    for path in (study_path.parent / "pictures").iterdir():
        write_image(path, rng.integers(0, np.iinfo(depth).max, (32, 32, 3), depth, endpoint=True), metadata={})
    whole = sweep(study_path, study_path.parent / "whole")
    light = sweep(with_format(study_path, "exr"), study_path.parent / "light")
    assert [row.state for row in light] == ["done"] * 12
    for one, other in zip(whole, light, strict=True):
        pixels = read_picture(study_path.parent / "whole" / one.output).pixels
        found = read_picture(study_path.parent / "light" / other.output)
        assert (found.pixels.dtype, found.encoding) == (kind, "linear")
        np.testing.assert_array_equal(encode(found.pixels.astype(np.float64), depth, "srgb"), pixels)


@pytest.mark.parametrize(
    ("depth", "image_format", "fit"),
    [("float32", "png", "tif or exr"), ("float32", "jpg", "tif or exr"), ("uint16", "jpg", "png or tif or exr")],
)
def test_a_format_that_would_lose_of_a_picture_is_named_in_its_row(
    study_path: Path, depth: str, image_format: str, fit: str
) -> None:
    write_image(study_path.parent / "pictures" / "zz.tif", np.zeros((8, 8, 3), depth), metadata={})
    rows = sweep(with_format(study_path, image_format), study_path.parent / "out")
    failed = [row for row in rows if row.state == "failed"]
    assert {row.picture for row in failed} == {"zz.tif"}
    assert len(failed) == 4
    says = f"zz.tif: output.format: {image_format} cannot hold the picture's {depth} without loss; use {fit}"
    assert {row.error for row in failed} == {says}


def test_another_studys_images_are_not_replaced_unasked(study_path: Path, outputs: Outputs) -> None:
    out = study_path.parent / "out"
    sweep(study_path, out)
    before = outputs(out)
    moved = study_path.rename(study_path.with_name("moved.toml"))
    assert all(row.kept for row in sweep(moved, out))  # all it would make is there: nothing is replaced
    other = study_path.with_name("other.toml")
    other.write_text(moved.read_text().replace("a = 1.0", "a = 0.9"))
    with pytest.raises(SweepError, match=r"another study \('A small study'\), and 00000-.*replaced.* -o, .*--fresh"):
        sweep(other, out)
    assert outputs(out) == before
    moved.write_text(other.read_text())  # the study itself may change
    assert [row.state for row in sweep(moved, out)] == ["done"] * 12
    assert outputs(out) != before
    assert not any(row.kept for row in sweep(other, out, fresh=True))


def test_each_point_is_checked_once_and_every_row_of_it_keeps_what_was_found(study_path: Path) -> None:
    checked = []

    def checks(raymap: RayMap) -> SelfCheck:
        checked.append(raymap)
        return check_map(raymap)

    before = compile_count("check")
    rows = sweep(study_path, study_path.parent / "out", steps=Steps(check=checks))
    assert len(checked) == 4
    assert compile_count("check") - before <= 1
    for row in rows:
        found = SelfCheck.from_json(row.checks)
        assert (found.failed, found.error) == (0, None)
        assert found.returned == found.surfaces >= 20
        assert found.as_json() == check_map(checked[row.index]).as_json()
    kept = sweep(study_path, study_path.parent / "out")
    assert [row.checks for row in kept] == [row.checks for row in rows]
    assert "checks" not in next(csv_lines(rows, ["lens.c", "lens.n"]))  # the table's columns are a contract


@pytest.mark.parametrize("error", [TraceError("the device went away"), ZeroDivisionError("a bug")])
def test_checks_that_fail_or_break_off_fail_no_row(error: Exception, study_path: Path) -> None:
    failure = Failure(row=1, column=2, event=1, law="snell", residual=1.0, bound=0.1)

    def found(raymap: RayMap) -> SelfCheck:
        if raymap.scene.n_medium == 1.0 and raymap.scene.lenses[0].n == 1.3:
            raise error
        return SelfCheck(rays=1, surfaces=2, failed=1, failures=(failure,))

    rows = sweep(study_path, study_path.parent / "out", steps=Steps(check=found))
    assert {row.state for row in rows} == {"done"}
    assert [row.checks["failed"] for row in rows] == [0, 0, 0, 1, 1, 1] * 2
    assert str(error) in rows[0].checks["error"]
    assert SelfCheck.from_json(rows[3].checks).failures == (failure,)


def test_rows_keep_seconds_by_stage_and_their_sum_counts_no_work_twice(study_path: Path) -> None:
    out = study_path.parent / "out"
    rows = sweep(study_path, out)
    for number, row in enumerate(rows):
        assert row.spans is not None
        assert ("trace" in row.spans) == ("check" in row.spans) == (number % 3 == 0)  # what a point's images share
        assert {"paint", "encode", "digest", "wait"} <= set(row.spans)
        assert ("commit" in row.spans) == (number > 0)  # each tells of the one before
        assert (row.paint_seconds, row.write_seconds) == (row.spans["paint"], row.spans["encode"])
    assert sum("decode" in row.spans for row in rows) == 3  # each picture once
    spent = total_spans(row.spans for row in rows)
    assert spent["trace"] >= sum(row.trace_seconds for row in rows[::3])
    with closing(sqlite3.connect(out / STORE_NAME)) as table:
        noted = [json.loads(spans) for (spans,) in table.execute("SELECT spans FROM run ORDER BY position")]
    assert noted == [row.spans for row in rows]
    assert [row.spans for row in sweep(study_path, out)] == noted  # kept with the row
    assert next(csv_lines(rows, ["lens.c"])).endswith("seconds,output,error")  # the table's columns are a contract


def accurate(study_path: Path, wish: str) -> Path:
    """Let a study ask for an accuracy."""
    text = study_path.read_text()
    text = re.sub(r"\[numerics\][^\[]*", "", text)
    study_path.write_text(f"{text}\n[numerics]\naccuracy = {wish!r}\n")
    return study_path


def test_a_study_that_asks_for_an_accuracy_says_what_it_achieved(study_path: Path) -> None:
    path = accurate(study_path, "1e-5 px")
    rows = sweep(path, path.parent / "out")
    assert {row.state for row in rows} == {"done"}
    assert all("plan" in row.spans for row in rows[::3])
    for row in rows:
        assert row.achieved is not None
        assert row.achieved["error"] <= 1e-5
        assert row.achieved["differ"] <= 1e-3
        assert row.achieved["rays"] >= 10
    axes = load_study(path).axes
    table = list(csv.DictReader(io.StringIO("\n".join(csv_lines(rows, axes, accuracy=True)))))
    assert all(float(line["achieved"]) <= 1e-5 for line in table)
    assert all("double" in line["traced_by"] or "mixed" in line["traced_by"] for line in table)
    assert next(csv_lines(rows, axes)).endswith(",error")  # a study that does not ask has no such columns


def test_points_of_one_structure_are_planned_once_and_by_the_first_whatever_is_done_already(
    study_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = accurate(study_path, "10 px")
    planned = []
    real = Planner.plan
    monkeypatch.setattr(Planner, "plan", lambda self, scene, *rest: planned.append(scene) or real(self, scene, *rest))
    out = path.parent / "out"
    sweep(path, out)
    first = next(load_study(path).points()).scene
    assert set(planned) == {first}
    planned.clear()
    with sqlite3.connect(out / STORE_NAME) as table:
        table.execute("UPDATE run SET state = 'pending' WHERE point = 3")
    sweep(path, out)
    assert set(planned) == {first}


def test_an_accuracy_that_a_point_cannot_reach_fails_that_point_by_name(study_path: Path) -> None:
    path = accurate(study_path, "1e-17 px")
    rows = sweep(path, path.parent / "out")
    assert {row.state for row in rows} == {"failed"}
    assert all(row.error is not None and "cannot be reached" in row.error for row in rows)
