"""Checks, bounds and certified rays among many lenses ask those about a point, and find what asking all finds."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from lenscl.accuracy import meeting
from lenscl.accuracy.media import Apart
from lenscl.accuracy.selfcheck.hits import Tolerance, candidates
from lenscl.accuracy.selfcheck.legs import Clear, obstacles
from lenscl.accuracy.selfcheck.media import media_at, ranks
from lenscl.config import scene_from_toml
from lenscl.reference import near
from lenscl.reference.oracle import prove_rays
from lenscl.tracing import boxes

PLACES = [[x, y, z] for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0) for z in (-1.0, 0.0, 1.0)]
SCENE = f"""
source = {{ at = [0.3, 0.2, 12] }}
film = {{ centre = [0, 0, 6], right = [2, 0, 0], down = [0, -2, 0], size = [16, 16] }}
picture = {{ centre = [0, 0, -4], right = [8, 0, 0], down = [0, -8, 0] }}
[[lens]]
name = "balls"
surface = "sphere"
r = 0.4
n = 1.5
at = {PLACES}
[[lens]]
name = "ring"
surface = "torus"
rotate = [30, 20, 0]
centre = [0, 0, 2.2]
n = 1.7
priority = 1
"""


@pytest.fixture(scope="module")
def scene():
    return scene_from_toml(SCENE)


def on_balls(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points on surfaces of the balls, and their outward normals."""
    rng = np.random.default_rng(6)
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return np.array(PLACES)[rng.integers(0, len(PLACES), count)] + 0.4 * normals, normals


def all_and_near(monkeypatch, found):
    """Return what is found where the lenses about a point are asked, and where all are."""
    few = found()
    monkeypatch.setattr(boxes, "FEW", 10**6)
    every = found()
    monkeypatch.undo()
    return few, every


@pytest.mark.parametrize("eps", [2.0**-52, 2.0**-23])
def test_points_belong_to_the_lenses_that_all_would_give(scene, monkeypatch, eps):
    points, normals = on_balls(200)
    points[::5] += 0.3 * normals[::5]  # some lie on nothing
    few, every = all_and_near(monkeypatch, lambda: candidates(scene, points, eps, Tolerance.of(scene, eps)))
    for one, other in zip(few[:2], every[:2], strict=True):
        for each in fields(one):
            np.testing.assert_array_equal(getattr(one, each.name), getattr(other, each.name), err_msg=each.name)
    np.testing.assert_array_equal(few[2], every[2])
    assert len(np.unique(few[0].lens[few[0].value <= few[0].bound])) > 20


def test_legs_are_free_where_all_lenses_leave_them_free(scene, monkeypatch):
    points, normals = on_balls(200)
    way = normals + np.random.default_rng(7).normal(size=normals.shape)
    way /= np.linalg.norm(way, axis=1)[:, None]
    within = np.full(200, -1)
    within[:20] = 5  # which they leave at once
    legs = Clear(origin=points, direction=way, length=np.full(200, np.inf), within=within, allowed=np.full(200, 1e-15))
    few, every = all_and_near(monkeypatch, lambda: obstacles(scene, legs, 2.0**-52))
    for one, other in zip(few, every, strict=True):
        np.testing.assert_array_equal(one, other)
    blocked = few[0] > few[1]
    assert 50 < blocked.sum() < 200
    # A line that passes all centres by more than the radius is free of balls; one that goes through is not
    away = np.array(PLACES)[None] - points[:, None]
    along = (away * way[:, None]).sum(axis=-1)
    passes = np.linalg.norm(away - along[..., None] * way[:, None], axis=-1)
    goes_through = ((passes < 0.35) & (along > 0.4)).any(axis=1)[20:]
    assert blocked[20:][goes_through].all()


def test_media_and_sides_are_those_that_all_lenses_give(scene, monkeypatch):
    points = np.random.default_rng(8).uniform(-1.5, 1.5, (300, 3))
    few, every = all_and_near(monkeypatch, lambda: media_at(scene, points, 2.0**-52))
    np.testing.assert_array_equal(few, every)
    assert len(np.unique(few)) > 20
    starts, _ = on_balls(100)

    def departs():
        rays = Apart(meeting.Glasses(scene), np.ascontiguousarray(starts.T))
        return rays._on, rays._departs

    few, every = all_and_near(monkeypatch, departs)
    for one, other in zip(few, every, strict=True):
        np.testing.assert_array_equal(one, other)
    assert (few[0] >= 0).all()
    assert ranks(scene).tolist() == list(range(28))


def test_certified_rays_are_proved_as_among_all_lenses(scene, monkeypatch):
    pytest.importorskip("flint")
    rng = np.random.default_rng(9)
    origins = np.column_stack([rng.uniform(-1.2, 1.2, (12, 2)), np.full(12, 5.0)])
    directions = np.column_stack([rng.uniform(-0.1, 0.1, (12, 2)), np.full(12, -1.0)])
    asked = []
    usual = near.near_line
    monkeypatch.setattr("lenscl.reference.oracle.near_line", lambda *args: asked.append(usual(*args)) or asked[-1])
    few = prove_rays(scene, origins, directions)
    assert sum(map(len, asked)) < 6 * len(asked)
    monkeypatch.setattr(near, "_FEW", 10**6)
    every = prove_rays(scene, origins, directions)
    assert sum(proof.events >= 4 for proof in few) >= 4
    for one, other in zip(few, every, strict=True):
        assert (one.status, one.events, one.radius) == (other.status, other.events, other.radius)
        assert [str(each) for each in one.st or ()] == [str(each) for each in other.st or ()]


def test_no_lens_that_a_line_meets_is_left_out_of_the_near_ones(scene):
    from lenscl.reference.vectors import vector

    middles, rng, met = np.array(PLACES), np.random.default_rng(10), 0
    pytest.importorskip("flint")
    for _ in range(100):
        origin, way = rng.uniform(-3, 3, 3), rng.normal(size=3)
        away = middles - origin
        off = np.linalg.norm(away - (away @ way)[:, None] * way / (way @ way), axis=1)
        (through,) = np.nonzero(off <= 0.4)
        met += len(through)
        assert set(through.tolist()) <= set(near.near_line(scene.lenses, vector(origin), vector(way)))
        (holding,) = np.nonzero(np.linalg.norm(away, axis=1) <= 0.4)
        assert set(holding.tolist()) <= set(near.near_line(scene.lenses, vector(origin), None))
    assert met > 40
