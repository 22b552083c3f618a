"""Very many lenses that touch or overlap: a ray carries a lens for each colour, and ends as with a bit for each."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from faults_in_kernels import Fault, broken
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import make_scene

from lenscl import RayStatus, StudyError, reference, trace, trace_rays
from lenscl.accuracy.selfcheck import check_rays
from lenscl.config import Scene
from lenscl.device import choose
from lenscl.tracing import RayMap, film_rays, structure
from lenscl.tracing import coloured as coloured_module
from lenscl.tracing.boxes import BoxTree
from lenscl.tracing.coloured import _neighbours, colours_of

PLATE: dict[str, Any] = {
    "surface": "box",
    "a": 2.2,
    "b": 2.2,
    "c": 0.2,
    "name": "plate",
    "centre": [0, 0, -0.1],
    "n": 1.5,
}
EFFECTS: dict[str, Any] = {"absorption": True, "path_length": True, "fresnel": True, "footprint": True}


def on_a_plate(across: int, down: int, **more: Any) -> Scene:
    """Return half balls cemented to a plate, every other one of the plate's index, and bubbles in it."""
    pitch = 2.0 / across
    caps = [
        {"surface": "half_ball", "diameter": 0.9 * pitch, "name": f"c{i}_{j}", "n": 1.5 if (i + j) % 2 else 1.7,
         "centre": [(i + 0.5) * pitch - 1.0, (j + 0.5) * pitch - 1.0, 0.0], "absorption": [0.3 * (i % 3), 0.1, 0.0]}
        for i in range(across) for j in range(down)
    ]  # fmt: skip
    bubbles = [
        {"surface": "sphere", "r": 0.06, "name": f"b{k}", "n": 1.0, "centre": [0.3 * k - 0.6, 0.1 * k - 0.2, -0.1]}
        for k in range(5)
    ]
    film = {"size": [24, 24], "right": [0.75, 0, 0], "down": [0, -0.75, 0]}
    return make_scene(PLATE, *caps, *bubbles, film=film, **more)


def assert_alike(one: RayMap, other: RayMap, within: float) -> None:
    assert one.kernel.structure.tabled != other.kernel.structure.tabled
    np.testing.assert_array_equal(one.status, other.status)
    np.testing.assert_array_equal(one.events, other.events)
    np.testing.assert_allclose(one.st, other.st, rtol=within, atol=within)
    for name, array in one.added.items():
        np.testing.assert_allclose(array, other.added[name], rtol=1e3 * within, atol=1e3 * within, err_msg=name)


@pytest.fixture
def coloured(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Let every scene of lenses that touch have a table."""
    monkeypatch.setattr(structure, "MOST_NESTED", 0)
    return monkeypatch


@pytest.mark.parametrize("precision", ["double", "single"])
def test_colours_tell_as_much_as_bits(precision: str, coloured: pytest.MonkeyPatch) -> None:
    scene = on_a_plate(3, 3, effects=EFFECTS, numerics={"precision": precision})
    table = trace(scene)
    coloured.undo()
    bits = trace(scene)
    assert bits.kernel.structure.nests
    assert table.kernel.structure.colour_count < 6
    assert (table.events >= 3).sum() > 300
    assert (table.status == RayStatus.UNDECIDED).mean() < 0.02
    assert_alike(table, bits, 1e-4 if precision == "single" else 1e-11)


def test_mirrored_faces_on_a_plate_reflect_by_colours_as_by_bits(coloured: pytest.MonkeyPatch) -> None:
    """The plate has a mirrored back, two caps on it mirrored domes, one is a mirror all over, and so is a bubble."""
    plain = on_a_plate(3, 3)
    coats = {
        "lens.plate.mirror": ["-z"],
        "lens.c0_1.mirror": ["front"],
        "lens.c2_2.mirror": ["front"],
        "lens.c1_1.mirror": True,
        "lens.b2.mirror": True,
    }
    scene = plain.replace(coats | {f"effects.{key}": value for key, value in EFFECTS.items()})
    table = trace(scene)
    coloured.undo()
    bits = trace(scene)
    assert len(table.kernel.structure.kinds) == 6
    assert (table.events >= 3).sum() > 200
    assert (table.status == RayStatus.UNDECIDED).mean() < 0.05
    assert_alike(table, bits, 1e-11)
    assert (trace(plain).events != bits.events).mean() > 0.2, "mirrors change paths"


def test_a_picture_in_the_glass_stops_rays_of_a_table(coloured: pytest.MonkeyPatch) -> None:
    scene = on_a_plate(3, 3, effects=EFFECTS, picture={"corner": [-3.0, 3.0, -0.15]})
    table = trace(scene)
    coloured.undo()
    assert table.kernel.structure.stops
    assert (table.events > 0).sum() > 300
    assert_alike(table, trace(scene), 1e-11)


def test_many_lenses_on_a_plate_trace_as_the_twin() -> None:
    scene = on_a_plate(6, 6, numerics={"step": 0.004}).replace({"film.size": [11, 11]})
    assert len(scene.lenses) == 42
    raymap, twin = trace(scene), reference.trace(scene)
    assert raymap.kernel.structure.tabled
    assert raymap.kernel.structure.colour_count < 7
    decided = (raymap.status.ravel() != RayStatus.UNDECIDED) & (twin.status != RayStatus.UNDECIDED)
    short = decided & (twin.events <= 4)
    assert decided.mean() > 0.9
    assert (short & (twin.events >= 2)).sum() > 60
    np.testing.assert_array_equal(raymap.status.ravel()[short], twin.status[short])
    np.testing.assert_array_equal(raymap.events.ravel()[short], twin.events[short])
    error = np.abs(raymap.st.reshape(-1, 2) - twin.st).max(axis=1)[short]
    assert np.quantile(error, 0.9) < 1e-8
    found = check_rays(scene, choose(), *film_rays(scene, np.arange(121)))
    assert found.error is None
    assert found.checked > 60
    assert found.failed == 0, found.failures


def test_rays_start_in_and_on_solids_of_every_colour() -> None:
    """From within a bubble in the plate, and from the face that a cap and the plate share."""
    scene = on_a_plate(7, 7)
    bubble, cap = scene.lenses[-1].centre, scene.lenses[8].centre
    up, down = [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]
    ends = trace_rays(scene, [bubble, bubble, [cap[0], cap[1], 0.05]], [down, up, down])
    assert ends.kernel.structure.colours
    assert ends.events[0] == 2, "out of the bubble, out of the plate"
    assert ends.events[2] in (1, 2), "out of the plate, and into it where the indices differ"
    assert ends.status[0] != RayStatus.UNDECIDED


def test_more_colours_than_a_set_holds_are_refused() -> None:
    heap = [{"surface": "sphere", "name": f"b{i}", "r": 0.5 + 0.01 * i} for i in range(30)]
    with pytest.raises(StudyError, match="overlap too much to be told apart by 24 colours"):
        trace(make_scene(*heap))


BROKEN = (
    Fault("any lens of the colour", "sets_solids.cl", "((ray)->solids[(int)lens->colour] == (maskv)LENS_NUMBER))",
          "(maskv)-1)"),
    Fault("the lens that is crossed is not told", "sets_solids.cl",
          "ray->solids[colour] = crosses ? hit->solids[colour] : ray->solids[colour];", ""),
    Fault("lowest priority first", "sets_solids.cl", "(solids[colour] > medium)",
          "((solids[colour] < medium) | (medium == NOWHERE))"),
    Fault("solids that the ray is in are not asked", "table_nested.cl", "int number = largest_lane(within);",
          "within = NOWHERE; int number = -1;"),
)  # fmt: skip


@pytest.mark.parametrize("fault", BROKEN, ids=lambda fault: fault.name)
def test_broken_sets_are_caught(fault: Fault) -> None:
    scene = on_a_plate(5, 5, source={"kind": "point", "at": [6.0, 0.0, 3.0]}).replace({"film.centre": [1.5, 0.0, 0.8]})
    whole = trace(scene)
    with broken(fault):
        other = trace(scene)
    assert whole.kernel.structure.tabled
    assert other.kernel.text != whole.kernel.text
    differs = (other.status != whole.status) | (other.events != whole.events) | (other.st != whole.st).any(axis=-1)
    assert differs.sum() > 2, differs.sum()


@settings(max_examples=50)
@given(st.lists(st.tuples(*[st.floats(-1, 1)] * 3, st.floats(0, 0.8)), min_size=1, max_size=40))
def test_boxes_that_overlap_are_found(boxes: list[tuple[float, ...]]) -> None:
    rows = np.array(boxes)
    low, high = rows[:, :3], rows[:, :3] + rows[:, 3:]
    beside = _neighbours(low, high)
    for i, own in enumerate(beside):
        meets = ((low[i] <= high) & (low <= high[i])).all(axis=1)
        assert set(np.flatnonzero(meets).tolist()) - {i} <= set(own)
        far = ((low[i] > high + 1e-5) | (low > high[i] + 1e-5)).any(axis=1)
        assert not set(np.flatnonzero(far).tolist()) & set(own)
        assert len(own) == len(set(own))


def test_neighbours_differ_in_colour() -> None:
    scene = on_a_plate(7, 7)
    colours = colours_of(scene)
    assert max(colours) < 6
    assert colours.count(colours[0]) == 1, "the plate touches all others"


def test_a_plate_across_x_is_coloured_with_the_work_of_one_across_z(monkeypatch: pytest.MonkeyPatch) -> None:
    """Boxes that share an x are not all compared with each other: 4096 of them would be 8 million pairs."""
    compared = 0
    walked = BoxTree._walked

    def counted(tree: BoxTree, count: int, first: int, meets: Any) -> Any:
        def counts(asks: Any, *boxes: Any) -> Any:
            nonlocal compared
            compared += len(asks)
            return meets(asks, *boxes)

        return walked(tree, count, first, counts)

    monkeypatch.setattr(BoxTree, "_walked", counted)
    across = np.stack(np.meshgrid(np.arange(64.0), np.arange(64.0), [0.0]), axis=-1).reshape(-1, 3)
    found = []
    for order in ([0, 1, 2], [2, 0, 1], [1, 2, 0]):
        compared, places = 0, across[:, order]
        found.append([sorted(own) for own in _neighbours(places - 0.55, places + 0.55)])
        assert 4096 < compared < 100 * 4096, compared
        colours = coloured_module._coloured((places - 0.55).tobytes(), (places + 0.55).tobytes())
        assert max(colours) == 3
    assert found[0] == found[1] == found[2]
    assert sum(map(len, found[0])) == 2 * (2 * 63 * 64 + 2 * 63**2)


def test_wide_bounds_do_not_use_up_the_colours() -> None:
    """Half balls that touch in a lattice, in bounds three times as wide: each pair of bounds shares a part."""
    at = [[0.2 * i - 0.3, 0.2 * j - 0.3, 0.2 * k] for i in range(4) for j in range(4) for k in range(2)]
    half = {"surface": "max(x^2+y^2+z^2-0.01,-z)", "bounds": [[-0.3] * 3, [0.3] * 3], "at": at}
    film = {"size": [12, 12], "right": [0.4, 0, 0], "down": [0, -0.4, 0]}
    scene = make_scene(half, film=film)
    assert max(colours_of(scene)) == 3
    raymap = trace(scene)
    assert raymap.kernel.structure.colours
    twin = reference.trace(scene)
    decided = (raymap.status.ravel() != RayStatus.UNDECIDED) & (twin.status != RayStatus.UNDECIDED)
    assert (decided & (twin.events >= 2)).sum() > 40
    np.testing.assert_array_equal(raymap.status.ravel()[decided], twin.status[decided])
    np.testing.assert_array_equal(raymap.events.ravel()[decided], twin.events[decided])
