"""Refractive indices by name, and the dispersion formulas behind them.

>>> round(refractive_index("water", D_LINE), 3)
1.333
"""

from __future__ import annotations

from lenscl.materials.catalogue import ALIASES, CATALOGUE, Material, material, material_names, refractive_index
from lenscl.materials.dispersion import (
    C_LINE,
    D_LINE,
    F_LINE,
    HIGHEST_N,
    LOWEST_N,
    Abbe,
    Cauchy,
    Constant,
    Index,
    Sellmeier,
    Table,
    index_problems,
)

__all__ = [
    "ALIASES",
    "CATALOGUE",
    "C_LINE",
    "D_LINE",
    "F_LINE",
    "HIGHEST_N",
    "LOWEST_N",
    "Abbe",
    "Cauchy",
    "Constant",
    "Index",
    "Material",
    "Sellmeier",
    "Table",
    "index_problems",
    "material",
    "material_names",
    "refractive_index",
]
