"""What `lenscl explain` prints of a pixel, and what it refuses."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lenscl import accuracy, trace
from lenscl.accuracy import Combination
from lenscl.accuracy.path import explain_pixel
from lenscl.config import Scene, load_study

WIDTH = 100
TANGENT = """
source = { kind = "parallel", direction = [0.0, 0.0, -1.0] }
film = { centre = [0.75, 0.0, 2.5], right = [0.5, 0.0, 0.0], down = [0.0, -0.5, 0.0], size = [3, 3] }
picture = { centre = [0.0, 0.0, -2.5], right = [6.0, 0.0, 0.0], down = [0.0, -6.0, 0.0] }
[[lens]]
surface = "sphere"
r = 0.75
n = 1.5
"""
PIXELS = ((10, 12), (10, 20), (8, 16), (12, 16), (11, 19), (0, 0))


@pytest.fixture
def tangent(tmp_path: Path) -> Path:
    path = tmp_path / "tangent.toml"
    path.write_text(TANGENT)
    return path


def test_json_holds_the_path_and_the_text_its_figures(lenscl, study_path: Path) -> None:
    study = load_study(study_path)
    events = 0
    for row, column in PIXELS:
        pixel = ("explain", study_path, "--pixel", f"{row},{column}")
        found = json.loads(lenscl(*pixel, "--json").stdout)
        path = explain_pixel(study.scene, row, column, size=tuple(found["picture"]))
        assert found == json.loads(json.dumps(path.as_json()))
        text = lenscl(*pixel).stdout
        assert f"Pixel ({row}, {column}) of 20 rows and 32 columns" in text
        assert f"Ends {path.status.name.replace('_', ' ')} after {path.total} event" in text
        for event in path.events:
            events += 1
            (where,) = re.findall(rf"^ +{event.number}  +{event.kind}  +lens +(\S+) +(\S+) +(\S+) +(\S+)$", text, re.M)
            assert [float(part) for part in where] == pytest.approx([*event.point, event.leg], rel=1e-5, abs=1e-7)
            assert f"{event.incidence:.4f}" in text
            assert f"{event.allowed:.1e}" in text
        if path.st is not None:
            assert f"at (s, t) = ({path.st[0]:.16g}, {path.st[1]:.16g})" in text
            assert f"at most {path.error:.2g} in s and t" in text
        assert "proved" in text
    assert events > len(PIXELS)


def test_the_media_of_every_surface_and_all_solids_at_the_start_are_told(lenscl, tmp_path: Path) -> None:
    lenses = "".join(
        f'[[lens]]\nname = "{name}"\nsurface = "sphere"\nr = {r}\nn = {n}\n'
        for name, r, n in (("glass", 0.75, 1.5), ("bubble", 0.3, 1.0))
    )
    study = tmp_path / "bubble.toml"
    study.write_text(TANGENT.partition("[[lens]]")[0] + lenses)
    pixel = ("explain", study, "--pixel", "1,1", "--set", "film.centre=[0.1, 0, 2.5]")
    text = lenscl(*pixel).stdout
    media = text.partition("Media:")[2].partition("Bends:")[0]
    found = [tuple(line.split()) for line in media.splitlines()[2:] if line]
    assert found == [
        ("1", "around", "1", "lens.glass", "1.5"),
        ("2", "lens.glass", "1.5", "lens.bubble", "1"),
        ("3", "lens.bubble", "1", "lens.glass", "1.5"),
        ("4", "lens.glass", "1.5", "around", "1"),
    ]
    assert max(map(len, text.splitlines())) <= WIDTH
    source = ("--set", 'source.kind="point"', "--set", "source.at=[0, 0, 0.1]", "--set", "film.centre=[0, 0, -1]")
    inside = " ".join(lenscl("explain", study, "--pixel", "1,1", *source).stdout.split())
    assert "inside lens.glass and lens.bubble, in the medium of lens.bubble" in inside


def test_the_text_keeps_within_a_hundred_columns(lenscl, study_path: Path, tangent: Path) -> None:
    dense = ("--set", "lens.n=2.417")
    many = [(study_path, row, column, dense) for row, column in PIXELS]
    lines = 0
    for study, row, column, more in [*many, (tangent, 1, 1, ()), (tangent, 1, 0, ("--set", "medium.n=2.5"))]:
        for line in lenscl("explain", study, "--pixel", f"{row},{column}", *more).stdout.splitlines():
            assert len(line) <= WIDTH, line
            lines += 1
    assert lines > 100


def test_a_long_path_shows_its_beginning_and_its_end(lenscl, study_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    events = trace(load_study(study_path).scene.replace({"lens.n": 2.417})).events
    row, column = (int(each) for each in np.unravel_index(events.argmax(), events.shape))
    pixel = ("explain", study_path, "--pixel", f"{row},{column}", "--set", "lens.n=2.417")
    assert "left out" not in lenscl(*pixel).stdout
    monkeypatch.setattr(sys.modules["lenscl.cli.explain"], "_MOST_EVENTS", 2)
    total = int(events.max())
    assert total > 2
    text = lenscl(*pixel).stdout
    assert f"({total - 2} events between are left out; --json has all)" in text
    shown = re.findall(r"^ +(\d+)  (?:entry|exit|total)", text, re.M)
    assert [int(number) for number in shown] == [1, total]


def test_each_end_says_what_there_is_to_say_of_it(lenscl, study_path: Path, tangent: Path) -> None:
    def text(study: Path, pixel: str, *settings: str) -> str:
        given = [word for setting in settings for word in ("--set", setting)]
        result = lenscl("explain", study, "--pixel", pixel, *given)
        assert result.exit_code == 0
        return " ".join(result.stdout.split())

    assert "it meets no lens" in text(study_path, "0,0")
    undecided = text(tangent, "1,1")
    assert "Ends UNDECIDED after 0 events the search cannot prove what the ray meets next" in undecided
    assert "nobody can tell: the ray touches the surface" in undecided
    assert "in twice the precision of double" in text(tangent, "1,1", "film.centre=[0.74999999999999,0,2.5]")
    single = text(tangent, "1,1", "film.centre=[0.74999999,0,2.5]", "numerics.precision=single")
    assert "in double precision" in single
    assert "single precision leaves this ray undecided" in single
    assert "Ends TRAPPED after 1 event numerics.max_events lets it" in text(
        study_path, "10,12", "numerics.max_events=1"
    )
    ends = text(tangent, "1,0", "medium.n=2.5", "effects.total_reflection=end")
    assert "Ends TOTAL REFLECTION after 1 event" in ends
    assert "the pixel lies on the source" in text(
        study_path, "1,1", "film.centre=[0,0,4]", "film.size=[3,3]", "source.at=[0,0,4]"
    )
    paraxial = text(study_path, "10,12", "numerics.snell=paraxial")
    assert "bent by the paraxial rule" in paraxial
    assert "bent by the exact law, is at most" in paraxial or "NOT what was traced" in paraxial


def test_without_python_flint_one_line_says_so(lenscl, study_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "flint", None)
    text = lenscl("explain", study_path, "--pixel", "10,12").stdout
    assert [line for line in text.splitlines() if line.startswith("  proved ")] == [
        "  proved   nothing: certified answers need python-flint, which is not installed: pip install"
    ]
    assert text.split()[-1] == "'lenscl[accuracy]'"


def test_a_study_that_asks_for_an_accuracy_is_planned_first(
    lenscl, study_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chosen = Combination(method="march", precision="single", step=0.01)
    asked: list[tuple[object, object]] = []

    class Plans:
        def plan(self, scene: Scene, size: tuple[int, int]) -> SimpleNamespace:
            asked.append((str(scene.numerics.accuracy), size))
            return SimpleNamespace(achieved="as wished", combination=chosen)

    monkeypatch.setattr(accuracy, "planner_of", Plans)
    pixel = ("explain", study_path, "--pixel", "10,12", "--json")
    planned = lenscl(*pixel, "--set", "numerics.accuracy=0.5 px")
    by_hand = lenscl(*pixel, "--set", "numerics.method=march", "--set", "numerics.precision=single")
    found = json.loads(planned.stdout)
    assert planned.stderr == "accuracy: as wished\n"
    assert asked == [("0.5 px", tuple(found["picture"]))]
    assert found == json.loads(by_hand.stdout)
    assert (found["asked"], found["searches"]) == ("single", ["march"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--pixel", "3"), "Error: --pixel: must be ROW,COL, two whole numbers from 0 such as 250,170, got '3'\n"),
        (
            ("--pixel", "1,2,3"),
            "Error: --pixel: must be ROW,COL, two whole numbers from 0 such as 250,170, got '1,2,3'\n",
        ),
        (
            ("--pixel", "1.5,2"),
            "Error: --pixel: must be ROW,COL, two whole numbers from 0 such as 250,170, got '1.5,2'\n",
        ),
        (
            ("--pixel", "20,0"),
            "Error: pixel (20, 0) is not on the film, which has 20 rows and 32 columns (film.size); rows are 0 to 19, "
            "columns 0 to 31\n",
        ),
        (
            ("--pixel", "0,-1"),
            "Error: pixel (0, -1) is not on the film, which has 20 rows and 32 columns (film.size); rows are 0 to 19, "
            "columns 0 to 31\n",
        ),
    ],
)
def test_a_pixel_that_is_none_is_refused(lenscl, study_path: Path, arguments: tuple[str, ...], message: str) -> None:
    result = lenscl("explain", study_path, *arguments)
    assert (result.exit_code, result.stderr, result.stdout) == (2, message, "")


def test_the_help_says_what_it_does_with_a_pixel_and_without(lenscl) -> None:
    text = " ".join(lenscl("explain", "--help").stdout.split())
    assert "Without --pixel it prints a table" in text
    assert "With --pixel it prints the path" in text


def test_effects_have_a_table_of_their_own(lenscl, study_path: Path) -> None:
    asked = ("--set", "effects.fresnel=true", "--set", "effects.footprint=true")
    text = lenscl("explain", study_path, "--pixel", "8,8", *asked).stdout
    table = text.split("Effects: what they have made of the ray behind each surface, and in the map\n")[1]
    head, *rows = table.split("\n\n")[0].splitlines()
    assert head.split() == ["transmittance", "s_by_row", "s_by_column", "t_by_row", "t_by_column"]
    assert [len(row.split()) for row in rows] == [2] * (len(rows) - 1) + [6]
    assert rows[-1].startswith("map")
    assert "Effects:" not in lenscl("explain", study_path, "--pixel", "8,8").stdout
    all_of_them = lenscl("explain", study_path, "--pixel", "8,8", *asked, "--set", "effects.fresnel=polarised",
                         "--set", "effects.absorption=true", "--set", "effects.path_length=true").stdout  # fmt: skip
    assert max(map(len, all_of_them.splitlines())) <= 100
    assert "path_length" in all_of_them
