"""The same rays end at the same place, bit for bit: again, on one thread or more, in other tiles, in any order.

In packets of another width, and where it optimises, the compiler may join other products and sums, a * b + c without
the rounding between. So places may differ there, and statuses and events may not: (s, t) by at most CONTRACTION
roundings times the ray's condition, by which one rounding's size at the start grows on the way to the picture. Rays
that land on no place of the picture's plane, and those whose path hangs on rounding, have no condition; they are
counted apart.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from kernels.simulated import broken
from numpy.typing import NDArray
from probe import optimised_device, plain_device
from scenes import CATALOGUE, make_scene
from thinned import thinned

import lenscl
from lenscl import RayStatus, trace, trace_rays
from lenscl.accuracy import pixel_bounds
from lenscl.config import Scene
from lenscl.device import choose
from lenscl.tracing import RayMap, film_rays, job

PRECISIONS = ("single", "mixed", "double")
ARRAYS = ("st", "status", "events", "origin", "direction")
EPSILON = {"single": 2.0**-23, "mixed": 2.0**-52, "double": 2.0**-52}
START_ULPS = 4.0  # what lenscl.accuracy.bounds moves the start of a ray by
CONTRACTION = 1.0  # measured: 0.12 at most, over the catalogue
HANGS = 0.001  # the share of a film's rays that may land and hang on rounding, or end unlike; measured: none of 57,340
SIZE = [61, 47]
TURNED = {"rotate": [20.0, 30.0, 10.0]}
SEVERAL = (
    {"surface": "sphere", "name": "ball", "r": 0.4, "centre": [0.1, 0.0, 0.9]},
    {"surface": "torus", "name": "ring", "R": 0.6, "r": 0.2, "centre": [0.0, 0.1, -0.2], "n": 1.7, **TURNED},
    {"surface": "prism", "name": "prism", "centre": [-0.1, 0.0, -1.6], "stretch": [0.6, 0.6, 0.6], **TURNED},
)
QUARTIC = {"surface": "x**4 + y**4 + z**4 - k", "k": 0.3, "bounds": [[-1.0] * 3, [1.0] * 3], **TURNED}
SCENES: dict[str, Scene] = {
    **{name: make_scene({"surface": name, **TURNED}, film={"size": SIZE}) for name in CATALOGUE},
    "several": make_scene(*SEVERAL, film={"size": SIZE}),
    "quartic": make_scene(QUARTIC, film={"size": SIZE}),
    "diamond": make_scene({"surface": "bifolia", "n": 2.4}, film={"size": SIZE}, numerics={"max_events": 40}),
    "reflections end": make_scene(
        {"surface": "torus", "n": 2.4, **TURNED}, film={"size": SIZE}, effects={"total_reflection": "end"}
    ),
}
FEW = (
    *(("torus", precision) for precision in PRECISIONS),
    *(("heart", "single"), ("prism", "double"), ("several", "mixed")),
)
EACH = pytest.mark.parametrize(("name", "precision"), thinned(product(SCENES, PRECISIONS), FEW))
DIGESTS = """
import sys
from kernels.test_determinism import FEW, SCENES, bytes_of
from lenscl import trace
from lenscl.device import choose
print(choose().units)
for name, precision in FEW:
    scene = SCENES[name].replace({"film.size": [203, 131]})
    print(name, precision, bytes_of(trace(scene, precision=precision)))
"""


def bytes_of(raymap: Any) -> str:
    return hashlib.sha256(b"".join(getattr(raymap, name).tobytes() for name in ARRAYS)).hexdigest()


def roundings_apart(one: RayMap, other: RayMap, precision: str) -> NDArray[np.float64]:
    """Return how many roundings two maps' places are apart, times each ray's condition; NaN where it has none."""
    bound = pixel_bounds(one.scene, np.arange(one.status.size)).bound
    condition = np.where(bound >= 0.0, bound, np.nan) / (START_ULPS * EPSILON["double"])
    apart = np.abs(one.st.astype(np.float64) - other.st).max(axis=2).ravel()
    ratio: NDArray[np.float64] = apart / (EPSILON[precision] * condition)
    return ratio


@EACH
def test_a_scene_traced_again_gives_the_same_bytes(name: str, precision: str) -> None:
    first, again = (trace(SCENES[name], precision=precision) for _ in range(2))
    anew = trace(SCENES[name], precision=precision, device=replace(choose()))  # a context and a program of its own
    assert (first.events > 0).sum() > 100
    assert bytes_of(first) == bytes_of(again) == bytes_of(anew)


@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="there is one core, so one thread")
def test_one_thread_and_two_give_the_same_bytes() -> None:
    if "portable computing" not in choose().label.lower():
        pytest.skip("how many threads there are can be told to PoCL alone")
    said = []
    for threads in ("1", "2"):
        tests = Path(__file__).parent.parent
        paths = [str(tests), str(tests.parent / "bench"), str(Path(lenscl.__file__).parent.parent)]
        environment = os.environ | {"POCL_MAX_PTHREAD_COUNT": threads, "PYTHONPATH": os.pathsep.join(paths)}
        line = [sys.executable, "-c", DIGESTS]
        done = subprocess.run(line, capture_output=True, text=True, env=environment, check=False)
        assert done.returncode == 0, done.stderr
        units, *digests = done.stdout.splitlines()
        assert units == threads
        assert len(digests) == len(FEW)
        said.append(digests)
    assert said[0] == said[1]


@EACH
def test_packets_of_any_width_and_plain_kernels_end_alike_within_the_bound_of_contraction(
    name: str, precision: str
) -> None:
    is_few = (name, precision) in FEW
    widths = [(1, 1), (4, 4), (32, 16)] if is_few else [(1, 1), (2, 2), (4, 4), (8, 8), (16, 16), (32, 16)]
    devices = [*(optimised_device(*width) for width in widths), plain_device(*widths[-2])]
    maps = [trace(SCENES[name], precision=precision, device=each) for each in devices]
    first, lens = maps[0], (maps[0].events > 0).ravel()
    for other in maps[1:]:
        ratio = roundings_apart(first, other, precision)
        judged, lands = ~np.isnan(ratio), (first.status <= RayStatus.OFF_PICTURE).ravel()
        assert (judged & lens).sum() > 100
        assert (lands & ~judged).mean() <= HANGS
        assert np.nanmax(ratio) <= CONTRACTION
        unlike = ((other.status != first.status) | (other.events != first.events)).ravel()
        assert not (unlike & judged).any()
        assert unlike.mean() <= HANGS


def test_places_two_roundings_of_their_condition_apart_are_seen() -> None:
    first = trace(SCENES["torus"])
    bound = pixel_bounds(first.scene, np.arange(first.status.size)).bound.reshape(first.status.shape)
    moved = replace(first, st=first.st + (2.0 / START_ULPS * np.maximum(bound, 0.0))[:, :, None])
    assert np.nanmax(roundings_apart(first, moved, "double")) > CONTRACTION
    assert np.nanmax(roundings_apart(first, first, "double")) == 0.0


@EACH
def test_films_in_other_tiles_give_the_same_bytes(name: str, precision: str, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = bytes_of(trace(SCENES[name], precision=precision))
    for pixels in (1000, 40):  # of 2867: whole rows, and parts of a row
        monkeypatch.setattr(job, "_TILE_PIXELS", pixels)
        assert len(list(job.tiles(*reversed(SIZE)))) >= 3
        assert bytes_of(trace(SCENES[name], precision=precision)) == whole


def test_a_kernel_that_knows_a_rays_place_in_its_tile_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    with broken(
        "ends_map.cl", "store_pairs(place.s,", "store_pairs(place.s + (realv)(real)first * (realv)REAL_EPSILON,"
    ):
        whole = trace(SCENES["torus"])
        monkeypatch.setattr(job, "_TILE_PIXELS", 1000)
        assert (trace(SCENES["torus"]).st != whole.st).any()


@EACH
def test_rays_in_any_order_and_number_end_at_the_same_bytes(name: str, precision: str) -> None:
    scene = SCENES[name]
    points, vectors = film_rays(scene, np.arange(SIZE[0] * SIZE[1]))
    together = trace_rays(scene, points, vectors, precision=precision)
    shuffled = np.random.default_rng(2).permutation(len(points))
    for part in np.array_split(shuffled, [7, 8, 300]):  # 7 rays, one, some and the rest
        some = trace_rays(scene, points[part], vectors[part], precision=precision)
        for array in ARRAYS:
            np.testing.assert_array_equal(getattr(some, array), getattr(together, array)[part])
    assert (together.events > 0).sum() > 100
