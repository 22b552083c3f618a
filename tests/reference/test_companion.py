"""The two judges against each other: wherever the float64 one decides, the certified one agrees."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from lenscl.expr import Expr, parse
from lenscl.lenses import surface
from lenscl.reference import certified, companion, rows, sign_polynomial

pytest.importorskip("flint", reason="python-flint, of the extra `accuracy`, is not installed")

AIMED, DEPARTING = 1300, 700  # rays a surface
VALUES = {
    "sphere": {"r": 0.7},
    "ellipsoid": {"a": 1.0, "b": 0.8, "c": 0.3, "r": 1.1},
    "torus": {"R": 0.7, "r": 0.25},
    "bifolia": {},
    "heart": {},
    "barth_sextic": {"w": 1.0, "clip": 1.8},
}


@dataclass
class Rays:
    origin: np.ndarray
    direction: np.ndarray
    length: np.ndarray
    departs: np.ndarray


def rays_at(name: str, expression: Expr, seed: int, aimed: int, departing: int) -> Rays:
    """Rays from around the box to points in it, and from where some of them land to anywhere in it."""
    rng = np.random.default_rng(seed)
    low, high = (np.array(corner) for corner in surface(name).box(VALUES[name]))
    reach = np.linalg.norm(high - low) / 2
    away = unit(rng.normal(size=(aimed, 3)))
    origin = (low + high) / 2 + 1.5 * reach * away
    direction = unit(rng.uniform(low, high, size=(aimed, 3)) - origin)
    length = np.full(aimed, 3 * reach)
    judged = companion.first_roots(expression, VALUES[name], origin, direction, length)
    landed = np.flatnonzero(judged.found)[:departing]
    points = origin[landed] + judged.t[landed, None] * direction[landed]
    onward = unit(rng.uniform(low, high, size=points.shape) - points)
    kept = slice(0, AIMED)
    return Rays(
        np.concatenate([origin[kept], points]),
        np.concatenate([direction[kept], onward]),
        np.concatenate([length[kept], np.full(len(points), 2 * reach)]),
        np.arange(len(points) + len(origin[kept])) >= len(origin[kept]),
    )


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def judge(expression: Expr, values: Any, rays: Rays) -> companion.Judged:
    return companion.first_roots(expression, values, rays.origin, rays.direction, rays.length, departs=rays.departs)


def verdicts(expression: Expr, values: Any, rays: Rays, judged: companion.Judged) -> Counter[str]:
    """Count how the judges stand to each other; `disagree` must be 0."""
    counts: Counter[str] = Counter()
    for k in range(len(rays.length)):
        ray = (rays.origin[k], rays.direction[k], rays.length[k])
        proof = certified.first_root(expression, values, *ray, departs=bool(rays.departs[k]))
        crossing = proof.crossing
        counts["crossed" if crossing else "missed"] += 1
        counts["departing, crossed"] += bool(crossing and rays.departs[k])
        if judged.undecided[k]:
            counts["undecided"] += 1
            continue
        agree = bool(judged.found[k]) == (crossing is not None) and judged.before[k] == proof.start
        if agree and crossing is not None:
            agree = crossing.distance(judged.t[k]) <= judged.radius[k]
        counts["agree" if agree else "disagree"] += 1
    return counts


@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "torus", "bifolia", "heart"])
def test_the_judges_agree_on_random_rays(name: str) -> None:
    expression = sign_polynomial(surface(name))
    assert expression is not None
    rays = rays_at(name, expression, 31, 2 * AIMED, DEPARTING)
    judged = judge(expression, VALUES[name], rays)
    counts = verdicts(expression, VALUES[name], rays, judged)
    assert len(rays.length) >= 2000
    assert counts["disagree"] == 0, counts
    assert counts["undecided"] <= 4, counts  # 1 in 500: every one of them is counted here
    assert min(counts["crossed"], counts["missed"], counts["departing, crossed"]) > 200, counts
    assert np.quantile(judged.radius[judged.found], 0.99) < 1e-8


@pytest.mark.parametrize("name", ["heart", "barth_sextic", "torus"])
def test_the_judges_agree_on_forms_with_roots_and_maxima(name: str) -> None:
    expression = surface(name).expression
    rays = rays_at(name, expression, 32, 250, 150)
    counts = verdicts(expression, VALUES[name], rays, judge(expression, VALUES[name], rays))
    assert counts["disagree"] == 0, counts
    assert counts["undecided"] <= 2, counts
    assert min(counts["crossed"], counts["departing, crossed"]) > 40, counts


def near_tangents() -> tuple[Rays, np.ndarray]:
    """Rays past the unit ball, by 0 and +- 1e-1 ... 1e-16; whether each meets it."""
    past = np.concatenate([[0.0], *[[10.0**-k, -(10.0**-k)] for k in range(1, 17)]])
    origin = np.stack([np.full(past.size, -3.0), 1.0 + past, np.zeros(past.size)], axis=1)
    direction = np.tile([1.0, 0.0, 0.0], (past.size, 1))
    rays = Rays(origin, direction, np.full(past.size, 6.0), np.zeros(past.size, dtype=bool))
    return rays, origin[:, 1] < 1.0


def test_a_near_tangent_is_decided_rightly_or_left_open() -> None:
    rays, meets = near_tangents()
    judged = judge(surface("sphere").expression, {"r": 1.0}, rays)
    assert not np.any(~judged.undecided & (judged.found != meets))
    assert judged.undecided[0], "an exact double root cannot be told from a chord in float64"
    assert judged.undecided[-2:].all()
    assert not judged.undecided[1:17].any(), "down to 1e-8 the roots stand apart"


def faults_in_a_clipped_slab() -> int:
    """How many of 100 rays through a slab in a cylinder are judged wrongly; most meet both pieces' surfaces."""
    slab = parse("max(z^2 - 1/16, x^2 + y^2 - 1)", ["x", "y", "z"])
    rng = np.random.default_rng(37)
    origin = 3 * unit(rng.normal(size=(100, 3)))
    direction = unit(rng.uniform(-0.5, 0.5, size=(100, 3)) - origin)
    rays = Rays(origin, direction, np.full(100, 6.0), np.zeros(100, dtype=bool))
    counts = verdicts(slab, {}, rays, judge(slab, {}, rays))
    assert counts["crossed"] > 50, counts
    assert counts["undecided"] == 0, counts
    return counts["disagree"]


def test_rays_through_a_clipped_slab_are_judged_rightly() -> None:
    assert faults_in_a_clipped_slab() == 0


def test_discs_of_no_size_would_be_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    exact = rows._discs

    def sure(c: np.ndarray, e: np.ndarray) -> Any:
        place, _, alone = exact(c, e)
        return place, np.zeros(place.shape), alone

    monkeypatch.setattr(rows, "_discs", sure)
    monkeypatch.setattr(companion, "UNIT", 0.0)
    assert faults_in_a_clipped_slab() > 0


def test_taking_every_root_for_a_crossing_would_be_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    def alternate(self: Any, t: np.ndarray) -> np.ndarray:
        return np.broadcast_to(1 - 2 * (np.arange(t.shape[1]) % 2), t.shape).astype(np.int8)

    monkeypatch.setattr(companion._Rays, "signs", alternate)
    assert faults_in_a_clipped_slab() > 0


def departure_faults() -> int:
    """How many rays from the inside of a ball's surface are not found to leave at -2 o.d."""
    rng = np.random.default_rng(33)
    origin = unit(rng.normal(size=(500, 3)))
    direction = unit(-origin + 0.5 * rng.normal(size=origin.shape))
    inward = np.einsum("ij,ij->i", origin, direction) < -1e-3
    assert inward.sum() > 300
    origin, direction = origin[inward], direction[inward]
    rays = Rays(origin, direction, np.full(len(origin), 5.0), np.ones(len(origin), dtype=bool))
    judged = judge(surface("sphere").expression, {"r": 1.0}, rays)
    leaves = -2 * np.einsum("ij,ij->i", origin, direction)
    right = judged.found & (np.abs(judged.t - leaves) < 1e-14) & (judged.before == -1)
    return int((~right).sum())


def test_departing_rays_leave_at_the_far_side() -> None:
    assert departure_faults() == 0


def test_without_the_known_root_removed_departing_rays_would_be_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rows.Rows, "deflated", lambda self, known: self)
    assert departure_faults() > 0


@pytest.mark.parametrize("k", range(1, 13))
def test_a_thin_slab_is_judged_rightly_or_left_open(k: int) -> None:
    h = float(f"1e-{k}")
    slab = parse("z^2 - h^2", ["x", "y", "z", "h"])
    rng = np.random.default_rng(34)
    origin = rng.uniform(0.5, 1.5, size=(200, 3))
    direction = unit(np.stack([*rng.normal(size=(2, 200)), -np.ones(200)], axis=1))
    judged = companion.first_roots(slab, {"h": h}, origin, direction, 20.0)
    enter = (origin[:, 2] - h) / -direction[:, 2]
    known = judged.found
    assert not (~judged.found & ~judged.undecided)[enter < 19].any()
    assert (judged.before == 1)[known].all()
    np.testing.assert_array_less(np.abs(judged.t - enter)[known], judged.radius[known] + 1e-14)
    assert known.mean() > 0.8 if k <= 5 else True
    assert judged.undecided.mean() > 0.8 if k >= 10 else True


def test_far_rays_are_judged_on_the_chord_in_the_box() -> None:
    name = "torus"
    expression = sign_polynomial(surface(name))
    assert expression is not None
    rng = np.random.default_rng(35)
    low, high = (np.array(corner) for corner in surface(name).box(VALUES[name]))
    origin = 1e6 * unit(rng.normal(size=(150, 3)))
    direction = unit(rng.uniform(low, high, size=(150, 3)) - origin)
    nearest = -np.einsum("ij,ij->i", origin, direction)
    judged = companion.first_roots(expression, VALUES[name], origin, direction, nearest + 2.0, start=nearest - 2.0)
    whole = Rays(origin, direction, nearest + 2.0, np.zeros(150, dtype=bool))
    counts = verdicts(expression, VALUES[name], whole, judged)
    assert counts["disagree"] == 0, counts
    assert counts["agree"] > 140, counts
    assert counts["crossed"] > 50, counts


def test_rays_along_which_the_degree_falls_are_judged() -> None:
    paraboloid = parse("z - x^2 - y^2", ["x", "y", "z"])
    origin = np.array([[0.5, 0.5, -1.0], [0.5, 0.5, 1.0], [0.0, 0.0, 1.0], [3.0, 0.0, 1.0]])
    direction = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    judged = companion.first_roots(paraboloid, {}, origin, direction, 5.0)
    assert list(judged.found) == [True, False, True, False]
    assert not judged.undecided.any()
    np.testing.assert_allclose(judged.t, [1.5, 0.0, 1.0, 0.0], rtol=1e-15)
    assert list(judged.before) == [-1, 1, 1, -1]


def test_what_vanishes_along_the_ray_or_is_not_finite_is_undecided() -> None:
    plane = parse("y*(x^2 + 1)", ["x", "y", "z"])
    origin = np.array([[0.0, 0.0, 0.0], [0.0, np.nan, 0.0], [0.0, np.inf, 0.0], [0.0, -1.0, 0.0]])
    direction = np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    judged = companion.first_roots(plane, {}, origin, direction, 5.0)
    assert list(judged.undecided) == [True, True, True, False]
    assert list(judged.found) == [False, False, False, True]


def test_one_ray_and_no_ray_are_rays() -> None:
    ball = surface("sphere").expression
    judged = companion.first_roots(ball, {"r": 1.0}, np.zeros((0, 3)), np.zeros((0, 3)), 5.0)
    assert judged.t.shape == (0,)
    judged = companion.first_roots(ball, {"r": 1.0}, np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), 5.0)
    assert (bool(judged.found[0]), int(judged.before[0])) == (True, -1)
    assert judged.t[0] == pytest.approx(1.0, abs=4e-16)


def test_running_error_bounds_hold_against_exact_arithmetic() -> None:
    from fractions import Fraction

    rng = np.random.default_rng(36)
    a, b = rng.normal(size=(2, 3, 200))
    none = [np.zeros(200)] * 3
    built: dict[str, tuple[rows.Rows, Callable[[Any, Any], list[Fraction]]]] = {
        "sum": (
            rows.Rows(list(a), none) + rows.Rows(list(b), none),
            lambda u, v: [p + q for p, q in zip(u, v, strict=True)],
        ),
        "product": (
            rows.Rows(list(a), none) * rows.Rows(list(b), none),
            lambda u, v: [sum((u[i] * v[k - i] for i in range(3) if 0 <= k - i < 3), Fraction(0)) for k in range(5)],
        ),
        "moved": (
            rows.Rows(list(a), none).about(b[0], b[1]),
            lambda u, v: [u[0] + u[1] * v[0] + u[2] * v[0] ** 2, (u[1] + 2 * u[2] * v[0]) * v[1], u[2] * v[1] ** 2],
        ),
    }
    checked = 0
    for name, (got, exactly) in built.items():
        for ray in range(200):
            expected = exactly(*([Fraction(v) for v in each[:, ray]] for each in (a, b)))
            for c, e, value in zip(got.c, got.e, expected, strict=True):
                assert abs(Fraction(c[ray]) - value) <= Fraction(e[ray]) <= Fraction(1e-14), name
                checked += 1
    assert checked == 200 * 11
