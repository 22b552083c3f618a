"""Convex quadrics are entered and left without a box: every ray against exact rational arithmetic.

The rays run along an axis, so neither their direction nor the way into local space rounds anything, and the lens has
the medium's index, so they go straight on: what is met, and where, follows from the given numbers alone.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import lenscl
from lenscl import RayStatus

SCENE = """
[source]
kind = "point"
at = [0, 0, -9]
[film]
centre = [0, 0, -8]
right = [1, 0, 0]
down = [0, 1, 0]
size = [1, 1]
[picture]
centre = [0, 0, 1e12]
right = [1, 0, 0]
down = [0, 1, 0]
[medium]
n = 1.0
[[lens]]
surface = "ellipsoid"
a = {0}
b = {1}
c = {2}
n = 1.0
"""
AXES = {"round": (1.0, 0.75, 0.5), "flat": (1.0, 0.75, 2.0**-9), "thin": (2.0**-9, 0.75, 1.0), "tiny": (2.0**-21,) * 3}
EPSILON = {"single": 2.0**-23, "double": 2.0**-52}
COUNT = 4000
TRACED_AGAIN = {
    "single": 0.65,
    "double": 0.2,
}  # shares; what is wrong at first is more, for the parity of events tells it

Array = NDArray[np.float64]


def rays(axes: tuple[float, float, float], precision: str, seed: int) -> tuple[Array, Array]:
    """Return origins and directions along z or against it: past, through, tangent and from inside, from near and far.

    Alike rays stand together: a packet with a ray that is not certain, or with both kinds, is searched in the box. A
    ray is certain as far as its depth is more than the rounding of F where it starts.
    """
    rng = np.random.default_rng(seed)
    a, b, c = axes
    depth = rng.choice([-1.0, 1.0], COUNT) * 10.0 ** rng.uniform(-16, 0, COUNT)
    radius, angle = np.sqrt(1 - depth), rng.uniform(0, 2 * np.pi, COUNT)
    x, y = a * radius * np.cos(angle), b * radius * np.sin(angle)
    within = rng.random(COUNT) < 0.25
    away = c * np.where(within, rng.uniform(-1, 1, COUNT), -(10.0 ** rng.uniform(0, 4, COUNT)))
    turned = rng.choice([-1.0, 1.0], COUNT)
    origins = np.stack([x, y, turned * away], axis=1)
    if precision == "single":
        origins = origins.astype(np.float32).astype(np.float64)
    order = np.lexsort([abs(depth) / (1 + (away / c) ** 2), within])
    return origins[order], np.stack([0 * x, 0 * x, turned], axis=1)[order]


def exact(axes: tuple[float, float, float], origin: Array, forward: float) -> tuple[int, float, float]:
    """Return the events of a ray, F where it is deepest, and F at its origin; all signs are exact."""
    a, b, c = (Fraction(value) for value in axes)
    x, y, z = (Fraction(float(value)) for value in origin)
    deepest = (x / a) ** 2 + (y / b) ** 2 - 1
    start = deepest + (z / c) ** 2
    if start <= 0:
        return 1, float(deepest), float(start)
    return (2 if deepest < 0 and z * Fraction(forward) < 0 else 0), float(deepest), float(start)


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("name", AXES)
def test_rays_meet_an_ellipsoid_as_often_as_exact_arithmetic_says(name: str, precision: Any) -> None:
    axes = AXES[name]
    scene = lenscl.scene_from_toml(SCENE.format(*axes)).replace({"numerics.precision": precision})
    origins, directions = rays(axes, precision, seed=5)
    paths = lenscl.trace_rays(scene, origins, directions)
    wanted = [exact(axes, o, d[2]) for o, d in zip(origins, directions, strict=True)]
    events, deepest, start = (np.array(column) for column in zip(*wanted, strict=True))
    decided = paths.status != RayStatus.UNDECIDED

    # Only what lies within rounding may be undecided: a touch, or a start on the surface
    slack = 64 * EPSILON["double"]  # what single leaves undecided is traced again in double
    assert (np.minimum(np.abs(deepest), np.abs(start))[~decided] < slack).all()
    assert decided.mean() > 0.9
    assert paths.escalated < TRACED_AGAIN[precision] * COUNT
    assert {int(count) for count in events[decided]} == {0, 1, 2}
    np.testing.assert_array_equal(paths.events[decided], events[decided])

    # Both ends of a chord are on the surface, on their own sides of the solid
    stopped = lenscl.trace_rays(scene.replace({"numerics.max_events": 1}), origins, directions)
    leaves, enters = decided & (events > 0), decided & (events == 2)
    assert (stopped.status[enters] == RayStatus.TRAPPED).all()
    for ends, chosen, side in ((paths, leaves, 1.0), (stopped, enters, -1.0)):
        on = (ends.origin[chosen] / np.array(axes)) ** 2
        np.testing.assert_allclose(on.sum(axis=1), 1.0, atol=24 * EPSILON[precision], rtol=0)
        assert (ends.origin[chosen, 2] * directions[chosen, 2] * side > 0).all()


def test_the_last_root_before_and_the_first_behind_the_origin_are_told_apart() -> None:
    """A ray that starts just outside, before or behind the solid: the roots lie on one side of it."""
    scene = lenscl.scene_from_toml(SCENE.format(1.0, 0.75, 0.5))
    gaps = 2.0 ** -np.arange(4.0, 44.0)
    for side, events in ((-1.0, 2), (1.0, 0)):
        origins = np.stack([0 * gaps, 0 * gaps, side * (0.5 + gaps)], axis=1)
        paths = lenscl.trace_rays(scene, origins, np.array([[0.0, 0.0, 1.0]] * len(gaps)))
        assert (paths.events == events).all()
