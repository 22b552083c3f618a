"""Many lenses: records of a table, which trace as lenses do that stand in a kernel's text, and as the twin."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from faults_in_kernels import Fault, broken
from probe import plain_device
from random_scenes import random_crowd
from scenes import make_scene

from lenscl import RayStatus, reference, trace, trace_rays
from lenscl.accuracy.selfcheck import check_rays
from lenscl.codegen import Table
from lenscl.config import Scene
from lenscl.device import choose
from lenscl.tracing import RayMap, film_rays, kernel_source, structure

EFFECTS: dict[str, Any] = {
    "total_reflection": "follow",
    "fresnel": "polarised",
    "absorption": True,
    "path_length": True,
    "footprint": True,
    "dispersion": 3,
}


@contextmanager
def written(most: int) -> Iterator[None]:
    """Let kernels have the text of so many lenses at most; the lenses of others are in tables."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(structure, "MOST_WRITTEN", most)
        yield


def balls(*shape: int, n: Any = 1.5, radius: float = 0.42) -> list[dict[str, Any]]:
    """Return balls in a grid over [-1, 1], of three sizes."""
    pitch = 2.0 / shape[0]
    lines = [(np.arange(count) - (count - 1) / 2) * pitch for count in shape]
    places = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    sizes = radius * pitch * np.array([1.0, 0.9, 0.8])
    return [
        {"surface": "sphere", "name": f"b{i}", "r": sizes[i % 3], "centre": place.tolist(), "n": n}
        for i, place in enumerate(places)
    ]


def mixed(*, n: Any = 1.6) -> list[dict[str, Any]]:
    """Return eleven lenses of six kinds, polyhedra, a torus and an expression among them."""
    kinds: list[dict[str, Any]] = [
        {"surface": "sphere", "r": 0.2},
        {"surface": "box", "a": 0.3, "b": 0.25, "c": 0.2, "rotate": [20, 30, 0]},
        {"surface": "torus", "R": 0.15, "r": 0.06, "rotate": [40, 0, 10]},
        {"surface": "ellipsoid", "a": 0.2, "b": 0.15, "c": 0.1, "stretch": [1.0, 1.1, 0.9], "rotate": [0, 50, 20]},
        {"surface": "max(x^2 + y^2 - k, abs(z) - 0.1)", "k": 0.03, "bounds": [[-0.25] * 3, [0.25] * 3]},
        {"surface": "heart", "stretch": [0.12] * 3, "rotate": [-90, -90, 0]},
    ]
    places = [(x, y, z) for z in (0.0, -0.9) for y in (-0.5, 0.05, 0.55) for x in (-0.55, 0.0, 0.55)]
    more = [
        {"name": f"l{i}", "centre": place, "n": n if i % 3 else 1.8, "absorption": [0.1 * i, 0.4, 0.0]}
        for i, place in enumerate(places[:11])
    ]
    return [kinds[i % len(kinds)] | more[i] for i in range(11)]


def assert_alike(one: RayMap, other: RayMap, within: float) -> None:
    """Hold that two maps have the same status and events, and places and all else within an error."""
    assert one.kernel.structure.tabled != other.kernel.structure.tabled
    np.testing.assert_array_equal(one.status, other.status)
    np.testing.assert_array_equal(one.events, other.events)
    np.testing.assert_allclose(one.st, other.st, rtol=within, atol=within)
    assert one.added.keys() == other.added.keys()
    for name, array in one.added.items():
        np.testing.assert_allclose(array, other.added[name], rtol=1e3 * within, atol=1e3 * within, err_msg=name)


@pytest.mark.parametrize("precision", ["single", "double", "mixed"])
def test_a_table_traces_as_text_does_with_every_effect(precision: str) -> None:
    scene = make_scene(
        *mixed(n="BK7"),
        film={"size": [40, 40], "right": [0.8, 0, 0], "down": [0, -0.8, 0]},
        effects=EFFECTS,
        numerics={"precision": precision},
    )
    table = trace(scene)
    with written(99):
        text = trace(scene)
    assert len(table.kernel.structure.kinds) == 6
    assert (table.events >= 4).sum() > 50, "rays that meet two lenses"
    assert (table.status == RayStatus.UNDECIDED).mean() < 0.01
    assert_alike(table, text, 1e-4 if precision == "single" else 1e-11)


@pytest.mark.parametrize("precision", ["single", "double"])
def test_mirrors_in_a_table_reflect_as_those_in_text(precision: str) -> None:
    """Of each kind of lens one is plain, one has mirrored faces, and one is a mirror all over."""
    mirrors = {"box": ["+z", "-x"], "max(x^2 + y^2 - k, abs(z) - 0.1)": ["2"]}
    lenses = [
        lens | {"mirror": True if i % 4 == 1 else mirrors.get(lens["surface"], False)} for i, lens in enumerate(mixed())
    ]
    film = {"size": [40, 40], "right": [0.8, 0, 0], "down": [0, -0.8, 0]}
    scene = make_scene(*lenses, film=film, effects=EFFECTS | {"dispersion": False}, numerics={"precision": precision})
    table = trace(scene)
    with written(99):
        text = trace(scene)
    kinds = [kind.mirror for kind in table.kernel.structure.kinds]
    assert len(kinds) > 6
    assert {type(mirror) for mirror in kinds} == {bool, tuple}
    assert (table.events >= 2).sum() > 100
    assert (table.status == RayStatus.UNDECIDED).mean() < 0.02
    assert_alike(table, text, 1e-4 if precision == "single" else 1e-11)
    plain = trace(make_scene(*mixed(), film=film, numerics={"precision": precision}))
    assert (plain.events != table.events).sum() > 80, "mirrors change paths"


@pytest.mark.parametrize(("seed", "count"), [(1, 9), *(pytest.param(i, 9 + i % 22, marks=pytest.mark.slow)
                                                                  for i in range(20, 60))])  # fmt: skip
def test_a_table_traces_random_lenses_as_text_does(seed: int, count: int) -> None:
    scene = random_crowd(seed, count)
    table = trace(scene)
    with written(99):
        text = trace(scene)
    assert table.events.any()
    assert_alike(table, text, 1e-4 if scene.numerics.precision == "single" else 1e-10)


@pytest.mark.parametrize("width", [1, 2, 16])
def test_packets_of_every_width_walk_the_boxes_alike(width: int) -> None:
    """Rays go through a heap of balls one by one, in pairs, and in packets that let them go alone."""
    scene = make_scene(*balls(5, 5, 5), film={"size": [32, 32], "right": [0.7, 0, 0], "down": [0, -0.7, 0]})
    one, other = trace(scene), trace(scene, device=plain_device(width, width))
    assert one.events.mean() > 3.5
    assert one.kernel.structure.width not in (width, 1)
    assert ("open_wide" in other.kernel.text) == (width >= 4)
    np.testing.assert_array_equal(one.status, other.status)
    np.testing.assert_array_equal(one.events, other.events)


def test_rays_through_a_heap_of_balls_end_as_the_twin_says() -> None:
    scene = make_scene(*balls(4, 4, 2), film={"size": [20, 20], "right": [0.6, 0, 0], "down": [0, -0.6, 0]},
                       numerics={"step": 0.003})  # fmt: skip
    raymap, twin = trace(scene), reference.trace(scene)
    assert raymap.kernel.structure.tabled
    assert (raymap.events >= 4).sum() > 100
    short = twin.events <= 4  # each ball makes an error some ten times as large
    np.testing.assert_array_equal(raymap.status.ravel()[short], twin.status[short])
    np.testing.assert_array_equal(raymap.events.ravel()[short], twin.events[short])
    error = np.abs(raymap.st.reshape(-1, 2) - twin.st).max(axis=1)[short]
    assert np.quantile(error, 0.9) < 1e-9


def test_the_text_does_not_grow_with_the_number_of_lenses() -> None:
    nine, many = (kernel_source(make_scene(*balls(*shape))) for shape in ((3, 3, 1), (12, 12, 2)))
    assert many.structure.tabled
    assert nine.text == many.text
    one = kernel_source(make_scene(balls(1, 1, 1)[0]))
    assert len(many.text) < 2 * len(one.text)
    assert not kernel_source(make_scene(*balls(2, 2, 2))).structure.tabled


def test_rays_start_in_and_on_lenses_of_any_number() -> None:
    """Numbers fill more than a byte: rays start in the middle and on the surface of each of 300 balls."""
    lenses = balls(10, 10, 3)
    scene = make_scene(*lenses)
    centres = np.array([lens["centre"] for lens in lenses])
    radii = np.array([lens["r"] for lens in lenses])
    within = trace_rays(scene, centres, np.tile([0.0, 0.0, 1.0], (300, 1)), precision="single")
    assert within.kernel.structure.tabled
    from_above = np.array([lens["centre"][2] for lens in lenses]) == centres[:, 2].max()
    assert (within.events[from_above] == 1).all()
    assert (within.events % 2 == 1).all(), "they leave the ball they start in, and enter and leave others"
    on = centres + radii[:, np.newaxis] * [0.0, 0.0, 1.0]
    for along, events in ((1.0, 0), (-1.0, None)):
        ends = trace_rays(scene, on, np.tile([0.0, 0.0, along], (300, 1)))
        decided = ends.status != RayStatus.UNDECIDED
        assert decided.mean() > 0.95
        if events is not None:
            assert (ends.events[from_above & decided] == events).all()
        assert (ends.events[decided] % 2 == (along < 0)).all()


def test_the_source_may_lie_in_a_lens_of_a_table() -> None:
    lenses = balls(12, 12, 1)
    scene = make_scene(*lenses, source={"kind": "point", "at": [*lenses[137]["centre"][:2], 0.01]},
                       film={"centre": [0.0, 0.0, 0.5], "size": [12, 12]})  # fmt: skip
    raymap = trace(scene)
    assert raymap.kernel.structure.tabled
    assert (raymap.events == 1).mean() > 0.8
    assert (raymap.events % 2 == 1).all()


def test_self_checks_hold_of_a_table() -> None:
    scene = make_scene(*mixed(), film={"size": [24, 24], "right": [0.8, 0, 0], "down": [0, -0.8, 0]})
    found = check_rays(scene, choose(), *film_rays(scene, np.arange(576)))
    assert found.error is None
    assert found.checked > 100
    assert found.failed == 0, found.failures


BROKEN = (
    Fault("eta of another lens", "lens.cl", "(realv)lens->eta_in", "(realv)(lens->number > 4 ? 1.3 : lens->eta_in)"),
    Fault("hierarchy that forgets a child", "boxes.cl", "link.x + 1 - high_first;", "link.x + high_first;"),
    Fault("lone rays take the first box alone", "boxes_lone.cl", "for (int i = 0; i < VW; ++i) {\n    if (!meets",
          "for (int i = 0; i < 1; ++i) {\n    if (!meets"),
    Fault("farther boxes first, and no others", "table.cl", "min_v(hit->found ? hit->t : (realv)REAL_MAX, hit->doubt)",
          "hit->found ? (realv)-1 : (realv)REAL_MAX"),
    Fault("one solid a packet is asked", "table.cl", "within = asking.alive ? NOWHERE : within;", "within = NOWHERE;"),
    Fault("absorption of the first lens", "distinct.cl",
          "is_number_of_lens(at[i], lenses) ? records[(int)at[i]].x : 0;", "records[0].x;"),
)  # fmt: skip


@pytest.mark.parametrize("fault", BROKEN, ids=lambda fault: fault.name)
def test_broken_tables_are_caught(fault: Fault) -> None:
    scene = lit(make_scene(*[one | {"absorption": [0.3 * i, 0.0, 0.0]} for i, one in enumerate(balls(5, 5, 1))],
                           *balls_behind(), effects={"absorption": True}))  # fmt: skip
    whole = trace(scene)
    with broken(fault):
        other = trace(scene)
    assert other.kernel.text != whole.kernel.text
    with written(99):
        text = trace(scene)
    assert_alike(whole, text, 1e-11)
    with pytest.raises(AssertionError, match=r"Arrays are not equal|Not equal to tolerance"):
        assert_alike(other, text, 1e-11)


def lit(scene: Scene) -> Scene:
    """Return a scene with a film that its balls fill."""
    return scene.replace({"film.size": [24, 24], "film.right": [0.7, 0, 0], "film.down": [0, -0.7, 0]})


def balls_behind() -> list[dict[str, Any]]:
    """Return a second layer of balls, which rays meet after others."""
    return [one | {"name": f"c{i}", "centre": [*one["centre"][:2], -0.9]} for i, one in enumerate(balls(3, 3, 1))]


def test_a_table_has_the_records_of_its_lenses_alone() -> None:
    scene = make_scene(*mixed())
    source = kernel_source(scene)
    table = Table(source.structure)
    places = table.places(11)
    assert sorted(places[:, 1].tolist()) == sorted([0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5])
    assert len(set(places[:, 0].tolist())) == 11
