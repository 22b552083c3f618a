"""Write the C functions of a surface from its expression."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from textwrap import shorten

from lenscl.codegen.along import along_functions
from lenscl.codegen.text import Precision, function, function_of, shape_symbols
from lenscl.expr import Expr, band_text, derivative_along, gradient, symbol
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


def _band(prefix: str, surface: Surface, precision: Precision) -> str:
    signature = f"band_t {prefix}_band(band3_t p, {prefix}_t shape)"
    text = band_text(surface.expression, symbols=_local(surface), bands=_COORDINATES, precision=precision)
    return function_of(signature, text, "return {band};")


def _slope_band(prefix: str, surface: Surface, precision: Precision) -> str:
    signature = f"band_t {prefix}_slope_band(band3_t p, real3v d, {prefix}_t shape)"
    names = {axis: _unlike(f"d{axis}", shape_symbols(surface)) for axis in _COORDINATES}
    slope = derivative_along(surface.expression, {axis: symbol(name) for axis, name in names.items()})
    symbols = _local(surface) | {name: f"d.{axis}" for axis, name in names.items()}
    return function_of(
        signature, band_text(slope, symbols=symbols, bands=_COORDINATES, precision=precision), "return {band};"
    )


WRITERS: dict[str, Callable[[str, Surface, Precision], str]] = {
    "f": _value,
    "f_gradient": _value_and_gradient,
    "gradient": _gradient,
    "along": along_functions,
    "band": _band,
    "slope_band": _slope_band,
}


def _slopes(surface: Surface) -> dict[str, Expr]:
    return dict(zip(("df_dx", "df_dy", "df_dz"), gradient(surface.expression), strict=True))


def _local(surface: Surface) -> dict[str, str]:
    return _COORDINATES | shape_symbols(surface)


def _unlike(name: str, taken: Collection[str]) -> str:
    while name in taken:
        name += "_"
    return name


def _described(surface: Surface) -> str:
    """Return a surface's formula for a comment; a user's own text stays out, for it may hold line ends."""
    return shorten(surface.formula if surface.name != "expression" else str(surface.expression), _COMMENT)
