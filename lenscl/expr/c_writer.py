"""Expressions as OpenCL C: shared parts become named temporaries, integer powers become products.

The text is written in the words of `kernels/lanes.cl`: `real` (a scalar) and `realv` (one value a ray, VW of them).
Only this module spells numbers, by precision.
"""

from __future__ import annotations

import re
import struct
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

from lenscl.expr.graph import Expr, node, number, walk
from lenscl.expr.operations import ATOM, NEGATION, OPERATIONS, PRODUCT, SUM, whole
from lenscl.expr.printing import spell, wrapped

Precision = Literal["single", "double"]

_INLINE = 88  # characters; in what is longer, the longest operand gets a name
_LINE = 120
_COMMENT = 72

_TYPES = """
bool char uchar short ushort int uint long ulong half float double quad real
"""
_WORDS = """
auto break case const constant continue default do else enum extern for global goto if inline kernel local private
PASTE PASTE_ LANES VW REAL MASK REAL_MAX NUMBER NAN INFINITY MAXFLOAT HUGE_VAL HUGE_VALF
RUN RAY_WORDS WAVES_REACH IS_DOUBLE IS_FINE LOG_2_HIGH LOG_2_LOW UPPER_HALF PART ROUNDER OF_HALVES OF_ONE OF_TWO
store_lanes load_lanes to_bytes from_bytes ubytev bytev bitsv anywhere_realv
as_bits as_numbers to_bits to_numbers
read_only read_write register restrict return signed sizeof static struct switch typedef uniform union unsigned void
volatile while pipe complex imaginary image2d_t event_t sampler_t size_t ptrdiff_t intptr_t uintptr_t maskv mask
any_lane true false
"""
RESERVED_WORDS: frozenset[str] = frozenset(_WORDS.split()) | {
    f"{kind}{lanes}" for kind in _TYPES.split() for lanes in ("", "2", "3", "4", "8", "16", "v", "3v")
}  # no temporary may be called so: words of OpenCL C and of our vocabulary


@dataclass(frozen=True, slots=True)
class CText:
    """Generated text.

    Attributes
    ----------
    statements : tuple of str
        Declarations of the temporaries, in order. Each is one line; a formula too long to follow its declaration is a
        comment line before it.
    results : mapping of str to str
        For each output the C expression of its value, to be returned or assigned: a `realv`, or a `real` where there
        are no lanes at all.
    """

    statements: tuple[str, ...]
    results: Mapping[str, str]

    def after(self, first: Iterable[str]) -> CText:
        """Return the same behind other statements."""
        return CText((*first, *self.statements), self.results)


def c_text(
    outputs: Mapping[str, Expr], *, symbols: Mapping[str, str], lanes: Collection[str], precision: Precision
) -> CText:
    """Spell expressions in OpenCL C, sharing what they have in common.

    Parameters
    ----------
    outputs : mapping of str to Expr
        What is wanted, under the names that `results` will have.
    symbols : mapping of str to str
        The C spelling of every symbol that occurs, such as `"p.x"` or `"s.R"`.
    lanes : collection of str
        The symbols that differ between the lanes of a packet (`realv`). The others are `real`.
    precision : "single" or "double"
        What `real` is; numbers are spelled for it.

    Raises
    ------
    KeyError
        If a symbol has no spelling.
    """
    return Writer(outputs, symbols, lanes, precision).write()


def spell_number(value: float, precision: Precision) -> str:
    """Spell a number so that it reads back as the nearest value of that precision; always with a point."""
    if precision == "double":
        return _pointed(repr(value))
    try:
        nearest = single(value)
    except OverflowError:
        return "INFINITY" if value > 0.0 else "-INFINITY"
    digits = next(text for n in range(1, 10) if single(float(text := f"{nearest:.{n}g}")) == nearest)
    return _pointed(digits) + "f"


def single(value: float) -> float:
    """Round to the nearest number of single precision; OverflowError beyond its largest."""
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


def _pointed(digits: str) -> str:
    if "." in digits:
        return digits
    mantissa, mark, exponent = digits.partition("e")
    return f"{mantissa}.0{mark}{exponent}"


def lowered(roots: Iterable[Expr]) -> tuple[dict[Expr, Expr], dict[Expr, Expr]]:
    """Replace integer powers by products: u^n = (u^(n/2))^2, or u^(n-1) u for odd n.

    Returns
    -------
    lower, origin : dict
        The replacement of every node; and for every replacement the node it says in other words.
    """
    lower: dict[Expr, Expr] = {}
    origin: dict[Expr, Expr] = {}

    def product(base: Expr, of: Expr, n: int) -> Expr:
        if n == 1:
            return base
        if n % 2:
            made = node("*", product(base, of, n - 1), base)
        else:
            half = product(base, of, n // 2)
            made = node("*", half, half)
        origin.setdefault(made, node("power", of, number(n)))
        return made

    for each in walk(roots):
        if each.op == "power":
            lower[each] = product(lower[each.args[0]], each.args[0], whole(each.args[1]))
        else:
            lower[each] = node(each.op, *(lower[arg] for arg in each.args)) if each.args else each
        origin.setdefault(lower[each], each)
    return lower, origin


class Writer:
    """Names shared parts, in the order of use; how a node is spelled is for subclasses to change."""

    def __init__(
        self, outputs: Mapping[str, Expr], symbols: Mapping[str, str], lanes: Collection[str], precision: Precision
    ) -> None:
        self._lower, self._origin = lowered(outputs.values())
        self._outputs = {name: self._lower[expr] for name, expr in outputs.items()}
        self._symbols, self._lane_names, self._precision = symbols, frozenset(lanes), precision
        self._order = list(walk(self._outputs.values()))
        self._named = self._shared()
        self._text: dict[Expr, tuple[str, int]] = {}  # spelling and how tightly it binds
        self._on_lanes: dict[Expr, bool] = {}
        self._formula: dict[Expr, tuple[str, int]] = {}  # in the symbols alone, as long as that is short
        self._brief: dict[Expr, tuple[str, int]] = {}  # with the names of temporaries
        self._statements: list[str] = []
        self._taken = set(RESERVED_WORDS) | set(OPERATIONS)
        for spelled in symbols.values():
            self._taken.update(re.findall(r"\w+", spelled))
        self._count: Counter[str] = Counter()

    def _shared(self) -> set[Expr]:
        """Return the nodes that must be named: used more than once, or where their text stands more than once."""
        uses = Counter(arg for each in self._order for arg in each.args)
        uses.update(self._outputs.values())
        named = {each for each in self._order if uses[each] > 1}
        for each in self._order:
            if each.args and OPERATIONS[each.op].named:
                named.add(each)
                named.update(each.args)
        return {each for each in named if each.args and not (each.op == "neg" and not each.args[0].args)}

    def write(self) -> CText:
        """Spell everything, operands first."""
        for each in self._order:
            self._on_lanes[each] = each.name in self._lane_names or any(self._on_lanes[arg] for arg in each.args)
            self._text[each] = self._spell(each)
            while len(self._text[each][0]) > _INLINE and (long := self._longest_operand(each)) is not None:
                self._declare(long)
                self._text[each] = self._spell(each)
            self._formula[each], self._brief[each] = self._say(each, self._formula), self._say(each, self._brief)
            if each in self._named:
                self._declare(each)
        return CText(tuple(self._statements), {name: self._result(expr) for name, expr in self._outputs.items()})

    def _result(self, each: Expr) -> str:
        return self._text[each][0] if self._on_lanes[each] or not self._lane_names else self._widened(each)

    def _kind(self, each: Expr) -> str:
        """Return the C type of a node."""
        return "realv" if self._on_lanes[each] else "real"

    def _spell(self, each: Expr) -> tuple[str, int]:
        if each.op == "number":
            assert each.value is not None
            return spell_number(each.value, self._precision), PRODUCT if each.value < 0.0 else ATOM
        if each.op == "symbol":
            return self._symbols[str(each.name)], ATOM
        row = OPERATIONS[each.op]
        needs = row.needs if row.c_needs is None else row.c_needs
        level = row.level if row.c_level is None else row.c_level
        arithmetic = level in (SUM, NEGATION, PRODUCT)
        parts = [
            wrapped(*self._text[arg], needed)
            if arithmetic or self._on_lanes[arg] or not self._on_lanes[each]
            else self._widened(arg)  # functions and ?: take operands of one type only
            for arg, needed in zip(each.args, needs, strict=True)
        ]
        if each.op == "neg" and parts[0].startswith("-"):  # two signs in a row are one operator of C, another
            parts = [f"({parts[0]})"]
        nan = f"({self._kind(each)})(NAN)"
        on_lanes = "_v" if self._on_lanes[each] else ""
        return row.c.format(*parts, zero=spell_number(0.0, self._precision), nan=nan, on_lanes=on_lanes), level

    def _widened(self, each: Expr) -> str:
        """Spell a scalar as a value for every lane."""
        return f"(realv){wrapped(*self._text[each], ATOM)}"

    def _longest_operand(self, each: Expr) -> Expr | None:
        """Return the operand that is worth a name: the longest that is not a name, a number or the like."""
        operands = [arg for arg in each.args if arg.args and not re.fullmatch(r"[\w.]+", self._text[arg][0])]
        return max(operands, key=lambda arg: len(self._text[arg][0]), default=None)

    def _say(self, each: Expr, said: Mapping[Expr, tuple[str, int]]) -> tuple[str, int]:
        """Spell a node for people, from its operands as they stood before powers became products."""
        origin = self._origin[each]
        return spell(
            origin, {arg: spell(arg, {}) if arg.op == "number" else said[self._lower[arg]] for arg in origin.args}
        )

    def _declare(self, each: Expr) -> None:
        name = self._name(each)
        line = f"const {self._kind(each)} {name} = {self._text[each][0]};"
        says = self._formula[each][0]
        if len(says) > _COMMENT:
            says, self._formula[each] = self._brief[each][0], (name, ATOM)
            says = says if len(says) <= _COMMENT else says[: _COMMENT - 3] + "..."
        fits = len(line) + 6 + len(says) <= _LINE
        self._statements += [f"{line}   // {says}"] if fits else [f"// {says}", line]
        self._text[each] = self._brief[each] = (name, ATOM)

    def _name(self, each: Expr) -> str:
        """Call x^2 x2, x y xy, the square of root1 root1_squared; anything else by its operation and a count."""
        structural = self._structural(self._origin[each], each)
        if structural and structural not in self._taken and not re.fullmatch("[A-Z_]{2,}", structural):
            self._taken.add(structural)
            return structural
        stem = OPERATIONS[self._origin[each].op].stem
        while True:
            self._count[stem] += 1
            name = f"{stem}{self._count[stem]}"
            if name not in self._taken:
                self._taken.add(name)
                return name

    def _structural(self, origin: Expr, each: Expr) -> str | None:
        if origin.op == "power":
            base, n = origin.args[0], whole(origin.args[1])
            if base.op == "symbol":
                return f"{base.name}{n}" if not str(base.name)[-1].isdigit() else f"{base.name}_{n}"
            if n == 2 and each.op == "*" and self._text[each.args[0]][0].isidentifier():
                return f"{self._text[each.args[0]][0]}_squared"
        if origin.op == "*" and all(arg.op == "symbol" for arg in origin.args):
            names = [str(arg.name) for arg in origin.args]
            return "".join(names) if all(len(name) == 1 for name in names) else "_".join(names)
        return None
