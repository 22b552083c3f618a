"""Find the kernel fragments: real OpenCL C files, beside the package in a checkout and inside it in a wheel."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Literal

from lenscl.errors import LensclError
from lenscl.expr import OPERATIONS, Expr
from lenscl.expr.graph import walk

Precision = Literal["single", "double", "mixed"]

_PACKAGE = Path(__file__).resolve().parent.parent
_HOMES = (_PACKAGE / "kernels", _PACKAGE.parent / "kernels")
_DEFINED = re.compile(r"#define (\w+)")
_REALS = {
    "single": ("float", "int", "FLT", "x##f"),
    "double": ("double", "long", "DBL", "x"),
}


VOCABULARY = (
    "lanes.cl",
    "prelude.cl",
    "functions.cl",
    "waves.cl",
    "memory.cl",
)  # the fragments that all others are written in


def called_by(expressions: Iterable[Expr]) -> tuple[str, ...]:
    """Return the fragments beyond the vocabulary that the C text of expressions, and of their slopes, calls."""
    found = (name for each in walk(expressions) if each.args for name in OPERATIONS[each.op].fragments)
    return tuple(dict.fromkeys(found))


def carried(precision: Precision) -> Literal["single", "double"]:
    """Return the precision that rays are carried in: mixed searches in single, and carries them in double."""
    return "single" if precision == "single" else "double"


@cache
def fragment(name: str) -> str:
    """Return the text of a fragment.

    Parameters
    ----------
    name : str
        Its file below kernels/, such as "newton.cl" or "effects/follow_total_reflection.cl".
    """
    for home in _HOMES:
        path = home / name
        if path.is_file():
            return path.read_text(encoding="utf-8")
    raise LensclError(f"{name}: this kernel file is missing from the installation; install lenscl again")


def located(name: str) -> str:
    """Return a fragment behind a mark that makes the compiler's messages name its file."""
    return f'#line 1 "{name}"\n{fragment(name)}'


def located_until(name: str, end: str) -> str:
    """Return the part of a fragment before the first line that begins with `end`, marked likewise."""
    part, found, _ = located(name).partition(f"\n{end}")
    if not found:
        raise LensclError(f"{name}: this kernel file is not of this version; install lenscl again")
    return f"{part}\n"


def generated(what: str) -> str:
    """Return the mark and comment that open a generated part."""
    return f'#line 1 "generated"\n// {what}\n'


def head(precision: Precision, width: int) -> str:
    """Return the definitions that kernels/lanes.cl expects: the precision and the lanes of a packet."""
    return _head(carried(precision), width, inputs_rounded=False)


def head_again(precision: Literal["single", "double"], width: int, *, inputs_rounded: bool) -> str:
    """Return those definitions for what follows in a kernel that has a head already.

    Parameters
    ----------
    inputs_rounded : bool
        Whether the rays that are searched are rounded to this precision.
    """
    text = _head(precision, width, inputs_rounded=inputs_rounded)
    return "".join(f"#undef {name}\n" for name in _DEFINED.findall(text)) + text


def _head(precision: Literal["single", "double"], width: int, *, inputs_rounded: bool) -> str:
    real, mask, limits, literal = _REALS[precision]
    return (
        f"#define REAL {real}\n#define MASK {mask}\n#define VW {width}\n"
        f"#define REAL_MAX {limits}_MAX\n#define REAL_TINY {limits}_MIN\n#define REAL_EPSILON {limits}_EPSILON\n"
        f"#define NUMBER(x) {literal}\n#define INPUT_ROUNDINGS {int(inputs_rounded)}\n"
    )
