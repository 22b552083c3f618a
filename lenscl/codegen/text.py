"""Write C functions of expressions, in the words of the kernels."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Literal

from lenscl.codegen.specialise import parameter_spelling
from lenscl.expr import CText, Expr, c_text
from lenscl.lenses import Surface

Precision = Literal["single", "double"]


def function(
    signature: str, outputs: Mapping[str, Expr], ending: str, symbols: Mapping[str, str], precision: Precision
) -> str:
    """Return a C function that computes outputs and ends as told, each {name} of an output being its C text."""
    lanes = [name for name, spelled in symbols.items() if not spelled.startswith("shape.")]
    return function_of(signature, c_text(outputs, symbols=symbols, lanes=lanes, precision=precision), ending)


def function_of(signature: str, text: CText, ending: str) -> str:
    """Return a C function with the given statements, which ends as told."""
    lines = [*text.statements, *ending.format_map(text.results).splitlines()]
    return f"static inline {signature} {{\n" + "".join(f"  {line}\n" for line in lines) + "}\n"


def shape_symbols(surface: Surface) -> dict[str, str]:
    """Return the C spelling of a surface's parameters."""
    return {name: f"shape.{c_name}" for name, c_name in parameter_spelling(surface).items()}


def unlike(name: str, taken: Collection[str]) -> str:
    """Return a name for a symbol of our own that no parameter has."""
    while name in taken:
        name += "_"
    return name
