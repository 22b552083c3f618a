"""Self-checks of rays that end on the way: opaque lenses raise no alarm, faults there are caught by the right law."""

from __future__ import annotations

from contextlib import ExitStack
from typing import Any

import numpy as np
import pytest
from faults_in_kernels import Fault, broken
from probe import plain_device
from random_scenes import random_scene
from scenes import make_scene

from lenscl import RayStatus, trace, trace_rays
from lenscl.accuracy import SelfCheck, check_map
from lenscl.accuracy.path import explain_pixel
from lenscl.accuracy.selfcheck import check_rays
from lenscl.config import Scene

FILM = {"size": [24, 24]}
OPAQUE = {"surface": "sphere", "r": 0.5, "absorbs": True, "name": "stop"}
CLEAR = {"surface": "ellipsoid", "a": 0.6, "b": 0.5, "c": 0.4, "name": "glass"}
BESIDE = {"centre": [0.45, 0.0, 0.95]}  # of a stop: it hides a part of the glass
QUARTIC = {"surface": "x^4 + y^4 + z^4 - 0.1", "bounds": [[-0.7] * 3, [0.7] * 3], "absorbs": True, "name": "stop"}
WITHIN = {"kind": "point", "at": [0.1, 0.05, 0.1]}
SMALL_STOP = {"surface": "torus", "R": 0.45, "r": 0.08, "absorbs": True, "name": "stop", "centre": [0.0, 0.0, 0.8]}

SCENES: dict[str, dict[str, Any]] = {
    "a sphere alone": {"lenses": (OPAQUE,)},
    "a rod": {"lenses": ({"surface": "rod", "absorbs": True},)},
    "a torus": {"lenses": ({"surface": "torus", "absorbs": True},), "numerics": {"precision": "single"}},
    "flat faces": {"lenses": ({"surface": "prism", "absorbs": True},), "numerics": {"precision": "mixed"}},
    "an expression": {"lenses": (QUARTIC,), "numerics": {"method": "interval"}},
    "an index below the medium's": {"lenses": (OPAQUE | {"n": 1.0},), "medium": 1.5},
    "beside glass": {"lenses": (OPAQUE | BESIDE, CLEAR | {"n": 2.2}), "effects": {"fresnel": "polarised"}},
    "beside glass of less than the medium": {
        "lenses": (OPAQUE | BESIDE | {"n": 1.0}, CLEAR | {"n": 1.2}), "medium": 1.6,
        "effects": {"total_reflection": "end", "fresnel": "split", "path_length": True},
    },
    "behind glass": {
        "lenses": (CLEAR | {"centre": [0, 0, 0.9], "n": 1.7}, OPAQUE | {"r": 0.3, "centre": [0, 0, -0.4]}),
    },
    "the source within": {"lenses": (OPAQUE, CLEAR | {"centre": [0, 0, -1.2]}), "source": WITHIN},
    "the source within glass": {
        "lenses": (CLEAR | {"n": 2.4}, SMALL_STOP | {"centre": [0, 0, 1.0]}), "source": WITHIN,
        "effects": {"total_reflection": "end"}, "numerics": {"precision": "single"},
    },
    "no more events allowed": {"lenses": (OPAQUE | BESIDE, CLEAR), "numerics": {"max_events": 1}},
    "the paraxial rule": {"lenses": (OPAQUE | BESIDE | {"n": 0.5}, CLEAR), "numerics": {"snell": "paraxial"}},
    "the march": {"lenses": (OPAQUE | BESIDE, CLEAR), "numerics": {"method": "march", "step": 0.05}},
    "wavelengths": {
        "lenses": (SMALL_STOP, CLEAR | {"n": "SF11"}),
        "effects": {"dispersion": 3, "antialias": "edges", "path_length": True},
    },
    "parallel light": {
        "lenses": (SMALL_STOP, CLEAR), "source": {"kind": "parallel", "direction": [0.05, 0.02, -1.0]},
    },
    "absorption switched off": {"lenses": (OPAQUE,), "effects": {"absorption": False}},
}  # fmt: skip


def scene_of(name: str) -> Scene:
    parts = dict(SCENES[name])
    return make_scene(*parts.pop("lenses"), film=FILM, **parts)


@pytest.mark.parametrize("name", SCENES)
def test_opaque_lenses_raise_no_alarm_and_are_checked(name: str) -> None:
    scene = scene_of(name)
    raymap = trace(scene, device=plain_device(1))
    blocked = raymap.counts()[RayStatus.BLOCKED]
    assert (blocked > 15) == (name != "absorption switched off")
    check = check_map(raymap)
    assert check.failures == (), [str(failure) for failure in check.failures]
    assert check.failed == 0
    assert check.untold == 0
    assert check.rays >= 14
    assert check.returned > 0.6 * check.surfaces
    assert ("stop" in check.worst) == (blocked > 0)
    np.testing.assert_allclose(np.linalg.norm(raymap.direction, axis=-1), 1.0, atol=20 * np.finfo(raymap.st.dtype).eps)


def test_given_rays_that_are_blocked_are_checked() -> None:
    scene = scene_of("beside glass")
    rng = np.random.default_rng(3)
    aims = rng.uniform(-0.4, 0.4, (60, 3)) + np.where(np.arange(60)[:, None] % 2, BESIDE["centre"], [0.0, 0.0, 0.0])
    origins = rng.normal(loc=[0.0, 0.0, 5.0], size=(60, 3))
    paths = trace_rays(scene, origins, aims - origins, device=plain_device(1))
    assert (paths.status == RayStatus.BLOCKED).sum() > 25
    check = check_rays(scene, plain_device(1), origins, aims - origins)
    assert (check.failed, check.checked) == (0, 60)


@pytest.mark.parametrize("seeds", [range(6), pytest.param(range(6, 400), marks=pytest.mark.slow)])
def test_random_scenes_raise_no_alarm(seeds: range) -> None:
    total = SelfCheck()
    ended: set[int] = set()
    for seed in seeds:
        raymap = trace(random_scene(seed), device=plain_device(1))
        ended |= set(np.unique(raymap.status).tolist())
        check = check_map(raymap)
        assert check.failures == (), (seed, [str(failure) for failure in check.failures])
        total += check
    assert total.failed == 0
    assert total.checked > 20 * len(seeds)
    assert {RayStatus.PICTURE, RayStatus.BLOCKED} <= ended


# Each fault is put into the kernel that follows rays, and breaks what becomes of a blocked ray

FAULTS: dict[str, tuple[str, str, tuple[tuple[str, str, str], ...]]] = {  # scene, law, and what is replaced
    "goes on": (
        "beside glass", "stop", (("effects/opaque.cl", "at->lanes & (lens_absorbs", "(maskv)0 & (lens_absorbs"),)),
    "ends on clear glass": ("behind glass", "stop", (("effects/opaque.cl", "0) != (realv)0)", "0) == (realv)0)"),)),
    "bent": ("a sphere alone", "stop", (("effects/opaque.cl", "at->incident,", "ray->direction,"),)),
    "not unit": (
        "an index below the medium's", "length", (("effects/opaque.cl", "at->incident,", "ray->direction,"),)),
    "beside the surface": (
        "a sphere alone", "surface",
        (("lens.cl", "at3(search.origin, search.direction, root.t)",
          "at3(search.origin, search.direction, root.t * (realv)NUMBER(1.001))"),)),
    "on its far side": (
        "a sphere alone", "ahead",
        (("ahead_chord.cl", "-(b + reach) * inverse;", "(reach - b) * inverse;"),
         ("lens.cl", "return (astray <= (realv)0) |", "return (maskv)-1 | (astray <= (realv)0) |"))),
    "through a nearer lens": ("beside glass", "ahead", (("lens.cl", "(t < hit->t)", "(t > hit->t)"),)),
}  # fmt: skip


@pytest.mark.parametrize("which", FAULTS)
def test_a_fault_on_an_opaque_lens_is_caught_by_the_law_that_it_breaks(which: str) -> None:
    name, law, changes = FAULTS[which]
    raymap = trace(scene_of(name), device=plain_device(1))
    assert check_map(raymap).failed == 0
    with ExitStack() as stack:
        for change in changes:
            stack.enter_context(broken(Fault(which, *change)))
        check = check_map(raymap)
    assert check.failed > 5
    assert check.worst[law] > 1e6, check.worst


def test_directions_are_unit_whatever_ends_a_ray() -> None:
    """In maps and paths; a blocked ray keeps the direction in which it came, whatever other lenses there are."""
    seen: set[int] = set()
    for name in ("beside glass of less than the medium", "the source within", "no more events allowed"):
        scene = scene_of(name)
        raymap = trace(scene, device=plain_device(1))
        seen |= set(np.unique(raymap.status).tolist())
        np.testing.assert_allclose(np.linalg.norm(raymap.direction, axis=-1), 1.0, atol=1e-14)
        if scene.source.at is not None:
            first = (raymap.status == RayStatus.BLOCKED) & (raymap.events == 1)
            way = raymap.origin[first] - scene.source.at
            assert first.sum() > 10
            np.testing.assert_allclose(
                raymap.direction[first], way / np.linalg.norm(way, axis=1, keepdims=True), atol=1e-13
            )
    on_source = make_scene(OPAQUE, film={"centre": [0.0, 0.0, 4.0], "size": [3, 3]})  # whose middle pixel is the source
    doubtful = make_scene({"surface": "(x^2 + y^2 + z^2 - 0.25)^2", "bounds": [[-0.6] * 3, [0.6] * 3]}, film=FILM)
    for scene in (on_source, doubtful):
        raymap = trace(scene, device=plain_device(1))
        assert raymap.counts()[RayStatus.UNDECIDED] > 0
        np.testing.assert_allclose(np.linalg.norm(raymap.direction, axis=-1), 1.0, atol=1e-14)
        seen |= set(np.unique(raymap.status).tolist())
    assert {RayStatus.BLOCKED, RayStatus.TOTAL_REFLECTION, RayStatus.TRAPPED, RayStatus.UNDECIDED} <= seen


def test_a_blocked_ray_is_explained_as_one_that_nothing_bends() -> None:
    scene = make_scene(OPAQUE | {"n": 1.2}, medium=1.5, film={"size": [33, 33]})
    path = explain_pixel(scene, 16, 17, device=plain_device(1))
    (event,) = path.events
    assert (path.status, event.kind, event.behind) == (RayStatus.BLOCKED, "entry", None)
