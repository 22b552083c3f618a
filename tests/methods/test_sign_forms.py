"""Surfaces that are F in other words end where F does, with as many steps, and nothing undecided that F decides."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from sampled import compared, field, film_rays
from scenes import make_scene

import lenscl
from lenscl import RayStatus
from lenscl.config import Scene
from lenscl.tracing import count_steps

BOUNDS = [[-1.1] * 3, [1.1] * 3]
NEAR = {"right": [0.8, 0.0, 0.0], "down": [0.0, -0.8, 0.0]}  # so that lenses fill it
FILM = {"size": [25, 25]} | NEAR
QUARTIC = "x^4 + y^4 + z^4 - 0.5"
GOURSAT = "x^4 + y^4 + z^4 - (x^2 + y^2 + z^2) + 0.4"
# In other words, and F
SAME = {
    f"tanh(5*({QUARTIC}))": QUARTIC,
    f"exp({QUARTIC}) - 1": QUARTIC,
    f"({QUARTIC})**3": QUARTIC,
    f"cbrt({QUARTIC})": QUARTIC,
    f"exp(cbrt({QUARTIC})) - 1": QUARTIC,
    f"log(1 + {QUARTIC})": QUARTIC,
    f"({QUARTIC})/(1 + x^2 + y^2)": QUARTIC,
    f"sqrt({QUARTIC} + 0.5) - sqrt(0.5)": QUARTIC,
    f"2*tanh({GOURSAT})**5": GOURSAT,
    f"({QUARTIC})*abs({QUARTIC})": QUARTIC,
    f"max(cbrt({QUARTIC}), (z - 0.2)**3)": f"max({QUARTIC}, z - 0.2)",
    "(x^2 + y^2 + z^2 - 0.5)**3": "x^2 + y^2 + z^2 - 0.5",
    "sqrt(x^2 + y^2 + z^2) - 0.5": "x^2 + y^2 + z^2 - 0.25",
    "hypot(hypot(x, y), z) - 0.5": "x^2 + y^2 + z^2 - 0.25",
}
PRECISION = dict(zip(SAME, ("double", "single", "mixed", "double", "double", "mixed", "single") * 2, strict=False))


def scene_of(text: str, film: Any = FILM, precision: str = "double", **numbers: float) -> Scene:
    table = {"surface": text, "bounds": BOUNDS, **numbers}
    return make_scene(table, film=film, numerics={"precision": precision})


def assert_alike(scene: Scene, other: Scene, precision: str) -> int:
    found, known = lenscl.trace(scene), lenscl.trace(other)
    np.testing.assert_array_equal(found.status, known.status)
    np.testing.assert_array_equal(found.events, known.events)
    assert found.counts()[RayStatus.UNDECIDED] == 0
    near = np.abs(known.st) < 10.0
    np.testing.assert_allclose(found.st[near], known.st[near], atol=1e-3 if precision == "single" else 1e-8)
    return int((found.events > 0).sum())


@pytest.mark.parametrize("text", SAME)
def test_f_in_other_words_is_traced_as_f(text: str) -> None:
    scene, other = (scene_of(each, precision=PRECISION[text]) for each in (text, SAME[text]))
    assert assert_alike(scene, other, PRECISION[text]) > 100
    steps, known = count_steps(scene), count_steps(other)
    assert steps.searches == known.searches
    assert steps.steps <= 1.1 * known.steps
    assert scene.lenses[0].formula == text  # as it was written


@pytest.mark.parametrize(
    ("text", "precision"),
    [
        ("hypot(hypot(x, y) - R, z) - r", "double"),
        ("sqrt((sqrt(x^2 + y^2) - R)^2 + z^2) - r", "single"),
        ("(hypot(x, y) - R)^2 + z^2 - r^2", "mixed"),
    ],
)
def test_a_torus_in_other_words_is_the_torus(text: str, precision: str) -> None:
    rays = 0
    for R, r in ((0.7, 0.25), (0.3, 0.45)):  # a ring, and a spindle, which has an inner sheet as a quartic
        written = text.replace("R", str(R)).replace("- r", f"- {r}")
        torus = make_scene({"surface": "torus", "R": R, "r": r}, film=FILM, numerics={"precision": precision})
        for scene in (scene_of(written, precision=precision), scene_of(text, precision=precision, R=R, r=r)):
            found, known = lenscl.trace(scene), lenscl.trace(torus)
            told = (found.status != RayStatus.UNDECIDED) & (known.status != RayStatus.UNDECIDED)
            assert (~told).sum() <= 1  # on the axis of a spindle, where it has points
            np.testing.assert_array_equal(found.events[told], known.events[told])
            near = told & (np.abs(known.st) < 10.0).all(axis=-1)
            np.testing.assert_allclose(found.st[near], known.st[near], atol=1e-2 if precision == "single" else 1e-8)
            rays += int((found.events > 0).sum())
        if r < R:
            ring = scene_of(text, precision=precision, R=R, r=r)
            quartic = "(x^2 + y^2 + z^2 + R^2 - r^2)^2 - 4*R^2*(x^2 + y^2)"
            other = scene_of(quartic, precision=precision, R=R, r=r)
            assert count_steps(ring).steps <= 1.1 * count_steps(other).steps
    assert rays > 500


# A branch that goes to infinity where another decides; a small number beside the pole decides as well, at more steps
AT_POLES = [
    "max(-z, z - 0.3 + 0.03*log(x**2 + y**2), x**2 + y**2 - 1, z - 0.75)",
    "max(x^2 + y^2 + z^2 - 0.8, z - 0.2 - 0.01/(x^2 + y^2))",
    "max(x^2 + y^2 + z^2 - 0.8, 0.2 - 0.05/abs(x))",
    "max(x^2 + y^2 + z^2 - 0.8, z + 0.2*log(hypot(x, y)))",
    "min(x^2 + y^2 + (z - 0.5)^2 - 0.1, z^2 - 0.6 + 0.01*(x^2 + y^2 + z^2)^-0.5 + x^2 + y^2)",
    "min(z^2 + x^2 + y^2 - 0.3, x^2 + z^2 + y^2 - 0.4 + 0.01/hypot(x, y), x^2 + y^2 + z^2 - 0.4 - log(abs(x))/9)",
    "max(x^2 + y^2 + z^2 - 0.8, cbrt(0.2 + log(x^2 + y^2)) + z, 0.1 - exp(-z))",
    "max(x^2 + y^2 + z^2 - 0.8, z + 2 - sqrt(2 + 1/(x^2 + y^2)))",
    "max(x^2 + y^2 + z^2 - 0.8, log((y + 0.02)^2) - log((z - 0.3)^2) + 3)",  # down at one, up at the other
]


@pytest.mark.parametrize(
    ("text", "precision"), [*((text, "double") for text in AT_POLES), *((text, "single") for text in AT_POLES[:2])]
)
def test_what_goes_to_infinity_where_another_branch_decides_is_decided(text: str, precision: str) -> None:
    scene = scene_of(text, film=FILM, precision=precision)
    raymap = lenscl.trace(scene)
    assert (raymap.events > 0).sum() > 50
    undecided = np.argwhere(raymap.status == RayStatus.UNDECIDED)
    assert not len(undecided), undecided  # nor on the axis itself
    found = compared(scene, field(text), 1.8, chosen=(raymap.events > 0).ravel())
    assert found.told.sum() > 40
    same = (found.paths.events == found.said.events)[found.told]
    assert same.mean() > 0.98  # a ray through an edge may be taken to either side of it
    assert np.median(found.apart[found.told][same]) < (1e-3 if precision == "single" else 1e-6)


# Each against dense sampling of the text as it stands
ASIDE = [
    "tanh(3*(x^2 + y^2 + z^2) - 1) + 0.3",
    "log(x^2 + 2*y^2 + z^2) + 1",
    "2 - 1/(x^2 + y^2 + z^4)",
    "sqrt(x^2 + 2*y^2) + z^2 - 0.5",
    "max(sqrt(x^2 + y^2) - 0.6*(0.9 - z), -z - 0.3)",
    "((x^2)^1.5 + (y^2)^1.5 + (z^2)^1.5)^0.5 - 0.6",
    "exp(x^2 + y^2) - exp(0.5 - z^2)",
    "(x^2 + y^2 + z^2 - 0.5)/sqrt(x^2 + y^2 + 0.1) - 0.05*z",
    "x^2 + y^2 + z^2 - sqrt(x^2 + 0.2) + 0.1",
]


@pytest.mark.parametrize("text", ASIDE)
def test_rays_go_where_sampling_of_the_text_says(text: str) -> None:
    found = compared(scene_of(text, film=FILM), field(text), 1.9)
    assert (found.paths.status == RayStatus.UNDECIDED).sum() <= 1  # a cone's point on the axis
    assert found.told.sum() > 50
    np.testing.assert_array_equal(found.paths.events[found.told], found.said.events[found.told])
    apart = found.apart[found.told]
    assert np.median(apart) < 1e-6
    assert (apart < 1e-3).mean() > 0.97


@pytest.mark.parametrize(
    ("text", "is_defined"),
    [
        # Its square says that where u < 0 it is inside
        ("max(sqrt(x - 0.1) - 0.2, x^2 + y^2 + z^2 - 0.5)", lambda x, y, z: x >= 0.1),
        # A pole inside of where there is no value, which rays come to through places that have one
        ("max(sqrt(2 + log(y^2 + z^2)) - 5, x^2 + y^2 + z^2 - 0.5)", lambda x, y, z: y**2 + z**2 >= np.exp(-2)),
    ],
)
def test_where_f_has_no_value_a_ray_stays_undecided(text: str, is_defined: Callable[[Any, Any, Any], Any]) -> None:
    scene = scene_of(text)
    raymap = lenscl.trace(scene)
    origin, direction = film_rays(scene)
    t = np.linspace(3.0, 5.0, 400)[None, :, None]
    x, y, z = np.moveaxis(origin[:, None] + t * direction[:, None], -1, 0)
    without = (~is_defined(x, y, z) & (x**2 + y**2 + z**2 < 0.5)).any(axis=1).reshape(raymap.status.shape)
    decided = raymap.status != RayStatus.UNDECIDED
    assert without.sum() > 50
    assert not (decided & without).any()
    assert (decided & ~without).sum() > 300
