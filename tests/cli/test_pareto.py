"""The command pareto, and the commands that take a study which asks for an accuracy."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

from lenscl.accuracy import Combination, front
from lenscl.imaging import read_picture
from lenscl.views import front_plot

Run = Callable[..., Result]
FEW = [
    Combination(method="polynomial", precision="single"),
    Combination(method="polynomial"),
    Combination(method="march", step=0.01),
    Combination(method="march", step=0.3),
]


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(front, "every_combination", lambda *_: FEW)


@pytest.fixture
def asking(study_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("lenscl.accuracy.planning._PIXELS", (2**13, 2**13))  # the fewest that are planned on
    text = re.sub(r"\[numerics\][^\[]*", "", study_path.read_text())
    study_path.write_text(f"{text}\n[numerics]\naccuracy = '0.01 px'\n")
    return study_path


def test_a_front_is_a_table_a_csv_a_picture_and_a_page(
    lenscl: Run, study_path: Path, tmp_path: Path, few: None
) -> None:
    result = lenscl("pareto", study_path, "-o", tmp_path / "front", "--rounds", "6", "--set", "film.size=[48, 48]")
    assert result.exit_code == 0, result.stderr
    for combination in FEW:
        assert str(combination) in result.stdout
    assert "within 0.05 px: " in result.stdout
    assert "the forerunner's method: march 0.01, double" in result.stdout
    assert "device " in result.stdout
    assert sorted(path.name for path in (tmp_path / "front").iterdir()) == ["pareto.csv", "pareto.html", "pareto.png"]
    rows = list(csv.DictReader((tmp_path / "front" / "pareto.csv").read_text().splitlines()))
    assert len(rows) == len(FEW)
    assert {row["rays"] for row in rows} == {"2304"}
    assert read_picture(tmp_path / "front" / "pareto.png").size[0] > 1000
    assert "4 of 4" in result.stderr


def test_a_front_as_json_speaks_of_what_the_study_asks_for(
    lenscl: Run, asking: Path, tmp_path: Path, few: None
) -> None:
    result = lenscl("pareto", asking, "-o", tmp_path / "front", "--rounds", "6", "--json")
    found = json.loads(result.stdout)
    assert found["sentence"].startswith("within 0.01 px: ")
    assert [row["error_px_99"] for row in found["rows"]] == sorted(row["error_px_99"] for row in found["rows"])


def test_missing_plotting_is_said_before_anything_is_measured(
    lenscl: Run, study_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(front_plot, "find_spec", lambda _: None)
    result = lenscl("pareto", study_path, "-o", tmp_path / "front")
    assert result.exit_code == 1
    assert result.stderr == (
        "Error: a plot needs matplotlib and plotly, not installed here: pip install 'lenscl[plot]'\n"
    )
    assert not (tmp_path / "front").exists()


@pytest.mark.usefixtures("few")
def test_a_folder_that_cannot_be_made_is_named(lenscl: Run, study_path: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    result = lenscl("pareto", study_path, "-o", tmp_path / "file" / "front", "--rounds", "6")
    assert result.exit_code == 1
    assert f"{tmp_path}/file/front: cannot be made" in result.stderr


def test_commands_trace_as_accurately_as_a_study_asks_and_say_so(lenscl: Run, asking: Path, tmp_path: Path) -> None:
    for command, file in (("render", "one.png"), ("map", "one.npz")):
        result = lenscl(command, asking, "-o", tmp_path / file)
        assert result.exit_code == 0, result.stderr
        (told,) = [line for line in result.stderr.splitlines() if line.startswith("accuracy: ")]
        error = float(told.split("within ")[1].split(" px")[0])
        assert 0 < error <= 0.01
    kernel = lenscl("kernel", asking)
    assert "accuracy: " in kernel.stderr
    assert kernel.stdout.startswith("// lenses")
    listed = lenscl("sweep", asking, "--dry-run")
    assert listed.exit_code == 0
    assert all(row["kernel"] == "" for row in csv.DictReader(listed.stdout.splitlines()))
    assert "numerics.accuracy chooses kernels" in listed.stderr


def test_a_sweep_says_how_accurate_its_points_are_and_export_repeats_it(lenscl: Run, asking: Path) -> None:
    out = asking.parent / "out"
    swept = lenscl("sweep", asking, "-o", out)
    assert swept.exit_code == 0, swept.stderr
    assert re.search(r"accuracy: \d+ points? by .*; 99 % within at most .* px", swept.stderr)
    rows = list(csv.DictReader(swept.stdout.splitlines()))
    assert all(0 < float(row["achieved"]) <= 0.01 and row["traced_by"] for row in rows)
    assert lenscl("export", out, "--csv").stdout == swept.stdout


def test_what_cannot_be_reached_is_an_error_of_the_study(lenscl: Run, asking: Path, tmp_path: Path) -> None:
    result = lenscl("render", asking, "--set", "numerics.accuracy=1e-17 px", "-o", tmp_path / "one.png")
    assert result.exit_code == 2
    assert result.stderr.startswith('Error: numerics.accuracy: "1e-17 px" cannot be reached: the most accurate here, ')
    assert not list(tmp_path.glob("*.png"))
