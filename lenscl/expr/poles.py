"""Bounds of an expression with a pole: it goes to infinity on one side, and is bounded on the other.

As u >= 0 goes to 0, log(u) goes to minus infinity, and 1 / u and u^-p go to infinity. No finite interval contains these
values. But if u <= h on a segment, then log(h) is an upper bound there. An expression with poles of both signs, such as
log(u) - log(v), has an upper bound where only u may be 0, and a lower bound where only v may be 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from lenscl.expr.graph import Expr, node, walk
from lenscl.expr.operations import whole

# Functions that never fall and are defined for all numbers: else a bound of the operand may be outside the domain
_RISING = ("exp", "cbrt", "tanh", "atan", "sinh", "sign", "floor")


@dataclass(frozen=True, slots=True)
class OneSided:
    """An expression that goes to infinity of one sign where some of its parts go to 0, and its bound on the other side.

    Attributes
    ----------
    falls : bool
        Whether the expression goes to minus infinity.
    bound : Expr
        The expression with a symbol in the place of each such part. Let each symbol be an upper bound of its part. Then
        `bound` is an upper bound of the expression if that falls, else a lower bound.
    parts : dict of Expr to Expr
        The part that each symbol stands for.
    """

    falls: bool
    bound: Expr
    parts: dict[Expr, Expr]


def one_sided(
    expr: Expr, is_nonnegative: Callable[[Expr], bool], varies: Callable[[Expr], bool], name: Callable[[int], Expr]
) -> list[OneSided]:
    """Return the poles of an expression: those to minus infinity and those to infinity, if a bound is known.

    Parameters
    ----------
    expr : Expr
        Any expression.
    is_nonnegative, varies : callable
        Whether a part is proved never to be negative, and whether it depends on the place.
    name : callable
        From 0, 1, 2 and so on, the symbol for the first part, the second, the third.
    """
    order = list(walk([expr]))
    poles = {each: side for each in order if (side := _pole(each, is_nonnegative, varies)) is not None}
    if not poles:
        return []
    ways: dict[Expr, set[int]] = {expr: {1}}  # 1 if the expression increases with a part, -1 if it decreases, else 0
    for each in reversed(order):
        for arg, sign in [] if each in poles else _signs(each, is_nonnegative):
            ways.setdefault(arg, set()).update(way * sign for way in ways.get(each, ()))
    found = []
    for side in (-1, 1):
        going = {each for each, own in poles.items() if ways.get(each) == {side * own}}
        if going:
            found.append(_bounded(order, going, side, name))
    return found


def _bounded(order: list[Expr], poles: set[Expr], side: int, name: Callable[[int], Expr]) -> OneSided:
    """Return the bound of the last expression of `order`, with symbols for the operands of these poles."""
    made: dict[Expr, Expr] = {}
    marks: dict[Expr, Expr] = {}
    for each in order:
        args = [made[arg] for arg in each.args]
        if each in poles:
            place = 1 if each.op == "/" else 0
            part = each.args[place]
            args[place] = marks[part] = marks.get(part) or name(len(marks))
        made[each] = node(each.op, *args) if each.args else each
    return OneSided(side < 0, made[order[-1]], {mark: part for part, mark in marks.items()})


def _pole(each: Expr, is_nonnegative: Callable[[Expr], bool], varies: Callable[[Expr], bool]) -> int | None:
    """Return the sign of an operation's infinity as its operand, never negative, goes to 0; None if it has no pole."""
    if each.op == "log" and varies(each.args[0]) and is_nonnegative(each.args[0]):
        return -1
    if each.op == "/" and varies(each.args[1]) and each.args[0].value and is_nonnegative(each.args[1]):
        return 1 if each.args[0].value > 0.0 else -1
    if each.op == "pow" and varies(each.args[0]) and (each.args[1].value or 0.0) < 0.0 and is_nonnegative(each.args[0]):
        return 1
    return None


def _signs(each: Expr, is_nonnegative: Callable[[Expr], bool]) -> list[tuple[Expr, int]]:
    """Return each operand with 1 if the operation increases with it, -1 if it decreases, else 0."""
    match each.op:
        case "+" | "max" | "min":
            return [(arg, 1) for arg in each.args]
        case "-":
            return [(each.args[0], 1), (each.args[1], -1)]
        case "neg":
            return [(each.args[0], -1)]
        case "*" | "/":
            u, v = each.args
            if each.op == "*" and u.value is not None:
                u, v = v, u
            sign = 0 if not v.value else (1 if v.value > 0.0 else -1)
            return [(u, sign), (v, 0)]
        case "power":
            return [(each.args[0], whole(each.args[1]) % 2)]
        case "sqrt" if _is_never_negative(each.args[0], is_nonnegative):
            return [(each.args[0], 1)]
        case op if op in _RISING:
            return [(each.args[0], 1)]
    return [(arg, 0) for arg in each.args]


def _is_never_negative(u: Expr, is_nonnegative: Callable[[Expr], bool]) -> bool:
    """Say whether u >= 0 is proved at every place of its domain, also near the poles of its parts."""
    at: dict[Expr, bool] = {}
    for each in walk([u]):
        parts = [at[arg] for arg in each.args]
        kept = each.op in ("+", "*", "/", "min") and all(parts)
        at[each] = kept or each.op == "pow" or (each.op == "max" and any(parts)) or is_nonnegative(each)
    return at[u]
