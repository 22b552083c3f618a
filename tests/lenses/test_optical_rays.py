"""Every event of rays through the solids of optics is the one of closed forms: none missed, none invented."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from lenses import analytic
from numpy.typing import NDArray
from scenes import OPTICS, make_scene

from lenscl import RayStatus, trace_rays
from lenscl.lenses import surface

Array = NDArray[Any]
RAYS = 6000
MOST = 16

CASES: list[tuple[str, dict[str, float]]] = [
    *((name, {}) for name in OPTICS),
    ("biconvex", {"R1": 0.5, "R2": 0.7, "thickness": 3.0, "diameter": 1.0}),  # longer than its balls
    ("biconvex", {"R1": 1e4, "R2": 1e4, "thickness": 1e-3, "diameter": 1.0}),
    ("plano_convex", {"R": 0.7, "thickness": 0.7, "diameter": 1.4}),  # half a ball
    ("meniscus", {"R1": 1.8, "R2": 0.9, "thickness": 0.1, "diameter": 1.6}),
    ("rod", {"diameter": 0.1, "length": 3.0}),
    ("prism", {"apex": 2.0, "side": 1.0, "length": 0.5}),
    ("prism", {"apex": 90.0, "side": 1.0, "length": 0.5}),
    ("cone", {"diameter": 1.0, "height": 2.0}),
    ("cone", {"diameter": 2.0, "height": 0.02}),
    ("conic_singlet", {"c1": 0.0, "c2": -1.0, "k2": -2.25, "diameter": 1.6}),
    ("conic_singlet", {"c1": -1.0, "k1": -3.0, "c2": 1.2, "k2": 0.3, "thickness": 0.1}),  # the other sheets are near
    ("conic_singlet", {"c1": 1.0, "k1": 1.0, "c2": -1.0, "thickness": 2.5, "diameter": math.sqrt(2)}),
    ("even_asphere_singlet", {"A4": 0.1, "A6": -0.05, "B4": 0.05, "B8": 0.1}),
    ("even_asphere_singlet", {"c1": 0.0, "A4": -0.3, "A6": 0.4, "c2": 0.5, "B4": -0.2, "B6": -0.1, "B8": 0.1}),
]
EACH = pytest.mark.parametrize(
    ("name", "given"), CASES, ids=lambda v: v if isinstance(v, str) else "-".join(map(str, v.values())) or "default"
)


def values_of(name: str, given: dict[str, float]) -> dict[str, float]:
    row = surface(name)
    values = {parameter.name: parameter.default for parameter in row.parameters} | given
    assert list(row.problems(values)) == []
    return values


def aimed(name: str, values: dict[str, float], count: int, seed: int) -> tuple[Array, Array]:
    """Return rays from outside at points of the box; a half keeps within some 30 degrees of the axis."""
    rng = np.random.default_rng(seed)
    low, high = (np.array(corner) for corner in surface(name).box(values))
    d = rng.normal(size=(count, 3))
    d[::2, 2] += np.where(d[::2, 2] < 0.0, -4.0, 4.0)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    return rng.uniform(low, high, (count, 3)) - 2.0 * np.linalg.norm(high - low) * d, d


def edge_points(name: str, values: dict[str, float], rng: np.random.Generator, count: int) -> Array:
    """Return points of the edges: circles about z, the prism's nine lines, the cone's tip."""
    if name == "prism":
        half = math.radians(values["apex"] / 2)
        height, base, x = values["side"] * math.cos(half), values["side"] * math.sin(half), values["length"] / 2
        ring = [(2 * height / 3, 0.0), (-height / 3, base), (-height / 3, -base)]
        lines = [((-x, *p), (x, *p)) for p in ring]
        lines += [((end, *ring[i - 1]), (end, *ring[i])) for end in (-x, x) for i in range(3)]
        pick = rng.integers(9, size=count)
        start, stop = (np.array(ends)[pick] for ends in zip(*lines, strict=True))
        return start + rng.random((count, 1)) * (stop - start)
    radius = np.full(count, values["diameter"] / 2)
    faces = analytic.FACES[name](values)
    heights = {
        "rod": lambda: [-values["length"] / 2, values["length"] / 2],
        "cone": lambda: [-values["height"] / 2],
    }.get(name, lambda: [float(f.vertex + f.sag(radius[:1] ** 2)[0]) for f in faces if isinstance(f, analytic.Sag)])()
    z = np.array(heights)[rng.integers(len(heights), size=count)]
    if name == "cone":
        tip = rng.random(count) < 0.3
        radius, z = np.where(tip, 0.0, radius), np.where(tip, values["height"] / 2, z)
    turn = rng.uniform(0.0, 2 * np.pi, count)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), z], 1)


def compared(name: str, values: dict[str, float], o: Array, d: Array, n: float, **how: Any) -> tuple[Any, Any, Array]:
    """Return the program's paths, those of closed forms, and the rays that rounding does not decide."""
    scene = make_scene({"surface": name, "n": n, **values}, numerics={"max_events": MOST})
    want = analytic.trace(analytic.FACES[name](values), o, d, n, 1.0, MOST)
    return trace_rays(scene, o, d, **how), want, ~want.unsure


@EACH
def test_events_ends_and_directions_are_those_of_closed_forms(name: str, given: dict[str, float]) -> None:
    values = values_of(name, given)
    rays = RAYS if not any(value for key, value in values.items() if key[0] in "AB") else RAYS // 6  # slow to sample
    o, d = aimed(name, values, rays, 1)
    for n in (1.0, 1.5):
        got, want, sure = compared(name, values, o, d, n)
        assert (~sure).sum() <= 5
        assert (want.events > 0).sum() > rays // 2
        assert not (got.status == RayStatus.UNDECIDED).any()
        np.testing.assert_array_equal(got.events[sure], want.events[sure])
        # A ray whose many reflections each widen its error
        few = sure & (want.events <= 4)
        assert np.abs(got.origin - want.origin)[few].max() < 1e-10
        assert np.abs(got.direction - want.direction)[few].max() < 1e-10
        met = few & (want.events > 0)
        assert np.median(np.abs(got.origin - want.origin)[met].max(1)) < 1e-15
        if n > 1.0 and name != "ball":
            assert want.reflected.sum() > 10, "total reflection is exercised"


@pytest.mark.parametrize("name", OPTICS)
def test_single_precision_misses_and_invents_nothing_either(name: str) -> None:
    values = values_of(name, {})
    o, d = aimed(name, values, RAYS, 2)
    got, want, sure = compared(name, values, o, d, 1.5, precision="single")
    few = sure & (want.events <= 4)
    differ = few & (got.events != want.events)
    assert (got.status[few] == RayStatus.UNDECIDED).sum() == 0
    assert differ.sum() <= few.sum() // 500  # its rounding tells on which side of an edge a ray passes
    error = np.abs(got.origin - want.origin)[few & ~differ].max(1)
    assert np.quantile(error, 0.99) < 1e-4


@pytest.mark.parametrize("name", [name for name in OPTICS if name not in ("ball", "even_asphere_singlet")])
def test_rays_aimed_at_edges_are_right_or_undecided(name: str) -> None:
    values = values_of(name, {})
    rng = np.random.default_rng(3)
    _, d = aimed(name, values, RAYS, 4)
    off = 10.0 ** rng.uniform(-17, -2, (RAYS, 1))
    p = edge_points(name, values, rng, RAYS) + off * rng.normal(size=(RAYS, 3))
    for n in (1.0, 1.5):
        got, want, sure = compared(name, values, p - 4.0 * d, d, n)
        undecided = got.status == RayStatus.UNDECIDED
        assert undecided.sum() < 0.25 * RAYS
        assert (undecided & (off[:, 0] > 1e-12)).sum() <= RAYS // 500, "only in the edge itself"
        assert (sure & ~undecided).sum() > RAYS // 4
        wrong = sure & ~undecided & (got.events != want.events)
        assert not wrong.any()


def test_a_lens_wider_by_a_billionth_would_be_seen() -> None:
    values = values_of("biconvex", {})
    o, d = aimed("biconvex", values, RAYS, 1)
    _, want, sure = compared("biconvex", values, o, d, 1.5)
    for key in ("R1", "R2", "thickness", "diameter"):
        got, _, _ = compared("biconvex", values | {key: values[key] * (1 + 1e-9)}, o, d, 1.5)
        few = sure & (want.events <= 4) & (got.events == want.events)
        assert np.abs(got.origin - want.origin)[few].max() > 1e-10


def test_closed_forms_without_a_face_would_be_seen() -> None:
    values = values_of("meniscus", {})
    o, d = aimed("meniscus", values, RAYS, 1)
    faces = analytic.FACES["meniscus"](values)
    got, want, sure = compared("meniscus", values, o, d, 1.5)
    np.testing.assert_array_equal(got.events[sure], want.events[sure])
    for left_out in range(3):
        other = analytic.trace([f for i, f in enumerate(faces) if i != left_out], o, d, 1.5, 1.0, MOST)
        assert (other.events != got.events).sum() > 100
