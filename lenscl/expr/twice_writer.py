"""Expressions in twice the precision: rational ones, as calls of the functions of `kernels/double_double.cl`."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from lenscl.expr.c_writer import CText, Writer, spell_number
from lenscl.expr.graph import Expr, walk
from lenscl.expr.operations import ATOM

_CALLS = {
    "+": "dd_add({}, {})",
    "-": "dd_subtract({}, {})",
    "neg": "dd_negate({})",
    "*": "dd_multiply({}, {})",
    "/": "dd_divide({}, {})",
}


def is_rational(exprs: Iterable[Expr]) -> bool:
    """Say whether expressions are made of numbers, symbols and the four rules of arithmetic alone."""
    return all(not each.args or each.op in _CALLS or each.op == "power" for each in walk(exprs))


def twice_text(outputs: Mapping[str, Expr], *, symbols: Mapping[str, str], lanes: Collection[str]) -> CText:
    """Spell rational expressions in twice the precision, sharing what they have in common.

    Parameters
    ----------
    outputs : mapping of str to Expr
        What is wanted; the results are of type `dd_t`.
    symbols : mapping of str to str
        The C spelling of every symbol that occurs.
    lanes : collection of str
        The symbols of type `dd_t`; the others are exact doubles.
    """
    return _TwiceWriter(outputs, symbols, lanes, "double").write()


class _TwiceWriter(Writer):
    def _kind(self, each: Expr) -> str:
        return "dd_t"

    def _result(self, each: Expr) -> str:
        return self._text[each][0]

    def _spell(self, each: Expr) -> tuple[str, int]:
        if each.op == "number":
            assert each.value is not None
            return f"dd_of((realv)({spell_number(each.value, 'double')}))", ATOM
        if each.op == "symbol":
            spelled = self._symbols[str(each.name)]
            return (spelled if self._on_lanes[each] else f"dd_of((realv){spelled})"), ATOM
        return _CALLS[each.op].format(*(self._text[arg][0] for arg in each.args)), ATOM
