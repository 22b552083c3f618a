"""Prescriptions as people publish them, their solids in contact: against paraxial matrices and sequential tracing."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from physics.arranged import CROWN, FLINT, PICTURE, Array, Lens, followed, here, scene_of, user
from physics.test_arrangements import _spheres
from scenes import make_scene

from lenscl import RayStatus, trace
from lenscl.accuracy import check_map

# Le Grand's full theoretical eye, millimetres: radii, thicknesses and indices of cornea, aqueous, lens and vitreous
EYE_RADII, EYE_DEPTHS = (7.8, 6.5, 10.2, -6.0), (0.55, 3.05, 4.0)
EYE_INDICES = (1.0, 1.3771, 1.3374, 1.42, 1.336)
EYE_LENGTH = 24.1966  # from the cornea to where parallel light is gathered: as published
# A port of glass between water and air
PORT = {"water": 1.33, "glass": 1.5168, "air": 1.0}


def system(curvatures: Sequence[float], depths: Sequence[float], n: Sequence[float]) -> Array:
    """Return the matrix of a sequence of spheres for (height, n times slope), from the first vertex to the last."""
    matrix = np.eye(2)
    for i, c in enumerate(curvatures):
        matrix = np.array([[1.0, 0.0], [-c * (n[i + 1] - n[i]), 1.0]]) @ matrix
        if i < len(depths):
            matrix = np.array([[1.0, depths[i] / n[i + 1]], [0.0, 1.0]]) @ matrix
    return matrix


def eye(z: float | None = None, **more: Any) -> Any:
    """Return the four media in contact, the cornea's vertex at the origin, and the retina in the vitreous, or on it."""
    z = EYE_LENGTH if z is None else z
    c = [*(1.0 / r for r in EYE_RADII), 0.0]
    depths = [*EYE_DEPTHS, 18.0]
    lenses, at = [], 0.0
    for number, (first, last) in enumerate(pairwise(c)):
        name = ("cornea", "aqueous", "lens", "vitreous")[number]
        lenses.append({
            "surface": "conic_singlet", "name": name, "n": EYE_INDICES[number + 1], "c1": first, "c2": last,
            "thickness": depths[number], "diameter": 8.0, "centre": [0.0, 0.0, at + depths[number] / 2],
        })  # fmt: skip
        at += depths[number]
    picture = {"corner": [-1.0, 1.0, z], "right": [2.0, 0.0, 0.0], "down": [0.0, -2.0, 0.0]}
    return make_scene(
        *lenses, picture=picture, source={"kind": "parallel", "direction": [0.0, 0.0, 1.0]},
        film={"centre": [0.0, 0.0, -3.0], "right": [2.0, 0.0, 0.0], "down": [0.0, -2.0, 0.0], "size": [11, 11]}, **more,
    )  # fmt: skip


def _up(heights: Array, below: float) -> tuple[Array, Array]:
    origins = np.column_stack([heights, 0.5 * heights, np.full(heights.size, below)])
    return origins, np.tile([0.0, 0.0, 1.0], (heights.size, 1))


@pytest.mark.parametrize("precision", ["double", "mixed"])
def test_a_cemented_doublet_has_the_focal_lengths_of_its_prescription(precision: str) -> None:
    curvatures = [CROWN["c1"], CROWN["c2"], FLINT["c2"]]
    matrix = system(curvatures, [4.0, 2.5], [1.0, CROWN["n"], FLINT["n"], 1.0])
    focal, back = -1.0 / matrix[1, 0], -matrix[0, 0] / matrix[1, 0]
    ends = followed(scene_of(CROWN, FLINT), _up(np.array([1e-3]), -20.0), precision)
    assert ends.events.tolist() == [3]
    slope = ends.direction[0, 0] / ends.direction[0, 2]
    assert -1e-3 / slope == pytest.approx(focal, rel=1e-8)
    crosses = ends.origin[0, 2] - ends.origin[0, 0] / slope  # the axis, behind the last vertex at 6.5
    assert crosses == pytest.approx(6.5 + back, rel=1e-8)
    assert 50.0 < focal < 120.0


def test_an_eye_of_four_media_in_contact_gathers_light_where_it_is_published() -> None:
    matrix = system([1.0 / r for r in EYE_RADII], EYE_DEPTHS, EYE_INDICES)
    beyond = -EYE_INDICES[-1] * matrix[0, 0] / matrix[1, 0]
    assert sum(EYE_DEPTHS) + beyond == pytest.approx(EYE_LENGTH, abs=5e-5)
    heights = np.array([1e-4, 0.5, 1.5])
    origins, ahead = _up(heights, -3.0)
    ends = followed(eye(), (origins, ahead))
    assert ends.events.tolist() == [4, 4, 4]
    assert (ends.status == RayStatus.PICTURE).all()
    vertices = [0.0, 0.55, 3.6, 7.6]
    expected = _spheres(origins, ahead, list(zip(vertices, (1.0 / r for r in EYE_RADII), strict=True)), EYE_INDICES)
    assert np.abs(ends.direction - expected).max() < 1e-14
    slope = ends.direction[0, 0] / ends.direction[0, 2]
    assert ends.origin[0, 2] - ends.origin[0, 0] / slope == pytest.approx(EYE_LENGTH, abs=5e-5)
    at_retina = 2.0 * np.abs(ends.st[0] - 0.5)
    assert at_retina.max() < 1e-8, "a paraxial ray meets the axis there, within the vitreous"


def test_the_eye_is_decided_everywhere_and_raises_no_alarm() -> None:
    for precision in ("double", "single", "mixed"):
        raymap = trace(eye(), precision=precision, device=here())
        assert (raymap.status == RayStatus.PICTURE).all()
        assert (raymap.events == 4).all()
        check = check_map(raymap)
        assert check.failures == (), [str(failure) for failure in check.failures]
        assert check.checked >= 32


@pytest.mark.parametrize("written", ["touching", "nested"])
def test_a_flat_port_bends_by_the_outer_media_alone(written: str) -> None:
    """Water, glass and air in plane layers that touch: what leaves has the angle of a single face of water and air."""
    box = "max(abs(x) - 3, abs(y) - 3, abs(z) - h)"
    bounds = {"bounds": [[-3.2] * 3, [3.2] * 3]}
    water = user(box, n=PORT["water"], h=1.0, centre=[0.0, 0.0, 1.1]) | bounds
    glass = user(box, n=PORT["glass"], h=0.1) | bounds
    if written == "nested":
        water |= {"h": 1.1, "centre": [0.0, 0.0, 1.0]}  # down to the outer face of the glass, which is laid into it
    scene = scene_of(water, glass, picture=PICTURE | {"corner": [-4.0, 4.0, -1.0]})
    angle = np.radians([0.0, 10.0, 30.0, 45.0])
    ahead = np.column_stack([np.sin(angle), 0.0 * angle, -np.cos(angle)])
    ends = followed(scene, (np.tile([0.0, 0.0, 1.0], (4, 1)), ahead))
    assert ends.events.tolist() == [2] * 4
    np.testing.assert_allclose(ends.direction[:, 0], PORT["water"] * np.sin(angle), rtol=0, atol=1e-15)
    tangents = [np.tan(np.arcsin(PORT["water"] * np.sin(angle) / n)) for n in PORT.values()]
    x = 0.9 * tangents[0] + 0.2 * tangents[1] + 0.9 * tangents[2]
    np.testing.assert_allclose(ends.st, np.column_stack([(x + 4.0) / 8.0, 0.0 * x + 0.5]), rtol=0, atol=4e-16)


def test_prisms_of_one_glass_go_straight_on_and_lose_only_at_the_outer_faces() -> None:
    half = "max(max(abs(x), abs(y), abs(z)) - 0.5, {})"
    prisms: list[Lens] = [user(half.format(cut), n=1.5) for cut in ("x - z", "z - x")]
    source = {"kind": "parallel", "direction": [0.0, 0.0, -1.0]}
    film = {"right": [0.9, 0.0, 0.0], "down": [0.0, -0.9, 0.0], "size": [8, 8]}
    for fresnel in (True, "polarised"):
        raymap = trace(scene_of(*prisms, source=source, film=film, effects={"fresnel": fresnel}), device=here())
        assert (raymap.events == 3).all()
        np.testing.assert_allclose(raymap.transmittance, 0.96**2, rtol=1e-14)
    for n, events in ((1.5, 3), (1.45, 3), (1.0, None)):  # cement of two glasses reflects totally below 1.06
        pair = [prisms[0], prisms[1] | {"n": n}]
        ends = followed(scene_of(*pair), (np.array([[0.1, 0.05, 2.0]]), np.array([[0.0, 0.0, -1.0]])))
        assert events is None or ends.events[0] == events
        is_through = abs(ends.direction[0, 2]) > 0.5
        assert is_through == (n > 1.06)
