"""What a map counts along rays is held against how far they travel in each medium."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from lenscl.config import scene_from_toml
from lenscl.hardcases import Answers, Case, Expected, Moved
from lenscl.hardcases.counted import miscounted

SCENE = """
[source]
at = [0.0, 0.0, 4.0]
[film]
corner = [-1.0, 1.0, 2.0]
right = [2.0, 0.0, 0.0]
down = [0.0, -2.0, 0.0]
size = [2, 1]
[picture]
corner = [-4.0, 4.0, -3.0]
right = [8.0, 0.0, 0.0]
down = [0.0, -8.0, 0.0]
[[lens]]
name = "clear"
surface = "sphere"
n = 1.5
[[lens]]
name = "dyed"
surface = "sphere"
n = 2.0
r = 0.5
absorption = [1.0, 2.0, 0.0]
"""
LENGTHS = np.array([[1.0, 0.5, 2.0], [0.0, 0.0, 3.0]])  # in either lens, and around both
PATH = np.array([4.5, 3.0])
DEEPER = np.exp([[-1.0, -2.0, 0.0], [0.0, 0.0, 0.0]])
LEFT = np.exp([[-0.5, -1.0, 0.0], [0.0, 0.0, 0.0]])


def said(path: Any = PATH, left: Any = LEFT, *, events: int = 4, level: str = "double", **more: Any) -> list[str]:
    ways = {"status": np.zeros(2, np.uint8), "st": np.full((2, 2), 0.5)}
    exact = Answers(events=np.array([4, 0], np.uint8), **ways)
    nothing = Answers(events=np.zeros(0, np.uint8), status=np.zeros(0, np.uint8), st=np.zeros((0, 2)))
    moved = Moved(
        spread=np.zeros(2), is_stable=np.array([True, True]), beside=nothing, ray=np.zeros(0, np.int32),
        length_spread=np.full((2, 3), 1e-15 if level == "double" else 1e-6),
    )  # fmt: skip
    expected = Expected(answers=exact, moved={"double": moved, "single": moved}, lengths=LENGTHS)
    added = {"path_length": np.asarray(path)[None], "transmission": np.asarray(left)[None]}
    ends = SimpleNamespace(events=np.array([[events, 0]], np.uint8), added=added, **ways)
    case = Case(name="one", family="of this test", why="to try it", scene=SCENE, **({"counts_lengths": True} | more))
    return [
        str(each) for each in miscounted(case, scene_from_toml(SCENE), expected, cast("Any", ends), cast("Any", level))
    ]


def test_what_is_counted_medium_by_medium_is_right() -> None:
    assert said() == []
    assert said(PATH * (1 + 1e-15), LEFT * (1 - 1e-15)) == []
    assert said(PATH * (1 + 1e-6), LEFT * (1 - 1e-6), level="single") == []


@pytest.mark.parametrize(
    ("path", "left", "what"),
    [
        (PATH + np.array([0.5, 0.0]), LEFT, "path length is 5; it must be 4.5"),
        (PATH - [0.0, 1e-12], LEFT, "path length is 3; it must be 3"),
        (PATH, DEEPER, "transmission of red light is 0.367879441; it must be 0.606"),
        (PATH, LEFT * [[1, 1, 0.9], [1, 1, 1]], "transmission of blue light is 0.9; it must be 1"),
        (PATH * [np.nan, 1.0], LEFT, "path length is nan"),
    ],
)  # fmt: skip
def test_what_is_counted_in_another_medium_is_wrong(path: Any, left: Any, what: str) -> None:
    (found,) = said(path, left)
    assert what in found
    way = "1 in lens.clear and 0.5 in lens.dyed and 2 in the medium around" if "ray 0" in found else "3 in the medium"
    assert way in found


def test_rays_that_end_otherwise_and_cases_that_count_nothing_are_not_held() -> None:
    assert said(PATH + np.array([1.0, 0.0]), events=5) == []
    assert said(PATH + 1.0, counts_lengths=False) == []
