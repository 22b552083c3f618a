"""Write the C functions of a surface from its expression."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from textwrap import shorten

from lenscl.codegen.along import along_functions
from lenscl.codegen.bands import band_functions, band_functions_twice
from lenscl.codegen.text import Precision, function, shape_symbols
from lenscl.expr import Expr, gradient
from lenscl.lenses import Surface

_COMMENT = 100  # characters of a formula that a comment shows
_COORDINATES = {"x": "p.x", "y": "p.y", "z": "p.z"}


def surface_functions(prefix: str, surface: Surface, wanted: Iterable[str], precision: Precision) -> str:
    """Return functions of a surface as kernels/search.cl lists them.

    Parameters
    ----------
    prefix : str
        The surface's own part of every C name.
    surface : Surface
        What to write.
    wanted : iterable of str
        Their names there.
    precision : str
        How numbers are spelled.
    """
    functions = (WRITERS[name](prefix, surface, precision) for name in dict.fromkeys(wanted))
    return "\n".join((f"// {prefix}: {_described(surface)}; negative inside", *functions))


def _value(prefix: str, surface: Surface, precision: Precision) -> str:
    signature = f"realv {prefix}_f(real3v p, {prefix}_t shape)"
    return function(signature, {"f": surface.expression}, "return {f};", _local(surface), precision)


def _value_and_gradient(prefix: str, surface: Surface, precision: Precision) -> str:
    signature = f"realv {prefix}_f_gradient(real3v p, {prefix}_t shape, real3v *g)"
    ending = "g->x = {df_dx};\ng->y = {df_dy};\ng->z = {df_dz};\nreturn {f};"
    return function(signature, {"f": surface.expression} | _slopes(surface), ending, _local(surface), precision)


def _gradient(prefix: str, surface: Surface, precision: Precision) -> str:
    signature = f"real3v {prefix}_gradient(real3v p, {prefix}_t shape)"
    ending = "const real3v g = {{{df_dx}, {df_dy}, {df_dz}}};\nreturn g;"
    return function(signature, _slopes(surface), ending, _local(surface), precision)


WRITERS: dict[str, Callable[[str, Surface, Precision], str]] = {
    "f": _value,
    "f_gradient": _value_and_gradient,
    "gradient": _gradient,
    "along": along_functions,
    "bands": band_functions,
    "bands_twice": band_functions_twice,
}


def _slopes(surface: Surface) -> dict[str, Expr]:
    return dict(zip(("df_dx", "df_dy", "df_dz"), gradient(surface.expression), strict=True))


def _local(surface: Surface) -> dict[str, str]:
    return _COORDINATES | shape_symbols(surface)


def _described(surface: Surface) -> str:
    """Return a surface's formula for a comment; a user's own text stays out, for it may hold line ends."""
    return shorten(surface.formula if surface.name != "expression" else str(surface.expression), _COMMENT)
