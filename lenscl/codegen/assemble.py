"""Put a kernel together: a list of pieces, in the order in which they build on each other."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence

from lenscl.codegen.fragments import VOCABULARY, generated, head, located, located_until
from lenscl.codegen.layout import Layout
from lenscl.codegen.mirrors import kind_mirrors, lens_coats, mirrored_at, mirrors_told
from lenscl.codegen.searches import searches, words_of
from lenscl.codegen.source import KernelSource
from lenscl.codegen.specialise import Structure, layout
from lenscl.codegen.table import by_kind, declared, defined, index_of, reads, wide_levels
from lenscl.effects import TOTAL, Hook, Output
from lenscl.status import RayStatus

# Effects that ask in which medium a ray travels: by one lens, or by a set, with the hooks that they then have besides
_OF_MEDIA: Mapping[str, tuple[Hook, ...]] = {"absorption": ("picture",), "opaque": (), "path_length": ()}
_STEP_ENDS = "// One work-item carries"  # in trace.cl: behind it is the kernel
_POLARISED = "fresnel_polarised"
_MOST_KEPT = 64  # some hundred kilobytes each
_kept: dict[tuple[Hashable, ...], tuple[Layout, str]] = {}  # by what decides a kernel's text


def kernel_source(structure: Structure) -> KernelSource:
    """Return the trace kernel of a structure; equal structures give equal text.

    What was written is kept: a sweep asks for the same text at every point, and writing it takes longer than tracing a
    small film.
    """
    form = structure.form()
    if form not in _kept:
        if len(_kept) >= _MOST_KEPT:
            _kept.clear()
        _kept[form] = _written(structure)
    numbers, text = _kept[form]
    return KernelSource(structure, numbers, text)


def _written(structure: Structure) -> tuple[Layout, str]:
    numbers = layout(structure)
    pieces = [
        _banner(structure),
        head(structure.precision, structure.width)
        + f"#define RUN {structure.run}\n#define RAY_WORDS {structure.ray_words}\n"
        + f"#define RAY_CARRIES{''.join(f' realv {name};' for name in structure.carries)}\n",
        "".join(f"#define RAY_{status.name} {status.value}\n" for status in RayStatus),
        *(located(name) for name in (*VOCABULARY, *words_of(structure))),
        generated("the numbers of a scene, which a sweep may change without a new kernel"),
        *(declared(structure, numbers) if structure.tabled else [numbers.declare()]),
        *([f"#define CONTACT_IS_DECIDED {int(structure.carried == 'double')}\n"] if structure.nests else []),
        *(_nested_ray(structure) if structure.nests else [located("ray.cl")]),
        *([] if structure.rays == "given" else [located("film.cl")]),
        located(f"rays_{structure.rays}{_of_rays(structure)}.cl"),
        located("placement.cl"),
        *(located(f"{name}.cl") for name in structure.needs),
        *searches(structure),
        *([located("coats.cl")] if structure.coats else []),
        *(_tabled_lenses(structure) if structure.tabled else _lenses(structure)),
        *([located(f"total_{_possible(structure)}.cl")] if structure.snell == "exact" else []),
        located(f"snell_{structure.snell}.cl"),
        located("screen.cl"),
        *([located("screen_nested.cl")] if structure.nests else []),
        *([located(f"picture_{'stops' if structure.stops else 'open'}.cl")] if structure.nests else []),
        located(f"ends_{structure.ends}.cl"),
        *_lens_numbers(structure),
        *(["\n".join(_surface_calls(structure))] if structure.needs else []),
        *(["\n".join(_media(structure))] if structure.nests else []),
        *(mirrored_at(structure) if structure.mirrors else ()),
        *(located(f"effects/{name}.cl") for name in _effect_files(structure)),
        generated("what this scene consists of"),
        "\n".join(_calls(structure)),
        located("layer.cl"),
        located(_layer(structure)),
        located("parks.cl" if structure.parks else "parks_never.cl"),
        located("steps_counted.cl" if structure.counts else "steps_uncounted.cl"),
        *_kernel(structure),
    ]
    return numbers, "\n".join(pieces)


def _of_rays(structure: Structure) -> str:
    """Return which form of the fragment of the rays is taken."""
    if structure.rays == "given":
        return "_solids" if structure.colours else "_nested" if structure.nests or structure.tabled else ""
    return "_nested" if structure.nests and structure.rays != "point" else ""


def _nested_ray(structure: Structure) -> Iterator[str]:
    count = structure.colour_count
    yield f"#define COLOURS {count}\n#define SOLIDS maskv solids[COLOURS];\n" if count else "#define SOLIDS\n"
    yield located("ray_nested.cl")
    yield located("sets_solids.cl" if count else "sets_bits.cl")


def _kernel(structure: Structure) -> Iterator[str]:
    nested = "_nested" if structure.nests else ""
    if structure.tabled:
        yield located_until(f"trace{nested}.cl", _STEP_ENDS)
        yield located(f"trace_table{nested}.cl")
    else:
        yield located(f"trace{nested}.cl")


def _possible(structure: Structure) -> str:
    return "possible" if any(effect.fact == TOTAL for effect in structure.effects) else "impossible"


def _layer(structure: Structure) -> str:
    """Return the fragment that tells a work-item by which of the scene's sets of numbers it traces."""
    layers = (f"effects/{effect.name}.cl" for effect in structure.effects if effect.layers)
    return next(layers, "layer_single.cl")


def _banner(structure: Structure) -> str:
    effects = ", ".join(effect.name for effect in structure.effects) or "none"
    methods = "; ".join(dict.fromkeys(f"{method.name} {method.guarantee}" for method in structure.methods.values()))
    lenses, mirrors = ", ".join(_prefixes(structure)), ", ".join(mirrors_told(structure))
    return (
        f"// lenses   {lenses}\n// rays     {structure.rays}\n"
        f"// method   {methods}\n"
        f"// snell    {structure.snell}\n// effects  {effects}\n"
        f"{f'// mirrors  {mirrors}{chr(10)}' if mirrors else ''}"
        f"// numbers  {structure.precision}, {structure.width} to a packet\n"
    )


def _prefixes(structure: Structure) -> Iterator[str]:
    """Yield the C prefix of each lens's surface, of those in a table once a kind."""
    if structure.tabled:
        yield "a table of " + " and ".join(kind.prefix for kind in structure.kinds)
    else:
        yield from (structure.prefix(number) for number in structure.lenses)


def _lenses(structure: Structure) -> Iterator[str]:
    for number in structure.lenses:
        yield from _lens(structure, number)


def _tabled_lenses(structure: Structure) -> Iterator[str]:
    for kind in structure.kinds:
        yield defined(kind)
        yield located("lens.cl")
        yield from [located("lens_nested.cl")] if structure.nests else []
        yield from (located(f"lens_{name}.cl") for name in structure.needs)
        yield from kind_mirrors(structure, kind) if structure.mirrors else ()
        yield "#undef LENS_NUMBER\n#undef LENS_BIT\n#undef LENS\n#undef SURFACE\n"
    nested = "_nested" if structure.nests else ""
    yield located("distinct.cl")
    yield located("slab.cl")
    yield located("boxes_lone.cl" if wide_levels(structure.width) else "boxes_packet.cl")
    yield located("boxes.cl")
    yield generated("a lens by its number")
    yield by_kind(
        structure,
        "lens_start(int number, ray_t *ray, const scene_t *scene)",
        f"{{prefix}}_lens_start{nested}(ray, {{lens}}, {{shape}})",
    )
    yield by_kind(
        structure,
        "lens_meet(int number, const ray_t *ray, const scene_t *scene, hit_t *hit)",
        f"{{prefix}}_lens_meet{nested}(ray, {{lens}}, {{shape}}, &scene->method, hit)",
    )
    yield located(f"table{nested}.cl")


def _lens(structure: Structure, number: int) -> Iterator[str]:
    prefix = structure.prefix(number)
    yield f"#define LENS_NUMBER {number}\n#define LENS(name) lens_{number}_##name\n"
    yield f"#define SURFACE(name) {prefix}_##name\n"
    yield located("lens.cl")
    if structure.nests:
        yield f"#define LENS_BIT ((maskv)(MASK){1 << structure.nests.index(number)})\n"
        yield located("lens_nested.cl")
        yield "#undef LENS_BIT\n"
    yield from (located(f"lens_{name}.cl") for name in structure.needs)
    yield from lens_coats(structure, number)
    yield "#undef LENS_NUMBER\n#undef LENS\n#undef SURFACE\n"


def _lens_numbers(structure: Structure) -> Iterator[str]:
    """Yield a function for each number that effects read of a lens, by the number of the lens."""
    if not structure.lens_reads:
        return
    yield generated("numbers of a packet's lenses")
    if structure.tabled:
        yield from reads(structure)
        return
    for name, _ in structure.lens_reads:
        lines = [f"static inline realv lens_{name}(const scene_t *scene, maskv lens, int i) {{"]
        spelled = f"{name}[i]" if dict(structure.lens_reads)[name] > 1 else name
        first, *others = structure.lenses
        lines.append(f"  realv found = (realv)scene->lens_{first}.{spelled};")
        for number in others:
            lines.append(f"  found = lens == (maskv){number} ? (realv)scene->lens_{number}.{spelled} : found;")
        yield "\n".join([*lines, "  return found;", "}\n"])


def _effect_files(structure: Structure) -> Iterator[str]:
    own = ("mirrored",) if structure.mirrors else ()
    yield from dict.fromkeys([*own, *(name for effect in structure.effects for name in effect.uses)])
    if structure.mirrors:
        yield "mirror_nested" if structure.nests else "mirror"
    for effect in structure.effects:
        if effect.layers:  # whose fragment stands where the layers are handed out
            continue
        yield from (f"{effect.name}_{getattr(structure, attribute)}" for attribute in effect.by)
        yield f"{effect.name}_nested" if structure.nests and effect.name in _OF_MEDIA else effect.name
        if effect.name == _POLARISED and structure.mirrors:
            yield "mirror_polarised"


def _surface_calls(structure: Structure) -> Iterator[str]:
    """Yield a function for each that effects call of the surfaces, by the numbers of a packet's lenses."""
    for name in structure.needs:
        yield generated("functions of a packet's surfaces")
        if structure.tabled:
            yield _tabled_call(structure, name)
            continue
        yield f"static inline void at_lens_{name}(const scene_t *scene, maskv lens, {name}_t *asked) {{"
        for number in structure.lenses:
            yield f"  const maskv is_{number} = lens == (maskv){number};"
            call = f"lens_{number}_{name}(&scene->lens_{number}, scene->shape_{number}, is_{number}, asked)"
            yield f"  if (any_lane(is_{number})) {call};"
        yield "}\n"


def _tabled_call(structure: Structure, name: str) -> str:
    """Return a function that effects call of the surfaces, for one packet's lenses after the other."""
    one = by_kind(
        structure,
        f"lens_{name}(int number, maskv lanes, const scene_t *scene, {name}_t *asked)",
        f"{{prefix}}_lens_{name}({{lens}}, {{shape}}, lanes, asked)",
    )
    return (
        f"{one}\nstatic inline void at_lens_{name}(const scene_t *scene, maskv lens, {name}_t *asked) {{\n"
        "  for (int number = largest_lane(lens); number >= 0; number = largest_lane(lens)) {\n"
        f"    lens_{name}(number, lens == (maskv)number, scene, asked);\n"
        "    lens = lens == (maskv)number ? NOWHERE : lens;\n  }\n}\n"
    )


def _calls(structure: Structure) -> Iterator[str]:
    numbers, nested = structure.lenses, "_nested" if structure.nests else ""
    yield "static inline void start(ray_t *ray, const scene_t *scene) {"
    if structure.tabled:
        if structure.colours and structure.rays != "given":
            given = "(maskv)(MASK)scene->source.solids[c]" if structure.rays == "point" else "NOWHERE"
            if structure.colour_count == 1:
                given = given.removesuffix("[c]")
            yield f"  for (int c = 0; c < COLOURS; ++c) ray->solids[c] = {given};"
        yield "  start_at_lenses(ray, scene);"
    else:
        yield from (f"  lens_{i}_start{nested}(ray, &scene->lens_{i}, scene->shape_{i});" for i in numbers)
    yield from _hooked(structure, "start", "ray, scene")
    yield "}\n"
    if not structure.tabled:
        yield "static inline void meet_lenses(const ray_t *ray, const scene_t *scene, hit_t *hit) {"
        for i in numbers:
            yield f"  lens_{i}_meet{nested}(ray, &scene->lens_{i}, scene->shape_{i}, &scene->method, hit);"
        yield "}\n"
    yield "static inline void at_interface(ray_t *ray, const interface_t *at, const scene_t *scene) {"
    if structure.mirrors:
        yield "  interface_t met, glass;\n  mirror_interface(ray, at, scene, &met, &glass);"
        if any(effect.name == _POLARISED for effect in structure.effects):
            yield "  mirror_polarised(ray, &met, &glass);"
    yield from _hooked(structure, "interface", "ray, at, scene")
    yield from _hooked(structure, "after", "ray, at, scene")
    yield "}\n"
    yield "static inline void at_picture(ray_t *ray, const place_t *place, const scene_t *scene) {"
    if structure.ends == "map":  # else the last surface point is the end
        yield from _hooked(structure, "picture", "ray, place, scene")
    yield from _hooked(structure, "landing", "ray, place, scene")
    yield "}\n"
    yield from _stores(structure.adds)


def _media(structure: Structure) -> Iterator[str]:
    """Yield what tells the medium of a set of lenses, and its index."""
    yield generated("the medium of a set of lenses")
    if structure.tabled:
        yield index_of(structure)
        return
    yield "static inline maskv medium_of(maskv set) {\n  maskv medium = NOWHERE;"
    for place, number in enumerate(structure.nests):
        if number in structure.lenses:
            yield f"  medium = (set & (maskv)(MASK){1 << place}) != (maskv)0 ? (maskv){number} : medium;"
    yield "  return medium;\n}\n"
    yield "static inline realv index_of(const scene_t *scene, maskv medium) {\n  realv n = (realv)scene->n_medium;"
    for number in structure.lenses:
        yield f"  n = medium == (maskv){number} ? (realv)scene->lens_{number}.n : n;"
    yield "  return n;\n}\n"


def _hooked(structure: Structure, hook: Hook, arguments: str) -> Iterator[str]:
    for effect in structure.effects:
        more = _OF_MEDIA.get(effect.name, ()) if structure.nests else ()
        if hook in (*effect.hooks, *more):
            seen = "&met" if effect.meets_mirrors else "&glass"
            given = arguments.replace("at,", f"{seen},") if structure.mirrors else arguments
            yield f"  {effect.name}_{hook}({given});"


def _stores(adds: Sequence[Output]) -> Iterator[str]:
    """Yield what writes the effects' arrays, of N numbers a ray, padded to whole packets."""
    yield f"#define EFFECT_PARAMETERS {''.join(f', global real *restrict {output.name}' for output in adds)}".rstrip()
    yield f"#define EFFECT_ARGUMENTS {''.join(f', {output.name}' for output in adds)}".rstrip()
    yield "static inline void store_effects(const ray_t *ray, int first EFFECT_PARAMETERS) {"
    for output in adds:
        count = len(output.members)
        for place, member in enumerate(output.members):
            first = f"{output.name} + {f'{count} * ' if count > 1 else ''}first{f' + {place}' if place else ''}"
            yield f"  scatter(ray->{member}, {first}, {count});"
    yield "}\n"
