"""Self-checks of solids that lie in one another, touch or overlap: no false alarm, and no fault in them goes unseen."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import numpy as np
import pytest
from faults_in_kernels import Fault, broken, swapped_priorities
from overlapping_scenes import overlapping_scene, solids_of
from probe import plain_device
from scenes import make_scene

from lenscl import RayStatus, trace
from lenscl.accuracy import SelfCheck, check_map
from lenscl.accuracy.selfcheck import check_rays
from lenscl.accuracy.selfcheck.media import AROUND, UNKNOWN, media_at
from lenscl.config import Scene

PRECISIONS = ("double", "single", "mixed")
FILM = {"size": [24, 24]}
CUBE = {"bounds": [[-0.5] * 3, [0.5] * 3]}
HALF = CUBE | {"surface": "max(max(abs(x), abs(y), abs(z)) - 0.4, x - z)", "name": "half"}
OTHER = CUBE | {"surface": "max(max(abs(x), abs(y), abs(z)) - 0.4, z - x)", "name": "other"}
CROWN = {"surface": "conic_singlet", "n": 1.5168, "c1": 0.016, "c2": -0.022, "thickness": 4.0, "diameter": 25.4}
FLINT = {"surface": "conic_singlet", "n": 1.6727, "c1": -0.022, "c2": -0.0078, "thickness": 2.5, "diameter": 25.4}
BALL = {"surface": "sphere", "r": 0.5, "name": "ball"}
BESIDE = {"surface": "sphere", "r": 0.4, "centre": [0.25, 0.1, 0.1], "n": 1.7, "name": "beside"}


def cylinder(radius: float, low: float, high: float, **more: Any) -> dict[str, Any]:
    """Return a lens with an upright cylinder for its solid, turned to show its side."""
    middle, half = (low + high) / 2, (high - low) / 2
    formula = f"max(x^2 + y^2 - {radius**2!r}, abs(z - {middle!r}) - {half!r})"
    return {"surface": formula, "bounds": [[-0.7] * 3, [0.7] * 3], "rotate": [70.0, 0.0, 0.0]} | more


def window(low: float, high: float, n: float) -> dict[str, Any]:
    middle, half = (low + high) / 2, (high - low) / 2
    formula = f"max(max(abs(x), abs(y)) - 0.8, abs(z - {middle!r}) - {half!r})"
    return {"surface": formula, "bounds": [[-1.1] * 3, [1.1] * 3], "n": n}


ARRANGEMENTS: dict[str, dict[str, Any]] = {
    "a bubble": {"lenses": (BALL, BALL | {"r": 0.4, "n": 1.0, "name": "air"})},
    "the same place twice": {"lenses": (BALL, BALL | {"n": 1.7, "name": "again"})},
    "two balls": {"lenses": (BALL | {"priority": 1}, BESIDE), "effects": {"fresnel": True}},
    "a cemented doublet": {
        "lenses": (CROWN | {"centre": [0.0, 0.0, 2.0]}, FLINT | {"centre": [0.0, 0.0, 5.25]}),
        "source": {"kind": "parallel", "direction": [0.0, 0.0, 1.0]},
        "film": FILM | {"centre": [0.0, 0.0, -5.0], "right": [20.0, 0.0, 0.0], "down": [0.0, -20.0, 0.0]},
        "picture": {"corner": [-15.0, 15.0, 100.0], "right": [30.0, 0.0, 0.0], "down": [0.0, -30.0, 0.0]},
    },
    "a cube of two prisms": {"lenses": (HALF, OTHER)},
    "a coin in resin": {
        "lenses": (
            cylinder(0.6, -0.3, 0.3, rotate=[0.0, 0.0, 0.0]),
            cylinder(0.2, -0.03, 0.03, rotate=[20.0, 10.0, 0.0], absorbs=True),
        ),
    },
    "a stack of windows": {"lenses": (window(-0.1, 0.1, 1.5), window(0.1, 0.3, 1.7), window(0.3, 0.5, 1.3))},
    "a liquid in a glass": {
        "lenses": (cylinder(0.5, -0.6, 0.6), cylinder(0.45, -0.4, 0.6, n=1.0), cylinder(0.45, -0.4, 0.4, n=1.33)),
    },
    "a ball set in a ring": {
        "lenses": (
            {"surface": "torus"}, {"surface": "ball", "diameter": 0.4, "centre": [0.7, 0.0, -0.25], "absorbs": True},
        ),
    },
    "a source in both": {"lenses": (BALL, BESIDE), "source": {"kind": "point", "at": [0.2, 0.1, 0.1]}},
}  # fmt: skip
_QUICK = {  # to compile: these are checked in every precision, the others in one of them
    "a bubble": PRECISIONS, "the same place twice": PRECISIONS, "two balls": PRECISIONS,
    "a cemented doublet": ("single",), "a cube of two prisms": ("double",), "a coin in resin": ("mixed",),
    "a stack of windows": ("double",), "a liquid in a glass": ("mixed",), "a ball set in a ring": ("single",),
    "a source in both": ("single",),
}  # fmt: skip


def arrangement(name: str, **more: Any) -> Scene:
    parts = {"film": FILM} | ARRANGEMENTS[name] | more
    lenses = [{"name": f"l{number}"} | lens for number, lens in enumerate(parts.pop("lenses"))]
    return make_scene(*lenses, **parts)


def each_case() -> Iterator[Any]:
    for name in ARRANGEMENTS:
        for precision in PRECISIONS:
            yield pytest.param(name, precision, marks=() if precision in _QUICK[name] else pytest.mark.slow)


@pytest.mark.parametrize(("name", "precision"), list(each_case()))
def test_an_arrangement_raises_no_alarm(name: str, precision: str) -> None:
    raymap = trace(arrangement(name), precision=precision, device=plain_device(1))
    assert raymap.kernel.structure.nests
    assert raymap.counts()[RayStatus.UNDECIDED] <= 3
    check = check_map(raymap)
    assert check.failures == (), [str(failure) for failure in check.failures]
    assert check.failed == 0
    assert check.rays >= 32
    assert check.untold <= 2
    assert check.returned > 0.9 * (check.surfaces - check.rays)  # what single leaves undecided is counted twice
    assert sum(check.unchecked.values()) < 0.02 * check.surfaces
    assert {"length", "surface", "snell", "return", "ahead"} <= check.worst.keys()
    opaque = any(lens.absorbs for lens in raymap.scene.lenses)
    assert ("stop" in check.worst) == opaque == (raymap.counts()[RayStatus.BLOCKED] > 0)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("seeds", [range(30), pytest.param(range(30, 200), marks=pytest.mark.slow)])
def test_overlapping_solids_drawn_at_random_raise_no_alarm(precision: str, seeds: range) -> None:
    """Of the same kinds, so that there are few kernels: places, sizes, indices and the source change."""
    total = SelfCheck()
    for seed in seeds:
        check = check_map(trace(solids_of(seed), precision=precision, device=plain_device(1)))
        assert check.failures == (), (seed, [str(failure) for failure in check.failures])
        total += check
    assert total.failed == 0
    assert total.checked > 20 * len(seeds)
    assert total.surfaces > 2.5 * total.checked
    assert total.returned > 0.95 * total.surfaces
    assert total.untold < 0.01 * total.rays


@pytest.mark.parametrize("seeds", [range(2), pytest.param(range(2, 60), marks=pytest.mark.slow)])
def test_overlapping_solids_of_every_kind_raise_no_alarm(seeds: range) -> None:
    total = SelfCheck()
    for seed in seeds:
        for precision in PRECISIONS if len(seeds) > 2 else (PRECISIONS[seed],):
            raymap = trace(overlapping_scene(seed), precision=precision, device=plain_device(1))
            check = check_map(raymap)
            assert check.failures == (), (seed, precision, [str(failure) for failure in check.failures])
            total += check
    assert total.failed == 0
    assert total.checked > 40 * len(seeds)


def test_given_rays_through_an_arrangement_are_checked() -> None:
    scene = arrangement("two balls")
    rng = np.random.default_rng(4)
    aims, origins = rng.uniform(-0.3, 0.3, (60, 3)), rng.uniform(-0.6, 0.6, (60, 3))
    check = check_rays(scene, plain_device(1), origins, aims - origins)
    assert (check.failed, check.checked) == (0, 60)
    assert check.surfaces > 100


def test_contact_with_a_surface_that_rounding_displaces_raises_no_alarm() -> None:
    """One of two equal balls is written so that F loses nine digits: contact is not told from a gap."""
    formula = "(x + k)**2 - k**2 - 2*k*x + y**2 + z**2 - 0.25"
    noisy = {"surface": formula, "k": 1e4, "bounds": [[-0.65] * 3, [0.65] * 3], "name": "noisy"}
    check = check_map(trace(make_scene(noisy, BALL | {"n": 1.7}, film=FILM), device=plain_device(1)))
    assert check.failed == 0, [str(failure) for failure in check.failures]
    assert check.unchecked["undecided"] == check.untold == check.rays > 20


# Gaps finer than what rounding lets be seen: nothing is said of them, nor of what they hide


@pytest.mark.parametrize("gap", [1e-13, 1e-11])
def test_a_gap_that_rounding_hides_raises_no_alarm(gap: float) -> None:
    """Rays that are totally reflected at it do not meet the prism behind it."""
    far = OTHER | {"surface": f"max(max(abs(x), abs(y), abs(z)) - 0.4, z - x + {gap!r})"}
    check = check_map(trace(make_scene(HALF, far, film=FILM), device=plain_device(1)))
    assert check.failed == 0, [str(failure) for failure in check.failures]
    assert check.checked >= 36
    assert check.unchecked["singular"] > 10


# Media


def test_media_are_those_of_the_solids_that_hold_a_point_by_priority() -> None:
    rng = np.random.default_rng(8)
    seen: set[int] = set()
    for seed in range(12):
        scene = solids_of(seed)
        points = rng.uniform(-0.6, 0.6, (400, 3))
        expected = np.full(len(points), AROUND)
        order = sorted(range(len(scene.lenses)), key=lambda i: (scene.lenses[i].priority, i))
        for number in order:
            lens = scene.lenses[number]
            assert lens.rotate == (0.0, 0.0, 0.0)
            f = _plain(lens.formula, points - np.array(lens.centre), lens.values)
            expected[f < 0] = number
        found = media_at(scene, points, 2.0**-52)
        np.testing.assert_array_equal(found, expected)
        seen |= set(found.tolist())
        assert np.mean(media_at(scene, points, 2.0**-23) == expected) > 0.99
    assert seen == {AROUND, 0, 1, 2}


def _plain(formula: str, points: Any, values: Any) -> Any:
    x, y, z = points.T
    if formula == "sphere":
        return x**2 + y**2 + z**2 - values["r"] ** 2
    if formula == "torus":
        return (np.hypot(x, y) - values["R"]) ** 2 + z**2 - values["r"] ** 2
    return (x / values["a"]) ** 2 + (y / values["b"]) ** 2 + (z / values["c"]) ** 2 - 1.0


def test_a_medium_is_unknown_where_rounding_hides_a_sign_that_decides() -> None:
    """On the ball's surface: outside the other solid, inside one of higher priority, inside one of lower."""
    points = np.array([[0.5, 0.0, 0.0]])
    for priority, expected in ((1.0, 1), (-1.0, UNKNOWN)):
        large = {"surface": "sphere", "r": 0.8, "priority": priority, "name": "large"}
        assert media_at(make_scene(BALL, large), points, 2.0**-52).tolist() == [expected]
    away = {"surface": "sphere", "r": 0.1, "centre": [0.0, 0.0, -1.0], "name": "away"}
    assert media_at(make_scene(BALL, away), points, 2.0**-52).tolist() == [UNKNOWN]
    beside = np.array([[0.5 + 1e-6, 0.0, 0.0]])
    assert media_at(make_scene(BALL, away), beside, 2.0**-52).tolist() == [AROUND]
    assert media_at(make_scene(BALL, away), beside, 2.0**-52, 1e-5).tolist() == [UNKNOWN]


# Each fault is in every kernel: that of the map, and that which follows rays

_SEVERAL = "(hit.crossed & (hit.crossed - (maskv)1)) != (maskv)0"
_AROUND = f"at.n_after = {_SEVERAL} ? (realv)scene->n_medium : index_of(scene, after);"
_BESIDE = "const maskv beside = root.found & not_lane(first) & not_lane(low > hit->high);"
_APART = "(not_lane(hit->found) | (high < hit->low))"
_PASSES = "meets & (before == after);"
_N_AFTER = "at.n_after = index_of(scene, after);"
FAULTS: dict[str, tuple[str, str, tuple[tuple[str, str, str], ...]]] = {  # arrangement, law, and what is replaced
    "contact as a gap": (
        "the same place twice", "contact",
        (("lens_nested.cl", _BESIDE, "const maskv beside = (maskv)0;"),
         ("lens_nested.cl", _APART, "(not_lane(hit->found) | (t < hit->t))"))),
    "index of the medium around behind contact": (
        "the same place twice", "snell",
        (("trace_nested.cl", _N_AFTER, _AROUND),)),
    "index of the lens whose surface it is": (
        "a bubble", "snell", (("trace_nested.cl", _N_AFTER, "at.n_after = index_of(scene, hit.lens);"),)),
    "an event where no medium changes": ("two balls", "snell", (("trace_nested.cl", _PASSES, "(maskv)0;"),)),
    "media told apart by index": (
        "two of one index", "ahead",
        (("trace_nested.cl", _PASSES, "meets & (index_of(scene, before) == index_of(scene, after));"),)),
    "one solid at a time": (
        "a bubble", "ahead",
        (("lens_nested.cl", "ray->alive & (inside | returns);",
          "ray->alive & (ray->inside == (maskv)0 ? returns : inside);"),)),
    "the farther surface first": (
        "a bubble", "ahead", (("lens_nested.cl", "(high < hit->low));", "(low > hit->high));"),)),
    "an opaque lens entered": (
        "an opaque ball", "stop",
        (("effects/opaque_nested.cl", "at->lanes & (enters | leaves)", "at->lanes & leaves"),)),
    "opaque by the surface met": (
        "an opaque ball", "stop",
        (("effects/opaque_nested.cl", "lens_absorbs(scene, at->after, 0)", "lens_absorbs(scene, at->lens, 0)"),)),
    "the path's last event forgotten": ("two balls", "snell", (("trace_nested.cl", "-ray.passed)", "(realv)0)"),)),
}  # fmt: skip
ARRANGEMENTS_FOR_FAULTS: dict[str, tuple[dict[str, Any], ...]] = {
    "two of one index": (BALL, BESIDE | {"n": 1.5}),
    "an opaque ball": (BALL | {"priority": 1}, BESIDE | {"absorbs": True, "r": 0.3, "centre": [0.1, 0.0, -0.4]}),
}


@pytest.mark.parametrize("which", FAULTS)
def test_a_fault_is_caught_by_the_law_that_it_breaks(which: str) -> None:
    name, law, changes = FAULTS[which]
    lenses = ARRANGEMENTS_FOR_FAULTS.get(name) or ARRANGEMENTS[name]["lenses"]
    scene = make_scene(*lenses, film=FILM)
    assert check_map(trace(scene, device=plain_device(1))).failed == 0
    with ExitStack() as stack:
        for change in changes:
            stack.enter_context(broken(Fault(which, *change)))
        check = check_map(trace(scene, device=plain_device(1)))
    assert check.failed > 5
    assert check.worst[law] > (1.5 if law == "contact" else 1e6), check.worst
    assert "all hold" not in check.summary()


@pytest.mark.parametrize("name", ["a bubble", "two balls"])
def test_swapped_priorities_are_caught(name: str) -> None:
    with swapped_priorities():
        check = check_map(trace(arrangement(name), device=plain_device(1)))
    assert check.failed > 20
    assert check.worst["ahead"] > 1e6
    assert check.worst["snell"] > 1e6
    assert {failure.cause for failure in check.failures} == {"media"}
    names = " and ".join(f"lens.{lens.name}" for lens in arrangement(name).lenses)
    assert f"{names} overlap, touch or lie in one another there" in next(check.warnings())


def test_a_gap_taken_for_contact_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """A gap of 1e-8 between faces of two balls that nearly fill each other: a ray has two more events."""
    scene = make_scene(BALL, BALL | {"r": 0.5 - 1e-8, "n": 1.7, "name": "again"}, film=FILM)
    assert check_map(trace(scene, device=plain_device(1))).failed == 0
    slope = " * spread) / slope;\n  const maskv grazes"
    wide = Fault("wide", "lens_nested.cl", slope, slope.replace(";", " + (realv)NUMBER(1e-7);"))
    near = Fault(
        "near", "lens_nested.cl", "#define CONTACT ((realv)NUMBER(5.7e-14))", "#define CONTACT ((realv)NUMBER(1e-6))"
    )
    with broken(wide), broken(near):
        check = check_map(trace(scene, device=plain_device(1)))
    assert check.failed > 20
    assert check.worst["ahead"] > 10.0


# Pictures on and in solids

PAPERWEIGHT = make_scene(
    {"surface": "plano_convex", "R": 1.0, "thickness": 1.0, "diameter": 2.0, "centre": [0.0, 0.0, -0.5]},
    source={"kind": "point", "at": [0.0, 0.0, -8.0]},
    film={"corner": [-0.05, 0.05, -4.0], "right": [0.1, 0.0, 0.0], "down": [0.0, -0.1, 0.0], "size": [16, 16]},
    picture={"corner": [-1.0, 1.0, 0.0], "right": [2.0, 0.0, 0.0], "down": [0.0, -2.0, 0.0]},
)  # its flat face lies on the picture
WITHIN = PAPERWEIGHT.replace({"picture.corner": [-1.0, 1.0, -0.3]})
CUT = make_scene(
    BALL, BESIDE, film=FILM, picture={"corner": [-0.5, 0.4, 0.1], "right": [0.9, 0.0, 0.3], "down": [0.0, -0.7, 0.0]},
    effects={"total_reflection": "follow"},
)  # fmt: skip


@pytest.mark.parametrize(("scene", "precision"), [
    (PAPERWEIGHT, "double"), (PAPERWEIGHT, "single"), (WITHIN, "mixed"), (CUT, "double"), (CUT, "single"),
])  # fmt: skip
def test_a_picture_on_or_in_solids_raises_no_alarm(scene: Scene, precision: str) -> None:
    raymap = trace(scene, precision=precision, device=plain_device(1))
    assert raymap.kernel.structure.stops
    assert raymap.counts()[RayStatus.PICTURE] > 40
    check = check_map(raymap)
    assert check.failures == (), [str(failure) for failure in check.failures]
    assert check.checked > 40
    assert check.returned >= check.surfaces - check.rays - 2
    assert {"snell", "return", "ahead", "place"} <= check.worst.keys()


@pytest.mark.parametrize(("law", "scene", "changes"), [
    ("contact", PAPERWEIGHT, (
        ("(before | touched);", "before;"),
        ("const maskv unknown = travels", "const maskv unknown = (maskv)0 & travels"))),
    ("ahead", PAPERWEIGHT, (
        ("const maskv behind = hit->found &", "const maskv behind = (maskv)0 & hit->found &"),
        ("const maskv before = not_lane(hit->found)", "const maskv before = (maskv)-1"))),
    ("ahead", CUT, (
        ("const maskv is_on =", "const maskv is_on = (maskv)0 &"),
        ("const maskv may_be_on =", "const maskv may_be_on = (maskv)0 &"))),
], ids=["behind the face", "before the face", "not at all"])  # fmt: skip
def test_a_picture_met_out_of_turn_is_caught(law: str, scene: Scene, changes: tuple[tuple[str, str], ...]) -> None:
    with ExitStack() as stack:
        for old, new in changes:
            stack.enter_context(broken(Fault(law, "picture_stops.cl", old, new)))
        check = check_map(trace(scene, device=plain_device(1)))
    assert check.failed > 10
    assert check.worst[law] > (1.5 if law == "contact" else 1e6), check.worst
