"""Rays of several wavelengths in one launch: each as if it were alone, and by the closed forms of prisms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from faults_in_kernels import Fault, broken
from numpy.typing import NDArray
from probe import plain_device
from scenes import make_scene

from lenscl import RayStatus, StudyError, reference, trace, trace_rays
from lenscl.config import Scene
from lenscl.effects import wavelengths_of
from lenscl.materials import D_LINE
from lenscl.tracing import calls, count_steps, job, kernel_source, trace_without

F_LINE, C_LINE = 486.1327, 656.2725  # nm, of hydrogen
ENDS = ("st", "status", "events", "origin", "direction")
WEDGE: dict[str, Any] = {"surface": "prism", "side": 1.0, "length": 4.0}
# Peter 1923, as in the catalogue; stated here, so that it reaches beyond the range of his measurements, to the C line
DIAMOND = {"sellmeier": [0.3306, 4.3356, 0.1750**2, 0.1060**2]}


def dispersive(lens: dict[str, Any], asked: Any = 5, **parts: Any) -> Scene:
    effects = {"dispersion": asked} | parts.pop("effects", {})
    return make_scene(lens, effects=effects, film={"size": [37, 29]} | parts.pop("film", {}), **parts)


def assert_alike(found: Any, scene: Scene) -> int:
    """Hold each wavelength's layer against the map of the scene at that wavelength; return how many rays differ."""
    plain = [trace(layer) for layer in scene.layers()]
    assert len(plain) == len(found.status) == len(found.wavelengths)
    for number, each in enumerate(plain):
        for name in (*ENDS, *each.added):
            np.testing.assert_array_equal(getattr(found, name)[number], getattr(each, name), err_msg=f"{number} {name}")
    return int((found.st != found.st[:1]).any(axis=(0, -1)).sum())


@pytest.mark.parametrize(
    ("asked", "wanted"),
    [
        (False, ()),
        ("rgb", (611.4, 549.1, 464.2)),
        (3, (475.0, 545.0, 615.0)),
        (7, (455.0, 485.0, 515.0, 545.0, 575.0, 605.0, 635.0)),
    ],
)
def test_the_wavelengths_are_those_stated(asked: Any, wanted: tuple[float, ...]) -> None:
    assert wavelengths_of(asked) == wanted
    assert dispersive({"surface": "sphere", "n": "BK7"}, asked).wavelengths == wanted


@pytest.mark.parametrize(
    ("lens", "parts"),
    [
        ({"surface": "prism"}, {"numerics": {"precision": "single"}, "effects": {"path_length": True}}),
        ({"surface": "torus"}, {"numerics": {"precision": "mixed"}}),
        ({"surface": "biconvex", "absorption": [0.1, 0.2, 0.3]}, {"effects": {"fresnel": True}}),
        ({"surface": "heart"}, {"source": {"kind": "parallel", "direction": [0.1, 0.0, -1.0]}}),
    ],
)
def test_every_wavelength_is_traced_as_if_it_were_alone(lens: dict[str, Any], parts: dict[str, Any]) -> None:
    scene = dispersive({"n": "SF10"} | lens, medium="water", **parts)
    found = trace(scene)
    assert assert_alike(found, scene) > 100
    assert found.st.shape == (5, 29, 37, 2)
    assert set(found.added) == {"wavelengths", *trace(scene.layers()[0]).added}
    assert found.wavelengths.tolist() == list(scene.wavelengths)
    assert sum(found.counts().values()) == 5 * 29 * 37


def test_films_larger_than_a_tile_have_a_tile_for_all_wavelengths(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = dispersive({"surface": "prism", "n": "F2"}, 7)
    narrow = plain_device(2)  # packets that put no ray aside, for which there are launches of their own
    whole = trace(scene, device=narrow)
    launches = []
    real = job.Job._launch
    monkeypatch.setattr(job.Job, "_launch", lambda *a: (launches.append(a[1][3]), real(*a))[1])
    monkeypatch.setattr(job, "_TILE_PIXELS", 7 * 80)
    tiled = trace(scene, device=narrow)
    assert launches == [74] * 14 + [37]  # two rows of 37, and the last
    for name in ("st", "status", "events"):
        np.testing.assert_array_equal(getattr(tiled, name), getattr(whole, name))


FAULTS = (
    Fault("every wavelength by the first one's index", "effects/dispersion.cl", "{number, item -", "{0, item -"),
    Fault("every wavelength stored as the first", "effects/dispersion.cl", "number * packets * VW}", "0}"),
)


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_wrong_layer_is_noticed(fault: Fault) -> None:
    scene = dispersive({"surface": "prism", "n": "F2"}, 3)
    with broken(fault):
        found = trace(scene)
    with pytest.raises(AssertionError):
        assert_alike(found, scene)


def test_without_dispersive_glass_all_maps_are_the_plain_one() -> None:
    scene = dispersive({"surface": "torus", "n": 1.5}, 4)
    found, plain = trace(scene), trace(scene.at_d_line())
    for name in ENDS:
        for layer in getattr(found, name):
            np.testing.assert_array_equal(layer, getattr(plain, name))
    assert (plain.events > 0).sum() > 150
    assert scene.at_d_line() == scene.replace({"effects.dispersion": False})


def test_the_d_line_is_what_a_scene_without_the_effect_shows() -> None:
    scene = dispersive({"surface": "torus", "n": "BK7"})
    d_line, plain = trace(scene.at_wavelength(D_LINE)), trace(scene.at_d_line())
    for name in ENDS:
        np.testing.assert_array_equal(getattr(d_line, name), getattr(plain, name))
    assert scene.at_wavelength(D_LINE).lenses[0].n == pytest.approx(1.5168, abs=5e-6)


def test_undecided_rays_are_traced_again_at_their_own_wavelength() -> None:
    scene = dispersive(
        {"surface": "bifolia", "n": "SF11"}, 3, film={"size": [96, 96]}, numerics={"precision": "single"}
    )
    found = trace(scene)
    alone = [trace(layer).escalated for layer in scene.layers()]
    assert found.escalated == sum(alone) > 50
    assert len(set(alone)) > 1
    assert_alike(found, scene)
    assert found.counts()[RayStatus.UNDECIDED] == 0


def deviations(scene: Scene, incidence: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return by how much a prism deviates rays that enter it at the middle of a side, (wavelengths, rays), radians.

    They come from the apex's other side, at angles from the side's normal towards the base.
    """
    half = 0.5 * np.radians(scene.lenses[0].values["apex"])
    side = scene.lenses[0].values["side"]
    middle = np.array([0.0, side * np.cos(half) / 6.0, side * np.sin(half) / 2.0])  # of the side at positive z
    normal, along = np.array([0.0, np.sin(half), np.cos(half)]), np.array([0.0, np.cos(half), -np.sin(half)])
    units = -np.cos(incidence)[:, None] * normal + np.sin(incidence)[:, None] * along
    paths = trace_rays(scene, middle - 0.1 * units, units)
    assert (paths.events == 2).all()
    before = np.arctan2(units[:, 1], -units[:, 2])
    behind = np.arctan2(paths.direction[..., 1], -paths.direction[..., 2])
    assert np.abs(paths.direction[..., 0]).max() < 1e-15
    found: NDArray[np.float64] = before - behind
    return found


@pytest.mark.parametrize("material", ["BK7", "SF10", "water"])
def test_a_prism_deviates_least_as_its_closed_form_says_at_every_wavelength(material: str) -> None:
    """delta = 2 asin(n sin(A / 2)) - A, where the ray within is parallel to the base (Born & Wolf, sec. 4.7.2)."""
    scene = dispersive(WEDGE | {"apex": 50.0, "n": material}, 8)
    apex = np.radians(50.0)
    n = np.array([scene.lenses[0].material.index.at(nm) for nm in scene.wavelengths])
    least = np.arcsin(n * np.sin(apex / 2))  # incidence
    delta = deviations(scene, np.concatenate([least, least + 0.02, least - 0.02]))
    np.testing.assert_allclose(np.diagonal(delta[:, :8]), 2 * least - apex, rtol=0, atol=1e-14)
    for around in (delta[:, 8:16], delta[:, 16:]):
        assert (np.diagonal(around) > np.diagonal(delta[:, :8]) + 1e-5).all()
    assert (np.diff(2 * least - apex) < 0).all()  # blue is bent most


def wedge(n: Any, incidence: Any, apex: float) -> Any:
    """Deviation by a wedge, both surfaces by Snell's law."""
    within = np.arcsin(np.sin(incidence) / n)
    return incidence + np.arcsin(n * np.sin(apex - within)) - apex


def test_the_fire_of_diamond_is_that_of_a_wedge_between_the_f_and_c_lines() -> None:
    incidence, apex = np.radians([0.0, 5.0, 20.0, 60.0]), np.radians(20.0)
    scene = dispersive(WEDGE | {"apex": 20.0, "n": DIAMOND}, "rgb")
    indices = {nm: scene.at_wavelength(nm).lenses[0].n for nm in (F_LINE, C_LINE, *scene.wavelengths)}
    lines = [deviations(scene.at_wavelength(nm), incidence) for nm in (F_LINE, C_LINE)]
    fire = wedge(indices[F_LINE], incidence, apex) - wedge(indices[C_LINE], incidence, apex)
    np.testing.assert_allclose(lines[0] - lines[1], fire, rtol=0, atol=1e-14)
    assert (fire > np.radians(0.4)).all()
    n_d = scene.at_wavelength(D_LINE).lenses[0].n
    assert (n_d - 1) / (indices[F_LINE] - indices[C_LINE]) == pytest.approx(55.3, abs=0.1)  # its Abbe number
    # And between those that one launch traces
    found = deviations(scene, incidence)
    wanted = np.array([wedge(indices[nm], incidence, apex) for nm in scene.wavelengths])
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-14)


def test_rays_of_the_callers_own_have_wavelengths_too() -> None:
    scene = dispersive({"surface": "ball", "n": "BK7"}, 3, effects={"path_length": True})
    paths = trace_rays(scene, [[0.0, 0.0, 3.0], [0.2, 0.0, 3.0]], [[0.0, 0.0, -1.0]] * 2)
    assert paths.st.shape == (3, 2, 2)
    assert paths.origin.shape == (3, 2, 3)
    n = np.array([layer.lenses[0].n for layer in scene.layers()])
    diameter = scene.lenses[0].values["diameter"]
    np.testing.assert_allclose(paths.path_length[:, 0], 3.0 - diameter / 2 + n * diameter, rtol=1e-14)
    assert paths.wavelengths.tolist() == [475.0, 545.0, 615.0]
    with pytest.raises(AttributeError, match=r"no wavelengths; trace with effects\.dispersion for it"):
        _ = trace_rays(scene.at_d_line(), [[0.0, 0.0, 3.0]], [[0.0, 0.0, -1.0]]).wavelengths


def test_total_reflection_is_left_out_only_where_no_wavelength_has_it() -> None:
    """A glass that is denser than what is around it at the d line, and thinner at the other end of the spectrum."""

    def total(cauchy: list[float]) -> tuple[bool, str]:
        scene = dispersive({"surface": "sphere", "n": {"cauchy": cauchy}}, medium=1.4)
        (call,) = [call for call in calls(scene) if call.effect.key == "total_reflection"]
        return call.is_in, call.why

    falls = [1.29, 0.04]
    assert total([1.45, 0.01]) == (False, "rays leave the sphere lens at the angle at which they have entered it")
    assert total(falls) == (True, "rays enter lens to a lower index, at 629 nm")
    plain = dispersive({"surface": "sphere", "n": {"cauchy": falls}}, medium=1.4).at_d_line()
    assert plain.lenses[0].n > 1.4
    assert not next(call for call in calls(plain) if call.effect.key == "total_reflection").is_in


def test_auto_never_calls_for_it_and_who_does_not_ask_has_none_of_its_text() -> None:
    scene = make_scene({"surface": "sphere", "n": "SF10"})
    assert scene.effects.dispersion is False
    assert "wavelength" not in kernel_source(scene).text
    text = kernel_source(scene.replace({"effects.dispersion": 64})).text
    assert text.count("effects/dispersion.cl") == 1
    assert text == kernel_source(scene.replace({"effects.dispersion": "rgb"})).text  # how many is an argument


def test_steps_are_counted_over_all_wavelengths_and_the_effect_can_be_left_out() -> None:
    scene = dispersive({"surface": "torus", "n": "SF10"}, 3)
    alone = [count_steps(layer) for layer in scene.layers()]
    together = count_steps(scene)
    assert together.searches == sum(each.searches for each in alone) > 1000
    assert together.steps == sum(each.steps for each in alone)
    without = trace_without(scene, "dispersion")
    np.testing.assert_array_equal(without.st, trace(scene.at_d_line()).st)
    assert "wavelengths" not in without.added


@pytest.mark.parametrize(
    ("asked", "got"),
    [
        (2, "2"),
        (65, "65"),
        (True, "true"),
        (4.5, "4.5; a single wavelength is a list, too, [4.5]"),
        ("auto", '"auto"'),
        ("rbg", '"rbg"; did you mean "rgb"?'),
    ],
)
def test_other_values_are_refused(asked: Any, got: str) -> None:
    with pytest.raises(StudyError) as error:
        dispersive({"surface": "sphere"}, asked)
    says = (
        'effects.dispersion: must be false or "rgb" or a whole number from 3 to 64 or a rising list of 1 to 64 '
        f"wavelengths in nm, got {got}"
    )
    assert error.value.problems == (says,)


def test_whole_numbers_may_be_written_as_floats() -> None:
    assert dispersive({"surface": "sphere"}, 8.0).effects.dispersion == 8
    assert dispersive({"surface": "sphere"}, np.int64(8).item()).wavelengths[0] == 440.0 + 210.0 / 16


def test_a_material_without_data_at_a_wavelength_is_refused_by_its_key() -> None:
    table = {"table": [[500.0, 1.6], [600.0, 1.5]]}
    with pytest.raises(StudyError) as error:
        dispersive({"surface": "sphere", "n": table}, "rgb", medium=table)
    assert [problem.split(":")[0] for problem in error.value.problems] == ["medium.n", "lens.n"]
    assert "known from 500 to 600 nm, not at 611.4 nm" in error.value.problems[0]
    assert 'effects.dispersion = "rgb" needs it there: give data' in error.value.problems[1]
    assert make_scene({"surface": "sphere", "n": table}).lenses[0].n == pytest.approx(1.6 - 0.1 * 0.875618)


def test_every_material_of_the_catalogue_serves_every_number_of_wavelengths() -> None:
    from lenscl.materials import material_names

    for name in material_names():
        for asked in ("rgb", 3, 64):
            scene = dispersive({"surface": "sphere", "n": name}, asked, medium="vacuum")
            assert len({layer.lenses[0].n for layer in scene.layers()}) in (1, len(scene.wavelengths))


def test_the_slow_twin_agrees_at_every_wavelength() -> None:
    scene = dispersive(WEDGE | {"apex": 30.0, "n": "SF10"}, "rgb", film={"size": [12, 10]})
    found = trace(scene)
    for number, layer in enumerate(scene.layers()):
        twin = reference.trace(layer)
        np.testing.assert_array_equal(found.status[number].ravel(), twin.status)
        np.testing.assert_array_equal(found.events[number].ravel(), twin.events)
        np.testing.assert_allclose(found.st[number].reshape(-1, 2), twin.st, rtol=0, atol=1e-11)
    assert (found.events == 2).all(axis=0).sum() > 30
