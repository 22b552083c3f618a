"""Quotients that are cosines of an angle by their structure: a coordinate over a distance."""

from __future__ import annotations

from collections.abc import Callable

from lenscl.expr.graph import Expr
from lenscl.expr.simplify import power


def is_share(u: Expr, is_nonnegative: Callable[[Expr], bool]) -> bool:
    """Say whether u is p / sqrt(p^2 + q) with q >= 0, written with sqrt or hypot.

    Then -1 <= u <= 1 wherever u is defined, whatever its symbols are.

    Parameters
    ----------
    u : Expr
        Any expression.
    is_nonnegative : callable
        Whether a part is proved never to be negative.
    """
    if u.op == "neg":
        return is_share(u.args[0], is_nonnegative)
    if u.op != "/":
        return False
    p, length = u.args
    addends = _addends(length)
    if p.op == "neg":
        p = p.args[0]
    others = [each for each in addends if each is not power(p, 2)]
    return len(others) < len(addends) and all(is_nonnegative(each) for each in others)


def _addends(length: Expr) -> list[Expr]:
    """Return the parts of a distance's square; none where it is no distance."""
    if length.op not in ("sqrt", "hypot"):
        return []
    found, rest = [], [length.args[0]] if length.op == "sqrt" else [power(each, 2) for each in length.args]
    while rest:
        each = rest.pop()
        if each.op == "+":
            rest.extend(each.args)
        elif each.op == "power" and each.args[0].op == "hypot" and each.args[1].value == 2.0:
            rest.extend(power(arg, 2) for arg in each.args[0].args)
        else:
            found.append(each)
    return found
