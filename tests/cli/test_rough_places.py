"""What the commands say where the machine, the files or the user are odd: a message and an exit code, no traceback."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
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


def _noted(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.startswith("note: ")]


def test_a_stretched_film_and_picture_are_noted_once_and_change_no_exit_code(lenscl, study_path: Path) -> None:
    folder = study_path.parent
    write_image(folder / "pictures" / "aa-wide.png", np.zeros((8, 16, 3), np.uint8), metadata={})
    few = ("--set", "lens.r=0.2", "--set", "lens.n=1.5")
    checked = lenscl("check", study_path, *few)
    assert checked.exit_code == 0
    remarks = checked.stdout.split("\nRemarks:\n")[1].splitlines()
    assert [remark.split(": ")[0] for remark in remarks] == ["  film", "  picture"]
    found = {
        "render": lenscl("render", study_path, *few, "-o", folder / "x.png"),
        "map": lenscl("map", study_path, *few, "-o", folder / "x.npz"),
        "sweep": lenscl("sweep", study_path, *few, "-o", folder / "out"),
    }
    for command, result in found.items():
        assert result.exit_code == 0
        notes = _noted(result.stderr)
        assert len(notes) == (1 if command == "map" else 2)
        assert notes[0].startswith("note: film: its pixels are 1.6 times as high as wide")
        assert all("aa-wide.png, 16 x 8, are 2 times as high as wide" in note for note in notes[1:])
        assert not any(line.startswith("note") for line in result.stdout.splitlines())
    square = ("--set", "film.down=[0, -1.25, 0]", "--set", "picture.images=pictures/c*.png")
    assert "Remarks" not in lenscl("check", study_path, *few, *square).stdout
    assert _noted(lenscl("map", study_path, *few, *square, "-o", folder / "x.npz").stderr) == []


def test_what_is_set_may_replace_what_the_file_has_wrong(lenscl, study_path: Path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "scipy", None)
    monkeypatch.setitem(sys.modules, "scipy.stats", None)
    text = study_path.read_text()
    axes = text.index("[sweep.axes]")
    sampled = "[sweep]\nmode = 'latin'\nsamples = 2\n[sweep.axes]\n'lens.r' = { min = 0.1, max = 0.2 }\n"
    study_path.write_text(text[:axes].replace("size = [32, 20]", "size = [32, 0]") + sampled)
    wrong = lenscl("check", study_path, "--set", "sweep.mode=random")
    assert (wrong.exit_code, wrong.stderr.count("\n")) == (2, 1)
    assert wrong.stderr.startswith("Error: film.size: ")
    assert "SciPy" in lenscl("check", study_path, "--set", "film.size=[32, 20]").stderr
    right = lenscl("check", study_path, "--set", "film.size=[32, 20]", "--set", "sweep.mode=random")
    assert right.exit_code == 0
    assert "2 points" in right.stdout


@pytest.mark.parametrize("environment", ["picture", "pictures/cat.png", "[0.1, 0.2, 0.9]"])
@pytest.mark.parametrize("form", ["exr", "npz"])
@pytest.mark.parametrize("dispersion", ["false", "rgb"])
def test_a_map_of_reflections_is_written_or_refused_by_a_sentence(
    lenscl, study_path: Path, environment: str, form: str, dispersion: str
) -> None:
    sets = ("effects.fresnel=split", f"effects.environment={environment}", f"effects.dispersion={dispersion}")
    file = study_path.parent / f"map.{form}"
    result = lenscl("map", study_path, "-o", file, *(part for each in sets for part in ("--set", each)))
    if (form, dispersion) == ("exr", "rgb"):
        assert result.exit_code == 1
        assert "holds one wavelength" in result.stderr
        assert not file.exists()
    else:
        assert result.exit_code == 0
        assert file.exists()


@pytest.mark.parametrize(
    ("lens", "says"),
    [
        ('surface = "1 - x**2 - y**2 - z**2"\nbounds = [[-2, -2, -2], [2, 2, 2]]', "try -(1 - x**2 - y**2 - z**2)"),
        ('surface = "bunny.stl"', "files of meshes are not read"),
        ('surface = "x² + y² + z² - 1"\nbounds = [[-2, -2, -2], [2, 2, 2]]', "superscript two"),
        ('surface = "sphere"\n[source]\nat = [0, 0, 5]', "a study has one source"),
    ],
)
def test_a_stranger_is_told_in_one_message_what_to_write(lenscl, tmp_path: Path, lens: str, says: str) -> None:
    study = tmp_path / "study.toml"
    study.write_text(
        "[source]\nat = [0, 0, 4]\n[film]\ncentre = [0, 0, 2.5]\nright = [1, 0, 0]\ndown = [0, -1, 0]\nsize = [8, 8]\n"
        "[picture]\ncentre = [0, 0, -2.5]\nright = [6, 0, 0]\ndown = [0, -6, 0]\n"
        f"[[lens]]\nn = 1.5\n{lens}\n",
        encoding="utf-8",
    )
    for command in (("check",), ("map", "-o", tmp_path / "x.npz"), ("render", "-o", tmp_path / "x.png")):
        result = lenscl(command[0], study, *command[1:])
        assert result.exit_code == 2
        assert result.stderr.count("Error: ") == 1
        assert says in result.stderr
