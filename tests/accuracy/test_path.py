"""Paths shown event by event: against closed forms, certified roots, the map itself, and changed starts."""

from __future__ import annotations

import json
import math
import sys
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from scenes import make_scene

from lenscl import RayStatus, trace
from lenscl.accuracy.path import RayPath, explain_pixel
from lenscl.config import Scene
from lenscl.errors import StudyError
from lenscl.reference import certified
from lenscl.tracing import Placement

POLYNOMIAL = ("sphere", "ellipsoid", "torus", "heart", "bifolia", "barth_sextic", "rod")
SOME = 3


def lens(name: str, **changes: Any) -> dict[str, Any]:
    return {"surface": name, "rotate": [20.0, 30.0, 10.0], "stretch": [0.6, 0.6, 0.6], **changes}


def some_pixels(scene: Scene, count: int, seed: int = 1) -> list[tuple[int, int]]:
    """Return pixels whose rays land behind a lens."""
    raymap = trace(scene)
    found = np.argwhere((raymap.events > 0) & (raymap.status <= RayStatus.OFF_PICTURE))
    chosen = np.random.default_rng(seed).permutation(len(found))[:count]
    return [(int(row), int(column)) for row, column in found[chosen]]


def one_ray(height: float, surface: str = "sphere", **changes: Any) -> Scene:
    """Return a scene whose single film pixel sends a ray along -z at a height above the axis."""
    return make_scene(
        {"surface": surface, **changes.pop("lens", {"r": 0.75})},
        source={"kind": "parallel", "direction": [0.0, 0.0, -1.0]},
        film={"centre": [height, 0.0, 2.5], "size": [1, 1]},
        **changes,
    )


@pytest.mark.parametrize("height", [0.0, 0.1, 0.5, 0.74, 0.7499])
def test_a_sphere_is_met_at_the_angles_of_its_closed_form(height: float) -> None:
    path = explain_pixel(one_ray(height), 0, 0)
    entry, leaving = path.events
    incidence = math.asin(height / 0.75)
    inside = math.asin(height / 0.75 / 1.5)
    near = {"rel": 1e-9, "abs": 1e-9}  # the slant of a flat ray is not known better
    assert (entry.kind, leaving.kind, path.inside) == ("entry", "exit", None)
    assert [entry.incidence, leaving.behind] == pytest.approx([math.degrees(incidence)] * 2, **near)
    assert [entry.behind, leaving.incidence] == pytest.approx([math.degrees(inside)] * 2, **near)
    assert entry.normal == pytest.approx((height / 0.75, 0.0, math.cos(incidence)), abs=1e-12)
    assert entry.leg == pytest.approx(path.start[2] - 0.75 * math.cos(incidence), abs=1e-11)
    assert leaving.leg == pytest.approx(1.5 * math.cos(inside), abs=1e-11)
    assert entry.margin is None
    assert entry.k == pytest.approx(math.cos(incidence) ** 2 + (1 - 1 / 1.5**2) * math.sin(incidence) ** 2, rel=1e-12)
    assert leaving.margin == pytest.approx(math.degrees(math.asin(1 / 1.5) - inside), abs=1e-9)
    assert leaving.k == pytest.approx(math.cos(incidence) ** 2, abs=1e-11)


@pytest.mark.parametrize("beside", [0.2, 1e-3, 1e-6, 1e-9, -1e-9, -1e-6, -1e-3, -0.2])
def test_the_margin_is_the_angle_left_to_the_critical_one_however_little(beside: float) -> None:
    """In a bubble in glass; the height is that of the critical angle, times 1 - beside."""
    height = 0.75 / 1.5 * (1 - beside)
    path = explain_pixel(one_ray(height, lens={"r": 0.75, "n": 1.0}, medium=1.5), 0, 0)
    first = path.events[0]
    with mpmath.workdps(40):
        sine = mpmath.mpf(height) / mpmath.mpf(0.75)
        expected = mpmath.degrees(mpmath.asin(1 / mpmath.mpf(1.5)) - mpmath.asin(sine))
        k = 1 - (mpmath.mpf(1.5) * sine) ** 2
    assert first.kind == ("entry" if beside > 0 else "total reflection")
    assert first.margin is not None
    assert first.k is not None
    assert first.k_bound is not None
    assert abs(first.margin - float(expected)) <= 1e-6 * abs(float(expected)) + 1e-13
    assert abs(first.k - float(k)) <= first.k_bound < 1e-12
    if beside < 0:
        assert first.incidence == pytest.approx(first.behind, abs=1e-9)
        assert path.total == 1


@pytest.mark.parametrize("precision", ["single", "double"])
def test_the_path_ends_where_the_map_says_and_its_residuals_are_within_what_rounding_allows(precision: str) -> None:
    kinds: set[str] = set()
    events = 0
    for name in ("torus", "bifolia", "superellipsoid", "rod"):
        scene = make_scene(lens(name), numerics={"precision": precision})
        raymap = trace(scene)
        for row, column in some_pixels(scene, SOME):
            path = explain_pixel(scene, row, column)
            assert path.status is RayStatus(raymap.status[row, column])
            assert path.total == len(path.events) == raymap.events[row, column]
            assert path.st is not None
            assert path.error is not None
            assert path.proof is not None
            assert path.st == tuple(raymap.st[row, column].tolist())
            assert path.proof.status is path.status
            assert path.proof.distance is not None
            assert path.proof.distance <= path.error
            for event in path.events:
                events += 1
                kinds.add(event.kind)
                assert event.residual is not None
                assert event.allowed is not None
                assert abs(event.residual) <= event.allowed
                assert event.bracket is not None
    assert events > 8 * SOME
    assert kinds == {"entry", "exit", "total reflection"}


def crossing_between(scene: Scene, path: RayPath, ends: tuple[Fraction, Fraction]) -> certified.Root | None:
    """Return the first crossing of the first event's ray between two places, counted from the event's point."""
    (lens,), placed = scene.lenses, Placement.of(scene.lenses[0])
    expression = certified.sign_polynomial(lens.surface)
    assert expression is not None
    along = placed.to_local @ (np.array(path.direction) / np.linalg.norm(path.direction))
    base = placed.local(np.array(path.events[0].point))
    low, high = ends
    start = [Fraction(o) + low * Fraction(d) for o, d in zip(base.tolist(), along.tolist(), strict=True)]
    return certified.first_root(expression, lens.values, start, along.tolist(), high - low).crossing


@pytest.mark.parametrize("precision", ["single", "double"])
def test_the_certified_root_lies_in_the_bracket_and_not_beside_it(
    precision: str, request: pytest.FixtureRequest
) -> None:
    held = beside = off = 0
    is_whole = precision == "double" or request.config.getoption("--slow")
    names = POLYNOMIAL if is_whole else POLYNOMIAL[1:4]
    for name in names:
        scene = make_scene(lens(name), numerics={"precision": precision})
        for row, column in some_pixels(scene, SOME, seed=3):
            path = explain_pixel(scene, row, column)
            bracket = path.events[0].bracket
            assert bracket is not None
            low, high = (Fraction(end) for end in bracket)
            root = crossing_between(scene, path, (low, high))
            assert root is not None, (name, row, column)
            assert (root.before, root.after) == (1, -1)
            held += 1
            beside += crossing_between(scene, path, (high, 2 * high - low)) is not None
            off += not low <= 0 <= high
            assert high - low < 1e-12
    assert held == SOME * len(names)
    assert beside == 0
    assert off > held / 2 if precision == "single" else off < held / 2


def test_a_ray_that_single_leaves_undecided_is_shown_in_double_as_a_map_has_it() -> None:
    scene = one_ray(0.75 - 1e-8, numerics={"precision": "single"})
    raymap = trace(scene)
    assert raymap.escalated == 1
    path = explain_pixel(scene, 0, 0)
    assert (path.precision, path.asked, path.total) == ("double", "single", 2)
    assert path.status is RayStatus(raymap.status[0, 0])
    assert [event.kind for event in path.events] == ["entry", "exit"]
    first = path.events[0]
    assert first.growth is not None
    assert first.growth > 1e3  # it grazes


def test_a_ray_that_only_the_last_resort_decides_says_so_and_one_that_nothing_does_is_undecided() -> None:
    path = explain_pixel(one_ray(0.75 - 1e-14), 0, 0)
    assert (path.last_resort, path.events, path.total) == (True, (), 2)
    assert path.status is RayStatus.BEHIND
    assert path.growth is None
    tangent = explain_pixel(one_ray(0.75), 0, 0)
    assert (tangent.last_resort, tangent.status, tangent.total) == (False, RayStatus.UNDECIDED, 0)
    assert tangent.proof is not None
    assert tangent.proof.status is None
    assert "touches" in tangent.proof.reason


def test_a_ray_past_every_lens_has_no_events_and_its_place() -> None:
    path = explain_pixel(one_ray(1.5), 0, 0)
    assert (path.events, path.status, path.pixel) == ((), RayStatus.PICTURE, (512, 768))
    assert path.st == pytest.approx((0.75, 0.5), abs=1e-14)
    assert path.last == pytest.approx(path.start[2] + 2.5, abs=1e-12)
    # Turned by e it moves e times the way to the picture, moved across by e times the reach so much
    assert path.growth == pytest.approx(max(path.last / 6, path.reach / 6) * math.sqrt(2), rel=0.3)


def test_the_pixel_is_of_the_picture_that_is_named_and_none_beside_it() -> None:
    scene = one_ray(1.5, picture={"size": [30, 20]})
    assert explain_pixel(scene, 0, 0).pixel == (10, 22)
    assert explain_pixel(scene, 0, 0, size=(7, 5)).pixel == (2, 5)
    beside = explain_pixel(one_ray(3.5), 0, 0)
    assert (beside.status, beside.pixel) == (RayStatus.OFF_PICTURE, None)
    assert beside.st is not None


def test_rays_that_are_stopped_say_how() -> None:
    trapped = explain_pixel(one_ray(0.3, numerics={"max_events": 1}), 0, 0)
    assert (trapped.status, trapped.total, trapped.st, trapped.last) == (RayStatus.TRAPPED, 1, None, None)
    glass = {"lens": {"r": 0.75, "n": 1.0}, "medium": 1.5, "effects": {"total_reflection": "end"}}
    ended = explain_pixel(one_ray(0.6, **glass), 0, 0)
    (only,) = ended.events
    assert ended.status is RayStatus.TOTAL_REFLECTION
    assert (only.kind, only.behind, ended.error, ended.growth) == ("total reflection", None, None, None)
    assert only.margin is not None
    assert only.margin < 0


def test_a_start_inside_leaves_first_and_one_on_the_surface_goes_where_it_is_directed() -> None:
    def start(z: float) -> RayPath:
        source = {"kind": "point", "at": [0.0, 0.0, z]}
        film = {"centre": [0.0, 0.0, z - 1.0], "right": [0.01, 0.0, 0.0], "down": [0.0, -0.01, 0.0], "size": [1, 1]}
        return explain_pixel(make_scene({"surface": "sphere", "r": 0.75}, source=source, film=film), 0, 0)

    inside, entering, leaving = start(0.25), start(0.75), start(-0.75)
    assert (inside.inside, [event.kind for event in inside.events]) == ("lens", ["exit"])
    assert inside.events[0].leg == pytest.approx(1.0, abs=1e-14)
    assert (entering.inside, [event.kind for event in entering.events]) == ("lens", ["exit"])
    assert (leaving.inside, leaving.events) == (None, ())


def test_each_event_names_its_lens_and_on_an_edge_the_face_that_bends() -> None:
    rod = {"name": "stick", "surface": "rod", "centre": [0.0, 0.0, 1.0]}
    ball = {"name": "ball", "surface": "sphere", "r": 0.5, "centre": [0.0, 0.0, -1.0]}
    path = explain_pixel(make_scene(rod, ball, film={"size": [9, 9]}), 4, 5)
    assert [event.lens for event in path.events] == ["lens.stick"] * 2 + ["lens.ball"] * 2
    through = explain_pixel(make_scene({"surface": "rod"}, film={"size": [1, 1]}), 0, 0)
    assert [event.normal for event in through.events] == [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]
    roof = one_ray(0.0, "max(x + z - 0.4, z - x - 0.4, x^2 + y^2 + z^2 - 1)", lens={"bounds": [[-1.3] * 3, [1.3] * 3]})
    for height in (0.0, 1e-17, 1e-14, -1e-14):  # on the ridge, to rounding, and beside it
        first = explain_pixel(roof.replace({"film.centre.x": height}), 0, 0).events[0]
        assert first.normal is not None
        side = math.copysign(math.sqrt(0.5), height if abs(height) > 1e-15 else first.normal[0])
        assert first.normal == pytest.approx((side, 0.0, math.sqrt(0.5)), abs=1e-12)
        assert first.behind == pytest.approx(math.degrees(math.asin(math.sqrt(0.5) / 1.5)), abs=1e-9)


def test_at_a_point_without_a_normal_the_ray_is_undecided_and_shows_no_event_there() -> None:
    path = explain_pixel(one_ray(0.0, "cone", lens={}), 0, 0)  # along its axis, at its tip
    assert (path.status, path.events, path.growth, path.last_resort) == (RayStatus.UNDECIDED, (), None, False)


def test_far_from_the_origin_what_rounding_leaves_unknown_is_none_and_all_is_still_json() -> None:
    """A ball of a millionth of its distance from the origin, in single: no point of it is known to a hundredth."""
    far = {"r": 0.75, "centre": [2e6, 0.0, 0.0]}
    scene = one_ray(2e6, lens=far, numerics={"precision": "single"}, picture={"corner": [2e6 - 3, 3.0, -2.5]})
    path = explain_pixel(scene, 0, 0)
    json.dumps(path.as_json(), allow_nan=False)
    assert path.events
    assert all(event.allowed is None for event in path.events if event.normal is None)
    assert any(event.allowed is None for event in path.events)


def test_the_paraxial_rule_is_held_against_the_exact_law() -> None:
    path = explain_pixel(one_ray(0.4, numerics={"snell": "paraxial"}), 0, 0)
    assert path.proof is not None
    assert path.proof.distance is not None
    assert path.error is not None
    assert 1e-3 < path.proof.distance == pytest.approx(path.error, rel=1e-9)
    tangent_inside = math.tan(math.asin(0.4 / 0.75)) / 1.5
    assert path.events[0].behind == pytest.approx(math.degrees(math.atan(tangent_inside)), abs=1e-9)


def test_without_python_flint_nothing_is_proved(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "flint", None)
    path = explain_pixel(one_ray(0.3), 0, 0)
    assert path.proof is None
    assert path.as_json()["proof"] is None


def test_what_cannot_be_explained_is_refused_or_said() -> None:
    scene = make_scene({"surface": "sphere", "r": 0.5}, film={"centre": [0, 0, 4.0], "size": [5, 3]})
    for row, column in ((3, 0), (0, 5), (-1, 0), (0, -1)):
        with pytest.raises(
            StudyError, match=rf"pixel \({row}, {column}\) is not on the film, which has 3 rows and 5 col"
        ):
            explain_pixel(scene, row, column)
    on_source = explain_pixel(scene, 1, 2)
    assert (on_source.status, on_source.direction, on_source.total) == (RayStatus.UNDECIDED, (0.0, 0.0, 0.0), 0)


@pytest.mark.parametrize("name", ["torus", "cone", "superellipsoid"])
def test_a_path_is_plain_json_of_all_its_values(name: str) -> None:
    scene = make_scene(lens(name))
    path = explain_pixel(scene, *some_pixels(scene, 1)[0])
    found = json.loads(json.dumps(path.as_json(), allow_nan=False))
    assert found.keys() == set(path.__slots__)
    assert [event["number"] for event in found["events"]] == list(range(1, path.total + 1))
    assert found["events"][0].keys() == set(path.events[0].__slots__)
    assert found["status"] == path.status.name
    assert found["proof"]["status"] == path.status.name
    assert found["st"] == list(path.st or ())
