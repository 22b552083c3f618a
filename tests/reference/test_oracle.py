"""The certified oracle against closed forms in 60 digits, against itself at more bits, and where nobody can tell."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
from scenes import forerunner, make_scene

from lenscl import RayStatus, trace
from lenscl.errors import LensclError
from lenscl.reference.oracle import Proof, prove_pixels, prove_rays

DIGITS = 60
FINE = 1e-30


@pytest.fixture(autouse=True)
def many_digits() -> Any:
    with mpmath.workdps(DIGITS):
        yield


def aimed(count: int, seed: int, reach: float = 0.5) -> tuple[Any, Any]:
    rng = np.random.default_rng(seed)
    origins = rng.uniform(-1, 1, (count, 3)) + np.array([0, 0, 4])
    return origins, rng.uniform(-reach, reach, (count, 3)) - origins


def ellipsoid_by_hand(scene: Any, axes: Any, origin: Any, direction: Any) -> Any:
    """Return (s, t) behind an unturned ellipsoid at the world's origin: quadratics and Snell's law by angles."""

    def dot(a: Any, b: Any) -> Any:
        return sum(x * y for x, y in zip(a, b, strict=True))

    def bend(d: Any, normal: Any, ratio: Any) -> Any:
        cosine = -dot(d, normal)
        across = [x + cosine * y for x, y in zip(d, normal, strict=True)]
        angle = mpmath.asin(ratio * mpmath.sqrt(dot(across, across)))
        length = mpmath.sqrt(dot(across, across))
        return [mpmath.sin(angle) * x / length - mpmath.cos(angle) * y for x, y in zip(across, normal, strict=True)]

    p = [mpmath.mpf(float(x)) for x in origin]
    d = [mpmath.mpf(float(x)) for x in direction]
    d = [x / mpmath.sqrt(dot(d, d)) for x in d]
    n = mpmath.mpf(scene.lenses[0].n) / mpmath.mpf(scene.n_medium)
    for turn in (-1, 1):
        u, v = ([x / mpmath.mpf(a) for x, a in zip(w, axes, strict=True)] for w in (p, d))
        a, b, c = dot(v, v), dot(u, v), dot(u, u) - 1
        root = mpmath.sqrt(b * b - a * c)
        p = [x + (-b + turn * root) / a * y for x, y in zip(p, d, strict=True)]
        normal = [x / mpmath.mpf(k) ** 2 for x, k in zip(p, axes, strict=True)]
        size = mpmath.sqrt(dot(normal, normal))
        d = bend(d, [-turn * x / size for x in normal], 1 / n if turn < 0 else n)
    picture = scene.picture
    away = (mpmath.mpf(picture.corner[2]) - p[2]) / d[2]
    return [
        (p[i] + away * d[i] - mpmath.mpf(picture.corner[i])) / mpmath.mpf(span[i])
        for i, span in ((0, picture.right), (1, picture.down))
    ]


@pytest.mark.parametrize("axes", [(0.8, 0.8, 0.8), (1.0, 0.8, 0.6), (0.9, 0.7, 2.0**-12)])
def test_spheres_and_ellipsoids_to_thirty_digits(axes: tuple[float, float, float]) -> None:
    a, b, c = axes
    surface = {"surface": "sphere", "r": a} if a == b == c else {"surface": "ellipsoid", "a": a, "b": b, "c": c}
    scene = make_scene({**surface, "n": 1.4})
    origins, directions = aimed(60, 3)
    proofs = prove_rays(scene, origins, directions, FINE)
    checked = 0
    for proof, o, d in zip(proofs, origins, directions, strict=True):
        assert proof.status is not None, proof.reason
        if proof.events == 2 and proof.st is not None:
            checked += 1
            for ball, exact in zip(proof.st, ellipsoid_by_hand(scene, axes, o, d), strict=True):
                middle = mpmath.mpf(ball.mid().str(50, radius=False))
                assert abs(middle - exact) <= FINE * (1 + abs(exact))
            assert proof.radius <= FINE
    assert checked > 20


def test_a_conic_with_a_spherical_back_brings_parallel_light_to_its_focus() -> None:
    """An ellipsoid of eccentricity 3/5 = n_medium / n_lens, cut by a sphere round its far focus: exact."""
    lens = {
        "surface": "max(max(x^2/16 + y^2/16 + z^2/25 - 1, 1 - (x^2 + y^2 + (z + 3)^2)), -2.5 - z)",
        "bounds": [[-4.5, -4.5, -3.0], [4.5, 4.5, 5.5]], "n": 5.0,
    }  # fmt: skip
    picture = {"corner": [-1.0, 1.0, -3.0], "right": [2.0, 0.0, 0.0], "down": [0.0, -2.0, 0.0]}
    scene = make_scene(lens, medium=3.0, picture=picture)
    heights = [(0.3 * k, 0.2 * k) for k in range(-5, 6)]
    for proof in prove_rays(scene, [(x, y, 9.0) for x, y in heights], [(0, 0, -1)] * len(heights), FINE):
        assert (proof.status, proof.events) == (RayStatus.PICTURE, 2)
        assert proof.distance(0.5, 0.5) <= 2 * FINE


def test_more_bits_say_the_same_more_closely() -> None:
    scene = forerunner("bifolia", 32)
    pixels = range(0, 1024, 31)
    for coarse, fine in zip(prove_pixels(scene, pixels), prove_pixels(scene, pixels, 1e-90), strict=True):
        assert (coarse.status, coarse.events) == (fine.status, fine.events)
        if coarse.st is not None and fine.st is not None:
            assert fine.bits > coarse.bits
            assert fine.radius <= 1e-90 < coarse.radius
            assert all(a.overlaps(b) for a, b in zip(coarse.st, fine.st, strict=True))


@pytest.mark.parametrize("name", ["ellipsoid", "torus", "heart", "bifolia"])
def test_film_rays_of_the_forerunners_scenes_end_as_the_kernels_say(name: str) -> None:
    scene = forerunner(name, 32)
    raymap = trace(scene)
    lens_rays = np.flatnonzero(raymap.events.ravel() > 0)[::5]
    others = np.flatnonzero(raymap.events.ravel() == 0)[::60]
    assert len(lens_rays) > 20
    pixels = np.concatenate([lens_rays, others])
    for pixel, proof in zip(pixels, prove_pixels(scene, pixels), strict=True):
        assert proof.status == RayStatus(int(raymap.status.ravel()[pixel])), proof.reason
        assert proof.events == raymap.events.ravel()[pixel]
        if proof.st is not None and proof.events < 8:  # many events multiply the kernels' rounding
            assert proof.distance(*map(float, raymap.st.reshape(-1, 2)[pixel])) < 1e-9


def test_other_expressions_and_several_lenses() -> None:
    gyroid = "max(abs(sin(3*x)*cos(3*y) + sin(3*y)*cos(3*z) + sin(3*z)*cos(3*x)) - 0.3, x^2 + y^2 + z^2 - 1)"
    scene = make_scene(
        {"name": "g", "surface": gyroid, "bounds": [[-1.1] * 3, [1.1] * 3], "rotate": [10.0, 20.0, 30.0]},
        {"name": "s", "surface": "superellipsoid", "centre": [0.2, 0.1, -1.8], "stretch": [0.5, 0.4, 0.3]},
        {"name": "b", "surface": "biconvex", "centre": [0.0, 0.0, 1.9], "stretch": [0.5, 0.5, 0.5]},
        film={"size": [12, 12]},
    )
    raymap = trace(scene)
    proofs = prove_pixels(scene, range(144))
    told = [k for k, proof in enumerate(proofs) if proof.status is not None]
    assert len(told) > 130
    assert [proofs[k].status for k in told] == [RayStatus(int(raymap.status.ravel()[k])) for k in told]
    assert [proofs[k].events for k in told] == raymap.events.ravel()[told].tolist()
    assert np.unique(raymap.events).size > 4


def ball(**numerics: Any) -> Any:
    return make_scene({"surface": "sphere", "r": 1.0, "n": 2.0}, numerics=numerics)


def one(scene: Any, origin: Any, direction: Any) -> Proof:
    (proof,) = prove_rays(scene, [origin], [direction])
    return proof


def test_rays_that_nobody_can_tell_are_undecidable_and_say_why() -> None:
    tangent = one(ball(), (1.0, 0.0, 4.0), (0.0, 0.0, -1.0))
    assert tangent.status is None
    assert "touches" in tangent.reason

    # From the middle of a cube a ray meets the face z = -1 at a sine of 3/5, which is n_medium / n_lens
    cube = {"surface": "max(abs(x) - 1, max(abs(y) - 1, abs(z) - 1))", "bounds": [[-2] * 3, [2] * 3], "n": 5.0}
    critical = one(make_scene(cube, medium=3.0), (0.0, 0.0, 0.0), (3.0, 0.0, -4.0))
    assert critical.status is None
    assert "critical" in critical.reason
    below = one(make_scene(cube, medium=3.0), (0.0, 0.0, 0.0), (3.0 - 2.0**-50, 0.0, -4.0))
    assert (below.status, below.events) == (RayStatus.OFF_PICTURE, 1)

    # s is 0 exactly, which is on the picture
    aside = make_scene({"surface": "sphere", "r": 0.1, "centre": [9.0, 0.0, 0.0]})
    edge = one(aside, (-3.0, 0.0, 4.0), (0.0, 0.0, -1.0))
    assert (edge.status, edge.events) == (RayStatus.PICTURE, 0)
    assert edge.radius == 0.0


def test_starts_on_and_in_a_solid_and_the_ends_of_rays() -> None:
    on = one(ball(), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0))
    assert (on.status, on.events) == (RayStatus.PICTURE, 1)
    leaving = one(ball(), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0))
    assert (leaving.status, leaving.events) == (RayStatus.BEHIND, 0)
    within = one(ball(), (0.0, 0.0, 0.5), (0.0, 0.0, -1.0))
    assert (within.status, within.events) == (RayStatus.PICTURE, 1)
    trapped = one(ball(max_events=5), (0.0, 0.75, 0.0), (1.0, 0.0, 0.0))
    assert (trapped.status, trapped.events) == (RayStatus.TRAPPED, 5)
    ended = one(ball().replace({"effects.total_reflection": "end"}), (0.0, 0.75, 0.0), (1.0, 0.0, 0.0))
    assert (ended.status, ended.events) == (RayStatus.TOTAL_REFLECTION, 1)
    beside = one(ball(), (2.0, 2.0, 4.0), (1.0, 1.0, -1.0))
    assert (beside.status, beside.events) == (RayStatus.OFF_PICTURE, 0)
    parallel = one(ball(), (0.0, 3.0, 4.0), (1.0, 0.0, 0.0))
    assert (parallel.status, parallel.events) == (RayStatus.BEHIND, 0)
    with pytest.raises(LensclError, match="no place"):
        parallel.distance(0.0, 0.0)


def test_parallel_light_and_a_null_lens() -> None:
    scene = make_scene(
        {"surface": "torus", "n": 1.0, "rotate": [90.0, 45.0, 0.0]},
        source={"kind": "parallel", "direction": [0.1, 0.2, -1.0]}, film={"size": [5, 4]},
    )  # fmt: skip
    raymap = trace(scene)
    proofs = prove_pixels(scene, range(20))
    assert [proof.events for proof in proofs] == raymap.events.ravel().tolist()
    assert max(proof.events for proof in proofs) >= 2
    for proof, st in zip(proofs, raymap.st.reshape(-1, 2), strict=True):
        assert proof.distance(*map(float, st)) < 1e-14  # straight on


@pytest.mark.parametrize(
    ("origin", "direction", "told"),
    [
        ((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), r"directions\[1\]: a direction must not be zero"),
        ((0.0, 0.0, 4.0), (0.0, float("inf"), 1.0), r"directions\[1\]: expected three finite numbers"),
        ((0.0, float("nan"), 4.0), (0.0, 0.0, -1.0), r"origins\[1\]: expected three finite numbers"),
        ((0.0, 4.0), (0.0, 0.0, -1.0), r"origins\[1\]: expected three finite numbers"),
    ],
)
def test_what_is_no_ray_is_refused_by_name(origin: tuple[float, ...], direction: tuple[float, ...], told: str) -> None:
    scene = make_scene({"surface": "sphere"})
    with pytest.raises(LensclError, match=told):
        prove_rays(scene, [(0.0, 0.0, 4.0), origin], [(0.0, 0.0, -1.0), direction])


def test_a_shaken_ray_is_turned_behind_that_surface_and_nowhere_else() -> None:
    slab = {"surface": "max(abs(z) - 0.5, x^2 + y^2 - 4)", "bounds": [[-2.1] * 3, [2.1] * 3], "n": 1.5}
    tilt, still = 2.0**-10, (0.0, 0.0, 0.0)

    def shake(ray: int, event: int) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        return still, (tilt, 0.0, 0.0) if (ray, event) == (1, 0) else still

    rays = [[0.0, 0.0, 4.0]] * 2, [[0.0, 0.0, -1.0]] * 2
    straight, tilted = prove_rays(make_scene(slab), *rays, shake=shake)
    assert (straight.events, tilted.events) == (2, 2)
    # One unit of glass along (tilt, 0, -1); behind it the sine is 1.5 times as large, down to z = -2.5
    sine = 1.5 * tilt / math.hypot(tilt, 1.0)
    shift = tilt + 2.0 * sine / math.sqrt(1.0 - sine * sine)
    assert straight.distance(0.5, 0.5) < 1e-20
    assert tilted.distance(0.5 + shift / 6.0, 0.5) < 1e-15


def test_a_shaken_ray_meets_the_normal_of_a_point_beside() -> None:
    """On a ball the normal of a point moved along the surface is turned by as much: the way in is that of a slope."""
    scene = make_scene({"surface": "max(x^2 + y^2 + z^2 - 1, -z)", "bounds": [[-1.1] * 3, [1.1] * 3], "n": 1.5})
    slope, still = 2.0**-10, (0.0, 0.0, 0.0)

    def shake(_: int, event: int) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        return (slope, 0.0, 0.0) if event == 0 else still, still

    shaken = prove_rays(scene, [[0.0, 0.0, 4.0]], [[0.0, 0.0, -1.0]], shake=shake)[0]
    angle = math.atan(slope)
    inside = angle - math.asin(math.sin(angle) / 1.5)  # from the axis, towards it; 1 down to the flat face
    outside = math.asin(1.5 * math.sin(inside))
    shift = math.tan(inside) + 2.5 * math.tan(outside)
    assert shaken.events == 2
    assert shaken.distance(0.5 - shift / 6.0, 0.5) < 1e-15


def test_a_ray_that_few_bits_cannot_tell_is_undecidable_by_them() -> None:
    scene = make_scene({"surface": "sphere"})
    grazing = [[1.0, 0.0, 4.0]], [[-(2.0**-400), 0.0, -1.0]]  # the ball's rim is met 2^-400 inside
    assert prove_rays(scene, *grazing, most_bits=256)[0].status is None
    assert prove_rays(scene, *grazing)[0].status is not None
