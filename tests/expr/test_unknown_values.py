"""What is not known of one operand makes no claim of another true: bounds, roundings and balls, in pairs."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from flint import arb

from lenscl.expr import OPERATIONS, Expr, bounds, evaluate, evaluate_with_error, least
from lenscl.expr.graph import node, number, symbol
from lenscl.reference.jets import Jet, jet

X, Y = symbol("x"), symbol("y")
# What an operand may be: known, exactly 0, with a pole or an end of its domain within, overflowing
OPERANDS = (
    Y, number(0.0), X, node("/", number(1.0), X), node("log", X), node("sqrt", X), node("tan", X),
    node("exp", node("/", Y, X)), node("atan2", X, number(-0.25)), node("-", node("/", Y, X), node("/", Y, X)),
)  # fmt: skip
LONG = np.longdouble
EXPONENT = node("+", number(1.0), node("abs", X))  # of norms, which promise that theirs is never below 1


def pairs() -> Iterator[Expr]:
    """Yield every operation on every pair of operands, and each again within every operation."""
    inner = []
    for name, row in OPERATIONS.items():
        for some in itertools.product(OPERANDS, repeat=min(row.arity, 2)):
            args = (some[0], number(3.0)) if name == "power" else (*some, X, Y)[: row.arity]
            args = (*some, EXPONENT) if name.startswith("norm") else args
            inner.append(node(name, *args))
    yield from inner
    rng = np.random.default_rng(3)
    for name, row in OPERATIONS.items():
        for first in rng.choice(len(inner), 60):
            one = inner[first]
            if name == "power":
                yield node(name, one, number(2.0))
            elif name.startswith("norm"):
                yield node(name, one, Y, EXPONENT)
                yield node(name, Y, one, EXPONENT)
            elif row.arity == 1:
                yield node(name, one)
            else:
                rest = (Y, X, Y)[: row.arity - 1]
                yield node(name, one, *rest)
                yield node(name, *rest, one)


def test_bounds_of_every_pair_hold_what_is_defined() -> None:
    rng = np.random.default_rng(0)
    middle, reach = rng.uniform(-1.5, 1.5, (2, 40)), rng.choice([0.0, 1e-9, 0.1, 1.0, 2.0], (2, 40))
    low, high = middle - reach, middle + reach
    low[0, ::5], high[1, 1::5] = 0.0, 0.0  # poles and ends at a corner
    low, high = np.minimum(low, high), np.maximum(low, high)
    share = np.concatenate([rng.random((60, 2, 1)), np.array([[0, 0], [0, 1], [1, 0], [1, 1], [0.5, 0.5]])[:, :, None]])
    points = np.clip(low + share * (high - low), low, high)
    at = {"x": points[:, 0], "y": points[:, 1]}
    held = finite = 0
    for expr in pairs():
        least, most = bounds(expr, {"x": (low[0], high[0]), "y": (low[1], high[1])})
        value = evaluate(expr, at)
        defined = ~np.isnan(value)
        with np.errstate(invalid="ignore"):
            assert (~defined | ((least <= value) & (value <= most))).all(), expr
        held += int(defined.sum())
        finite += int((np.isfinite(least) | np.isfinite(most)).sum())
    assert held > 10**6
    assert finite > 10_000


def test_a_square_that_is_written_as_a_product_is_known_to_be_positive() -> None:
    off = node("-", node("sqrt", X), number(0.7))
    square, wave = node("*", off, off), node("cos", X)
    assert least(node("+", square, node("*", Y, Y))) == 0.0
    assert least(node("*", square, square)) == 0.0
    assert 0.3 * (1 - 1e-15) <= least(node("+", number(0.3), node("*", wave, wave))) <= 0.3
    assert least(node("*", X, Y)) == -np.inf


def test_rounding_bounds_of_every_pair_are_infinite_where_nothing_is_known() -> None:
    """An error is finite only where the value is one, and where long double, which knows more, is as near to it."""
    tiny = np.array([0.0, 1e-300, -1e-300, 1e-9, -1e-9, 1.0, -1.0, 0.3, 700.0, np.pi / 2, -3.0, 2.0**-40])
    x, y = (each.ravel() for each in np.meshgrid(tiny, tiny))
    finite = 0
    for expr in pairs():
        value, error = evaluate_with_error(expr, {"x": x, "y": y})
        known = np.isfinite(error)
        assert np.isfinite(value[known]).all(), expr
        with np.errstate(all="ignore"):
            exact = in_long_double(expr, {"x": x.astype(LONG), "y": y.astype(LONG)})
            off = np.abs(exact - value) > error * (1 + 1e-9) + 1e-15 * np.abs(exact)
        far = known & off  # roots of what underflows to 0 are 0, and exactly there may be none
        assert not far.any(), (expr, x[far][0], y[far][0], value[far][0], error[far][0], exact[far][0])
        finite += int(known.sum())
    assert finite > 100_000


def in_long_double(expr: Expr, at: dict[str, Any]) -> Any:
    if not expr.args:
        return at[str(expr.name)] if expr.op == "symbol" else LONG(expr.value)
    args = [in_long_double(arg, at) for arg in expr.args]
    if expr.op == "power":
        return args[0] ** int(expr.args[1].value or 0)
    if expr.op in ("min", "max"):  # beyond double's range there is no number to compare with
        args = [np.where(np.abs(arg) > 1.8e308, np.sign(arg) * np.inf, arg) for arg in args]
    return OPERATIONS[expr.op].evaluate(np, *args)


@pytest.mark.parametrize("unknown", [arb("nan"), arb(0, "inf")])
def test_balls_of_the_unknown_are_unknown(unknown: arb) -> None:
    """A ball of the oracle that is not finite makes none that is; of sine and the like it does if it is a number."""
    is_undefined = str(unknown) == "nan"
    tried = 0
    for other in (arb(0), arb(0.5), arb(0, 1), arb(-2)):
        for name, row in OPERATIONS.items():
            places = range(1 if name == "power" else row.arity)
            for place in places:
                args = (X, number(3.0)) if name == "power" else tuple(X if i == place else Y for i in range(row.arity))
                if name in ("where", "norm_slope"):
                    continue  # a choice may be of known branches; slopes of norms are made by jets themselves
                found = jet(node(name, *args), {"x": Jet(unknown, (unknown,)), "y": Jet(other, (arb(1),))})
                tried += 1
                bounded = name in ("sin", "cos", "atan2", "atan", "tanh", "min", "max") and not is_undefined
                assert bounded or not found.value.is_finite(), (name, place, other)
                assert not found.slopes[0].is_finite() or bounded, (name, place, other)
    assert tried > 80
