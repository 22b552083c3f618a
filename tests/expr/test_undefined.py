"""Which operation lacks a value, against what numpy makes of the operand by hand."""

from __future__ import annotations

import numpy as np
import pytest

from lenscl.expr import evaluate, parse, why_undefined

AT = {"x": -0.5, "y": 0.0, "z": 2.0}
CASES = [
    ("x^2 + sqrt(x) + y", "the square root of x = -0.5", "sqrt(max(x, 0))"),
    ("z - sqrt(1 - z^2) + sqrt(x)", "the square root of 1 - z^2 = -3", "sqrt(max(1 - z^2, 0))"),
    ("log(y) + z", "the logarithm of y = 0", "log(max(y, 1e-9))"),
    ("abs(log(x)) - 1", "the logarithm of x = -0.5", "log(max(x, 1e-9))"),
    ("x^1.5 + z", "the power 1.5 of x = -0.5", "pow(abs(x), 1.5)"),
    ("z + asin(x - 1)", "the arc sine of x - 1 = -1.5", "asin(min(max(x - 1, -1), 1))"),
    ("acos(z) - y", "the arc cosine of z = 2", "max(F, abs(z) - 1)"),
    ("z + cosh(500*z) - 1", "cosh of numbers beyond the largest", "stays small"),
    ("mod(x, y) + z", "a division by y = 0", "never 0"),
    ("z + 1/y", "a division by y = 0", "never 0"),
    ("y/(y*z) + 1", "a division by ", "never 0"),
    ("z + y^-2", "a division by y^2 = 0", "never 0"),
    ("z + y^-1.5", "a negative power of y = 0", "never 0"),
    ("1/(sqrt(x) + 1) + z", "the square root of x = -0.5", "sqrt(max(x, 0))"),
    ("exp(1000*z) - z", "exp of numbers beyond the largest", "stays small"),
]


@pytest.mark.parametrize(("text", "what", "instead"), CASES)
def test_the_operation_that_lacks_a_value_is_named_with_its_operand(text: str, what: str, instead: str) -> None:
    expression = parse(text, "xyz")
    assert not np.isfinite(evaluate(expression, AT))
    found = why_undefined(expression, AT)
    assert found is not None
    assert found[0].startswith(what)
    assert instead in found[1]


@pytest.mark.parametrize("text", ["x^2 - z", "min(z, 1/(1 + y))", "sqrt(z) + log(z)", "1/(1 + exp(1000*z))"])
def test_nothing_is_said_where_there_is_a_value(text: str) -> None:
    expression = parse(text, "xyz")
    assert np.isfinite(evaluate(expression, AT))
    assert why_undefined(expression, AT) is None
