"""Where an expression goes to infinity: the bound that it has there on the other side all the same.

A logarithm of u >= 0 goes to minus infinity as u goes to 0, and 1 / u and u^-p to infinity. No interval about a value
holds that; but u is no more than the most it is on a segment, and so log(u) is no more than the logarithm of that. An
expression that goes both ways, such as log(u) - log(v), has two bounds; where only u goes to 0 one of them is known.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from lenscl.expr.graph import Expr, node, walk
from lenscl.expr.operations import whole

_RISING = ("exp", "cbrt", "tanh")  # of all numbers: what has no value for some is not told by its bound


@dataclass(frozen=True, slots=True)
class OneSided:
    """An expression that goes to infinity on one side only, where some of its parts go to 0.

    Attributes
    ----------
    falls : bool
        Whether it goes to minus infinity.
    bound : Expr
        With a symbol in the place of each such part: the greater the part, the nearer this is to what the expression
        is, which lies below it if it falls, else above.
    parts : dict of Expr to Expr
        What each symbol stands for.
    """

    falls: bool
    bound: Expr
    parts: dict[Expr, Expr]


def one_sided(
    expr: Expr, is_nonnegative: Callable[[Expr], bool], varies: Callable[[Expr], bool], name: Callable[[int], Expr]
) -> list[OneSided]:
    """Return how an expression goes to minus infinity and how to infinity, of both what a bound is known of.

    Parameters
    ----------
    expr : Expr
        Any expression.
    is_nonnegative, varies : callable
        Whether a part is known to be nowhere negative, and whether it is another one at another place.
    name : callable
        From a count, the symbol of the first such part, of the second, ...
    """
    order = list(walk([expr]))
    poles = {each: side for each in order if (side := _pole(each, is_nonnegative, varies)) is not None}
    if not poles:
        return []
    ways: dict[Expr, set[int]] = {expr: {1}}  # whether the expression rises with a part, 1, falls, -1, or neither, 0
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
    """Return the bound of an expression, the last of `order`, with symbols in the places of what these poles are of."""
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
    """Return the sign of the infinity that an operation goes to where an operand, nowhere negative, goes to 0."""
    if each.op == "log" and varies(each.args[0]) and is_nonnegative(each.args[0]):
        return -1
    if each.op == "/" and varies(each.args[1]) and each.args[0].value and is_nonnegative(each.args[1]):
        return 1 if each.args[0].value > 0.0 else -1
    if each.op == "pow" and varies(each.args[0]) and (each.args[1].value or 0.0) < 0.0 and is_nonnegative(each.args[0]):
        return 1
    return None


def _signs(each: Expr, is_nonnegative: Callable[[Expr], bool]) -> list[tuple[Expr, int]]:
    """Return the operands, and whether the operation rises with each, 1, falls, -1, or neither, 0."""
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
    """Say whether u >= 0 is known wherever u has a value, poles of its parts included."""
    at: dict[Expr, bool] = {}
    for each in walk([u]):
        parts = [at[arg] for arg in each.args]
        kept = each.op in ("+", "*", "/", "min") and all(parts)
        at[each] = kept or each.op == "pow" or (each.op == "max" and any(parts)) or is_nonnegative(each)
    return at[u]
