"""Where an expression goes to infinity on one side: the bound that it has there all the same.

A logarithm of u >= 0 goes to minus infinity as u goes to 0, and 1 / u and u^-p to infinity. No interval about a value
holds that; but u is no more than the most it is on a segment, and so log(u) is no more than the logarithm of that.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from lenscl.expr.graph import Expr, node, walk
from lenscl.expr.operations import whole

_RISING = ("exp", "cbrt", "tanh", "sqrt")


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
) -> OneSided | None:
    """Return how an expression goes to infinity, None where it does not, or in a way that no bound is known of.

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
        return None
    ways: dict[Expr, set[int]] = {}  # by how the expression goes where a pole goes to infinity: 1, -1; 0 where unknown
    for each in order:
        if each in poles:
            ways[each] = {poles[each]}
        else:
            ways[each] = {way * sign for arg, sign in _signs(each) for way in ways[arg]}
    if ways[expr] not in ({1}, {-1}):
        return None
    made: dict[Expr, Expr] = {}
    parts: dict[Expr, Expr] = {}
    for each in order:
        args = [made[arg] for arg in each.args]
        if each in poles:
            place = 1 if each.op == "/" else 0
            found = next((mark for mark, part in parts.items() if part is each.args[place]), None)
            args[place] = found or name(len(parts))
            parts[args[place]] = each.args[place]
        made[each] = node(each.op, *args) if each.args else each
    return OneSided(ways[expr] == {-1}, made[expr], parts)


def _pole(each: Expr, is_nonnegative: Callable[[Expr], bool], varies: Callable[[Expr], bool]) -> int | None:
    """Return the sign of the infinity that an operation goes to where an operand, nowhere negative, goes to 0."""
    if each.op == "log" and varies(each.args[0]) and is_nonnegative(each.args[0]):
        return -1
    if each.op == "/" and varies(each.args[1]) and each.args[0].value and is_nonnegative(each.args[1]):
        return 1 if each.args[0].value > 0.0 else -1
    if each.op == "pow" and varies(each.args[0]) and (each.args[1].value or 0.0) < 0.0 and is_nonnegative(each.args[0]):
        return 1
    return None


def _signs(each: Expr) -> list[tuple[Expr, int]]:
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
        case op if op in _RISING:
            return [(each.args[0], 1)]
    return [(arg, 0) for arg in each.args]
