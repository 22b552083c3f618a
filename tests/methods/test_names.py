"""A user's parameters may be called as our own symbols are; numbers may be larger than their squares can be."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import make_scene

import lenscl

BOX = [[-1.1] * 3, [1.1] * 3]


@pytest.mark.parametrize("method", ["polynomial", "interval"])
@pytest.mark.parametrize(
    "name", ["ox", "dz", "part_0", "part_0_slope", "origin_x", "drift_y", "reach", "along", "error"]
)
def test_a_parameter_may_have_any_name(name: str, method: str) -> None:
    def of(parameter: str) -> lenscl.RayMap:
        form = f"x**4 + y**4 + z**4 - {parameter} * (x**2 + 1)"
        lens = {"surface": form, parameter: 0.3, "bounds": BOX}
        return lenscl.trace(make_scene(lens), method=method)

    ours, plain = of(name), of("k")
    assert (plain.events > 0).sum() > 100
    np.testing.assert_array_equal(ours.st, plain.st)


@pytest.mark.parametrize("precision", ["single", "mixed"])
def test_bounds_whose_squares_overflow_prove_nothing(precision: str) -> None:
    lens = {"surface": "max(exp(exp(3*x)) - 5 + y, x**2 + y**2 + z**2 - 1.05)", "bounds": BOX, "n": 1.0}
    rng = np.random.default_rng(3)
    d = rng.normal(size=(5000, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    o = rng.uniform(-1.1, 1.1, (5000, 3)) - 4 * d
    want, got = (lenscl.trace_rays(make_scene(lens), o, d, precision=each) for each in ("double", precision))
    assert (want.events == 2).sum() > 1000
    assert (got.events != want.events).sum() <= 5  # rays that single moves across an edge
