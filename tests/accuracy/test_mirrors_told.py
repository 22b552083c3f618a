"""What is told of rays that mirrors reflect: self-checks without false alarms, error bounds that hold, explain."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from faults_in_kernels import Fault, broken
from scenes import make_scene

from lenscl import RayStatus, trace
from lenscl.accuracy.bounds import error_map
from lenscl.accuracy.path import explain_pixel
from lenscl.accuracy.selfcheck import check_map
from lenscl.cli import main
from lenscl.config import Scene
from lenscl.reference import oracle
from lenscl.sweep.arrangement import arrangement_spots

BALL = {"surface": "sphere", "r": 0.5, "name": "ball", "mirror": True}
MANGIN = {"surface": "half_ball", "diameter": 1.2, "name": "mangin", "mirror": ["front"], "n": 1.5}
GLASS = {"surface": "ellipsoid", "a": 0.9, "b": 0.8, "c": 0.7, "name": "glass", "n": 1.4, "priority": -1.0}
BLOCK = {"surface": "box", "name": "block", "n": 1.5, "mirror": ["-z"], "rotate": [5.0, 8.0, 0.0]}
SCENES: dict[str, tuple[dict[str, Any], ...]] = {
    "ball": (BALL,),
    "glass before a mirror": (MANGIN,),
    "mirror in glass": (GLASS, BALL | {"centre": [0.1, 0.0, 0.05]}),
    "silvered side of a cemented pair": (BLOCK, BLOCK | {"name": "under", "mirror": False, "centre": [
        float(-np.sin(np.radians(8)) * np.cos(np.radians(5))), float(np.sin(np.radians(5))),
        float(-np.cos(np.radians(8)) * np.cos(np.radians(5)))]}),
    "opaque but for its top": (BLOCK | {"mirror": ["+z"], "absorbs": True},),
}  # fmt: skip


def scene_of(name: str, **numerics: Any) -> Scene:
    return make_scene(
        *SCENES[name],
        picture={"centre": [0.0, 0.0, 6.0], "size": [100, 100]},
        film={"size": [20, 20]},
        numerics=numerics,
    )


@pytest.mark.parametrize("name", SCENES)
def test_self_checks_hold_and_look_at_mirrors(name: str) -> None:
    raymap = trace(scene_of(name))
    found = check_map(raymap)
    assert found.failed == 0, found.failures
    assert found.worst["snell"] < 1.0 or name.startswith("opaque")
    assert found.checked > 0.8 * found.rays > 15


@pytest.mark.parametrize(("precision", "snell"), [("single", "exact"), ("double", "paraxial")])
def test_self_checks_hold_in_every_precision_and_law(precision: str, snell: str) -> None:
    for name in ("glass before a mirror", "mirror in glass"):
        found = check_map(trace(scene_of(name, precision=precision, snell=snell)))
        assert found.failed == 0, found.failures
        assert found.checked > 0.8 * found.rays > 15


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        ("ball", Fault("not quite", "effects/mirrored.cl", "(realv)-2 *", "(realv)NUMBER(-1.9999) *")),
        (
            "ball",
            Fault("let through", "effects/mirror.cl", "mirrored_at(ray, at, scene, &unsure);",
                  "mirrored_at(ray, at, scene, &unsure) & at->leaves;"),
        ),
        (
            "glass before a mirror",
            Fault("faces exchanged", "lens_coat.cl", "return asks & is_coated;",
                  "return asks & not_lane(is_coated);"),
        ),
        (
            "mirror in glass",
            Fault("let through", "effects/mirror_nested.cl", "mirrored_at(ray, at, scene, &unsure);", "(maskv)0;"),
        ),
    ],
)  # fmt: skip
def test_self_checks_see_mirrors_that_are_broken(name: str, fault: Fault) -> None:
    with broken(fault):
        assert check_map(trace(scene_of(name))).failed > 0


@pytest.mark.parametrize("name", ["glass before a mirror", "mirror in glass", "silvered side of a cemented pair"])
def test_error_bounds_hold_where_mirrors_reflect(name: str) -> None:
    raymap = trace(scene_of(name))
    bounds = error_map(raymap).ravel()
    lands = np.isin(raymap.status.ravel(), [RayStatus.PICTURE, RayStatus.OFF_PICTURE]) & (raymap.events.ravel() > 0)
    assert (bounds[lands] >= 0).mean() > 0.9
    pixels = np.random.default_rng(1).choice(np.flatnonzero(lands & (bounds >= 0)), 15, replace=False)
    for pixel, proof in zip(pixels, oracle.prove_pixels(raymap.scene, pixels, radius=1e-18), strict=True):
        assert proof.status == raymap.status.ravel()[pixel]
        assert proof.distance(*raymap.st.reshape(-1, 2)[pixel].tolist()) <= bounds[pixel] < 1e-9


@pytest.mark.parametrize(
    ("name", "kinds", "face", "lens"),
    [
        ("ball", ["mirror"], "surface", "lens.ball"),
        ("glass before a mirror", ["entry", "mirror", "exit"], "front", "lens.mangin"),
        ("mirror in glass", ["entry", "mirror", "exit"], "surface", "lens.ball"),
        ("silvered side of a cemented pair", ["entry", "mirror", "exit"], "-z", "lens.block"),
    ],
)
def test_a_path_is_told_face_by_face(name: str, kinds: list[str], face: str, lens: str) -> None:
    path = explain_pixel(scene_of(name), 9, 10)
    assert [event.kind for event in path.events] == kinds
    (event,) = [event for event in path.events if event.kind == "mirror"]
    assert (event.face, event.lens, event.margin) == (face, lens, None)
    assert event.behind == pytest.approx(event.incidence, abs=1e-9)
    assert path.growth is not None
    assert path.error is not None
    assert path.proof is not None
    assert (path.proof.status, path.proof.events) == (path.status, path.total)


def test_the_commands_speak_of_mirrors(tmp_path: Any) -> None:
    study = tmp_path / "study.toml"
    study.write_text(scene_of("glass before a mirror").to_toml(), encoding="utf-8")
    run = CliRunner().invoke
    told = run(main, ["explain", str(study), "--pixel", "9,10"]).output
    assert "reflected by the mirrored face front" in told
    listed = run(main, ["lenses"]).output
    assert 'faces: "front", "back", "rim"' in listed
    described = {each["name"]: each for each in json.loads(run(main, ["lenses", "--json"]).output)}
    assert described["box"]["faces"] == ["+x", "-x", "+y", "-y", "+z", "-z"]
    assert run(main, ["check", str(study)]).exit_code == 0


def test_check_says_what_becomes_of_mirrors_that_touch_or_are_hidden() -> None:
    def spots(*lenses: dict[str, Any]) -> str:
        return " ".join(text for _, _, text in arrangement_spots(make_scene(*lenses), 0, 1))

    assert "and a mirrored one of them reflects" in spots(*SCENES["silvered side of a cemented pair"])
    hidden = spots(BALL | {"priority": -2.0}, GLASS)
    assert "it bends no light, its mirrored faces reflect none, and is not seen" in hidden
    assert "mirrored" not in spots(BALL | {"mirror": False, "priority": -2.0}, GLASS)
