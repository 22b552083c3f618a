"""python-flint is there, but broken: every command says so, or does without it, and none ends in a traceback."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from patience import PATIENCE

FAULTS = {
    "a library is missing": (
        "from flint.deep import arb",
        "raise ImportError('libflint.so.20: cannot open\\nshared object file')",
        "ImportError: libflint.so.20: cannot open shared object file",
    ),
    "it is of another machine": (
        "from flint.deep import arb",
        "raise OSError('wrong ELF class')",
        "OSError: wrong ELF class",
    ),
    "a part is missing": ("import flint.gone", "", "ModuleNotFoundError: No module named 'flint.gone'"),
    "another package of that name": ("", "", "it has no arb, ctx, fmpq, fmpq_poly, fmpz_poly"),
}
Broken = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(params=FAULTS)
def why(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """Put a broken flint into a folder of the path; how it shows."""
    package = tmp_path / "first" / "flint"
    package.mkdir(parents=True)
    head, deep, shown = FAULTS[request.param]
    (package / "__init__.py").write_text(head)
    (package / "deep.py").write_text(deep)
    return shown


@pytest.fixture
def broken(command: Callable[..., list[str]], tmp_path: Path) -> Broken:
    """Run a command where that folder comes first."""
    path = os.pathsep.join(filter(None, (str(tmp_path / "first"), os.environ.get("PYTHONPATH"))))

    def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            command(*arguments),
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            env={**os.environ, "PYTHONPATH": path},
        )

    return run


def told(why: str) -> str:
    return (
        f"certified answers need python-flint, which is installed but cannot be used ({why}): "
        "pip install --force-reinstall python-flint"
    )


def test_a_pixel_is_explained_without_a_proof(why: str, broken: Broken, study_path: Path) -> None:
    done = broken("explain", study_path, "--pixel", "10,12")
    assert (done.returncode, done.stderr) == (0, "")
    assert " ".join(done.stdout.split()).endswith(f"proved nothing: {told(why)}")


@pytest.mark.parametrize("why", ["a library is missing"], indirect=True)
def test_what_cannot_do_without_it_is_refused(why: str, broken: Broken, study_path: Path, tmp_path: Path) -> None:
    small = ("--set", "film.size=[12, 12]")
    for asked in (
        ("pareto", study_path, *small, "--rounds", "6", "-o", tmp_path / "front"),
        ("map", study_path, *small, "--set", "numerics.accuracy=1e-9 px", "-o", tmp_path / "a.npz"),
    ):
        done = broken(*asked)
        assert done.returncode == 1
        assert done.stderr.splitlines()[-1] == f"Error: {told(why)}"
        assert "Traceback" not in done.stderr


@pytest.mark.parametrize("why", ["a library is missing"], indirect=True)
def test_what_never_asks_for_it_does_its_work(why: str, broken: Broken, study_path: Path, tmp_path: Path) -> None:
    done = broken("map", study_path, "--error", "-o", tmp_path / "a.npz")
    assert (done.returncode, "flint" in done.stderr) == (0, False), done.stderr


@pytest.mark.parametrize("why", ["a library is missing", "another package of that name"], indirect=True)
def test_the_doctor_names_it_with_its_fix(why: str, broken: Broken) -> None:
    done = broken("doctor", "--json")
    faults = [row for row in json.loads(done.stdout) if row["state"] == "FAULT"]
    assert done.returncode == 1
    assert [(row["what"], row["fix"]) for row in faults] == [
        ("extra accuracy", "pip install --force-reinstall python-flint")
    ]
    assert faults[0]["detail"].startswith("installed, but cannot be used: ")
