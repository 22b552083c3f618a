"""What `auto` leaves out is proved: tracing with it forced in makes the same map."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scenes import forerunner, make_scene

from lenscl import trace, trace_rays
from lenscl.config import Needs, Scene, study_from_toml
from lenscl.tracing import calls, study_needs, with_needs

SPHERE: dict[str, Any] = {"surface": "sphere", "r": 0.6}


def total_reflection(scene: Scene, **how: Any) -> tuple[bool, str]:
    (call,) = [call for call in calls(scene, **how) if call.effect.key == "total_reflection"]
    return call.is_in, call.why


@pytest.mark.parametrize(
    ("lens", "more", "why"),
    [
        (SPHERE, {}, "rays leave the sphere"),
        (SPHERE | {"n": 2.417}, {"medium": 1.3}, "rays leave the sphere"),
        ({"surface": "ball", "diameter": 1.0, "stretch": [-1.2, 1.2, 1.2], "rotate": [10, 20, 30]}, {}, "sphere"),
        ({"surface": "ellipsoid", "a": 0.5, "b": 1.0, "stretch": [1.6, 0.8, 0.8]}, {}, "sphere"),
        ({"surface": "torus", "n": 1.25}, {"medium": 1.25}, "has the index around it"),
        ({"surface": "torus"}, {"numerics": {"snell": "paraxial"}}, "paraxial rule never"),
        ({"surface": "torus", "absorbs": True}, {}, "is opaque"),
        (SPHERE, {"source": {"kind": "parallel", "direction": [0, 0, -1]}}, "sphere"),
    ],
)
@pytest.mark.parametrize("precision", ["single", "double"])
def test_total_reflection_is_left_out_where_it_cannot_be(
    lens: dict[str, Any], more: dict[str, Any], why: str, precision: str
) -> None:
    scene = make_scene(lens, **more, film={"size": [64, 64]}).replace({"numerics.precision": precision})
    is_in, reason = total_reflection(scene)
    assert not is_in
    assert why in reason
    bare, forced = trace(scene), trace(scene.replace({"effects.total_reflection": "follow"}))
    assert "total_reflection" not in bare.kernel.text.replace("// effects", "")
    assert "follow_total_reflection" in forced.kernel.text or scene.numerics.snell == "paraxial"
    np.testing.assert_array_equal(bare.st, forced.st)
    np.testing.assert_array_equal(bare.status, forced.status)
    np.testing.assert_array_equal(bare.events, forced.events)
    assert (bare.events > 0).sum() > 300


@pytest.mark.parametrize(
    ("lens", "more"),
    [
        (SPHERE | {"n": 0.8}, {}),  # on entry
        (SPHERE | {"stretch": [1.0, 1.0, 1.001]}, {}),
        ({"surface": "ellipsoid", "a": 0.5}, {}),
        (SPHERE, {"source": {"kind": "point", "at": [0.0, 0.0, 0.1]}}),
        (SPHERE, {"source": {"kind": "point", "at": [0.0, 0.0, 0.6]}}),  # on it
        ({"surface": "torus", "absorbs": True}, {"effects": {"absorption": False}}),
        ({"surface": "torus"}, {}),
    ],
)
def test_it_stays_where_that_is_not_proved(lens: dict[str, Any], more: dict[str, Any]) -> None:
    assert total_reflection(make_scene(lens, **more))[0]


def test_rays_of_the_callers_own_may_start_within() -> None:
    scene = make_scene(SPHERE | {"n": 1.9})
    assert total_reflection(scene, rays_given=True)[0]
    rays = trace_rays(scene, [[0.0, 0.55, 0.0]], [[0.0, 0.05, 1.0]])
    assert rays.events[0] == 16  # round and round


@pytest.mark.parametrize(("precision", "width"), [("single", 1e-4), ("double", 1e-12)])
def test_grazing_rays_leave_a_sphere_whatever_rounding_says(precision: str, width: float) -> None:
    """A ray that just enters meets the other side at the critical angle; rounding must not keep it in."""
    scene = make_scene(
        SPHERE, source={"kind": "parallel", "direction": [0, 0, -1]}, numerics={"precision": precision},
        film={"centre": [0.6 * (1 - width), 0.0, 2.5], "right": [1.2 * width, 0, 0], "size": [2000, 1]},
    )  # fmt: skip
    found = trace(scene)
    assert "follow_total_reflection" not in found.kernel.text
    assert set(np.unique(found.events)) <= {0, 2}
    assert (found.events == 2).sum() > 200
    length = np.linalg.norm(found.direction.astype(np.float64), axis=-1)
    np.testing.assert_allclose(length, 1.0, atol=1e-5)


def test_a_study_is_decided_for_all_its_points() -> None:
    text = make_scene(SPHERE).to_toml()
    fact = "total reflection is possible"
    assert fact not in study_needs(study_from_toml(text)).facts
    for axis, is_in in (
        ('"lens.r" = [0.2, 0.4]', False),
        ('"lens.n" = [1.2, 1.5]', False),
        ('"lens.n" = [0.9, 1.5]', True),
        ('"lens.stretch.x" = [1.0, 1.1]', True),
        ('"film.scale" = [1.0, 1.1]', False),
        ('"film.scale" = { linspace = [1.0, 1.1, 5000] }', False),
        ('"lens.r" = { linspace = [0.2, 0.4, 5000] }', True),  # too many to look at
    ):
        assert (fact in study_needs(study_from_toml(f"{text}\n[sweep.axes]\n{axis}\n")).facts) == is_in, axis


def test_a_fact_of_the_study_stays_with_the_scene_and_is_explained() -> None:
    scene = with_needs(make_scene(SPHERE), Needs(facts=frozenset({"total reflection is possible"})))
    is_in, why = total_reflection(scene.replace({"lens.r": 0.3}))
    assert is_in
    assert why == "another point of the study needs it"


def test_what_follows_or_judges_rays_compiles_nothing_that_only_observes() -> None:
    from lenscl.tracing.called import steering

    asked = {"footprint": True, "path_length": True, "fresnel": "polarised", "total_reflection": "end"}
    scene = make_scene({"surface": "torus", "absorbs": True}, effects={**asked, "absorption": True})
    kept = steering(scene).effects
    assert (kept.footprint, kept.path_length, kept.fresnel) == (False, False, False)
    assert (kept.total_reflection, kept.absorption) == ("end", True)
    assert steering(steering(scene)) == steering(scene)
    plain = make_scene({"surface": "torus"})
    assert steering(plain) is plain


@pytest.mark.parametrize("name", ["ellipsoid", "torus", "heart", "bifolia"])
def test_what_is_left_out_of_the_shipped_studies_changes_nothing_where_it_is_forced_in(name: str) -> None:
    scene = forerunner(name, 48)
    out = {call.effect.key: call for call in calls(scene) if not call.is_in and call.asked == "auto"}
    assert out.keys() == {"absorption"}
    assert all(call.why for call in out.values())
    bare, forced = trace(scene), trace(scene.replace({f"effects.{key}": True for key in out}))
    assert "absorption" not in bare.kernel.text
    assert "absorption_interface" in forced.kernel.text
    assert "opaque_interface" in forced.kernel.text
    for array in ("st", "status", "events"):
        np.testing.assert_array_equal(getattr(bare, array), getattr(forced, array))
    assert (forced.transmission == 1.0).all()
    assert (bare.events > 0).sum() > 100
