from __future__ import annotations

import mpmath
import numpy as np
import pytest
import sympy

from lenscl.expr import OPERATIONS, differentiate, evaluate, gradient, parse, polynomial, symbol

NAMES = ["x", "y", "z", "R", "r"]
SMOOTH = [
    "(x^2 + y^2 + z^2 + R^2 - r^2)^2 - 4*R^2*(x^2 + y^2)",
    "2*x^2 + 2*y^2 + z^2 - 1 - z*cbrt(x^2/10 + y^2)",
    "(R - sqrt(x^2 + y^2))^2 + z^2 - r^2",
    "exp(-x^2/2)*sin(3*y)*cos(z) - tanh(x*z)/(2 + y^2)",
    "log(1 + x^2) + atan2(y, 3 + x) + tan(0.2*z)",
    "(1 + x^2)^0.7 + (2 + y^2)^(x*z) - (3 + z^2)^-3",
    "-(-x)^3*(2*y)^5/(4*x^2 + 1) - (x - y)/(-2*z^2 - 1)",
]
POLYNOMIALS = [
    "(x^2 + y^2 + z^2 + R^2 - r^2)^2 - 4*R^2*(x^2 + y^2)",
    "(x^2 + y^2 + z^2)^2 - 3*y*(x^2 + z^2)",
    "4*(2.5*x^2 - y^2)*(2.5*y^2 - z^2)*(2.5*z^2 - x^2) - (x^2 + y^2 + z^2 - 1)^2",
    "-(x - 2*y)^7/(R + 3) + sqrt(R)*z",
    "x - x",
    "R^2 - 1",
]


def _sympy(text):
    return sympy.sympify(text.replace("^", "**"), locals={name: sympy.Symbol(name, real=True) for name in NAMES})


@pytest.mark.parametrize("text", SMOOTH)
def test_gradients_agree_with_sympy(text):
    rng = np.random.default_rng(5)
    values = {name: rng.uniform(0.1, 1.5, 50) * rng.choice([-1, 1], 50) for name in ["x", "y", "z"]}
    values |= {"R": np.full(50, 0.7), "r": np.full(50, 0.25)}
    for name, got in zip("xyz", gradient(parse(text, NAMES)), strict=True):
        want = sympy.lambdify(NAMES, sympy.diff(_sympy(text), sympy.Symbol(name, real=True)), "mpmath")
        for k, value in enumerate(evaluate(got, values)):
            expected = float(want(*(mpmath.mpf(float(values[each][k])) for each in NAMES)))
            assert value == pytest.approx(expected, rel=1e-11, abs=1e-12)


def test_the_derivative_of_every_row_is_its_slope(sample, exact):
    values = sample.points(np.random.default_rng(6), 40)
    checked = 0
    for name in sample.domain:
        got = evaluate(differentiate(sample.expr, name), values)
        for k, slope in enumerate(got):
            at = {each: float(column[k]) for each, column in values.items()}
            with mpmath.workdps(40):
                want = mpmath.diff(lambda t, at=at, name=name: exact(sample.expr, {**at, name: t}), at[name])
            assert slope == pytest.approx(float(want), rel=1e-9, abs=1e-9), (name, at)
            checked += 1
    assert checked == 40 * len(sample.domain)


def test_a_wrong_derivative_in_the_table_would_be_seen(sample, exact):
    """The broken twin: half the derivative fails the comparison that the test above makes."""
    values = sample.points(np.random.default_rng(6), 40)
    if sample.name in ("sign", "floor"):
        pytest.skip("its slope is 0, and so is half of it")
    name = next(iter(reversed(sample.domain)))
    half = 0.5 * evaluate(differentiate(sample.expr, name), values)
    slopes = []
    for k in range(40):
        at = {each: float(column[k]) for each, column in values.items()}
        with mpmath.workdps(40):
            slopes.append(float(mpmath.diff(lambda t, at=at: exact(sample.expr, {**at, name: t}), at[name])))
    assert not np.allclose(half, slopes, rtol=1e-9, atol=1e-9)


def test_branches_have_the_derivative_of_the_side_they_are_on():
    values = {"x": np.array([-2.0, -0.5, 0.5, 2.0]), "y": 1.0}
    for text, want in {
        "abs(x)": [-1, -1, 1, 1],
        "min(x^2, 1)": [0, -1, 1, 0],
        "max(x^2, 1)": [-4, 0, 0, 4],
        "max(x, min(-x, y), 0)": [0, -1, 1, 1],
    }.items():
        np.testing.assert_array_equal(evaluate(differentiate(parse(text, NAMES), "x"), values), want)


def test_min_and_max_keep_their_sum_in_derivatives_at_ties():
    F = parse("min(x, y) + max(x, y)", NAMES)
    for name in "xy":
        assert evaluate(differentiate(F, name), {"x": 1.0, "y": 1.0}) == 1.0


def test_what_does_not_depend_on_a_symbol_has_slope_zero_and_no_nan():
    F = parse("cbrt(y) + sqrt(y) + log(y)", NAMES)
    assert str(differentiate(F, "x")) == "0"


@pytest.mark.parametrize("text", POLYNOMIALS)
def test_coefficients_along_a_ray_agree_with_sympy(text):
    along = {name: (symbol(f"o{name}"), symbol(f"d{name}")) for name in "xyz"}
    got = polynomial(parse(text, NAMES), along)
    assert got is not None
    t = sympy.Symbol("t")
    replaced = _sympy(text).subs(
        {sympy.Symbol(k, real=True): sympy.Symbol(f"o{k}") + t * sympy.Symbol(f"d{k}") for k in "xyz"},
        simultaneous=True,
    )
    want = sympy.Poly(sympy.expand(replaced), t).all_coeffs()[::-1]
    assert len(got) == len(want)
    rng = np.random.default_rng(7)
    names = [*(f"o{k}" for k in "xyz"), *(f"d{k}" for k in "xyz"), "R", "r"]
    values = {name: rng.uniform(0.2, 1.0) for name in names}
    for c, expected in zip(got, want, strict=True):
        number = expected.subs({each: values[each.name] for each in expected.free_symbols})
        assert float(evaluate(c, values)) == pytest.approx(float(number), rel=1e-11, abs=1e-12)


@pytest.mark.parametrize("text", ["sqrt(x)", "1/x", "min(x, y)", "sin(x) + x^2", "abs(x)^2", "x^0.5", "R^x"])
def test_what_is_no_polynomial_has_no_coefficients(text):
    assert polynomial(parse(text, NAMES), {"x": (symbol("ox"), symbol("dx"))}) is None


def test_every_row_is_covered_here():
    assert len(OPERATIONS) == 30
