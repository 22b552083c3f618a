"""Find the kernel fragments: real OpenCL C files, beside the package in a checkout and inside it in a wheel."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Literal

from lenscl.errors import LensclError

_PACKAGE = Path(__file__).resolve().parent.parent
_HOMES = (_PACKAGE / "kernels", _PACKAGE.parent / "kernels")
_REALS = {
    "single": ("float", "int", "FLT", "x##f"),
    "double": ("double", "long", "DBL", "x"),
}


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


def head(precision: Literal["single", "double"], width: int) -> str:
    """Return the definitions that kernels/prelude.cl expects: the precision and the lanes of a packet."""
    real, mask, limits, literal = _REALS[precision]
    return (
        f"#define REAL {real}\n#define MASK {mask}\n#define VW {width}\n"
        f"#define REAL_MAX {limits}_MAX\n#define REAL_TINY {limits}_MIN\n#define REAL_EPSILON {limits}_EPSILON\n"
        f"#define NUMBER(x) {literal}\n"
    )
