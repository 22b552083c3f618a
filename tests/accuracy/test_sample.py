"""The strata of a film are what they are called, and a sample stands for all of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scenes import make_scene

from lenscl.accuracy.sample import EDGE, FREE, LENS, MANY, STEEP, STRATA, Sample, strata
from lenscl.status import RayStatus
from lenscl.tracing import RayMap, trace

WANTED = {EDGE: 20, MANY: 15, STEEP: 10, LENS: 40, FREE: 5}


@pytest.fixture(scope="module")
def raymap() -> RayMap:
    return trace(make_scene({"surface": "torus"}, film={"size": [60, 40]}, numerics={"max_events": 32}))


def test_edges_are_beside_pixels_that_end_otherwise(raymap: RayMap) -> None:
    kinds = strata(raymap)
    rows, columns = kinds.shape
    lands = (raymap.status == RayStatus.PICTURE) | (raymap.status == RayStatus.OFF_PICTURE)
    ends = [[(int(raymap.events[i, j]), 0 if lands[i, j] else int(raymap.status[i, j])) for j in range(columns)]
            for i in range(rows)]  # fmt: skip
    for i in range(rows):
        for j in range(columns):
            beside = [(i + a, j + b) for a, b in ((0, 1), (1, 0), (0, -1), (-1, 0))]
            differs = any(0 <= y < rows and 0 <= x < columns and ends[y][x] != ends[i][j] for y, x in beside)
            if STRATA[kinds[i, j]] != MANY:
                assert (STRATA[kinds[i, j]] == EDGE) == differs
    assert 50 < np.count_nonzero(kinds == STRATA.index(EDGE)) < kinds.size / 2


def test_free_rays_meet_no_lens_and_all_others_do(raymap: RayMap) -> None:
    kinds = strata(raymap)
    assert not raymap.events[kinds == STRATA.index(FREE)].any()
    for name in (MANY, STEEP, LENS):
        assert raymap.events[kinds == STRATA.index(name)].all()


def test_many_and_steep_are_the_extremes(raymap: RayMap) -> None:
    kinds, lens = strata(raymap), raymap.events > 0
    many, plain = kinds == STRATA.index(MANY), kinds == STRATA.index(LENS)
    assert many.any() or raymap.events[lens].max() == np.median(raymap.events[lens])
    if many.any():
        assert raymap.events[many].min() >= np.quantile(raymap.events[lens], 0.98)
    assert 0 < np.count_nonzero(kinds == STRATA.index(STEEP)) <= 0.05 * np.count_nonzero(lens) + 1
    assert plain.any()


def test_rays_of_many_events_are_always_in_it() -> None:
    """A heart of high index keeps some rays inside for long."""
    scene = make_scene({"surface": "heart", "rotate": [-90.0, -90.0, 0.0], "n": 2.4}, film={"size": [64, 64]})
    raymap = trace(scene)
    sample = Sample.of(raymap, WANTED)
    assert raymap.events.max() > np.median(raymap.events[raymap.events > 0])
    taken = raymap.events.ravel()[sample.pixels[sample.drawn.stratum == STRATA.index(MANY)]]
    assert taken.size > 0
    assert taken.min() > np.median(raymap.events[raymap.events > 0])


def test_weights_sum_to_the_film_and_pixels_are_drawn_once(raymap: RayMap) -> None:
    sample = Sample.of(raymap, WANTED)
    assert sample.drawn.weights.sum() == pytest.approx(raymap.status.size)
    assert len(np.unique(sample.pixels)) == len(sample.pixels)
    assert sum(sample.sizes) == raymap.status.size
    for name, count in sample.counts().items():
        assert count == min(WANTED[name], sample.sizes[STRATA.index(name)])
    kinds = strata(raymap).ravel()[sample.pixels]
    np.testing.assert_array_equal(kinds, sample.drawn.stratum)


def test_every_run_looks_at_the_same_pixels(raymap: RayMap) -> None:
    np.testing.assert_array_equal(Sample.of(raymap, WANTED).pixels, Sample.of(raymap, WANTED).pixels)


@pytest.mark.parametrize("size", [[1, 1], [1, 9], [9, 1]])
def test_the_smallest_films_have_samples(size: list[int]) -> None:
    raymap = trace(make_scene({"surface": "sphere"}, film={"size": size}))
    sample = Sample.of(raymap, WANTED)
    assert sample.drawn.weights.sum() == pytest.approx(raymap.status.size)


def test_a_film_without_a_lens_is_free(raymap: RayMap) -> None:
    empty = replace(raymap, events=np.zeros_like(raymap.events), status=np.zeros_like(raymap.status))
    assert set(np.unique(strata(empty)).tolist()) == {STRATA.index(FREE)}
