from __future__ import annotations

from dataclasses import replace

import pytest

from lenscl.accuracy.bench import plan_rows, scene_files
from lenscl.device import choose
from lenscl.errors import StudyError

LENSES = ("bifolia", "ellipsoid", "heart", "torus")


def names(rows) -> set[str]:
    return {str(row) for row in rows}


def test_the_scenes_are_those_of_the_design() -> None:
    assert list(scene_files()) == [f"{lens}-{view}" for lens in LENSES for view in ("close", "wide")]


def test_the_usual_rows_are_close_auto_and_march_in_both_precisions() -> None:
    rows, left_out = plan_rows([], [], [], choose())
    expected = {f"{lens}-close {m} {p}" for lens in LENSES for m in ("auto", "march") for p in ("single", "double")}
    assert names(rows) == expected
    assert len(rows) == len(expected)
    assert left_out == []


def test_a_scene_is_named_whole_or_by_a_part_and_measured_once() -> None:
    rows, _ = plan_rows(["torus", "torus-wide", "wide"], ["march", "march"], ["single", "single"], choose())
    assert [str(row) for row in rows] == [
        f"{name} march single" for name in ("torus-close", "torus-wide", "bifolia-wide", "ellipsoid-wide", "heart-wide")
    ]
    assert rows[0].scene.lenses[0].surface.name == "torus"
    assert rows[0].scene.film.size == (1024, 1024)


def test_every_wrong_name_is_told_with_those_known() -> None:
    with pytest.raises(StudyError) as refused:
        plan_rows(["tor", "", "torus"], ["auto", "guess"], [], choose())
    problems = refused.value.problems
    assert [problem.split(" is unknown")[0] for problem in problems] == [
        '--scene: "tor"',
        '--scene: ""',
        '--method: "guess"',
    ]
    assert "torus-close" in problems[0]
    assert "march" in problems[2]


def test_what_a_method_cannot_search_is_left_out_and_said() -> None:
    rows, left_out = plan_rows(["heart-close", "torus-close"], ["polynomial"], ["double"], choose())
    assert names(rows) == {"torus-close polynomial double"}
    assert [reason.split(":")[0] for reason in left_out] == ["heart-close"]
    with pytest.raises(StudyError, match="heart-close: left out: "):
        plan_rows(["heart"], ["polynomial"], ["double"], choose())


def test_without_double_only_single_is_usual() -> None:
    rows, _ = plan_rows(["torus"], ["auto"], [], replace(choose(), has_double=False))
    assert {row.precision for row in rows} == {"single"}
