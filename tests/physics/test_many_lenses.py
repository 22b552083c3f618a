"""Scenes of several lenses, and rays that start in, on and beside them."""

from __future__ import annotations

from fractions import Fraction
from itertools import permutations
from typing import Any

import numpy as np
import pytest
from scenes import make_scene

from lenscl import RayStatus, reference, trace, trace_rays
from lenscl.tracing.numbers import picture_numbers

BALL = {"surface": "sphere", "name": "ball", "r": 0.4, "centre": [0.1, 0.0, 0.9], "n": 1.5}
RING = {
    "surface": "torus",
    "name": "ring",
    "R": 0.6,
    "r": 0.2,
    "centre": [0.0, 0.1, -0.2],
    "n": 1.7,
    "rotate": [20, 0, 0],
}
EGG = {"surface": "ellipsoid", "name": "egg", "c": 0.5, "r": 0.5, "centre": [-0.1, 0.0, -1.4], "n": 1.3}


def test_light_passes_lens_after_lens_as_in_the_twin() -> None:
    scene = make_scene(BALL, RING, EGG, film={"size": [60, 60]})
    raymap, twin = trace(scene, method="march"), reference.trace(scene)
    assert (raymap.events >= 4).sum() > 200, "many rays meet two lenses and more"
    np.testing.assert_array_equal(raymap.status.ravel(), twin.status)
    np.testing.assert_array_equal(raymap.events.ravel(), twin.events)
    error = np.abs(raymap.st.reshape(-1, 2) - twin.st).max(axis=1)
    assert np.median(error[twin.events > 0]) < 1e-12


@pytest.mark.parametrize("precision", ["single", "double"])
def test_the_order_in_which_lenses_are_written_changes_nothing(precision: str, request: pytest.FixtureRequest) -> None:
    orders = list(permutations((BALL, RING, EGG)))
    chosen = orders if request.config.getoption("--slow") else [orders[i] for i in (0, 3, 4)]  # each lens in each place
    maps = [trace(make_scene(*lenses), precision=precision) for lenses in chosen]
    assert (maps[0].events >= 4).any()
    for other in maps[1:]:
        np.testing.assert_array_equal(other.st, maps[0].st)
        np.testing.assert_array_equal(other.status, maps[0].status)
        np.testing.assert_array_equal(other.events, maps[0].events)


def test_the_nearer_of_two_lenses_is_met_first() -> None:
    """A null ball before or behind an opaque-like one of high index: the first surface bends first."""
    near, far = dict(BALL, centre=[0, 0, 1.0]), dict(BALL, centre=[0, 0, -1.0], name="far", n=2.0)
    ray = ([[0.2, 0.0, 3.0]], [[0.0, 0.0, -1.0]])
    one = trace_rays(make_scene(near, far, numerics={"max_events": 1}), *ray)
    assert one.status[0] == RayStatus.TRAPPED
    assert one.origin[0, 2] == pytest.approx(1.0 + np.sqrt(0.16 - 0.04), abs=1e-9)
    inside = trace_rays(make_scene(near, far), [[0.0, 0.0, -1.0]], [[0.0, 0.0, 1.0]])  # starts in the far one
    assert inside.events[0] == 3


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize(
    ("origin", "direction", "events"),
    [
        ([0, 0, 1], [0, 0, -1], 1),  # on the pole, entering: one exit
        ([0, 0, 1], [0, 0, 1], 0),  # on the pole, leaving
        ([0, 0, -1], [0, 0.1, -1], 0),
        ([0, 0, -1], [0, 0.1, 1], 1),
        ([0, 0, 0], [0.3, 0.2, -1], 1),  # inside
        ([0, 0, 1.001], [0, 0, -1], 2),  # just outside
    ],
)
def test_a_ray_that_starts_on_a_surface_is_inside_if_it_enters(
    origin: list[float], direction: list[float], events: int, precision: str
) -> None:
    scene = make_scene({"surface": "sphere"}, numerics={"max_events": 64})
    assert trace_rays(scene, [origin], [direction], precision=precision).events[0] == events
    twin = reference.trace_rays(scene, np.array([origin], float), np.array([direction]) / np.linalg.norm(direction))
    assert twin.events[0] == events
    film: dict[str, Any] = {"centre": (np.array(origin) + direction).tolist(), "right": [0.01, 0, 0], "size": [1, 1]}
    if direction[2] != 0:
        point = scene.replace({"source.at": origin, **{f"film.{k}": v for k, v in film.items()}})
        assert trace(point, precision=precision).events[0, 0] == events


def test_a_film_pixel_on_the_source_has_no_ray_and_no_nan() -> None:
    raymap = trace(make_scene({"surface": "sphere"}, film={"size": [3, 3], "centre": [0.0, 0.0, 4.0]}))
    assert raymap.status[1, 1] == RayStatus.UNDECIDED
    for array in (raymap.st, raymap.origin, raymap.direction):
        assert np.isfinite(array).all()


def test_nothing_is_searched_outside_a_users_bounds() -> None:
    text = "max(min(abs(x) - 0.3, 1.0005 - x), abs(y) - 0.3, abs(z) - 0.3)"  # a second part begins at x = 1.0005
    scene = make_scene({"surface": text, "bounds": [[-1, -1, -1], [1, 1, 1]]})
    down = trace_rays(scene, [[0.1, 0, 3], [1.0007, 0, 3]], [[0, 0, -1], [0, 0, -1]], method="march")
    assert down.events.tolist() == [2, 0]
    assert trace_rays(scene, [[1.0007, 0, 0]], [[0, 0, -1]], method="march").events[0] == 0


def test_a_doubtful_lens_behind_the_surface_that_is_met_changes_nothing() -> None:
    hole = "x**2 + y**2 + z**2 - 1 + 1e-9 * sqrt(x**2 + y**2 + (z - 1)**2 - h**2)"  # no number near its north pole
    doubtful = {"surface": hole, "h": 0.3, "bounds": [[-1.2] * 3, [1.2] * 3], "name": "doubtful", "centre": [0, 0, -2]}
    mirror = dict(BALL, centre=[0, 0, 1.0], n=1.0)
    scene = make_scene(mirror, doubtful, medium=1.5, effects={"total_reflection": "end"})
    origin, direction = [[0.35, 0.0, 3.0]], [[0.0, 0.0, -1.0]]
    for found in (
        trace_rays(scene, origin, direction, method="march"),
        reference.trace_rays(scene, *map(np.array, (origin, direction))),
    ):
        assert found.status[0] == RayStatus.TOTAL_REFLECTION


def test_coordinates_up_to_1e30_are_places() -> None:
    scene = make_scene({"surface": "sphere", "centre": [0.0, 40.0, 0.0]})
    for slope, status in ((1e-25, RayStatus.OFF_PICTURE), (1e-33, RayStatus.BEHIND)):
        ends = trace_rays(scene, [[0, 0, 0]], [[1.0, 0.0, -slope]])
        assert ends.status[0] == status


@pytest.mark.parametrize("size", [[2**20 + 5, 2], [3, 400_000]])
def test_films_of_more_than_one_tile_are_whole(size: list[int]) -> None:
    scene = make_scene({"surface": "sphere", "r": 1.0}, film={"size": size}, numerics={"step": 0.1, "method": "march"})
    raymap = trace(scene, precision="single")
    origin, direction = reference.film_rays(scene)
    st, _ = reference.land(origin, direction, scene.picture)
    free = raymap.events.ravel() == 0
    assert 1000 < free.sum() < free.size
    assert np.abs(raymap.st.reshape(-1, 2) - st)[free].max() < 2e-6


def test_nearly_parallel_spans_keep_every_digit_of_their_duals() -> None:
    right, down = [6.1, 0.3, 0.7], [6.1, 0.3 + 6e-14, 0.7 + 1e-14]
    numbers = picture_numbers(make_scene({"surface": "sphere"}, picture={"right": right, "down": down}))

    def dot(a: list[Fraction], b: list[Fraction]) -> Fraction:
        return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))

    a, b = [Fraction(x) for x in right], [Fraction(x) for x in down]
    gram = dot(a, a) * dot(b, b) - dot(a, b) ** 2
    duals = {
        "dual_s": [(dot(b, b) * x - dot(a, b) * y) / gram for x, y in zip(a, b, strict=True)],
        "dual_t": [(dot(a, a) * y - dot(a, b) * x) / gram for x, y in zip(a, b, strict=True)],
    }
    for name, exact in duals.items():
        np.testing.assert_allclose(numbers[name], [float(x) for x in exact], rtol=1e-15)


def test_an_array_is_traced_as_the_same_lenses_written_out() -> None:
    """Bit for bit, for rays of the film and for rays that start in, on and beside its copies."""
    places = [[x, y, 0.1 * x] for x in (-0.9, 0.0, 0.9) for y in (-0.45, 0.45)]
    alike = {"surface": "sphere", "r": 0.4, "n": "BK7", "priority": 1}
    array = make_scene({**alike, "name": "balls", "at": places}, EGG, film={"size": [60, 60]})
    written = make_scene(
        *({**alike, "name": f"ball{i}", "centre": place} for i, place in enumerate(places)),
        EGG,
        film={"size": [60, 60]},
    )
    assert len(array.lenses) == len(written.lenses) == 7
    one, other = trace(array), trace(written)
    assert (one.events >= 2).sum() > 300
    for name in ("st", "status", "events"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    rng = np.random.default_rng(4)
    origins = np.concatenate([rng.uniform(-1.2, 1.2, (40, 3)), np.add(places, (0.0, 0.0, 0.4))])
    directions = rng.normal(size=origins.shape)
    paths, same = trace_rays(array, origins, directions), trace_rays(written, origins, directions)
    assert (paths.events > 0).sum() > 5
    for name in ("origin", "direction", "status", "events"):
        np.testing.assert_array_equal(getattr(paths, name), getattr(same, name))
