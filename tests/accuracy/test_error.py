"""Errors are against places that hold, and count what they say they count."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scenes import make_scene

from lenscl import RayStatus, reference, trace
from lenscl.accuracy.bench import Error, Expected
from lenscl.config import Scene
from lenscl.tracing import RayMap

LENSES: dict[str, dict[str, Any]] = {
    "ellipsoid": {"surface": "ellipsoid", "a": 1.0, "b": 0.8, "c": 0.6},
    "torus": {"surface": "torus", "R": 0.7, "r": 0.25},
    "heart": {"surface": "heart", "rotate": [-90.0, -90.0, 0.0]},
    "bifolia": {"surface": "bifolia", "centre": [0.0, -0.375, 0.0]},
}


@pytest.mark.parametrize("name", LENSES)
def test_what_is_expected_is_what_another_search_finds(name: str) -> None:
    """The twin that marches in fine steps shares the refraction, but neither polynomials nor their roots."""
    scene = make_scene(LENSES[name])
    expected = Expected.of(scene, 20, least=40)
    assert "companion matrices" in expected.against
    origins, directions = (each[expected.pixels] for each in reference.film_rays(scene))
    marched = reference.trace_rays(scene.replace({"numerics.step": 2e-3}), origins, directions)
    paths = expected.paths
    same = (paths.events == marched.events) & (paths.status == marched.status)
    assert same.mean() > 0.99  # the march may lose a short chord
    lens = same & (paths.events > 0)
    assert lens.sum() > 40
    pixels = np.abs(paths.st - marched.st)[lens].max(axis=1) * 1024
    assert np.quantile(pixels, 0.9) <= expected.floor < 1e-6


@pytest.mark.parametrize(
    "lenses",
    [
        [{"surface": "superellipsoid"}],
        [
            {"name": "near", "surface": "sphere", "r": 0.4, "centre": [0.0, 0.0, 0.6]},
            {"name": "far", "surface": "sphere", "r": 0.4, "centre": [0.0, 0.0, -0.6]},
        ],
    ],
)
def test_what_no_companion_matrix_tells_is_marched_finely_and_said(lenses: list[dict[str, Any]]) -> None:
    scene = make_scene(*lenses, film={"size": [12, 12]})
    expected = Expected.of(scene, 12, least=5)
    assert "steps of 0.001" in expected.against
    error = expected.error_of(trace(scene))
    assert error.compared > 5
    assert error.pixels.high < 1e-6


@pytest.fixture(scope="module")
def traced() -> tuple[RayMap, Expected]:
    scene = make_scene(LENSES["torus"])
    return trace(scene), Expected.of(scene, 48)


def changed(raymap: RayMap, **arrays: Any) -> RayMap:
    return replace(raymap, **arrays)


def test_a_right_map_is_right(traced: tuple[RayMap, Expected]) -> None:
    raymap, expected = traced
    error = expected.error_of(raymap)
    assert error.differ == 0.0
    assert error.compared > 400
    assert error.sampled >= error.compared
    assert error.pixels.median <= error.pixels.high <= error.pixels.largest
    assert error.pixels.high < 10 * error.floor < 1e-6
    assert error.pixels.high == pytest.approx(1024 * error.coordinates.high)


def test_a_displaced_map_is_wrong_by_that(traced: tuple[RayMap, Expected]) -> None:
    raymap, expected = traced
    error = expected.error_of(changed(raymap, st=raymap.st + np.array([1e-3, -2e-3])))
    for quantiles, scale in ((error.coordinates, 1.0), (error.pixels, 1024.0)):
        for value in (quantiles.median, quantiles.high, quantiles.largest):
            assert value == pytest.approx(2e-3 * scale, rel=1e-6)
    assert error.differ == 0.0


def test_pixels_are_those_of_the_scenes_picture() -> None:
    scene = make_scene(LENSES["torus"], picture={"size": [100, 3000]})
    raymap = trace(scene)
    error = Expected.of(scene, 16).error_of(changed(raymap, st=raymap.st + np.array([1e-2, 1e-3])))
    assert error.coordinates.median == pytest.approx(1e-2, rel=1e-6)
    assert error.pixels.median == pytest.approx(3.0, rel=1e-6)


def test_rays_that_end_otherwise_are_counted_and_not_measured(traced: tuple[RayMap, Expected]) -> None:
    raymap, expected = traced
    through = expected.pixels[expected.paths.events > 0]
    wrong = through[::10]
    events = raymap.events.copy()
    events.ravel()[wrong] += 1
    right, error = expected.error_of(raymap), expected.error_of(changed(raymap, events=events))
    assert error.differ == pytest.approx(len(wrong) / right.sampled)
    assert error.compared < right.compared
    assert error.pixels.largest <= right.pixels.largest


def test_an_undecided_ray_claims_nothing(traced: tuple[RayMap, Expected]) -> None:
    raymap, expected = traced
    status, st = raymap.status.copy(), raymap.st.copy()
    open_ = expected.pixels[expected.paths.events > 0][::7]
    status.ravel()[open_], st.reshape(-1, 2)[open_] = RayStatus.UNDECIDED, -1.0
    right, error = expected.error_of(raymap), expected.error_of(changed(raymap, status=status, st=st))
    assert error.differ == 0.0
    assert 0 < right.compared - error.compared <= len(open_)
    assert error.pixels.largest <= right.pixels.largest


def test_a_map_in_which_nothing_is_right_has_no_error_to_tell(traced: tuple[RayMap, Expected]) -> None:
    raymap, expected = traced
    error: Error = expected.error_of(changed(raymap, events=raymap.events + np.uint8(1)))
    assert error.compared == 0
    assert error.differ == 1.0
    assert error.pixels.largest == 0.0


def test_another_glass_would_be_seen(traced: tuple[RayMap, Expected]) -> None:
    raymap, expected = traced
    error = expected.error_of(trace(raymap.scene.replace({"lens.n": 1.50001})))
    assert error.pixels.median > 1e-4


def test_a_search_that_loses_chords_would_be_seen() -> None:
    scene = make_scene({"surface": "torus", "R": 0.7, "r": 0.05}, numerics={"step": 0.1})
    expected = Expected.of(scene, 48)
    assert expected.error_of(trace(scene)).differ == 0.0
    assert expected.error_of(trace(scene, method="march")).differ > 0.2


def test_a_small_lens_is_looked_at_more_closely() -> None:
    scene = make_scene({"surface": "sphere", "r": 0.05}, film={"size": [400, 300]})
    few, many = (Expected.of(scene, 20, least) for least in (1, 50))
    assert 1 <= np.count_nonzero(few.paths.events) < 50 <= np.count_nonzero(many.paths.events)
    assert len(many.pixels) < 300 * 400
    everything = Expected.of(scene.replace({"film.size": [40, 30]}), 20, 50)  # has not that many to look at
    assert len(everything.pixels) == 40 * 30


def sampled_pixels(columns: int, rows: int, cells: int) -> np.ndarray:
    film = {"size": [columns, rows]}
    scene: Scene = make_scene({"surface": "sphere", "r": 0.1}, film=film)
    return Expected.of(scene, cells, least=0).pixels


def test_the_sample_has_one_ray_in_every_cell_and_is_always_the_same() -> None:
    pixels = sampled_pixels(60, 45, 15)
    cells = (pixels // 60 // 3) * 15 + pixels % 60 // 4
    assert sorted(cells) == list(range(15 * 15))
    assert len(set(pixels % 60 % 4)) == 4  # and is no grid
    np.testing.assert_array_equal(pixels, sampled_pixels(60, 45, 15))
    assert sorted(sampled_pixels(7, 5, 64)) == list(range(35))
