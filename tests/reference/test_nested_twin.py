"""The float64 twin among solids in one another, overlapping, and in contact: against the oracle and closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from arrangements import bubble, doublet, drawn, stack
from numpy.typing import NDArray
from scenes import make_scene

from lenscl import RayStatus, reference
from lenscl.config import Scene
from lenscl.reference import Paths, Steps, oracle

Array = NDArray[np.float64]
FINE = {"max_events": 16, "step": 0.002}
SMALL = {"size": [20, 20], "right": [0.5, 0.0, 0.0], "down": [0.0, -0.5, 0.0]}
PLACE = 1e-9  # picture coordinates: rounding, grown through curved surfaces


def some_rays(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Return rays through the middle of a scene; one in three starts there."""
    through, directions = rng.uniform(-0.4, 0.4, (count, 3)), rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    back = np.where(np.arange(count) % 3 == 0, 0.0, 2.5)
    return through - back[:, None] * directions, directions


def held(scene: Scene, paths: Paths, origins: Array, directions: Array) -> dict[str, int]:
    """Return how many rays end as proved, otherwise, and how many the twin or the oracle leaves open."""
    found = {"right": 0, "wrong": 0, "undecided": 0, "untold": 0, "many": 0}
    proofs = oracle.prove_rays(scene, origins, directions, radius=1e-12, most_bits=256)
    for i, proof in enumerate(proofs):
        if paths.status[i] == RayStatus.UNDECIDED:
            found["undecided"] += 1
        elif proof.status is None:
            found["untold"] += 1
        else:
            is_right = paths.status[i] == proof.status and paths.events[i] == proof.events
            if is_right and proof.st is not None:
                s, t = paths.st[i].tolist()
                is_right = proof.distance(s, t) < PLACE * max(1.0, abs(s), abs(t)) ** 2
            found["right" if is_right else "wrong"] += 1
            found["many"] += is_right and proof.events > 3
    return found


def test_random_solids_in_solids_end_as_the_oracle_proves() -> None:
    total: dict[str, int] = {}
    for seed in range(6):
        rng = np.random.default_rng(seed)
        scene = drawn(rng).replace({f"numerics.{key}": value for key, value in FINE.items()})
        rays = some_rays(rng, 8)
        for name, count in held(scene, reference.trace_rays(scene, *rays), *rays).items():
            total[name] = total.get(name, 0) + count
    assert total["wrong"] == 0
    assert total["right"] > 40
    assert total["many"] >= 4
    assert total["undecided"] + total["untold"] < 5


def test_a_bubble_is_the_shell_that_is_left_of_its_ball() -> None:
    """Where two media meet it is all one who of two solids says so: a shell by max() has the same surfaces."""
    shell = "max(x^2 + y^2 + z^2 - 0.25, 0.04 - (x - 0.1)^2 - (y - 0.05)^2 - (z - 0.1)^2)"
    nested = make_scene(*bubble(), film=SMALL, numerics=FINE)
    apart = make_scene({"surface": shell, "bounds": [[-0.6] * 3, [0.6] * 3], "n": 1.5}, film=SMALL, numerics=FINE)
    one, other = reference.trace(nested), reference.trace(apart)
    np.testing.assert_array_equal(one.status, other.status)
    np.testing.assert_array_equal(one.events, other.events)
    assert np.count_nonzero(one.events == 4) > 20
    assert np.abs(one.st - other.st).max() < 1e-9


def test_what_gives_way_is_passed_without_an_event() -> None:
    hidden = make_scene(*bubble(priority=-1.0, n=2.0), film=SMALL, numerics=FINE)
    plain = make_scene(bubble()[0], film=SMALL, numerics=FINE)
    one, other = reference.trace(hidden), reference.trace(plain)
    through = reference.trace(make_scene(*bubble(n=2.0), film=SMALL, numerics=FINE)).events >= 4
    assert np.count_nonzero(through) > 40
    np.testing.assert_array_equal(one.events, other.events)
    np.testing.assert_array_equal(one.status, other.status)
    assert np.abs(one.st - other.st).max() < 1e-12
    assert np.abs(one.origin - other.origin).max() < 1e-12, "the origin is that of the last event, not where one passes"


def test_between_media_of_one_index_there_is_an_event_that_bends_nothing() -> None:
    one = reference.trace(make_scene(*bubble(n=1.5), film=SMALL, numerics=FINE))
    other = reference.trace(make_scene(bubble()[0], film=SMALL, numerics=FINE))
    assert np.count_nonzero(one.events == other.events + 2) > 40
    np.testing.assert_array_equal(one.status, other.status)
    assert np.abs(one.st - other.st).max() < 1e-9


def test_faces_in_contact_are_one_interface_and_a_gap_is_two() -> None:
    axial = np.array([[0.05, 0.02, 3.0]]), np.array([[0.0, 0.0, -1.0]])
    for gap, events in ((0.0, 3), (1e-12, 4), (1e-3, 4)):
        paths = reference.trace_rays(make_scene(*stack(gap), numerics=FINE), *axial)
        assert paths.events.tolist() == [events], gap
    scene = make_scene(*doublet(), film={"size": [5, 5], "right": [0.3, 0, 0], "down": [0, -0.3, 0]}, numerics=FINE)
    rays = reference.film_rays(scene)
    paths = reference.trace_rays(scene, *rays)
    found = held(scene, paths, *rays)
    assert np.count_nonzero(paths.events == 3) >= 20
    assert (found["wrong"], found["undecided"]) == (0, 0)
    assert found["right"] >= 24


def test_contact_at_the_origin_of_the_world_is_proved_too() -> None:
    """There a length is a ball about 0, of which no root is known."""
    for gap, events in ((0.0, 3), (1e-3, 4)):
        (proof,) = oracle.prove_rays(make_scene(*stack(gap)), [[0.0, 0.0, 3.0]], [[0.0, 0.0, -1.0]])
        assert (proof.status, proof.events) == (RayStatus.PICTURE, events)


def test_an_edge_that_two_solids_share_is_undecided() -> None:
    """Two balls cross each other in a circle: on it nobody can tell whose surface comes first."""
    balls = [
        {"surface": "sphere", "name": name, "r": 0.5, "centre": [x, 0, 0]} for name, x in (("a", 0.2), ("b", -0.2))
    ]
    scene = make_scene(*balls, numerics=FINE)
    starts = np.array([[0.0, 0.1, 2.0], [1e-6, 0.1, 2.0], [-1e-6, 0.1, 2.0]])
    paths = reference.trace_rays(scene, starts, np.tile([0.0, 0.0, -1.0], (3, 1)))
    assert (paths.status == RayStatus.UNDECIDED).tolist() == [True, False, False]
    assert paths.events[1:].tolist() == [4, 2]  # the later one is the medium where both are


def test_two_wedges_of_one_glass_make_a_cube_that_bends_nothing_within() -> None:
    cube = "max(max(abs(x), abs(y), abs(z)) - 0.3, {})"
    wedge = {"bounds": [[-0.4] * 3, [0.4] * 3], "n": 1.5}
    halves = [wedge | {"surface": cube.format(side), "name": name} for side, name in (("x - z", "a"), ("z - x", "b"))]
    down = np.tile([0.0, 0.0, -1.0], (2, 1))
    paths = reference.trace_rays(make_scene(*halves, numerics=FINE), np.array([[0.1, 0.05, 2], [-0.21, 0.1, 2]]), down)
    assert paths.events.tolist() == [3, 3]
    np.testing.assert_allclose(paths.direction, down, atol=1e-15)


def test_a_ray_starts_in_all_the_solids_that_hold_it_and_ends_at_what_is_opaque() -> None:
    start = np.array([[0.1, 0.05, 0.1]]), np.array([[0.0, 0.0, -1.0]])
    assert reference.trace_rays(make_scene(*bubble(), numerics=FINE), *start).events.tolist() == [2]
    hidden = make_scene(*bubble(priority=-1.0), numerics=FINE)
    assert reference.trace_rays(hidden, *start).events.tolist() == [1]
    for coin, status, events in (({}, RayStatus.BLOCKED, 2), ({"priority": -1.0}, RayStatus.PICTURE, 2)):
        scene = make_scene(*bubble(absorbs=True, **coin), numerics=FINE)
        paths = reference.trace_rays(scene, np.array([[0.1, 0.05, 3.0]]), start[1])
        assert (paths.status[0], paths.events[0]) == (status, events)


def _last_first(scene: Scene) -> tuple[int, ...]:
    return tuple(reversed(scene.by_priority()))


def _one_by_one(t: Array, found: Any, spread: Array, normal: Array) -> Any:
    return reference.Steps().together(t, found, np.zeros_like(spread) - 1.0, normal)


@pytest.mark.parametrize(
    ("faulty", "lenses"),
    [({"by_priority": _last_first}, bubble(n=1.2)), ({"together": _one_by_one}, stack())],
    ids=["priority swapped", "contact as a gap"],
)
def test_a_twin_with_a_fault_ends_otherwise(faulty: Any, lenses: Any) -> None:
    scene = make_scene(*lenses, film={"size": [4, 4], "right": [0.3, 0, 0], "down": [0, -0.3, 0]}, numerics=FINE)
    rays = reference.film_rays(scene)
    whole = held(scene, reference.trace_rays(scene, *rays), *rays)
    broken = held(scene, reference.trace_rays(scene, *rays, steps=Steps(**faulty)), *rays)
    assert whole["right"] >= 14
    assert whole["wrong"] == 0
    assert broken["wrong"] > 5
