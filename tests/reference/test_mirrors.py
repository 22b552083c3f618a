"""Scenes with mirrors, apart and nested, against certified answers and the float64 twin."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from faults_in_kernels import Fault, broken
from mirrored_scenes import mirrored_scene
from scenes import make_scene

from lenscl import RayStatus, trace, trace_rays
from lenscl.config import Scene
from lenscl.reference import oracle
from lenscl.reference import trace as twin
from lenscl.reference import trace_rays as trace_by_twin

SLOW_SEEDS = range(60)


def scene_of(seed: int, *, nested: bool) -> Scene:
    """Return a scene of three solids with mirrors; its numbers are drawn, its kernel is one of two."""
    rng = np.random.default_rng(seed)
    lenses: tuple[dict[str, Any], ...] = (
        {"surface": "half_ball", "diameter": rng.uniform(0.6, 0.8), "mirror": ["back"]},
        {"surface": "box", "a": rng.uniform(0.3, 0.5), "b": 0.4, "c": rng.uniform(0.2, 0.5), "mirror": ["+x", "-z"]},
        {"surface": "ellipsoid", "a": 0.3, "b": rng.uniform(0.15, 0.3), "c": 0.25, "mirror": True},
    )  # fmt: skip
    places = rng.uniform(-0.15, 0.15, (3, 3)) if nested else np.array([[0, 0, 0], [0.9, 0, -0.2], [-0.8, 0.2, 0.1]])
    return make_scene(
        *(
            lens | {
                "name": f"l{i}", "centre": places[i].tolist(), "rotate": rng.uniform(-180, 180, 3).tolist(),
                "n": float(rng.choice([1.0, 1.3, 1.5, 1.7])),
            }
            for i, lens in enumerate(lenses)
        ),
        picture={"centre": [0.0, 0.0, float(rng.choice([-2.5, 6.0]))]},
        effects={"total_reflection": "follow"},
        numerics={"max_events": 7},
    )  # fmt: skip


def aimed(seed: int, count: int) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    rng = np.random.default_rng(seed + 1000)
    starts = rng.normal(0, 1, (count, 3))
    starts *= rng.choice([0.1, 4.0], (count, 1), p=[0.3, 0.7]) / np.linalg.norm(starts, axis=1)[:, None]
    aims = rng.uniform(-0.3, 0.3, (count, 3)) + np.array([[0, 0, 0], [0.9, 0, -0.2], [-0.8, 0.2, 0.1]])[
        rng.integers(0, 3, count)
    ]  # fmt: skip
    return starts, aims - starts


def agreement(scene: Scene, starts: Any, ways: Any) -> tuple[int, int]:
    """Return how many rays are decided and proved, and how many met a mirrored face by the proof."""
    units = ways / np.linalg.norm(ways, axis=1)[:, None]
    ends = trace_rays(scene, starts, units)
    proofs = oracle.prove_rays(scene, starts.tolist(), units.tolist(), radius=1e-12, most_bits=512)
    decided = 0
    for i, proof in enumerate(proofs):
        status = RayStatus(ends.status[i])
        if proof.status is None:
            continue
        assert status is not RayStatus.UNDECIDED
        assert (status, ends.events[i]) == (proof.status, proof.events)
        if proof.st is not None and np.abs(ends.st[i]).max() < 1e3:
            assert proof.distance(*ends.st[i].tolist()) < 1e-6
        decided += 1
    return decided, sum(proof.events for proof in proofs)


@pytest.mark.parametrize("nested", [False, True])
def test_rays_among_mirrors_end_as_is_proved(nested: bool) -> None:
    decided = events = 0
    for seed in range(4):
        more = agreement(scene_of(seed, nested=nested), *aimed(seed, 25))
        decided, events = decided + more[0], events + more[1]
    assert decided >= 96
    assert events > 150


@pytest.mark.parametrize("nested", [False, True])
def test_the_twin_agrees_but_for_what_its_march_loses(nested: bool) -> None:
    met = 0
    for seed in range(2):
        scene = scene_of(seed, nested=nested)
        starts, ways = aimed(seed, 200)
        units = ways / np.linalg.norm(ways, axis=1)[:, None]
        ends = trace_rays(scene, starts, units)
        other = trace_by_twin(scene, starts, units)
        both = (ends.status != RayStatus.UNDECIDED) & (other.status != RayStatus.UNDECIDED)
        alike = (ends.status == other.status) & (ends.events == other.events)
        assert alike[both].mean() > 0.98
        close = both & alike
        np.testing.assert_allclose(other.direction[close], ends.direction[close], rtol=0, atol=1e-7)
        met += int(ends.events[close].sum())
    assert met > 300


@pytest.mark.parametrize(
    ("nested", "fault"),
    [
        (False, Fault("one-sided", "effects/mirror.cl", "mirrored_at(ray, at, scene, &unsure);",
                      "mirrored_at(ray, at, scene, &unsure) & not_lane(at->leaves);")),
        (True, Fault("set kept crossed", "effects/mirror_nested.cl",
                     "ray->inside = crossed ? ray->inside ^ ray->on : ray->inside;", "")),
    ],
)  # fmt: skip
def test_broken_mirrors_are_caught_by_the_proofs(nested: bool, fault: Fault) -> None:
    scene, rays = scene_of(1, nested=nested), aimed(1, 25)
    agreement(scene, *rays)
    with broken(fault), pytest.raises(AssertionError):
        agreement(scene, *rays)


def test_an_edge_of_the_coat_is_undecidable_and_is_said_to_be_so() -> None:
    """A ray through a point of the edge, in numbers that are exact."""
    lens = {"surface": "max(x^2 + y^2 - 1, z, -z - 1)", "bounds": [[-1.5] * 3, [1.5] * 3], "mirror": ["2"], "n": 1.5}
    scene = make_scene(lens)
    (proof,) = oracle.prove_rays(scene, [[2.0, 0.0, 1.0]], [[-1.0, 0.0, -1.0]], most_bits=256)
    assert proof.status is None
    ends = trace_rays(scene, [[2.0, 0.0, 1.0]], [[-1.0, 0.0, -1.0]])
    assert ends.status[0] == RayStatus.UNDECIDED


@pytest.mark.slow
@pytest.mark.parametrize("seed", SLOW_SEEDS)
def test_random_scenes_of_mirrors_end_as_is_proved(seed: int) -> None:
    scene = mirrored_scene(seed)
    raymap = trace(scene)
    met = np.flatnonzero((raymap.events.ravel() > 0) | (raymap.status.ravel() == RayStatus.UNDECIDED))
    pixels = np.random.default_rng(seed).choice(met, min(24, len(met)), replace=False)
    for pixel, proof in zip(pixels, oracle.prove_pixels(scene, pixels, radius=1e-12, most_bits=512), strict=True):
        if proof.status is not None:
            assert raymap.status.ravel()[pixel] == proof.status
            assert raymap.events.ravel()[pixel] == proof.events
    other = twin(scene)
    both = (raymap.status.ravel() != RayStatus.UNDECIDED) & (other.status != RayStatus.UNDECIDED)
    alike = (raymap.status.ravel() == other.status) & (raymap.events.ravel() == other.events)
    assert alike[both].mean() > 0.98
