"""Paths shown event by event through solids in one another, overlapping and in contact: whose media, whose faces."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from arrangements import bubble, doublet, drawn, stack
from scenes import make_scene

from lenscl import RayStatus, trace
from lenscl.accuracy.path import RayPath, explain_pixel

NARROW = {"size": [9, 9], "right": [0.2, 0.0, 0.0], "down": [0.0, -0.2, 0.0]}


def media(path: RayPath) -> list[tuple[str, str, str | None, str | None]]:
    return [(event.kind, event.lens, event.before, event.after) for event in path.events]


def one_ray(*lenses: dict[str, Any], height: float = 0.05, **changes: Any) -> RayPath:
    source = {"kind": "parallel", "direction": [0.0, 0.0, -1.0]}
    film = {"centre": [height, 0.02, 2.5], "size": [1, 1]}
    return explain_pixel(make_scene(*lenses, source=source, film=film, **changes), 0, 0)


CASES: dict[str, tuple[list[dict[str, Any]], list[tuple[str, str, str | None, str | None]]]] = {
    "bubble": (
        bubble(),
        [
            ("entry", "lens.glass", None, "lens.glass"),
            ("entry", "lens.bubble", "lens.glass", "lens.bubble"),
            ("exit", "lens.bubble", "lens.bubble", "lens.glass"),
            ("exit", "lens.glass", "lens.glass", None),
        ],
    ),
    "bubble of glass": (
        bubble(n=1.5),
        [
            ("entry", "lens.glass", None, "lens.glass"),
            ("entry", "lens.bubble", "lens.glass", "lens.bubble"),
            ("exit", "lens.bubble", "lens.bubble", "lens.glass"),
            ("exit", "lens.glass", "lens.glass", None),
        ],
    ),
    "hidden": (
        bubble(priority=-1.0, n=2.0),
        [("entry", "lens.glass", None, "lens.glass"), ("exit", "lens.glass", "lens.glass", None)],
    ),
    "doublet": (
        doublet(),
        [
            ("entry", "lens.crown", None, "lens.crown"),
            ("cemented", "lens.crown", "lens.crown", "lens.flint"),
            ("exit", "lens.flint", "lens.flint", None),
        ],
    ),
    "stack": (
        stack(),
        [
            ("entry", "lens.upper", None, "lens.upper"),
            ("cemented", "lens.upper", "lens.upper", "lens.lower"),
            ("exit", "lens.lower", "lens.lower", None),
        ],
    ),
    "gap": (
        stack(1e-12),
        [
            ("entry", "lens.upper", None, "lens.upper"),
            ("exit", "lens.upper", "lens.upper", None),
            ("entry", "lens.lower", None, "lens.lower"),
            ("exit", "lens.lower", "lens.lower", None),
        ],
    ),
    "through a joint": (
        [*stack(), {"surface": "sphere", "name": "ball", "r": 0.2, "n": 1.3}],
        [
            ("entry", "lens.upper", None, "lens.upper"),
            ("entry", "lens.ball", "lens.upper", "lens.ball"),
            ("exit", "lens.ball", "lens.ball", "lens.lower"),
            ("exit", "lens.lower", "lens.lower", None),
        ],
    ),
}


@pytest.mark.parametrize(
    ("name", "precision"), [*((name, "double") for name in CASES), ("doublet", "single"), ("through a joint", "single")]
)
def test_each_event_names_both_media_and_whose_face_it_is(name: str, precision: str) -> None:
    lenses, expected = CASES[name]
    path = one_ray(*lenses, numerics={"precision": precision})
    assert media(path) == expected
    index = {f"lens.{lens['name']}": lens["n"] for lens in lenses} | {None: 1.0}
    for event in path.events:
        assert (event.n_before, event.n_after) == (index[event.before], index[event.after])
        assert event.residual is not None
        assert event.allowed is not None
        assert abs(event.residual) <= event.allowed
        assert event.incidence is not None
        assert event.behind is not None
        sines = [math.sin(math.radians(angle)) for angle in (event.incidence, event.behind)]
        assert event.n_before * sines[0] == pytest.approx(event.n_after * sines[1], abs=1e-5)
    assert path.proof is not None
    assert (path.proof.status, path.proof.events) == (path.status, path.total)


def test_all_pixels_of_a_bubble_and_a_doublet_are_followed_as_they_are_proved() -> None:
    cemented = within = events = 0
    for lenses in (bubble(), doublet()):
        scene = make_scene(*lenses, film=NARROW)
        raymap = trace(scene)
        for row, column in ((0, 0), (1, 6), (3, 3), (4, 4), (5, 2), (8, 8)):
            path = explain_pixel(scene, row, column)
            assert path.total == len(path.events) == raymap.events[row, column]
            assert path.growth is not None
            assert path.proof is not None
            assert (path.proof.status, path.proof.events) == (path.status, path.total)
            for one, other in zip(path.events, path.events[1:], strict=False):
                assert one.after == other.before or one.kind == "total reflection"
            assert path.events[0].before is None
            assert path.events[-1].after is None
            events += len(path.events)
            cemented += sum(event.kind == "cemented" for event in path.events)
            within += sum(event.lens == "lens.bubble" for event in path.events)
    assert events > 25
    assert cemented >= 3
    assert within >= 4


def test_random_solids_in_solids_keep_their_media_and_laws(request: pytest.FixtureRequest) -> None:
    paths = events = reflected = 0
    for seed in range(14) if request.config.getoption("--slow") else (1, 4):
        rng = np.random.default_rng(seed)
        scene = drawn(rng).replace({"film.size": [16, 16]})
        pixels = np.argwhere(trace(scene).events >= 3)
        for row, column in pixels[rng.permutation(len(pixels))[:3]]:
            path = explain_pixel(scene, int(row), int(column))
            paths += 1
            medium = path.inside
            for event in path.events:
                events += 1
                is_total = event.kind == "total reflection"
                reflected += is_total
                assert event.before == medium != event.after
                medium = medium if is_total else event.after
                assert None in (event.residual, event.allowed) or abs(event.residual) <= event.allowed
                if event.incidence is not None and event.behind is not None and not is_total:
                    sines = [math.sin(math.radians(angle)) for angle in (event.incidence, event.behind)]
                    assert event.n_before * sines[0] == pytest.approx(event.n_after * sines[1], abs=1e-9)
            assert path.proof is not None
            assert path.proof.status in (None, path.status)
    assert paths >= 6
    assert events > 15
    assert reflected > 0


def test_parallel_light_starts_in_no_solid() -> None:
    source = {"kind": "parallel", "direction": [0.0, 0.0, -1.0]}
    raymap = trace(make_scene(*bubble(), source=source, film={"size": [8, 8]}))
    assert raymap.escalated == 0
    assert (raymap.events == 4).sum() >= 2
    assert not (raymap.status == RayStatus.UNDECIDED).any()


def test_total_reflection_at_a_bubble_names_what_it_is_reflected_from() -> None:
    path = one_ray(*bubble(centre=[0.0, 0.0, 0.0]), height=0.24)
    reflected = path.events[1]
    assert (reflected.kind, reflected.lens) == ("total reflection", "lens.bubble")
    assert (reflected.before, reflected.after, reflected.n_after) == ("lens.glass", "lens.bubble", 1.0)
    assert reflected.margin is not None
    assert reflected.margin < 0
    assert path.events[2].before == "lens.glass"


def test_no_total_reflection_at_cement_where_air_would_have_it() -> None:
    """At 45 degrees within glass of 1.5: a prism on a prism of 1.45."""
    half = "max(max(abs(x), abs(y), abs(z)) - 0.3, {})"
    box = {"bounds": [[-0.4] * 3, [0.4] * 3]}
    one = box | {"surface": half.format("x - z"), "name": "one", "n": 1.5}
    other = box | {"surface": half.format("z - x"), "name": "other", "n": 1.45}
    assert [event[0] for event in media(one_ray(one))] == ["entry", "total reflection", "exit"]
    path = one_ray(one, other)
    assert [event[0] for event in media(path)] == ["entry", "cemented", "exit"]
    joint = path.events[1]
    assert joint.margin is not None
    assert joint.incidence == pytest.approx(45.0, abs=1e-9)
    assert joint.margin == pytest.approx(math.degrees(math.asin(1.45 / 1.5)) - 45.0, abs=1e-9)


@pytest.mark.parametrize(
    ("z", "inside", "solids"),
    [
        (0.1, "lens.bubble", ("lens.glass", "lens.bubble")),
        (-0.4, "lens.glass", ("lens.glass",)),
        (2.0, None, ()),
        (0.3, "lens.bubble", ("lens.glass", "lens.bubble")),  # on the bubble, entering it
        (-0.1, "lens.glass", ("lens.glass",)),  # on it, leaving
    ],
)
def test_a_start_in_several_solids_names_all_of_them(z: float, inside: str | None, solids: tuple[str, ...]) -> None:
    source = {"kind": "point", "at": [0.1, 0.05, z]}
    film = {"centre": [0.1, 0.05, z - 0.01], "right": [0.01, 0, 0], "down": [0, -0.01, 0], "size": [1, 1]}
    path = explain_pixel(make_scene(*bubble(), source=source, film=film), 0, 0)
    assert (path.inside, path.solids) == (inside, solids)
    assert path.events[0].before == inside
    assert path.total == {0.1: 2, -0.4: 1, 2.0: 4, 0.3: 2, -0.1: 1}[z]


def test_rays_that_end_at_a_surface_name_what_lies_behind_it() -> None:
    coin = one_ray(*bubble(absorbs=True))
    assert coin.status is RayStatus.BLOCKED
    assert media(coin)[-1] == ("entry", "lens.bubble", "lens.glass", "lens.bubble")
    trapped = one_ray(*doublet(), numerics={"max_events": 2})
    assert trapped.status is RayStatus.TRAPPED
    assert media(trapped)[-1] == ("cemented", "lens.crown", "lens.crown", "lens.flint")
