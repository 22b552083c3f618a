"""Refractive indices by name, and the dispersion formulas behind them.

>>> round(refractive_index("water", D_LINE), 3)
1.333
"""

from __future__ import annotations

from lenscl.materials.catalogue import CATALOGUE, Material, material, material_names, refractive_index
from lenscl.materials.dispersion import (
    D_LINE,
    HIGHEST_N,
    LOWEST_N,
    Cauchy,
    Constant,
    Index,
    Sellmeier,
    Table,
    index_problems,
)

__all__ = [
    "CATALOGUE",
    "D_LINE",
    "HIGHEST_N",
    "LOWEST_N",
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
