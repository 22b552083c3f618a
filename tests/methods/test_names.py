"""A user's parameters may be called as our own symbols are; numbers may be larger than their squares can be."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import make_scene

import lenscl

BOX = [[-1.1] * 3, [1.1] * 3]
NAMES = ("ox", "dz", "part_0", "part_0_slope", "origin_x", "drift_y", "reach", "along", "error")
TERMS = ("1", "x**2", "y**2", "z**2", "x*y", "y*z", "x*z", "x", "z")  # all unlike: none may stand for another


@pytest.mark.parametrize("method", ["polynomial", "interval"])
def test_a_parameter_may_have_any_name(method: str) -> None:
    def of(names: tuple[str, ...]) -> lenscl.RayMap:
        form = " + ".join(f"{name} * {term}" for name, term in zip(names, TERMS, strict=True))
        values = {name: 0.2 + k / 64 for k, name in enumerate(names)}
        lens = {"surface": f"x**4 + y**4 + z**4 - 0.6 * ({form})", **values, "bounds": BOX}
        return lenscl.trace(make_scene(lens), method=method)

    ours, plain = of(NAMES), of(tuple(f"k{number}" for number in range(len(NAMES))))
    assert (plain.events > 0).sum() > 100
    np.testing.assert_array_equal(ours.events, plain.events)
    np.testing.assert_allclose(ours.st, plain.st, atol=1e-9)  # sums are in the order of their names


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
