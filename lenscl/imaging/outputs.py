"""What the arrays that effects add to a ray map are outside the kernel: one row each, read by painting and by files.

An effect of the kernel is a row of `lenscl.effects`, which says how an array comes about. A row here says what becomes
of it. An array without a row is one number a pixel that is written under its own name and not painted with.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputUse:
    """How an array of a ray map is used.

    Attributes
    ----------
    name : str
        Of the array: its attribute of the map.
    weighs : bool
        Whether painting multiplies colours by it: by one number all of them, by three red, green and blue.
    channels : tuple of str
        What an EXR calls a pixel's numbers; empty for one number, which has the array's own name.
    derived : tuple of str
        Attributes that the map computes from it, which files hold, too.
    """

    name: str
    weighs: bool = False
    channels: tuple[str, ...] = ()
    derived: tuple[str, ...] = ()


_ROWS = (
    OutputUse(name="transmittance", weighs=True),
    OutputUse(name="transmission", weighs=True, channels=("R", "G", "B")),
    OutputUse(name="path_length"),
    OutputUse(name="reflectance"),
    OutputUse(name="reflected_st", channels=("s", "t")),
    OutputUse(name="reflected", channels=("x", "y", "z")),
    OutputUse(
        name="jacobian",
        channels=("ds_drow", "ds_dcolumn", "dt_drow", "dt_dcolumn"),
        derived=("magnification", "fold"),
    ),
)

OUTPUT_USES: Mapping[str, OutputUse] = MappingProxyType({row.name: row for row in _ROWS})
