"""The lenses of optics obey the formulas that opticians know them by."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from lenses import analytic
from numpy.typing import NDArray
from scenes import make_scene

from lenscl import trace_rays

Array = NDArray[Any]
ALONG = np.array([0.0, 0.0, 1.0])


def through(lens: dict[str, Any], o: Array, d: Array, n: float = 1.5, **how: Any) -> Any:
    scene = make_scene(lens | {"n": n}, picture={"corner": [-3.0, 3.0, -20.0]})  # which stops no ray in a large lens
    return trace_rays(scene, np.asarray(o, float), np.broadcast_to(d, np.shape(o)), **how)


def collimated(height: Array, azimuth: float = 0.4) -> Array:
    """Return starts of rays along +z at some heights."""
    height = np.asarray(height, float)
    return np.stack([height * math.cos(azimuth), height * math.sin(azimuth), 0 * height - 9.0], 1)


def focal_lengths(lens: dict[str, Any], n: float) -> tuple[float, float]:
    """Return the paraxial focal length and where on the axis its focus lies, from two heights to fourth order."""
    height = np.array([2e-3, 4e-3])
    rays = through(lens, collimated(height), ALONG, n)
    assert (rays.events == 2).all()
    across, along = np.hypot(*rays.direction[:, :2].T), rays.direction[:, 2]
    focal = height * along / across
    focus = rays.origin[:, 2] + np.hypot(*rays.origin[:, :2].T) * along / across
    return tuple((4 * x[0] - x[1]) / 3 for x in (focal, focus))  # type: ignore[return-value]


LENSES: list[tuple[dict[str, Any], float, float]] = [  # lens, curvatures of front and back
    ({"surface": "biconvex", "R1": 1.5, "R2": 1.2}, 1 / 1.5, -1 / 1.2),
    ({"surface": "biconvex", "R1": 80.0, "R2": 60.0, "thickness": 7.0, "diameter": 25.0}, 1 / 80, -1 / 60),
    ({"surface": "plano_convex", "R": 1.0}, 1.0, 0.0),
    ({"surface": "meniscus", "R1": 0.9, "R2": 1.8}, 1 / 0.9, 1 / 1.8),
    ({"surface": "conic_singlet", "c1": 0.7, "k1": -1.3, "c2": -0.2, "k2": 2.0}, 0.7, -0.2),
    ({"surface": "even_asphere_singlet", "c1": 0.2, "c2": -0.5, "A4": 0.2, "B4": -0.1}, 0.2, -0.5),
]


@pytest.mark.parametrize("n", [1.33, 1.5, 1.9])
@pytest.mark.parametrize(("lens", "c1", "c2"), LENSES, ids=lambda v: v["surface"] if isinstance(v, dict) else "")
def test_paraxial_foci_are_the_thick_lens_makers(lens: dict[str, Any], c1: float, c2: float, n: float) -> None:
    thickness = make_scene(lens).lenses[0].values["thickness"]
    power = (n - 1) * (c1 - c2 + (n - 1) * thickness * c1 * c2 / n)
    focal, focus = focal_lengths(lens, n)
    assert focal == pytest.approx(1 / power, rel=1e-8)
    assert focus - thickness / 2 == pytest.approx((1 - (n - 1) * thickness * c1 / n) / power, rel=1e-8, abs=1e-8)


def test_turned_about_the_lens_has_the_same_focal_length_and_another_focus() -> None:
    lens = {"surface": "plano_convex", "R": 1.0, "thickness": 0.45}
    front, back = focal_lengths(lens, 1.5), focal_lengths(lens | {"rotate": [180.0, 0.0, 0.0]}, 1.5)
    assert front[0] == pytest.approx(back[0], rel=1e-8)
    assert back[1] - front[1] == pytest.approx(0.45 * 0.5 / 1.5 * 2, rel=1e-6)  # f (n - 1) t / (n R), f = R / (n - 1)


def test_a_focal_length_wrong_by_a_millionth_would_be_seen() -> None:
    lens = {"surface": "biconvex", "R1": 1.5 * (1 + 1e-6), "R2": 1.2}
    power = 0.5 * (1 / 1.5 + 1 / 1.2 - 0.5 * 0.5 / 1.5 / 1.5 / 1.2)
    assert abs(focal_lengths(lens, 1.5)[0] * power - 1) > 1e-7


@pytest.mark.parametrize("n", [1.33, 1.5, 1.9])
def test_a_ball_lens_focuses_at_n_d_over_4_n_minus_1_from_its_centre(n: float) -> None:
    focal, focus = focal_lengths({"surface": "ball", "diameter": 1.2}, n)
    assert focal == pytest.approx(n * 1.2 / (4 * (n - 1)), rel=1e-8)
    assert focus == pytest.approx(focal, rel=1e-8)


@pytest.mark.parametrize("apex", [1.0, 30.0, 60.0, 75.0])
@pytest.mark.parametrize("n", [1.33, 1.5])
def test_a_prism_deviates_least_where_the_ray_crosses_it_alike(apex: float, n: float) -> None:
    lens = {"surface": "prism", "apex": apex, "side": 1.2, "length": 1.2}
    half = math.radians(apex / 2)
    enter = math.asin(n * math.sin(half))  # sin((A + D) / 2) = n sin(A / 2): inside, the ray runs along z
    rng = np.random.default_rng(1)
    offset = np.concatenate([[0.0], rng.uniform(-0.02, 0.02, 40)])
    angle = enter + offset - half
    d = np.stack([0 * angle, np.sin(angle), np.cos(angle)], 1)
    on_front = np.stack([rng.uniform(-0.3, 0.3, 41), 0 * angle, 0 * angle - 0.8 * math.cos(half) * math.tan(half)], 1)
    rays = through(lens, on_front - 3 * d, d, n)
    assert (rays.events == 2).all()
    turned = np.arcsin(np.clip(np.cross(d, rays.direction)[:, 0], -1, 1))  # about x, towards the base
    deviation = 2 * enter - 2 * half
    np.testing.assert_allclose(turned[0], deviation, atol=4e-16, rtol=1e-14)
    assert (turned[1:] > deviation).all()
    assert turned.max() - deviation > 1e-6
    np.testing.assert_allclose(rays.direction[0], [0.0, -d[0, 1], d[0, 2]], atol=1e-15)


def test_from_end_to_end_a_rod_is_a_plate() -> None:
    rng = np.random.default_rng(2)
    length, n = 0.7, 1.6
    d = rng.normal(size=(500, 3)) * [0.3, 0.3, 0.0] + ALONG
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    start = np.stack([*rng.uniform(-0.4, 0.4, (2, 500)), np.full(500, -length / 2)], 1)
    rays = through({"surface": "rod", "diameter": 4.0, "length": length}, start - 2 * d, d, n)
    assert (rays.events == 2).all()
    np.testing.assert_allclose(rays.direction, d, atol=3e-16)
    sine = np.hypot(d[:, 0], d[:, 1])
    inside = np.arcsin(sine / n)
    shifted = np.linalg.norm(np.cross(rays.origin - start, d), axis=1)
    np.testing.assert_allclose(shifted, length / np.cos(inside) * np.sin(np.arcsin(sine) - inside), atol=1e-15)
    assert shifted.max() > 0.1


@pytest.mark.parametrize("height", [0.02, 0.2, 0.4])
def test_an_axicon_turns_all_collimated_light_by_one_angle(height: float) -> None:
    lens = {"surface": "cone", "diameter": 1.4, "height": height}
    radius = np.linspace(1e-9, 0.699, 200)
    slope = math.atan2(height, 0.7)
    out = math.asin(1.5 * math.sin(slope)) - slope  # n sin a = sin(a + b)
    for azimuth in (0.0, 0.4, 2.0):
        rays = through(lens, collimated(radius, azimuth), ALONG)
        assert (rays.events == 2).all()
        want = [-math.sin(out) * math.cos(azimuth), -math.sin(out) * math.sin(azimuth), math.cos(out)]
        np.testing.assert_allclose(rays.direction, np.broadcast_to(want, (200, 3)), atol=2e-15)


@pytest.mark.parametrize("n", [1.33, 1.5, 2.4])
def test_a_plano_hyperbolic_lens_focuses_without_aberration(n: float) -> None:
    radius, thickness = 0.8, 0.6
    lens = {"surface": "conic_singlet", "c1": 0.0, "c2": -1 / radius, "k2": -(n**2), "thickness": thickness}
    height = np.linspace(-0.69, 0.69, 121)
    rays = through(lens, collimated(height), ALONG, n)
    assert (rays.events == 2).all()
    to_focus = np.array([0.0, 0.0, thickness / 2 + radius / (n - 1)]) - rays.origin
    assert np.linalg.norm(np.cross(to_focus, rays.direction), axis=1).max() < 1e-12
    # The twin, a sphere, does not
    rays = through(lens | {"k2": 0.0}, collimated(height), ALONG, n)
    to_focus = to_focus + 0 * rays.origin
    assert np.linalg.norm(np.cross(to_focus, rays.direction), axis=1).max() > 1e-2


def test_even_terms_that_follow_a_hyperboloid_focus_to_their_order() -> None:
    """A sphere with the hyperboloid's r^4, r^6 and r^8 is wrong by r^10, which bends rays by r^9 only."""
    n, c = 1.5, -1.25
    one_k = 1 - n**2
    series = [c**3 / 8, c**5 / 16, 5 * c**7 / 128]  # of the sag of 1 + k = 1, times (1 + k)^j
    even = {f"B{4 + 2 * j}": s * (one_k ** (j + 1) - 1) for j, s in enumerate(series)}
    lens = {"surface": "even_asphere_singlet", "c1": 0.0, "c2": c, "thickness": 0.6}
    focus = np.array([0.0, 0.0, 0.3 - 1 / (c * (n - 1))])

    def miss(extra: dict[str, float], height: float) -> float:
        rays = through(lens | extra, collimated([height]), ALONG, n)
        return float(np.linalg.norm(np.cross(focus - rays.origin, rays.direction), axis=1)[0])

    assert math.log2(miss({}, 0.2) / miss({}, 0.1)) == pytest.approx(3, abs=0.2)
    assert math.log2(miss(even, 0.3) / miss(even, 0.15)) == pytest.approx(9, abs=0.5)
    assert miss(even, 0.3) < 0.01 * miss({}, 0.3)
    for left_out in even:
        assert miss(even | {left_out: 0.0}, 0.3) > 3 * miss(even, 0.3)


def test_an_even_asphere_without_even_terms_is_the_conic_singlet() -> None:
    rng = np.random.default_rng(3)
    shape = {"c1": 0.8, "k1": -0.7, "c2": -0.5, "k2": 1.2, "thickness": 0.6, "diameter": 1.4}
    d = rng.normal(size=(4000, 3)) * 0.5 + ALONG
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    o = rng.uniform(-0.7, 0.7, (4000, 3)) - 4 * d
    one, other = (through({"surface": f"{name}_singlet", **shape}, o, d) for name in ("conic", "even_asphere"))
    assert (one.events > 1).sum() > 2000
    np.testing.assert_array_equal(one.events, other.events)
    few = one.events <= 4
    np.testing.assert_allclose(one.direction[few], other.direction[few], atol=1e-11)
    assert np.median(np.abs(one.direction - other.direction)[few].max(1)) < 1e-15


def test_one_lens_by_radii_by_curvatures_and_of_a_ball_is_one_lens() -> None:
    rng = np.random.default_rng(4)
    d = rng.normal(size=(3000, 3)) * 0.3 + ALONG
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    o = rng.uniform(-0.7, 0.7, (3000, 3)) - 4 * d
    rim = {"thickness": 0.6, "diameter": 1.4}
    alike: list[tuple[dict[str, Any], dict[str, Any]]] = [
        ({"surface": "biconvex", "R1": 1.25, "R2": 2.0, **rim}, {"c1": 0.8, "c2": -0.5, **rim}),
        ({"surface": "meniscus", "R1": 1.25, "R2": 2.0, **rim}, {"c1": 0.8, "c2": 0.5, **rim}),
        ({"surface": "plano_convex", "R": 1.25, **rim}, {"c1": 0.8, "c2": 0.0, **rim}),
        ({"surface": "ball", "diameter": 1.0}, {"c1": 2.0, "c2": -2.0, "thickness": 1.0, "diameter": 1.0}),
    ]
    for lens, conic in alike:
        one, other = through(lens, o, d), through({"surface": "conic_singlet", **conic}, o, d)
        assert (one.events > 0).sum() > 500
        np.testing.assert_array_equal(one.events, other.events)
        few = one.events <= 2
        np.testing.assert_allclose(one.direction[few], other.direction[few], atol=1e-10)


@pytest.mark.parametrize("name", ["biconvex", "plano_convex", "meniscus", "rod", "prism", "cone", "conic_singlet"])
def test_a_normal_is_that_of_the_face_that_is_met(name: str) -> None:
    """From the law of refraction alone: n2 t - n1 d lies along the normal."""
    scene = make_scene({"surface": name, "n": 1.3}, numerics={"max_events": 1})
    values = scene.lenses[0].values
    rng = np.random.default_rng(5)
    d = rng.normal(size=(3000, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    low, high = (np.array(corner) for corner in scene.lenses[0].surface.box(values))
    rays = trace_rays(scene, rng.uniform(low, high, (3000, 3)) - 4 * d, d)
    met = rays.events == 1
    normal = (d - 1.3 * rays.direction)[met]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    p = rays.origin[met].astype(np.longdouble)
    faces = analytic.FACES[name](values)
    on = np.argmin([np.abs(face.beyond(p)) for face in faces], 0)
    want = np.stack([face.slope(p) for face in faces])[on, np.arange(len(p))]
    want /= np.linalg.norm(want.astype(float), axis=1, keepdims=True)
    assert np.bincount(on, minlength=len(faces)).min() > 30, "every face is met"
    np.testing.assert_allclose(normal, want.astype(float), atol=2e-14)
