"""Where an expression jumps: the angles that it takes round their cut, and the steps of sign and floor."""

from __future__ import annotations

from lenscl.expr.graph import Expr, walk

STEPS = ("sign", "floor")
_WAVES = ("sin", "cos", "tan")  # the same after a full turn of what they are taken of


def jumps(expr: Expr) -> tuple[Expr, ...]:
    """Return the parts by which an expression may jump: angles, atan2(y, x), at their cut, and signs and floors.

    On the half-plane y = 0, x <= 0 an angle changes by a full turn. An expression goes on smoothly there if it takes
    the angle by whole multiples only, and these through sin, cos or tan: cos(5*atan2(y, x)) does, atan2(y, x)^2 does
    not. A multiple that is a parameter may be no whole number. Of signs and floors no such rule is known.
    """
    order = list(walk([expr]))
    return tuple(each for each in order if each.op in STEPS or (each.op == "atan2" and _turns(order, each) != 0))


def _turns(order: list[Expr], angle: Expr) -> int | None:
    """Return by how many turns the last node changes where an angle changes by one; None where that is no rule."""
    found: dict[Expr, int | None] = {}
    for each in order:
        if each is angle:
            found[each] = 1
        else:
            found[each] = _turned(each, [found[arg] for arg in each.args])
    return found[order[-1]]


def _turned(each: Expr, turns: list[int | None]) -> int | None:
    if not any(turn != 0 for turn in turns):
        return 0
    if None in turns:
        return None
    first = turns[0] or 0
    match each.op:
        case "+":
            return first + (turns[1] or 0)
        case "-":
            return first - (turns[1] or 0)
        case "neg":
            return -first
        case "*":
            number, turn = (each.args[0], turns[1]) if each.args[0].value is not None else (each.args[1], first)
            return _whole_multiple(number.value, turn)
        case "/" if each.args[1].value:
            return _whole_multiple(1.0 / each.args[1].value, first)
        case op if op in _WAVES:
            return 0
        case _:
            return None


def _whole_multiple(factor: float | None, turns: int | None) -> int | None:
    turned = None if factor is None or turns is None else factor * turns
    return int(turned) if turned is not None and turned.is_integer() else None
