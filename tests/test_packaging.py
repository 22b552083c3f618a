"""The wheel carries the kernels and works away from the checkout."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(CHECKOUT)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return next(folder.glob("*.whl"))


def said(interpreter: str | Path, code: str, folder: Path | None = None) -> str:
    done = subprocess.run([interpreter, "-c", code], capture_output=True, text=True, cwd=folder, check=True)
    return done.stdout.strip()


def test_the_wheel_carries_every_kernel_and_nothing_of_the_tests(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    kernels = {path.relative_to(CHECKOUT / "kernels").as_posix() for path in (CHECKOUT / "kernels").rglob("*.cl")}
    assert len(kernels) > 15
    assert {name.removeprefix("lenscl/kernels/") for name in names if name.endswith(".cl")} == kernels
    assert not any(name.startswith(("tests", "configs", "bench")) for name in names)
    assert "lenscl/py.typed" in names
    scenes = {path.name for path in (CHECKOUT / "configs" / "bench").glob("*.toml")}
    assert len(scenes) == 8
    assert {Path(name).name for name in names if name.startswith("lenscl/configs/")} == scenes


def test_the_wheel_installs_into_a_fresh_environment_and_renders(wheel: Path, tmp_path: Path) -> None:
    environment = tmp_path / "venv"
    subprocess.run([sys.executable, "-m", "venv", str(environment)], check=True)
    python = environment / "bin" / "python"
    subprocess.run([python, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", str(wheel)], check=True)

    # The libraries it depends on are taken from here, but not lenscl itself
    def libraries(interpreter: str | Path) -> Path:
        return Path(said(interpreter, "import site; print(site.getsitepackages()[0])"))

    for entry in libraries(sys.executable).iterdir():
        link = libraries(python) / entry.name
        if "lenscl" not in entry.name.lower() and not link.exists():
            link.symlink_to(entry)

    starter = tmp_path / "starter"
    command = environment / "bin" / "lenscl"
    for arguments in (["new", str(starter)], ["render", str(starter / "study.toml"), "-o", str(tmp_path / "seen.png")]):
        done = subprocess.run([command, *arguments], capture_output=True, text=True, cwd=tmp_path, check=False)
        assert done.returncode == 0, done.stderr
    assert (tmp_path / "seen.png").stat().st_size > 1000
    assert str(environment) in said(python, "import lenscl; print(lenscl.__file__)", tmp_path)
    found = said(
        python, "from lenscl.accuracy.bench import scene_files; print(*scene_files().values())", tmp_path
    ).split()
    assert len(found) == 8
    assert all(path.startswith(str(environment)) for path in found)
