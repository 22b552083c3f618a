"""What ends a sweep, what is tried once more, and what fails alone."""

from __future__ import annotations

import errno
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from lost import LOST, REFUSED, driver_error, trace_error

from lenscl.accuracy import Planner, SelfCheck, check_map
from lenscl.cli import main
from lenscl.config import Scene, load_study
from lenscl.device import Buffer, Device, choose
from lenscl.errors import DiskFullError, ImageError, NoDeviceError
from lenscl.imaging import write_image
from lenscl.sweep import Row, Steps, Store, SweepError, paint_as_told, plan_sweep, run_sweep
from lenscl.sweep.errors import RESUME
from lenscl.sweep.schema import STORE_NAME
from lenscl.tracing import RayMap

Outputs = Callable[[Path], dict[str, bytes]]


def sweep(study_path: Path, **options: Any) -> list[Row]:
    return list(run_sweep(plan_sweep(load_study(study_path), study_path.parent / "out"), **options))


def states(study_path: Path) -> list[str]:
    with Store.reading(study_path.parent / "out") as store:
        return [row.state for row in store.rows()]


def goes_on(study_path: Path, made: int, least: int | None = None) -> None:
    """Run the same study again: what was made is kept, at least so much of it, and the rest is made."""
    rows = sweep(study_path)
    assert [row.state for row in rows] == ["done"] * 12
    kept = sum(row.kept for row in rows)
    assert [row.kept for row in rows] == [True] * kept + [False] * (12 - kept)
    assert (made if least is None else least) <= kept <= made


def traces_until(number: int, error: BaseException) -> Callable[..., Any]:
    """Return a trace that raises at the point of this number, counted from 0 as they come, and at those after it."""
    count = iter(range(100))

    def traces(planner: Planner, scene: Scene, **options: Any) -> Any:
        if next(count) >= number:
            raise error
        return planner.trace(scene, **options)

    return traces


# --- what ends a sweep ---


def test_a_device_that_is_gone_ends_the_sweep_and_what_was_made_is_noted(study_path: Path) -> None:
    with pytest.raises(NoDeviceError, match=f"the driver refuses a context; {RESUME}"):
        sweep(study_path, steps=Steps(trace=traces_until(2, NoDeviceError("the driver refuses a context"))))
    assert states(study_path) == ["done"] * 6 + ["pending"] * 6
    goes_on(study_path, 6)


def test_a_device_that_is_gone_while_rays_are_checked_ends_the_sweep_too(study_path: Path) -> None:
    def checks(raymap: RayMap) -> SelfCheck:
        raise NoDeviceError("the driver refuses a context")

    with pytest.raises(NoDeviceError, match=RESUME):
        sweep(study_path, steps=Steps(check=checks))
    assert states(study_path) == ["pending"] * 12


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT])
def test_a_full_disk_ends_the_sweep_and_fails_no_row(study_path: Path, number: int, outputs: Outputs) -> None:
    def writes(path: Path, pixels: Any, **options: Any) -> None:
        if path.name.startswith("00002"):
            raise DiskFullError(f"{path}: cannot be written ({OSError(number, 'full').strerror})")
        write_image(path, pixels, **options)

    with pytest.raises(SweepError, match=f"00002-.*full.*; {RESUME}"):
        sweep(study_path, steps=Steps(write=writes))
    found = states(study_path)
    assert found[:6] == ["done"] * 6
    assert set(found[6:9]) == {"pending"}
    assert set(found) == {"done", "pending"}
    assert found.count("done") == len(outputs(study_path.parent / "out"))  # what was whole is noted
    assert [row.state for row in sweep(study_path)] == ["done"] * 12


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EIO])
def test_an_image_file_tells_a_full_disk_from_other_trouble(
    tmp_path: Path, number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fsync(descriptor: int) -> None:
        raise OSError(number, "made up")

    monkeypatch.setattr("os.fsync", fsync)
    with pytest.raises(ImageError) as caught:
        write_image(tmp_path / "a.png", np.zeros((4, 4, 3), np.uint8), metadata={})
    assert isinstance(caught.value, DiskFullError) == (number != errno.EIO)


def test_a_folder_that_is_gone_ends_the_sweep(study_path: Path) -> None:
    out, away = study_path.parent / "out", study_path.parent / "away"

    def writes(path: Path, pixels: Any, **options: Any) -> None:
        if path.name.startswith("00002") and out.exists():
            out.rename(away)
        write_image(path, pixels, **options)

    with pytest.raises(SweepError, match=r"is gone.*put i.*back and run the same command again"):
        sweep(study_path, steps=Steps(write=writes), encoders=1)
    away.rename(out)
    goes_on(study_path, 6, least=3)  # the last ones before may not have been noted yet


def test_a_folder_that_was_replaced_ends_the_sweep_though_its_images_can_be_written(
    study_path: Path, outputs: Outputs
) -> None:
    out, away = study_path.parent / "out", study_path.parent / "away"

    def writes(path: Path, pixels: Any, **options: Any) -> None:
        if path.name.startswith("00002") and not away.exists():
            out.rename(away)
            out.mkdir()
        write_image(path, pixels, **options)

    with pytest.raises(SweepError, match=f"{STORE_NAME}: is gone, or was replaced; put its folder back"):
        sweep(study_path, steps=Steps(write=writes), encoders=1)
    assert outputs(out)
    shutil.rmtree(out)
    away.rename(out)
    goes_on(study_path, 6, least=3)  # the last ones before may not have been noted yet


def test_an_interrupt_ends_the_sweep_and_what_was_made_is_noted(study_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        sweep(study_path, steps=Steps(trace=traces_until(2, KeyboardInterrupt())))
    assert states(study_path) == ["done"] * 6 + ["pending"] * 6
    goes_on(study_path, 6)


@pytest.mark.parametrize(
    ("error", "code"), [(NoDeviceError("no device"), 4), (DiskFullError("a.png: make room"), 1)], ids=["device", "disk"]
)
def test_the_command_ends_with_the_code_of_what_stopped_it_and_says_how_to_go_on(
    study_path: Path, monkeypatch: pytest.MonkeyPatch, error: Exception, code: int
) -> None:
    steps = Steps(trace=traces_until(1, error))
    monkeypatch.setattr("lenscl.sweep.run_sweep", partial(run_sweep, steps=steps))
    done = CliRunner().invoke(main, ["sweep", str(study_path), "-o", str(study_path.parent / "out")])
    assert done.exit_code == code
    assert f"{error}; {RESUME}" in done.stderr
    assert len(done.stdout.splitlines()) <= 4  # the rows of the first point, behind the header
    assert states(study_path) == ["done"] * 3 + ["pending"] * 9


# --- what is tried once more ---


@pytest.mark.parametrize("stage", ["trace", "check", "paint"])
def test_a_device_that_was_lost_is_opened_anew_and_nothing_fails(
    study_path: Path, outputs: Outputs, stage: str
) -> None:
    calls: dict[str, int] = {"trace": 0, "check": 0, "paint": 0}
    devices = set()

    def loses(each: str, number: int) -> None:
        calls[each] += 1
        if each == stage and calls[each] == number:
            raise trace_error(LOST) if each != "paint" else driver_error(LOST)

    def traces(planner: Planner, scene: Scene, **options: Any) -> Any:
        loses("trace", 2)
        raymap, achieved = planner.trace(scene, **options)
        devices.add(id(raymap.device))
        return raymap, achieved

    def checks(raymap: RayMap) -> SelfCheck:
        loses("check", 2)
        return check_map(raymap)

    def paints(*arguments: Any) -> Any:
        loses("paint", 5)
        return paint_as_told(*arguments)

    rows = sweep(study_path, steps=Steps(trace=traces, check=checks, paint=paints))
    assert [row.state for row in rows] == ["done"] * 12
    assert all(row.checks["error"] is None for row in rows)
    assert len(devices) == 2
    assert calls["trace"] == 5  # one point once more
    undisturbed = study_path.parent / "undisturbed"
    list(run_sweep(plan_sweep(load_study(study_path), undisturbed)))
    assert outputs(study_path.parent / "out") == outputs(undisturbed)


def test_a_point_that_loses_the_device_twice_fails_by_name_and_the_others_are_made(study_path: Path) -> None:
    tried = []

    def traces(planner: Planner, scene: Scene, **options: Any) -> Any:
        if scene.lenses[0].values["c"] == 0.4 and scene.lenses[0].n == 1.5:
            tried.append(scene)
            raise trace_error(LOST)
        return planner.trace(scene, **options)

    rows = sweep(study_path, steps=Steps(trace=traces))
    assert [row.state for row in rows] == ["done"] * 3 + ["failed"] * 3 + ["done"] * 6
    assert len(tried) == 2  # its other pictures are not tried
    for row in rows[3:6]:
        assert row.error.startswith("the device: kernel trace failed (tried twice, ")


@dataclass(frozen=True)
class Dead(Device):
    """A device that takes nothing any more."""

    def upload(self, array: Any) -> Buffer:
        raise driver_error(LOST)


def test_a_device_that_does_not_come_back_ends_the_sweep(study_path: Path) -> None:
    chosen = choose()
    dead = Dead(**{name: getattr(chosen, name) for name in Device.__dataclass_fields__})
    with pytest.raises(NoDeviceError, match=f"is lost and does not come back .*; {RESUME}"):
        sweep(study_path, device=dead)
    assert states(study_path) == ["pending"] * 12
    goes_on(study_path, 0)


# --- what fails alone ---


def raising(error: Exception, at: Iterator[bool]) -> Callable[..., Any]:
    def step(planner: Planner, scene: Scene, **options: Any) -> Any:
        if next(at):
            raise error
        return planner.trace(scene, **options)

    return step


@pytest.mark.parametrize(
    "error", [trace_error(REFUSED), MemoryError(), RuntimeError("a bug"), OSError(errno.EIO, "no picture")],
    ids=["refused", "memory", "bug", "read"],
)  # fmt: skip
def test_any_other_error_fails_one_point_alone(study_path: Path, error: Exception) -> None:
    rows = sweep(study_path, steps=Steps(trace=raising(error, iter([True, False, False, False]))))
    assert [row.state for row in rows] == ["failed"] * 3 + ["done"] * 9
    assert len({row.error for row in rows[:3]}) == 1
    assert rows[0].error
