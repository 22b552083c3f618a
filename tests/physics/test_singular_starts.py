"""Rays that start on a surface where it has no normal: nobody can tell their side, so they are undecided."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from faults_in_kernels import Fault, broken
from probe import plain_device
from scenes import make_scene

from lenscl import RayStatus, trace_rays

CONE = {"surface": "max(sqrt(x^2 + y^2) + z - 1, -z - 1)", "bounds": [[-2.1] * 3, [2.1] * 3]}


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize(
    ("lens", "at"),
    [(CONE, (0.0, 0.0, 1.0)), ({"surface": "heart"}, (0.0, 0.0, 1.0)), ({"surface": "bifolia"}, (0.0, 0.0, 0.0))],
    ids=["tip of a cone", "dimple of the heart", "pinch of the bifolia"],
)
def test_a_ray_from_a_point_without_a_normal_is_undecided(
    lens: dict[str, Any], at: tuple[float, float, float], precision: str
) -> None:
    scene = make_scene(lens, numerics={"precision": precision})
    ahead = np.concatenate([np.random.default_rng(1).normal(size=(24, 3)), np.eye(3), -np.eye(3)])
    paths = trace_rays(scene, np.broadcast_to(at, ahead.shape), ahead)
    assert (paths.status == RayStatus.UNDECIDED).all()
    assert (paths.events == 0).all()
    beside = trace_rays(scene, np.broadcast_to(np.add(at, (0.0, 0.0, 1e-3)), ahead.shape), ahead)
    assert (beside.status != RayStatus.UNDECIDED).mean() > 0.9


@pytest.mark.parametrize(("name", "at"), [("heart", (0.0, 0.0, 1.0)), ("bifolia", (0.0, 0.0, 0.0))])
def test_the_march_does_not_guess_there_either(name: str, at: tuple[float, float, float]) -> None:
    """The other searches prove nothing there and would leave such rays open by themselves; a march would go on."""
    scene = make_scene({"surface": name}, numerics={"method": "march"})
    ahead = np.random.default_rng(1).normal(size=(24, 3))

    def undecided() -> float:
        paths = trace_rays(scene, np.broadcast_to(at, ahead.shape), ahead, device=plain_device())
        return float((paths.status == RayStatus.UNDECIDED).mean())

    assert undecided() == 1.0
    with broken(Fault("side guessed", "lens.cl", "end_ray(ray, lanes & not_lane(known), RAY_UNDECIDED);", "")):
        assert undecided() < 0.1


@pytest.mark.parametrize("precision", ["single", "double"])
def test_a_ray_from_a_pole_within_the_solid_is_never_taken_to_have_left_it(precision: str) -> None:
    """On the plane x = 0 the second branch of min has no value, and bounds about it hold 0 however near they are."""
    poles = {
        "surface": "max(x^2 + y^2 + z^2 - 1, min(x^2 + y^2 + (z - 0.2)^2 - 0.1, hypot(z, z) + 1 - x^-2))",
        "bounds": [[-1.1] * 3, [1.1] * 3],
        "n": 1.0,
    }
    scene = make_scene(poles, numerics={"precision": precision})
    random = np.random.default_rng(2)
    on_plane = random.uniform(-0.5, 0.5, (40, 3)) * [0.0, 1.0, 1.0]
    ahead = random.normal(size=(40, 3))
    paths = trace_rays(scene, on_plane, ahead)
    decided = paths.status != RayStatus.UNDECIDED
    assert (paths.events[decided] % 2 == 1).all()
    beside = trace_rays(scene, np.add(on_plane, (1e-6, 0.0, 0.0)), ahead)
    assert (beside.status != RayStatus.UNDECIDED).mean() > 0.9
    assert (beside.events[beside.status != RayStatus.UNDECIDED] % 2 == 1).all()
