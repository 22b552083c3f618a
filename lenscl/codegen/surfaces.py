"""Write the C functions of a surface from its expression."""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import shorten
from typing import Literal

from lenscl.codegen.specialise import parameter_spelling
from lenscl.expr import Expr, c_text, gradient
from lenscl.lenses import Surface

_COMMENT = 100  # characters of a formula that a comment shows


def surface_functions(prefix: str, surface: Surface, precision: Literal["single", "double"]) -> str:
    """Return the three functions that kernels/search.cl asks of a surface.

    Parameters
    ----------
    prefix : str
        The surface's own part of every C name.
    surface : Surface
        What to write.
    precision : str
        How numbers are spelled.
    """
    f = {"f": surface.expression}
    slopes = dict(zip(("df_dx", "df_dy", "df_dz"), gradient(surface.expression), strict=True))
    symbols = {"x": "p.x", "y": "p.y", "z": "p.z"}
    symbols |= {name: f"shape.{c_name}" for name, c_name in parameter_spelling(surface).items()}

    def function(signature: str, outputs: Mapping[str, Expr], ending: str) -> str:
        text = c_text(outputs, symbols=symbols, lanes=("x", "y", "z"), precision=precision)
        lines = [*text.statements, *ending.format_map(text.results).splitlines()]
        return f"static inline {signature} {{\n" + "".join(f"  {line}\n" for line in lines) + "}\n"

    point = f"real3v p, {prefix}_t shape"
    store = "g->x = (realv)({df_dx});\ng->y = (realv)({df_dy});\ng->z = (realv)({df_dz});"
    make = "const real3v g = {{(realv)({df_dx}), (realv)({df_dy}), (realv)({df_dz})}};\nreturn g;"
    return "\n".join(
        (
            f"// {prefix}: {_described(surface)}; negative inside",
            function(f"realv {prefix}_f({point})", f, "return {f};"),
            function(f"realv {prefix}_f_gradient({point}, real3v *g)", f | slopes, f"{store}\nreturn {{f}};"),
            function(f"real3v {prefix}_gradient({point})", slopes, make),
        )
    )


def _described(surface: Surface) -> str:
    """Return a surface's formula for a comment; a user's own text stays out, for it may hold line ends."""
    return shorten(surface.formula if surface.name != "expression" else str(surface.expression), _COMMENT)
