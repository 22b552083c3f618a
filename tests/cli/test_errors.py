from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from patience import PATIENCE


def test_every_problem_of_a_study_is_a_line_of_its_own_led_by_its_key(lenscl, study_path: Path) -> None:
    study_path.write_text(study_path.read_text().replace("R = 0.7", "R = -1.0").replace("n = 1.000277", "n = 'glas'"))
    result = lenscl("check", study_path)
    assert result.exit_code == 2
    lines = result.stderr.splitlines()
    assert len(lines) == 2
    assert any(line.startswith("Error: lens") for line in lines)
    assert any(line.startswith("Error: medium.n") for line in lines)
    assert result.stdout == ""


@pytest.mark.parametrize(
    "arguments",
    [
        ("check", "gone.toml"),
        ("sweep", "gone.toml"),
        ("render", "gone.toml", "-o", "x.png"),
        ("map", "gone.toml", "-o", "x.exr"),
        ("kernel", "gone.toml"),
    ],
)
def test_a_missing_study_is_named(lenscl, arguments: tuple[str, ...]) -> None:
    result = lenscl(*arguments)
    assert result.exit_code == 2
    assert result.stderr.startswith("Error: gone.toml: ")


@pytest.mark.parametrize(
    ("override", "expected"),
    [("lens.q=1", "lens.q"), ("lens.r", "KEY=VALUE"), ("numerics.method=guess", "numerics.method")],
)
def test_a_bad_override_is_refused_by_its_key(lenscl, study_path: Path, override: str, expected: str) -> None:
    result = lenscl("check", study_path, "--set", override)
    assert result.exit_code == 2
    assert result.stderr.startswith("Error: ")
    assert expected in result.stderr


def test_no_device_is_exit_code_4_and_says_how_to_get_one(command, study_path: Path) -> None:
    for arguments in (("devices",), ("kernel", study_path), ("sweep", study_path, "-o", study_path.parent / "out")):
        done = subprocess.run(
            command(*arguments),
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            env={**os.environ, "LENSCL_DEVICE": "abacus"},
        )
        assert done.returncode == 4, done.stderr
        assert "Error: LENSCL_DEVICE=abacus names no device; unset it or use part of: " in done.stderr
        assert "lenscl doctor" in done.stderr
        assert "Traceback" not in done.stderr
    assert not (study_path.parent / "out" / "sweep.sqlite").exists()


REPLACE_LOAD_STUDY = """
import lenscl.config
def load_study(path): raise {error}
lenscl.config.load_study = load_study
"""


def test_a_bug_keeps_its_traceback(command, finish, study_path: Path) -> None:
    faults = REPLACE_LOAD_STUDY.format(error="ZeroDivisionError('a bug')")
    done = finish(command("check", study_path, faults=faults))
    assert done.returncode == 1
    assert "Traceback" in done.stderr
    assert "a bug" in done.stderr


def test_ctrl_c_in_any_command_is_exit_code_130_without_a_traceback(command, finish, study_path: Path) -> None:
    faults = (
        "import lenscl.config\ndef load_study(path): raise KeyboardInterrupt\nlenscl.config.load_study = load_study"
    )
    done = finish(command("check", study_path, faults=faults))
    assert done.returncode == 130
    assert done.stderr == "Interrupted.\n"


@pytest.mark.parametrize("name", ["lenses", "schema"])
def test_a_reader_that_stops_early_is_no_error_message(command, name: str) -> None:
    """As `lenscl lenses | head -c 1`, with a pipe that is closed before the first row."""
    read, write = os.pipe()
    os.close(read)
    done = subprocess.Popen(command(name), stdout=write, stderr=subprocess.PIPE, text=True)
    os.close(write)
    _, complaint = done.communicate(timeout=PATIENCE)
    assert complaint == ""
    assert done.returncode == 1


def test_a_closed_pipe_ends_a_sweep_quietly_with_its_work_noted(command, finish, study_path: Path) -> None:
    out = study_path.parent / "out"
    line = command("sweep", study_path, "-o", out)
    with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as sweep:
        sweep.stdout.readline()
        sweep.stdout.close()
        complaint = sweep.stderr.read()
    assert sweep.returncode == 1
    assert "Traceback" not in complaint
    assert "Exception" not in complaint
    assert finish(line).returncode == 0


def test_modules_are_run_by_name_too() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "lenscl", "--version"], capture_output=True, text=True, timeout=PATIENCE
    )
    assert done.stdout.startswith("lenscl ")
    assert done.stderr == ""
