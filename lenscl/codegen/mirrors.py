"""Write what tells mirrored faces from others, for the lenses that have some.

A kernel without a mirror has no text of it. Which faces are mirrors is written into the text: a lens that is a mirror
all over needs no look at the point, and another one compares two functions there, `lenscl.lenses.coat_functions`.
"""

from __future__ import annotations

from collections.abc import Iterator

from lenscl.codegen.fragments import generated, located
from lenscl.codegen.specialise import Kind, Structure
from lenscl.codegen.surfaces import coat_function
from lenscl.codegen.table import by_kind
from lenscl.lenses import Surface, coat_functions, coated_planes
from lenscl.methods import Method

_HEAD = (
    "static inline maskv mirrored_at(const ray_t *ray, const interface_t *at, const scene_t *scene, "
    "maskv *unsure) {\n  maskv mirrors = (maskv)0, open = (maskv)0;"
)
_TAIL = "  *unsure = open & not_lane(mirrors);\n  return mirrors;\n}\n"


def mirrors_told(structure: Structure) -> Iterator[str]:
    """Yield a few words on the mirrors of each lens, of those in a table once a kind."""
    if structure.tabled:
        yield from (f"{kind.prefix}: {_told(kind.mirror)}" for kind in structure.kinds if kind.mirror)
    else:
        yield from (f"lens_{number}: {_told(coated)}" for number, coated in structure.mirrors)


def _told(mirror: bool | tuple[str, ...]) -> str:
    return "all faces" if isinstance(mirror, bool) else f"{len(mirror)} of its faces"


def lens_coats(structure: Structure, number: int) -> Iterator[str]:
    """Yield LENS(is_coated)() of a lens with mirrored faces and others; stands where LENS and SURFACE are defined."""
    coated = structure.coats.get(number)
    if coated is not None:
        prefix = structure.prefix(number)
        yield from _coats(
            structure, f"lens_{number}", prefix, structure.lenses[number], structure.method(prefix), coated
        )


def kind_mirrors(structure: Structure, kind: Kind) -> Iterator[str]:
    """Yield LENS(mirrored)() of the lenses of a table's kind: the lanes that meet mirrored faces, and those unsure."""
    if isinstance(kind.mirror, tuple):
        yield from _coats(structure, f"{kind.prefix}_lens", kind.prefix, kind.surface, kind.method, kind.mirror)
    yield (
        "static inline void LENS(mirrored)(const ray_t *ray, const interface_t *at, const lens_t *lens, "
        "SURFACE(t) shape,\n                                  maskv lanes, maskv *mirrors, maskv *open) {"
    )
    if kind.mirror and structure.nests:
        yield "  lanes = lanes & HAS_LENS(ray, ray->on);"
    if isinstance(kind.mirror, tuple):
        yield (
            "  maskv unsure = (maskv)0;\n"
            "  const maskv coated =\n"
            "      LENS(is_coated)(lens, shape, ray->origin, at->incident, at->length, lanes, &unsure);\n"
            "  *mirrors = *mirrors | (coated & not_lane(unsure));\n  *open = *open | unsure;"
        )
    elif kind.mirror:
        yield "  *mirrors = *mirrors | lanes;"
    yield "}\n"


def _coats(
    structure: Structure, name: str, prefix: str, surface: Surface, method: Method, coated: tuple[str, ...]
) -> Iterator[str]:
    yield generated("the mirrored faces of a lens, and the others")
    if method.wants_planes:
        planes = coated_planes(surface, coated)
        assert planes is not None, "a solid whose faces are not told by its planes is searched in another way"
        listed = ", ".join(str(int(each)) for each in planes)
        yield f"constant uchar {name}_coated_planes[{len(planes)}] = {{{listed}}};\n"
        yield located("lens_coat_planes.cl")
    else:
        yield coat_function(name, prefix, surface, coat_functions(surface, coated), structure.carried)
    yield located("lens_coat.cl")


def mirrored_at(structure: Structure) -> Iterator[str]:
    """Yield the function that says which lanes meet a mirrored face."""
    yield generated("the lenses that have mirrored faces")
    if structure.tabled:
        yield from _mirrored_in_table(structure)
        return
    yield _HEAD
    for number, coated in structure.mirrors:
        is_met = f"at->lanes & (at->lens == (maskv){number})"
        if structure.nests:  # of surfaces in contact those count whose solid is a medium there
            bit = f"(maskv)(MASK){1 << structure.nests.index(number)}"
            is_medium = f"((at->before == (maskv){number}) | (at->after == (maskv){number}))"
            is_met = f"at->lanes & {is_medium} & ((ray->on & {bit}) != (maskv)0)"
        yield f"  const maskv met_{number} = {is_met};"
        if coated is True:
            yield f"  mirrors = mirrors | met_{number};"
            continue
        yield f"  maskv open_{number} = (maskv)0;"
        arguments = f"ray->origin, at->incident, at->length, met_{number}, &open_{number}"
        yield (
            f"  const maskv coated_{number} = lens_{number}_is_coated(&scene->lens_{number}, scene->shape_{number}, "
            f"{arguments});"
        )
        yield f"  mirrors = mirrors | (coated_{number} & not_lane(open_{number}));"
        yield f"  open = open | open_{number};"
    yield _TAIL


def _mirrored_in_table(structure: Structure) -> Iterator[str]:
    """Yield `mirrored_at` for lenses in a table: those that a packet's lanes meet, one after the other."""
    yield by_kind(
        structure,
        "lens_mirrored(int number, const ray_t *ray, const interface_t *at, const scene_t *scene, maskv lanes, "
        "maskv *mirrors, maskv *open)",
        "{prefix}_lens_mirrored(ray, at, {lens}, {shape}, lanes, mirrors, open)",
    )
    yield _HEAD
    # Of surfaces in contact those count whose solid is a medium there
    for lens in ("before", "after") if structure.nests else ("lens",):
        yield (
            f"  maskv {lens} = at->lanes ? at->{lens} : NOWHERE;\n"
            f"  for (int number = largest_lane({lens}); number >= 0; number = largest_lane({lens})) {{\n"
            f"    lens_mirrored(number, ray, at, scene, {lens} == (maskv)number, &mirrors, &open);\n"
            f"    {lens} = {lens} == (maskv)number ? NOWHERE : {lens};\n  }}"
        )
    yield _TAIL
