"""The image that lenses reflect, in a sweep: sought beside the study, read once, and part of what is resumed."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

from lenscl.config import load_study
from lenscl.imaging import environment, read_metadata, write_image
from lenscl.sweep import Row, plan_sweep, run_sweep

SPLIT = '\n[effects]\nfresnel = "split"\nenvironment = "sky.png"\n'


@pytest.fixture
def split_path(study_path: Path) -> Path:
    """The small study, whose lenses reflect an image that lies beside it."""
    study_path.write_text(study_path.read_text().replace("[sweep.axes]", f"{SPLIT}[sweep.axes]"))
    draw_sky(study_path, 200)
    return study_path


def draw_sky(study_path: Path, value: int, name: str = "sky.png") -> None:
    write_image(study_path.parent / name, np.full((4, 8, 3), value, np.uint8), metadata={})


def sweep(study_path: Path) -> list[Row]:
    return list(run_sweep(plan_sweep(load_study(study_path), study_path.parent / "out")))


def test_only_another_content_of_the_image_paints_anew(split_path: Path) -> None:
    out = split_path.parent / "out"
    (first, *_) = sweep(split_path)
    before = (out / first.output).read_bytes()
    times = {path.name: path.stat().st_mtime_ns for path in out.glob("*.png")}
    os.utime(split_path.parent / "sky.png")
    sweep(split_path)
    assert {path.name: path.stat().st_mtime_ns for path in out.glob("*.png")} == times
    draw_sky(split_path, 20)
    rows = sweep(split_path)
    assert [row.state for row in rows] == ["done"] * 12
    assert all(path.stat().st_mtime_ns != times[path.name] for path in out.glob("*.png"))
    assert (out / first.output).read_bytes() != before


def test_it_is_decoded_once(split_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read = []
    real = environment.read_picture
    monkeypatch.setattr(environment, "read_picture", lambda path: read.append(path) or real(path))
    sweep(split_path)
    assert len(read) == 1


def test_outputs_say_its_name_and_not_its_place(split_path: Path) -> None:
    (row, *_) = sweep(split_path)
    about = read_metadata(split_path.parent / "out" / row.output)
    assert 'environment = "sky.png"' in about["scene"]
    assert str(split_path.parent) not in json.dumps(about)


def test_a_missing_image_fails_every_point_by_its_name(split_path: Path) -> None:
    (split_path.parent / "sky.png").unlink()
    rows = sweep(split_path)
    assert {row.state for row in rows} == {"failed"}
    assert all("sky.png" in row.error for row in rows)


def test_set_and_axes_seek_it_from_the_studys_folder_too(split_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    draw_sky(split_path, 20, "night.png")
    monkeypatch.chdir(split_path.parent.parent)
    relative = Path("study") / "small.toml"
    night = str(Path("study") / "night.png")
    assert load_study(relative).with_overrides({"effects.environment": "night.png"}).scene.environment == night
    text = split_path.read_text() + '"effects.environment" = ["sky.png", "night.png", "picture"]\n'
    split_path.write_text(text)
    study = load_study(relative)
    shown = [point.scene.environment for point in list(study.points())[:3]]
    assert shown == [str(Path("study") / "sky.png"), night, "picture"]
    held = study.with_overrides({"effects.environment": "night.png"})
    assert {point.scene.environment for point in held.points()} == {night}


def test_check_and_errors_name_the_key(split_path: Path) -> None:
    from click.testing import CliRunner

    from lenscl.cli import main

    def check() -> tuple[int, str]:
        result = CliRunner().invoke(main, ["check", str(split_path)])
        return result.exit_code, result.stdout

    code, text = check()
    assert code == 0
    assert "sky.png  8 x 4" in text
    (split_path.parent / "sky.png").write_bytes(b"no picture")
    code, text = check()
    assert code == 3
    assert "effects.environment: " in text
    assert "UNREADABLE" in text
    assert all(row.error.startswith("effects.environment: ") for row in sweep(split_path))
    split_path.write_text(split_path.read_text().replace('fresnel = "split"', "fresnel = true"))
    assert 'nothing reflects it; only fresnel = "split"' in check()[1]
