"""The words of an expression: the functions that a user may call, and the constants.

Most functions are rows of the table of operations. The others are made of rows, and have no rules of their own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from lenscl.expr.graph import Expr, build, number
from lenscl.expr.operations import OPERATIONS

CONSTANTS: Mapping[str, float] = {"pi": math.pi}  # a parameter of the same name takes its place


def _mod(u: Expr, v: Expr) -> Expr:
    """Return u - v floor(u / v): it lies between 0 and v and has the sign of v, as % of Python."""
    if u.value is not None and v.value:
        return number(u.value % v.value)  # exact; the quotient below is rounded
    return u - v * build("floor", u / v)


_MADE: Mapping[str, tuple[int, Callable[..., Expr]]] = {"mod": (2, _mod)}  # number of operands, and what makes it
FUNCTIONS: frozenset[str] = frozenset({*(row.name for row in OPERATIONS.values() if row.user), *_MADE})


def operands_of(name: str) -> int:
    """Return how many operands a function has."""
    return _MADE[name][0] if name in _MADE else OPERATIONS[name].arity


def called(name: str, *operands: Expr) -> Expr:
    """Return a function of operands."""
    return _MADE[name][1](*operands) if name in _MADE else build(name, *operands)
