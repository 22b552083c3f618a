"""Decide what is baked into a kernel and what is an argument.

Baked in: the form of every surface, which lenses rays may reach, the kind of source, the method, Snell's rule, the
effects, precision and packet width. Arguments: every number of the scene. A sweep over numbers therefore builds one
program, and the kernel cache grows with forms, not with values.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field, fields
from typing import Literal

from lenscl.codegen.fragments import Precision, carried
from lenscl.codegen.layout import EMPTY, Layout, Member, Slot, Struct
from lenscl.effects import Output, Variant
from lenscl.lenses import Surface
from lenscl.lenses.planes import WORDS
from lenscl.methods import Method

_RAY_WORDS = 11
_NESTED_WORDS = 12


@dataclass(frozen=True, slots=True)
class Kind:
    """Lenses that are searched by the same text: of equal surfaces, by one method.

    Attributes
    ----------
    prefix : str
        Of the C names.
    surface : Surface
    method : Method
    lenses : dict of int to int
        The lenses, by their numbers in the scene, rising, each with its place among those of the kind.
    mirror : bool or tuple of str
        In a table: whether they are mirrors, or which of their faces are, by name.
    """

    prefix: str
    surface: Surface
    method: Method
    lenses: Mapping[int, int]
    mirror: bool | tuple[str, ...] = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Structure:
    """All that decides the text of a trace kernel."""

    lenses: Mapping[int, Surface]  # of the lenses that rays may reach, by their numbers in the scene
    rays: Literal["point", "parallel", "given"]
    methods: Mapping[int, Method]  # of each of them
    ends: Literal["map", "legs"]  # what is kept of a ray: its place alone, or its last leg, too
    snell: Literal["exact", "paraxial"]
    effects: tuple[Variant, ...]
    precision: Precision  # mixed: rays in double, searched in single
    width: int  # lanes of a packet
    run: int  # packets that one work-item carries, one after the other
    parks: bool  # whether the last few rays of a packet are put aside for another launch
    counts: bool = False  # whether the searches' steps are counted
    nests: tuple[int, ...] = ()  # the lenses, lowest priority first, where their solids may touch or overlap
    stops: bool = False  # whether rays end where they meet the picture first; then `nests` has the lenses
    source: Literal["point", "parallel"] = "point"  # of the film's rays, also where others are traced
    colours: tuple[int, ...] = ()  # of all lenses of a table that nests: those whose solids may touch differ
    tabled: bool = False  # whether the lenses are records of a table, and text is written by kinds of them
    # Of the lenses that have mirrored faces: their numbers, and the names of these faces, True where it is all of them
    mirrors: tuple[tuple[int, Literal[True] | tuple[str, ...]], ...] = ()
    kinds: tuple[Kind, ...] = field(init=False, repr=False, compare=False)  # of the lenses, in the order of first use

    def __post_init__(self) -> None:
        """Sort the lenses by kinds, once: there may be many."""
        object.__setattr__(self, "kinds", _kinds(self.lenses, self.methods, dict(self.mirrors) if self.tabled else {}))

    def form(self) -> tuple[Hashable, ...]:
        """Return all that the text hangs on, as values to compare by."""
        lenses: tuple[Hashable, ...]
        if self.tabled:
            lenses = tuple((kind.surface.key, kind.method.name, kind.mirror) for kind in self.kinds)
        else:
            lenses = tuple((number, surface.key) for number, surface in self.lenses.items())
            lenses += (*(one.name for one in self.methods.values()), self.mirrors)
        apart = ("lenses", "methods", "effects", "kinds", "mirrors", "nests", "colours")
        rest = (getattr(self, each.name) for each in fields(self) if each.name not in apart)
        nests = (bool(self.nests), self.colour_count) if self.tabled else self.nests
        return (lenses, nests, tuple(effect.name for effect in self.effects), *rest)

    def surfaces(self) -> dict[str, Surface]:
        """Return the distinct surfaces by the prefix of their C names, in the order of first use.

        A surface that two methods search is two.
        """
        return {kind.prefix: kind.surface for kind in self.kinds}

    def prefix(self, lens: int) -> str:
        """Return the C prefix of a lens's surface."""
        return next(kind.prefix for kind in self.kinds if lens in kind.lenses)

    def method(self, prefix: str) -> Method:
        """Return the method that searches a surface, by its C prefix."""
        return next(kind.method for kind in self.kinds if kind.prefix == prefix)

    @property
    def carried(self) -> Literal["single", "double"]:
        """The precision that rays are carried in."""
        return carried(self.precision)

    def is_mixed(self, prefix: str) -> bool:
        """Return whether a surface is searched in single precision before it is polished in double."""
        method = self.method(prefix)
        is_closed = method.wants_planes or self.surfaces()[prefix].degree in method.closed_forms
        return self.precision == "mixed" and not is_closed

    @property
    def ray_words(self) -> int:
        """The members of ray_t in kernels/ray.cl or ray_nested.cl, each one number a lane, with the effects'."""
        return (_NESTED_WORDS if self.nests else _RAY_WORDS) + self.colour_count + len(self.carries)

    @property
    def colour_count(self) -> int:
        """How many colours the lenses have, where a set has a bit for each colour; else 0."""
        return max(self.colours, default=-1) + 1

    @property
    def carries(self) -> tuple[str, ...]:
        """The numbers that a ray carries for the effects: members of ray_t, each once."""
        return tuple(dict.fromkeys(name for effect in self.effects for name in effect.carries))

    @property
    def coats(self) -> Mapping[int, tuple[str, ...]]:
        """The mirrored faces of the lenses that have others, too, by the lenses' numbers."""
        return {number: coated for number, coated in self.mirrors if coated is not True}

    @property
    def layered(self) -> bool:
        """Whether rays are traced by several sets of a scene's numbers in one launch, a layer of the arrays each."""
        return any(effect.layers for effect in self.effects)

    @property
    def lens_reads(self) -> tuple[tuple[str, int], ...]:
        """The attributes of a lens that the effects read, and how many numbers each is."""
        return tuple(dict.fromkeys(one for effect in self.effects for one in effect.reads))

    @property
    def adds(self) -> tuple[Output, ...]:
        """What the effects add to a ray map."""
        return tuple(output for effect in self.effects for output in effect.adds)

    @property
    def needs(self) -> tuple[str, ...]:
        """The functions of every surface that the effects call, each once."""
        return tuple(dict.fromkeys(one for effect in self.effects for one in effect.needs))

    def reads(self) -> tuple[str, ...]:
        """Return the keys of [numerics] that any method reads, each once."""
        return tuple(dict.fromkeys(key for method in self.methods.values() for key in method.reads))


def lens_struct(structure: Structure) -> Struct:
    """Return the numbers of every lens, with those that the effects read."""
    more = tuple(Slot(name, size) for name, size in structure.lens_reads)
    nested = _NESTED_SLOTS if structure.nests else ()
    tabled = _TABLED_SLOTS if structure.tabled else ()
    coloured = _COLOURED_SLOTS if structure.colours else ()
    coats = _COAT_SLOTS if structure.coats else ()
    return Struct(_LENS.c_name, _LENS.slots + tabled + coloured + nested + coats + more)


def layout(structure: Structure) -> Layout:
    """Return the numbers that a structure's kernel takes as arguments, but for those of a table."""
    members = [
        Member("film", _FILM),
        Member("source", source_struct(structure)),
        Member("picture", _PICTURE),
        Member("method", method_struct(structure)),
        Member("n_medium", comment="index around the lenses"),
    ]
    if structure.tabled:
        return Layout(tuple(members))
    shapes = {number: kind_struct(kind) for kind in structure.kinds for number in kind.lenses}
    for number in structure.lenses:
        members += [Member(f"lens_{number}", lens_struct(structure)), Member(f"shape_{number}", shapes[number])]
    return Layout(tuple(members))


def source_struct(structure: Structure) -> Struct:
    """Return what the kernel reads of the source."""
    source = _SOURCES[structure.rays]
    if structure.rays != "point" or not structure.colours:
        return source
    solids = Slot("solids", structure.colour_count, "the lens of each colour that it lies in or on")
    return Struct(source.c_name, (*source.slots, solids))


def kind_struct(kind: Kind) -> Struct:
    """Return what shapes the lenses of a kind: the parameters of their surface, or its planes."""
    struct = planes_struct if kind.method.wants_planes else shape_struct
    return struct(kind.surface, f"{kind.prefix}_t")


def parameter_spelling(surface: Surface) -> dict[str, str]:
    """Return the C field of each of a surface's parameters.

    A user's own names get a prefix, since they may be keywords or macros of C.
    """
    stem = "k_" if surface.name == "expression" else ""
    return {parameter.name: stem + parameter.name for parameter in surface.parameters}


def method_struct(structure: Structure) -> Struct:
    """Return what the methods read of [numerics]."""
    return Struct("method_t", tuple(Slot(key, 1, "scene units") for key in structure.reads()) or (EMPTY,))


def shape_struct(surface: Surface, c_name: str) -> Struct:
    """Return a surface's parameters as a C structure of that name."""
    spelling = parameter_spelling(surface)
    slots = tuple(Slot(spelling[parameter.name], 1, parameter.meaning) for parameter in surface.parameters)
    return Struct(c_name, slots or (EMPTY,))


def planes_struct(surface: Surface, c_name: str) -> Struct:
    """Return a polyhedron's planes as a C structure of that name."""
    slots = (
        Slot("share", 1, "of the sizes of a ray's coordinates: error of a plane's value"),
        Slot("planes", WORDS * len(surface.planes), "a, b, c, d, d less its own error, that error; plane by plane"),
    )
    return Struct(c_name, slots, is_shared=True)


def _kinds(
    lenses: Mapping[int, Surface],
    methods: Mapping[int, Method],
    mirrors: Mapping[int, Literal[True] | tuple[str, ...]],
) -> tuple[Kind, ...]:
    """Sort lenses by surface, method and mirrored faces."""
    keys: dict[int, str] = {}  # by identity: many lenses have one surface, and a key may take long to make
    alike: dict[tuple[Hashable, ...], dict[int, int]] = {}
    for number, surface in lenses.items():
        if (key := keys.get(id(surface))) is None:
            key = keys[id(surface)] = surface.key
        own = alike.setdefault((key, methods[number].name, mirrors.get(number, False)), {})
        own[number] = len(own)
    found: dict[str, Surface] = {}
    kinds = []
    for numbers in alike.values():
        first = next(iter(numbers))
        prefix = _free_name(lenses[first].name, found)
        found[prefix] = lenses[first]
        kinds.append(Kind(prefix, lenses[first], methods[first], numbers, mirrors.get(first, False)))
    return tuple(kinds)


def _free_name(name: str, taken: dict[str, Surface]) -> str:
    names = (name, *(f"{name}_{i}" for i in range(2, len(taken) + 3)))
    return next(free for free in names if free not in taken)


_FILM = Struct(
    "film_t",
    (
        Slot("corner", 3, "outer corner of pixel (0, 0)"),
        Slot("column_step", 3, "from a pixel to the one on its right"),
        Slot("row_step", 3, "from a pixel to the one below"),
    ),
)
_SOURCES = {
    "point": Struct(
        "source_t",
        (
            Slot("at", 3),
            Slot("inside", 1, "number of the lens it lies in, or -1"),
            Slot("on", 1, "number of the lens on whose surface it lies, or -1"),
        ),
    ),
    "parallel": Struct(
        "source_t", (Slot("direction", 3, "unit"), Slot("plane", 1, "rays start at direction . p = plane"))
    ),
    "given": Struct("source_t", (EMPTY,)),
}
_PICTURE = Struct(
    "picture_t",
    (
        Slot("corner", 3),
        Slot("normal", 3, "unit"),
        Slot("dual_s", 3, "1 along right, 0 along down"),
        Slot("dual_t", 3, "0 along right, 1 along down"),
    ),
)
_LENS = Struct(
    "lens_t",
    (
        Slot("to_local", 9, "rows of the linear map"),
        Slot("to_world", 9, "rows of its inverse"),
        Slot("centre", 3, "world"),
        Slot("box_low", 3, "local; the solid lies strictly inside the box"),
        Slot("box_high", 3),
        Slot("n", 1, "refractive index"),
        Slot("eta_in", 1, "index around it over its own"),
        Slot("eta_out", 1, "its own over the one around it"),
    ),
)
_COAT_SLOTS = (Slot("coat_noise", 1, "the most that rounding changes of its faces' functions near the surface"),)
_NESTED_SLOTS = (
    Slot("noise", 1, "the most that rounding changes of F near the surface"),
    Slot("size", 1, "half the diagonal of its box, in the world"),
)
_TABLED_SLOTS = (Slot("number", 1, "the lens's own"),)
_COLOURED_SLOTS = (
    Slot("colour", 1, "no lens that may touch it has the same"),
    Slot("bit", 1, "that of its colour"),
)
