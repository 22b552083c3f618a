"""The generated kernel as a value."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from lenscl.codegen.layout import EMPTY, Layout
from lenscl.codegen.specialise import Structure, parameter_spelling
from lenscl.codegen.table import Table
from lenscl.lenses.planes import search_rows


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

    @property
    def table(self) -> Table | None:
        """Where the numbers of the lenses stand, where they are in a table."""
        return Table(self.structure) if self.structure.tabled else None

    def shape_values(self, lens: int, values: Mapping[str, float]) -> dict[str, ArrayLike]:
        """Return a lens's parameters, or its planes, by the names of its slots in the layout."""
        if self.structure.methods[lens].wants_planes:
            eps = float(np.finfo(np.float32 if self.structure.carried == "single" else np.float64).eps)
            rows, share = search_rows(self.structure.lenses[lens].planes, values, eps)
            return {"share": share, "planes": rows.ravel()}
        spelling = parameter_spelling(self.structure.lenses[lens])
        return {c_name: values[name] for name, c_name in spelling.items()} or {EMPTY.name: 0.0}

    def __str__(self) -> str:
        return self.text
