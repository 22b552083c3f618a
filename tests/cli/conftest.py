from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from patience import PATIENCE

from lenscl.cli import main

Run = Callable[..., Result]


@pytest.fixture
def lenscl() -> Run:
    """Run a command in this process; a bug keeps its traceback."""

    def run(*arguments: str | Path) -> Result:
        result = CliRunner().invoke(main, [str(argument) for argument in arguments])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result

    return run


@pytest.fixture(scope="session")
def starter(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What `lenscl new` makes, once."""
    folder = tmp_path_factory.mktemp("starter") / "hello"
    result = CliRunner().invoke(main, ["new", str(folder)])
    assert result.exit_code == 0, result.output
    return folder


def small_study(starter: Path, folder: Path) -> Path:
    """Copy the starter study into a new folder, with a small film and two of its pictures; its file."""
    shutil.copytree(starter, folder)
    for path in sorted((folder / "pictures").iterdir())[2:]:
        path.unlink()
    path = folder / "study.toml"
    text = path.read_text()
    assert text.count("size = [256, 256]") == 1
    path.write_text(text.replace("size = [256, 256]", "size = [32, 20]"))
    return path


@pytest.fixture
def study_path(starter: Path, tmp_path: Path) -> Path:
    """The starter study with a small film and two of its pictures."""
    return small_study(starter, tmp_path / "study")


@pytest.fixture(scope="session")
def small_starter(starter: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same as `study_path`, once: to be read only."""
    return small_study(starter, tmp_path_factory.mktemp("small") / "study")


@pytest.fixture(scope="session")
def command() -> Callable[..., list[str]]:
    """Return the command line of a process of its own; `faults` is Python that is run in it first."""

    def build(*arguments: str | Path, faults: str = "") -> list[str]:
        start = f"{faults}\nfrom lenscl.cli import main\nmain(prog_name='lenscl')"
        return [sys.executable, "-c", start, *(str(argument) for argument in arguments)]

    return build


@pytest.fixture(scope="session")
def finish() -> Callable[[Sequence[str]], subprocess.CompletedProcess[str]]:
    """Run a process to its end."""
    return lambda line: subprocess.run(line, capture_output=True, text=True, timeout=PATIENCE)


@pytest.fixture(scope="session")
def outputs() -> Callable[[Path], dict[str, bytes]]:
    """Read every file of a sweep's folder but its table and lock."""
    return lambda folder: {
        path.name: path.read_bytes() for path in folder.iterdir() if not path.name.startswith("sweep.")
    }
