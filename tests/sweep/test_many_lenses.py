"""Very many lenses on the host: trees of boxes against every pair, counts of what is looked at, and what is said."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import event, given, settings
from hypothesis import strategies as st

from lenscl.config import Lenses, scene_from_toml, study_from_toml
from lenscl.sweep.hardspots import hard_spots
from lenscl.sweep.plan import structure_text
from lenscl.tracing import MOST_PAIRS, locate, locate_sets, reach_of, study_needs, touching, with_needs
from lenscl.tracing import apart as apart_module
from lenscl.tracing import reaching as reaching_module
from lenscl.tracing import start as start_module
from lenscl.tracing.apart import may_touch
from lenscl.tracing.boxes import BoxTree, near_legs, near_points, world_boxes
from lenscl.tracing.called import needs_of
from lenscl.tracing.filled import ball, farthest
from lenscl.tracing.placement import Placement
from lenscl.tracing.reaching import reaches, reaching

HEAD = """
source = { at = [0, 0, 40] }
film = { centre = [0, 0, 20], right = [16, 0, 0], down = [0, -16, 0], size = [32, 32] }
picture = { centre = [0, 0, -20], right = [40, 0, 0], down = [0, -40, 0] }
"""
SOLIDS = {
    "ball": 'surface = "sphere"\nr = 0.4',
    "turned": 'surface = "ellipsoid"\na = 0.5\nb = 0.1\nc = 0.3\nrotate = [20, 30, 40]',
    "ring": 'surface = "torus"\nR = 0.35\nr = 0.1\nstretch = [1, 1.5, -0.7]',
    "own": 'surface = "x**2 + y**4 + z**2 - 0.1"\nbounds = [[-3, -2, -1], [1, 1, 1]]',
}


def scene_of(**tables):
    """Return a scene of arrays, each of a solid, at its places."""
    text = "".join(
        f"[[lens]]\nname = '{name}'\nn = 1.5\n{SOLIDS[name]}\nat = {[list(map(float, place)) for place in at]}\n"
        for name, at in tables.items()
    )
    return scene_from_toml(HEAD + text)


def grid(side: int, width: int = 3) -> np.ndarray:
    axes = np.meshgrid(*[np.arange(side) - side / 2.0] * width)
    return np.column_stack([np.stack(axes, axis=-1).reshape(-1, width), *[np.zeros(side**width)] * (3 - width)])


coordinates = st.floats(-2.0, 2.0).map(lambda x: round(x, 2))
places = st.lists(st.tuples(coordinates, coordinates, coordinates), min_size=1, max_size=7)


@given(
    boxes=st.lists(st.tuples(*[coordinates] * 3, *[st.floats(0.0, 1.0)] * 3), min_size=1, max_size=40),
    asks=st.lists(st.tuples(*[coordinates] * 3, *[st.just(0.0) | st.floats(0.0, 1.0)] * 3), max_size=10),
)
def test_a_tree_finds_the_boxes_that_meet(boxes, asks):
    boxes, asks = (np.array(each, dtype=np.float64).reshape(-1, 6) for each in (boxes, asks))
    low, high = boxes[:, :3], boxes[:, :3] + boxes[:, 3:]
    ask_low, ask_high = asks[:, :3], asks[:, :3] + asks[:, 3:]
    found = set(zip(*(each.tolist() for each in BoxTree(low, high).meeting(ask_low, ask_high)), strict=True))
    meets = ((ask_low[:, None] <= high) & (ask_high[:, None] >= low)).all(axis=-1)
    assert found == {(i, j) for i, j in np.argwhere(meets).tolist()}
    event(f"some meet: {bool(found)}")


@given(
    boxes=st.lists(st.tuples(*[coordinates] * 3, *[st.floats(0.01, 1.0)] * 3), min_size=1, max_size=40),
    legs=st.lists(
        st.tuples(*[coordinates] * 3, *[st.sampled_from([0.0, -0.0, 1.0, -0.5, 1e-9])] * 3, st.floats(0.0, 9.0)),
        max_size=8,
    ),
)
def test_a_tree_finds_the_boxes_that_legs_go_through(boxes, legs):
    boxes, legs = np.array(boxes), np.array(legs, dtype=np.float64).reshape(-1, 7)
    legs = legs[legs[:, 3:6].any(axis=1)]
    low, high = boxes[:, :3], boxes[:, :3] + boxes[:, 3:]
    start, along, length = legs[:, :3], legs[:, 3:6], legs[:, 6]
    found = set(zip(*(each.tolist() for each in BoxTree(low, high).crossed(start, along, length)), strict=True))
    # Sampled places of a leg lie in no box that was not found; and what was found is near
    for i in range(len(legs)):
        t = np.concatenate([np.linspace(0.0, length[i], 400)])
        points = start[i] + t[:, None] * along[i]
        within = ((points[:, None] >= low) & (points[:, None] <= high)).all(axis=-1).any(axis=0)
        for j in range(len(boxes)):
            assert (i, j) in found or not within[j]
        room = length[i] / 400 * np.linalg.norm(along[i]) + 1e-9
        near = ((points[:, None] >= low - room) & (points[:, None] <= high + room)).all(axis=-1).any(axis=0)
        assert all(near[j] for k, j in found if k == i)
    event(f"some are crossed: {bool(found)}")


@settings(max_examples=12, deadline=None)
@given(tables=st.fixed_dictionaries({"ball": places, "ring": places}, optional={"turned": places, "own": places}))
def test_solids_that_touch_are_those_of_every_pair(tables):
    scene = scene_of(**tables)
    every = range(len(scene.lenses))
    pairs = touching(scene.lenses, every)
    alone = Lenses.of(list(scene.lenses))
    assert pairs == touching(alone, every)
    with pytest.MonkeyPatch.context() as monkey:  # so many that balls are looked at, too
        monkey.setattr(apart_module, "_MANY", 0)
        assert set(apart_module._pairs(scene.lenses.solids, None)) == set(pairs)
    assert set(pairs) == {(i, j) for i, j in combinations(every, 2) if may_touch(alone[i], alone[j])}
    some = [number for number in every if number % 3]
    assert touching(scene.lenses, some) == tuple(pair for pair in pairs if set(pair) <= set(some))
    # And independently: balls touch where their centres are no farther apart than two radii
    (first,) = (group for group in scene.lenses.groups if group.lens.name == "ball")
    balls = first.centres
    apart = np.linalg.norm(balls[:, None] - balls, axis=-1)
    for i, j in combinations(range(len(balls)), 2):
        if abs(apart[i, j] - 0.8) > 1e-3:
            assert ((first.first + i, first.first + j) in pairs) is bool(apart[i, j] < 0.8)
    event(f"some touch: {bool(pairs)}")


@settings(max_examples=40, deadline=None)
@given(
    tables=st.fixed_dictionaries({"ball": places}, optional={"ring": places, "turned": places, "own": places}),
    points=st.lists(st.tuples(coordinates, coordinates, coordinates), min_size=1, max_size=30),
)
def test_points_are_located_as_lens_by_lens(tables, points):
    scene, points = scene_of(**tables), np.array(points)
    inside, on = locate(scene, points)
    assert inside.dtype == on.dtype == np.int32
    expected = np.full((2, len(points)), -1)
    for number, lens in enumerate(scene.lenses):
        found = np.stack(locate(replace(scene, lenses=Lenses.of([lens])), points))
        expected[found >= 0] = number
    assert np.array_equal(np.stack([inside, on]), expected)
    event(f"some lie inside: {bool((inside >= 0).any())}, of more than 8 lenses: {len(scene.lenses) > 8}")


@pytest.mark.parametrize("name", SOLIDS)
def test_bounds_of_a_solid_hold_all_of_it(name):
    lens = scene_of(**{name: [(0, 0, 0)]}).lenses[0]
    placed, rng = Placement.of(lens), np.random.default_rng(3)
    local = rng.uniform(*placed.box, (200_000, 3))
    values = {**lens.values, **dict(zip("xyz", local.T, strict=True))}
    from lenscl.expr import evaluate

    world = local[evaluate(lens.surface.expression, values) <= 0.0] @ placed.to_world.T
    assert len(world) > 1000
    middle, radius = ball(lens.solid)
    off = np.linalg.norm(world - middle, axis=1).max()
    assert 0.8 * radius < off <= radius
    for direction in rng.normal(size=(6, 3)):
        most, bound = (world @ direction).max(), farthest(lens.solid, tuple(direction.tolist()))
        assert most <= bound
        assert bound - most < 0.15 * np.ptp(world @ direction)
    up = farthest(lens.solid, (0.0, 0.0, 1.0))
    assert world[:, 2].max() <= up
    assert up - world[:, 2].max() < 0.1 * np.ptp(world[:, 2])


@settings(max_examples=25, deadline=None)
@given(tables=st.fixed_dictionaries({"ball": places, "turned": places}), height=st.sampled_from([-0.4, -1.0, 0.0, 5.0]))
def test_lenses_that_reach_the_picture_are_those_of_each_alone(tables, height):
    scene = scene_of(**tables).replace({"picture.centre": [0.3, 0.0, height], "picture.right": [1.0, 0.0, 0.5]})
    screen = scene.picture
    expected = [i for i, lens in enumerate(scene.lenses) if reaches(lens, screen.corner, screen.right, screen.down)]
    assert list(reaching(scene.lenses, screen)) == expected
    with pytest.MonkeyPatch.context() as monkey:  # so many that it is looked at how far they go
        monkey.setattr(reaching_module, "_MANY", 0)
        assert list(reaching(scene.lenses, screen)) == expected
    event(f"some reach it: {bool(expected)}")


def counted(monkeypatch, module, name: str) -> list:
    calls, function = [], getattr(module, name)

    def seen(*args):
        calls.append(args)
        return function(*args)

    monkeypatch.setattr(module, name, seen)
    return calls


def test_a_lattice_of_solids_is_looked_at_once_for_each_way_in_which_two_lie():
    """8,000 solids, whose boxes and balls overlap those of their neighbours in a few ways, and they do not."""
    scene = scene_of(turned=0.7 * grid(20) + 0.1)
    apart_module._apart.cache_clear()
    assert touching(scene.lenses, range(8000)) == ()
    ways = apart_module._apart.cache_info().misses
    assert 1 < ways < 100  # places that differ by rounding may fall to either side of a step
    before = apart_module._touching.cache_info().misses
    # Asked again, for another film, other glass and another size of picture, nothing is looked at
    again = scene.replace({"lens.n": 1.7, "film.size": [9, 9]})
    assert touching(again.lenses, range(8000)) == ()
    assert apart_module._touching.cache_info().misses == before
    assert apart_module._apart.cache_info().misses == ways


def test_of_very_many_pairs_some_are_told(monkeypatch):
    scene = scene_of(ball=np.zeros((3000, 3)))
    assert len(touching(scene.lenses, range(3000))) == MOST_PAIRS
    (twice,) = [spot for spot in hard_spots(scene) if spot.kind == "twice"]
    assert str(twice).startswith(
        "lens.ball.at: 2999 of its 3000 places are given before, the first of them as lens.ball"
    )
    assert "lens.ball.at[1] and lens.ball.at[0]: the same solid twice" in str(twice)
    assert not [spot for spot in hard_spots(scene) if "overlap" in spot.kind]


def test_facts_of_an_array_are_found_by_table(monkeypatch):
    made = Counter()
    usual = Placement.of.__func__

    def of(cls, lens):
        made[lens.name] += 1
        return usual(cls, lens)

    monkeypatch.setattr(Placement, "of", classmethod(of))
    text = f"[[lens]]\nname = 'balls'\n{SOLIDS['ball']}\nn = 1.5\nat = {grid(18).tolist()}\n"
    study = study_from_toml(HEAD + text)
    needs = study_needs(study)
    assert len(needs.lenses) == 18**3
    assert "solids may touch or overlap" not in needs.facts
    assert [spot.kind for spot in hard_spots(study.scene)] == ["thin", "not-aimed-at"]
    assert 0 < sum(made.values()) < 40


def test_only_the_lenses_about_a_point_are_asked(monkeypatch):
    scene = scene_of(ball=grid(12))
    evaluated = counted(monkeypatch, start_module, "_sides_of")
    points = np.random.default_rng(2).uniform(-6.0, 6.0, (500, 3))
    inside, _ = locate(scene, points)
    assert len(evaluated) == 1
    assert len(evaluated[0][2]) < 2 * len(points)
    off = np.linalg.norm(points - scene.lenses.groups[0].centres[inside], axis=1)
    assert (off[inside >= 0] < 0.4).all()
    assert 50 < (inside >= 0).sum() < 250
    nearest = np.linalg.norm(points[:, None] - scene.lenses.groups[0].centres, axis=-1).min(axis=1)
    assert np.array_equal(nearest < 0.4, inside >= 0)


def test_near_lenses_are_all_of_few():
    scene = scene_of(ball=[(0, 0, 0), (5, 0, 0)])
    points = np.array([[100.0, 0.0, 0.0]])
    assert near_points(scene.lenses, points)[1].tolist() == [0, 1]
    assert near_legs(scene.lenses, points, points, np.ones(1))[1].tolist() == [0, 1]
    low, high = world_boxes(scene.lenses)
    assert (low[:, 0] < [-0.4, 4.6]).all()
    assert (high[:, 0] > [0.4, 5.4]).all()


def test_what_is_hard_about_an_array_is_said_once():
    scene = scene_of(ball=0.7 * grid(9, 2))
    spots = list(hard_spots(scene.replace({"lens.stretch.z": 1e-3, "film.scale": 8.0})))
    (overlap,) = [spot for spot in spots if spot.kind.startswith("overlap")]
    assert "A later place in lens.ball.at makes it that of" in overlap.message
    assert "143 other pairs of lens.ball may touch or overlap, too" in overlap.message
    cut = [spot for spot in hard_spots(scene.replace({"film.centre": [0, 0, 0]})) if spot.kind == "cut-by-film"]
    assert len(cut) == 1
    assert cut[0].message.endswith("So it is with 81 of the 81 places of lens.ball")
    source = [spot for spot in hard_spots(scene.replace({"source.at": [0.35, 0.35, 0.0]})) if spot.key == "source"]
    assert len(source) == 1
    assert "lens.ball.at[" in source[0].message


def test_points_of_a_study_may_have_arrays_of_different_lengths():
    text = HEAD + f"[[lens]]\nname = 'balls'\n{SOLIDS['ball']}\nn = 1.5\nat = [[0, 0, 0]]\n"
    text += f"[[lens]]\nname = 'ring'\n{SOLIDS['ring']}\nn = 1.6\ncentre = [0, 0, 3]\n"
    longer = [[float(x), 0.0, 0.0] for x in range(4)]
    study = study_from_toml(f"{text}[sweep.axes]\n'lens.balls.at' = [{longer}, {longer[:2]}]\n")
    needs = study_needs(study)
    assert needs.lenses == frozenset(range(5))
    scenes = [with_needs(point.scene, needs) for point in study.points()]
    assert [list(reach_of(scene)) for scene in scenes] == [[0, 1, 2, 3, 4], [0, 1, 2]]
    assert [sorted(needs_of(scene).lenses) for scene in scenes] == [[0, 1, 2, 3, 4], [0, 1, 2]]
    assert len({structure_text(point) for point in study.points()}) == 2


def test_sets_of_very_many_lenses_are_whole_numbers():
    """70 balls in one place and one beside them: a set has a bit for each lens, in the order of priority."""
    scene = scene_of(ball=[*[(0, 0, 0)] * 70, (5, 0, 0)], ring=[(0, 9, 0)])
    inside, on = locate_sets(scene, np.array([[0.1, 0, 0], [5.1, 0, 0], [5.4, 0, 0], [0, 8.5, 0], [0, 0, 9]]))
    assert inside.tolist() == [2**70 - 1, 2**70, 0, 2**71, 0]
    assert on.tolist() == [0, 0, 2**70, 0, 0]
