"""Judgements of maps: errors put in by hand come out, and certified answers are what maps are held against."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scenes import make_scene

from lenscl.accuracy.judgement import SEEN, judge
from lenscl.accuracy.sample import Sample
from lenscl.accuracy.truth import Truth
from lenscl.status import RayStatus
from lenscl.tracing import RayMap, trace

FEW = {"edge": 20, "many": 10, "steep": 20, "lens": 60, "free": 10}


@pytest.fixture(scope="module")
def raymap() -> RayMap:
    return trace(make_scene({"surface": "torus"}, film={"size": [40, 30]}, picture={"size": [512, 256]}))


@pytest.fixture(scope="module")
def truth(raymap: RayMap) -> Truth:
    return Truth.traced(raymap)


def moved(raymap: RayMap, by: tuple[float, float], chosen: Any = slice(None)) -> RayMap:
    st = raymap.st.copy()
    st.reshape(-1, 2)[chosen] += by
    return replace(raymap, st=st)


def test_a_map_is_right_against_itself(raymap: RayMap, truth: Truth) -> None:
    judgement = judge(raymap, truth)
    assert judgement.pixels.largest == judgement.units.largest == 0.0
    assert judgement.differ.value == judgement.colours.value == 0.0
    assert judgement.compared > 200


def test_a_shift_is_an_error_of_its_length(raymap: RayMap, truth: Truth) -> None:
    judgement = judge(moved(raymap, (0.003, -0.004)), truth)
    for one in (judgement.pixels.median.value, judgement.pixels.high.value, judgement.pixels.largest):
        assert one == pytest.approx(0.003 * 512)  # more than 0.004 * 256
    for one in (judgement.units.median.value, judgement.units.high.value, judgement.units.largest):
        assert one == pytest.approx(6.0 * 0.005)
    other_size = judge(moved(raymap, (0.003, -0.004)), truth, size=(100, 1000))
    assert other_size.pixels.median.value == pytest.approx(4.0)
    assert other_size.units.median.value == judgement.units.median.value


def test_scene_units_are_lengths_on_a_sheared_picture() -> None:
    scene = make_scene({"surface": "sphere"}, picture={"right": [6.0, 2.0, 0.0], "down": [3.0, -6.0, 1.0]})
    raymap = trace(scene)
    judgement = judge(moved(raymap, (0.01, 0.02)), Truth.traced(raymap))
    expected = np.linalg.norm(0.01 * np.array([6.0, 2.0, 0.0]) + 0.02 * np.array([3.0, -6.0, 1.0]))
    assert judgement.units.median.value == pytest.approx(expected)


def test_an_error_that_few_have_is_the_largest_and_not_the_99_per_cent(raymap: RayMap, truth: Truth) -> None:
    lens = np.flatnonzero((raymap.events > 0).ravel() & (raymap.status == RayStatus.PICTURE).ravel())
    few = judge(moved(raymap, (0.1, 0.0), lens[:2]), truth)
    assert few.pixels.high.value == 0.0
    assert few.pixels.largest == pytest.approx(51.2)
    many = judge(moved(raymap, (0.1, 0.0), lens[: len(lens) // 20]), truth)
    assert many.pixels.high.value == pytest.approx(51.2)


def test_rays_that_end_otherwise_are_counted_and_not_compared(raymap: RayMap, truth: Truth) -> None:
    lens = np.flatnonzero((raymap.events > 0).ravel())
    status = raymap.status.copy()
    status.ravel()[lens[:7]] = RayStatus.UNDECIDED
    judgement = judge(replace(raymap, status=status), truth)
    assert judgement.differ.value == pytest.approx(7 / len(lens))
    assert judgement.colours.value == pytest.approx(7 / raymap.status.size)
    whole = judge(raymap, truth)
    landed = np.isin(raymap.status.ravel()[lens[:7]], (RayStatus.PICTURE, RayStatus.OFF_PICTURE)).sum()
    assert judgement.compared == whole.compared - landed


def test_other_events_are_another_end(raymap: RayMap, truth: Truth) -> None:
    events = raymap.events.copy()
    lens = np.flatnonzero(events.ravel())
    events.ravel()[lens[:5]] += 1
    assert judge(replace(raymap, events=events), truth).differ.value == pytest.approx(5 / len(lens))


def test_a_colour_changes_where_it_would_be_seen(raymap: RayMap, truth: Truth) -> None:
    unseen = judge(moved(raymap, (0.9 * SEEN / 512, 0.0)), truth).colours.value
    seen = judge(moved(raymap, (1.1 * SEEN / 512, 0.0)), truth).colours.value
    assert unseen == 0.0
    assert seen == pytest.approx((raymap.status == RayStatus.PICTURE).mean())


def test_what_a_double_of_the_truth_leaves_off_counts(raymap: RayMap, truth: Truth) -> None:
    rest = np.full(truth.st.shape, 1e-3)
    assert judge(raymap, replace(truth, rest=rest)).pixels.median.value == pytest.approx(0.512)


def test_what_nobody_knows_is_left_out(raymap: RayMap, truth: Truth) -> None:
    known = np.ones(raymap.status.size, np.bool_)
    known[:100] = False
    wrong = np.arange(100)
    judgement = judge(moved(raymap, (0.5, 0.5), wrong), replace(truth, is_known=known))
    assert judgement.pixels.largest == 0.0
    assert judgement.unknown == 100


def test_what_the_truth_is_right_to_is_added(raymap: RayMap, truth: Truth) -> None:
    judgement = judge(raymap, replace(truth, radius=np.full(raymap.status.size, 1e-3)))
    assert judgement.pixels.median.value == pytest.approx(0.512)
    assert judgement.units.median.value == pytest.approx(1e-3 * 12)


@pytest.mark.parametrize("surface", ["torus", "heart"])
def test_against_certified_answers(surface: str) -> None:
    scene = make_scene({"surface": surface, "rotate": [20.0, 30.0, 0.0]}, film={"size": [40, 40]})
    double = trace(scene)
    sample = Sample.of(double, FEW)
    certified = Truth.certified(scene, sample.pixels)
    assert certified.is_known.mean() > 0.97
    exact = judge(double, certified, sample.drawn)
    single = judge(trace(scene, precision="single"), certified, sample.drawn)
    assert exact.compared > 50
    assert exact.pixels.high.value < 1e-8 < single.pixels.high.value < 1.0
    assert exact.differ.value == 0.0
    assert exact.pixels.median.value > 0.0  # the last digits are seen


def test_error_bounds_hold_the_certified_answers(raymap: RayMap) -> None:
    pixels = Sample.of(raymap, FEW).pixels
    bounded = Truth.bounded(raymap.scene, pixels, raymap.device)
    certified = Truth.certified(raymap.scene, pixels)
    both = bounded.is_known & certified.is_known
    np.testing.assert_array_equal(bounded.events[both], certified.events[both])
    apart = np.abs((bounded.st - certified.st) - certified.rest).max(axis=1)[both]
    assert both.sum() > 80
    assert (apart <= bounded.radius[both]).all()
    assert np.median(bounded.radius[both]) < 1e-12
