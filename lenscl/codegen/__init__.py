"""Turn surfaces, a method and effects into the OpenCL C text of one kernel.

Input: a `Structure`, all that decides the text. Output: a `KernelSource`, the text with the layout of the numbers it
reads. Structure is compiled, numbers are arguments: `specialise` alone draws that line.
"""

from __future__ import annotations

from lenscl.codegen.assemble import kernel_source
from lenscl.codegen.bands import faces_of, has_twice
from lenscl.codegen.fragments import VOCABULARY, Precision, carried, fragment, head
from lenscl.codegen.layout import EMPTY, Layout, Slot
from lenscl.codegen.source import KernelSource
from lenscl.codegen.specialise import Structure
from lenscl.codegen.table import Table, wide_levels

__all__ = [
    "EMPTY",
    "VOCABULARY",
    "KernelSource",
    "Layout",
    "Precision",
    "Slot",
    "Structure",
    "Table",
    "carried",
    "faces_of",
    "fragment",
    "has_twice",
    "head",
    "kernel_source",
    "wide_levels",
]
