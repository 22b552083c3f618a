"""What the tests of expressions share: one sample for every row of the table, and values of it to many digits."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np
import pytest

from lenscl.expr import OPERATIONS, Expr
from lenscl.expr.graph import node, number, symbol


def _cbrt(u: Any) -> Any:
    return mpmath.sign(u) * mpmath.cbrt(abs(u))


def _real_power(u: Any, p: Any) -> Any:
    return mpmath.power(u, p) if u >= 0 else mpmath.nan


def _norm(u: Any, v: Any, p: Any) -> Any:
    return mpmath.power(abs(u) ** p + abs(v) ** p, 1 / mpmath.mpf(p))


def _norm_slope(u: Any, v: Any, p: Any) -> Any:
    return mpmath.sign(u) * (abs(u) / _norm(u, v, p)) ** (p - 1) if u else mpmath.mpf(0)


# The meaning of every row in another program's arithmetic
MEANING: dict[str, Callable[..., Any]] = {
    "+": lambda u, v: u + v,
    "-": lambda u, v: u - v,
    "neg": lambda u: -u,
    "*": lambda u, v: u * v,
    "/": lambda u, v: u / v,
    "power": lambda u, n: u ** int(n),
    "sqrt": mpmath.sqrt,
    "cbrt": _cbrt,
    "abs": abs,
    "min": min,
    "max": max,
    "where": lambda a, b, u, v: u if a < b else v,
    "exp": mpmath.exp,
    "log": mpmath.log,
    "sin": mpmath.sin,
    "cos": mpmath.cos,
    "tan": mpmath.tan,
    "atan2": mpmath.atan2,
    "asin": mpmath.asin,
    "acos": mpmath.acos,
    "atan": mpmath.atan,
    "sinh": mpmath.sinh,
    "cosh": mpmath.cosh,
    "tanh": mpmath.tanh,
    "sign": mpmath.sign,
    "floor": mpmath.floor,
    "hypot": mpmath.hypot,
    "pow": _real_power,
    "norm": _norm,
    "norm_slope": _norm_slope,
}

_POSITIVE = (0.0, 4.0)
_DOMAIN = {"sqrt": [_POSITIVE], "log": [_POSITIVE], "pow": [_POSITIVE, (-3.0, 3.0)], "exp": [(-20.0, 20.0)]}
_DOMAIN |= {name: [(-1.0, 1.0)] for name in ("asin", "acos")} | {name: [(-20.0, 20.0)] for name in ("sinh", "cosh")}
_DOMAIN |= {name: [(-4.0, 4.0), (-4.0, 4.0), (1.0, 10.0)] for name in ("norm", "norm_slope")}


@dataclass(frozen=True)
class Sample:
    """A row of the table applied to symbols, and where its operands may lie."""

    name: str
    expr: Expr
    domain: dict[str, tuple[float, float]]

    def points(self, rng: np.random.Generator, count: int) -> dict[str, Any]:
        return {name: rng.uniform(low, high, count) for name, (low, high) in self.domain.items()}


def _sample(name: str) -> Sample:
    row = OPERATIONS[name]
    names = [f"u{k}" for k in range(row.arity)]
    ranges = _DOMAIN.get(name, [(-4.0, 4.0)] * row.arity)
    if name == "power":
        return Sample(name, node("power", symbol("u0"), number(7)), {"u0": (-4.0, 4.0)})
    return Sample(name, node(name, *map(symbol, names)), dict(zip(names, ranges, strict=True)))


@pytest.fixture(scope="session", params=sorted(OPERATIONS))
def sample(request: pytest.FixtureRequest) -> Sample:
    return _sample(request.param)


@pytest.fixture(scope="session")
def samples() -> list[Sample]:
    return [_sample(name) for name in sorted(OPERATIONS)]


def _exact(expr: Expr, values: Mapping[str, float]) -> Any:
    if expr.op == "number":
        return mpmath.mpf(expr.value)
    if expr.op == "symbol":
        return mpmath.mpf(values[str(expr.name)])
    return MEANING[expr.op](*(_exact(arg, values) for arg in expr.args))


@pytest.fixture(scope="session")
def exact() -> Callable[[Expr, Mapping[str, float]], Any]:
    """The value at one point, to as many digits as mpmath is set to; recursive and slow."""
    return _exact
