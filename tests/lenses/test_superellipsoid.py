"""Superellipsoids end undecided at their edges and points alone: not on axes, planes of symmetry or diagonals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from sampled import compared, field
from scenes import make_scene

import lenscl
from lenscl import RayStatus
from lenscl.accuracy import check_map
from lenscl.config import Scene
from lenscl.expr import evaluate_with_error

PRECISIONS = ("double", "single", "mixed")
BARR = "((x**2)**(1/e2) + (y**2)**(1/e2))**(e2/e1) + (z**2)**(1/e1) - 1"  # as printed
NEAR = {
    "source": {"kind": "point", "at": [0.0, 0.0, 6.0]},
    "film": {"centre": [0.0, 0.0, 3.0], "right": [1.0, 0.0, 0.0], "down": [0.0, -1.0, 0.0], "size": [64, 64]},
}


def scene_of(e1: float, e2: float, **parts: Any) -> Scene:
    return make_scene({"surface": "superellipsoid", "e1": e1, "e2": e2}, **parts)


def undecided(scene: Scene, precision: str) -> Any:
    return lenscl.trace(scene, precision=precision).status == RayStatus.UNDECIDED


@pytest.mark.parametrize("precision", PRECISIONS)
def test_what_is_smooth_is_decided_on_axes_planes_and_diagonals(precision: str) -> None:
    rays = 0
    for e1, e2 in ((0.2, 0.2), (0.5, 0.5), (1.0, 1.0), (1.5, 1.5), (1.9, 1.9), (0.3, 1.7), (1.6, 0.4), (1.0, 0.2)):
        for parts in (NEAR, {"film": {"size": [33, 33]}}):  # |x| = |y|; the axis and the planes x = 0 and y = 0
            raymap = lenscl.trace(scene_of(e1, e2, **parts), precision=precision)
            assert raymap.counts()[RayStatus.UNDECIDED] == 0, (e1, e2)
            rays += int((raymap.events > 0).sum())
    assert rays > 12_000


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_double_cone_is_decided_but_at_its_points_and_rim(precision: str) -> None:
    raymap = lenscl.trace(scene_of(2.0, 1.0, film={"size": [80, 80]}), precision=precision)
    assert raymap.counts()[RayStatus.UNDECIDED] == 0
    assert (raymap.events > 0).sum() > 1500
    points = undecided(scene_of(2.0, 1.0, film={"size": [33, 33]}), precision)
    assert [tuple(each) for each in np.argwhere(points)] == [(16, 16)]  # the axis meets both points


@pytest.mark.parametrize("precision", PRECISIONS)
def test_an_octahedron_is_decided_but_at_its_edges(precision: str) -> None:
    edged = scene_of(2.0, 2.0, film={"size": [33, 33]})
    raymap = lenscl.trace(edged, precision=precision)
    found = raymap.status == RayStatus.UNDECIDED
    row, column = np.indices(found.shape)
    on_edge = ((row == 16) | (column == 16)) & (np.abs(row - 16) + np.abs(column - 16) < 9)
    assert found[on_edge].all()
    assert not found[(row != 16) & (column != 16)].any()
    faces = make_scene(
        {"surface": "abs(x) + abs(y) + abs(z) - 1", "bounds": [[-1.1] * 3, [1.1] * 3]}, film={"size": [33, 33]}
    )
    other = lenscl.trace(faces, precision=precision)
    both = ~found & (other.status != RayStatus.UNDECIDED)
    assert both.sum() > 900
    np.testing.assert_array_equal(raymap.events[both], other.events[both])
    np.testing.assert_allclose(raymap.st[both], other.st[both], atol=1e-4 if precision == "single" else 1e-11)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("rotate", [[0.0, 0.0, 30.0], [17.0, 40.0, 5.0]])
def test_rays_in_the_plane_of_an_edge_end_undecided_however_it_is_turned(precision: str, rotate: list[float]) -> None:
    """A plane of symmetry that rounding turns: on which side of the edge a ray is, nobody can tell."""
    lens = {"surface": "superellipsoid", "e1": 1.0, "e2": 2.0, "rotate": rotate}
    scene = make_scene(lens)
    turn = np.asarray(_turn(rotate))
    rng = np.random.default_rng(4)
    plane = np.stack([np.zeros(200), *rng.normal(size=(2, 200))], axis=1)
    target = np.stack([np.zeros(200), *rng.uniform(-0.4, 0.4, (2, 200))], axis=1)
    unit = plane / np.linalg.norm(plane, axis=1, keepdims=True)
    paths = lenscl.trace_rays(scene, (target - 3.0 * unit) @ turn.T, unit @ turn.T, precision=precision)
    assert (paths.status == RayStatus.UNDECIDED).mean() > 0.9  # others are beside it by a rounding
    smooth = scene.replace({"lens.e2": 1.2})
    paths = lenscl.trace_rays(smooth, (target - 3.0 * unit) @ turn.T, unit @ turn.T, precision=precision)
    assert (paths.status != RayStatus.UNDECIDED).all()


def _turn(rotate: list[float]) -> Any:
    from lenscl.reference import Placement

    lens = make_scene({"surface": "sphere", "rotate": rotate}).lenses[0]
    return Placement.of(lens).point_to_world(np.eye(3)).T


@pytest.mark.parametrize("precision", PRECISIONS)
def test_the_ball_among_them_is_the_sphere(precision: str) -> None:
    """On the axis, too, where Fresnel's losses and the film pixel's footprint have closed forms."""
    effects = {"fresnel": True, "path_length": True}
    film = {"size": [33, 33]}
    ball = lenscl.trace(scene_of(1.0, 1.0, film=film, effects=effects), precision=precision)
    sphere = lenscl.trace(make_scene({"surface": "sphere"}, film=film, effects=effects), precision=precision)
    np.testing.assert_array_equal(ball.events, sphere.events)
    inner = np.abs(ball.st) < 1e3
    np.testing.assert_allclose(ball.st[inner], sphere.st[inner], atol=2e-4 if precision == "single" else 1e-11)
    assert ball.transmittance[16, 16] == pytest.approx(0.96**2, abs=1e-6)


@pytest.mark.parametrize(("e1", "e2"), [(1.5, 1.5), (2.0, 1.0), (0.5, 0.5), (0.7, 1.8), (1.9, 0.3)])
def test_rays_go_where_sampling_of_the_printed_formula_says(e1: float, e2: float) -> None:
    for parts in (NEAR | {"film": NEAR["film"] | {"size": [24, 24]}}, {"film": {"size": [21, 21]}}):
        found = compared(scene_of(e1, e2, **parts), field(BARR, e1=e1, e2=e2), 1.75)
        assert found.told.sum() > 80
        np.testing.assert_array_equal(found.paths.events[found.told], found.said.events[found.told])
        # Sampling has its slopes by differences, which near an edge that is all but sharp tell less
        apart = found.apart[found.told]
        assert np.median(apart) < 1e-7
        assert (apart < 1e-3).mean() > 0.97


@pytest.mark.parametrize(("e1", "e2"), [(1.5, 1.5), (0.3, 1.7), (1.0, 1.9)])
def test_the_formula_as_printed_is_decided_where_its_powers_are_less_than_1(e1: float, e2: float) -> None:
    film = {"size": [21, 21]}
    printed = {"surface": BARR.replace("e1", str(e1)).replace("e2", str(e2)), "bounds": [[-1.1] * 3, [1.1] * 3]}
    found, known = lenscl.trace(make_scene(printed, film=film)), lenscl.trace(scene_of(e1, e2, film=film))
    assert found.counts()[RayStatus.UNDECIDED] == 0
    np.testing.assert_array_equal(found.events, known.events)
    near = np.abs(known.st) < 10.0
    np.testing.assert_allclose(found.st[near], known.st[near], atol=1e-8)
    assert (found.events > 0).sum() > 80


@pytest.mark.parametrize(("e1", "e2"), [(2.0, 1.0), (1.0, 2.0), (2.0, 2.0), (1.0, 1.0), (0.2, 1.7)])
def test_the_rounding_of_f_is_known_for_exponents_at_both_ends(e1: float, e2: float) -> None:
    """Bounds of 2 / 2 reach below 1 by rounding; were those of the norm lost there, no ray could be checked."""
    scene = make_scene({"surface": "superellipsoid", "e1": e1, "e2": e2}, film={"size": [30, 30]})
    (lens,) = scene.lenses
    x, y, z = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 500))
    f, error = evaluate_with_error(lens.surface.expression, {**lens.values, "x": x, "y": y, "z": z})
    assert (error < 1e-13).all()
    assert (np.abs(f) < 3.0).all()
    findings = check_map(lenscl.trace(scene))
    assert findings.failed == 0
    assert findings.surfaces > 60
    assert findings.returned > 0.5 * findings.surfaces
