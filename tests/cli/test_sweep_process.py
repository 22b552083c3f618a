"""Sweeps that are killed, interrupted, or meet each other, in processes of their own."""

from __future__ import annotations

import csv
import io
import os
import random
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from patience import PATIENCE

from lenscl.sweep.lock import folder_lock

IMAGES = 9 * 2  # points times pictures of the starter study as the fixture leaves it

ENDLESS_WRITES = """
import functools
import sys
import time
import lenscl.sweep as sweeping
def write(*arguments, **options):
    print("writing", file=sys.stderr, flush=True)
    while True:
        time.sleep(3600)
sweeping.run_sweep = functools.partial(sweeping.run_sweep, steps=sweeping.Steps(write=write))
"""

# All writes but the first ones wait until a file appears
HELD_WRITES = """
import functools
import itertools
import time
from pathlib import Path
import lenscl.sweep as sweeping
from lenscl.imaging import write_image
count = itertools.count(1)
def write(*arguments, **options):
    held = next(count) > {free}
    while held and not Path({gate!r}).exists():
        time.sleep(0.01)
    write_image(*arguments, **options)
sweeping.run_sweep = functools.partial(sweeping.run_sweep, steps=sweeping.Steps(write=write))
"""

DIE_AT_RENAME = """
import itertools, os, signal
import lenscl.imaging
count, real = itertools.count(1), os.replace
def replace(source, target):
    if next(count) == {number}:
        {before}
        os.kill(os.getpid(), signal.SIGKILL)
    real(source, target)
os.replace = replace
"""


@pytest.fixture(scope="session")
def undisturbed(small_starter: Path, command, finish, outputs) -> dict[str, bytes]:
    out = small_starter.parent.parent / "undisturbed"
    done = finish(command("sweep", small_starter, "-o", out))
    assert done.returncode == 0, done.stderr
    made = outputs(out)
    assert len(made) == IMAGES
    return made


def start(line: list[str]) -> subprocess.Popen[str]:
    return subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def read_rows(process: subprocess.Popen[str], rows: int) -> None:
    for _ in range(1 + rows):
        assert process.stdout.readline()


def wait_for(word: str, process: subprocess.Popen[str]) -> str:
    """Read complaints until one has a word; all that were read."""
    read = ""
    for line in process.stderr:
        read += line
        if word in line:
            return read
    pytest.fail(f"it ended without saying {word!r}")


def kill_and_resume(study_path: Path, command, finish, outputs, kills: list[int]) -> tuple[dict[str, bytes], list[int]]:
    """Kill a sweep after so many rows of each run, then let one finish; return its images, and how many each left.

    No run writes more images than it is to leave, however late it is killed.
    """
    out = study_path.parent / "killed"
    found: list[int] = []
    for rows in kills:
        held = HELD_WRITES.format(free=rows - (found[-1] if found else 0), gate=str(out / "never"))
        with start(command("sweep", study_path, "-o", out, faults=held)) as process:
            read_rows(process, rows)
            process.kill()
        assert process.returncode == -signal.SIGKILL
        found.append(len([name for name in outputs(out) if name.endswith(".png")]))
    done = finish(command("sweep", study_path, "-o", out))
    assert done.returncode == 0, done.stderr
    table = list(csv.DictReader(io.StringIO(done.stdout)))
    assert len(table) == IMAGES
    assert f"{IMAGES} made" not in done.stderr  # something was kept
    return outputs(out), found


def test_a_sweep_killed_twice_ends_with_the_bytes_of_an_undisturbed_one(
    study_path: Path, command, finish, outputs, undisturbed: dict[str, bytes]
) -> None:
    made, found = kill_and_resume(study_path, command, finish, outputs, [2, 9])
    assert made == undisturbed
    assert found == [2, 9]


@pytest.mark.slow
def test_a_sweep_killed_ten_times_ends_with_the_bytes_of_an_undisturbed_one(
    study_path: Path, command, finish, outputs, undisturbed: dict[str, bytes]
) -> None:
    rows = sorted(random.Random(11).randrange(IMAGES - 1) for _ in range(10))
    made, found = kill_and_resume(study_path, command, finish, outputs, rows)
    assert made == undisturbed
    assert found == rows


@pytest.mark.parametrize("before", ["pass", "real(source, target)"], ids=["before the rename", "after it"])
def test_dying_at_a_rename_leaves_whole_images_only(
    study_path: Path, command, finish, outputs, undisturbed: dict[str, bytes], before: str
) -> None:
    out = study_path.parent / "killed"
    line = command("sweep", study_path, "-o", out, faults=DIE_AT_RENAME.format(number=5, before=before))
    assert finish(line).returncode == -signal.SIGKILL
    left = outputs(out)
    whole = {name: data for name, data in left.items() if name in undisturbed}
    assert whole
    assert all(data == undisturbed[name] for name, data in whole.items())
    done = finish(command("sweep", study_path, "-o", out))
    assert done.returncode == 0, done.stderr
    assert outputs(out) == undisturbed  # and nothing besides: what the dead run left is gone


def test_the_first_ctrl_c_finishes_what_is_on_its_way_and_says_how_to_go_on(
    study_path: Path, command, finish, outputs, undisturbed: dict[str, bytes]
) -> None:
    out = study_path.parent / "interrupted"
    gate = study_path.parent / "gate"
    with start(command("sweep", study_path, "-o", out, faults=HELD_WRITES.format(free=3, gate=str(gate)))) as process:
        read_rows(process, 3)
        process.send_signal(signal.SIGINT)
        complaint = wait_for("Stopping", process)
        gate.touch()  # the writes on their way go on when they are known to be the last
        rest = process.stdout.read()  # communicate() would lose what readline() holds
        complaint += process.stderr.read()
        process.wait(timeout=PATIENCE)
    assert process.returncode == 130, complaint
    assert "run the same command again" in complaint
    assert "Traceback" not in complaint
    noted = 3 + len(rest.splitlines())
    assert noted < IMAGES
    assert len(outputs(out)) == noted  # every image on disk has its row, and the reverse
    assert all(data == undisturbed[name] for name, data in outputs(out).items())
    done = finish(command("sweep", study_path, "-o", out))
    assert done.returncode == 0
    assert f"{IMAGES - noted} made, {noted} kept, 0 failed" in done.stderr
    assert outputs(out) == undisturbed


def test_the_second_ctrl_c_quits_at_once(study_path: Path, command) -> None:
    out = study_path.parent / "interrupted"
    with start(command("sweep", study_path, "-o", out, faults=ENDLESS_WRITES)) as process:
        wait_for("writing", process)
        process.send_signal(signal.SIGINT)
        wait_for("Stopping", process)
        assert process.poll() is None  # it waits for the writes on their way
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=PATIENCE) == 130
        process.stderr.close()


def test_a_sweep_into_a_folder_where_one_is_at_work_is_refused(study_path: Path, command, finish) -> None:
    out = study_path.parent / "out"
    with folder_lock(out):
        done = finish(command("sweep", study_path, "-o", out))
        assert done.returncode == 1
        assert done.stderr.splitlines()[-1] == (
            f"Error: {out}: another sweep is writing here; wait for it to end, or choose another folder with -o"
        )
        assert [path.name for path in out.iterdir()] == ["sweep.lock"]
    assert finish(command("sweep", study_path, "-o", out)).returncode == 0


def test_a_full_disk_stops_the_sweep_and_making_room_lets_it_go_on(
    study_path: Path, command, finish, outputs, undisturbed: dict[str, bytes], small_disk: Callable[[int], Path]
) -> None:
    disk = small_disk(16 * 2**20)
    out = disk / "out"
    ballast = disk / "ballast"
    ballast.write_bytes(bytes(13 * 2**20))
    done = finish(command("sweep", study_path, "-o", out))
    assert done.returncode == 1, done.stderr
    assert "Traceback" not in done.stderr
    assert "make room on the disk; what was made is noted: run the same command again to go on" in done.stderr
    assert outputs(out) == {}
    states = [line["output"] for line in csv.DictReader(finish(command("export", out, "--csv")).stdout.splitlines())]
    assert states == [""] * IMAGES  # none was tried in vain

    ballast.unlink()
    assert finish(command("sweep", study_path, "-o", out)).returncode == 0
    assert outputs(out) == undisturbed


def test_a_disk_too_full_for_the_table_is_named(
    study_path: Path, command, finish, small_disk: Callable[[int], Path]
) -> None:
    disk = small_disk(2**20)
    (disk / "ballast").write_bytes(bytes(2**20 - 20_000))
    done = finish(command("sweep", study_path, "-o", disk / "out"))
    assert done.returncode == 1, done.stderr
    assert "Traceback" not in done.stderr
    assert f"Error: {disk / 'out' / 'sweep.sqlite'}: the disk" in done.stderr
    assert "run the same command again" in done.stderr


def test_a_disk_that_cannot_be_written_is_named_before_anything_is_printed(
    study_path: Path, command, finish, small_disk: Callable[[int], Path]
) -> None:
    disk = small_disk(16 * 2**20)
    out = disk / "out"
    assert finish(command("sweep", study_path, "-o", out)).returncode == 0
    subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
    for options, expected in (
        (("-o", out), f"Error: {out / 'sweep.sqlite'}: cannot be written; make the folder and the file writable"),
        (("-o", out, "--fresh"), "cannot be removed: Read-only file system"),
        (("-o", disk / "new"), f"Error: {disk / 'new'}: cannot be made: Read-only file system"),
    ):
        done = finish(command("sweep", study_path, *options))
        assert done.returncode == 1
        assert expected in done.stderr
        assert "Traceback" not in done.stderr
        assert done.stdout == ""
    assert len(finish(command("export", out, "--csv")).stdout.splitlines()) == 1 + IMAGES


@pytest.fixture
def small_disk(tmp_path: Path):
    """Make a file system of so many bytes; only the superuser can."""
    mounted: list[Path] = []

    def make(size: int) -> Path:
        folder = tmp_path / "disk"
        folder.mkdir()
        done = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", folder], capture_output=True)
        if done.returncode != 0:
            pytest.skip("a small file system cannot be mounted here: a full or sealed disk was not tried")
        mounted.append(folder)
        return folder

    if os.name != "posix" or os.geteuid() != 0:
        pytest.skip("only the superuser can mount a small file system: a full or sealed disk was not tried")
    yield make
    for folder in mounted:
        subprocess.run(["umount", folder], check=True)
