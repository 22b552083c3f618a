"""Blocked rays: where they end and with which direction is held against the ray and the surface."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from lenscl import RayStatus
from lenscl.config import scene_from_toml
from lenscl.hardcases import Case
from lenscl.hardcases.blocked import misplaced

SCENE = """
[source]
at = [0.0, 0.0, 4.0]
[film]
corner = [-1.0, 1.0, 2.0]
right = [2.0, 0.0, 0.0]
down = [0.0, -2.0, 0.0]
size = [2, 2]
[picture]
corner = [-4.0, 4.0, -3.0]
right = [8.0, 0.0, 0.0]
down = [0.0, -8.0, 0.0]
[[lens]]
name = "clear"
surface = "sphere"
n = 1.5
r = 0.5
centre = [0.0, 0.0, 2.0]
[[lens]]
name = "dark"
surface = "sphere"
n = 1.5
centre = [0.0, 0.0, -1.0]
stretch = [1.0, 2.0, 0.5]
absorbs = true
"""
TOP, DOWN = [0.0, 0.0, -0.5], [0.0, 0.0, -1.0]  # of the dark lens, and how the ray goes


def said(origin: list[float], direction: list[float], events: int = 1, level: str = "double") -> list[str]:
    status = np.array([RayStatus.PICTURE, RayStatus.BLOCKED], np.uint8)  # of the first nothing is asked
    ends = SimpleNamespace(
        status=status,
        events=np.array([0, events], np.uint8),
        origin=np.array([[9.0, 9.0, 9.0], origin]),
        direction=np.array([DOWN, direction]),
    )
    rays = {"origins": np.array([[9.0, 9.0, 9.0], [0.0, 0.0, 4.0]]), "directions": np.array([DOWN, [0.0, 0.0, -3.0]])}
    case = Case(name="one", family="of this test", why="to try it", scene=SCENE, **rays)
    return [str(each) for each in misplaced(case, scene_from_toml(SCENE), cast("Any", ends), cast("Any", level))]


def test_a_ray_that_ends_on_the_opaque_surface_as_it_came_is_right() -> None:
    assert said(TOP, DOWN) == []
    assert said([0.0, 0.0, -0.5 + 1e-12], DOWN) == []
    assert said([0.0, 0.0, -0.5 + 1e-5], DOWN, level="single") == []


@pytest.mark.parametrize("origin", [[0.0, 0.0, -0.5 + 1e-7], [0.0, 0.0, 2.5], [0.0, 0.0, -1.0]])
def test_a_ray_that_ends_elsewhere_is_wrong(origin: list[float]) -> None:
    told = said(origin, DOWN)  # beside it, on the clear lens, in the middle, where F has no slope
    assert [each.startswith("ray 1: is blocked ") for each in told] == [True]
    assert told[0].endswith(" beside every opaque surface")


@pytest.mark.parametrize(("direction", "events"), [([0.0, 0.0, -1.5], 1), ([0.0, 0.0, -1.5], 3), ([0.6, 0.0, -0.8], 1)])
def test_a_direction_that_is_not_unit_or_not_the_rays_own_is_wrong(direction: list[float], events: int) -> None:
    assert ["its direction is" in each for each in said(TOP, direction, events)] == [True]


def test_a_ray_that_was_bent_before_has_any_unit_direction() -> None:
    assert said(TOP, [0.6, 0.0, -0.8], events=3) == []
