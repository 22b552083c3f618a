"""Optical path: constant where optics says so, and the slope of a wavefront everywhere."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import make_scene

from lenscl import RayStatus, trace, trace_rays

WANTED = {"path_length": True}
PRECISIONS = ("single", "mixed", "double")


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("n", [1.2, 1.5, 2.4])
def test_paths_to_a_perfect_focus_are_of_one_length(n: float, precision: str) -> None:
    """An ellipsoid of revolution of eccentricity 1 / n has its far focus in all parallel light that enters it."""
    b = np.sqrt(1.0 - 1.0 / n**2)
    scene = make_scene(
        {"surface": "ellipsoid", "a": b, "b": b, "c": 1.0, "n": n}, effects=WANTED, numerics={"precision": precision}
    )
    x, y = (v.ravel() for v in np.meshgrid(np.linspace(-0.6, 0.6, 15) * b, np.linspace(-0.6, 0.6, 15) * b))
    start = np.stack([x, y, np.full_like(x, 3.0)], axis=1)
    scene = scene.replace({"numerics.max_events": 1, "effects.total_reflection": "end"})
    rays = trace_rays(scene, start, np.broadcast_to([0.0, 0.0, -1.0], start.shape))
    assert (rays.status == RayStatus.TRAPPED).all()  # behind the first surface, where its path was kept
    to_focus = np.linalg.norm(np.array([0.0, 0.0, -1.0 / n]) - rays.origin.astype(np.float64), axis=1)
    whole = rays.path_length.astype(np.float64) + n * to_focus
    assert np.ptp(whole) < (4e-6 if precision == "single" else 2e-14)
    # In through the near end, then n times the way from there to the far focus: 2 in glass of eccentricity 1 / n
    assert whole.mean() == pytest.approx(3.0 - 1.0 + n * (1.0 + 1.0 / n), rel=2e-7 if precision == "single" else 1e-15)


@pytest.mark.parametrize(
    ("surface", "kind"), [("torus", "point"), ("heart", "parallel"), ("biconvex", "point"), ("bifolia", "parallel")]
)
def test_rays_are_normal_to_surfaces_of_equal_path(surface: str, kind: str) -> None:
    """Malus and Dupin: over the picture's plane the path grows by n times the ray's part along it."""
    source = {"kind": "parallel", "direction": [0.1, 0.2, -1.0]} if kind == "parallel" else None
    scene = make_scene({"surface": surface}, source=source, effects=WANTED, medium=1.1, film={"size": [400, 40]})
    raymap = trace(scene)
    picture = scene.picture
    place = raymap.st @ np.array([picture.right, picture.down])  # but for the corner
    moves = place[:, 2:] - place[:, :-2]
    along = 1.1 * np.einsum("ijk,ijk->ij", raymap.direction[:, 1:-1], moves)
    grows = raymap.path_length[:, 2:] - raymap.path_length[:, :-2]
    # Where the three rays take one kind of path, and it changes slowly
    alike = np.ones(grows.shape, bool)
    for array in (raymap.status, raymap.events):
        alike &= (array[:, 2:] == array[:, 1:-1]) & (array[:, :-2] == array[:, 1:-1])
    alike &= np.isin(raymap.status[:, 1:-1], [RayStatus.PICTURE, RayStatus.OFF_PICTURE])
    bends = np.linalg.norm(place[:, 2:] - 2 * place[:, 1:-1] + place[:, :-2], axis=-1)
    smooth = alike & (bends < 0.05 * np.linalg.norm(moves, axis=-1)) & (raymap.events[:, 1:-1] > 0)
    assert smooth.sum() > 300
    off = np.abs(grows - along)[smooth] / np.linalg.norm(moves, axis=-1)[smooth]
    assert np.median(off) < 5e-4  # a central difference
    assert (off < 0.02).mean() > 0.99


@pytest.mark.parametrize("precision", PRECISIONS)
def test_without_a_lens_on_the_way_it_is_index_times_distance(precision: str) -> None:
    scene = make_scene({"surface": "torus"}, medium=1.3, effects=WANTED, numerics={"precision": precision})
    raymap = trace(scene)
    free = (raymap.events == 0) & (raymap.st != -1.0).all(axis=-1)
    assert free.sum() > 100
    picture = scene.picture
    place = np.asarray(picture.corner) + raymap.st.astype(np.float64) @ np.array([picture.right, picture.down])
    straight = 1.3 * np.linalg.norm(place - np.array([0.0, 0.0, 4.0]), axis=-1)
    np.testing.assert_allclose(raymap.path_length[free], straight[free], rtol=1e-6 if precision == "single" else 1e-14)


def test_parallel_light_has_no_path_behind_it_where_it_starts() -> None:
    direction = np.array([0.3, 0.1, -1.0])
    scene = make_scene(
        {"surface": "sphere", "r": 0.2}, source={"kind": "parallel", "direction": direction.tolist()}, effects=WANTED
    )
    raymap = trace(scene)
    straight = raymap.events == 0
    picture = scene.picture
    place = np.asarray(picture.corner) + raymap.st @ np.array([picture.right, picture.down])
    unit = direction / np.linalg.norm(direction)
    starts = place @ unit - raymap.path_length
    assert straight.sum() > 100
    assert np.ptp(starts[straight]) < 1e-13  # one plane, normal to the light
    corners = np.array([[x, y, z] for x in (-0.65, 0.65) for y in (-0.65, 0.65) for z in (2.5,)])
    assert starts[straight].max() <= (corners @ unit).min() + 1e-13  # before the film


def test_what_never_meets_the_plane_has_no_length_to_it() -> None:
    raymap = trace(make_scene({"surface": "sphere", "n": 0.5}, effects={"total_reflection": "follow", **WANTED}))
    nowhere = ~np.isin(raymap.status, [RayStatus.PICTURE, RayStatus.OFF_PICTURE])
    assert nowhere.sum() > 10
    assert (raymap.path_length[nowhere] == -1.0).all()
    assert (raymap.path_length[~nowhere] > 4.5).all()


def test_rays_of_the_callers_own_count_up_to_their_last_surface() -> None:
    scene = make_scene({"surface": "ball", "diameter": 2.0}, effects=WANTED)
    rays = trace_rays(scene, [[0.0, 0.0, 3.0], [2.0, 0.0, 3.0], [0.0, 0.0, 0.5]], [[0.0, 0.0, -2.0]] * 3)
    np.testing.assert_allclose(rays.path_length, [2.0 + 1.5 * 2.0, 0.0, 1.5 * 1.5], rtol=1e-14)
