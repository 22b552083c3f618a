from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from lenscl.accuracy.bench import scenes

CONFIGS = Path(__file__).parent.parent.parent / "configs" / "bench"


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """The benchmark's tori and heart on a film of few pixels; a folder for runs."""
    found = {}
    for name in ("heart-close", "torus-close", "torus-wide"):
        text = (CONFIGS / f"{name}.toml").read_text()
        assert text.count("size = [1024, 1024]") == 1
        found[name] = tmp_path / f"{name}.toml"
        found[name].write_text(text.replace("size = [1024, 1024]", "size = [32, 24]"))
    monkeypatch.setattr(scenes, "scene_files", lambda: found)
    return tmp_path / "runs"


QUICK = ("--scene", "torus-close", "--rounds", "3")


def table(text: str) -> list[list[str]]:
    """Return the cells of the first table in a text."""
    return [line.split() for line in text.split("\n\n")[0].splitlines()]


def test_a_run_is_a_table_and_its_circumstances(lenscl, small: Path) -> None:
    result = lenscl("bench", *QUICK, "--folder", small)
    assert result.exit_code == 0
    head, *rows = table(result.stdout)
    assert head[:4] == ["scene", "method", "precision", "ns/ray"]

    assert [row[:2] for row in rows] == [["torus-close", method] for method in ("auto:", "auto:", "march", "march")]

    for needed in (
        "device  ",
        "GFLOP/s",
        "3 rounds",
        "768 of the film",
        "float64 twin",
        "the frozen kernel",
        "lenscl 0",
    ):
        assert needed in result.stdout
    assert result.stderr.splitlines()[0] == "1 of 4: torus-close auto double"
    assert len(result.stderr.splitlines()) == 4
    assert not small.exists()  # nothing is kept that was not asked for


def test_a_saved_run_is_compared_with_a_later_one(lenscl, small: Path) -> None:
    first = lenscl("bench", *QUICK, "--method", "auto", "--precision", "double", "--save", "base", "--folder", small)
    assert first.exit_code == 0
    assert str(small / "base.json") in first.stderr
    result = lenscl("bench", *QUICK, "--precision", "double", "--compare", "base", "--folder", small)
    assert result.exit_code == 0
    assert "Against base, measured 2" in result.stdout
    paired = result.stdout.split("Against base")[1]
    (row,) = [line.split() for line in paired.splitlines() if line.startswith("torus-close")]
    assert row[:3] == ["torus-close", "auto", "double"]
    assert all(float(cell) > 0 for cell in row[3:6])
    assert "of 1 row changed by more than their own spread" in paired
    assert "Only in this run: torus-close march double" in paired


def test_json_is_the_run_as_it_is_saved_and_the_comparison(lenscl, small: Path) -> None:
    one = (*QUICK, "--method", "march", "--precision", "single", "--folder", small)
    saved = lenscl("bench", *one, "--save", "base", "--json")
    assert json.loads(saved.stdout) == json.loads((small / "base.json").read_text())
    document = json.loads(lenscl("bench", *one, "--compare", "base", "--json").stdout)
    (change,) = document["comparison"]["changes"]
    assert document["comparison"]["base"] == "base"
    assert (change["scene"], change["method"], change["precision"]) == ("torus-close", "march", "single")
    assert change["low"] <= change["ratio"] <= change["high"]
    assert change["is_same_kernel"] is True
    (measured,) = document["measurements"]
    assert change["error_high_pixels"]["after"] == measured["error"]["pixels"]["high"]


def test_another_driver_is_said_and_times_are_not_compared(lenscl, small: Path) -> None:
    one = (*QUICK, "--method", "auto", "--precision", "double", "--folder", small)
    lenscl("bench", *one, "--save", "base")
    path = small / "base.json"
    document = json.loads(path.read_text())
    document["measurements"][0]["circumstances"] |= {"driver": "an older one", "width": 3}
    path.write_text(json.dumps(document))
    result = lenscl("bench", *one, "--compare", "base")
    assert result.exit_code == 0
    paired = result.stdout.split("Against base")[1]
    assert "The times of all rows are not comparable: driver was an older one, is " in paired
    assert "width was 3, is " in paired
    assert "changed by more" not in paired
    (row,) = [line.split() for line in paired.splitlines() if line.startswith("torus-close")]
    assert row[3:8] == ["-", "-", "-", "not", "comparable"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--compare", "gone"), 'Error: --compare: no run is saved as "gone" in '),
        (("--save", "../x"), 'Error: "../x": is no name for a run'),
        (("--scene", "moon", "--method", "guess"), 'Error: --scene: "moon" is unknown; known are heart-close, torus-'),
        (("--scene", "heart", "--method", "polynomial"), "Error: heart-close: left out: numerics.method: "),
        (("--rounds", "2"), "is not in the range x>=3"),
        (("--precision", "half"), "'half' is not one of 'single', 'double', 'mixed'"),
    ],
)
def test_a_wrong_request_is_refused_before_anything_is_measured(
    lenscl, small: Path, arguments: tuple[str, ...], says: str
) -> None:
    result = lenscl("bench", *arguments, "--folder", small)
    assert result.exit_code == 2
    assert says in result.stderr
    assert "1 of " not in result.stderr
    assert result.stdout == ""


def test_both_wrong_names_are_told_at_once(lenscl, small: Path) -> None:
    result = lenscl("bench", "--scene", "moon", "--method", "guess", "--folder", small)
    assert [line.split('"')[1] for line in result.stderr.splitlines()] == ["moon", "guess"]


def test_a_name_that_is_taken_is_refused_before_a_minute_has_gone(lenscl, small: Path) -> None:
    small.mkdir()
    (small / "base.json").write_text("kept")
    result = lenscl("bench", *QUICK, "--save", "base", "--folder", small)
    assert result.exit_code == 2
    assert "is there already; --force replaces it" in result.stderr
    assert (small / "base.json").read_text() == "kept"
    one = ("--method", "auto", "--precision", "double")
    assert lenscl("bench", *QUICK, *one, "--save", "base", "--force", "--folder", small).exit_code == 0
    assert json.loads((small / "base.json").read_text())["form"] == 2


def test_what_cannot_be_measured_is_left_out_and_said(lenscl, small: Path) -> None:
    result = lenscl("bench", "--method", "polynomial", "--precision", "double", "--rounds", "3", "--folder", small)
    assert result.exit_code == 0
    assert result.stderr.startswith("heart-close: left out: numerics.method: ")
    assert [row[0] for row in table(result.stdout)[1:]] == ["torus-close"]


def test_without_a_device_it_is_exit_code_4(command, finish, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(os.environ, "LENSCL_DEVICE", "abacus")
    done = finish(command("bench", "--folder", tmp_path))
    assert done.returncode == 4
    assert "LENSCL_DEVICE=abacus names no device" in done.stderr
    assert "Traceback" not in done.stderr
