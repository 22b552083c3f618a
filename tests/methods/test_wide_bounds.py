"""Bounds far wider than the solid: rays are clipped to the solid's own box, found once for its parameters."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from probe import plain_device
from scenes import make_scene

from lenscl import RayStatus, trace
from lenscl.cli.explain_study import _always, _searches
from lenscl.config import Scene
from lenscl.expr import evaluate
from lenscl.tracing import Follower, count_steps, tight, tightened
from lenscl.tracing.numbers import scene_numbers
from lenscl.tracing.placement import Placement

QUARTIC = "x^4 + y^4 + z^4 - k"
SOLIDS = {
    QUARTIC: {"k": 0.9},
    "(x^2 + y^2 + z^2 + 0.6)^2 - 2.9*(x^2 + y^2)": {},
    "max(x^3 - y*z - 0.2, (x - 3)^2/40 + y^2 + z^2 - 1)": {},
    "abs(x)^2.5 + abs(y)^1.5 + z^2 - k": {"k": 0.8},
    "x^2 + y^2 + (z - 700)^2 - 1 + 0.2*sin(5*x)": {},
    "sqrt(x^2 + 2*y^2 + z^2 + 1) - 1.3 + 0.1*cos(4*y)": {},
}


def scene_of(text: str, half: float, **more: Any) -> Scene:
    lens = {"surface": text, "bounds": [[-half] * 3, [half] * 3], "n": 1.4}
    return make_scene(lens | SOLIDS.get(text, {}) | more, film={"size": [32, 32]}, numerics={"max_events": 8})


def box_of(scene: Scene) -> NDArray[np.float64]:
    found = tightened(scene.lenses[0])
    assert found is not None
    return found


@pytest.mark.parametrize("text", SOLIDS)
@pytest.mark.parametrize("half", [1e3, 1e6])
def test_the_box_holds_the_solid_and_not_much_more(text: str, half: float) -> None:
    scene = scene_of(text, half)
    low, high = box_of(scene)
    span = high - low
    rng = np.random.default_rng(2)
    points = rng.uniform(low - 0.6 * span, high + 0.6 * span, (200_000, 3))
    lens = scene.lenses[0]
    inside = (
        np.asarray(evaluate(lens.surface.expression, {**lens.values, **dict(zip("xyz", points.T, strict=True))})) <= 0
    )
    assert inside.sum() > 300
    held = (points[inside] > low).all(axis=1) & (points[inside] < high).all(axis=1)
    assert held.all()
    filled = points[inside].max(axis=0) - points[inside].min(axis=0)
    assert (filled > 0.45 * span).all()


def test_bounds_that_fit_stay_as_they_are() -> None:
    fitting = scene_of(QUARTIC, 1.5)
    assert tightened(fitting.lenses[0]) is None
    for scene in (fitting, make_scene({"surface": "torus"}), make_scene({"surface": "brilliant"})):
        source = trace(scene.replace({"film.size": [4, 4]})).kernel
        numbers = scene_numbers(scene, source)
        box = Placement.of(scene.lenses[0]).box
        np.testing.assert_array_equal([numbers["lens_0.box_low"], numbers["lens_0.box_high"]], box)


def test_where_f_has_no_value_somewhere_the_bounds_stay() -> None:
    """Rays through such places are undecided, in the box that was promised."""
    for text in ("x^2 + y^2 + z^2 - 1 + 1e-9*sqrt(x + 900)", "log(x + 999.5) + x^2 + y^2 + z^2 - 8"):
        assert tightened(scene_of(text, 1e3).lenses[0]) is None
    assert tightened(scene_of("x^2 + y^2 + z^2 + 1e-9*sqrt(x + 1001) - 1", 1e3).lenses[0]) is not None


def test_wide_bounds_cost_no_steps_and_change_no_answer() -> None:
    device = plain_device(4)
    fitting, wide = scene_of(QUARTIC, 1.2), scene_of(QUARTIC, 1e3)
    found, wanted = (trace(scene, device=device) for scene in (wide, fitting))
    np.testing.assert_array_equal(found.status, wanted.status)
    np.testing.assert_array_equal(found.events, wanted.events)
    assert (found.events > 0).sum() > 200
    landed = (found.status == RayStatus.PICTURE) & (found.events <= 4)
    assert np.abs(found.st - wanted.st)[landed].max() < 1e-9
    steps = [count_steps(scene, device=device).steps for scene in (wide, fitting)]
    assert steps[0] < 1.3 * steps[1], steps
    with pytest.MonkeyPatch.context() as patch:  # as it was
        patch.setattr("lenscl.tracing.numbers.search_box", lambda lens: Placement.of(lens).box)
        assert count_steps(wide, device=device).steps > 2 * steps[0]


def test_rays_that_start_beside_the_box_or_in_the_solid_are_the_same() -> None:
    device = plain_device(4)
    rng = np.random.default_rng(6)
    d = rng.normal(size=(600, 3))
    o = rng.normal(size=(600, 3)) * rng.choice([0.3, 1.0, 50.0], 600)[:, None]
    d = np.where(rng.random((600, 1)) < 0.7, rng.uniform(-0.7, 0.7, (600, 3)) - o, d)
    ends = [Follower(scene_of(QUARTIC, half), device).ends(o, d, 8) for half in (1.1, 1e3)]
    np.testing.assert_array_equal(ends[0].status, ends[1].status)
    np.testing.assert_array_equal(ends[0].events, ends[1].events)
    assert (ends[0].events > 0).sum() > 200


def test_a_sweep_of_anything_else_finds_the_box_once() -> None:
    tight._tightened.cache_clear()
    for place in (0.0, 0.1, 0.2):
        scene = scene_of(QUARTIC, 1e3, centre=[place, 0.0, 0.0], n=1.3 + place)
        box_of(scene)
    assert tight._tightened.cache_info().misses == 1


def test_explain_says_that_rays_are_searched_in_a_smaller_box() -> None:
    rows = {row[0]: row for row in _always(scene_of(QUARTIC, 1e3))}
    assert "wider than the solid" in rows["lens.bounds"][4]
    assert "lens.bounds" not in {row[0] for row in _always(scene_of(QUARTIC, 1.2))}
    assert _searches(scene_of("max(x^4 + y^4 + z^4 - 1, z)", 1.2)) == {"lens": "joined"}
