"""Write a surface that joins polynomials by max and min: each polynomial along a ray, as search_joined.cl asks."""

from __future__ import annotations

from collections.abc import Collection

from lenscl.codegen.along import form_along
from lenscl.codegen.bands import leaves_text
from lenscl.codegen.text import Precision, function, shape_symbols, unlike
from lenscl.expr import Expr, creased, degree, derivative_along, magnitude, number, polynomial, symbol
from lenscl.expr.joined import CLOSED, MOST_LEAVES
from lenscl.lenses import Surface

_AXES = "xyz"
_HORNER = 4  # as in `along`
_MOVED = 4  # as in `along`: a leaf's zone is compared with places of others, found from an origin that is moved


def joined_functions(prefix: str, surface: Surface, precision: Precision) -> str:
    """Return how the leaves are joined, those of low degree along a ray, and every other as a polynomial of its own."""
    joined, leaves = creased(surface.expression, MOST_LEAVES)
    hard = hard_leaves(surface)
    texts = [leaves_text(prefix, joined, len(leaves))]
    for leaf, form in hard.items():
        name = f"{prefix}_leaf_{leaf}"
        top = degree(form, _AXES)
        assert top is not None, "leaves are polynomials"
        texts.append(f"#define {name}_t {prefix}_t\n")
        texts.append(form_along(name, surface, form, top, precision, starts_moved=True))
    texts.append(_closed_along(prefix, surface, list(leaves.values()), precision))
    texts += [_rounding(prefix, surface, list(leaves.values()), precision, moves=moves) for moves in (False, True)]
    texts.append(_values(prefix, surface, list(leaves.values()), precision))
    texts.append(f"#define {prefix}_IS_HARD(leaf) ({sum(1 << leaf for leaf in hard)} >> (leaf) & 1)\n")
    return "\n".join(texts)


def hard_leaves(surface: Surface) -> dict[int, Expr]:
    """Return the leaves whose roots along a ray are not had in closed form, by their numbers."""
    leaves = enumerate(surface.polynomial_leaves)
    return {number: leaf for number, leaf in leaves if (degree(leaf, _AXES) or 0) > CLOSED}


def leaves_dispatched(prefix: str, hard: Collection[int]) -> str:
    """Return the function that searches a leaf by its number."""
    calls = "".join(
        f"  if (leaf == {k}) return {prefix}_leaf_{k}_next_zone(search, shape, start, end, looks);\n" for k in hard
    )
    return (
        f"static inline zone_t {prefix}_next_zone(int leaf, search_t search, {prefix}_t shape, realv start, realv end,"
        f" root_t *looks) {{\n{calls}"
        "  return no_zone();\n}\n"
    )


def _closed_along(prefix: str, surface: Surface, leaves: list[Expr], precision: Precision) -> str:
    """Return the function of the coefficients along the ray of all leaves of low degree."""
    shape = shape_symbols(surface)
    ray = {vector: {axis: unlike(f"{vector}{axis}", shape) for axis in _AXES} for vector in "od"}
    line = {axis: (symbol(ray["o"][axis]), symbol(ray["d"][axis])) for axis in _AXES}
    outputs: dict[str, Expr] = {}
    hard = hard_leaves(surface)
    for leaf, form in enumerate(leaves):
        found = (number(0.0),) if leaf in hard else polynomial(form, line)
        assert found is not None, "leaves are polynomials"
        padded = (*found, *[number(0.0)] * CLOSED)[: CLOSED + 1]
        outputs |= {f"c{leaf}_{power}": each for power, each in enumerate(padded)}
    names = [(leaf, power) for leaf in range(len(leaves)) for power in range(CLOSED + 1)]
    return function(
        f"void {prefix}_closed(real3v o, real3v d, {prefix}_t shape, realv c[{len(leaves)}][{CLOSED + 1}])",
        outputs,
        "\n".join(f"c[{leaf}][{power}] = {{c{leaf}_{power}}};" for leaf, power in names),
        {name: f"{vector}.{axis}" for vector, axes in ray.items() for axis, name in axes.items()} | shape,
        precision,
    )


def _rounding(prefix: str, surface: Surface, leaves: list[Expr], precision: Precision, *, moves: bool) -> str:
    """Return the function of what the leaves may be wrong by where coordinates are of a size.

    If it `moves`, coordinates may be wrong by `drift`, too.
    """
    shape = shape_symbols(surface)
    drift = {axis: symbol(unlike(f"drift_{axis}", shape)) for axis in _AXES} if moves else {}
    sizes: dict[str, Expr] = {}
    lines = []
    for leaf, form in enumerate(leaves):
        top = degree(form, _AXES) or 0
        sizes[f"size_{leaf}"], roundings = magnitude(form, _AXES)
        own = 2 * roundings + (_HORNER + _MOVED) * top + _MOVED * roundings
        count = f"({own} + INPUT_ROUNDINGS * {2 * (roundings + top)})"
        moved = f" + ({{moved_{leaf}}})" if moves else ""
        if moves:
            sizes[f"moved_{leaf}"] = derivative_along(sizes[f"size_{leaf}"], drift)
        lines.append(f"error[{leaf}] = (realv)(REAL_EPSILON * {count}) * ({{size_{leaf}}}){moved};")
    name, more = ("errors_at", ", real3v drift") if moves else ("errors_within", "")
    return function(
        f"void {prefix}_{name}(real3v p{more}, {prefix}_t shape, realv error[{len(leaves)}])",
        sizes,
        "\n".join(lines),
        {axis: f"p.{axis}" for axis in _AXES} | {str(drift[axis].name): f"drift.{axis}" for axis in drift} | shape,
        precision,
    )


def _values(prefix: str, surface: Surface, leaves: list[Expr], precision: Precision) -> str:
    return function(
        f"void {prefix}_leaf_values(real3v p, {prefix}_t shape, realv value[{len(leaves)}])",
        {f"f_{leaf}": form for leaf, form in enumerate(leaves)},
        "\n".join(f"value[{leaf}] = {{f_{leaf}}};" for leaf in range(len(leaves))),
        {axis: f"p.{axis}" for axis in _AXES} | shape_symbols(surface),
        precision,
    )
