"""Rays where F ends within the bounds: what comes before that is proved, and what comes behind it is not."""

from __future__ import annotations

import pytest
from scenes import make_scene

from lenscl import RayStatus

pytest.importorskip("flint", reason="python-flint, of the extra `accuracy`, is not installed")

from lenscl.reference.oracle import Proof, prove_rays

# |sqrt(x + 0.2) - 0.5| = 0.3 on the axis at x = -0.16 and x = 0.44; F has no value below -0.2
SCENE = make_scene(
    {"surface": "abs(sqrt(x + 0.2) - 0.5) + y^2 + z^2 - 0.3", "bounds": [[-1.1] * 3, [1.1] * 3]},
    picture={"corner": [3.0, -4.0, 4.0], "right": [0.0, 8.0, 0.0], "down": [0.0, 0.0, -8.0]},
)


def proved(origin: list[float], direction: list[float]) -> Proof:
    return prove_rays(SCENE, [origin], [direction])[0]


def test_a_ray_is_followed_to_where_f_ends() -> None:
    proof = proved([0.1, 0.0, 0.0], [-1.0, 0.0, 0.0])
    assert (proof.status, proof.events) == (None, 1)  # it leaves the solid at x = -0.16, and F ends at -0.2
    assert proof.reason == "F has no value, or none that is finite, on the ray's way"


def test_a_ray_that_comes_from_where_f_has_no_value_is_not_decided() -> None:
    proof = proved([-3.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    assert (proof.status, proof.events) == (None, 0)
    assert "no value" in proof.reason


def test_a_ray_that_goes_the_other_way_is_decided() -> None:
    proof = proved([0.1, 0.0, 0.0], [1.0, 0.0, 0.0])
    assert (proof.status, proof.events) == (RayStatus.PICTURE, 1)
    assert proof.distance(0.5, 0.5) < 1e-15
