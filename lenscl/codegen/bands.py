"""Write a surface as bands on a segment of a ray: its polynomial parts there, and of their bands the rest."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from lenscl.codegen.text import Precision, function, function_of, shape_symbols
from lenscl.expr import Expr, band_text, build, degree, derivative_along, magnitude, number, pieces, polynomial, symbol
from lenscl.lenses import Surface

_AXES = "xyz"
_KINDS = ("linear", "quadratic", "cubic", "quartic")  # polynomials of kernels/interval_polynomials.cl, by degree
_INNER = 2  # degree of what a part is made of, as far as roundings are followed
_HORNER = 4  # roundings a degree for the sums that follow, twice over to cover terms of second order
_UNIT = symbol("REAL_EPSILON")
_INPUT = symbol("INPUT_ROUNDINGS")


def band_functions(prefix: str, surface: Surface, precision: Precision) -> str:
    """Return what search_interval.cl asks of a surface: its parts, and the bands of F and of F's slope."""
    rest, parts = pieces(surface.expression, _AXES, len(_KINDS))
    slope = derivative_along(rest, {name: symbol(f"{name}_slope") for name in parts})
    kinds = {name: _KINDS[_degree(part) - 1] for name, part in parts.items()}
    bands = {name: f"band_of_{kind}(parts->{name})" for name, kind in kinds.items()}
    starts = {name: f"start_of_{kind}(parts->{name})" for name, kind in kinds.items()}
    slopes = {f"{name}_slope": f"slope_of_{kind}(parts->{name})" for name, kind in kinds.items()}
    return "\n".join(
        (
            _parts_struct(prefix, kinds),
            _parts_function(prefix, surface, parts, precision),
            _band_function(prefix, "band", surface, rest, bands, precision),
            _band_function(prefix, "start_band", surface, rest, starts, precision),
            _band_function(prefix, "slope_band", surface, slope, bands | slopes, precision),
        )
    )


def _degree(part: Expr) -> int:
    found = degree(part, _AXES)
    assert found is not None, "a part is a polynomial"
    return found


def _parts_struct(prefix: str, kinds: dict[str, str]) -> str:
    fields = "".join(f"  {kind}_t {name};\n" for name, kind in kinds.items())
    return f"typedef struct {{\n{fields}}} {prefix}_parts_t;\n"


def _parts_function(prefix: str, surface: Surface, parts: dict[str, Expr], precision: Precision) -> str:
    """Return the function of the parts' coefficients and of what these may be wrong by."""
    spelled = {"REAL_EPSILON": "REAL_EPSILON", "INPUT_ROUNDINGS": "INPUT_ROUNDINGS"} | shape_symbols(surface)
    vectors = {}
    for vector in ("origin", "along", "reach", "drift"):
        vectors[vector] = {axis: _unlike(f"{vector}_{axis}", spelled) for axis in _AXES}
        spelled |= {vectors[vector][axis]: f"{vector}.{axis}" for axis in _AXES}
    origin, along, reach, drift = ({axis: symbol(name) for axis, name in names.items()} for names in vectors.values())
    outputs: dict[str, Expr] = {}
    lines = [f"{prefix}_parts_t parts;"]
    for name, part in parts.items():
        whole, inner = pieces(part, _AXES, _INNER)
        coefficients: dict[str, tuple[Expr, ...]] = {}
        errors: dict[str, Expr] = {}
        for each, quadric in inner.items():
            coefficients[each] = _polynomial(quadric, {axis: (origin[axis], along[axis]) for axis in _AXES})
            errors[each] = _error(quadric, _AXES, reach, drift)
        sizes = {each: _sum_of_sizes(coefficients[each]) + errors[each] for each in inner}
        error = errors[whole.name] if whole.name in errors else _error(whole, tuple(inner), sizes, errors)
        padded = (*_polynomial(whole, coefficients), *[number(0.0)] * _degree(part))
        for power in range(_degree(part) + 1):
            outputs[f"{name}_{power}"] = padded[power]
            lines.append(f"parts.{name}.c[{power}] = {{{name}_{power}}};")
        outputs[f"{name}_error"] = error
        lines.append(f"parts.{name}.error = ({{{name}_error}}) + UNDERFLOW;")
    return function(
        f"{prefix}_parts_t {prefix}_parts(real3v origin, real3v along, real3v reach, real3v drift, {prefix}_t shape)",
        outputs,
        "\n".join((*lines, "return parts;")),
        spelled,
        precision,
    )


def _error(form: Expr, along: Collection[str], sizes: Mapping[str, Expr], errors: Mapping[str, Expr]) -> Expr:
    """Bound what a polynomial is wrong by: its own roundings, and the errors of what it is made of.

    To first order the latter come in by the slopes of the polynomial with all terms positive, whose values at `sizes`,
    which hold the errors, are the largest.
    """
    size, roundings = magnitude(form, along)
    top = degree(form, along)
    assert top is not None
    count = number(2.0 * roundings + _HORNER * top) + _INPUT * (2.0 * (roundings + top))
    own, passed_on = (
        _polynomial(each, {name: (value,) for name, value in sizes.items()})[0]
        for each in (size, derivative_along(size, errors))
    )
    return count * _UNIT * own + passed_on


def _polynomial(form: Expr, along: Mapping[str, tuple[Expr, ...]]) -> tuple[Expr, ...]:
    found = polynomial(form, along)
    assert found is not None
    return found


def _sum_of_sizes(coefficients: Iterable[Expr]) -> Expr:
    total = number(0.0)
    for each in coefficients:
        total = total + build("abs", each)
    return total


def _unlike(name: str, taken: Collection[str]) -> str:
    while name in taken:
        name += "_"
    return name


def _band_function(
    prefix: str, name: str, surface: Surface, band: Expr, bands: dict[str, str], precision: Precision
) -> str:
    """Return the function of a band, `bands` being the C text of those that it is made of."""
    symbols = {part: part for part in bands} | shape_symbols(surface)
    text = band_text(band, symbols=symbols, bands=bands, precision=precision)
    return function_of(
        f"band_t {prefix}_{name}(const {prefix}_parts_t *parts, {prefix}_t shape)",
        text.after(f"const band_t {part} = {made};" for part, made in bands.items()),
        "return {band};",
    )
