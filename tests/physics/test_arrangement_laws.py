"""Laws of solids that may touch or overlap, held for random ones; and kernels that break them, caught."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from faults_in_kernels import Fault, broken
from hypothesis import given, settings
from hypothesis import strategies as st
from physics.arranged import CROWN, FLINT, Lens, alike, followed, rays_through, scene_of, user
from probe import plain_device
from scenes import make_scene

from lenscl import RayStatus, trace_rays
from lenscl.config import Scene
from lenscl.reference.oracle import prove_rays
from lenscl.tracing import RayPaths, kernel_source

EXAMPLES = 5
COUNT = 120
KINDS: dict[str, Lens] = {
    "ball": {"surface": "sphere", "r": 0.4},
    "ring": {"surface": "torus", "R": 0.35, "r": 0.15},
    "drum": {"surface": "rod", "diameter": 0.6, "length": 0.5},
}
PLACES = st.tuples(*[st.floats(-0.3, 0.3)] * 3).map(list)
INDICES = st.sampled_from([1.0, 1.3, 1.5, 1.7])
SEEDS = st.integers(0, 2**32 - 1)


def _three(places: list[list[float]], indices: list[float]) -> list[Lens]:
    """Return three overlapping solids, the later of higher priority."""
    return [
        KINDS[kind] | {"name": kind, "centre": at, "n": n, "priority": rank}
        for rank, (kind, at, n) in enumerate(zip(KINDS, places, indices, strict=True))
    ]


def test_the_order_of_lenses_in_the_file_is_no_matter_where_priorities_differ() -> None:
    landed = 0

    @settings(max_examples=EXAMPLES)
    @given(st.lists(PLACES, min_size=3, max_size=3), st.lists(INDICES, min_size=3, max_size=3), SEEDS)
    def holds(places: list[list[float]], indices: list[float], seed: int) -> None:
        nonlocal landed
        lenses = _three(places, indices)
        rays = rays_through(np.random.default_rng(seed), COUNT)
        one, *others = (followed(scene_of(*some), rays) for some in list(permutations(lenses))[::2])
        for other in others:
            landed += alike(one, other, 0.0)

    holds()
    assert landed > 300


def test_where_all_indices_are_equal_light_goes_straight_on() -> None:
    events = 0

    @settings(max_examples=EXAMPLES)
    @given(st.lists(PLACES, min_size=3, max_size=3), st.sampled_from([1.0, 1.5]), SEEDS)
    def holds(places: list[list[float]], n: float, seed: int) -> None:
        nonlocal events
        rays = rays_through(np.random.default_rng(seed), COUNT)
        ends = followed(scene_of(*_three(places, [n] * 3), medium=n), rays)
        told = ends.status != RayStatus.UNDECIDED
        assert told.mean() > 0.98
        assert np.abs(ends.direction - rays[1])[told].max() < 1e-15, "but for how the given direction is made unit"
        events += int(ends.events[told].sum())

    holds()
    assert events > 600


def test_a_solid_cut_in_two_that_are_cemented_bends_as_the_whole() -> None:
    whole = "x^4 + y^4 + z^4 - 0.03"
    crossed = 0

    @settings(max_examples=EXAMPLES)
    @given(st.tuples(*[st.floats(-1.0, 1.0)] * 3), st.floats(-0.1, 0.1), st.sampled_from([1.3, 1.5, 0.7]), SEEDS)
    def holds(normal: tuple[float, float, float], offset: float, n: float, seed: int) -> None:
        nonlocal crossed
        a, b, c = (x if abs(x) > 0.01 else 0.5 for x in normal)
        knife = {"a": a, "b": b, "c": c, "d": offset, "n": n}
        low, high = (user(f"max({whole}, {sign}*(a*x + b*y + c*z - d))", **knife) for sign in ("1", "(-1)"))
        rays = rays_through(np.random.default_rng(seed), COUNT)
        parts, one = followed(scene_of(low, high), rays), followed(scene_of(user(whole, n=n)), rays)
        told = (parts.status != RayStatus.UNDECIDED) & (one.events <= 4)
        assert told.mean() > 0.9
        assert (parts.events >= one.events)[told].all()
        assert np.abs(parts.direction - one.direction)[told].max() < 1e-10
        crossed += int((parts.events > one.events)[told].sum())

    holds()
    assert crossed > 60, "rays go from one part into the other"


def test_a_solid_of_lower_priority_within_another_is_not_there() -> None:
    landed = 0

    @settings(max_examples=EXAMPLES)
    @given(st.floats(0.2, 0.5), st.tuples(*[st.floats(-180.0, 180.0)] * 3).map(list), INDICES, SEEDS)
    def holds(share: float, turn: list[float], n: float, seed: int) -> None:
        nonlocal landed
        cube = user("max(abs(x), max(abs(y), abs(z))) - 0.4", n=1.5, priority=0.5)
        ghost = KINDS["ring"] | {"stretch": [share] * 3, "rotate": turn, "n": n}
        rays = rays_through(np.random.default_rng(seed), COUNT)
        landed += alike(followed(scene_of(cube, ghost), rays), followed(scene_of(cube), rays), 1e-11)

    holds()
    assert landed > 150


@pytest.mark.parametrize("precision", ["double", "single", "mixed"])
def test_solids_apart_have_the_usual_kernel(precision: str) -> None:
    """Whatever their priorities are; where they are not proved apart it is another one."""
    numerics = {"precision": precision}
    ball, ring = KINDS["ball"] | {"name": "ball"}, KINDS["ring"] | {"name": "ring", "centre": [0.0, 0.0, -1.0]}
    apart = make_scene(ball, ring, numerics=numerics)
    text = kernel_source(apart).text
    assert "nested" not in text
    assert kernel_source(make_scene(ball | {"priority": 3}, ring, numerics=numerics)).text == text
    assert "nested" in kernel_source(make_scene(ball, ring | {"centre": [0.0, 0.0, -0.4]}, numerics=numerics)).text


DOUBLET = scene_of(CROWN, FLINT)
MIXTURE = scene_of(KINDS["ball"] | {"n": 1.5}, KINDS["drum"] | {"n": 1.2, "centre": [0.2, 0.1, 0.1]})
FAULTS = {
    "contact as a gap": (
        DOUBLET,
        Fault("contact as a gap", "lens_nested.cl", "    unknown = beside & not_lane(contact | certain);",
              "    before = before | (contact & (apart < (realv)0));\n    contact = (maskv)0;"),
    ),
    "contact crossed by one surface": (
        DOUBLET,
        Fault("contact crossed by one surface", "lens_nested.cl", "contact ? hit->crossed | LENS_BIT : hit->crossed",
              "hit->crossed"),
    ),
    "surfaces within a medium bend": (
        MIXTURE,
        Fault("surfaces within a medium bend", "trace_nested.cl", "passes = meets & (before == after);",
              "passes = (maskv)0;"),
    ),
    "a surface is left out of the set": (
        MIXTURE,
        Fault("a surface is left out of the set", "trace_nested.cl", "ray->inside ^ hit.crossed;",
              "ray->inside | hit.crossed;"),
    ),
}  # fmt: skip


def _rays_of(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    if scene is DOUBLET:
        x = np.linspace(-9.0, 9.0, 13)
        return np.column_stack([x, 0.3 * x, np.full(13, -20.0)]), np.tile([0.02, 0.0, 1.0], (13, 1))
    return rays_through(np.random.default_rng(7), 40)


def _differing(scene: Scene, ends: RayPaths) -> int:
    """Return how many rays end otherwise than is proved."""
    origins, directions = _rays_of(scene)
    proofs = prove_rays(scene, origins.tolist(), directions.tolist(), most_bits=256)
    assert all(proof.status is not None for proof in proofs)
    return sum(
        (ends.status[i], ends.events[i]) != (proof.status, proof.events)
        or (proof.st is not None and proof.distance(*map(float, ends.st[i])) > 1e-9)
        for i, proof in enumerate(proofs)
    )


def test_whole_kernels_end_rays_as_is_proved() -> None:
    for scene in (DOUBLET, MIXTURE):
        assert _differing(scene, followed(scene, _rays_of(scene))) == 0


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_in_the_kernel_is_caught(name: str) -> None:
    scene, fault = FAULTS[name]
    with broken(fault):
        ends = trace_rays(scene, *_rays_of(scene), device=plain_device(1))
    assert _differing(scene, ends) >= 5


def test_priorities_that_are_swapped_are_caught() -> None:
    ends = followed(MIXTURE.replace({"lens.l0.priority": 1}), _rays_of(MIXTURE))
    assert _differing(MIXTURE, ends) >= 5
