"""Write a polynomial surface as a polynomial along a ray."""

from __future__ import annotations

from lenscl.codegen.text import Precision, function, shape_symbols, unlike
from lenscl.expr import Expr, magnitude, number, polynomial, symbol
from lenscl.lenses import Surface

_AXES = "xyz"
_HORNER = 4  # roundings a degree that recentring adds, twice over to cover terms of second order


def along_functions(prefix: str, surface: Surface, precision: Precision) -> str:
    """Return the coefficients of F along a ray, a bound on F's terms, and the degree, as search_polynomial.cl asks."""
    form, top = surface.polynomial_form, surface.degree
    assert form is not None, "the method is chosen for polynomials only"
    assert top is not None
    return form_along(prefix, surface, form, top, precision)


def form_along(
    prefix: str, surface: Surface, form: Expr, top: int, precision: Precision, *, starts_moved: bool = False
) -> str:
    """Return the same of a polynomial of degree `top` in the surface's parameters.

    `starts_moved` says that the ray's origin may be a rounded point of the ray, and its length a part of it.
    """
    shape = shape_symbols(surface)
    ray = {vector: {axis: unlike(f"{vector}{axis}", shape) for axis in _AXES} for vector in "od"}
    coefficients = polynomial(form, {axis: (symbol(ray["o"][axis]), symbol(ray["d"][axis])) for axis in _AXES})
    assert coefficients is not None
    padded = (*coefficients, *[number(0.0)] * (top + 1 - len(coefficients)))
    size, roundings = magnitude(form, _AXES)
    spelled = {name: f"{vector}.{axis}" for vector, axes in ray.items() for axis, name in axes.items()}
    own = 2 * roundings + _HORNER * top + (4 * (roundings + top) if starts_moved else 0)
    names = [f"c{power}" for power in range(top + 1)]
    return "\n".join(
        (
            f"#define {prefix}_DEGREE {top}",
            f"#define {prefix}_ROUNDINGS ({own} + INPUT_ROUNDINGS * {2 * (roundings + top)})",
            function(
                f"void {prefix}_along(real3v o, real3v d, {prefix}_t shape, realv c[{top + 1}])",
                dict(zip(names, padded, strict=True)),
                "\n".join(f"c[{power}] = {{{name}}};" for power, name in enumerate(names)),
                spelled | shape,
                precision,
            ),
            function(
                f"realv {prefix}_magnitude(real3v p, {prefix}_t shape)",
                {"size": size},
                "return {size};",
                {axis: f"p.{axis}" for axis in _AXES} | shape,
                precision,
            ),
        )
    )
