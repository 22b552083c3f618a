"""The polynomial method misses no crossing: against companion matrices, closed forms, and its own scale."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import make_scene

from lenscl import RayStatus, trace, trace_rays
from lenscl.config import Scene
from lenscl.errors import LensclError
from lenscl.methods import METHODS
from lenscl.reference import companion

Array = NDArray[np.float64]
BOUNDS = [[-1.2] * 3, [1.2] * 3]
LENSES: dict[str, dict[str, Any]] = {
    "sphere": {"surface": "sphere"},
    "ellipsoid": {"surface": "ellipsoid", "a": 1.0, "b": 0.8, "c": 0.6},
    "torus": {"surface": "torus"},
    "thin torus": {"surface": "torus", "R": 0.7, "r": 1e-3},
    "bifolia": {"surface": "bifolia"},
    "quartic": {"surface": "x**4 + y**4 + z**4 - k", "k": 0.5, "bounds": BOUNDS},
    "sextic": {"surface": "x**6 + y**6 + z**6 - 0.5 - x*y*z", "bounds": BOUNDS},
}
RAYS = 20_000


def aimed_rays(scene: Scene, count: int, seed: int) -> tuple[Array, Array]:
    """Return rays from all round at points of the lens's bounding box; half of them graze it."""
    rng = np.random.default_rng(seed)
    low, high = (np.array(corner) for corner in scene.lenses[0].surface.box(scene.lenses[0].values))
    target = low + (high - low) * rng.uniform(0, 1, (count, 3))
    edge = rng.integers(0, 3, count // 2)
    target[np.arange(count // 2), edge] = np.where(rng.random(count // 2) < 0.5, low[edge], high[edge])
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return target - 4.0 * direction, direction


@pytest.mark.parametrize("name", LENSES)
def test_no_first_crossing_is_missed_or_invented(name: str) -> None:
    scene = make_scene(LENSES[name] | {"n": 1.0}, numerics={"max_events": 1})
    origin, direction = aimed_rays(scene, RAYS, 3)
    paths = trace_rays(scene, origin, direction, method="polynomial")
    lens = scene.lenses[0]
    form = lens.surface.sign_polynomial(lens.values)
    assert form is not None
    judged = companion.first_roots(form, lens.values, origin, direction, 8.0)
    decided = ~judged.undecided & (paths.status != RayStatus.UNDECIDED)
    assert (paths.status == RayStatus.UNDECIDED).mean() < 1e-3
    assert judged.undecided.mean() < 1e-3
    assert judged.found[decided].sum() > RAYS // 200
    np.testing.assert_array_equal((paths.events > 0)[decided], judged.found[decided])
    hit = decided & judged.found
    distance = np.sum((paths.origin - origin) * direction, axis=1)
    assert (np.abs(distance - judged.t)[hit] <= judged.radius[hit] + 1e-9).all()


@pytest.mark.parametrize("name", LENSES)
def test_every_later_crossing_of_a_straight_ray_is_met_too(name: str) -> None:
    """Through a null lens a ray goes straight: its events are all the crossings of the line."""
    scene = make_scene(LENSES[name] | {"n": 1.0}, numerics={"max_events": 64})
    origin, direction = aimed_rays(scene, 1500, 4)
    paths = trace_rays(scene, origin, direction, method="polynomial")
    lens = scene.lenses[0]
    form = lens.surface.sign_polynomial(lens.values)
    assert form is not None
    t = np.linspace(0.0, 8.0, 4001)
    from lenscl.expr import evaluate

    line = origin[:, None, :] + t[:, None] * direction[:, None, :]
    inside = evaluate(form, {**lens.values, "x": line[..., 0], "y": line[..., 1], "z": line[..., 2]}) < 0
    sampled = np.abs(np.diff(inside.astype(int), axis=1)).sum(axis=1)
    decided = paths.status != RayStatus.UNDECIDED
    assert (paths.events[decided] >= sampled[decided]).all(), "samples see fewer crossings, never more"
    assert (paths.events[decided] % 2 == 0).all(), "what enters leaves"
    assert (paths.events == sampled)[decided].mean() > 0.97


@pytest.mark.parametrize("name", ["sphere", "torus", "sextic"])
def test_the_walk_alone_meets_the_same(name: str) -> None:
    scene = make_scene(LENSES[name], numerics={"max_events": 8})
    origin, direction = aimed_rays(scene, 10_000, 6)
    walked = trace_rays(scene, origin, direction, method="guarded")
    proved = trace_rays(scene, origin, direction, method="polynomial")
    decided = (walked.status != RayStatus.UNDECIDED) & (proved.status != RayStatus.UNDECIDED)
    assert decided.mean() > 0.999
    assert (walked.events > 0).sum() > 1000
    np.testing.assert_array_equal(walked.events[decided], proved.events[decided])
    np.testing.assert_allclose(walked.origin[decided], proved.origin[decided], atol=1e-6)


@pytest.mark.parametrize("thickness", [10.0**-k for k in range(1, 10)])
def test_no_chord_of_a_thin_lens_is_lost_where_the_march_loses_them(thickness: float) -> None:
    lens = {"surface": "ellipsoid", "r": 0.8, "stretch": [1.0, 1.0, thickness / 1.6], "n": 1.0}
    scene = make_scene(lens)
    rng = np.random.default_rng(5)
    place = 0.79 * np.sqrt(rng.random(5000))
    angle = rng.uniform(0, 2 * np.pi, 5000)
    target = np.stack([place * np.cos(angle), place * np.sin(angle), np.zeros(5000)], 1)
    direction = np.stack([rng.uniform(-1, 1, 5000), rng.uniform(-1, 1, 5000), -np.ones(5000)], 1)
    paths = trace_rays(scene, target - 2 * direction, direction, method="polynomial")
    assert (paths.events == 2).all()
    if thickness <= 1e-3:
        marched = trace_rays(scene, target - 2 * direction, direction, method="march")
        assert (marched.events == 0).mean() > 0.5


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("name", ["ellipsoid", "torus", "bifolia"])
@pytest.mark.parametrize("power", [-20, 20])
def test_a_scene_scaled_by_a_power_of_two_gives_the_same_map_bit_for_bit(name: str, power: int, precision: str) -> None:
    def scaled(k: float) -> Scene:
        return make_scene(
            LENSES[name] | {"stretch": [k, k, k]},
            source={"kind": "point", "at": [0.0, 0.0, 4.0 * k]},
            film={"centre": [0.0, 0.0, 2.5 * k], "right": [0.8 * k, 0, 0], "down": [0, -0.8 * k, 0]},
            picture={"corner": [-3 * k, 3 * k, -2.5 * k], "right": [6 * k, 0, 0], "down": [0, -6 * k, 0]},
        )

    one, other = (trace(scaled(k), method="polynomial", precision=precision) for k in (1.0, 2.0**power))
    assert (one.events > 0).sum() > 200
    np.testing.assert_array_equal(one.status, other.status)
    np.testing.assert_array_equal(one.events, other.events)
    np.testing.assert_array_equal(one.st, other.st)


@pytest.mark.parametrize(("precision", "bound"), [("single", 1e-6), ("double", 1e-12)])
@pytest.mark.parametrize("name", [name for name in LENSES if name != "thin torus"])  # no pixel would meet it
def test_a_null_lens_is_the_identity(name: str, precision: str, bound: float) -> None:
    away = make_scene({"surface": "sphere", "centre": [0.0, 50.0, 0.0]}, film={"size": [128, 128]})
    scene = make_scene(LENSES[name] | {"n": 1.0}, film={"size": [128, 128]})
    bent, free = trace(scene, method="polynomial", precision=precision), trace(away, precision=precision)
    decided = bent.status != RayStatus.UNDECIDED
    assert decided.mean() > (0.95 if precision == "single" else 0.9999)
    assert (bent.events > 0).sum() > 30
    assert np.abs(bent.st - free.st)[decided].max() <= bound


def test_a_source_inside_and_total_reflections_for_ever() -> None:
    ball = make_scene({"surface": "sphere", "n": 1.5}, numerics={"max_events": 200, "method": "polynomial"})
    caught = trace_rays(ball, [[0.9, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    assert caught.status[0] == RayStatus.TRAPPED
    assert caught.events[0] == 200
    assert np.abs(np.linalg.norm(caught.origin) - 1) < 1e-12
    assert trace_rays(ball, [[0.0, 0.0, 0.3]], [[0.1, 0.0, 1.0]]).events[0] == 1


def test_a_tangent_ray_is_undecided_or_misses_and_a_touching_pinch_is_not_entered() -> None:
    ball = make_scene({"surface": "sphere", "n": 1.5})
    height = 1 + np.array([-1e-6, -1e-9, 1e-9, 1e-6])
    rays = np.stack([height, 0 * height, 3 + 0 * height], 1), np.tile([0.0, 0.0, -1.0], (4, 1))
    passing = trace_rays(ball, *rays, method="polynomial")
    assert (passing.events > 0).tolist() == [True, True, False, False]
    exact = trace_rays(ball, [[1.0, 0.0, 3.0]], [[0.0, 0.0, -1.0]], method="polynomial")
    assert exact.events[0] == 0
    along = trace_rays(make_scene({"surface": "bifolia"}), [[0.0, 3.0, 0.0]], [[0.0, -1.0, 0.0]], method="polynomial")
    assert along.events[0] == 0, "the axis touches the pinch with multiplicity 4"


def test_a_surface_that_is_no_polynomial_is_refused_by_name() -> None:
    for lens in ({"surface": "heart"}, {"surface": "torus", "R": 0.2, "r": 0.5}):
        with pytest.raises(LensclError, match=r"numerics\.method.*polynomial"):
            trace(make_scene(lens), method="polynomial")
    assert "polynomial" in METHODS


def test_a_polynomial_of_a_high_degree_is_left_to_intervals_at_once() -> None:
    product = "*".join(["x"] * 2000)
    for text in ("x**10 + y**10 + z**10 - 0.5", "x**64 + y**64 + z**64 - 0.5", f"{product} + y**2 + z**2 - 0.5"):
        surface = make_scene({"surface": text, "bounds": BOUNDS}).lenses[0].surface
        assert surface.sign_polynomial({}) is None
    ball = make_scene({"surface": "(x**2 + y**2 + z**2)**4 - 0.5", "bounds": BOUNDS, "n": 1.0}, film={"size": [9, 9]})
    assert ball.lenses[0].surface.sign_polynomial({}) is not None
    assert (trace(ball, method="polynomial").events == 2).sum() > 20
