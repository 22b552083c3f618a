"""What effects make of mirrors: reflectance 1, the medium kept, the derivative and the light on the picture right."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from effects.slopes import slopes
from faults_in_kernels import Fault, broken
from numpy.typing import NDArray
from scenes import make_scene

from lenscl import RayStatus, trace, trace_rays
from lenscl.config import Scene

Array = NDArray[np.float64]
DOWN = ([[0.0, 0.0, 3.0]], [[0.0, 0.0, -1.0]])
BLOCK = {"surface": "box", "n": 1.5, "mirror": ["-z"]}
SEEN = {"centre": [0.0, 0.0, 6.0]}  # a picture behind the source, where a mirror sends the light
MANGIN = {"surface": "meniscus", "rotate": [180.0, 0.0, 0.0], "n": 1.5, "mirror": ["back"]}
FAR = {"centre": [0.0, 0.0, -60.0]}
CURVED: dict[str, tuple[dict[str, Any], ...]] = {
    "ball": ({"surface": "ellipsoid", "a": 0.9, "b": 0.6, "c": 0.7, "rotate": [10.0, 20.0, 30.0], "mirror": True},),
    "behind glass": (MANGIN,),
    "in glass": (
        {"surface": "sphere", "name": "glass", "r": 0.9, "n": 1.4},
        {"surface": "torus", "name": "ring", "R": 0.4, "r": 0.15, "rotate": [50.0, 10.0, 0.0], "mirror": True},
    ),
}


def seen(*lenses: dict[str, Any], **effects: Any) -> Scene:
    return make_scene(*lenses, picture=SEEN, film={"size": [20, 20]}, effects=effects)


@pytest.mark.parametrize("kind", [True, "polarised", "split"])
def test_a_mirror_reflects_all_and_the_glass_before_it_takes_its_share(kind: Any) -> None:
    effects = {"fresnel": kind}
    rays = trace_rays(make_scene(BLOCK, effects=effects), *DOWN)
    assert rays.events[0] == 3
    assert rays.transmittance[0] == pytest.approx(0.96**2, abs=1e-15)
    ball = trace(seen(*CURVED["ball"], **effects))
    assert (ball.events == 1).sum() > 50
    np.testing.assert_array_equal(ball.transmittance, 1.0)
    if kind == "split":
        assert not ball.reflectance.any()  # the reflection is the path itself
        glass = trace(seen(MANGIN, **effects))
        assert (glass.reflectance[glass.events == 3] >= 0.04 - 1e-12).all()


def plate(azimuth: float, z: float, n: float) -> dict[str, Any]:
    """Return a thin plate of glass, at Brewster's angle to rays along z; its plane of incidence holds the azimuth."""
    angle = np.degrees(np.arctan(n))
    return {"surface": "box", "a": 0.6, "b": 0.6, "c": 0.05, "n": n, "rotate": [angle, 0.0, azimuth],
            "centre": [0.0, 0.0, z]}  # fmt: skip


def carried(scene: Scene, start: Array, d: Array, events: int) -> float:
    """Return the power of unpolarised light along a path, by two fields that are carried as vectors in space.

    At glass the parts of a field across and in the plane of incidence are weakened apart. A mirror takes the mirror
    image of a field, the other way round: the tangential part vanishes on it.
    """
    points, ways = [start], [d]
    for k in range(1, events + 1):
        ends = trace_rays(scene.replace({"numerics.max_events": k}), [start], [d])
        points.append(ends.origin[0])
        ways.append(ends.direction[0])
    first = np.cross(d, [0.3, 0.9, 0.1])
    first /= np.linalg.norm(first)
    power = 0.0
    for field in (first, np.cross(d, first)):
        inside = False
        for before, after in pairwise(ways):
            if before @ after < 0.9:  # mirrors turn it by far more than the plates
                normal = (before - after) / np.linalg.norm(before - after)
                field = -(field - 2 * (field @ normal) * normal)
                continue
            n1, n2 = (1.5, 1.0) if inside else (1.0, 1.5)
            inside = not inside
            change = n1 * before - n2 * after
            normal = change / np.linalg.norm(change)
            c1, c2 = abs(before @ normal), abs(after @ normal)
            s = np.cross(before, normal)
            s /= np.linalg.norm(s)
            weights = [2 * np.sqrt(n1 * c1 * n2 * c2) / q for q in (n1 * c1 + n2 * c2, n2 * c1 + n1 * c2)]
            field = weights[0] * (field @ s) * s + weights[1] * (field @ np.cross(before, s)) * np.cross(after, s)
        power += 0.5 * float(field @ field)
    return power


def polarised_scene() -> Scene:
    """Return two plates before a tilted mirror, all planes of incidence different."""
    mirror = {"surface": "box", "a": 1.0, "b": 1.0, "c": 0.02, "mirror": True}
    lenses = [
        plate(40.0, 2.7, 1.5) | {"name": "before"},
        plate(0.0, 2.0, 1.5) | {"name": "first"},
        mirror | {"name": "low", "rotate": [45.0, 0.0, 25.0]},
    ]  # fmt: skip
    return make_scene(*lenses, picture=FAR, effects={"fresnel": "polarised"})


def check_polarised() -> None:
    scene = polarised_scene()
    start, d = np.array([0.02, 0.01, 3.5]), np.array([0.0, 0.0, -1.0])
    end = trace_rays(scene, [start], [d])
    assert end.events[0] == 5
    # A second plate far along the way, across it at a slant: what it lets on hangs on how the light is polarised
    way = end.direction[0]
    far = end.origin[0] + 3.0 * way
    slant = {
        "surface": "box", "a": 2.0, "b": 2.0, "c": 0.05, "n": 1.5, "rotate": [50.0, 35.0, 0.0], "centre": far.tolist(),
        "name": "last",
    }  # fmt: skip
    lenses = [dict(lens) for lens in scene.document()["lens"]]
    whole = make_scene(*lenses, slant, picture=FAR, effects={"fresnel": "polarised"})
    found = trace_rays(whole, [start], [d])
    assert found.events[0] == 7
    assert found.transmittance[0] == pytest.approx(carried(whole, start, d, 7), abs=1e-13)


def test_mirrors_keep_polarised_light_as_ideal_conductors_do() -> None:
    check_polarised()


@pytest.mark.parametrize(
    "fault",
    [
        Fault(
            "handedness kept", "effects/mirror_polarised.cl", "lanes ? -ray->polarised_u", "lanes ? ray->polarised_u"
        ),
        Fault("axis kept", "effects/mirror_polarised.cl", "mirrored(old, met->normal)", "old"),
    ],
    ids=lambda fault: fault.name,
)
def test_a_mirror_that_mixes_up_polarised_light_is_caught(fault: Fault) -> None:
    with broken(fault), pytest.raises(AssertionError):
        check_polarised()


@pytest.mark.parametrize("nested", [False, True])
def test_path_and_absorption_go_by_the_medium_on_both_sides(nested: bool) -> None:
    block = BLOCK | {"name": "block", "absorption": [0.3, 0.0, 1.0]}
    under = {"surface": "box", "name": "under", "centre": [0.0, 0.0, -1.0]}
    scene = make_scene(block, *([under] if nested else []), picture=SEEN,
                       effects={"path_length": True, "absorption": True})  # fmt: skip
    assert ("_nested" in scene_text(scene)) == nested
    film = trace(scene.replace({"film.size": [1, 1]}))
    assert film.events[0, 0] == 3
    assert film.path_length[0, 0] == pytest.approx(3.5 + 1.5 * 2 + 5.5, abs=1e-14)
    np.testing.assert_allclose(film.transmission[0, 0], np.exp([-0.6, 0.0, -2.0]), rtol=1e-14)
    metal = trace(make_scene({"surface": "sphere", "mirror": True}, picture=SEEN, film={"size": [1, 1]}, medium=1.33,
                             effects={"path_length": True}))  # fmt: skip
    assert metal.path_length[0, 0] == pytest.approx(1.33 * (3.0 + 5.0), abs=1e-14)


def scene_text(scene: Scene) -> str:
    return str(trace(scene.replace({"film.size": [1, 1]})).kernel.text)


@pytest.mark.parametrize("neighbour", [False, True])
def test_what_is_no_mirror_of_an_opaque_solid_takes_light(neighbour: bool) -> None:
    lens = {"surface": "box", "mirror": ["+z"], "absorbs": True, "name": "a"}
    more = [{"surface": "box", "name": "b", "centre": [0.9, 0.0, 0.0], "priority": -1.0}] if neighbour else []
    rays = trace_rays(make_scene(lens, *more), [[0.1, 0.2, 3.0], [-3.0, 0.1, 0.2]], [[0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    assert rays.status.tolist() == [RayStatus.BEHIND, RayStatus.BLOCKED]
    assert rays.events.tolist() == [1, 1]
    np.testing.assert_array_equal(rays.direction, [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])


@pytest.mark.parametrize("name", CURVED)
def test_footprints_are_the_derivative_of_the_map(name: str) -> None:
    raymap = trace(seen(*CURVED[name], footprint=True))
    rows, columns = (each.ravel().astype(float) for each in np.indices(raymap.status.shape))
    true = slopes(raymap.scene, rows, columns)
    told = (true.error < 1e-7) & (raymap.events.ravel() > 0) & (raymap.st.reshape(-1, 2) != -1).any(axis=1)
    assert told.sum() > 12
    off = np.abs(raymap.jacobian.reshape(-1, 2, 2) - true.jacobian)[told].max(axis=(1, 2))
    assert (off / np.abs(true.jacobian[told]).max(axis=(1, 2))).max() < 1e-6


def test_a_mirror_has_no_dispersion() -> None:
    raymap = trace(seen(*CURVED["ball"], dispersion=[450.0, 550.0, 650.0]))
    assert (raymap.events == 1).sum() > 100
    np.testing.assert_array_equal(raymap.st, np.broadcast_to(raymap.st[:1], raymap.st.shape))


def test_a_mirrored_ray_is_not_ended_as_totally_reflected() -> None:
    lens = {"surface": "box", "n": 1.5, "mirror": ["-z"]}
    rays = trace_rays(
        make_scene(lens, effects={"total_reflection": "end"}),
        [[0.0, 0.0, 0.3]] * 2,
        [[0.1, 0.0, -1.0], [1.0, 0.0, 0.9]],
    )
    assert rays.status.tolist() == [RayStatus.BEHIND, RayStatus.TOTAL_REFLECTION]


def test_what_is_a_mirror_all_over_calls_for_no_total_reflection() -> None:
    assert "follow_total_reflection" not in scene_text(seen({"surface": "torus", "n": 0.5, "mirror": True}))
    assert "follow_total_reflection" in scene_text(seen({"surface": "torus", "n": 0.5}))
    assert "mirror_interface" not in scene_text(seen({"surface": "sphere", "n": 0.5, "mirror": False}))


def test_a_mirror_sends_rays_to_lenses_beside_the_film() -> None:
    mirror = {"surface": "box", "name": "mirror", "c": 0.1, "rotate": [45.0, 0.0, 0.0], "mirror": True}
    lens = {"surface": "sphere", "name": "lens", "r": 0.5, "centre": [0.0, -3.0, 0.0]}
    events = trace(make_scene(mirror, lens)).events
    assert (events == 3).sum() > 50


def test_a_flat_mirror_lights_the_picture_from_the_sources_image() -> None:
    plate = {"surface": "box", "a": 9.0, "b": 9.0, "c": 0.5, "centre": [0.0, 0.0, -0.25], "mirror": True}
    picture = {"centre": [0.0, 0.0, 5.0], "size": [30, 30], "right": [2.0, 0.0, 0.0], "down": [0.0, -2.0, 0.0]}
    raymap = trace(make_scene(plate, picture=picture, effects={"caustics": True}))
    places = (np.arange(30) + 0.5) / 15 - 1
    square = places[:, None] ** 2 + places**2
    # The source is 1 below the picture's plane, its image in the mirror 9 below
    true = 9 / (square + 81) ** 1.5 * (square + 1) ** 1.5
    np.testing.assert_allclose(raymap.irradiance, true, rtol=2e-3)
