"""The table of methods and the rule by which `auto` picks one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True, slots=True, kw_only=True)
class Method:
    """One way to find the next intersection."""

    name: str
    fragments: tuple[str, ...]  # files of kernels/, in order, instantiated once for every distinct surface
    guarantee: str  # what it promises, in a sentence for users
    writes: tuple[str, ...]  # the functions of a surface that it calls, as codegen names them
    reads: tuple[str, ...] = ()  # the keys of [numerics] it reads
    words: tuple[str, ...] = ()  # files of kernels/ that its surfaces' functions are written in, once a kernel


_ROWS = (
    Method(
        name="march",
        fragments=("newton.cl", "search_march.cl"),
        guarantee="finds every crossing but pairs of crossings less than one step apart",
        writes=("f", "f_gradient"),
        reads=("step", "tolerance"),
    ),
    Method(
        name="interval",
        fragments=("newton.cl", "search_interval.cl"),
        guarantee="finds every crossing, by proof; a ray whose proof rounding forbids is undecided",
        writes=("f_gradient", "band", "slope_band"),
        words=("interval.cl", "interval_arithmetic.cl", "interval_powers.cl", "interval_functions.cl"),
    ),
)

_AUTO = "march"

METHODS: Mapping[str, Method] = MappingProxyType({row.name: row for row in _ROWS})


def choose(name: str) -> Method:
    """Return the method of a name; "auto" is `march`."""
    return METHODS[_AUTO if name == "auto" else name]
