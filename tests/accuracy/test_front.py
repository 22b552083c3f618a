"""Which combinations stand on a front, by made-up times and errors, and a front that was measured."""

from __future__ import annotations

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from scenes import make_scene

from lenscl.accuracy import Front, Tried, circumstances, front, front_csv, front_sentence, measure_front
from lenscl.accuracy.combination import Combination
from lenscl.accuracy.judgement import Distances, Judgement
from lenscl.accuracy.statistics import Estimate
from lenscl.config import Accuracy
from lenscl.device import choose
from lenscl.errors import StudyError

ROUNDS = 15


def tried(
    name: str,
    time: float,
    error: float,
    *,
    spread: float = 1.3,
    noise: float = 0.01,
    differ: float = 0.0,
    seed: int = 0,
) -> Tried:
    """Make one up, its error known to a factor of `spread`, its rounds scattering by `noise`."""
    random = np.random.default_rng([seed, len(name), int(time * 10)])
    ns = time * (1.0 + noise * random.standard_normal(ROUNDS))
    high = Estimate(error, error / spread, error * spread)
    distances = Distances(median=Estimate(error / 10, error / 11, error / 9), high=high, largest=error * 10)
    share = Estimate(0.0, 0.0, 0.001)
    judgement = Judgement(
        against="a friend", sampled=900, unknown=0, compared=800, pixels=distances, units=distances, differ=share,
        colours=share,
    )  # fmt: skip
    return Tried(
        combination=Combination(method=name), searches=(name,), ns=tuple(ns.tolist()), first_seconds=1.0,
        judgement=judgement, differ=differ, undecided=0.0, escalated=0.0, width=8, kernel_key="k",
    )  # fmt: skip


def made(*some: Tried) -> Front:
    return Front(
        tried=tuple(sorted(some, key=lambda each: each.error)), left_out=(), title="t", film=(8, 8), picture=(9, 9),
        sampled={"lens": 9}, forerunner=Combination(method="march"), circumstances={"platform": "p", "device": "d",
        "driver": "1", "kind": "cpu", "units": 2}, rounds=ROUNDS, program="lenscl", made="now", scene_key="s",
    )  # fmt: skip


def places(*some: Tried) -> dict[str, str]:
    return {combination.method: place for combination, place in made(*some).places.items()}


def test_the_faster_of_two_as_accurate_stands() -> None:
    assert places(tried("slow", 20, 1e-9), tried("fast", 10, 1.1e-9)) == {"slow": "behind", "fast": "front"}


def test_less_accurate_and_faster_stands_too_and_slower_does_not() -> None:
    found = places(tried("exact", 20, 1e-9), tried("coarse", 10, 1e-3), tried("bad", 21, 1e-3))
    assert found == {"exact": "front", "coarse": "front", "bad": "behind"}


def test_what_noise_does_not_tell_apart_is_said() -> None:
    found = places(tried("one", 10.0, 1e-9, noise=0.2), tried("two", 10.2, 1e-9, noise=0.2, seed=3))
    assert sorted(found.values()) == ["front", "noise"]


def test_faster_by_less_than_noise_does_not_stand() -> None:
    found = places(tried("exact", 10.0, 1e-9, noise=0.2), tried("coarse", 9.8, 1e-3, noise=0.2, seed=5))
    assert found == {"exact": "front", "coarse": "behind"}


def test_what_loses_too_many_rays_has_no_place_and_beats_nothing() -> None:
    found = places(tried("exact", 20, 1e-9), tried("lossy", 1, 1e-12, differ=0.0011))
    assert found == {"exact": "front", "lossy": "not eligible"}


def test_an_error_beyond_the_bounds_of_another_is_another_class() -> None:
    close = places(tried("a", 20, 1e-9, spread=3.0), tried("b", 10, 2e-9, spread=3.0))
    far = places(tried("a", 20, 1e-9, spread=1.5), tried("b", 10, 2e-9, spread=1.5))
    assert close == {"a": "behind", "b": "front"}
    assert far == {"a": "front", "b": "front"}


def test_no_chain_of_small_steps_pushes_the_most_accurate_off() -> None:
    """Each is as accurate as the next, but the last is not as accurate as the first."""
    chain = [tried(f"{k}", 20.0 - k, 1e-9 * 1.25**k, spread=1.3) for k in range(9)]
    standing = made(*chain).on_front()
    assert standing[0].error <= 1.3e-9
    assert standing[-1].combination.method == "8"


def test_a_common_slowdown_changes_nothing() -> None:
    """Rounds are paired: a machine that is three times slower in some of them slows all."""
    load = np.where(np.arange(ROUNDS) % 3 == 0, 3.0, 1.0)
    some = [tried("exact", 10.5, 1e-9), tried("coarse", 10.0, 1e-3)]
    loaded = [replace(each, ns=tuple((np.array(each.ns) * load).tolist())) for each in some]
    assert places(*loaded) == places(*some) == {"exact": "front", "coarse": "front"}


def test_the_cheapest_that_meets_a_wish() -> None:
    here = made(tried("exact", 20, 1e-9), tried("coarse", 10, 1e-3), tried("lossy", 1, 1e-4, differ=0.01))
    cases = {1e-2: "coarse", 1e-5: "exact"}
    for value, name in cases.items():
        cheapest = here.cheapest(Accuracy(value, "px"))
        assert cheapest is not None
        assert cheapest.combination.method == name
    assert here.cheapest(Accuracy(1e-12, "scene units")) is None


def test_the_sentence_says_what_a_wish_needs_and_what_the_forerunner_costs() -> None:
    here = made(tried("exact", 20, 1e-9), tried("coarse", 10, 1e-3), tried("march", 60, 1.1e-9))
    told = front_sentence(here).split("; ")
    assert told[0].startswith("within 0.05 px: coarse, double, ")
    assert told[1].startswith("as exact as can be told: exact, double, ")
    assert "the forerunner's method: march, double, " in told[2]
    assert "3.0 x" in told[2]
    assert front_sentence(here, Accuracy(1e-15, "px")).startswith("within 1e-15 px: nothing here is")


@pytest.fixture(scope="module")
def measured() -> Front:
    few = (
        Combination(method="polynomial", precision="single"),
        Combination(method="polynomial"),
        Combination(method="march", step=0.01),
        Combination(method="march", step=0.5),
        Combination(method="polynomial", snell="paraxial"),
        Combination(method="march", step=1e-7),  # refused: it would take for ever
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(front, "every_combination", lambda *_: list(few))
        scene = make_scene({"surface": "torus"}, film={"size": [64, 64]})
        return measure_front(scene, choose(), title="a torus", made="now", size=(256, 256), rounds=6)


def test_a_measured_front_knows_its_circumstances(measured: Front) -> None:
    assert len(measured.tried) == 5
    assert len(measured.left_out) == 1
    assert "numerics.step" in measured.left_out[0]
    assert measured.picture == (256, 256)
    errors = {(each.combination.method, each.combination.precision, each.combination.step, each.combination.snell):
              each.error for each in measured.tried}  # fmt: skip
    assert errors["polynomial", "double", None, "exact"] < 1e-8
    assert 1e-6 < errors["polynomial", "single", None, "exact"] < 1.0
    assert errors["polynomial", "double", None, "paraxial"] > 10.0
    coarse = next(each for each in measured.tried if each.combination.step == 0.5)
    assert measured.places[coarse.combination] == "not eligible"
    told = "\n".join(circumstances(measured))
    device = choose()
    for word in (
        device.name,
        " ".join(device.driver.split()),
        device.platform,
        "64 x 64",
        "warm",
        "6 rounds",
        "certified",
        "256",
    ):
        assert word in told


def test_the_csv_carries_all_that_a_figure_needs(measured: Front) -> None:
    rows = list(csv.DictReader(io.StringIO(front_csv(measured))))
    assert len(rows) == len(measured.tried)
    device = choose()
    for row, one in zip(rows, measured.tried, strict=True):
        assert float(row["ns_per_ray"]) == one.time
        assert float(row["ns_per_ray_low"]) <= float(row["ns_per_ray"]) <= float(row["ns_per_ray_high"])
        assert float(row["error_px_99"]) == one.error
        assert (row["device"], row["driver"], row["platform"]) == (device.name, device.driver, device.platform)
        assert (int(row["rays"]), row["state"], int(row["rounds"])) == (64 * 64, "warm", 6)
        assert int(row["width"]) == one.width
        assert row["against"] == "certified answers"
        assert row["place"] == measured.places[one.combination]


@pytest.mark.parametrize("size", [[1, 10**6], [2, 10**6], [10**6, 3], [700, 900], [90, 90], [8192, 1]])
def test_a_film_is_made_coarser_to_no_more_than_so_many_pixels(size: list[int]) -> None:
    scene = make_scene({"surface": "sphere"}, film={"size": size})
    columns, rows = front.coarser(scene, 8192).film.size
    assert 4000 < columns * rows <= 8192 or [columns, rows] == size
    assert columns <= size[0]
    assert rows <= size[1]


def test_a_film_that_meets_no_lens_has_no_front() -> None:
    scene = make_scene({"surface": "sphere", "centre": [50.0, 0.0, 0.0]}, film={"size": [8, 8]})
    with pytest.raises(StudyError, match="film: no ray meets a lens"):
        measure_front(scene, choose(), title="", made="")
