"""Healthy maps pass every check and say what was exercised; each fault is caught, by the law that it breaks."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from faults_in_kernels import Fault, broken
from probe import plain_device
from scenes import CATALOGUE, CONFIGS, SHAPES, make_scene

from lenscl import RayStatus, compile_count, load_study, trace
from lenscl.accuracy import Failure, SelfCheck, check_map
from lenscl.accuracy.selfcheck.check import sampled
from lenscl.accuracy.selfcheck.findings import LAWS
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.tracing import Follower, RayMap, film_rays

LENS = {"heart": {"rotate": [-90.0, -90.0, 0.0]}, "barth_sextic": {"stretch": [0.5, 0.5, 0.5]}}
FILM = {"size": [32, 32]}
PATH_LAWS = {"length", "surface", "snell", "return", "ahead", "place"}


def lens(name: str, **more: Any) -> dict[str, Any]:
    return {"surface": name} | LENS.get(name, {}) | more


def narrow() -> Device:
    """Return the device with one ray to a packet and plain kernels: what is tested here is the check itself.

    The same laws are held on optimised kernels of all widths by tests/physics/test_aimed_paths.py.
    """
    return plain_device(1)


def checked(scene: Scene, *, is_narrow: bool = True, **asked: str) -> SelfCheck:
    check = check_map(trace(scene, device=narrow() if is_narrow else None, **asked))
    assert check.failures == (), [str(failure) for failure in check.failures]
    assert check.failed == 0
    assert all(check.worst[law] <= 1.0 for law in check.worst)
    return check


SOME_OPTICS = ("plano_convex", "prism", "cone", "even_asphere_singlet")  # --slow takes the others, too


@pytest.mark.parametrize("name", [*SHAPES, *SOME_OPTICS])
def test_every_surface_passes_and_is_exercised(name: str) -> None:
    check = checked(make_scene(lens(name), film=FILM))
    assert check.rays >= 40
    assert check.surfaces >= 2 * check.rays - sum(check.unchecked.values())
    assert check.returned > 0.9 * check.surfaces
    assert check.worst.keys() == PATH_LAWS
    # A residual that is always 0 would check nothing; but where nothing lies ahead, nothing is found
    assert all(value > 0.0 for law, value in check.worst.items() if law != "ahead")


@pytest.mark.slow
@pytest.mark.parametrize("method", ["auto", "interval", "march"])
@pytest.mark.parametrize("precision", ["single", "double", "mixed"])
@pytest.mark.parametrize("name", CATALOGUE)
def test_every_surface_passes_by_every_method_in_every_precision(name: str, precision: str, method: str) -> None:
    check = checked(make_scene(lens(name)), is_narrow=False, precision=precision, method=method)
    assert check.returned > 0.7 * check.surfaces


@pytest.mark.parametrize(
    ("name", "precision", "method"),
    [("heart", "single", "auto"), ("bifolia", "mixed", "auto"),
     ("plano_convex", "single", "auto"), ("torus", "double", "march")],
)  # fmt: skip
def test_other_precisions_and_methods_pass(name: str, precision: str, method: str) -> None:
    check = checked(make_scene(lens(name), film=FILM), precision=precision, method=method)
    assert check.returned > 0.8 * check.surfaces


@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("k", [1e-6, 1e6])
def test_tiny_and_huge_scenes_pass(k: float, precision: str) -> None:
    scene = make_scene(
        lens("ellipsoid", stretch=[k, 0.8 * k, 0.6 * k], n=2.0),
        source={"kind": "point", "at": [0.0, 0.0, 4.0 * k]},
        film={"centre": [0.0, 0.0, 2.5 * k], "right": [1.3 * k, 0, 0], "down": [0, -1.3 * k, 0]} | FILM,
        picture={"corner": [-3 * k, 3 * k, -2.5 * k], "right": [6 * k, 0, 0], "down": [0, -6 * k, 0]},
    )
    assert checked(scene, precision=precision).returned > 100


@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("far", [1e3, 1e6])
def test_scenes_far_from_the_origin_pass(far: float, precision: str) -> None:
    at = np.array([far, -far / 3, far / 7])
    scene = make_scene(
        lens("ellipsoid", a=1.0, b=0.8, c=0.6, centre=at.tolist()),
        source={"kind": "point", "at": np.add(at, [0, 0, 4]).tolist()},
        film={"centre": np.add(at, [0, 0, 2.5]).tolist()} | FILM,
        picture={"corner": np.add(at, [-3, 3, -2.5]).tolist()},
    )
    check = checked(scene, precision=precision)
    assert check.surfaces > 60


@pytest.mark.parametrize("n", [1.0, 1.0 + 1e-9, 10.0, 100.0])
def test_indices_from_none_to_a_hundred_pass(n: float) -> None:
    assert checked(make_scene(lens("ellipsoid", n=n), film=FILM)).returned > 100


@pytest.mark.parametrize("rotate", [[0, 0, 0], [20, 30, 10]])
def test_squashed_lenses_pass(rotate: list[float]) -> None:
    check = checked(make_scene(lens("ellipsoid", stretch=[1.0, 1.0, 1e-3], rotate=rotate), film=FILM))
    assert check.surfaces > 100


def test_sources_inside_bubbles_and_parallel_light_pass() -> None:
    inside = {"kind": "point", "at": [0.3, 0.1, -0.1]}
    assert checked(make_scene(lens("ellipsoid", n=2.2), source=inside, film=FILM)).surfaces > 60
    assert checked(make_scene(lens("ellipsoid", n=1.0), medium=1.6, film=FILM)).surfaces > 60
    parallel = {"kind": "parallel", "direction": [0.1, 0.0, -1.0]}
    assert checked(make_scene(lens("ellipsoid"), source=parallel, film=FILM)).returned > 60


@pytest.mark.parametrize("snell", ["exact", "paraxial"])
def test_rays_that_end_by_total_reflection_are_checked_too(snell: str) -> None:
    scene = placed_scene().replace({"effects.total_reflection": "end", "numerics.snell": snell})
    raymap = trace(scene, device=narrow())
    ended = raymap.counts()[RayStatus.TOTAL_REFLECTION]
    assert (ended > 20) == (snell == "exact")
    check = checked(scene)
    assert check.surfaces - check.returned >= (10 if ended else 0)  # where it ended nothing is to be sent back from


def test_what_cannot_be_checked_is_counted_and_said() -> None:
    trapped = checked(make_scene(lens("ellipsoid", n=2.2), numerics={"max_events": 255}, film=FILM,
                                 source={"kind": "point", "at": [0.0, 0.79, 0.0]}))  # fmt: skip
    assert trapped.unchecked["cut"] > 0
    assert "with more surfaces than are looked at" in trapped.summary()
    # A superellipsoid in which max and min have creases where it has none, and rounding hides the slopes of small parts
    large, small = "max(abs(x), abs(y))", "min(abs(x), abs(y))"
    round_ = f"{large}*pow(1 + pow({small}/max({large}, 1e-37), 4), 0.25)"
    large, small = f"max({round_}, abs(z))", f"min({round_}, abs(z))"
    text = f"{large}*pow(1 + pow({small}/max({large}, 1e-37), 4), 0.25) - 1"
    singular = checked(make_scene({"surface": text, "bounds": [[-1.1] * 3, [1.1] * 3]}, film=FILM))
    assert 0 < singular.unchecked["singular"] < 0.2 * singular.surfaces
    blurred = make_scene(lens("sphere", stretch=[1.0, 1.0, 1e-6], rotate=[30, 20, 0]), film=FILM)
    assert "singular" not in checked(blurred).unchecked
    hidden = checked(blurred, precision="single")  # as thick as a few roundings of its points
    assert hidden.unchecked["singular"] == hidden.surfaces > 60
    assert "where rounding hides the surface" in hidden.summary()


def test_the_march_may_lose_what_it_says_it_may_lose() -> None:
    scene = make_scene(lens("torus"), numerics={"method": "march", "step": 0.2})
    check = checked(scene)
    assert check.unchecked["lost"] > 0
    assert "march" in check.summary()
    assert "lost" not in checked(scene, method="auto").unchecked


def test_a_film_that_shows_no_lens_says_so() -> None:
    check = checked(make_scene(lens("ellipsoid"), film={"centre": [9.0, 9.0, 2.5]} | FILM))
    assert check == SelfCheck()
    assert "no ray of the film meets a lens" in check.summary()
    assert list(check.warnings()) == []


def test_the_checks_program_is_no_trace_program_and_numbers_need_no_other() -> None:
    scene = make_scene(lens("ellipsoid"), film=FILM)
    raymap = trace(scene, device=narrow())
    before = compile_count()
    check_map(raymap)
    assert compile_count() == before
    checks = compile_count("check")
    other = trace(scene.replace({"lens.n": 1.7, "lens.a": 0.9}), device=narrow())
    check_map(other)
    assert (compile_count(), compile_count("check")) == (before, checks)


def test_the_device_ends_rays_at_their_surface_points_one_by_one() -> None:
    scene = make_scene(lens("ellipsoid", a=1.0, b=1.0, c=1.0, r=0.5), film=FILM)
    raymap = trace(scene, device=narrow())
    pixels = sampled(raymap.events)
    follower = Follower(scene, raymap.device, "check")
    starts = film_rays(scene, pixels)
    none, one, two, all_of_them = (follower.ends(*starts, k) for k in (0, 1, 2, 64))
    assert np.all(none.status == RayStatus.TRAPPED)
    np.testing.assert_array_equal(none.origin, np.broadcast_to([0.0, 0.0, 4.0], none.origin.shape))
    assert np.all(one.status == RayStatus.TRAPPED)
    np.testing.assert_allclose(np.linalg.norm(one.origin, axis=1), 0.5, rtol=1e-14)
    assert np.all(one.origin[:, 2] > 0.0)
    assert np.all(two.origin[:, 2] < one.origin[:, 2])
    np.testing.assert_array_equal(two.origin, all_of_them.origin)
    assert np.all(all_of_them.events == 2)


# A fault is put into the kernel that follows rays; the map is a healthy one

TILTED = (
    "const realv o = (realv)NUMBER(1e-3) * sqrt(dot3(g, g));\n  g.x += o * (g.y > (realv)0 ? (realv)1 : (realv)-1);"
)
FAULTS: dict[str, tuple[str, str, str, str]] = {
    "eta flipped": (
        "snell", "snell_exact.cl", "  const realv excess =", "  eta = (realv)1 / eta;\n  const realv excess ="),
    "tilted": ("snell", "snell_exact.cl", "  const realv c = max_v", f"  {TILTED}\n  const realv c = max_v"),
    "total too early": ("snell", "snell_exact.cl", "across), total);",
                        "across) - (realv)NUMBER(0.3) * dot3(g, g), total);"),
    "another normal": (
        "snell", "lens.cl", "real3v n = to_world_normal(lens, gradient);",
        "real3v n = turn3(lens->to_world, gradient);"),
    "longer": (
        "length", "snell_exact.cl", "return pick3(*total, d, t);",
        "const realv l = (realv)NUMBER(1.0001);\n  const real3v u = {l * t.x, l * t.y, l * t.z};\n"
        "  return pick3(*total, d, u);"),
    "no number": (
        "length", "snell_exact.cl", "return pick3(*total, d, t);",
        "const real3v u = {t.x, t.y, t.z / ((realv)0 * t.z)};\n  return pick3(*total, d, u);"),
    "displaced": (
        "surface", "lens.cl", "pick3(nearer, to_world_point(lens, point), hit->point)",
        "pick3(nearer, at3(to_world_point(lens, point), ray->direction, (realv)NUMBER(1e-4)), hit->point)"),
    "misplaced": (
        "surface", "placement.cl", "to_world, p), broadcast3(lens->centre), (realv)1)",
        "to_world, p), broadcast3(lens->centre), (realv)NUMBER(1.001))"),
    "sideways": (
        "surface", "lens.cl", "at3(search.origin, search.direction, root.t)",
        "at3(search.origin, search.direction, root.t * (realv)NUMBER(1.001))"),
    "takes the normal's side for the ray's": (
        "snell", "trace.cl", "const realv turns = leaves ? (realv)-1 : (realv)1;", "const realv turns = (realv)1;"),
    "lands askew": ("place", "screen.cl", "arrives ? s :", "arrives ? t :"),
    "half reflected": ("length", "effects/mirrored.cl", "(realv)-2 *", "(realv)NUMBER(-1.999) *"),
}  # fmt: skip


def fault(name: str, old: str, new: str) -> AbstractContextManager[None]:
    return broken(Fault("a fault", name, old, new))


def placed_scene() -> Scene:
    """Return an ellipsoid askew, with the source in it: rays leave it, and some are totally reflected before."""
    return make_scene(
        lens("ellipsoid", a=1.0, b=0.7, c=0.5, centre=[0.1, 0.05, -0.2], rotate=[20, 30, 10],
             stretch=[1.0, 0.9, 0.8], n=2.2),
        source={"kind": "point", "at": [0.3, 0.1, -0.1]},
        film=FILM,
    )  # fmt: skip


@pytest.fixture(scope="module")
def maps() -> dict[str, RayMap]:
    return {
        precision: trace(placed_scene(), precision=precision, device=narrow()) for precision in ("double", "single")
    }


@pytest.mark.parametrize(
    ("which", "precision"), [*((name, "double") for name in FAULTS), ("tilted", "single"), ("longer", "single"),
                             ("displaced", "single")],
)  # fmt: skip
def test_a_fault_is_caught_by_the_law_that_it_breaks(which: str, precision: str, maps: dict[str, RayMap]) -> None:
    healthy = check_map(maps[precision])
    assert healthy.failed == 0
    assert healthy.surfaces > 1.3 * healthy.rays  # some are reflected
    law, *change = FAULTS[which]
    with fault(*change):
        check = check_map(maps[precision])
    assert check.failed >= 20
    assert check.worst[law] > (5.0 if precision == "single" else 1e6)
    untouched = {
        "place": {"length", "surface", "snell", "return"},
        "snell": {"surface"},
        "length": {"surface"},
        "surface": {"length"},
        "return": {"length", "surface"},
    }
    assert all(check.worst[other] <= 1.0 for other in untouched[law])


def test_a_nearer_lens_passed_over_does_not_come_back() -> None:
    ball = {"surface": "ellipsoid", "r": 0.5}
    scene = make_scene({**ball, "name": "a", "centre": [0, 0, 0.7]}, {**ball, "name": "b", "centre": [0, 0, -0.7]},
                       film={"right": [0.4, 0, 0], "down": [0, -0.4, 0]} | FILM)  # fmt: skip
    raymap = trace(scene, device=narrow())
    assert check_map(raymap).failed == 0
    with fault("lens.cl", "(t < hit->t)", "(t > hit->t)"):
        check = check_map(raymap)
    assert check.worst["return"] > 1e6
    assert check.worst["surface"] < 1.0  # every point that is met is a point of a surface


@pytest.mark.parametrize("precision", ["single", "double"])
def test_a_surface_that_no_ray_meets_again_is_seen_ahead(precision: str) -> None:
    scene = make_scene({"surface": "torus", "rotate": [90, 0, 0]}, film=FILM)  # from the side: through both walls
    raymap = trace(scene, precision=precision, device=narrow())
    assert check_map(raymap).failed == 0
    assert (raymap.events > 2).any()
    with fault("trace.cl", "*travels & hit.found &", "*travels & hit.found & (ray->events < (maskv)2) &"):
        lost = trace(scene, precision=precision, device=narrow())
        check = check_map(lost)
    assert lost.events.max() == 2
    assert check.worst["ahead"] > 1e3
    assert check.failed >= 5
    assert all(check.worst[law] <= 1.0 for law in ("length", "surface", "snell", "place"))


def test_a_misplaced_lens_in_the_hosts_numbers_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    from lenscl.tracing import placement

    real = placement._rotation
    monkeypatch.setattr(placement, "_rotation", lambda degrees: real((degrees[0], degrees[1], degrees[2] + 1e-3)))
    check = check_map(trace(placed_scene(), device=narrow()))
    assert check.worst["surface"] > 1e6


def test_a_map_whose_pixels_end_otherwise_is_caught_and_names_them(maps: dict[str, RayMap]) -> None:
    raymap = maps["double"]
    events = raymap.events.copy()
    pixel = int(sampled(events)[5])
    events.flat[pixel] += 1
    check = check_map(replace(raymap, events=events))
    row, column = divmod(pixel, 32)
    assert [(f.row, f.column, f.law) for f in check.failures] == [(row, column, "map")]
    (warning,) = check.warnings()
    assert warning.startswith(f"pixel ({row}, {column}): expected ")
    assert "lenscl bench" in warning


def test_the_sample_covers_what_shows_a_lens_and_takes_the_longest_paths() -> None:
    events = np.zeros((50, 90), np.uint8)
    events[10:40, 30:70] = 2
    events[20, 31:40] = 7
    pixels = sampled(events)
    rows, columns = np.divmod(pixels, 90)
    assert 64 <= len(pixels) <= 72
    assert np.all(events[rows, columns] > 0)
    cells = set(zip((rows - 10) * 8 // 30, (columns - 30) * 8 // 40, strict=True))
    assert len(cells) == 64
    assert np.count_nonzero(events[rows, columns] == 7) >= 8
    np.testing.assert_array_equal(pixels, sampled(events))
    assert sampled(np.ones((1, 3), np.uint8)).tolist() == [0, 1, 2]
    assert sampled(np.zeros((4, 4), np.uint8)).size == 0


def failing() -> SelfCheck:
    failure = Failure(row=3, column=4, event=2, law="snell", residual=1e-3, bound=1e-12)
    return SelfCheck(rays=9, surfaces=18, returned=17, unchecked={"borderline": 1}, worst={"snell": 1e9}, failed=2,
                     failures=(failure,))  # fmt: skip


def test_findings_are_kept_as_plain_data_and_added_up() -> None:
    check = failing()
    assert SelfCheck.from_json(check.as_json()) == check
    other = SelfCheck(rays=1, surfaces=2, returned=2, unchecked={"cut": 3}, worst={"snell": 0.1, "length": 0.2})
    both = other + check
    assert (both.rays, both.surfaces, both.returned, both.failed) == (10, 20, 19, 2)
    assert both.unchecked == {"cut": 3, "borderline": 1}
    assert both.worst == {"length": 0.2, "snell": 1e9}
    assert both.failures == check.failures
    many = both
    for _ in range(20):
        many = many + check
    assert len(many.failures) < 20 < many.failed
    assert set(LAWS) >= set(many.worst)


def test_a_summary_is_one_line_and_a_warning_leads_with_its_pixel() -> None:
    check = failing()
    assert "\n" not in check.summary()
    assert "2 FAILED: 9 rays, 18 surfaces, 17 legs followed back" in check.summary()
    assert "snell 1e+09" in check.summary()
    assert "1 within rounding of another path" in check.summary()
    (warning,) = check.warnings()
    assert warning.startswith("pixel (3, 4) at surface 2: expected a ray that bends by the scene's rule")
    assert "its cause was not looked for" in warning  # as in tables of before
    for advice in ("numerics.precision", "numerics.method", "lenscl bench", "report"):
        assert advice in warning
    broken_off = SelfCheck(error="the device went away")
    assert "not made: the device went away" in broken_off.summary()
    assert list(broken_off.warnings()) == ["the self-checks could not be made: the device went away"]


def test_the_forerunners_scenes_pass() -> None:
    for name in ("torus", "heart", "bifolia", "ellipsoid"):
        scene = load_study(CONFIGS / f"{name}.toml").scene.replace({"film.size": [64, 64]})
        assert checked(scene, is_narrow=False).surfaces > 100
