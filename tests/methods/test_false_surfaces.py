"""No surface where there is none, and none lost, of solids that join what is known of one part with what is not."""

from __future__ import annotations

from collections import Counter
from typing import Any

import fuzz_trees
import numpy as np
import pytest
from methods.searches import box_rays
from numpy.typing import NDArray
from probe import plain_device
from scenes import make_scene

import lenscl
from lenscl import RayStatus

Array = NDArray[Any]
PRECISIONS = ("double", "single", "mixed")
CUBE = [[-1.1, -1.1, -1.1], [1.1, 1.1, 1.1]]
BALL, RING = "x**2 + y**2 + z**2 - 0.1", "sqrt((sqrt(x**2 + y**2) - 0.7)**2 + z**2) - 0.1"
VIEW = {
    "film": {"corner": [-0.45, 0.45, 2.5], "right": [0.9, 0.0, 0.0], "down": [0.0, -0.9, 0.0], "size": [96, 96]},
    "numerics": {"max_events": 32},
}
NO_SOLID = (  # F is 0.04 and more
    "max(x**2 + y**2 + z**2 - 1, sqrt(0.3 + (cos(4.54*x))**2) - 0.10)",
    "max(sqrt(0.3 + (cos(4.54*x))**2) - 0.10, x**2 + y**2 + z**2 - 1)",
    "max(x**2 + y**2 + z**2 - 1, 0.04 + sqrt(z**2 + (x - cbrt(y))**2))",
    "max(x**2 + y**2 + z**2 - 1, 1.1 - tanh(exp(9/(x**2 + 0.01))))",
    "max(x**2 + y**2 + z**2 - 1, exp(tanh(y*exp(1/(x**2 + y**2 + 0.001)))) - 0.3)",
    "max(x**2 + y**2 + z**2 - 1, 0.1 + (1 + sin(3*x)*y)**0.5)",
)


@pytest.fixture(scope="module")
def apart() -> lenscl.RayMap:
    """The ball and the ring, two lenses of the catalogue that do not touch."""
    lenses = (
        {"name": "ball", "surface": "sphere", "r": 0.1**0.5},
        {"name": "ring", "surface": "torus", "R": 0.7, "r": 0.1},
    )
    return lenscl.trace(make_scene(*lenses, **VIEW), precision="double")


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("joined", [f"min({BALL}, {RING})", f"min({RING}, {BALL})"])
def test_two_solids_in_one_are_the_two(joined: str, precision: str, apart: lenscl.RayMap) -> None:
    raymap = lenscl.trace(make_scene({"surface": joined, "bounds": CUBE}, **VIEW), precision=precision)
    counts = raymap.counts()
    assert (apart.counts()[RayStatus.PICTURE], apart.counts()[RayStatus.OFF_PICTURE]) == (8984, 232)
    assert counts[RayStatus.UNDECIDED] == 0
    if precision == "double":
        np.testing.assert_array_equal(raymap.status, apart.status)
        np.testing.assert_array_equal(raymap.events, apart.events)
    alike = (raymap.status == apart.status) & (apart.status == RayStatus.PICTURE)
    off = np.abs(raymap.st - apart.st)[alike]
    assert alike.sum() > 8900
    assert np.quantile(off, 0.999) < {"double": 1e-11, "mixed": 1e-11, "single": 2e-3}[precision]
    assert (raymap.events == apart.events).mean() > 0.999
    assert (raymap.events > 0).sum() > 1900


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("text", NO_SOLID)
def test_what_is_no_solid_has_no_surface(text: str, precision: str) -> None:
    o, d, _ = box_rays(((-0.9,) * 3, (0.9,) * 3), 1500, 4)
    paths = lenscl.trace_rays(make_scene({"surface": text, "bounds": CUBE}), o - d, d, precision=precision)
    assert not paths.events.any()
    overflows = "exp" in text  # for every other ray on the way, and what that makes of tanh is not known
    assert (paths.status == RayStatus.UNDECIDED).mean() < (0.55 if overflows else 0.002)


STARTS = ((0.0, 0.0, 0.5), (0.0, 0.0, -0.5), (0.0, 0.0, 0.9), (0.0, 0.0, 0.1))
AT_A_POLE = {  # where every start lies on a line on which a part is infinite; whether it is inside
    "max(-z, z - 0.3 + 0.03*log(x**2 + y**2), x**2 + y**2 - 1, z - 0.75)": (True, False, False, True),
    "max(x**2 + y**2 + z**2 - 1, log(x**2 + y**2))": (True,) * 4,
    "max(x**2 + y**2 + z**2 - 1, 0.04/(x**2 + y**2) - 1)": (False,) * 4,
    "max(x**2 + y**2 + z**2 - 1, min(z - 0.2, log(x**2 + y**2)))": (True,) * 4,
    "max(x**2 + y**2 + z**2 - 1, min(z - 0.2, 5 - 1/(x**2 + y**2)))": (True,) * 4,
}


def test_a_start_of_which_little_is_known_is_not_taken_to_be_on_the_surface() -> None:
    directions = np.array([[1.0, 0.1, 0.2], [1.0, 0.1, 0.9], [1.0, 0.1, -0.9], [-0.3, 1.0, 0.05]])
    decided = 0
    for text, inside in AT_A_POLE.items():
        scene = make_scene({"surface": text, "bounds": CUBE, "n": 1.0})
        paths = lenscl.trace_rays(scene, np.repeat(STARTS, 4, axis=0), np.tile(directions, (4, 1)))
        known = paths.status != RayStatus.UNDECIDED
        assert (paths.events[known] % 2 == np.repeat(inside, 4)[known]).all(), text
        decided += int(known.sum())
    assert decided > 10


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("text", ["log(x + 0.2) + 0.6", "1/sqrt(x + 0.2) - 3 + z", "tanh(log(x + 0.2)) + 0.5"])
def test_no_ray_that_starts_where_f_has_no_value_is_decided(text: str, precision: str) -> None:
    """Though the slope of a logarithm has one there."""
    rng = np.random.default_rng(0)
    starts = rng.uniform(-0.5, 0.5, (600, 3))
    scene = make_scene({"surface": f"max(x**2 + y**2 + z**2 - 0.8, {text})", "bounds": CUBE})
    paths = lenscl.trace_rays(scene, starts, rng.normal(size=(600, 3)), precision=precision)
    is_decided = paths.status != RayStatus.UNDECIDED
    without = starts[:, 0] < -0.2
    assert without.sum() > 100
    assert not is_decided[without].any()
    assert is_decided[~without].sum() > 100


def test_random_trees_are_never_decided_and_wrong() -> None:
    """A few of the trees of bench/fuzz_trees.py, each in another precision."""
    counts, here = Counter[str](), plain_device()
    for number in range(24):
        found, wrong, text = fuzz_trees.one(number, 3, 20, [PRECISIONS[number % 3]], here)
        assert not wrong, (text, wrong)
        counts.update(found)
    decided = sum(counts[f"{precision}: decided"] for precision in PRECISIONS)
    assert counts["trees"] > 14
    assert decided > 150
    assert counts["bounds"] > 20_000
    assert counts["values"] > 100
    assert counts["derivatives"] > 300
