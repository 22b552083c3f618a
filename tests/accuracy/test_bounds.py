"""Error bounds hold against certified answers, and would not if any part of them were left out."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scenes import make_scene
from validate_error_map import PRECISIONS, Verdict, scenes, some_pixels, truth, verdict

from lenscl import RayStatus, compile_count, trace
from lenscl.accuracy import NO_BOUND, Places, bounds, error_at, error_map, pixel_bounds, place_bounds, rounding
from lenscl.config import Scene
from lenscl.errors import TraceError

FLAT, CANCELS = "prism's face grazed at 1e-3", "sphere, 1000 away in its own space"
DENSE = "prism, n = 1000"
NAMES = (DENSE, "torus", "torus, offset 1e+06", "air torus in glass", "bench heart-close", "bifolia", FLAT, CANCELS)
PIXELS = 50


@pytest.fixture(scope="module")
def certified() -> dict[str, tuple[Scene, Any, Any]]:
    """Scenes by name, with some pixels and their certified ends."""
    found = {}
    for name, scene in scenes():
        if name in NAMES:
            pixels = some_pixels(scene, PIXELS)
            found[name] = scene, pixels, truth(scene, pixels, None)
    assert found.keys() == set(NAMES)
    return found


def judged(places: Places, found: Any, by: float = 1.0, off: float = 0.0) -> np.ndarray:
    """Return the true errors of places over their bounds; these multiplied, the places disturbed."""
    lands = (places.bound >= 0) & np.isin(found["status"], (0, 1))
    error = np.abs((places.st + off - found["high"]) - found["low"]).max(axis=1)
    return error[lands] / (by * places.bound[lands])


def test_every_bound_holds_whatever_the_precision(certified, request: pytest.FixtureRequest) -> None:
    for precision in PRECISIONS:
        is_whole = precision != "mixed" or request.config.getoption("--slow")
        names = NAMES if is_whole else ("torus", "air torus in glass", "bench heart-close")
        verdicts: list[Verdict] = [
            verdict(trace(scene, precision=precision), pixels, found)
            for scene, pixels, found in (certified[name] for name in names)
        ]
        ratios = np.concatenate([each.ratios for each in verdicts])
        assert len(ratios) > 0.75 * PIXELS * len(names)
        assert sum(each.without for each in verdicts) < 0.02 * len(ratios)
        assert ratios.max() <= 1.0, precision
        if precision == "single":  # what is off by single precision is known almost exactly
            assert np.median(ratios) > 0.9


def test_bounds_of_double_have_room_and_are_not_vacuous(certified) -> None:
    ratios = np.concatenate([judged(pixel_bounds(scene, pixels), found) for scene, pixels, found in certified.values()])
    assert len(ratios) > 0.75 * PIXELS * len(NAMES)
    assert ratios.max() < 0.5
    assert np.median(ratios) > 1 / 300


def test_smaller_bounds_or_disturbed_places_are_caught(certified) -> None:
    for name, (scene, pixels, found) in certified.items():
        places = pixel_bounds(scene, pixels)
        assert (judged(places, found, by=1e-4) > 1).mean() > 0.5, name
        if name in ("torus", "bench heart-close", "bifolia"):  # whose own bounds are well below
            assert (judged(places, found, off=1e-9) > 1).mean() > 0.9, name


def test_moves_of_the_start_alone_would_miss_what_a_flat_face_takes_back(certified, monkeypatch) -> None:
    still = replace(bounds._NUDGES[0], turn=(0.0, 0.0, 0.0), eta_in=0.0, eta_out=0.0)
    monkeypatch.setattr(bounds, "_NUDGES", (still,) * 4)
    scene, pixels, found = certified[FLAT]
    assert (judged(pixel_bounds(scene, pixels), found) > 1).sum() > 5


def test_rounding_in_f_counts(certified, monkeypatch) -> None:
    monkeypatch.setattr(bounds, "surface_noise", lambda _, paths: np.zeros((2, len(paths.events))))
    scene, pixels, found = certified[CANCELS]
    assert (judged(pixel_bounds(scene, pixels), found) > 1).mean() > 0.5


def test_what_an_index_makes_of_a_direction_inside_counts(certified, monkeypatch) -> None:
    for module in (bounds, rounding):
        monkeypatch.setattr(module, "growth", lambda _: 1.0)
    scene, pixels, found = certified[DENSE]
    assert (judged(pixel_bounds(scene, pixels), found) > 1).sum() > 5


@pytest.mark.parametrize("effects", [{}, {"total_reflection": "end"}])
@pytest.mark.parametrize("precision", PRECISIONS)
def test_there_is_no_bound_exactly_where_there_is_no_place_or_the_double_trace_has_none(precision, effects) -> None:
    scene = make_scene({"surface": "torus", "n": 2.4, "rotate": [20, 30, 10]}, effects=effects)
    raymap = trace(scene, precision=precision)
    error = error_map(raymap)
    places = pixel_bounds(scene, np.arange(raymap.status.size))
    lands = np.isin(raymap.status, (RayStatus.PICTURE, RayStatus.OFF_PICTURE))
    np.testing.assert_array_equal(error < 0, ~(lands & (places.bound >= 0).reshape(lands.shape)))
    assert set(error[error < 0]) == {NO_BOUND}
    assert (error == NO_BOUND).sum() > 20
    assert np.isfinite(error).all()
    np.testing.assert_array_equal(error[error >= 0] > 0, True)


def test_a_ray_whose_path_rounding_decides_has_no_bound() -> None:
    scene = make_scene({"surface": "sphere", "r": 0.75})
    beside = [0.5, 0.75 - 2.0**-53, 0.75, 0.75 + 2.0**-52, 0.75 + 1e-3]
    places = place_bounds(scene, [[x, 0.0, 3.0] for x in beside], [[0.0, 0.0, -7.0]] * 5)
    assert (places.bound >= 0).tolist() == [True, False, False, False, True]
    assert places.events[[0, 4]].tolist() == [2, 0]


def test_a_map_that_takes_another_path_is_as_far_off_as_it_is() -> None:
    """A coarse march passes thin chords over: its places are wrong, and said to be."""
    scene = make_scene({"surface": "sphere", "r": 0.8, "stretch": [1, 1, 0.01]}, numerics={"step": 0.3})
    fine, coarse = trace(scene, method="auto"), trace(scene, method="march")
    missed = (fine.events > 0) & (coarse.events == 0)
    assert missed.sum() > 100
    apart = np.abs(fine.st - coarse.st).max(axis=-1)[missed]
    np.testing.assert_allclose(error_map(coarse)[missed], apart, rtol=1e-6, atol=1e-13)


def test_the_paraxial_law_is_held_against_the_exact_one() -> None:
    scene = make_scene({"surface": "sphere", "r": 0.8})
    exact, paraxial = trace(scene), trace(scene.replace({"numerics.snell": "paraxial"}))
    both = (exact.events == 2) & (paraxial.events == 2) & (error_map(paraxial) >= 0)
    assert both.sum() > 300
    apart = np.abs(exact.st - paraxial.st).max(axis=-1)[both]
    assert np.median(apart) > 1e-3
    np.testing.assert_allclose(error_map(paraxial)[both], apart, rtol=1e-6, atol=1e-12)


def test_a_pixel_has_its_bound_alone_and_among_others_and_in_parts(monkeypatch) -> None:
    scene = make_scene({"surface": "torus", "rotate": [20, 30, 10]})
    raymap = trace(scene)
    error, some = error_map(raymap), np.arange(5, 48 * 48, 37)
    np.testing.assert_array_equal(error_at(raymap, some), error.ravel()[some])
    whole = pixel_bounds(scene, some)
    monkeypatch.setattr(bounds, "_PART", 7)
    parts = pixel_bounds(scene, some)
    for name in ("st", "status", "events", "bound"):
        np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name))
    np.testing.assert_array_equal(error_map(replace_film(raymap, 6)), error[:6])
    assert pixel_bounds(scene, []).bound.shape == (0,)


def replace_film(raymap: Any, rows: int) -> Any:
    """The first rows of a map; their pixels keep their numbers."""
    return replace(raymap, st=raymap.st[:rows], status=raymap.status[:rows], events=raymap.events[:rows])


def test_a_film_takes_memory_by_parts(monkeypatch) -> None:
    raymap = trace(make_scene({"surface": "sphere", "r": 0.5}, film={"size": [256, 256]}))
    peaks = []
    for part in (2**16, 2**12):
        monkeypatch.setattr(bounds, "_PART", part)
        tracemalloc.start()
        error_map(raymap)
        peaks.append(tracemalloc.get_traced_memory()[1] - raymap.status.size * 8)
        tracemalloc.stop()
    assert peaks[0] < 1000 * 2**16  # bytes
    assert peaks[1] < peaks[0] / 8


def test_a_pixel_on_the_source_has_none() -> None:
    scene = make_scene({"surface": "sphere", "r": 0.5}, film={"centre": [0, 0, 4.0], "size": [3, 3]})
    places = pixel_bounds(scene, np.arange(9))
    assert places.bound[4] == NO_BOUND
    assert places.status[4] == RayStatus.UNDECIDED == trace(scene).status[1, 1]


def test_no_trace_program_is_counted() -> None:
    scene = make_scene({"surface": "x**2 + y**2 + 3*z**2 - 0.5", "bounds": [[-1, -1, -1], [1, 1, 1]]})
    raymap = trace(scene)
    before, judges = compile_count(), compile_count_of("judge")
    error_map(raymap)
    assert compile_count() == before
    assert compile_count_of("judge") == judges + 1


def compile_count_of(kind: str) -> int:
    from lenscl.device import compile_count

    return compile_count(kind)


def test_a_device_without_double_is_refused() -> None:
    raymap = trace(make_scene({"surface": "sphere", "r": 0.5}), precision="single")
    with pytest.raises(TraceError, match="has no double precision"):
        error_map(replace(raymap, device=replace(raymap.device, has_double=False)))
