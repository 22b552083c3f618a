"""The generated kernel as a value."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field

from lenscl.codegen.layout import EMPTY, Layout
from lenscl.codegen.specialise import Structure, parameter_spelling


@dataclass(frozen=True, slots=True)
class KernelSource:
    """The OpenCL C text of one trace kernel and what it was made from.

    `print(source.text)` shows a complete program that any OpenCL compiler accepts.
    """

    structure: Structure
    layout: Layout = field(repr=False)
    text: str = field(repr=False)

    @property
    def key(self) -> str:
        """A short digest of the text: equal keys, equal programs."""
        return hashlib.sha256(self.text.encode()).hexdigest()[:12]

    def shape_values(self, lens: int, values: Mapping[str, float]) -> dict[str, float]:
        """Return a lens's parameters by the names of its slots in the layout."""
        spelling = parameter_spelling(self.structure.lenses[lens])
        return {c_name: values[name] for name, c_name in spelling.items()} or {EMPTY.name: 0.0}

    def __str__(self) -> str:
        return self.text
