from __future__ import annotations

import json
import os
import subprocess

import pytest
from patience import PATIENCE

from lenscl.cli import health


def run_doctor(command, faults: str = "", **environment: str) -> tuple[int, list[dict[str, str]]]:
    done = subprocess.run(
        command("doctor", "--json", faults=faults),
        capture_output=True, text=True, timeout=PATIENCE, env={**os.environ, **environment},
    )  # fmt: skip
    assert "Traceback" not in done.stderr, done.stderr
    return done.returncode, json.loads(done.stdout)


def test_a_machine_that_works_is_told_so(command) -> None:
    code, found = run_doctor(command)
    states = {(row["what"], row["state"]) for row in found}
    assert ("device", "ok") in states
    assert ("image format", "ok") in states
    assert code == 0, found


def test_every_fault_comes_with_its_fix(command) -> None:
    """Without a PATH there is no linker, and nothing is compiled."""
    code, found = run_doctor(command, PATH="/nonexistent")
    faults = [row for row in found if row["state"] == "FAULT"]
    assert code == 4
    assert any("ld" in row["detail"] and "binutils" in row["fix"] for row in faults)
    assert all(row["fix"] for row in faults)
    assert any(row["what"] == "image format" and row["state"] == "ok" for row in found)  # it looked at the rest too


def test_doctor_runs_where_pyopencl_cannot_be_imported(command, tmp_path) -> None:
    (tmp_path / "pyopencl.py").write_text("raise ImportError('libOpenCL.so.1: cannot open shared object file')")
    code, found = run_doctor(command, PYTHONPATH=str(tmp_path))
    assert code == 4
    (fault,) = [row for row in found if row["is_device"]]
    assert "libOpenCL.so.1" in fault["detail"]


@pytest.mark.parametrize(
    ("crash", "expected"),
    [
        ("os.abort()", "the driver ended its process with SIGABRT"),
        ("sys.exit('no such luck')", "no such luck"),
    ],
)
def test_a_driver_that_ends_its_process_is_a_finding(
    monkeypatch: pytest.MonkeyPatch, crash: str, expected: str
) -> None:
    real = subprocess.run

    def crashing(line, **options):
        return real([line[0], "-c", f"import os, sys; {crash}"], **options)

    monkeypatch.setattr(subprocess, "run", crashing)
    (finding,) = health._devices()
    assert (finding.state, finding.is_device) == ("FAULT", True)
    assert expected in finding.detail


def test_a_device_that_computes_nonsense_is_a_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    """The twin, not the device, is spoilt here; the comparison cannot tell."""
    from lenscl import reference
    from lenscl.cli import probe
    from lenscl.device import choose

    label = choose().label
    assert probe._compare(label)["problems"] == []
    real = reference.trace

    def spoilt(scene):
        paths = real(scene)
        paths.st[:] += 1e-6
        return paths

    monkeypatch.setattr(reference, "trace", spoilt)
    problems = probe._compare(label)["problems"]
    assert len(problems) == 1
    assert problems[0].startswith("in double only")


def test_every_format_of_a_study_is_looked_at() -> None:
    from lenscl.config import study_from_toml
    from lenscl.errors import StudyError

    with pytest.raises(StudyError) as refused:
        study_from_toml('[output]\nformat = "nonsense"')
    (problem,) = [text for text in refused.value.problems if text.startswith("output.format")]
    for name in health.FORMATS:
        assert f'"{name}"' in problem
    assert problem.count('"') == 2 * len(health.FORMATS) + 2


def test_surroundings_at_fault_are_the_only_fault_told_of_devices(command) -> None:
    code, found = run_doctor(command, POCL_CACHE_DIR="/dev/null/cache")
    faults = [row for row in found if row["state"] == "FAULT"]
    assert code == 4
    assert [row["what"] for row in faults] == ["OpenCL's surroundings"]


def test_a_device_that_is_not_there_is_one_whole_sentence(command) -> None:
    code, found = run_doctor(command, LENSCL_DEVICE="abacus")
    (fault,) = [row for row in found if row["what"] == "choice of device"]
    assert code == 4
    assert fault["detail"].startswith("LENSCL_DEVICE=abacus names no device; unset it or use part of: ")
    assert not fault["detail"].endswith(":")
