"""Solids in one another, in contact and in part the same: against closed forms, and solids that are one expression."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest
from effects.slopes import slopes
from physics.arranged import CROWN, FLINT, Array, Lens, alike, down_axis, followed, here, rays_through, scene_of, user
from scenes import make_scene

from lenscl import RayStatus, trace
from lenscl.config import Scene
from lenscl.tracing import RayPaths

BALL: Lens = {"surface": "sphere", "r": 0.5, "n": 1.5}
COUNT = 400
PRECISIONS = pytest.mark.parametrize("precision", ["double", "single"])
ALL_PRECISIONS = pytest.mark.parametrize("precision", ["double", "mixed", "single"])
CLOSE = {"double": 1e-11, "mixed": 1e-11, "single": 2e-3}  # of directions that a few events spread


@PRECISIONS
def test_a_bubble_is_a_hollow_in_the_ball_around_it(precision: str) -> None:
    bubble = scene_of(BALL, {"surface": "sphere", "r": 0.4, "n": 1.0})
    shell = scene_of(user("max(x^2 + y^2 + z^2 - 0.25, 0.16 - x^2 - y^2 - z^2)", n=1.5))
    rays = rays_through(np.random.default_rng(1), COUNT)
    one, other = followed(bubble, rays, precision), followed(shell, rays, precision)
    told = (one.status != RayStatus.UNDECIDED) & (other.status != RayStatus.UNDECIDED)
    assert told.mean() > 0.99
    assert (one.events[told] == other.events[told]).all()
    assert (one.events[told] >= 4).sum() > 100, "rays go through both walls"
    few = told & (one.events <= 4)
    assert np.abs(one.direction - other.direction)[few].max() <= CLOSE[precision]


@PRECISIONS
def test_solids_of_one_index_that_overlap_bend_as_their_union(precision: str) -> None:
    quartic, at = "{0}^4 + {1}^4 + {2}^4 - 0.3", (0.3, 0.05, 0.1)
    one, other = quartic.format("x", "y", "z"), quartic.format("(x - 0.3)", "(y - 0.05)", "(z - 0.1)")
    two = scene_of(user(one, n=1.5), user(one, n=1.5, centre=list(at)))
    union = scene_of(user(f"min({one}, {other})", 1.2, n=1.5))
    rays = rays_through(np.random.default_rng(2), COUNT, 0.7, 3.0)
    parts, whole = followed(two, rays, precision), followed(union, rays, precision)
    told = (parts.status != RayStatus.UNDECIDED) & (whole.status != RayStatus.UNDECIDED)
    assert told.mean() > 0.99
    assert (parts.status[told] == whole.status[told])[whole.events[told] <= 6].all(), "few events: none is trapped"
    through = told & (whole.events == 2) & (parts.events == 3)
    assert through.sum() > 50, "rays go from one solid into the other, where they meet no surface of the union"
    assert np.abs(parts.direction - whole.direction)[through].max() <= CLOSE[precision]


@PRECISIONS
def test_of_one_ball_written_twice_the_later_is_there_or_that_of_higher_priority(precision: str) -> None:
    rays = rays_through(np.random.default_rng(3), COUNT)
    glass, air = BALL, BALL | {"n": 1.2}
    for lenses, there in (((glass, air), air), ((glass | {"priority": 1}, air), glass)):
        twice, once = followed(scene_of(*lenses), rays, precision), followed(scene_of(there), rays, precision)
        told = twice.status != RayStatus.UNDECIDED
        assert (once.status == RayStatus.UNDECIDED)[~told].all()
        assert (twice.events == once.events)[told].all()
        assert (once.events >= 2).sum() > 100
        assert np.abs(twice.direction - once.direction)[told].max() <= CLOSE[precision]


def _spheres(origin: Array, ahead: Array, surfaces: Sequence[tuple[float, float]], n: Sequence[float]) -> Array:
    """Return directions behind spheres on the z axis, each by vertex and curvature; NaN where reflected."""
    p, d = origin.copy(), ahead.copy()
    for (vertex, c), (before, after) in zip(surfaces, pairwise(n), strict=True):
        q = p - [0.0, 0.0, vertex]
        a, b, e = c * (d * d).sum(1), (c * (q * d).sum(1) - d[:, 2]), c * (q * q).sum(1) - 2.0 * q[:, 2]
        t = e / (-b + np.copysign(np.sqrt(b * b - a * e), d[:, 2]))
        p = p + t[:, None] * d
        normal = np.stack([-c * p[:, 0], -c * p[:, 1], 1.0 - c * (p[:, 2] - vertex)], axis=1)
        normal *= np.sign((normal * d).sum(1))[:, None]
        cosine, eta = (normal * d).sum(1), before / after
        with np.errstate(invalid="ignore"):
            behind = np.sqrt(1.0 - eta**2 * (1.0 - cosine**2))
        d = eta * d + (behind - eta * cosine)[:, None] * normal
    return d


def _up(heights: Array, below: float) -> tuple[Array, Array]:
    origins = np.column_stack([heights, 0.3 * heights, np.full(heights.size, below)])
    return origins, np.tile([0.0, 0.0, 1.0], (heights.size, 1))


@PRECISIONS
def test_a_cemented_doublet_bends_three_times_as_prescribed(precision: str) -> None:
    origins, ahead = _up(np.linspace(-10.0, 10.0, 41), -20.0)
    ends = followed(scene_of(CROWN, FLINT), (origins, ahead), precision)
    assert set(ends.events.tolist()) == {3}
    surfaces = [(0.0, CROWN["c1"]), (4.0, CROWN["c2"]), (6.5, FLINT["c2"])]
    expected = _spheres(origins, ahead, surfaces, [1.0, 1.5168, 1.6727, 1.0])
    digits = 1e-7 if precision == "single" else 1e-13  # single rounds what double has decided
    assert np.abs(ends.direction - expected).max() < digits


def test_light_on_the_axis_of_a_doublet_is_lost_at_three_surfaces() -> None:
    film = {"centre": [0.0, 0.0, -10.0], "right": [1e-6, 0.0, 0.0], "down": [0.0, -1e-6, 0.0], "size": [3, 3]}
    source = {"kind": "parallel", "direction": [0.0, 0.0, 1.0]}
    scene = make_scene(CROWN, FLINT, source=source, film=film, effects={"fresnel": True, "path_length": True},
                       picture={"corner": [-3.0, 3.0, 40.0]})  # fmt: skip
    raymap = trace(scene, device=here())
    n = [1.0, 1.5168, 1.6727, 1.0]
    passed = np.prod([1.0 - ((a - b) / (a + b)) ** 2 for a, b in pairwise(n)])
    assert passed == pytest.approx(0.8950, abs=5e-5)
    np.testing.assert_allclose(raymap.transmittance, passed, rtol=1e-12)
    beyond = 40.0 - 6.5
    length = 10.0 + 4.0 * 1.5168 + 2.5 * 1.6727 + beyond  # from the plane of the film, which is before everything
    np.testing.assert_allclose(raymap.path_length, length, rtol=1e-12)


def test_cement_reflects_only_where_its_two_glasses_do() -> None:
    """Where there is air between, rays are reflected totally from 4.8 on; cemented, none is."""
    curve = -1.0 / 8.0
    dense = {"surface": "conic_singlet", "n": 1.7, "c1": 0.0, "c2": curve, "thickness": 8.0, "diameter": 15.0,
             "centre": [0.0, 0.0, 4.0]}  # fmt: skip
    thin = {"surface": "conic_singlet", "n": 1.5, "c1": curve, "c2": 0.0, "thickness": 3.0, "diameter": 15.0,
            "centre": [0.0, 0.0, 9.5]}  # fmt: skip
    heights = np.linspace(-6.5, 6.5, 53)
    origins, ahead = np.column_stack([heights, 0 * heights, 0 * heights - 5.0]), np.tile([0.0, 0.0, 1.0], (53, 1))
    ends = followed(scene_of(dense, thin), (origins, ahead))
    expected = _spheres(origins, ahead, [(0.0, 0.0), (8.0, curve), (11.0, 0.0)], [1.0, 1.7, 1.5, 1.0])
    cemented = ends.events == 3
    assert cemented[np.abs(heights) > 4.8].sum() >= 10
    assert np.abs(ends.direction - expected)[cemented].max() < 1e-13
    apart = followed(scene_of(dense, thin | {"centre": [0.0, 0.0, 9.5 + 1e-9]}), (origins, ahead))
    assert (apart.events[np.abs(heights) > 4.85] != 3).all(), "with air between, they do not get through"


def _cube(n: float = 1.5, cut: str = "x - z") -> tuple[Lens, Lens]:
    cube = "max(max(abs(x), abs(y), abs(z)) - 0.5, {})"
    return user(cube.format(cut), n=n), user(cube.format(f"-({cut})"), n=n)


@ALL_PRECISIONS
def test_a_cube_of_two_prisms_of_one_glass_lets_light_straight_through(precision: str) -> None:
    ends = followed(scene_of(*_cube()), down_axis(np.linspace(-0.45, 0.45, 19).tolist()), precision)
    assert set(ends.events.tolist()) == {3}
    assert (ends.direction == [0.0, 0.0, -1.0]).all()


def _slabs(gap: float, lift: float = 0.0, **more: Any) -> Scene:
    slab = user("max(x^2 + y^2 - 1, abs(z) - 0.25)", 1.2, n=1.2)
    centres = [0.0, 0.0, lift + 0.25 + gap], [0.0, 0.0, lift - 0.25]
    return scene_of(*(slab | {"centre": centre} for centre in centres), **more)


@pytest.mark.parametrize(("lift", "distance"), [(0.0, 1e5), (1e3, 3.0), (1e3, 1e6)])
def test_contact_is_told_from_far_away_and_where_the_scene_is_far_from_the_origin(lift: float, distance: float) -> None:
    ahead = np.array([[0.1 * a, 0.05 * b, -1.0] for a, b in product(range(-3, 4), repeat=2)])
    origins = np.array([0.01, 0.02, lift]) - distance * ahead
    ends = followed(_slabs(0.0, lift), (origins, ahead))
    assert set(ends.events.tolist()) == {3}


def test_a_gap_is_a_gap_however_far_away_the_picture_is() -> None:
    picture = {"corner": [-1e6, 1e6, -1e6], "right": [2e6, 0.0, 0.0], "down": [0.0, -2e6, 0.0]}
    ahead = np.array([[0.1, 0.05, -1.0]])
    for gap, events in ((1e-12, 4), (0.0, 3)):
        ends = followed(_slabs(gap, picture=picture), (np.array([[0.1, 0.0, 2.0]]), ahead))
        assert ends.events.tolist() == [events]


@pytest.mark.parametrize("gap", [1e-12, -1e-12, 1e-9])
@PRECISIONS
def test_a_gap_of_a_trillionth_of_a_lens_is_a_gap(gap: float, precision: str) -> None:
    """Through it light meets two surfaces of air; where solids overlap the later begins before the other ends."""
    rays = np.array([[0.1, 0.0, 2.0]] * 3), np.tile([0.1, 0.05, -1.0], (3, 1))
    assert set(followed(_slabs(gap), rays, precision).events.tolist()) == {4 if gap > 0.0 else 3}
    assert set(followed(_slabs(0.0), rays, precision).events.tolist()) == {3}


def test_each_solid_absorbs_over_its_own_stretch() -> None:
    outer = {"surface": "rod", "diameter": 1.0, "length": 1.0, "n": 1.5, "absorption": [1.0, 0.5, 0.0]}
    inner = {"surface": "rod", "diameter": 0.5, "length": 0.4, "n": 1.5, "absorption": [0.0, 2.0, 3.0]}
    source = {"kind": "parallel", "direction": [0.0, 0.0, -1.0]}
    film = {"size": [9, 9], "right": [0.9, 0.0, 0.0], "down": [0.0, -0.9, 0.0]}
    raymap = trace(scene_of(outer, inner, source=source, film=film), device=here())
    x = (np.arange(9) - 4.0) / 10.0
    radius = np.hypot(*np.meshgrid(x, x))
    in_outer, in_inner = np.where(radius < 0.5, 1.0, 0.0), np.where(radius < 0.25, 0.4, 0.0)
    expected = np.exp(
        -np.stack([(in_outer - in_inner) * a + in_inner * b for a, b in ((1.0, 0.0), (0.5, 2.0), (0.0, 3.0))], axis=-1)
    )
    assert set(raymap.events.ravel().tolist()) == {0, 2, 4}
    np.testing.assert_allclose(raymap.transmission, expected, rtol=1e-12)


def _nested() -> Scene:
    ball = BALL | {"surface": "sphere", "n": 1.4, "centre": [0.05, 0.0, 0.0]}
    torus = {"surface": "torus", "R": 0.25, "r": 0.1, "n": 1.7, "rotate": [20.0, 10.0, 0.0]}
    slab = user("max(max(abs(x), abs(y)) - 0.6, abs(z + 0.45) - 0.25)", n=1.3, priority=-1)
    film = {"size": [24, 24], "right": [0.5, 0.0, 0.0], "down": [0.0, -0.5, 0.0]}
    return scene_of(ball, torus, slab, film=film, effects={"footprint": True})


def test_the_footprint_of_a_pixel_is_carried_through_solids_in_solids() -> None:
    scene = _nested()
    raymap = trace(scene, device=here())
    rows, columns = (each.ravel().astype(float) for each in np.indices((24, 24)))
    found = slopes(scene, rows, columns)
    told = (found.error < 1e-4) & (raymap.events.ravel() > 0)
    assert told.sum() > 150
    assert len(set(raymap.events.ravel()[told].tolist())) >= 3
    jacobian = raymap.jacobian.reshape(-1, 2, 2)[told]
    size = np.abs(found.jacobian[told]).max(axis=(1, 2))
    off = np.abs(jacobian - found.jacobian[told]).max(axis=(1, 2)) / size
    assert (off <= found.error[told] + 1e-7).all()


def test_paths_within_one_solid_that_surfaces_of_others_cross_are_whole() -> None:
    """A solid of lower priority within another changes no bit of any path: it is not there."""
    rays = rays_through(np.random.default_rng(5), COUNT)
    ball, ghost = BALL | {"priority": 2}, {"surface": "torus", "R": 0.25, "r": 0.1, "n": 2.0}
    with_ghost, alone = followed(scene_of(ball, ghost), rays), followed(scene_of(ball), rays)
    assert alike(with_ghost, alone, 1e-13) > 100
    lengths = [
        _length(followed(scene_of(*some, effects={"path_length": True}), rays)) for some in ((ball, ghost), (ball,))
    ]
    np.testing.assert_allclose(*lengths, rtol=1e-13)


def _length(ends: RayPaths) -> Array:
    return np.asarray(ends.path_length)
