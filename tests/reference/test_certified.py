"""Certified first roots against closed forms, where the answer is known to the last bit."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from lenscl.errors import LensclError
from lenscl.expr import parse
from lenscl.lenses import catalogue, surface, user_surface
from lenscl.reference import certified, sign_polynomial

flint = pytest.importorskip("flint", reason="python-flint, of the extra `accuracy`, is not installed")

BALL = surface("sphere").expression
UNIT_BALL = {"r": 1.0}


def implicit(text: str) -> Any:
    return parse(text, ["x", "y", "z"])


def rational(value: Any) -> Any:
    return flint.fmpq(*value.as_integer_ratio())


def ball_quadratic(o: np.ndarray, d: np.ndarray, r: float) -> tuple[Any, Any, Any]:
    """Coefficients a, b, c of a t^2 + 2 b t + c, exactly."""
    o_exact, d_exact = [rational(v) for v in o], [rational(v) for v in d]
    a = sum(v * v for v in d_exact)
    b = sum(u * v for u, v in zip(o_exact, d_exact, strict=True))
    return a, b, sum(v * v for v in o_exact) - rational(r) ** 2


def test_a_ball_is_met_where_the_quadratic_formula_says_to_thirty_digits() -> None:
    rng = np.random.default_rng(20)
    counts = {"meets": 0, "misses": 0, "from inside": 0}
    for _ in range(400):
        o, r = rng.normal(size=3) * 2, float(rng.uniform(0.5, 2.0))
        d = rng.normal(size=3) - o
        a, b, c = ball_quadratic(o, d, r)
        proof = certified.first_root(BALL, {"r": r}, o, d, 50.0, inside=bool(c < 0))
        assert proof.holds
        if b * b - a * c < 0 or (c > 0 and b > 0):
            counts["misses"] += 1
            assert not proof.roots
            continue
        with flint.ctx.workprec(300):
            root = flint.arb(b * b - a * c).sqrt()
            expected = (-flint.arb(b) + (root if c < 0 else -root)) / flint.arb(a)
            assert abs(proof.crossing.t - expected) < flint.arb("1e-30")
        assert proof.crossing.multiplicity == 1
        assert proof.crossing.t.overlaps(expected)
        assert proof.crossing.distance(float(proof.crossing.t)) < 1e-15
        assert len(proof.roots) == (1 if c < 0 else 2)
        counts["from inside" if c < 0 else "meets"] += 1
    assert min(counts.values()) > 25, counts


def departure_fault(first_root: Callable[..., certified.Certified]) -> str | None:
    """Rays off a ball, from rounded points: the other root of t (a t + 2 b) is exactly -2 b / a."""
    rng = np.random.default_rng(21)
    for _ in range(200):
        o, d = rng.normal(size=3), rng.normal(size=3)
        o /= np.linalg.norm(o)
        a, b, c = ball_quadratic(o, d, 1.0)
        if c == 0:
            continue
        proof = first_root(BALL, UNIT_BALL, o, d, 50.0, departs=True, inside=bool(b < 0))
        if not proof.holds:
            return "the side is wrong after departing"
        if len(proof.roots) != int(b < 0):
            return f"{len(proof.roots)} roots after departing"
        if b < 0 and not proof.crossing.encloses(-2 * b / a):
            return "the other root is not where it was"
    return None


def test_a_ray_that_departs_does_not_meet_the_point_that_it_departs_from() -> None:
    assert departure_fault(certified.first_root) is None


def test_without_the_known_root_removed_departing_rays_would_be_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(certified, "_departed", lambda tree: [p.same_sign() for p in certified.leaves(tree)])
    assert departure_fault(certified.first_root) is not None


def tangent_fault(first_root: Callable[..., certified.Certified]) -> str | None:
    """Touches and crossings of exact rationals: (F, ray in x, touch, crossing), None where there is none."""
    cases: list[tuple[str, float, tuple[float, int] | None, tuple[float, int] | None]] = [
        ("x^2 + y^2 + z^2 - 1", 1.0, (3.0, 2), None),  # past the unit ball at y = 1
        ("(x + 1)^2*(2 - x)", 0.0, (2.0, 2), (5.0, 1)),
        ("(x + 1)^4*(2 - x)^3", 0.0, (2.0, 4), (5.0, 3)),
        ("-(x + 1)^3*(x - 2)^2", 0.0, None, (2.0, 3)),
        ("(x + 1)^2*(x - 2)^2 + y", 0.0, (2.0, 2), None),
    ]
    for text, y, touch, crossing in cases:
        proof = first_root(implicit(text), {}, (-3.0, y, 0.0), (1.0, 0.0, 0.0), 10.0)
        for name, root, expected in (("touch", proof.touch, touch), ("crossing", proof.crossing, crossing)):
            if (root is None) != (expected is None):
                return f"{text}: {name} is {root}, expected {expected}"
            if root is not None and expected is not None:
                place, multiplicity = expected
                if not root.encloses(place) or root.multiplicity != multiplicity:
                    return f"{text}: {name} is {root}, expected {expected}"
    return None


def test_a_touch_is_told_from_a_crossing() -> None:
    assert tangent_fault(certified.first_root) is None


def test_ignoring_multiplicity_would_be_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(certified.Root, "crosses", True)
    assert tangent_fault(certified.first_root) is not None
    monkeypatch.undo()
    monkeypatch.setattr(certified, "_multiplicity", lambda factors, low, high: 1)
    assert tangent_fault(certified.first_root) is not None


@pytest.mark.parametrize("ulps", [-1, 0, 1])
def test_a_tangent_ray_is_decided_to_the_last_ulp(ulps: int) -> None:
    y = 1.0 + ulps * 2.0**-53 * (1 if ulps < 0 else 2)
    proof = certified.first_root(BALL, UNIT_BALL, (-3.0, y, 0.0), (1.0, 0.0, 0.0), 10.0)
    assert [root.crosses for root in proof.roots] == {-1: [True, True], 0: [False], 1: []}[ulps]
    assert proof.holds
    if ulps < 0:  # a chord of half length sqrt(1 - y^2)
        assert float(proof.crossing.t) == pytest.approx(3.0 - math.sqrt((1 - y) * (1 + y)), abs=1e-15)


@pytest.mark.parametrize("k", range(1, 13))
def test_a_slab_however_thin_is_entered_and_left(k: int) -> None:
    h = float(f"1e-{k}")
    slab = parse("max(z^2 - h^2, x^2 + y^2 - 4)", ["x", "y", "z", "h"])
    o, d = (0.3, -0.1, 1.0), (0.11, 0.07, -0.9)
    proof = certified.first_root(slab, {"h": h}, o, d, 3.0)
    enter, leave = ((1 - side * rational(h)) / rational(0.9) for side in (1, -1))
    assert [root.encloses(t) for root, t in zip(proof.roots, (enter, leave), strict=True)] == [True, True]
    assert proof.holds
    assert [root.multiplicity for root in proof.roots] == [1, 1]

    # From the rounded point inside: F(t) - F(0) has its other root at -2 z / dz exactly
    t = int(enter.p) / int(enter.q)
    start = tuple(a + t * b for a, b in zip(o, d, strict=True))
    proof = certified.first_root(slab, {"h": h}, start, d, 3.0, departs=True, inside=True)
    assert proof.holds
    assert proof.crossing.encloses(2 * rational(start[2]) / rational(0.9))
    assert len(proof.roots) == 1


def test_only_roots_ahead_and_up_to_the_length_count() -> None:
    def ts(o: float, length: float) -> list[float]:
        return [
            float(root.t)
            for root in certified.first_root(BALL, UNIT_BALL, (o, 0.0, 0.0), (1.0, 0.0, 0.0), length).roots
        ]

    assert ts(-3.0, 4.0) == [2.0, 4.0]  # the end is included
    assert ts(-3.0, math.nextafter(4.0, 0)) == [2.0]
    assert ts(-3.0, math.nextafter(2.0, 0)) == []
    assert ts(-3.0, 0.0) == []
    assert ts(-1.0, 5.0) == [2.0]  # the root at 0 is not
    assert ts(1.0, 5.0) == []

    # The end one ulp before or beyond an irrational root
    third, below = Fraction(1, 3), Fraction(math.sqrt(2))
    while below**2 > 2:
        below = Fraction(math.nextafter(float(below), 0))
    for end, count in ((below, 0), (Fraction(math.nextafter(float(below), 9)), 1)):
        roots = certified.first_root(implicit("x^2 - 2"), {}, (third, 0, 0), (1, 0, 0), end - third).roots
        assert len(roots) == count


def test_enclosures_are_narrow_however_close_or_far_the_roots() -> None:
    checked = 0
    for place in (1e-12, 1.0, 1e12):
        for gap in (1.0, 1e-8, 2.0**-52):
            F = parse("(x - a)*(x - b)*(x^2 + 1)", ["x", "y", "z", "a", "b"])
            a, b = place, place * (1 + gap)
            roots = certified.first_root(F, {"a": a, "b": b}, (0, 0, 0), (1, 0, 0), 10 * place).roots
            assert [root.encloses(v) for root, v in zip(roots, (a, b), strict=True)] == [True, True]
            for root in roots:
                assert root.t.rad() * flint.arb(2) ** 80 <= root.t
                checked += 1
    assert checked == 18


def test_minima_and_maxima_follow_the_piece_that_counts() -> None:
    cube = implicit("max(abs(x), abs(y), abs(z)) - 1")
    shell = implicit("max(x^2 + y^2 + z^2 - 4, -(x^2 + y^2 + z^2 - 1))")
    pair = implicit("min((x - 1)^2 + y^2 + z^2 - 1/4, (x - 3)^2 + y^2 + z^2 - 1/4)*2 + 1/8")
    ahead = (1, 0, 0)

    def signs(F: Any, o: Any, d: Any = ahead) -> list[tuple[float, int, int]]:
        return [(float(root.t), root.before, root.after) for root in certified.first_root(F, {}, o, d, 20.0).roots]

    assert signs(cube, (-3, 0.5, 0)) == [(2.0, 1, -1), (4.0, -1, 1)]
    assert signs(cube, (-3, 2, 0), (1, -1, 0)) == [(2.0, 1, -1), (3.0, -1, 1)]
    assert signs(cube, (-1, 3, 0), (1, -1, 0)) == [(2.0, 1, 1)]  # along the edge x = y = 1: touched
    assert signs(cube, (-3, 2, 0)) == []
    assert signs(shell, (-5, 0, 0)) == [(3.0, 1, -1), (4.0, -1, 1), (6.0, 1, -1), (7.0, -1, 1)]
    half = math.sqrt(0.25 - 1 / 16)
    found = signs(pair, (0, 0, 0))
    np.testing.assert_allclose([t for t, *_ in found], [1 - half, 1 + half, 3 - half, 3 + half], rtol=1e-15)
    assert [(before, after) for _, before, after in found] == [(1, -1), (-1, 1)] * 2


def test_a_spindle_torus_has_its_inner_sheet_in_the_quartic_only() -> None:
    torus, values = surface("torus"), {"R": 0.5, "r": 1.0}
    ray = ((0.0, 0.0, -3.0), (0.01, 0.02, 1.0), 10.0)
    quartic = sign_polynomial(torus)
    assert quartic is not None
    assert [root.crosses for root in certified.first_root(torus.expression, values, *ray).roots] == [True, True]
    assert len(certified.first_root(quartic, values, *ray).roots) == 4

    values = {"R": 1.0, "r": 0.5}
    ray = ((-3.0, 0.1, 0.2), (1.0, 0.01, 0.02), 10.0)
    both = [certified.first_root(F, values, *ray).roots for F in (torus.expression, quartic)]
    assert len(both[0]) == len(both[1]) == 4
    assert all(a.t.overlaps(b.t) for a, b in zip(*both, strict=True))


def test_the_heart_and_its_sextic_have_the_same_roots() -> None:
    heart = surface("heart")
    sextic = sign_polynomial(heart)
    assert sextic is not None
    rng = np.random.default_rng(22)
    checked = 0
    for _ in range(60):
        o = rng.normal(size=3)
        o *= 3 / np.linalg.norm(o)
        d = rng.uniform(-0.7, 0.7, size=3) - o
        both = [certified.first_root(F, {}, o, d, 2.0) for F in (heart.expression, sextic)]
        assert both[0].start == both[1].start == 1
        assert len(both[0].roots) == len(both[1].roots)
        for a, b in zip(both[0].roots, both[1].roots, strict=True):
            assert a.t.overlaps(b.t)
            assert (a.before, a.after) == (b.before, b.after)
            checked += 1
    assert checked > 60


def test_the_heart_is_left_from_its_equator_without_a_second_root_there() -> None:
    heart, rng = surface("heart").expression, np.random.default_rng(23)
    stays = goes = 0
    for _ in range(60):
        angle = rng.uniform(0, 2 * math.pi)
        x, y = math.cos(angle) / math.sqrt(2), math.sin(angle) / math.sqrt(2)  # A = 0, rounded; z = 0 exactly
        d = rng.normal(size=3)
        inward = 4 * (x * d[0] + y * d[1]) - math.cbrt(0.1 * x * x + y * y) * d[2]  # dG/dt
        proof = certified.first_root(heart, {}, (x, y, 0.0), d, 9.0, departs=True, inside=inward < 0)
        assert proof.start == (-1 if inward < 0 else 1)
        assert all(float(root.t) > 1e-6 for root in proof.roots)
        stays, goes = stays + (inward < 0), goes + (inward > 0)
    assert min(stays, goes) > 10


def test_singular_points_have_their_multiplicity() -> None:
    bifolia = surface("bifolia").expression
    proof = certified.first_root(bifolia, {}, (0.0, -1.0, 0.0), (0.0, 1.0, 0.0), 5.0)  # along its axis
    assert proof.crossing is None
    assert (float(proof.touch.t), proof.touch.multiplicity) == (1.0, 4)
    assert proof.holds

    sextic = sign_polynomial(surface("heart"))
    proof = certified.first_root(sextic, {}, (-3.0, Fraction(7, 10), 0.0), (1.0, 0.0, 0.0), 9.0)
    assert [root.multiplicity for root in proof.roots] == [3, 3]  # A^3 in the plane z = 0
    assert [root.crosses for root in proof.roots] == [True, True]
    assert [float(root.t) for root in proof.roots] == pytest.approx([2.9, 3.1], abs=1e-15)


def test_where_the_surface_is_flat_along_the_ray_nothing_is_claimed() -> None:
    ray = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 5.0)
    proof = certified.first_root(implicit("y"), {}, *ray)
    assert (proof.start, proof.roots, proof.holds) == (0, (), False)
    proof = certified.first_root(implicit("max(y, x - 1)"), {}, *ray)
    assert (proof.crossing, proof.touch, proof.holds) == (None, None, False)
    assert [(float(root.t), root.before, root.after) for root in proof.roots] == [(1.0, 0, 1)]
    proof = certified.first_root(implicit("y*(x - 1)"), {}, *ray)
    assert (proof.start, proof.roots, proof.holds) == (0, (), False)
    proof = certified.first_root(implicit("min(max(y, x - 1), max(y, x - 2))"), {}, *ray)  # x = 1 is nothing
    assert [(float(root.t), root.before, root.after) for root in proof.roots] == [(2.0, 0, 1)]
    proof = certified.first_root(implicit("x^2 + 1"), {}, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 5.0)
    assert (proof.start, proof.roots, proof.holds) == (1, (), True)


def test_a_ray_on_the_wrong_side_is_seen() -> None:
    for x, inside in ((0.0, True), (-3.0, False)):
        ray = ((x, 0.0, 0.0), (1.0, 0.0, 0.0), 1.5)
        assert certified.first_root(BALL, UNIT_BALL, *ray, inside=inside).holds
        assert not certified.first_root(BALL, UNIT_BALL, *ray, inside=not inside).holds


def test_sign_polynomials_have_the_sign_of_the_surface() -> None:
    from lenscl.expr import evaluate

    rng = np.random.default_rng(24)
    checked = []
    for row in catalogue().values():
        values = {each.name: each.default for each in row.parameters}
        equivalent = sign_polynomial(row)
        if equivalent is None:
            continue
        low, high = np.array(row.box(values))
        wider = 0.05 * (high - low)  # a cuboid fills its own box
        points = dict(zip("xyz", rng.uniform(low - wider, high + wider, size=(3000, 3)).T, strict=True))
        signs = [np.sign(evaluate(F, {**values, **points})) for F in (row.expression, equivalent)]
        np.testing.assert_array_equal(*signs)
        assert {-1.0, 1.0} <= set(signs[0])
        checked.append(row.name)
    assert checked == [
        *("sphere", "ellipsoid", "torus", "heart", "bifolia", "barth_sextic"),
        *("biconvex", "plano_convex", "meniscus", "ball", "rod"),
        *("biconcave", "half_ball", "drum", "box", "polyhedron"),
    ]
    box = ((-1.0,) * 3, (1.0,) * 3)
    assert sign_polynomial(user_surface("max(abs(x)/k, y^2) - 1/2", ["k"], box)) is not None
    assert sign_polynomial(user_surface("2*max(x, y)*k - abs(z)", ["k"], box)) is not None
    for text in (
        "1/(x^2 + 1) - y",
        "x*max(y, z) - 1",
        "(abs(x) - z)^2 - y",
        "abs(x)*abs(y) - z",
        "x*(1 + min(y, z)) - 1",
    ):
        assert sign_polynomial(user_surface(text, [], box)) is None


@pytest.mark.parametrize("text", ["sin(x) + y", "x/(y + 2)", "sqrt(x^2 + y^2) - 1", "abs(x)*y - 1", "cbrt(x)^2 - y"])
def test_what_no_polynomial_decides_is_refused_by_name(text: str) -> None:
    with pytest.raises(LensclError, match="no polynomial decides the sign of"):
        certified.first_root(implicit(text), {}, (0.1, 0.2, 0.3), (1.0, 2.0, 3.0), 5.0)


def test_a_parameter_that_divides_by_zero_is_refused() -> None:
    F = parse("x/(k - 1) - y", ["x", "y", "z", "k"])
    assert certified.first_root(F, {"k": 2.0}, (0, 1, 0), (1, 0, 0), 5.0).crossing is not None
    with pytest.raises(LensclError, match="no polynomial decides the sign of"):
        certified.first_root(F, {"k": 1.0}, (0, 1, 0), (1, 0, 0), 5.0)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_number_that_is_not_finite_is_refused(bad: float) -> None:
    for ray in (((bad, 0, 0), (1, 0, 0), 1.0), ((0, 0, 0), (1, bad, 0), 1.0), ((0, 0, 0), (1, 0, 0), bad)):
        with pytest.raises(LensclError, match="must be finite"):
            certified.first_root(BALL, UNIT_BALL, *ray)


def test_the_reference_imports_without_flint_and_says_what_is_missing() -> None:
    program = """
import sys
sys.modules["flint"] = None
from lenscl.lenses import surface
from lenscl.reference import certified
try:
    certified.first_root(surface("sphere").expression, {"r": 1.0}, (0, 0, 3), (0, 0, -1), 9.0)
except Exception as error:
    print(type(error).__name__, error)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("LensclError certified answers need python-flint")
    assert "lenscl[accuracy]" in done.stdout
    silent = "import sys, lenscl.reference; print('flint' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", silent], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
