"""From a wanted accuracy to the cheapest combination: with made-up times, and against certified answers."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import validate_planner
from scenes import make_scene
from thinned import thinned

import lenscl
from lenscl.accuracy import CalibrationCache, Planner
from lenscl.accuracy.achieved import check
from lenscl.accuracy.combination import Combination
from lenscl.accuracy.judgement import judge
from lenscl.accuracy.sample import Sample
from lenscl.accuracy.truth import Truth
from lenscl.config import Accuracy, Scene
from lenscl.device import choose
from lenscl.errors import StudyError
from lenscl.lenses import catalogue
from lenscl.tracing import RayMap, trace

COSTS = {"single": 1e6, "mixed": 1.5e6, "double": 2e6}  # ns a ray
FACTORS = {"polynomial": 1.0, "guarded": 1.1, "interval": 1.5, "auto": 1.0}
STEPS = 0.4  # a march costs so much a step through the lens, times the precision's cost
FILM = {"size": [96, 96]}


def made_up(scene: Scene) -> float:
    numerics = scene.numerics
    cost = COSTS[numerics.precision] * (0.9 if numerics.snell == "paraxial" else 1.0)
    if numerics.method == "march":
        return cost * STEPS / numerics.step
    return cost * FACTORS[numerics.method]


@pytest.fixture
def times(monkeypatch: pytest.MonkeyPatch) -> list[Scene]:
    """Let every scene cost what the table says; return what was timed."""
    timed: list[Scene] = []

    def best_times(scenes: Sequence[Scene], *_: Any, **__: Any) -> list[float]:
        timed.extend(scenes)
        return [made_up(scene) for scene in scenes]

    monkeypatch.setattr("lenscl.accuracy.planning.best_times", best_times)
    monkeypatch.setattr("lenscl.accuracy.planning.ns_of", lambda raymap: made_up(raymap.scene))
    return timed


@pytest.fixture(autouse=True)
def few_pixels(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plan on the fewest pixels, each of which is traced some fifty times."""
    monkeypatch.setattr("lenscl.accuracy.planning._PIXELS", (2**13, 2**13))


@pytest.fixture
def here(tmp_path: Path) -> Planner:
    return Planner(choose(), CalibrationCache(tmp_path / "calibration"))


def error_of(raymap: RayMap, wanted: Accuracy) -> tuple[float, float]:
    """Return the 99 % error, in the unit of a wish, and the share that ends otherwise, against certified answers."""
    scene = raymap.scene
    sample = Sample.of(raymap, {"many": 10, "edge": 20, "steep": 40, "lens": 200, "free": 10})
    judgement = judge(raymap, Truth.certified(scene, sample.pixels), sample.drawn)
    return (judgement.pixels if wanted.unit == "px" else judgement.units).high.value, judgement.differ.value


@pytest.mark.parametrize(
    ("wish", "method", "precision"),
    [
        ("1 px", "polynomial", "single"),
        ("0.05 px", "polynomial", "single"),
        ("1e-5 px", "polynomial", "mixed"),
        ("1e-9", "polynomial", "mixed"),
    ],
)
def test_the_cheapest_that_meets_a_wish_is_taken(
    times: list[Scene], here: Planner, wish: str, method: str, precision: str
) -> None:
    scene = make_scene({"surface": "torus"}, film=FILM, numerics={"accuracy": wish})
    raymap, achieved = here.trace(scene)
    assert achieved is not None
    assert (achieved.combination.method, achieved.combination.precision) == (method, precision)
    assert achieved.is_met
    assert (raymap.scene.numerics.method, raymap.scene.numerics.precision) == (method, precision)
    error, differ = error_of(raymap, achieved.wanted)
    assert error <= achieved.wanted.value
    assert differ <= 1e-3


def test_a_cheap_double_is_taken_before_a_dear_single(
    times: list[Scene], here: Planner, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(COSTS, "double", 5e5)
    _, achieved = here.trace(make_scene({"surface": "torus"}, film=FILM, numerics={"accuracy": "1 px"}))
    assert achieved is not None
    assert achieved.combination.precision == "double"


def test_of_nearly_equal_times_the_more_accurate_is_taken(
    times: list[Scene], here: Planner, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(COSTS, "double", 1.05e6)
    _, achieved = here.trace(make_scene({"surface": "torus"}, film=FILM, numerics={"accuracy": "1 px"}))
    assert achieved is not None
    assert achieved.combination.precision == "double"


def test_a_march_is_taken_only_where_it_is_worth_its_lost_rays(
    times: list[Scene], here: Planner, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = make_scene({"surface": "sphere"}, film=FILM, numerics={"accuracy": "1 px"})
    _, usual = here.trace(scene)
    assert usual is not None
    assert usual.combination.method == "polynomial"
    monkeypatch.setitem(globals(), "STEPS", 0.001)
    cheap = Planner(choose(), CalibrationCache(Path(here._cache.folder) / "cheap"))
    raymap, achieved = cheap.trace(scene)
    assert achieved is not None
    assert achieved.combination.method == "march"
    assert achieved.differ <= 1e-3
    assert judge(raymap, Truth.traced(trace(scene, precision="double"))).differ.value <= 1e-3


def test_the_paraxial_rule_serves_the_weakest_lenses_alone(times: list[Scene], here: Planner) -> None:
    combinations = {}
    for n in (1.5, 1.0 + 1e-7):
        scene = make_scene({"surface": "sphere", "n": n}, film=FILM, numerics={"accuracy": "0.01 px"})
        raymap, achieved = here.trace(scene)
        assert achieved is not None
        combinations[n] = achieved.combination.snell
        assert error_of(raymap, achieved.wanted)[0] <= 0.01
    assert combinations == {1.5: "exact", 1.0 + 1e-7: "paraxial"}


def test_what_cannot_be_reached_is_refused_and_what_can_is_said(times: list[Scene], here: Planner) -> None:
    scene = make_scene({"surface": "torus"}, film=FILM)
    with pytest.raises(StudyError) as refused:
        here.trace(scene.replace({"numerics.accuracy": "1e-16 px"}))
    text = str(refused.value)
    assert text.startswith('numerics.accuracy: "1e-16 px" cannot be reached: the most accurate here, ')
    reachable = float(text.split("within ")[1].split(" px")[0])
    assert 1e-15 < reachable < 1e-8
    _, achieved = here.trace(scene.replace({"numerics.accuracy": f"{1.3 * reachable} px"}))
    assert achieved is not None
    assert achieved.against == "certified answers"
    assert achieved.is_met


def test_where_rounding_decides_too_many_paths_that_is_said(
    times: list[Scene], here: Planner, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lenscl.accuracy.achieved.MOST_DIFFER", -1.0)
    scene = make_scene({"surface": "torus"}, film=FILM, numerics={"accuracy": "1 px"})
    with pytest.raises(StudyError, match="end otherwise than they should"):
        here.trace(scene)


def test_pixels_are_those_of_the_largest_picture(times: list[Scene], here: Planner) -> None:
    scene = make_scene({"surface": "torus"}, film=FILM, numerics={"accuracy": "0.05 px"})
    coarse, fine = (here.trace(scene, size=size)[1] for size in ((64, 64), (2**20, 2**20)))
    assert coarse is not None
    assert fine is not None
    assert coarse.combination.precision == "single"
    assert fine.combination.precision == "mixed"


def test_a_point_that_needs_more_than_its_like_gets_its_own_plan(times: list[Scene], here: Planner) -> None:
    easy = make_scene({"surface": "sphere", "r": 0.7}, film=FILM, numerics={"accuracy": "0.05 px"})
    hard = easy.replace({"picture.centre": [0.0, 0.0, -5000.0]})  # a long lever: single is off by many pixels there
    _, first = here.trace(easy)
    _, alike = here.trace(easy.replace({"lens.r": 0.75}), like=easy)
    raymap, achieved = here.trace(hard, like=easy)
    assert first is not None
    assert alike is not None
    assert achieved is not None
    assert first.combination.precision == alike.combination.precision == "single"
    assert achieved.combination.precision != "single"
    assert error_of(raymap, achieved.wanted)[0] <= 0.05


def test_points_alike_are_not_planned_again(times: list[Scene], here: Planner) -> None:
    easy = make_scene({"surface": "sphere", "r": 0.7}, film=FILM, numerics={"accuracy": "0.05 px"})
    here.trace(easy, like=easy)
    timed = len(times)
    for r in (0.6, 0.65, 0.8):
        _, achieved = here.trace(easy.replace({"lens.r": r}), like=easy)
        assert achieved is not None
        assert achieved.is_met
    assert len(times) == timed


def test_a_wish_that_cannot_be_reached_is_not_planned_for_every_point(times: list[Scene], here: Planner) -> None:
    first = make_scene({"surface": "sphere", "r": 0.7}, film=FILM, numerics={"accuracy": "1e-17 px"})
    for r in (0.7, 0.7, 0.7):
        timed = len(times)
        with pytest.raises(StudyError, match="cannot be reached"):
            here.trace(first.replace({"lens.r": r}), like=first)
    assert len(times) == timed


def test_a_calibration_is_kept_and_found_again(times: list[Scene], tmp_path: Path) -> None:
    scene = make_scene({"surface": "torus"}, film=FILM, numerics={"accuracy": "0.05 px"})
    cache = CalibrationCache(tmp_path / "cache")
    Planner(choose(), cache).trace(scene)
    cold = len(times)
    (kept,) = cache.folder.iterdir()
    times.clear()
    Planner(choose(), cache).trace(scene.replace({"lens.r": 0.2}))  # another scene of the same kernel
    warm = len(times)
    assert warm < cold - 6
    times.clear()
    kept.write_bytes(kept.read_bytes()[:50])  # cut short: measured anew
    Planner(choose(), cache).trace(scene)
    assert len(times) == cold
    assert [path.name for path in cache.folder.iterdir()] == [kept.name]


def test_a_calibration_of_another_driver_is_not_used(times: list[Scene], tmp_path: Path) -> None:
    cache = CalibrationCache(tmp_path)
    scene = make_scene({"surface": "torus"}, film=FILM, numerics={"accuracy": "0.05 px"})
    Planner(choose(), cache).trace(scene)
    (kept,) = tmp_path.iterdir()
    text = kept.read_text()
    driver = choose().driver
    assert driver in text
    kept.write_text(text.replace(driver, "another"))
    times.clear()
    Planner(choose(), cache).trace(scene)
    assert len(times) > 10


def test_a_map_that_is_off_is_seen(here: Planner) -> None:
    """The check is of the map's own rays: one that was disturbed does not pass."""
    scene = make_scene({"surface": "torus"}, film=FILM)
    raymap, wanted = trace(scene), Accuracy(1e-6, "px")
    combination = Combination(method="polynomial")
    assert check(raymap, wanted, combination, None).is_met
    off = replace(raymap, st=raymap.st + 1e-8)
    assert not check(off, wanted, combination, None).is_met
    lost = raymap.events.copy()
    lens = np.flatnonzero(lost.ravel())
    lost.ravel()[lens[:: len(lens) // 50]] = 0
    assert not check(replace(raymap, events=lost), wanted, combination, None).is_met


def test_the_public_trace_is_as_accurate_as_asked() -> None:
    scene = make_scene({"surface": "sphere"}, film=FILM, numerics={"accuracy": "1e-6 px"})
    raymap = lenscl.trace(scene)
    assert raymap.scene.numerics.accuracy is None
    assert error_of(raymap, Accuracy(1e-6, "px"))[0] <= 1e-6
    paths = lenscl.trace_rays(scene, [[0.1, 0.2, 4.0]], [[0.0, 0.0, -1.0]])
    assert paths.scene.numerics.precision == raymap.scene.numerics.precision
    assert lenscl.trace(scene, precision="single").st.dtype == np.float32


def test_a_scene_that_asks_for_nothing_is_not_checked(here: Planner) -> None:
    raymap, achieved = here.trace(make_scene({"surface": "sphere"}, film=FILM))
    assert achieved is None
    assert raymap.scene.numerics.method == "auto"


def test_a_film_that_meets_no_lens_is_as_accurate_as_anyone_asks(here: Planner) -> None:
    scene = make_scene({"surface": "sphere", "centre": [50.0, 0.0, 0.0]}, numerics={"accuracy": "1e-30 px"})
    raymap, achieved = here.trace(scene)
    assert achieved is not None
    assert achieved.is_met
    assert (achieved.error, achieved.rays) == (0.0, 0)
    assert raymap.scene.numerics.precision == "double"


@pytest.mark.parametrize("number", thinned(range(20), [0, 1]))
def test_random_scenes_meet_their_wishes(here: Planner, number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The scenes of bench/validate_planner.py, which holds their times against the best as well."""
    monkeypatch.setattr(validate_planner, "FILM", 96)
    surfaces = [*catalogue(), *validate_planner.EXPRESSIONS]
    scene = validate_planner.random_scene(np.random.default_rng(100 + number), surfaces[number % len(surfaces)])
    raymap, achieved = here.trace(scene)
    assert achieved is not None
    error, differ = error_of(raymap, achieved.wanted)
    assert error <= achieved.wanted.value
    assert differ <= 0.01  # of a few hundred rays; the planner saw to 0.1 % of thousands


@pytest.mark.parametrize(
    ("stretch", "wish"),
    thinned([(0.02, "0.2 px"), (0.035, "0.2 px"), (0.035, "1e-5 px")], [(0.02, "0.2 px"), (0.035, "1e-5 px")]),
)
def test_a_lens_of_a_few_pixels_is_judged_by_all_of_its_rays(here: Planner, stretch: float, wish: str) -> None:
    lens = {"surface": "heart", "stretch": [stretch] * 3, "rotate": [-90.0, -90.0, 0.0]}
    scene = make_scene(lens, film={"size": [1200, 1200]}, numerics={"accuracy": wish})
    raymap, achieved = here.trace(scene)
    assert achieved is not None
    exact = trace(achieved.combination.of(scene), precision="double", method="auto")
    truth = Truth.bounded(exact.scene, np.flatnonzero(exact.events), exact.device)
    judgement = judge(raymap, truth)
    assert 90 < judgement.compared == achieved.rays < 400
    assert judgement.pixels.high.value == pytest.approx(achieved.error)
    assert achieved.error <= achieved.wanted.value


def test_a_large_map_is_judged_by_upper_bounds_of_a_sample() -> None:
    scene = make_scene({"surface": "torus"}, film={"size": [400, 400]})
    raymap, wanted = trace(scene, precision="single"), Accuracy(0.05, "px")
    combination = Combination(method="polynomial", precision="single")
    every = judge(raymap, Truth.bounded(scene, np.arange(raymap.status.size), raymap.device))
    achieved = check(raymap, wanted, combination, None)
    assert achieved.rays > 10_000
    for seconds in (1e-9, 1e9):  # a quick and a slow day
        assert check(replace(raymap, trace_seconds=seconds), wanted, combination, None) == achieved
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("lenscl.accuracy.achieved._CHECKED", (2048, 2048))
        sampled = check(raymap, wanted, combination, None)
    assert 1500 < sampled.rays < 2100
    assert every.pixels.high.value < sampled.error < 20 * every.pixels.high.value
    assert sampled.differ >= every.differ.value


def test_rays_that_a_map_lost_beside_a_lens_are_looked_at(here: Planner) -> None:
    scene = make_scene({"surface": "sphere"}, film={"size": [300, 300]})
    raymap = trace(scene)
    lens = raymap.events > 0
    rim = lens & ~(np.roll(lens, 1, 0) & np.roll(lens, -1, 0) & np.roll(lens, 1, 1) & np.roll(lens, -1, 1))
    lost = replace(raymap, events=np.where(rim, 0, raymap.events).astype(np.uint8))
    achieved = check(lost, Accuracy(1.0, "px"), Combination(method="polynomial"), None)
    assert achieved.differ == pytest.approx(rim.sum() / lens.sum(), rel=0.02)
    assert not achieved.is_met


@pytest.mark.parametrize("harm", ["folder", "no times", "no march", "no number"])
def test_a_cache_that_cannot_be_used_costs_time_alone(times: list[Scene], tmp_path: Path, harm: str) -> None:
    cache = CalibrationCache(tmp_path / "calibration")
    scene = make_scene({"surface": "torus"}, film=FILM, numerics={"accuracy": "0.05 px"})
    if harm == "folder":
        cache.folder.write_text("a file where the folder should be")
    else:
        Planner(choose(), cache).trace(scene)
        (kept,) = cache.folder.iterdir()
        found = json.loads(kept.read_text())
        if harm == "no times":
            found["ns"] = []
        elif harm == "no march":
            found["ns"] = [pair for pair in found["ns"] if pair[0]["method"] != "march"]
        else:
            found["ns"][0][1] = -1.0
        kept.write_text(json.dumps(found))
    times.clear()
    _, achieved = Planner(choose(), cache).trace(scene)
    assert achieved is not None
    assert achieved.is_met
    assert len(times) > 10  # measured anew


def test_where_no_ray_can_be_judged_that_is_said(here: Planner) -> None:
    scene = make_scene({"surface": "torus"}, film=FILM, numerics={"accuracy": "1e-9 px", "max_events": 1})
    _, achieved = here.trace(scene)
    assert achieved is not None
    assert achieved.rays == 0
    assert "no ray meets a lens and lands" in str(achieved)


def test_what_fails_on_the_map_is_planned_without_and_a_march_again_with_finer_steps(
    times: list[Scene], here: Planner, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(globals(), "STEPS", 0.001)
    tried: list[Combination] = []

    def refusing(raymap: RayMap, wanted: Accuracy, combination: Combination, size: Any) -> Any:
        tried.append(combination)
        achieved = check(raymap, wanted, combination, size)
        return replace(achieved, differ=1.0) if len(tried) == 1 else achieved

    monkeypatch.setattr("lenscl.accuracy.planner.check", refusing)
    _, achieved = here.trace(make_scene({"surface": "sphere"}, film=FILM, numerics={"accuracy": "1 px"}))
    assert achieved is not None
    assert achieved.is_met
    assert [each.method for each in tried] == ["march"] * len(tried)
    steps = [each.step for each in tried if each.step is not None]
    assert len(steps) >= 2
    assert steps == sorted(set(steps), reverse=True)
