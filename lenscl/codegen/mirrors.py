"""Write what tells mirrored faces from others, for the lenses that have some.

A kernel without a mirror has no text of it. Which faces are mirrors is written into the text: a lens that is a mirror
all over needs no look at the point, and another one compares two functions there, `lenscl.lenses.coat_functions`.
"""

from __future__ import annotations

from collections.abc import Iterator

from lenscl.codegen.fragments import generated, located
from lenscl.codegen.specialise import Structure
from lenscl.codegen.surfaces import coat_function
from lenscl.lenses import coat_functions, coated_planes


def lens_coats(structure: Structure, number: int) -> Iterator[str]:
    """Yield LENS(is_coated)() of a lens with mirrored faces and others; stands where LENS and SURFACE are defined."""
    coated = structure.coats.get(number)
    if coated is None:
        return
    prefix = structure.prefix(number)
    surface = structure.lenses[number]
    yield generated("the mirrored faces of a lens, and the others")
    if structure.method(prefix).wants_planes:
        planes = coated_planes(surface, coated)
        assert planes is not None, "a solid whose faces are not told by its planes is searched in another way"
        listed = ", ".join(str(int(each)) for each in planes)
        yield f"constant uchar lens_{number}_coated_planes[{len(planes)}] = {{{listed}}};\n"
        yield located("lens_coat_planes.cl")
    else:
        yield coat_function(f"lens_{number}", prefix, surface, coat_functions(surface, coated), structure.carried)
    yield located("lens_coat.cl")


def mirrored_at(structure: Structure) -> Iterator[str]:
    """Yield the function that says which lanes meet a mirrored face."""
    yield generated("the lenses that have mirrored faces")
    yield (
        "static inline maskv mirrored_at(const ray_t *ray, const interface_t *at, const scene_t *scene, "
        "maskv *unsure) {\n  maskv mirrors = (maskv)0, open = (maskv)0;"
    )
    for number, coated in structure.mirrors:
        is_met = f"at->lanes & (at->lens == (maskv){number})"
        if structure.nests:  # of surfaces in contact those count whose solid is a medium there
            bit = f"(maskv)(MASK){1 << structure.nests.index(number)}"
            is_medium = f"((at->before == (maskv){number}) | (at->after == (maskv){number}))"
            is_met = f"at->lanes & {is_medium} & ((ray->on & {bit}) != (maskv)0)"
        yield f"  const maskv met_{number} = {is_met};"
        if coated is None:
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
    yield "  *unsure = open & not_lane(mirrors);\n  return mirrors;\n}\n"
