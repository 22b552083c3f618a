"""A kernel whose lenses are records of a table: its text grows with the kinds of lenses, not with their number.

A kind is a surface that a method searches. Each has one copy of the text of a lens, and an array of records: a lens_t,
then what shapes it. What the kernel gets, beside the scene's other numbers:

    numbers   numbers_t, one a layer: film, source, picture, method, index around the lenses
    table     the records, kind by kind, as a run of numbers
    records   two whole numbers a lens of the scene: where its record begins, and its kind; -1 for one out of reach
    indices   three numbers a lens, one set a layer: n, eta_in, eta_out, where wavelengths are traced side by side
    boxes     six numbers a node of a hierarchy of boxes in the world: lowest and highest corner
    links     two whole numbers a node: its first child, the second being the next, or ~number of its only lens; the
              axis along which the children lie, with the number of its wide node: lenscl/tracing/hierarchy.py
    wide_boxes, wide_links
              the wide nodes: as many boxes as a packet has lanes, for rays that go alone

    packet of rays -> kernels/table.cl: the lenses that lanes travel in, then those whose boxes they meet, nearest first
                   -> generated lens_meet(number, ...): the record, and the text of its kind -> kernels/lens.cl

A lens is called by its number in the scene, in this text as in every other. Where solids may touch or overlap it is
called by its rank in the order of priority, and a ray carries for each colour the lens that it lies in, see
kernels/sets_solids.cl.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.codegen.layout import Layout
from lenscl.codegen.specialise import Kind, Structure, kind_struct, lens_struct

INDICES = ("n", "eta_in", "eta_out")  # what wavelengths change of a lens
_SHORTEST_ALONE = 4  # lanes of a packet in which rays go alone through the boxes
_POINTERS = {  # what each holds
    "table": "real",
    "records": "int2",
    "indices": "real",
    "boxes": "real",
    "links": "int2",
    "wide_boxes": "real",
    "wide_links": "int",
}


def wide_levels(width: int) -> int:
    """Return how many levels of a hierarchy of boxes a wide node spans, 0 where packets are too short for these."""
    return width.bit_length() - 1 if width >= _SHORTEST_ALONE else 0


@dataclass(frozen=True, slots=True)
class Table:
    """Where the numbers of lenses stand in a kernel's table.

    Attributes
    ----------
    structure : Structure
    """

    structure: Structure

    def slots(self, kind: Kind) -> list[tuple[str, int]]:
        """Return (path, numbers) for every slot of a kind's records in order, such as ("torus.lens.centre", 3)."""
        parts = {"lens": lens_struct(self.structure), "shape": kind_struct(kind)}
        return [
            (f"{kind.prefix}.{part}.{one.name}", one.size) for part, struct in parts.items() for one in struct.slots
        ]

    def pack(self, values: Mapping[str, ArrayLike], dtype: type[np.floating[Any]]) -> NDArray[np.floating[Any]]:
        """Return all records as the kernel reads them.

        Parameters
        ----------
        values : mapping
            For the path of every slot an array of one row for each lens of the kind.
        dtype : type
            numpy.float32 or numpy.float64, as the kernel was built.
        """
        records = []
        for kind in self.structure.kinds:
            parts = [
                np.asarray(values[path], dtype=np.float64).reshape(len(kind.lenses), size)
                for path, size in self.slots(kind)
            ]
            records.append(np.concatenate(parts, axis=1).ravel())
        return np.concatenate(records).astype(dtype)

    def numbers(self, kind: Kind) -> NDArray[np.intp]:
        """Return by which numbers the kernel calls the lenses of a kind: those of the scene, or of their priority."""
        numbers = np.fromiter(kind.lenses, dtype=np.intp, count=len(kind.lenses))
        return np.argsort(self.structure.nests)[numbers] if self.structure.nests else numbers

    def places(self, lenses: int) -> NDArray[np.int32]:
        """Return where each of a scene's lenses has its record, and of which kind it is, shape (lenses, 2)."""
        found = np.array([[0, -1]], dtype=np.int32).repeat(lenses, axis=0)
        begin = 0
        for place, kind in enumerate(self.structure.kinds):
            words = sum(size for _, size in self.slots(kind))
            numbers = self.numbers(kind)
            found[numbers, 0] = begin + words * np.arange(len(numbers))
            found[numbers, 1] = place
            begin += words * len(numbers)
        return found

    def indices(
        self, values: Mapping[str, ArrayLike], lenses: int, dtype: type[np.floating[Any]]
    ) -> NDArray[np.floating[Any]]:
        """Return the indices of each of a scene's lenses, shape (lenses, 3), 1 for those out of reach."""
        found = np.ones((lenses, len(INDICES)), dtype=dtype)
        for kind in self.structure.kinds:
            numbers = self.numbers(kind)
            for column, name in enumerate(INDICES):
                found[numbers, column] = np.asarray(values[f"{kind.prefix}.lens.{name}"])
        return found


def declared(structure: Structure, numbers: Layout) -> Iterator[str]:
    """Yield the C structures of a scene whose lenses are in a table, and what puts a scene_t together."""
    yield numbers.declare("numbers_t")
    yield lens_struct(structure).declare()
    for kind in structure.kinds:
        yield kind_struct(kind).declare()
        yield f"typedef struct {{\n  lens_t lens;\n  {kind.prefix}_t shape;\n}} {kind.prefix}_record_t;\n"
    used = {name: holds for name, holds in _POINTERS.items() if name != "indices" or structure.layered}
    members = [f"  {one.struct.c_name if one.struct else 'real'} {one.name};\n" for one in numbers.members]
    members += ["  int lenses;\n"]
    members += [f"  global const {holds} *{name};\n" for name, holds in used.items()]
    yield f"typedef struct {{\n{''.join(members)}}} scene_t;\n"
    parameters = "".join(f", global const {holds} *restrict {name}" for name, holds in used.items())
    yield f"#define TABLE_PARAMETERS {parameters}\n#define TABLE_ARGUMENTS {''.join(f', {name}' for name in used)}\n"
    yield "// A work-item's scene, by the numbers of its layer.\n"
    yield f"static inline scene_t scene_of(global const numbers_t *numbers, int lenses, int layer{parameters}) {{"
    lines = ["scene_t scene;", *(f"scene.{one.name} = numbers[layer].{one.name};" for one in numbers.members)]
    own = {"indices": f"indices + {len(INDICES)} * lenses * layer"}
    lines += ["scene.lenses = lenses;"]
    lines += [f"scene.{name} = {own.get(name, name)};" for name in used]
    yield "".join(f"  {line}\n" for line in [*lines, "return scene;"]) + "}\n"


def defined(kind: Kind) -> str:
    """Return what kernels/lens.cl asks for: here a lens's number stands in its record."""
    prefix = kind.prefix
    return (
        "#define LENS_NUMBER (MASK)lens->number\n#define LENS_BIT ((maskv)(MASK)lens->bit)\n"
        f"#define LENS(name) {prefix}_lens_##name\n#define SURFACE(name) {prefix}_##name\n"
    )


def by_kind(structure: Structure, signature: str, call: str) -> str:
    """Return a function of one lens by its number, which calls that of its kind.

    `signature` has a `const scene_t *scene`; `call` is made with the record's `lens` and `shape`, {prefix} in its name.
    """
    lines = [
        f"static inline void {signature} {{",
        "  const int2 place = scene->records[number];",
        "  switch (place.y) {",
    ]
    for place, kind in enumerate(structure.kinds):
        record = f"{kind.prefix}_record_t"
        lines += [
            f"    case {place}: {{",
            f"      {record} record = *(global const {record} *)(scene->table + place.x);",
            *(
                f"      record.lens.{name} = scene->indices[{len(INDICES)} * number + {column}];"
                for column, name in enumerate(INDICES if structure.layered else ())
            ),
            f"      {call.format(prefix=kind.prefix, lens='&record.lens', shape='record.shape')};",
            "      break;",
            "    }",
        ]
    return "\n".join([*lines, "  }", "}\n"])


def index_of(structure: Structure) -> str:
    """Return the function that tells the index of a medium, by the number of its lens or NOWHERE."""
    found = (
        f"numbers_of_rows(medium, scene->lenses, scene->indices, {len(INDICES)})"
        if structure.layered
        else f"numbers_of_lenses(medium, scene->lenses, {_words(structure)['n']}, scene->table, scene->records)"
    )
    return (
        "static inline realv index_of(const scene_t *scene, maskv medium) {\n"
        f"  return medium == NOWHERE ? (realv)scene->n_medium : {found};\n}}\n"
    )


def _words(structure: Structure) -> dict[str, int]:
    """Return where the numbers of a lens begin in its record."""
    begin, begins = 0, {}
    for slot in lens_struct(structure).slots:
        begins[slot.name] = begin
        begin += slot.size
    return begins


def reads(structure: Structure) -> Iterator[str]:
    """Yield a function for each number that effects read of a lens, gathered by the lanes' lenses."""
    begins = _words(structure)
    for name, _ in structure.lens_reads:
        yield (
            f"static inline realv lens_{name}(const scene_t *scene, maskv lens, int i) {{\n"
            f"  return numbers_of_lenses(lens, scene->lenses, {begins[name]} + i, scene->table, scene->records);\n}}\n"
        )
