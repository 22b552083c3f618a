"""What self-checks say: an unknown is no success, and a failure names its likely cause."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from faults_in_kernels import Fault, broken
from probe import plain_device
from scenes import make_scene

from lenscl import RayStatus, trace
from lenscl.accuracy import Failure, SelfCheck, check_map
from lenscl.accuracy.selfcheck.hits import Tolerance, candidates, hits_of
from lenscl.accuracy.selfcheck.legs import Clear, obstacles
from lenscl.accuracy.selfcheck.sample import sampled
from lenscl.accuracy.selfcheck.tally import Tally
from lenscl.config import Scene
from lenscl.device import Device

FILM = {"size": [32, 32]}
NARROW = {"size": [40, 40], "right": [0.8, 0.0, 0.0], "down": [0.0, -0.8, 0.0]}
EPS = 2.0**-52
TOUCHED = {"surface": "(x^2 + y^2 + z^2 - 0.25)^2", "bounds": [[-0.6] * 3, [0.6] * 3]}  # F changes no sign: undecided
NOISY = {"surface": "(x + k)**2 - k**2 - 2*k*x + y**2 + z**2 - 0.25", "bounds": [[-0.65] * 3, [0.65] * 3], "n": 1.5}
QUARTIC = {"surface": "x^4 + y^4 + z^4 - 0.3", "bounds": [[-0.8] * 3, [0.8] * 3]}


def device() -> Device:
    return plain_device(1)


def checked(scene: Scene, **asked: str) -> SelfCheck:
    return check_map(trace(scene, device=device(), **asked))


# An unknown is no success


@pytest.mark.parametrize("k", [1e3, 1e5])
def test_the_rounding_of_f_raises_no_alarm(k: float) -> None:
    """F loses ten digits of its last at k = 1e5, and a ray comes back by another rounding of it."""
    lens = {**NOISY, "k": k}
    for found in (
        checked(make_scene(lens, film=FILM)),
        checked(make_scene({**lens, "absorbs": True}, film=FILM)),
    ):
        assert not found.failed, found.summary()
        assert found.checked == found.rays > 40
        assert found.returned >= found.rays
        assert 1e-3 < found.worst["return"] < 1.0  # a bound that allows anything would show nothing


def test_where_rounding_hides_the_lens_nothing_is_shown() -> None:
    found = checked(make_scene({**NOISY, "k": 1e7}, film=FILM))
    assert found.rays > 40
    assert not found.checked
    assert not found.failed
    assert "nothing is shown" in found.summary()


def test_a_path_that_the_rounding_of_f_decides_is_no_fault_of_the_map() -> None:
    """One ray of the sample is totally reflected or not by noise in F, in the map otherwise than alone."""
    lens = {**NOISY, "surface": "(x + k)**2 - k**2 - 2*k*x + y**4 + z**4 - 0.25", "bounds": [[-0.9] * 3, [0.9] * 3]}
    turned = {**lens, "k": 1e5, "n": 2.4, "rotate": [20.0, 30.0, 10.0]}
    found = checked(make_scene(turned, film=NARROW))
    assert found.rays > 40
    assert not found.failed, found.failures


def test_only_what_has_a_bound_is_compared() -> None:
    tally = Tally(lambda ray: (0, ray))
    residual = np.array([0.0, 0.0, 1.0, np.nan, 0.5, np.nan, np.inf])
    bound = np.array([np.nan, 0.0, np.inf, np.inf, 1.0, 1.0, 1.0])
    compared = tally.note("snell", np.arange(7), 1, residual, bound)
    np.testing.assert_array_equal(compared, [False, True, False, False, True, True, True])
    assert sorted(tally.failures) == [5, 6]
    assert tally.failed == 2
    exact = Tally(lambda ray: (0, ray))
    assert exact.note("snell", np.arange(1), 1, np.array([1e-300]), np.zeros(1)).all()
    assert exact.failed == 1  # no bound at all is left
    assert not exact.note("place", np.arange(2), 1, np.zeros(2), np.full(2, np.nan)).any()
    assert exact.worst.keys() == {"snell"}


BOX = [[-0.9] * 3, [0.9] * 3]  # that covers the surface of the ball beside it
UNKNOWN = {
    "no value below z = 0.2": {"surface": "x^2 + y^2 + (z - 0.5)^2 - 0.04 + 0.01*sqrt(z - 0.2)", "bounds": BOX},
    "a value, and no bound of it": NOISY | {"k": 1e7, "bounds": BOX},
}


@pytest.mark.parametrize("why", UNKNOWN)
def test_a_lens_of_which_nothing_is_known_takes_no_point_from_another(why: str) -> None:
    ball = {"surface": "sphere", "r": 0.2, "centre": [0.0, 0.0, -0.4], "name": "ball"}
    rng = np.random.default_rng(5)
    across = rng.normal(size=(40, 3))
    points = 0.2 * across / np.linalg.norm(across, axis=1, keepdims=True) + ball["centre"]
    unknown = UNKNOWN[why] | {"name": "unknown"}
    for lenses in ((unknown, ball), (ball, unknown)):
        scene = make_scene(*lenses)
        hits = hits_of(scene, points, EPS, Tolerance())
        assert {scene.lenses[number].name for number in hits.lens} == {"ball"}
        assert np.all(hits.value <= hits.bound)


def test_a_point_where_two_lenses_touch_may_be_of_either() -> None:
    balls = ({"surface": "sphere", "r": 0.5}, {"surface": "sphere", "r": 0.5, "centre": [0.0, 0.0, 1.0]})
    scene = make_scene(*(ball | {"name": name} for ball, name in zip(balls, "ab", strict=True)))
    first, second, both = candidates(scene, np.array([[0.0, 0.0, 0.5], [0.5, 0.0, 0.0]]), EPS, Tolerance())
    assert both.tolist() == [True, False]
    assert {int(first.lens[0]), int(second.lens[0])} == {0, 1}
    assert first.lens[1] == 0


def test_a_leg_on_which_f_is_unknown_is_not_called_free() -> None:
    pin = {"surface": "max(0.04 - sqrt(0.01 - x^2 - y^2), abs(z) - 0.5)", "bounds": [[-1] * 3, [1] * 3]}
    scene = make_scene(pin)
    legs = Clear(
        origin=np.array([[0.5, 0.0, 2.0], [3.0, 0.0, 2.0], [0.05, 0.0, 2.0]]),
        direction=np.tile([0.0, 0.0, -1.0], (3, 1)),
        length=np.full(3, np.inf), within=np.full(3, -1), allowed=np.zeros(3),
    )  # fmt: skip
    depth, bound = obstacles(scene, legs, EPS)
    assert np.isinf(bound[0])  # through the box, where F has no value
    assert (depth[1], bound[1]) == (0.0, 1.0)  # past it
    assert depth[2] > bound[2]  # through the solid


def test_undecided_rays_show_nothing() -> None:
    scene = make_scene(TOUCHED, film=FILM)
    raymap = trace(scene, device=device())
    assert raymap.counts()[RayStatus.UNDECIDED] > 60
    check = check_map(raymap)
    assert check.rays == check.untold == check.unchecked["undecided"] > 40
    assert check.summary() == (
        f"self-checks: none of {check.rays} rays could be checked: all are undecided; nothing is shown"
    )
    assert not raymap.events[
        raymap.status == RayStatus.UNDECIDED
    ].any()  # as many as can be meet a lens, for all we know
    assert "hold" not in check.summary()


def test_rays_that_a_map_leaves_undecided_are_no_checked_ones() -> None:
    raymap = trace(make_scene({"surface": "sphere", "r": 0.6}, film=FILM), device=device())
    whole = check_map(raymap)
    assert whole.untold == 0
    assert "all hold: " in whole.summary()
    pixels = sampled(raymap.events)
    status = raymap.status.copy()
    status.flat[pixels[: len(pixels) // 3]] = RayStatus.UNDECIDED
    some = check_map(replace(raymap, status=status))
    assert some.failed == 0
    assert 0 < some.untold == some.unchecked["undecided"] < some.rays / 2
    assert f"all hold: {some.checked} of {some.rays} rays checked, " in some.summary()
    status.flat[pixels[: len(pixels) * 3 // 4]] = RayStatus.UNDECIDED
    few = check_map(replace(raymap, status=status))
    expected = f"nothing is shown, for only {few.checked} of {few.rays} rays could be checked (these hold): "
    assert expected in few.summary()
    assert "all hold" not in few.summary()


def test_what_single_precision_leaves_undecided_is_followed_in_double(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = make_scene({"surface": "torus", "stretch": [1.0, 1.0, 1e-4], "rotate": [50.0, 0.0, 0.0]}, film=FILM)
    raymap = trace(scene, precision="single", device=device())
    never = "const maskv undecided = (sizeof(real) == 4 ? *travels : (maskv)0) | *travels &"
    fault = Fault("undecided in single", "trace.cl", "const maskv undecided = *travels &", never)
    with broken(fault):
        again = check_map(raymap)
    assert raymap.counts()[RayStatus.UNDECIDED] == 0
    assert again.failed == 0
    assert again.rays == again.checked > 40
    assert again.surfaces >= 2 * again.rays


def test_findings_of_before_are_read_and_count_their_undecided_rays() -> None:
    failure = {"row": 1, "column": 2, "event": 3, "law": "snell", "residual": 1.0, "bound": 0.1, "wavelength": None}
    old = {"rays": 68, "surfaces": 68, "returned": 0, "unchecked": {"undecided": 68}, "worst": {"length": 0.1},
           "failed": 0, "failures": [], "error": None}  # fmt: skip
    check = SelfCheck.from_json(old)
    assert check.untold == 68
    assert "none of 68 rays could be checked: all are undecided" in check.summary()
    both = check + SelfCheck.from_json({**old, "unchecked": {}, "failed": 1, "failures": [failure]})
    assert (both.rays, both.checked) == (136, 68)
    assert "1 FAILED: 68 of 136 rays checked, " in both.summary()
    assert both.failures[0].cause is None
    assert SelfCheck.from_json(both.as_json()) == both


# Causes


def told(check: SelfCheck, cause: str) -> str:
    """Return the first warning of a check all of whose failures have one cause."""
    assert check.failed > 0
    assert {failure.cause for failure in check.failures} == {cause}
    return next(check.warnings())


def two(first: dict[str, Any], second: dict[str, Any], **more: Any) -> Scene:
    return make_scene(first | {"name": "one"}, second | {"name": "other"}, film=FILM, **more)


@pytest.mark.parametrize("scene", [
    two(QUARTIC, QUARTIC | {"centre": [0.3, 0.05, 0.1]}),
    two({"surface": "sphere", "r": 0.5}, {"surface": "sphere", "r": 0.4, "n": 1.0}),
    two({"surface": "sphere", "r": 0.5}, {"surface": "sphere", "r": 0.5, "n": 1.0}),
], ids=["overlapping", "nested", "twice the same"])  # fmt: skip
def test_lenses_that_share_a_place_are_named_where_a_medium_is_mistaken(scene: Scene) -> None:
    assert checked(scene).failed == 0
    with broken(Fault("around", "trace_nested.cl", "index_of(scene, after);", "(realv)NUMBER(1.9);")):
        warning = told(checked(scene), "media")
    assert "likely cause: lens.one and lens.other overlap, touch or lie in one another there" in warning
    assert "numerics" not in warning


@pytest.mark.parametrize("precision", ["double", "single"])
def test_a_cemented_doublet_raises_no_alarm(precision: str) -> None:
    """Its lenses meet in a face of one radius: every ray crosses it once; what single leaves undecided double does."""
    crown = {"surface": "conic_singlet", "n": 1.5168, "c1": 0.016, "c2": -0.022, "thickness": 4.0, "diameter": 25.4}
    flint = {"surface": "conic_singlet", "n": 1.6727, "c1": -0.022, "c2": -0.0078, "thickness": 2.5, "diameter": 25.4}
    scene = two(
        crown | {"centre": [0.0, 0.0, 2.0]}, flint | {"centre": [0.0, 0.0, 5.25]},
        source={"kind": "parallel", "direction": [0.0, 0.0, 1.0]},
        picture={"corner": [-15.0, 15.0, 100.0], "right": [30.0, 0.0, 0.0], "down": [0.0, -30.0, 0.0]},
    )  # fmt: skip
    film = {"film.centre": [0.0, 0.0, -5.0], "film.right": [20.0, 0.0, 0.0], "film.down": [0.0, -20.0, 0.0]}
    scene = scene.replace(film)
    check = checked(scene, precision=precision)
    assert check.failures == (), [str(failure) for failure in check.failures]
    assert check.returned == 3 * check.rays > 150
    assert check.surfaces == (3 if precision == "double" else 4) * check.rays
    assert check.untold == 0
    assert check.unchecked == {}


LONGER = "const realv l = {};\n  const real3v u = {{l * t.x, l * t.y, l * t.z}};\n  return pick3(*total, d, u);"


def test_rounding_is_the_cause_where_double_holds_and_only_there() -> None:
    raymap = trace(make_scene({"surface": "torus"}, film=FILM), precision="single", device=device())
    only_single = LONGER.format("sizeof(real) == 4 ? (realv)NUMBER(1.001) : (realv)1")
    with broken(Fault("coarse", "snell_exact.cl", "return pick3(*total, d, t);", only_single)):
        warning = told(check_map(raymap), "rounding")
    assert 'set `numerics.precision` to "double"' in warning
    with broken(
        Fault("longer", "snell_exact.cl", "return pick3(*total, d, t);", LONGER.format("(realv)NUMBER(1.001)"))
    ):
        warning = told(check_map(raymap), "device")
    assert "numerics" not in warning
    assert device().label in warning
    assert device().driver in warning
    assert "report it" in warning


def test_an_expression_without_a_value_is_named() -> None:
    bowl = {"surface": "x^2 + y^2 + z^2 - 0.25 + 0.01*sqrt(0.7 - x)", "bounds": [[-1] * 3, [1] * 3], "name": "bowl"}
    raymap = trace(make_scene(bowl, film={"right": [0.4, 0.0, 0.0], **FILM}), device=device())
    assert check_map(raymap).failed == 0
    aside = "at3(to_world_point(lens, point), (real3v){(realv)1, (realv)0, (realv)0}, (realv)NUMBER(0.85))"
    where = "pick3(nearer, {}, hit->point)"
    fault = Fault(
        "aside", "lens.cl", where.format("to_world_point(lens, point)"), where.format(aside)
    )  # to x from 0.35 to 1.35
    with broken(fault):
        check = check_map(raymap)
    texts = [text for text in check.warnings() if "no finite value" in text]
    assert len(texts) > 1
    assert all("the expression of lens.bowl has no finite value there" in text for text in texts)
    assert {failure.cause for failure in check.failures} == {"no number", "device"}  # the latter where F has a value


def test_what_a_march_has_lost_is_named() -> None:
    """A march that passes over the ring's second wall says so itself; a fault that makes it fail names the step."""
    from lenscl.accuracy.selfcheck.causes import with_causes
    from lenscl.tracing import Follower, film_rays

    scene = make_scene({"surface": "torus", "name": "ring", "rotate": [90.0, 0.0, 0.0]}, film=FILM,
                       numerics={"method": "march", "step": 0.01})  # fmt: skip
    follower = Follower(scene, device())
    origins, vectors = film_rays(scene, np.array([16 * 32 + 16]))
    ends = follower.ends(origins, vectors, 2)  # as one that has lost what lies behind its first wall
    points = np.stack([origins, *(follower.ends(origins, vectors, k).origin for k in (1, 2))])
    failure = Failure(row=16, column=16, event=2, law="ahead", residual=1.0, bound=1e-12)
    left = replace_status(ends, RayStatus.PICTURE)
    (found,) = with_causes({0: failure}, scene, device(), points, left, EPS, lambda _: False)
    assert (found.cause, found.about) == ("lost", "lens.ring")
    assert "`numerics.step` to less" in str(found)
    assert "report" not in str(found)
    surely = scene.replace({"numerics.method": "auto"})
    (found,) = with_causes({0: failure}, surely, device(), points, left, EPS, lambda _: False)
    assert found.cause == "device"


def replace_status(ends: Any, status: RayStatus) -> Any:
    return replace(ends, status=np.full_like(ends.status, status))
