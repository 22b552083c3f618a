"""Expressions as bands: what bounds them on a segment of a ray, in the words of `kernels/interval*.cl`.

Every operation of the table has a function there. A number or parameter is exact and cheaper to add or multiply by;
what depends on parameters alone is a band too, a flat one, since its rounding counts as well.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from lenscl.expr.c_writer import CText, Precision, Writer, single, spell_number
from lenscl.expr.graph import Expr, node
from lenscl.expr.operations import ATOM

CALLS: Mapping[str, str] = {
    "+": "band_add({}, {})",
    "-": "band_subtract({}, {})",
    "neg": "band_negate({})",
    "*": "band_multiply({}, {})",
    "/": "band_divide({}, {}, {least_1})",
    "sqrt": "band_sqrt({}, {least_0})",
    "cbrt": "band_cbrt({})",
    "abs": "band_abs({})",
    "min": "band_min({}, {})",
    "max": "band_max({}, {})",
    "where": "band_where({}, {}, {}, {})",
    "exp": "band_exp({})",
    "log": "band_log({}, {least_0})",
    "sin": "band_sin({})",
    "cos": "band_cos({})",
    "tan": "band_tan({})",
    "atan2": "band_atan2({}, {})",
    "asin": "band_asin({}, {within})",
    "acos": "band_acos({}, {within})",
    "atan": "band_atan({})",
    "sinh": "band_sinh({})",
    "cosh": "band_cosh({})",
    "tanh": "band_tanh({})",
    "hypot": "band_hypot({}, {})",
    "pow": "band_pow({}, {}, {least_0})",
    "sign": "band_sign({})",
    "floor": "band_floor({})",
    "norm": "band_norm({}, {}, {})",
    "norm_slope": "band_norm_slope({}, {}, {})",
}  # by the name of the table's row; integer powers have become products. least_i: a number operand i is never below;
# within: 1 if the operand is proved to lie between -1 and 1


def band_text(
    outputs: Mapping[str, Expr],
    *,
    symbols: Mapping[str, str],
    bands: Collection[str],
    precision: Precision,
    floors: Mapping[str, float] | None = None,
    forks: Sequence[Expr] = (),
) -> CText:
    """Spell expressions as bands, sharing what they have in common.

    Parameters
    ----------
    outputs : mapping of str to Expr
        Expressions, each by the name that its result gets.
    symbols : mapping of str to str
        The C spelling of every symbol that occurs.
    bands : collection of str
        The symbols that are bands; the others are exact numbers, the same along the segment.
    precision : "single" or "double"
        What `real` is.
    floors : mapping of str to float, optional
        What symbols are never below, as is known of what they stand for.
    forks : sequence of Expr, optional
        Floors that are taken on one side of their jumps: the i-th on that which bit i of the C variable `way` says.
        What jumps on the segment is noted in `forks`, a pointer to bits of every lane.

    Returns
    -------
    CText
        Statements, and what each result is called.
    """
    return _BandWriter(outputs, symbols, bands, precision, floors or {}, forks).write()


class _BandWriter(Writer):
    def __init__(
        self,
        outputs: Mapping[str, Expr],
        symbols: Mapping[str, str],
        bands: Collection[str],
        precision: Precision,
        floors: Mapping[str, float],
        forks: Sequence[Expr],
    ) -> None:
        super().__init__(outputs, symbols, bands, precision)
        self._floors = floors
        self._forks = {self._lower[each]: i for i, each in enumerate(forks)}

    def _kind(self, each: Expr) -> str:
        return "band_t"

    def _result(self, each: Expr) -> str:
        return self._band(each)

    def _spell(self, each: Expr) -> tuple[str, int]:
        if each.args:
            return self._call(each), ATOM
        return (self._symbols[str(each.name)] if each.op == "symbol" else self._number(each)), ATOM

    def _number(self, each: Expr) -> str:
        assert each.value is not None
        spelled = spell_number(each.value, self._precision)
        return f"({spelled})" if each.value < 0.0 else spelled

    def _call(self, each: Expr) -> str:
        if (special := self._special(each)) is not None:
            return special
        least = {
            f"least_{i}": self._least(arg) for i, arg in enumerate(each.args) if f"{{least_{i}}}" in CALLS[each.op]
        }
        within = int("{within}" in CALLS[each.op] and self._is_within_one(each.args[0]))
        call = CALLS[each.op].format(*(self._band(arg) for arg in each.args), **least, within=within)
        if each in self._forks:
            return f"band_floor_on({call[len('band_floor(') : -1]}, {self._forks[each]}, way, forks)"
        return call

    def _special(self, each: Expr) -> str | None:
        """Spell what is cheaper than by bands alone."""
        if each.op not in ("+", "-", "*", "/"):
            return None
        u, v = each.args
        if self._exact(u) and self._exact(v):
            return None
        if each.op == "+" and (self._exact(u) or self._exact(v)):
            u, v = (v, u) if self._exact(u) else (u, v)
            return f"band_shift({self._band(u)}, {self._real(v)})"
        if each.op == "-" and self._exact(v):
            return f"band_shift({self._band(u)}, -{self._real(v)})"
        if each.op == "-" and self._exact(u):
            return f"band_shift(band_negate({self._band(v)}), {self._real(u)})"
        if each.op == "*" and u is v:
            return f"band_square({self._band(u)})"
        if each.op == "*" and (self._exact(u) or self._exact(v)):
            u, v = (v, u) if self._exact(u) else (u, v)
            return f"band_scale({self._band(u)}, {self._real(v)})"
        if each.op == "*" and (self._flat(u) or self._flat(v)):
            u, v = (v, u) if self._flat(u) else (u, v)
            return f"band_times_flat({self._band(u)}, {self._band(v)})"
        if each.op == "/" and self._flat(v):
            return f"band_times_flat({self._band(u)}, band_reciprocal({self._band(v)}, {self._least(v)}))"
        return None

    def _flat(self, each: Expr) -> bool:
        return not self._on_lanes[each]

    def _exact(self, each: Expr) -> bool:
        """Say whether a node is a number known exactly: a parameter, or a constant that this precision holds."""
        if each.op == "symbol":
            return self._flat(each)
        return each.value is not None and self._holds(each.value)

    def _holds(self, value: float) -> bool:
        try:
            return self._precision == "double" or single(value) == value
        except OverflowError:
            return False

    def _real(self, each: Expr) -> str:
        return f"(realv){self._text[each][0]}"

    def _band(self, each: Expr) -> str:
        if each.args or not self._flat(each):
            return self._text[each][0]
        return f"band_{'exact' if self._exact(each) else 'rounded'}({self._real(each)})"

    def _is_within_one(self, each: Expr) -> bool:
        from lenscl.expr.enclose import least

        return least(each, self._floors) >= -1.0 and least(node("neg", each), self._floors) >= -1.0

    def _least(self, each: Expr) -> str:
        """Spell what an operand is never below, whatever the coordinates and parameters are."""
        from lenscl.expr.enclose import least  # numpy, which only those wait for who write bands

        low = least(each, self._floors)
        if not 0.0 <= low < 1e38:  # only positive operands matter; and single precision ends there
            return "(realv)-INFINITY"
        if not self._holds(low):
            low *= 1.0 - 2.0**-20  # nearest is then below
        return f"(realv){spell_number(low, self._precision)}"
