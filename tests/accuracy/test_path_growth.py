"""How much a change of the start grows: against certified answers and traces of rays that are changed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scenes import make_scene

from lenscl import RayStatus, trace
from lenscl.accuracy.path import RayPath, explain_pixel, follow
from lenscl.config import Scene
from lenscl.device import choose
from lenscl.reference.oracle import prove_rays
from lenscl.tracing import Follower

Array = Any
SURFACES = ("sphere", "torus", "heart", "bifolia", "superellipsoid", "cone", "conic_singlet")
SOME = 4
FINE = 1e-25


def scene_of(name: str, **numerics: Any) -> Scene:
    lens = {"surface": name, "rotate": [20.0, 30.0, 10.0], "stretch": [0.6, 0.5, 0.7]}
    return make_scene(lens, numerics=numerics)


def paths(scene: Scene, count: int, seed: int) -> list[RayPath]:
    raymap = trace(scene)
    found = np.argwhere((raymap.events > 0) & (raymap.status <= RayStatus.OFF_PICTURE))
    chosen = np.random.default_rng(seed).permutation(len(found))[:count]
    return [explain_pixel(scene, int(row), int(column)) for row, column in found[chosen]]


def changed(path: RayPath, step: float) -> tuple[Array, Array, Array]:
    """Return origins and directions, shape (4, 2, 3), changed both ways, and the relative changes, shape (4,)."""
    o, d = np.array(path.start), np.array(path.direction)
    u = np.cross(d, np.eye(3)[np.argmin(np.abs(d))])
    u /= np.linalg.norm(u)
    v = np.cross(d, u)
    nothing, signs = np.zeros(3), np.array([1.0, -1.0])[:, None]
    moves = [(u, nothing), (v, nothing), (nothing, u), (nothing, v)]
    origins = np.stack([o + signs * step * path.reach * move for move, _ in moves])
    directions = np.stack([d + signs * step * turn for _, turn in moves])
    apart = np.ptp(origins, axis=1) / path.reach, np.ptp(directions, axis=1)  # what was left by rounding
    return origins, directions, np.linalg.norm(apart[0], axis=1) + np.linalg.norm(apart[1], axis=1)


def certified_growth(scene: Scene, path: RayPath) -> float | None:
    """Return the growth by differences of certified places, None where a changed ray takes another path."""
    assert path.growth is not None
    origins, directions, apart = changed(path, 2.0**-38 / max(1.0, path.growth))
    proofs = prove_rays(scene, origins.reshape(-1, 3).tolist(), directions.reshape(-1, 3).tolist(), FINE)
    if any(proof.st is None or proof.events != path.total for proof in proofs):
        return None
    differences = [
        [float(x - y) for x, y in zip(one.st or (), other.st or (), strict=True)]
        for one, other in zip(proofs[::2], proofs[1::2], strict=True)
    ]
    return float(np.linalg.norm(np.array(differences).T / apart, 2))


def test_growth_is_that_of_certified_places_of_changed_rays() -> None:
    ratios, events = [], 0
    for name in SURFACES:
        scene = scene_of(name)
        for path in paths(scene, SOME, seed=5):
            assert path.growth is not None
            found = certified_growth(scene, path)
            if found is not None:
                ratios.append(path.growth / found)
                events += path.total
    assert len(ratios) > 0.8 * SOME * len(SURFACES)
    assert events > 2 * len(ratios)  # and longer paths among them
    assert min(ratios) > 0.5
    assert max(ratios) < 2
    assert np.median(np.abs(np.array(ratios) - 1)) < 1e-3


@pytest.mark.parametrize("snell", ["exact", "paraxial"])
def test_growth_up_to_every_point_is_that_of_traces_of_changed_rays(snell: str) -> None:
    checked = longest = 0
    for name in ("torus", "bifolia", "cone"):
        scene = scene_of(name, snell=snell)
        follower = Follower(scene, choose())
        for path in paths(scene, SOME, seed=7):
            step = 1e-6 / max(1.0, *(event.growth or 0.0 for event in path.events))
            origins, directions, apart = changed(path, step)
            for event in path.events:
                assert event.growth is not None
                ends = follower.ends(origins.reshape(-1, 3), directions.reshape(-1, 3), event.number)
                if (ends.events < event.number).any():
                    break
                moved = -np.diff(ends.origin.reshape(4, 2, 3), axis=1)[:, 0]
                found = np.linalg.norm(moved.T / apart, 2) / path.reach
                assert event.growth == pytest.approx(found, rel=0.02), (name, path.row, path.column, event.number)
                checked += 1
                longest = max(longest, event.number)
    assert checked > 5 * SOME
    assert longest > 2 or snell == "paraxial"  # which reflects nothing


def test_surfaces_taken_for_flat_would_be_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(follow, "normal_bend", lambda *_: np.zeros((3, 3)))
    scene = scene_of("torus")
    ratios = [
        path.growth / (certified_growth(scene, path) or np.inf) for path in paths(scene, SOME, seed=5) if path.growth
    ]
    assert len(ratios) == SOME
    assert not all(0.5 < ratio < 2 for ratio in ratios)
