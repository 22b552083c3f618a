"""What the commands say where the machine, the files or the user are odd: a message and an exit code, no traceback."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest
from patience import PATIENCE

from lenscl.cli.group import plain
from lenscl.imaging import write_image


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no device that is always full")
@pytest.mark.parametrize("arguments", [("lenses",), ("schema",), ("check", "STUDY"), ("sweep", "STUDY", "--dry-run")])
def test_output_that_cannot_be_written_is_one_line(command, study_path: Path, arguments: tuple[str, ...]) -> None:
    line = command(*(study_path if part == "STUDY" else part for part in arguments))
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(line, stdout=full, stderr=subprocess.PIPE, text=True, timeout=PATIENCE)
    assert done.returncode == 1
    assert done.stderr.count("Error: No space left on device") == 1
    assert "Traceback" not in done.stderr
    assert "Exception" not in done.stderr


def test_a_current_folder_that_is_gone_is_told_of(command, study_path: Path, tmp_path: Path) -> None:
    (tmp_path / "gone").mkdir()
    line = ["sh", "-c", f'cd {tmp_path}/gone && rmdir ../gone && exec "$@"', "sh", *command("sweep", study_path)]
    done = subprocess.run(line, capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 1, done.stderr
    assert "Traceback" not in done.stderr
    assert "Error: " in done.stderr


@pytest.mark.parametrize(
    ("error", "says"),
    [
        ("MemoryError()", "film.size or the picture may be too large"),
        ("PermissionError(13, 'Permission denied', 'x.toml')", "Error: x.toml: Permission denied"),
    ],
)
def test_no_memory_and_no_permission_are_messages(command, finish, study_path: Path, error: str, says: str) -> None:
    faults = f"import lenscl.config\ndef load_study(path): raise {error}\nlenscl.config.load_study = load_study"
    done = finish(command("check", study_path, faults=faults))
    assert done.returncode == 1
    assert says in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("text", ["\x1b[31mred", "a\nb", "\u202eexe.gnp", "\x07", os.fsdecode(b"\xe9")])
def test_nothing_printed_for_people_moves_a_terminal(lenscl, study_path: Path, text: str) -> None:
    assert plain(text).isprintable()
    (study_path.parent / "pictures" / f"zz{text}.png").write_text("no picture")
    escaped = "".join(f"\\u{ord(c):04x}" if ord(c) < 0xD800 else "e" for c in text)
    study_path.write_text(study_path.read_text().replace('title = "', f'title = "{escaped}'))
    checked = lenscl("check", study_path)
    swept = lenscl("sweep", study_path, "--set", "lens.r=0.2", "--set", "lens.n=1.5", "-o", study_path.parent / "out")
    assert (checked.exit_code, swept.exit_code) == (3, 3)
    shown = checked.stdout + swept.stderr
    assert shown.count("zz") >= 3
    assert not set(text) & set(shown.replace("\n", "" if text != "a\nb" else "\n")) - set("[31mredab\nexe.gnp")


def test_a_pattern_that_matches_nothing_is_named_by_check(lenscl, study_path: Path) -> None:
    for pattern in ("pictures/*.gif", "nowhere/*"):
        result = lenscl("check", study_path, "--set", f"picture.images={pattern}")
        assert result.exit_code == 3
        assert f'picture.images: no file matches "{pattern}" in ' in result.stdout
        assert lenscl("sweep", study_path, "--set", f"picture.images={pattern}").exit_code == 2


def test_check_foretells_what_a_format_would_lose(lenscl, study_path: Path) -> None:
    write_image(study_path.parent / "pictures" / "zz.exr", np.zeros((8, 8, 3), np.float32), metadata={})
    result = lenscl("check", study_path)
    assert result.exit_code == 3
    assert "zz.exr  8 x 8, 3 channels: output.format: png cannot hold" in result.stdout
    assert lenscl("check", study_path, "--set", "output.format=exr").exit_code == 0


def test_render_writes_linear_light_to_exr(lenscl, study_path: Path) -> None:
    from lenscl.imaging import read_picture

    assert lenscl("render", study_path, "-o", study_path.parent / "x.exr").exit_code == 0
    assert read_picture(study_path.parent / "x.exr").encoding == "linear"


@pytest.mark.parametrize("is_there", [False, True])
def test_an_interrupted_new_leaves_nothing(command, tmp_path: Path, is_there: bool) -> None:
    folder = tmp_path / "hello"
    if is_there:
        folder.mkdir()
    small = (
        "import os, signal, lenscl.imaging\n"
        "draw = lenscl.imaging.draw\n"
        "def drawn(name, size):\n"
        "    return draw(name, 16)\n"
        "lenscl.imaging.draw = drawn\n"
    )
    faults = (
        f"{small}signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # though the parent may ignore it
        "def interrupted(name, size):\n"
        "    if name == list(lenscl.imaging.SAMPLES)[1]: os.kill(os.getpid(), signal.SIGINT)\n"
        "    return drawn(name, size)\n"
        "lenscl.imaging.draw = interrupted"
    )
    done = subprocess.run(command("new", folder, faults=faults), capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode in (130, -signal.SIGINT)
    assert [path.name for path in tmp_path.iterdir()] == (["hello"] if is_there else [])
    assert not is_there or not list(folder.iterdir())
    assert subprocess.run(command("new", folder, faults=small), capture_output=True, timeout=PATIENCE).returncode == 0
    assert sorted(path.name for path in folder.iterdir()) == ["pictures", "study.toml"]


def test_a_finished_sweep_leaves_images_one_table_and_a_lock(lenscl, study_path: Path) -> None:
    out = study_path.parent / "out"
    assert lenscl("sweep", study_path, "--set", "lens.r=0.2", "-o", out).exit_code == 0
    assert lenscl("export", out, "--csv").exit_code == 0
    others = {path.name for path in out.iterdir() if path.suffix != ".png"}
    assert others == {"sweep.sqlite", "sweep.lock"}


def test_two_starters_do_not_write_over_each_other(
    lenscl, starter: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    few = ("--set", "lens.r=0.2", "--set", "film.size=[16, 16]")
    for name in ("one", "two"):
        shutil.copytree(starter, name)
    assert lenscl("sweep", "one/study.toml", *few).exit_code == 0
    refused = lenscl("sweep", "two/study.toml", *few, "--set", "lens.R=0.6")
    assert refused.exit_code == 1
    assert "another study" in refused.stderr
    assert "-o" in refused.stderr
    assert "--fresh" in refused.stderr
