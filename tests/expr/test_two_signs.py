"""Two signs in a row: C reads `--2.0` as an operator of its own, which no number can be given to."""

from __future__ import annotations

import re

import pytest

from lenscl.expr import c_text, gradient, parse

FORMULAS = ("-log(1/(z^2 + 0.2 + sqrt(x^2 + y^2)))", "0.5 - log(1/(z^2 + 1))")


@pytest.mark.parametrize("formula", FORMULAS)
def test_no_sign_stands_before_another(formula: str) -> None:
    expression = parse(formula, "xyz")
    slopes = gradient(expression)
    outputs = {"value": expression, "dx": slopes[0], "dy": slopes[1], "dz": slopes[2]}
    written = c_text(outputs, symbols={name: f"p.{name}" for name in "xyz"}, lanes="xyz", precision="double")
    text = " ".join((*written.statements, *written.results.values()))
    assert len(re.findall(r"\bp\.[xyz]\b", text)) > 2
    assert "--" not in text
