"""Write how the surfaces of a kernel are searched.

With mixed precision the vocabulary stands twice in a kernel: the searches are compiled in words of single precision
between words_single.cl and words_double.cl, all else in double. A closed form has nothing that single could do first.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Literal

from lenscl.codegen.bands import leaves_of
from lenscl.codegen.fragments import VOCABULARY, called_by, generated, head_again, located
from lenscl.codegen.joined import hard_leaves, leaves_dispatched
from lenscl.codegen.layout import Struct
from lenscl.codegen.specialise import Structure, method_struct, shape_struct
from lenscl.codegen.surfaces import surface_functions
from lenscl.lenses import Surface
from lenscl.methods import Method

# The fragments that make SURFACE(first_root)() of SURFACE(isolate)()
ENDINGS = {
    "isolated": ("root_isolated.cl",),
    "corrected": ("root_corrected.cl",),
    "polished": ("newton.cl", "root_polished.cl"),
    "mixed": ("newton.cl", "root_mixed.cl"),
}


def searches(structure: Structure) -> Iterator[str]:
    """Yield how each surface is searched: for every distinct one, SURFACE(first_root)() and what it needs."""
    mixed = [prefix for prefix in structure.surfaces() if structure.is_mixed(prefix)]
    whole = [prefix for prefix in structure.surfaces() if not structure.is_mixed(prefix)]
    if mixed:
        yield from _in_single(structure, mixed)
    else:
        yield located("search.cl")
    yield from _words(structure, whole)
    for prefix in structure.surfaces():
        yield from _searched_surface(structure, prefix)


def _in_single(structure: Structure, prefixes: Sequence[str]) -> Iterator[str]:
    """Yield the searches in single precision of a kernel whose rays are double."""
    yield located("search.cl")
    yield located("words_single.cl")
    yield head_again("single", structure.width, inputs_rounded=True)
    yield from (located(name) for name in (*VOCABULARY[:4], *words_of(structure), "search.cl"))
    yield generated("the numbers of a scene that the searches read")
    yield method_struct(structure).declare()
    yield from (shape_struct(structure.surfaces()[prefix], f"{prefix}_single_t").declare() for prefix in prefixes)
    yield from _words(structure, prefixes)
    for prefix in prefixes:
        yield generated("a surface, from its expression")
        yield from _isolated_surface(structure, prefix, f"{prefix}_single", "single")
    yield located("words_double.cl")
    yield head_again("double", structure.width, inputs_rounded=False)
    yield located("mixed.cl")
    yield _rounded("single_method(const method_t *given)", "single_method_t", method_struct(structure), "given->")
    for prefix in prefixes:
        struct = shape_struct(structure.surfaces()[prefix], f"{prefix}_single_t")
        yield _rounded(f"{prefix}_single_shape({prefix}_t given)", struct.c_name, struct, "given.")


def words_of(structure: Structure) -> tuple[str, ...]:
    """Return the fragments beyond the vocabulary that the functions of a kernel's surfaces call."""
    return called_by(surface.expression for surface in structure.surfaces().values())


def _words(structure: Structure, prefixes: Sequence[str]) -> Iterator[str]:
    methods = [structure.method(prefix) for prefix in prefixes]
    names = [name for method in methods for name in method.words]
    bands = [f"interval_{name}" for name in words_of(structure) if names]
    yield from (located(name) for name in dict.fromkeys((*names, *bands)))


def _isolated_surface(
    structure: Structure, prefix: str, name: str, precision: Literal["single", "double"]
) -> Iterator[str]:
    surface, method = structure.surfaces()[prefix], structure.method(prefix)
    yield surface_functions(name, surface, method.writes, precision)
    hard = hard_leaves(surface) if method.wants_leaves else {}
    for leaf in hard:
        yield f"#define SURFACE(name) {name}_leaf_{leaf}_##name\n"
        yield from (located(fragment) for fragment in method.of_leaf)
        yield "#undef SURFACE\n"
    if hard:
        yield leaves_dispatched(name, hard)
    yield f"#define SURFACE(name) {name}_##name\n"
    yield from (located(fragment) for fragment in method.fragments_for(surface.degree))
    yield "#undef SURFACE\n"


def _searched_surface(structure: Structure, prefix: str) -> Iterator[str]:
    surface, method = structure.surfaces()[prefix], structure.method(prefix)
    is_mixed = structure.is_mixed(prefix)
    ending = "mixed" if is_mixed else method.ending_for(surface.degree)
    yield generated("a surface, from its expression")
    if not is_mixed:
        yield from _isolated_surface(structure, prefix, prefix, structure.carried)
    if not method.wants_planes:  # which have these functions in planes.cl
        yield finish_functions(prefix, surface, method, structure.carried, asks_values=bool(structure.nests))
    if structure.needs and not method.wants_planes:
        yield generated("what effects ask of the surface")
        yield surface_functions(prefix, surface, structure.needs, structure.carried)
    tolerance = "(realv)method->tolerance" if "tolerance" in method.reads else "(realv)0"
    yield f"#define {prefix}_CONVEX {int(surface.is_convex)}\n#define {prefix}_TOLERANCE {tolerance}\n"
    yield f"#define SURFACE(name) {prefix}_##name\n"
    yield from (located(name) for name in ENDINGS[ending])
    yield located("ahead_box.cl")
    if surface.is_convex and surface.degree == 2 and surface.degree in method.closed_forms:
        yield located("ahead_chord.cl")
    else:
        yield f"#define {prefix}_root_ahead {prefix}_root_in_box  // for every ray\n"
    yield "#undef SURFACE\n"


def finish_functions(
    prefix: str,
    surface: Surface,
    method: Method,
    precision: Literal["single", "double"],
    *,
    asks_values: bool = False,
) -> str:
    """Return what an ending and the lens ask of a surface: gradients, and values where roots are polished or compared.

    Where a surface is searched as a polynomial they are of that; where it is taken apart into leaves, of a leaf.
    """
    asks_values = asks_values or method.ending_for(surface.degree) != "isolated"
    edges = bool({"bands", "bands_twice", "joined"} & {*method.writes}) and len(leaves_of(surface)) > 1
    form = surface.polynomial_form if method.wants_polynomial else None
    wanted = ["gradient", *(["leaf_gradient"] if edges else [])]
    wanted += ["leaf_f_gradient" if edges else "f_gradient"] if asks_values else []
    text = surface_functions(prefix, replace(surface, expression=form or surface.expression), wanted, precision)
    if edges:
        return text
    return (
        f"{text}\n// taken as one leaf\n"
        f"#define {prefix}_leaf_gradient(p, shape, leaf) {prefix}_gradient(p, shape)\n"
        f"#define {prefix}_leaf_f_gradient(p, shape, leaf, g) {prefix}_f_gradient(p, shape, g)\n"
    )


def _rounded(signature: str, c_name: str, struct: Struct, given: str) -> str:
    """Return a function that rounds a structure of numbers to single precision."""
    fields = ", ".join(f"(float){given}{slot.name}" for slot in struct.slots)
    return f"static inline {c_name} {signature} {{\n  const {c_name} rounded = {{{fields}}};\n  return rounded;\n}}\n"
