"""Error bounds hold against certified answers, and would not if any part of them were left out."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scenes import make_scene
from validate_error_map import PRECISIONS, Verdict, made, scenes, some_pixels, truth, verdict

from lenscl import RayStatus, compile_count, trace
from lenscl.accuracy import (
    NO_BOUND,
    Places,
    bounds,
    carried,
    error_at,
    error_map,
    meeting,
    pixel_bounds,
    place_bounds,
)
from lenscl.config import Scene
from lenscl.errors import TraceError
from lenscl.reference.oracle import prove_rays
from lenscl.tracing import Judge, film_rays, trace_rays

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


def test_rounding_in_f_counts(certified, monkeypatch) -> None:
    without(monkeypatch, "level", "tilt")
    scene, pixels, found = certified[CANCELS]
    assert (judged(pixel_bounds(scene, pixels), found) > 1).mean() > 0.5


def without(monkeypatch: pytest.MonkeyPatch, *sizes: str, lens: int | None = None) -> None:
    """Leave sizes of roundings out, at the surfaces of one lens or of all."""
    met = meeting.Glass.met

    def fewer(glass: Any, *rays: Any) -> Any:
        whole = met(glass, *rays)
        left_out = {name: 0.0 * getattr(whole, name) for name in sizes}
        return replace(whole, **left_out) if lens in (None, glass.number) else whole

    monkeypatch.setattr(meeting.Glass, "met", fewer)


def noise_before(k: float, **second: Any) -> Scene:
    """A sphere whose F loses the digits of k^2, and then a lens whose F loses none."""
    text = "(x + k)**2 - k**2 - 2*k*x + y**2 + z**2 - 0.25"
    noisy = {"surface": text, "k": k, "bounds": [[-0.6] * 3, [0.6] * 3], "centre": [0.0, 0.0, 1.0], "n": 1.5}
    return made({**noisy, "name": "noisy"}, {**BALL, "r": 0.8, "centre": [0.0, 0.0, -1.5], **second, "name": "clean"})


def focus_between(far: float) -> Scene:
    """Parallel light is gathered far from the origin, and a tiny sphere stands behind its focus."""

    def at(z: float) -> list[float]:
        return [far, far, far + z]

    screens = {
        "film.centre": at(2.0), "film.right": [0.03, 0.0, 0.0], "film.down": [0.0, -0.03, 0.0],
        "picture.centre": at(-1.6), "picture.right": [0.01, 0.0, 0.0], "picture.down": [0.0, -0.01, 0.0],
        "source": {"kind": "parallel", "direction": [0.0, 0.0, -1.0]},
    }  # fmt: skip
    large = {**BALL, "r": 1.0, "centre": at(0.0), "name": "large"}
    return made(large, {**BALL, "r": 0.02, "centre": at(-1.53), "name": "tiny"}, **screens)


BALL = {"surface": "sphere", "n": 1.5}
LONG = {"k = 1e4": noise_before(1e4), "k = 1e6": noise_before(1e6), "far focus": focus_between(1e3)}


@pytest.fixture(scope="module")
def long_paths_certified() -> dict[str, tuple[Scene, Any, Any]]:
    found = {}
    for name, scene in LONG.items():
        pixels = some_pixels(scene, 80)
        found[name] = scene, pixels, truth(scene, pixels, None)
    return found


def test_bounds_hold_on_paths_of_four_surfaces(long_paths_certified) -> None:
    for name, (scene, pixels, found) in long_paths_certified.items():
        places = pixel_bounds(scene, pixels)
        is_long = places.events == 4
        assert is_long.sum() > 30, name
        assert (places.bound[is_long] >= 0).mean() > (0.5 if name == "k = 1e6" else 0.95), name
        ratios = judged(places, found)
        assert ratios.max() <= 1.0, name
        assert np.median(ratios) > 1e-3, name


def test_without_the_noise_of_an_earlier_surface_they_would_not(long_paths_certified, monkeypatch) -> None:
    without(monkeypatch, "level", "tilt", lens=0)
    for name in ("k = 1e4", "k = 1e6"):
        scene, pixels, found = long_paths_certified[name]
        assert (judged(pixel_bounds(scene, pixels), found) > 1).sum() > 15, name


def test_without_what_rounds_between_they_would_not(long_paths_certified, monkeypatch) -> None:
    without(monkeypatch, "searched", "told", "placed")
    scene, pixels, found = long_paths_certified["far focus"]
    assert (judged(pixel_bounds(scene, pixels), found) > 1).sum() > 10


@pytest.mark.parametrize("k", [0.0, 1e4])
def test_where_paths_part_a_bound_holds_or_there_is_none(k: float) -> None:
    """Rays are aimed at the rims of both lenses, and beside them by 1e-15 to 1e-3 of their slope."""
    scene = noise_before(k, surface="torus", R=0.3, r=0.05, centre=[0.1, 0.0, -0.5])
    across = np.linspace(-0.4, 0.4, 201)
    parts = np.flatnonzero(np.diff(events_at(scene, across).astype(int)))
    assert len(parts) >= 4
    low, high = across[parts], across[parts + 1]
    before = events_at(scene, low)
    for _ in range(54):
        middle = (low + high) / 2
        is_before = events_at(scene, middle) == before
        low, high = np.where(is_before, middle, low), np.where(is_before, high, middle)
    beside = np.array([0.0, *(sign * 10.0**-power for power in range(3, 16, 2) for sign in (1, -1))])
    slopes = np.unique(low[:, None] + beside)
    origins, directions = rays_at(slopes)
    places = place_bounds(scene, origins, directions)
    proofs = prove_rays(scene, origins.tolist(), directions.tolist(), most_bits=512)
    known = [i for i, proof in enumerate(proofs) if proof.status is not None and places.bound[i] >= 0]
    assert 8 <= len(known) < len(slopes) - 4
    for i in known:
        assert proofs[i].st is not None, slopes[i]
        assert proofs[i].distance(*places.st[i]) <= places.bound[i], slopes[i]


def rays_at(slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    x = np.asarray(slopes)
    return np.tile([0.0, 0.0, 4.0], (len(x), 1)), np.stack([x, np.full(len(x), 0.03), np.full(len(x), -3.0)], axis=1)


def events_at(scene: Scene, slopes: np.ndarray) -> np.ndarray:
    return trace_rays(scene, *rays_at(slopes), precision="double").events


@pytest.mark.parametrize(
    "lenses",
    [
        [{"surface": "torus", "n": 2.4, "rotate": [20, 30, 10]}],  # with total reflections
        [{"surface": "heart", "n": 1.5, "stretch": [0.8, 0.5, 0.6], "rotate": [-90, -90, 0]}],
        [{**BALL, "r": 0.5, "centre": [0, 0, 1.0], "name": "a"}, {**BALL, "r": 0.8, "centre": [0, 0, -1], "name": "b"}],
    ],
)
def test_derivatives_of_a_path_are_those_of_difference_quotients(lenses) -> None:
    scene = made(*lenses)
    points, directions = film_rays(scene, np.arange(0, scene.film.rows * scene.film.columns, 331))
    units = directions / np.linalg.norm(directions, axis=1)[:, None]
    judge = Judge(scene)
    found = judge.paths(points, units)
    rays = np.flatnonzero(np.isin(found.status, (0, 1)))
    nothing = np.zeros((3, len(rays)))
    way = carried._Way(scene, meeting.Glasses(scene), points[rays].T, units[rays].T,
                       nothing, nothing)  # fmt: skip
    for each in judge.meetings(points, units, found, rays):
        at = np.searchsorted(rays, each.rays)
        way.meet(at, each, np.arange(len(at)))
    known = np.isfinite(way.landed(found.origin[rays].T, found.direction[rays].T)[0])
    step, checked = 1e-7, 0
    for number, row in enumerate(way.rows):
        if number:  # a direction is kept unit, and so moves across itself alone
            row = row - np.einsum("kim,mi->km", row, units[rays])[:, None] * units[rays].T
        for axis in range(3):
            moves = np.zeros((2, 3))
            moves[number, axis] = step
            ends = []
            for sign in (1.0, -1.0):
                turned = units[rays] + sign * moves[1]
                turned /= np.linalg.norm(turned, axis=1)[:, None]
                ends.append(judge.paths(points[rays] + sign * moves[0], turned))
            same = known.copy()
            for end in ends:
                same &= (end.events == found.events[rays]) & np.isin(end.status, (0, 1))
            got = ((ends[0].st - ends[1].st) / (2 * step)).T
            close = np.abs(got - row[:, axis]).max(axis=0) <= 1e-4 * np.abs(row).max(axis=(0, 1)) + 1e-7
            checked += int(same.sum())
            assert close[same].mean() > 0.97  # beside silhouettes a step of 1e-7 is no small one
    assert checked > 300


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
