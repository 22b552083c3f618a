"""An expression taken apart at its creases has the value it had; its leaves have none that could be taken out."""

from __future__ import annotations

import numpy as np
import pytest

from lenscl.expr import Expr, creased, evaluate, parse
from lenscl.expr.graph import walk

MOST = 8
EXPRESSIONS = {
    "x^2 + y - 1": 1,
    "abs(x) - 1": 2,
    "max(abs(sin(x)*cos(y)) - 0.3, x^2 + y^2 + z^2 - 1)": 3,
    "max(x, -max(y, z))": 3,
    "abs(abs(x) - 1) - 0.2": 4,
    "-2*max(x, y)/4 + min(z, x)": 4,
    "1 - abs(x)/-3 - min(y, z, x)": 6,
    "abs(x) + abs(y) + abs(z) - 1": 8,
    "max(x, x) + y": 1,
    "sqrt(max(x, 0)) - 1": 1,  # a function, whose operand must stay whole
    "y*max(x, z)": 1,  # a factor that may have either sign
    "max(y*max(x, z), abs(x))": 3,
    "abs(x) + abs(y) + abs(z) + abs(x - y) - 1": 1,  # too many
    "max(abs(x) + abs(y) + abs(z) + abs(x - y) - 1, z)": 2,
}


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_the_value_is_that_of_the_whole(text: str) -> None:
    expr = parse(text, "xyz")
    joined, leaves = creased(expr, MOST)
    assert len(leaves) == EXPRESSIONS[text]
    points = dict(zip("xyz", np.random.default_rng(3).normal(size=(3, 500)), strict=True))
    of_leaves = {name: evaluate(leaf, points) for name, leaf in leaves.items()}
    np.testing.assert_allclose(evaluate(joined, of_leaves), evaluate(expr, points), rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_leaves_are_joined_by_max_and_min_alone(text: str) -> None:
    joined, leaves = creased(parse(text, "xyz"), MOST)

    def ops(expr: Expr) -> set[str]:
        return {each.op for each in walk([expr])}

    assert ops(joined) <= {"max", "min", "symbol"}
    assert {each.name for each in walk([joined]) if each.op == "symbol"} == set(leaves)
    if len(leaves) > 3:
        assert not any(ops(leaf) & {"max", "min", "abs"} for leaf in leaves.values())
