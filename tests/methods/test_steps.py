"""Steps of searches: counted where they can be known beforehand, and only by kernels that were asked to."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scenes import make_scene

from lenscl import trace
from lenscl.tracing import count_steps
from lenscl.tracing.job import Job

RADIUS, STEP = 0.5, 0.01
SPHERE = {"surface": "sphere", "r": RADIUS}
AXIS = {"size": [1, 1], "centre": [0.0, 0.0, 2.5], "right": [1e-9, 0.0, 0.0], "down": [0.0, -1e-9, 0.0]}


@pytest.mark.parametrize("precision", ["single", "double", "mixed"])
def test_a_closed_form_takes_one_step_a_search(precision: str) -> None:
    scene = make_scene(SPHERE, film={"size": [37, 23]})
    counted = count_steps(scene, method="polynomial", precision=precision)
    assert counted.steps == counted.searches
    events = trace(scene, precision=precision).events
    assert counted.searches >= events.sum() > 100  # and a search for those that only meet the box
    assert counted.searches <= events.sum() + (events == 0).sum()


@pytest.mark.parametrize("precision", ["single", "double"])
def test_a_march_looks_once_a_step_of_its_way(precision: str) -> None:
    counted = count_steps(make_scene(SPHERE, film=AXIS), method="march", precision=precision)
    assert counted.searches == 2  # into the ball and out of it; no ray meets a ball again
    inside = 2 * RADIUS / STEP
    assert inside + 1 <= counted.steps <= inside + 16  # the box is a step away, and Newton polishes two roots


def test_a_shorter_step_takes_more() -> None:
    scene = make_scene(SPHERE, film=AXIS)
    fine, coarse = (count_steps(scene.replace({"numerics.step": step}), method="march").steps for step in (1e-3, 1e-2))
    assert math.isclose(fine, 10 * coarse, rel_tol=0.1)


@pytest.mark.parametrize("method", ["polynomial", "guarded", "interval", "march"])
def test_every_method_counts_and_counting_changes_nothing(method: str) -> None:
    scene = make_scene({"surface": "torus", "R": 0.7, "r": 0.25}, film={"size": [64, 48]}).replace(
        {"numerics.method": method}
    )
    raymap, counted = trace(scene), count_steps(scene)
    assert counted == count_steps(scene)
    assert counted.searches >= raymap.events.sum() > 1000
    assert counted.mean > 1
    assert "counts" not in raymap.kernel.text
    counting = Job.prepare(scene, "point", "map", None, None, None, counts=True)
    ends = counting.run_film()
    assert "counts" in counting.source.text
    assert counting.steps == counted.steps
    np.testing.assert_array_equal(ends["st"].reshape(raymap.st.shape), raymap.st)
    np.testing.assert_array_equal(ends["events"].reshape(raymap.events.shape), raymap.events)


def test_no_search_has_no_mean() -> None:
    beside = AXIS | {"centre": [5.0, 0.0, 2.5]}
    counted = count_steps(make_scene({"surface": "torus"}, film=beside))  # passes the box, within which it is searched
    assert (counted.searches, counted.steps, counted.mean) == (0, 0, 0.0)
