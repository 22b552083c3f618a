"""Rays that double leaves undecided are searched once more in twice the precision, and rightly."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import make_scene

import lenscl
from lenscl.reference import certified
from lenscl.status import RayStatus
from lenscl.tracing import job

LENSES = {
    "sphere": {"surface": "sphere"},
    "torus": {"surface": "torus"},
    "bifolia": {"surface": "bifolia"},
    "quartic": {"surface": "x**4 + y**4 + z**4 - k", "k": 0.4, "bounds": [[-1, -1, -1], [1, 1, 1]]},
}
RAYS = 400


def touching(scene: lenscl.Scene) -> tuple[np.ndarray, np.ndarray]:
    """Return rays that pass a lens's rim by 1e-16 to 1e-13, on either side."""
    rng = np.random.default_rng(1)
    o = rng.normal(size=(RAYS, 3))
    o *= 3 / np.linalg.norm(o, axis=1, keepdims=True)
    hits = 0.05 * rng.normal(size=(RAYS, 3)) - o
    misses = hits + 3 * np.cross(hits, rng.normal(size=(RAYS, 3))) / np.linalg.norm(hits, axis=1, keepdims=True)
    low, high = np.zeros(RAYS), np.ones(RAYS)
    for _ in range(55):
        middle = (low + high) / 2
        meets = lenscl.trace_rays(scene, o, hits + middle[:, None] * (misses - hits)).events > 0
        low, high = np.where(meets, middle, low), np.where(meets, high, middle)
    off = 10.0 ** rng.uniform(-16, -13, RAYS) * rng.choice([-1, 1], RAYS)
    d = hits + (low + off)[:, None] * (misses - hits)
    return o, d / np.linalg.norm(d, axis=1, keepdims=True)


@pytest.mark.parametrize("name", LENSES)
def test_more_rays_are_decided_and_none_of_them_wrongly(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = make_scene(LENSES[name])
    o, d = touching(scene)
    last = lenscl.trace_rays(scene, o, d)
    monkeypatch.setattr(job.Job, "_more_precise", lambda job, scene: None)
    double = lenscl.trace_rays(scene, o, d)
    open_before, open_after = (each.status == RayStatus.UNDECIDED for each in (double, last))
    assert last.escalated == open_before.sum() > RAYS // 4
    assert open_after.sum() < 0.75 * open_before.sum()
    assert not (open_after & ~open_before).any()
    np.testing.assert_array_equal(last.st[~open_before], double.st[~open_before])

    lens = scene.lenses[0]
    settled = np.flatnonzero(open_before & ~open_after)
    crossed = 0
    for ray in settled:
        proof = certified.first_root(lens.surface.expression, lens.values, o[ray], d[ray], 10.0)
        assert (last.events[ray] > 0) == (proof.crossing is not None)
        crossed += proof.crossing is not None
    assert min(crossed, len(settled) - crossed) > 5


def test_single_goes_through_double_to_the_last() -> None:
    scene = make_scene(LENSES["sphere"])
    o, d = touching(scene)
    single, double = (lenscl.trace_rays(scene, o, d, precision=precision) for precision in ("single", "double"))
    np.testing.assert_array_equal(single.status, double.status)
    assert single.escalated > 0.8 * RAYS  # in single nearly all of them touch


def test_a_surface_that_is_not_rational_stays_in_double() -> None:
    assert not job.codegen.has_twice(make_scene({"surface": "prism"}).lenses[0].surface)
    assert job.codegen.has_twice(make_scene({"surface": "heart"}).lenses[0].surface)
