"""Mirrors against closed forms: the law of reflection, foci, unfolding; and kernels that reflect wrongly are caught."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from faults_in_kernels import Fault, broken
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scenes import make_scene

from lenscl import RayStatus, trace_rays
from lenscl.config import Scene

Array = NDArray[np.float64]
AXES = (1.0, 0.6, 0.8)
EGG = {"surface": "ellipsoid", **dict(zip("abc", AXES, strict=True)), "mirror": True}
CORNER = {"surface": "max(-x, -y, -z, x + y + z - 1)", "bounds": [[-0.1] * 3, [1.1] * 3], "mirror": ["1", "2", "3"]}
PIPE = {"surface": "box", "a": 1.0, "b": 0.8, "c": 50.0, "n": 1.0, "mirror": ["+x", "-x", "+y", "-y"]}
unit_numbers = st.floats(-1.0, 1.0).map(lambda x: round(x, 6))


def sent(scene: Scene, starts: Any, direction: Any, **how: Any) -> Any:
    """Trace rays that start at some points and all go one way."""
    starts = np.asarray(starts, dtype=np.float64)
    return trace_rays(scene, starts, np.broadcast_to(direction, starts.shape), **how)


def egg_rays(places: Array, aims: Array, **change: Any) -> tuple[Array, Array, Array, Any]:
    """Send rays to an egg that is a mirror; return directions before and after, unit normals where they meet it."""
    scene = make_scene(EGG | change, numerics={"max_events": 1})
    d = aims - places
    d /= np.linalg.norm(d, axis=1)[:, None]
    rays = trace_rays(scene, places, d)
    normal = rays.origin / np.square(AXES)
    return d, rays.direction, normal / np.linalg.norm(normal, axis=1)[:, None], rays


def check_the_law(places: Array, aims: Array) -> int:
    before, after, normal, rays = egg_rays(places, aims)
    met = rays.events == 1
    slope = np.sum(before * normal, axis=1, keepdims=True)
    np.testing.assert_allclose(after[met], (before - 2 * slope * normal)[met], rtol=0, atol=4e-15)
    np.testing.assert_allclose(np.linalg.norm(after[met], axis=1), 1.0, rtol=0, atol=1e-15)
    assert not np.isin(rays.status, [RayStatus.TOTAL_REFLECTION, RayStatus.BLOCKED]).any()
    return int(met.sum())


@given(st.lists(st.tuples(*[unit_numbers] * 6), min_size=8, max_size=8))
def test_a_mirror_keeps_the_law_of_reflection_on_both_sides(numbers: list[tuple[float, ...]]) -> None:
    drawn = np.array(numbers)
    inner = 0.35 * drawn[:, 3:] * AXES
    outer = drawn[:, :3] + np.where(drawn[:, :3] < 0, -1.5, 1.5)
    assert check_the_law(outer, inner) == len(drawn)
    assert check_the_law(inner, outer) == len(drawn)


def test_a_hollow_ball_focuses_at_half_its_radius_with_the_aberration_of_a_sphere() -> None:
    """A ray parallel to the axis, h beside it, crosses it at R / (2 cos t) from the centre, sin t = h / R."""
    h = np.linspace(1e-4, 0.7, 40)
    starts = np.stack([h, 0 * h, 0 * h], axis=1)
    scene = make_scene({"surface": "sphere", "r": 1.0, "mirror": True}, numerics={"max_events": 1})
    rays = sent(scene, starts, [0.0, 0.0, -1.0])
    crossing = rays.origin[:, 2] - rays.origin[:, 0] / rays.direction[:, 0] * rays.direction[:, 2]
    np.testing.assert_allclose(crossing, -0.5 / np.sqrt(1 - h**2), rtol=0, atol=2e-12)
    assert crossing[0] == pytest.approx(-0.5, abs=1e-8)
    assert (rays.status == RayStatus.TRAPPED).all()  # it never gets out


def test_a_ball_mirror_from_outside_spreads_light_from_half_its_radius() -> None:
    h = np.linspace(1e-3, 0.9, 40)
    scene = make_scene({"surface": "sphere", "r": 1.0, "mirror": True})
    rays = sent(scene, np.stack([h, 0 * h, 0 * h + 3.0], axis=1), [0.0, 0.0, -1.0])
    assert (rays.events == 1).all()
    crossing = rays.origin[:, 2] - rays.origin[:, 0] / rays.direction[:, 0] * rays.direction[:, 2]
    np.testing.assert_allclose(crossing, 0.5 / np.sqrt(1 - h**2), rtol=0, atol=1e-13)


def test_a_parabolic_mirror_brings_parallel_light_to_its_focus() -> None:
    f = 0.75
    dish = {
        "surface": "max(z - (x^2 + y^2)/(4*f), x^2 + y^2 - 1, -z - 0.2)", "f": f, "bounds": [[-1.2] * 3, [1.2] * 3],
        "mirror": ["1"], "n": 1.5,
    }  # fmt: skip
    places = np.random.default_rng(1).uniform(-0.7, 0.7, (200, 2))
    starts = np.column_stack([places, np.full(200, 4.0)])
    rays = sent(make_scene(dish), starts, [0.0, 0.0, -1.0])
    assert (rays.events == 1).all()
    away = np.array([0.0, 0.0, f]) - rays.origin
    missed = np.linalg.norm(np.cross(away, rays.direction), axis=1)
    assert missed.max() < 2e-15


@pytest.mark.parametrize(("precision", "off"), [("double", 2e-15), ("single", 2e-6), ("mixed", 2e-15)])
def test_a_corner_cube_of_three_mirrors_sends_every_ray_back(precision: str, off: float) -> None:
    rng = np.random.default_rng(2)
    aims = rng.dirichlet([1.0, 1.0, 1.0], 300) * 0.9 + 0.03
    starts = aims + rng.normal(0, 0.15, (300, 3)) + 2.0
    d = aims - starts
    d /= np.linalg.norm(d, axis=1)[:, None]
    rays = trace_rays(make_scene(CORNER), starts, d, precision=precision)
    whole = rays.events == 5
    assert whole.sum() > 150
    np.testing.assert_allclose(rays.direction[whole], -d[whole], rtol=0, atol=off)
    assert np.count_nonzero(rays.status == RayStatus.UNDECIDED) <= 2


def test_two_tilted_mirrors_make_a_periscope() -> None:
    plate = {"surface": "box", "a": 1.0, "b": 1.0, "c": 0.02, "mirror": True, "rotate": [45.0, 0.0, 0.0]}
    scene = make_scene(plate | {"name": "low"}, plate | {"name": "high", "centre": [0.0, -2.0, 0.0]})
    y = np.linspace(-0.2, 0.2, 9)
    rays = sent(scene, np.stack([0.1 + 0 * y, y, 0 * y + 3.0], axis=1), [0.0, 0.0, -1.0])
    assert (rays.events == 2).all()
    np.testing.assert_allclose(rays.direction, np.tile([0.0, 0.0, -1.0], (9, 1)), rtol=0, atol=1e-15)
    # The faces are 0.02 thick plates: the ray meets the upper side of one and the lower side of the other
    apart = 2.0 - 2 * 0.01 * np.sqrt(2)
    np.testing.assert_allclose(rays.origin[:, 1], y - apart, rtol=0, atol=1e-14)


def mangin(h: float, n: float, R1: float, R2: float, thickness: float) -> tuple[float, float]:
    """Trace a meridional ray through a meniscus with a silvered back by hand; return where and how it comes out."""
    p, d = np.array([h, -5.0]), np.array([0.0, 1.0])

    def meet(p: Array, d: Array, R: float, vertex: float) -> tuple[Array, Array]:
        off = p - np.array([0.0, vertex + R])
        b, c = off @ d, off @ off - R * R
        roots = -b + np.array([-1.0, 1.0]) * np.sqrt(b * b - c)
        at = [p + t * d for t in roots if t > 1e-9]
        near = min(at, key=lambda q: abs(q[1] - vertex))
        normal = (near - np.array([0.0, vertex + R])) / R
        return near, normal * (-1.0 if normal @ d > 0 else 1.0)

    def bent(d: Array, normal: Array, eta: float) -> Array:
        c = -d @ normal
        return np.asarray(eta * d + (eta * c - np.sqrt(1 - eta**2 * (1 - c * c))) * normal)

    p, normal = meet(p, d, R1, -thickness / 2)
    d = bent(d, normal, 1 / n)
    p, normal = meet(p, d, R2, thickness / 2)
    d = d - 2 * (d @ normal) * normal
    p, normal = meet(p, d, R1, -thickness / 2)
    d = bent(d, normal, n)
    return float(p[0]), float(d[0])


def test_a_mangin_mirror_refracts_reflects_and_refracts() -> None:
    n, R1, R2, thickness = 1.5168, 0.9, 1.8, 0.4
    lens = {"surface": "meniscus", "R1": R1, "R2": R2, "thickness": thickness, "n": n, "mirror": ["back"]}
    h = np.linspace(0.01, 0.45, 20)
    rays = sent(make_scene(lens), np.stack([h, 0 * h, 0 * h - 5.0], axis=1), [0.0, 0.0, 1.0])
    assert (rays.events == 3).all()
    by_hand = np.array([mangin(float(each), n, R1, R2, thickness) for each in h])
    np.testing.assert_allclose(rays.origin[:, 0], by_hand[:, 0], rtol=0, atol=2e-14)
    np.testing.assert_allclose(rays.direction[:, 0], by_hand[:, 1], rtol=0, atol=2e-14)


def folded(x: Array, half: float) -> Array:
    """Return where straight lines come to between two mirrors at -half and half."""
    return np.asarray(half - np.abs((x + half) % (4 * half) - 2 * half))


def test_a_pipe_with_coated_walls_leads_light_through_fifty_bounces() -> None:
    rng = np.random.default_rng(4)
    start = np.array([0.1, -0.05, -24.0])
    slopes = rng.uniform([0.3, -0.4], [0.75, 0.4], (60, 2))
    d = np.column_stack([slopes, np.ones(60)])
    rays = trace_rays(
        make_scene(PIPE, picture={"corner": [-3.0, 3.0, 60.0]}, numerics={"max_events": 255}),
        np.tile(start, (60, 1)),
        d,
    )
    straight = start[:2] + slopes * 49.0
    assert (rays.status != RayStatus.UNDECIDED).all()
    bounces = np.floor(np.abs(straight / np.array([1.0, 0.8])) + 0.5).sum(axis=1)
    np.testing.assert_array_equal(rays.events, bounces + 1)
    assert bounces.max() >= 50
    np.testing.assert_allclose(rays.origin[:, 0], folded(straight[:, 0], 0.5), rtol=0, atol=2e-13)
    np.testing.assert_allclose(rays.origin[:, 1], folded(straight[:, 1], 0.4), rtol=0, atol=2e-13)


def folded_in_triangle(points: Array, corners: Array) -> Array:
    """Return points of the plane, shape (N, 2), folded into a triangle by reflections in its sides."""
    made = points.copy()
    for _ in range(200):
        done = True
        for i in range(3):
            a, b = corners[i], corners[(i + 1) % 3]
            normal = np.array([(b - a)[1], -(b - a)[0]]) / np.linalg.norm(b - a)  # outward: corners go round leftwards
            over = np.maximum((made - a) @ normal, 0.0)
            made -= 2 * over[:, None] * normal
            done &= not (over > 0).any()
        if done:
            return made
    raise AssertionError("a point is not folded")


def test_a_kaleidoscope_shows_what_unfolding_says() -> None:
    side, length = 1.2, 8.0
    walls = {"surface": "prism", "side": side, "length": length, "n": 1.0, "mirror": ["front", "back", "base"]}
    rng = np.random.default_rng(5)
    slopes = rng.uniform(-0.6, 0.6, (400, 2))
    start = np.array([-3.9, 0.03, 0.02])
    rays = trace_rays(make_scene(walls, numerics={"max_events": 64}), np.tile(start, (400, 1)),
                      np.column_stack([np.ones(400), slopes]))  # fmt: skip
    third = side * np.cos(np.pi / 6) / 3
    corners = np.array([[-third, -side / 2], [2 * third, 0.0], [-third, side / 2]])  # y and z
    (ay, az), (by, bz) = corners[1] - corners[0], corners[2] - corners[1]
    corners = corners if ay * bz > az * by else corners[::-1]
    found = rays.status != RayStatus.UNDECIDED
    assert found.mean() > 0.99
    assert rays.events[found].max() > 5
    places = folded_in_triangle(start[1:] + 7.9 * slopes, corners)
    np.testing.assert_allclose(rays.origin[found][:, 1:], places[found], rtol=0, atol=2e-13)
    np.testing.assert_allclose(rays.origin[found][:, 0], length / 2, rtol=0, atol=1e-14)


@pytest.mark.parametrize("method", ["auto", "march"])
def test_a_ray_within_rounding_of_an_edge_of_the_coat_is_undecided(method: str) -> None:
    """On the edge of a mirrored and a clear face nobody can tell; a little beside it everybody can."""
    lens = {"surface": "half_ball", "diameter": 2.0, "mirror": ["front"], "n": 1.5}
    gap = np.array([0.0, 1e-17, 1e-9, -1e-9])
    rim = np.stack([1.0 + gap, 0 * gap, 0.5 + 0 * gap], axis=1)
    start = np.array([3.0, 0.1, 0.9])
    rays = trace_rays(make_scene(lens), np.tile(start, (4, 1)), rim - start, method=method)
    assert (rays.status[:2] == RayStatus.UNDECIDED).all()
    assert not rays.events[:2].any()
    np.testing.assert_allclose(rays.origin[:2], [start, start], rtol=0, atol=1e-15)
    way = (rim - start)[:2]
    np.testing.assert_allclose(rays.direction[:2], way / np.linalg.norm(way, axis=1)[:, None], rtol=0, atol=1e-15)
    assert (rays.status[2:] != RayStatus.UNDECIDED).all()


def test_both_faces_of_an_edge_may_be_mirrors() -> None:
    rng = np.random.default_rng(8)
    aims = rng.dirichlet([1.0, 1.0, 1.0], 300)
    scene = make_scene(CORNER | {"mirror": True})
    rays = trace_rays(scene, aims + 2.0, -np.ones((300, 3)))
    assert (rays.events == 1).all()
    np.testing.assert_allclose(rays.direction, np.full((300, 3), 1 / np.sqrt(3)), rtol=0, atol=1e-15)


def nested(*lenses: dict[str, Any], **more: Any) -> Scene:
    return make_scene(*(lens | {"name": f"l{i}"} for i, lens in enumerate(lenses)), **more)


def test_a_mirrored_face_in_contact_reflects_and_a_hidden_one_does_not() -> None:
    cube = {"surface": "box", "n": 1.5}
    down = np.array([[0.1, -0.2, 3.0]]), np.array([[0.0, 0.1, -1.0]])
    lower = cube | {"centre": [0.0, 0.0, -1.0], "n": 1.7}
    silvered = trace_rays(nested(cube | {"mirror": ["-z"]}, lower), *down)
    assert (silvered.events[0], silvered.status[0]) == (3, RayStatus.BEHIND)
    other_side = trace_rays(nested(cube, lower | {"mirror": ["+z"]}), *down)
    np.testing.assert_array_equal(other_side.direction, silvered.direction)
    assert silvered.direction[0, 2] > 0
    # Within a solid of higher priority there is no such face, and a ray goes through
    hidden = trace_rays(nested(cube | {"mirror": True, "c": 0.3}, cube | {"priority": 1.0}), *down)
    assert hidden.events[0] == 2
    plain = trace_rays(nested(cube), *down)
    np.testing.assert_allclose(hidden.direction, plain.direction, rtol=0, atol=1e-15)


def test_a_mirror_in_glass_is_met_from_the_glass() -> None:
    glass, ball = {"surface": "sphere", "r": 1.0, "n": 1.5}, {"surface": "sphere", "r": 0.4, "mirror": True}
    rays = sent(nested(glass, ball), [[0.0, 0.0, 3.0], [0.0, 0.0, 0.2]], [0.0, 0.0, -1.0])
    assert rays.events.tolist() == [3, 16]  # in and out again; and a start in the mirror stays there
    np.testing.assert_allclose(rays.direction[0], [0.0, 0.0, 1.0], rtol=0, atol=1e-15)
    assert rays.status[1] == RayStatus.TRAPPED


def test_the_paraxial_rule_reflects_exactly() -> None:
    rays = [
        trace_rays(make_scene(EGG, numerics={"snell": law}), [[0.3, 0.2, 3.0]], [[0.0, 0.05, -1.0]])
        for law in ("exact", "paraxial")
    ]
    np.testing.assert_array_equal(rays[0].direction, rays[1].direction)


@pytest.mark.parametrize("method", ["interval", "march", "planes", "auto"])
def test_every_method_tells_the_faces(method: str) -> None:
    box = {"surface": "box", "rotate": [20.0, 30.0, 10.0], "mirror": ["+z", "-x"], "n": 1.5}
    rng = np.random.default_rng(3)
    starts = rng.normal(0, 1, (200, 3))
    starts *= 3.0 / np.linalg.norm(starts, axis=1)[:, None]
    scene = make_scene(box, numerics={"step": 0.001, "max_events": 8})
    aims = rng.uniform(-0.3, 0.3, (200, 3))
    usual, other = (trace_rays(scene, starts, aims - starts, method=each) for each in ("auto", method))
    assert (usual.events > 1).sum() > 50
    both = (usual.status != RayStatus.UNDECIDED) & (other.status != RayStatus.UNDECIDED)
    assert both.mean() > 0.97
    np.testing.assert_array_equal(usual.events[both], other.events[both])
    np.testing.assert_allclose(usual.direction[both], other.direction[both], rtol=0, atol=1e-9)


def check_edge_once() -> None:
    """By a march, which itself decides rays on edges."""
    test_a_ray_within_rounding_of_an_edge_of_the_coat_is_undecided("march")


def check_law_once() -> None:
    rng = np.random.default_rng(9)
    assert check_the_law(rng.uniform(1.5, 2.0, (50, 3)), rng.uniform(-0.2, 0.2, (50, 3))) == 50


def check_inside_once() -> None:
    rng = np.random.default_rng(9)
    assert check_the_law(rng.uniform(-0.2, 0.2, (50, 3)), rng.uniform(1.5, 2.0, (50, 3))) == 50


FAULTS: tuple[tuple[Fault, Callable[[], None]], ...] = (
    (Fault("reflected by the wrong sign", "effects/mirrored.cl", "(realv)-2 *", "(realv)2 *"), check_law_once),
    (
        Fault("mirrors are one-sided", "effects/mirror.cl", "mirrored_at(ray, at, scene, &unsure);",
              "mirrored_at(ray, at, scene, &unsure) & not_lane(at->leaves);"),
        check_inside_once,
    ),
    (
        Fault("the ray gets to the other side", "effects/mirror.cl",
              "ray->inside = (mirrors | unsure) ? (at->leaves ? at->lens : NOWHERE) : ray->inside;", ""),
        test_a_mangin_mirror_refracts_reflects_and_refracts,
    ),
    (
        Fault("the faces are exchanged", "lens_coat.cl", "return asks & is_coated;",
              "return asks & not_lane(is_coated);"),
        test_a_mangin_mirror_refracts_reflects_and_refracts,
    ),
    (
        Fault("edges of the coat are decided", "lens_coat.cl", "(asks & not_lane(abs_v(at.coat - at.rest) > error))",
              "(maskv)0"),
        check_edge_once,
    ),
    (
        Fault("the coat of another plane", "lens_coat_planes.cl", "if (LENS(coated_planes)[k])",
              "if (LENS(coated_planes)[5 - k])"),
        test_a_pipe_with_coated_walls_leads_light_through_fifty_bounces,
    ),
    (
        Fault("the set of solids is kept crossed", "effects/mirror_nested.cl",
              "ray->inside = crossed ? ray->inside ^ ray->on : ray->inside;", ""),
        test_a_mirror_in_glass_is_met_from_the_glass,
    ),
)  # fmt: skip


@pytest.mark.parametrize(("fault", "check"), FAULTS, ids=[fault.name for fault, _ in FAULTS])
def test_kernels_that_reflect_wrongly_are_caught(fault: Fault, check: Callable[[], None]) -> None:
    check()
    with broken(fault), pytest.raises(AssertionError):
        check()
