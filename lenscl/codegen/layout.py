"""The numbers a kernel reads: one description that both writes the C structures and packs the values.

Every number is a `real`, so a structure is its fields in order and nothing between them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, slots=True)
class Slot:
    """A field of numbers."""

    name: str
    size: int = 1  # numbers in it; 1 is a scalar
    comment: str = ""

    def declare(self) -> str:
        """Return its line in a C structure."""
        shape = f"[{self.size}]" if self.size > 1 else ""
        return _line(f"real {self.name}{shape};", self.comment)


EMPTY = Slot("none", 1, "a C structure holds at least one number")


@dataclass(frozen=True, slots=True)
class Struct:
    """A C structure of slots."""

    c_name: str
    slots: tuple[Slot, ...]
    is_shared: bool = False  # functions get its address, not a copy: an array of one structure

    def declare(self) -> str:
        """Return its typedef."""
        body = "\n".join(slot.declare() for slot in self.slots)
        if self.is_shared:
            return f"typedef const struct {{\n{body}\n}} {self.c_name}[1];\n"
        return f"typedef struct {{\n{body}\n}} {self.c_name};\n"


@dataclass(frozen=True, slots=True)
class Member:
    """A place in the scene's structure: a whole structure, or a single number where `struct` is None."""

    name: str
    struct: Struct | None = None
    comment: str = ""


@dataclass(frozen=True, slots=True)
class Layout:
    """Everything a sweep may change without a new kernel, in the order the kernel reads it."""

    members: tuple[Member, ...]

    def declare(self, c_name: str = "scene_t") -> str:
        """Return the C text: every structure once, then the one of all members."""
        structs = {member.struct.c_name: member.struct for member in self.members if member.struct}
        lines = [_line(f"{m.struct.c_name if m.struct else 'real'} {m.name};", m.comment) for m in self.members]
        body = "\n".join(lines)
        return (
            "\n".join(struct.declare() for struct in structs.values()) + f"\ntypedef struct {{\n{body}\n}} {c_name};\n"
        )

    def slots(self) -> Iterator[tuple[str, int]]:
        """Yield (path, numbers) for every slot in order, such as ("film.corner", 3)."""
        for member in self.members:
            if member.struct is None:
                yield member.name, 1
            else:
                for slot in member.struct.slots:
                    yield f"{member.name}.{slot.name}", slot.size

    def pack(self, values: Mapping[str, ArrayLike], dtype: type[np.floating[Any]]) -> NDArray[np.floating[Any]]:
        """Return the numbers as the kernel reads them.

        Parameters
        ----------
        values : mapping
            A number or array for the path of every slot and no other.
        dtype : type
            numpy.float32 or numpy.float64, as the kernel was built.

        Raises
        ------
        KeyError, ValueError
            If the values are not exactly those of the layout: a fault of the program, not of a user.
        """
        slots = list(self.slots())
        if unknown := set(values) - {path for path, _ in slots}:
            raise KeyError(f"not in the layout: {sorted(unknown)}")
        parts: Sequence[NDArray[np.float64]] = [
            np.asarray(values[path], dtype=np.float64).reshape(size) for path, size in slots
        ]
        return np.concatenate(parts).astype(dtype)


def _line(declaration: str, comment: str) -> str:
    return f"  {declaration:<24}// {comment}" if comment else f"  {declaration}"
