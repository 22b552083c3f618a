"""Arithmetic of twice the precision, against exact fractions."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from probe import Probe

from lenscl.codegen import fragment

BODY = """
  const dd_t a = dd_sum(in_0, in_1), b = dd_sum(in_2, in_3);
  const dd_t c = dd_{}(a, b);
  out_0 = a.high; out_1 = a.low; out_2 = b.high; out_3 = b.low; out_4 = c.high; out_5 = c.low;
"""
U = Fraction(1, 2**53)
# Relative errors by Joldes, Muller and Popescu, theorems 3.1, 5.3 and 6.1 (to first order, then a little more)
CASES = {
    "add": (lambda a, b: a + b, Fraction(31, 10)),
    "subtract": (lambda a, b: a - b, Fraction(31, 10)),
    "multiply": (lambda a, b: a * b, 5),
    "divide": (lambda a, b: a / b, 15),
}


def worst(name: str, width: int, edit: tuple[str, str] = ("", "")) -> float:
    """Return the largest relative error of an operation, in units of u^2."""
    rng = np.random.default_rng(7)
    a, b = (rng.normal(size=2000) * 2.0 ** rng.integers(-40, 40, 2000) for _ in range(2))
    b[::3] = -a[::3] * (1 + 2.0 ** rng.integers(-52, -2, a[::3].size))  # sums that cancel
    low_a, low_b = (each * 2.0**-53 * rng.uniform(-1, 1, 2000) for each in (a, b))
    text = fragment("double_double.cl").replace(*edit)
    out = Probe((), BODY.format(name), 4, 6, "double", width, text)(a, low_a, b, low_b)
    exact, _ = CASES[name]
    error = Fraction(0)
    for row in out:
        first, second, third = (Fraction(row[i]) + Fraction(row[i + 1]) for i in (0, 2, 4))
        want = exact(first, second)
        if want:
            error = max(error, abs(third - want) / abs(want))
    return float(error / U**2)


@pytest.mark.parametrize("width", [1, 8, 16])
@pytest.mark.parametrize("name", CASES)
def test_the_errors_are_those_that_are_proved(name: str, width: int) -> None:
    assert 0.0 < worst(name, width) <= CASES[name][1] * 1.001


@pytest.mark.parametrize(
    ("name", "edit"),
    [
        ("add", ("b - (s - a)", "(realv)0")),
        ("multiply", ("fma(a, b, -p)", "(realv)0")),
        ("divide", ("+ (a.low - p.low)", "")),
        ("add", ("(a - (s - b_seen)) + ", "")),
    ],
)
def test_a_fault_is_seen(name: str, edit: tuple[str, str]) -> None:
    assert edit[0] in fragment("double_double.cl")
    assert worst(name, 8, edit) > 100 * CASES[name][1]


def test_what_is_exact_is_exact() -> None:
    rng = np.random.default_rng(8)
    a, b = rng.normal(size=(2, 500)) * 2.0 ** rng.integers(-30, 30, (2, 500))
    body = "const dd_t s = dd_sum(in_0, in_1), p = dd_product(in_0, in_1);"
    body += " out_0 = s.high; out_1 = s.low; out_2 = p.high; out_3 = p.low;"
    out = Probe((), body, 2, 4, "double", 8, fragment("double_double.cl"))(a, b)
    for row, first, second in zip(out, a, b, strict=True):
        assert Fraction(row[0]) + Fraction(row[1]) == Fraction(first) + Fraction(second)
        assert Fraction(row[2]) + Fraction(row[3]) == Fraction(first) * Fraction(second)
