"""Write the C functions of a surface from its expression."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from textwrap import shorten

from lenscl.codegen.along import along_functions
from lenscl.codegen.bands import band_functions, band_functions_twice, leaves_of
from lenscl.codegen.joined import joined_functions
from lenscl.codegen.text import Precision, function, shape_symbols, unlike
from lenscl.expr import Expr, build, differentiate, gradient, number, symbol
from lenscl.lenses import Surface
from lenscl.lenses.planes import WORDS

_COMMENT = 100  # characters of a formula that a comment shows
_VECTOR = "const real3v g = {{{df_dx}, {df_dy}, {df_dz}}};\nreturn g;"
_VALUE_AND_VECTOR = "g->x = {df_dx};\ng->y = {df_dy};\ng->z = {df_dz};\nreturn {f};"
_SECOND = {
    f"d2f_d{u}d{v}": (i, j) for i, u in enumerate("xyz") for j, v in enumerate("xyz") if i <= j
}  # by row and column of the symmetric matrix
_VECTOR_AND_MATRIX = "".join(
    [
        *(f"g->{axis} = {{df_d{axis}}};\n" for axis in "xyz"),
        *(f"h[{place}] = {{{name}}};\n" for place, name in enumerate(_SECOND)),
    ]
)
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
    return function(
        signature, {"f": surface.expression} | _slopes(surface), _VALUE_AND_VECTOR, _local(surface), precision
    )


def _gradient(prefix: str, surface: Surface, precision: Precision) -> str:
    signature = f"real3v {prefix}_gradient(real3v p, {prefix}_t shape)"
    return function(signature, _slopes(surface), _VECTOR, _local(surface), precision)


def _hessian(prefix: str, surface: Surface, precision: Precision) -> str:
    """Return the gradient and the second derivatives: xx, xy, xz, yy, yz, zz."""
    signature = f"void {prefix}_hessian(real3v p, {prefix}_t shape, real3v *g, realv h[6])"
    slopes = gradient(surface.expression)
    second = {name: differentiate(slopes[i], "xyz"[j]) for name, (i, j) in _SECOND.items()}
    return function(signature, _slopes(surface) | second, _VECTOR_AND_MATRIX, _local(surface), precision)


def _leaf_value_and_gradient(prefix: str, surface: Surface, precision: Precision) -> str:
    """Return the value and gradient of one leaf; near an edge, or beside faces of larger values, F may show another."""
    signature = f"realv {prefix}_leaf_f_gradient(real3v p, {prefix}_t shape, realv leaf, real3v *g)"
    leaves = leaves_of(surface)
    outputs = {"f": _of_leaf(surface, leaves)} | _slopes_of_leaf(surface)
    return function(signature, outputs, _VALUE_AND_VECTOR, _local(surface) | _leaf_symbol(surface), precision)


def _leaf_gradient(prefix: str, surface: Surface, precision: Precision) -> str:
    signature = f"real3v {prefix}_leaf_gradient(real3v p, {prefix}_t shape, realv leaf)"
    return function(signature, _slopes_of_leaf(surface), _VECTOR, _local(surface) | _leaf_symbol(surface), precision)


def coat_function(name: str, prefix: str, surface: Surface, coats: tuple[Expr, Expr], precision: Precision) -> str:
    """Return the function <name>_coat of a lens: what kernels/coats.cl has of a point, by two functions of faces."""
    outputs, lines = {}, ["coat_t at;"]
    for side, face in zip(("coat", "rest"), coats, strict=True):
        outputs[side] = face
        lines.append(f"at.{side} = {{{side}}};")
        for axis, slope in zip("xyz", gradient(face), strict=True):
            outputs[f"{side}_{axis}"] = slope
            lines.append(f"at.{side}_gradient.{axis} = {{{side}_{axis}}};")
    signature = f"coat_t {name}_coat(real3v p, {prefix}_t shape)"
    return function(signature, outputs, "\n".join([*lines, "return at;"]), _local(surface), precision)


def _planes(prefix: str, surface: Surface, _: Precision) -> str:
    """Return the number of a polyhedron's planes; they themselves are arguments."""
    return f"#define {prefix}_PLANES {len(surface.planes)}\n#define {prefix}_WORDS {WORDS}\n"


WRITERS: dict[str, Callable[[str, Surface, Precision], str]] = {
    "f": _value,
    "f_gradient": _value_and_gradient,
    "gradient": _gradient,
    "hessian": _hessian,
    "leaf_f_gradient": _leaf_value_and_gradient,
    "leaf_gradient": _leaf_gradient,
    "along": along_functions,
    "planes": _planes,
    "joined": joined_functions,
    "bands": band_functions,
    "bands_twice": band_functions_twice,
}


def _slopes(surface: Surface) -> dict[str, Expr]:
    return dict(zip(("df_dx", "df_dy", "df_dz"), gradient(surface.expression), strict=True))


def _slopes_of_leaf(surface: Surface) -> dict[str, Expr]:
    by_leaf = zip(*(gradient(leaf) for leaf in leaves_of(surface)), strict=True)
    return {name: _of_leaf(surface, slopes) for name, slopes in zip(("df_dx", "df_dy", "df_dz"), by_leaf, strict=True)}


def _of_leaf(surface: Surface, of_leaves: Sequence[Expr]) -> Expr:
    """Return the one of some leaves' expressions that the leaf's number tells."""
    (name,) = _leaf_symbol(surface)
    *others, chosen = of_leaves
    for number_below, other in reversed(list(enumerate(others))):
        chosen = build("where", symbol(name), number(number_below + 0.5), other, chosen)
    return chosen


def _leaf_symbol(surface: Surface) -> dict[str, str]:
    return {unlike("leaf", _local(surface)): "leaf"}


def _local(surface: Surface) -> dict[str, str]:
    return _COORDINATES | shape_symbols(surface)


def _described(surface: Surface) -> str:
    """Return a surface's formula for a comment; a user's own text stays out, for it may hold line ends."""
    return shorten(surface.formula if surface.name != "expression" else str(surface.expression), _COMMENT)
