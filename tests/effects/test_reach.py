"""A lens that no ray gets to is left out of the kernel; with it forced in the map is the same, bit for bit."""

from __future__ import annotations

from dataclasses import replace
from math import cos, radians, sin
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st
from scenes import make_scene

from lenscl import RayStatus, trace, trace_rays
from lenscl.config import Needs, Scene, study_from_toml
from lenscl.tracing import kernel_source, reach, reach_of, study_needs, with_needs

BALL: dict[str, Any] = {"name": "ball", "surface": "sphere", "r": 0.5}
STOP: dict[str, Any] = {"name": "stop", "surface": "sphere", "r": 0.1, "absorbs": True}
PARALLEL = {"kind": "parallel", "direction": [0.0, 0.0, -1.0]}


def with_all(scene: Scene) -> Scene:
    """Return a scene whose kernel has every lens."""
    return with_needs(scene, Needs(lenses=frozenset(range(len(scene.lenses)))))


def assert_nothing_gets_to(scene: Scene, lenses: set[int]) -> None:
    """Trace with some lenses forced in and opaque: nothing is blocked there, and the map is the same without them."""
    opaque = [replace(lens, absorbs=True) if i in lenses else lens for i, lens in enumerate(scene.lenses)]
    blocked = trace(with_all(replace(scene, lenses=tuple(opaque))))
    bare, forced = trace(scene), trace(with_all(scene))
    for number in lenses:
        assert f"lens_{number}" not in bare.kernel.text
        assert f"lens_{number}" in forced.kernel.text
    before = forced.status == RayStatus.BLOCKED
    np.testing.assert_array_equal(blocked.status == RayStatus.BLOCKED, before)
    for name in ("st", "status", "events"):
        np.testing.assert_array_equal(getattr(bare, name), getattr(forced, name))


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize(
    ("far", "more"),
    [
        ({"centre": [3.0, 0.0, 0.0]}, {"effects": {"total_reflection": "end"}}),  # beside the pyramid; bent by less
        ({"centre": [0.0, 0.0, 7.0]}, {}),  # behind the source
        ({"centre": [0.0, 2.0, 9.0]}, {"source": PARALLEL}),
        ({"centre": [2.0, 0.0, 2.5]}, {"source": PARALLEL}),  # at the height of the film, before the ball
    ],
)
def test_what_no_ray_gets_to_is_left_out(far: dict[str, Any], more: dict[str, Any], precision: str) -> None:
    scene = make_scene(BALL | {"n": 1.1}, STOP | far, **more, film={"size": [64, 64], "scale": 0.6})
    scene = scene.replace({"numerics.precision": precision})
    assert reach_of(scene).keys() == {0}
    assert_nothing_gets_to(scene, {1})
    assert (trace(scene).events > 0).sum() > 500


def test_a_ball_bends_rays_as_far_as_the_bound_says() -> None:
    """By twice the angle between grazing incidence and the critical angle: 96.4 degrees at n = 1.5."""
    close = {"centre": [0.45, 0.0, 2.5], "right": [0.1, 0.0, 0.0], "down": [0.0, -0.002, 0.0], "size": [4000, 3]}
    met = {}
    for angle in (80.0, 92.0, 98.0, 108.0, 130.0):
        at = [-30.0 * sin(radians(angle)), 0.0, -30.0 * cos(radians(angle))]
        stop = STOP | {"r": 2.0, "centre": at}
        scene = make_scene(BALL, stop, source=PARALLEL, film=close, effects={"total_reflection": "end"})
        met[angle] = (1 in reach_of(scene), RayStatus.BLOCKED in set(trace(with_all(scene)).status.flat))
    is_met, is_out = (True, True), (False, False)
    assert met == {80.0: is_met, 92.0: is_met, 98.0: is_met, 108.0: is_out, 130.0: is_out}


def test_rays_that_go_apart_are_bent_from_where_they_go() -> None:
    """At the edge of a wide film a weak ball bends rays still farther out."""
    edge = {"name": "edge", "surface": "sphere", "r": 0.3, "n": 1.03, "centre": [1.6, 0.0, 0.0]}
    at = [1.6 + 8.0 * sin(radians(40.0)), 0.0, -8.0 * cos(radians(40.0))]
    scene = make_scene(edge, STOP | {"r": 0.4, "centre": at}, film={"size": [8192, 3]})
    assert reach_of(scene)[1] == "rays that lens.edge has bent may meet it"
    assert RayStatus.BLOCKED in set(trace(with_all(scene)).status.flat)
    film = {"corner": [-1.5, 1.5, 2.5], "right": [1.5, 0.0, 0.0], "down": [0.0, -1.5, 0.0]}
    assert reach_of(make_scene(edge, STOP | {"r": 0.4, "centre": at}, film=film)).keys() == {0, 1}  # none is reached


def test_lenses_that_hardly_bend_are_followed_to_an_end() -> None:
    weak = [
        {"name": name, "surface": "sphere", "r": 0.5, "n": 1.0 + 1e-13, "centre": [x, 0.0, 0.0]}
        for name, x in (("one", 0.0), ("two", 1.0))
    ]
    behind = make_scene(*weak, STOP | {"centre": [0.0, 0.0, 9.0]})
    assert reach_of(behind).keys() == {0, 1, 2}  # each may send rays to the other, on and on


@pytest.mark.parametrize(
    "lens",
    [
        BALL | {"surface": "torus", "R": 0.4, "r": 0.1},  # no convex solid
        BALL | {"surface": "ellipsoid", "a": 0.5, "b": 0.5, "c": 0.2},  # that reflects totally
    ],
)
def test_rays_that_may_go_anywhere_may_get_anywhere(lens: dict[str, Any]) -> None:
    lens = {key: value for key, value in lens.items() if key != "r" or lens["surface"] == "torus"}
    scene = make_scene(lens, STOP | {"centre": [0.0, 0.0, 7.0]})
    assert reach_of(scene) == {
        0: "rays of the film pass through its box",
        1: "rays that lens.ball has bent may meet it",
    }
    assert reach_of(scene.replace({"lens.ball.absorbs": True})).keys() == {0}
    assert reach_of(scene.replace({"lens.ball.n": 1.0})).keys() == {0}


def test_what_bounds_no_ray_leaves_no_lens_out() -> None:
    """A solid that is not convex, the paraxial rule, and a film wider than a cone can be, each by itself."""
    behind = STOP | {"centre": [0.0, 0.0, 7.0]}
    ends = {"total_reflection": "end"}
    assert reach_of(make_scene(BALL, behind, effects=ends)).keys() == {0}
    ring = {"name": "ring", "surface": "torus", "R": 0.4, "r": 0.1}
    assert reach_of(make_scene(ring, behind, effects=ends)).keys() == {0, 1}
    assert reach_of(make_scene(BALL, behind, numerics={"snell": "paraxial"})).keys() == {0, 1}
    wide = {"corner": [-1e4, 1.0, 2.5], "right": [1.0001e4, 0.0, 0.0], "down": [0.0, -2.0, 0.0]}
    _, angle = reach._directions(make_scene(BALL, film=wide))
    assert angle < np.pi / 2
    slanted = {"corner": [-1e4, 1.0, 3.9], "right": [1e4, 0.0, 2.0], "down": [1.0, -1e4, -3.0]}
    assert reach._directions(make_scene(BALL, film=slanted))[1] <= np.pi


@pytest.mark.parametrize(("blue", "red"), [(1.3, 1.0), (1.0, 1.3)])
@pytest.mark.parametrize("middle", [1.0, 1.01])
def test_every_wavelength_counts(blue: float, red: float, middle: float) -> None:
    """A lens that bends nothing at the d line, or hardly, bends other light more."""
    behind = STOP | {"centre": [-3.0 * sin(radians(40.0)), 0.0, -3.0 * cos(radians(40.0))]}
    lens = BALL | {"n": {"table": [[430.0, blue], [587.5618, middle], [700.0, red]]}}
    scene = make_scene(lens, behind, source=PARALLEL, film={"size": [8, 8], "scale": 0.1})
    assert reach_of(scene).keys() == {0}
    assert reach_of(scene.replace({"effects.dispersion": 8})).keys() == {0, 1}


def test_lens_after_lens_the_cones_grow() -> None:
    """A third ball is beyond the first one's cone, but not beyond the second one's."""
    balls = [
        BALL | {"name": "first", "n": 1.1},
        BALL | {"name": "second", "n": 1.1, "centre": [1.5, 0.0, -1.5]},
        BALL | {"name": "third", "n": 1.1, "centre": [5.0, 0.0, -1.6]},
    ]
    narrow = {"size": [16, 16], "scale": 0.1}
    assert reach_of(make_scene(*balls, source=PARALLEL, film=narrow)).keys() == {0, 1, 2}
    assert reach_of(make_scene(balls[0], balls[2], source=PARALLEL, film=narrow)).keys() == {0}


def test_rays_left_undecided_are_traced_again_without_it() -> None:
    """Rays along the axis of a bifolia touch it where double cannot tell; twice its digits are asked for."""
    bifolia = {"name": "near", "surface": "bifolia", "absorbs": True}
    film = {"centre": [0.0, 0.0, 2.5], "right": [1e-9, 0.0, 0.0], "down": [0.0, -1e-9, 0.0], "size": [9, 9]}
    scene = make_scene(bifolia, STOP | {"centre": [9.0, 0.0, 0.0]}, source=PARALLEL, film=film)
    assert reach_of(scene).keys() == {0}
    bare, forced = trace(scene), trace(with_all(scene))
    assert bare.escalated > 0
    for name in ("st", "status", "events"):
        np.testing.assert_array_equal(getattr(bare, name), getattr(forced, name))


def test_where_nothing_is_reached_every_lens_stays() -> None:
    scene = make_scene(BALL | {"centre": [9.0, 0.0, 0.0]}, STOP | {"centre": [9.0, 3.0, 0.0]})
    assert reach_of(scene).keys() == {0, 1}
    assert (trace(scene).events == 0).all()


def test_rays_of_the_callers_own_get_to_every_lens() -> None:
    scene = make_scene(BALL, STOP | {"centre": [0.0, 0.0, 7.0]})
    assert "lens_1" not in kernel_source(scene).text
    paths = trace_rays(scene, [[0.0, 0.0, 4.0]], [[0.0, 0.0, 1.0]])
    assert paths.status[0] == RayStatus.BLOCKED


def test_a_lens_that_any_point_of_a_study_needs_stays_at_all() -> None:
    text = make_scene(BALL, STOP | {"centre": [0.0, 0.0, 7.0]}).to_toml()
    for axis, needed in (
        ('"lens.stop.r" = [0.1, 0.2]', {0}),
        ('"lens.stop.centre.z" = [7.0, -1.0]', {0, 1}),
        ('"picture.scale" = [0.5, 1.0]', {0}),
        ('"lens.ball.n" = { linspace = [1.2, 1.3, 5000] }', {0, 1}),  # too many to look at
    ):
        study = study_from_toml(f"{text}\n[sweep.axes]\n{axis}\n")
        needs = study_needs(study)
        assert needs.lenses == needed, axis
        sources = {kernel_source(with_needs(point.scene, needs)).key for point in list(study.points())[:2]}
        assert len(sources) == 1, axis


numbers = st.floats(-1.0, 1.0)
SHAPES = st.sampled_from([{"surface": "sphere"}, {"surface": "sphere"}, {"surface": "ellipsoid"}, {"surface": "torus"}])


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    """Draw two lenses somewhere about the film's rays, the first often in their way."""
    first = draw(SHAPES) | {"name": "first", "n": 1.0 + draw(st.floats(0.005, 0.3)), "stretch": [0.4, 0.4, 0.2]}
    turn, way = 180.0 * draw(numbers), draw(st.floats(1.5, 4.0))
    at = [way * sin(radians(turn)), 0.3 * draw(numbers), -way * cos(radians(turn))]
    second = {"name": "second", "surface": "sphere", "r": 0.3, "centre": at, "n": 1.4}
    if first["surface"] == "sphere":
        first["stretch"] = [0.4, 0.4, 0.4]
    source: dict[str, Any] = draw(st.sampled_from([{"kind": "point", "at": [0.0, 0.0, 4.0]}, PARALLEL]))
    effects = {"total_reflection": draw(st.sampled_from(["end", "follow"]))}
    film = {"size": [32, 32], "scale": draw(st.floats(0.05, 1.0))}
    return make_scene(first, second, source=source, effects=effects, film=film)


@given(scene=scenes())
@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])
def test_nothing_gets_to_a_lens_that_is_said_to_be_out_of_reach(scene: Scene) -> None:
    beyond = {0, 1} - reach_of(scene).keys()
    event(f"{len(beyond)} out of reach")
    if beyond:
        assert_nothing_gets_to(scene, beyond)
