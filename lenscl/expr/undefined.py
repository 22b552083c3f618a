"""Why an expression has no finite value at a point: which operation causes it, and what to write instead."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from lenscl.expr.graph import Expr, walk
from lenscl.expr.operations import OPERATIONS

_ARCS = {"asin": "arc sine", "acos": "arc cosine"}
_LONGEST = 60  # characters of an operand that is named


def why_undefined(expr: Expr, values: Mapping[str, float]) -> tuple[str, str] | None:
    """Return the operation without a finite value, and what to write instead; None if the expression has a value.

    For a function that is undefined for operands below 0, the advice has two parts: an operand that is never below 0,
    and a `max` that ends the solid where the operand is 0. Without the `max` the solid would go on, with a crease.

    Parameters
    ----------
    expr : Expr
    values : mapping of str to float
        A number for every symbol that occurs.

    Examples
    --------
    >>> from lenscl.expr import parse
    >>> why_undefined(parse("sqrt(1 - x) + 2", "x"), {"x": 3.0})
    ('the square root of 1 - x = -2', 'sqrt(max(1 - x, 0)) for it, and max(F, -(1 - x)) to end the solid there')
    """
    at: dict[Expr, float] = {}
    with np.errstate(all="ignore"):
        for each in walk([expr]):
            if each.args:
                at[each] = float(OPERATIONS[each.op].evaluate(np, *(np.float64(at[arg]) for arg in each.args)))
            else:
                at[each] = float(values[str(each.name)] if each.op == "symbol" else each.value or 0.0)
    blamed = expr
    while not math.isfinite(at[blamed]):
        # The cause is an operand that is NaN; else one that is infinite
        worse = [arg for arg in blamed.args if math.isnan(at[arg])] or [
            arg for arg in blamed.args if math.isinf(at[arg])
        ]
        if not worse:
            return _said(blamed, at)
        blamed = worse[0]
    return None


def _said(each: Expr, at: Mapping[Expr, float]) -> tuple[str, str]:
    operand = each.args[-1] if each.op == "/" else each.args[0]
    text = str(operand)
    number = f"{at[operand] + 0.0:.3g}"
    name, value = (text, f"{text} = {number}") if len(text) <= _LONGEST else ("u", number)
    end = f" for it, and max(F, -({name})) to end the solid there"
    above = f" for it, and max(F, 1e-6 - ({name})) to end the solid before"  # before the crease of the inner max
    if each.op == "sqrt":
        return f"the square root of {value}", f"sqrt(max({name}, 0)){end}"
    if each.op == "log":
        return f"the logarithm of {value}", f"log(max({name}, 1e-9)){above}"
    if each.op in ("asin", "acos") and abs(at[operand]) > 1.0:
        kept = f"{each.op}(min(max({name}, -1), 1))"
        return f"the {_ARCS[each.op]} of {value}", f"{kept} for it, and max(F, abs({name}) - 1) to end the solid there"
    if each.op == "/" and at[operand] == 0.0:
        return f"a division by {value}", "a divisor that is never 0, such as u^2 + 1e-6 for u^2"
    if each.op == "pow" and at[operand] < 0.0:
        exponent = str(each.args[1]) if len(str(each.args[1])) <= _LONGEST else "p"
        return (
            f"the power {exponent} of {value}",
            f"pow(abs({name}), {exponent}), or pow(max({name}, 0), {exponent}){end}",
        )
    if each.op == "pow" and at[operand] == 0.0:
        return f"a negative power of {value}", "a base that is never 0, such as u^2 + 1e-6 for u^2"
    return (
        f"{each.op} of numbers beyond the largest",
        "what has the same sign and stays small",
    )
