"""A picture on, in or before a solid: rays end where they meet it first, in whatever medium that is."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scenes import make_scene

import lenscl
from lenscl import RayStatus, StudyError
from lenscl.config import Scene
from lenscl.reference.oracle import prove_pixels
from lenscl.tracing.job import _rounded

PRECISIONS = ("double", "single", "mixed")
SLAB = {"surface": "max(abs(x) - 2, abs(y) - 2, abs(z) - 0.5)", "bounds": [[-2.1, -2.1, -0.6], [2.1, 2.1, 0.6]]}


def paperweight(z: float, **more: Any) -> Scene:
    """A half ball whose flat face lies at z = 0, above a picture there or beside it."""
    lens = {"surface": "plano_convex", "R": 1.0, "thickness": 1.0, "diameter": 2.0, "n": 1.5, "centre": [0, 0, -0.5]}
    return make_scene(
        {**lens, **more},
        source={"kind": "point", "at": [0.0, 0.0, -8.0]},
        film={"corner": [-0.05, 0.05, -4.0], "right": [0.1, 0, 0], "down": [0, -0.1, 0], "size": [65, 65]},
        picture={"corner": [-1.0, 1.0, z], "right": [2, 0, 0], "down": [0, -2, 0]},
    )


def slab(depth: float, *, sends: str = "point", **more: Any) -> Scene:
    """A slab of glass from z = 0.5 down to -0.5, with a picture in it."""
    picture = {"centre": [0.0, 0.0, 0.5 - depth], "right": [3, 0, 0], "down": [0, -3, 0], **more.pop("picture", {})}
    return make_scene(
        {**SLAB, "n": 1.5, "absorption": [0.1, 0.2, 0.4], **more},
        source={"kind": "point", "at": [0.0, 0.0, 4.0]},
        film={"centre": [0.0, 0.0, 2.0], "right": [0.8, 0, 0], "down": [0, -0.8, 0], "size": [9, 9]},
        picture=picture,
        effects={"path_length": True, "fresnel": True},
    )


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_paperweight_magnifies_n_times(precision: str) -> None:
    """Seen from near its axis, what lies in the middle of a half ball is as large as n times itself."""
    found = lenscl.trace(paperweight(0.0), precision=precision)
    assert (found.status == RayStatus.PICTURE).all()
    assert (found.events == 1).all()
    straight = 0.05 * (2 * 8.0 / 4.0) * 64 / 65 / 2.0  # of s, between the outer pixels of a row
    across = float(found.st[32, 64, 0] - found.st[32, 0, 0])
    assert straight / across == pytest.approx(1.5, rel=2e-3)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_gap_far_below_single_precision_is_a_gap(precision: str) -> None:
    found = lenscl.trace(paperweight(1e-9), precision=precision)
    assert (found.status == RayStatus.PICTURE).all()
    assert (found.events == 2).all()


@pytest.mark.parametrize("depth", [1e-3, 0.25, 0.7, 1.0])
@pytest.mark.parametrize("precision", PRECISIONS)
def test_in_a_slab_rays_land_at_the_apparent_depth(depth: float, precision: str) -> None:
    """At depth 1 the picture lies on the back face: rays do not leave the glass before it."""
    scene = slab(depth)
    found = lenscl.trace(scene, precision=precision)
    assert (found.status == RayStatus.PICTURE).all()
    assert (found.events == 1).all()
    at = 0.8 * (np.arange(9) - 4) / 9  # of the film's pixels; it is half way from the source to z = 0
    x, y = np.meshgrid(at, -at)
    rho = np.hypot(x, y) / 2.0  # tangent of the angle in air
    sine = rho / np.sqrt(1 + rho**2) / 1.5
    inside = depth / np.sqrt(1 - sine**2)
    share = np.divide(3.5 * rho + sine * inside, rho, out=np.zeros_like(rho), where=rho > 0) / 2.0
    close = 1e-5 if precision == "single" else 1e-12
    np.testing.assert_allclose(found.st[..., 0], 0.5 + share * x / 3, atol=close)
    np.testing.assert_allclose(found.st[..., 1], 0.5 - share * y / 3, atol=close)
    path = 3.5 * np.sqrt(1 + rho**2) + 1.5 * inside
    np.testing.assert_allclose(found.added["path_length"], path, rtol=10 * close)
    left = np.exp(-inside[..., None] * np.array([0.1, 0.2, 0.4]))
    np.testing.assert_allclose(found.added["transmission"], left, rtol=10 * close)
    assert found.added["transmittance"][4, 4] == pytest.approx(0.96, rel=10 * close)  # of one face alone


def test_a_picture_before_a_lens_stops_light_where_it_is_told_to() -> None:
    before = {"picture": {"centre": [0.0, 0.0, 1.0], "right": [0.6, 0, 0], "down": [0, -0.6, 0], "size": [8, 8]}}
    film = {"right": [0.4, 0, 0], "down": [0, -0.4, 0], "size": [9, 9]}
    kept, stopped = (
        lenscl.trace(
            make_scene({"surface": "sphere", "r": 0.5}, film=film, picture={**before["picture"], "stops": asked})
        )
        for asked in ("auto", True)
    )
    assert (kept.status == RayStatus.BEHIND).any()
    assert (kept.events[kept.status == RayStatus.BEHIND] == 2).all()
    on = stopped.status == RayStatus.PICTURE
    assert on.sum() > 20
    assert (stopped.events[on] == 0).all()
    assert (stopped.status[~on] == kept.status[~on]).all()
    assert kept.kernel.structure.nests == ()


def test_a_plane_that_is_cut_beside_the_picture_is_no_matter() -> None:
    aside = {"corner": [3.0, 1.0, 0.0], "right": [2, 0, 0], "down": [0, -2, 0]}
    found = lenscl.trace(make_scene({"surface": "sphere", "r": 0.5}, film={"size": [8, 8]}, picture=aside))
    assert found.kernel.structure.nests == ()


def test_a_picture_in_a_solid_that_is_to_stop_nothing_is_refused() -> None:
    with pytest.raises(StudyError, match=r'^picture\.stops: the picture may lie on or in lens, .* use "auto" or true'):
        lenscl.trace(slab(0.5, picture={"stops": False}))


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("tilt", [0.0, 0.4])
def test_pictures_that_cut_solids_end_rays_as_is_proved(precision: str, tilt: float) -> None:
    ball = {"name": "ball", "surface": "sphere", "r": 0.5, "n": 1.5}
    ring = {"name": "ring", "surface": "torus", "R": 0.6, "r": 0.2, "n": 1.7, "rotate": [60.0, 10.0, 0.0]}
    screen = {"centre": [0.0, 0.0, 0.1], "right": [0.9, 0, 0.9 * tilt], "down": [0, -0.7, 0]}
    scene = make_scene(
        ball, ring, film={"right": [1, 0, 0], "down": [0, -1, 0], "size": [15, 15]}, picture=screen,
        effects={"total_reflection": "follow"},
    )  # fmt: skip
    found = lenscl.trace(scene, precision=precision)
    proofs = prove_pixels(scene, range(225), most_bits=512)
    decided = [
        p.status is not None and s != RayStatus.UNDECIDED for p, s in zip(proofs, found.status.flat, strict=True)
    ]
    assert sum(decided) > 215
    worst = 0.0
    for number in np.flatnonzero(decided):
        proof = proofs[number]
        assert found.status.flat[number] == proof.status, number
        assert found.events.flat[number] == proof.events, number
        if proof.st is not None:
            worst = max(worst, proof.distance(*map(float, found.st.reshape(-1, 2)[number])))
    assert worst < (1e-2 if precision == "single" else 1e-11)  # a path of several reflections
    ends = {p.status for p in proofs}
    assert {RayStatus.PICTURE, RayStatus.BEHIND} <= ends


def test_a_source_on_the_picture_is_not_decided() -> None:
    scene = make_scene(
        {**SLAB, "n": 1.5}, source={"kind": "point", "at": [0.1, 0.0, 0.2]},
        film={"centre": [0.0, 0.0, 2.0], "size": [4, 4]}, picture={"centre": [0, 0, 0.2]},
    )  # fmt: skip
    assert (lenscl.trace(scene).status == RayStatus.UNDECIDED).all()
    assert math.isclose(float(scene.picture.centre[2]), 0.2)


def test_places_that_single_precision_stores_go_with_their_status() -> None:
    """Single decides no ray so near to an edge; what double says of it is rounded on the side where it is."""
    scene = make_scene(
        {**SLAB, "n": 1.5}, picture={"corner": [-0.5, 0.5, 0.1], "right": [1.0, 0, 0], "down": [0, -1.0, 0]},
        numerics={"precision": "single"},
    )  # fmt: skip
    apart = 10.0 ** -np.arange(2.0, 13.0)
    x = np.concatenate([edge + sign * apart for edge in (-0.5, 0.5) for sign in (1, -1)])
    origins = np.column_stack([x, np.full_like(x, 0.1), np.full_like(x, 3.0)])
    found = lenscl.trace_rays(scene, origins, np.tile([0.0, 0.0, -1.0], (x.size, 1)))
    assert found.escalated >= 20
    assert found.st.dtype == np.float32
    within = ((found.st >= 0) & (found.st < 1)).all(axis=1)
    np.testing.assert_array_equal(found.status == RayStatus.PICTURE, np.abs(x) < 0.5)
    np.testing.assert_array_equal(within, np.abs(x) < 0.5)


def test_rounding_of_places_keeps_the_side_of_every_edge() -> None:
    st = np.array([[1 - 1e-12, 0.5], [1.0, 0.5], [-1e-60, 0.5], [0.0, 1e-60], [0.25, 2.0], [-1.0, -1.0]])
    status = np.array([RayStatus.PICTURE, 1, 1, RayStatus.PICTURE, 1, RayStatus.BEHIND], np.uint8)
    rounded = _rounded(st, status, np.dtype(np.float32))
    assert rounded.dtype == np.float32
    within = ((rounded >= 0) & (rounded < 1)).all(axis=1)
    np.testing.assert_array_equal(within, status == RayStatus.PICTURE)
    np.testing.assert_array_equal(_rounded(st, status, np.dtype(np.float64)), st)
    np.testing.assert_allclose(rounded, st, atol=1e-7)


@pytest.mark.parametrize("precision", ["double", "mixed", "single"])
def test_a_solid_on_the_pictures_plane_and_wider_than_the_picture_lets_rays_land_beside_it(precision: str) -> None:
    """Rays leave the solid on the plane itself; a gap of 1e-6 tells where they meet it."""

    def traced(gap: float, precision: str) -> lenscl.RayMap:
        return lenscl.trace(
            make_scene(
                {"surface": "box", "a": 8.0, "b": 8.0, "c": 1.0, "centre": [0.0, 0.0, gap - 0.7]},
                source={"at": [0.0, 0.0, 5.0]},
                film={"centre": [0.0, 0.0, 3.0], "right": [2.0, 0, 0], "down": [0, -2.0, 0], "size": [24, 24]},
                picture={"centre": [0.0, 0.0, -1.2], "right": [1.2, 0, 0], "down": [0, -1.2, 0]},
                numerics={"precision": precision},
            )
        )

    touching, apart = traced(0.0, precision), traced(1e-6, "double")
    assert (apart.status == RayStatus.OFF_PICTURE).sum() > 500
    np.testing.assert_array_equal(touching.status, apart.status)
    np.testing.assert_allclose(touching.st, apart.st, atol=1e-5)
