"""Expressions as infix text, for people: messages, comments in generated code, `str(expr)`."""

from __future__ import annotations

from collections.abc import Mapping

from lenscl.expr.graph import Expr, walk
from lenscl.expr.operations import ATOM, OPERATIONS, PRODUCT

MAX_TEXT = 2000  # characters; a graph's text can be exponentially longer than the graph


def infix(expr: Expr) -> str:
    """Spell an expression; one longer than `MAX_TEXT` characters is cut, ending in an ellipsis."""
    text: dict[Expr, tuple[str, int]] = {}
    for each in walk([expr]):
        text[each] = spell(each, text)
    return text[expr][0]


def spell(each: Expr, text: Mapping[Expr, tuple[str, int]]) -> tuple[str, int]:
    """Spell one node from the spelling of its operands, with how tightly each binds."""
    if each.op == "number":
        assert each.value is not None
        return number_text(each.value), PRODUCT if each.value < 0.0 else ATOM
    if each.op == "symbol":
        return str(each.name), ATOM
    row = OPERATIONS[each.op]
    needs = (ATOM,) if each.op == "neg" and _sign_would_move(each.args[0]) else row.needs
    parts = [wrapped(*text[arg], needed) for arg, needed in zip(each.args, needs, strict=True)]
    spelled = row.text.format(*parts)
    return (spelled if len(spelled) <= MAX_TEXT else spelled[: MAX_TEXT - 3] + "..."), row.level


def _sign_would_move(u: Expr) -> bool:
    """Return whether a sign before a product without brackets would be read as its first factor's, and vanish in it."""
    if u.op not in ("*", "/"):
        return False
    while u.op in ("*", "/"):
        u = u.args[0]
    return u.op == "-" or u.value is not None


def wrapped(text: str, level: int, needed: int) -> str:
    """Put brackets around an operand that binds less tightly than its place needs."""
    return text if level >= needed else f"({text})"


def number_text(value: float) -> str:
    """Spell a number as one would write it: whole ones without a point."""
    return str(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)
