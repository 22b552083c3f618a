"""The table of methods and the rule by which `auto` picks one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal


@dataclass(frozen=True, slots=True, kw_only=True)
class Method:
    """One way to find the next intersection."""

    name: str
    fragments: tuple[str, ...]  # files of kernels/, in order, instantiated once for every distinct surface
    guarantee: str  # what it promises, in a sentence for users
    writes: tuple[str, ...]  # the functions of a surface that it calls, as codegen names them
    reads: tuple[str, ...] = ()  # the keys of [numerics] it reads
    ending: Literal["isolated", "corrected", "polished"] = "polished"  # how its roots get their last bits
    is_guaranteed: bool = False  # it misses no crossing, and says where it cannot tell
    wants_polynomial: bool = False  # it serves surfaces of which a polynomial of F's sign is known
    wants_planes: bool = False  # it serves convex polyhedra, and reads their planes in the place of parameters
    wants_leaves: bool = False  # it serves polynomials joined by max and min
    of_leaf: tuple[str, ...] = ()  # fragments before these, once for each leaf without roots in closed form
    words: tuple[str, ...] = ()  # files of kernels/ that its surfaces' functions are written in, once a kernel
    closed_forms: Mapping[int, tuple[str, ...]] = field(default_factory=dict)  # fragments instead, by F's degree

    def fragments_for(self, degree: int | None) -> tuple[str, ...]:
        """Return the fragments for a surface whose polynomial has this degree, None where it has none."""
        return self.fragments if degree is None else self.closed_forms.get(degree, self.fragments)

    def ending_for(self, degree: int | None) -> Literal["isolated", "corrected", "polished"]:
        """Return how the roots of such a surface get their last bits: a closed form's have them."""
        return "isolated" if degree in self.closed_forms else self.ending


_ROWS = (
    Method(
        name="march",
        fragments=("search_march.cl",),
        guarantee="finds every crossing but pairs of crossings less than one step apart",
        writes=("f",),
        reads=("step", "tolerance"),
    ),
    Method(
        name="planes",
        fragments=("planes.cl", "search_planes.cl"),
        ending="isolated",
        guarantee="finds every crossing of a convex polyhedron by its planes; undecided within rounding of an edge",
        writes=("planes",),
        is_guaranteed=True,
        wants_planes=True,
    ),
    Method(
        name="polynomial",
        fragments=("polynomial_ray.cl", "polynomial_bounds.cl", "polynomial_walk.cl", "search_polynomial.cl"),
        ending="corrected",
        closed_forms={2: ("polynomial_ray.cl", "search_quadratic.cl")},
        guarantee="finds every crossing of a polynomial, by proof; a ray whose proof rounding forbids is undecided",
        writes=("along",),
        is_guaranteed=True,
        wants_polynomial=True,
    ),
    Method(
        name="guarded",
        fragments=("polynomial_ray.cl", "polynomial_bounds.cl", "polynomial_walk.cl", "search_guarded.cl"),
        ending="corrected",
        guarantee="finds every crossing of a polynomial, by steps that pass none; undecided where rounding forbids it",
        writes=("along",),
        is_guaranteed=True,
        wants_polynomial=True,
    ),
    Method(
        name="joined",
        fragments=("joined_leaves.cl", "search_joined.cl"),
        guarantee="finds every crossing of polynomials under max and min, by proof; undecided where rounding hides it",
        writes=("joined",),
        of_leaf=(
            "polynomial_ray.cl",
            "polynomial_bounds.cl",
            "polynomial_walk.cl",
            "search_polynomial.cl",
            "joined_leaf.cl",
        ),
        words=("zones.cl",),
        is_guaranteed=True,
        wants_leaves=True,
    ),
    Method(
        name="interval",
        fragments=("interval_segment.cl", "interval_leaf.cl", "interval_leaves.cl", "search_interval.cl"),
        guarantee="finds every crossing, by proof; a ray whose proof rounding forbids is undecided",
        writes=("bands",),
        words=(
            "interval.cl",
            "interval_polynomials.cl",
            "interval_arithmetic.cl",
            "interval_curves.cl",
            "interval_powers.cl",
            "interval_cbrt.cl",
            "interval_functions.cl",
        ),
        is_guaranteed=True,
    ),
)

# What double leaves undecided is searched once more; no user asks for it
LAST_RESORT = Method(
    name="interval, in twice the precision",
    fragments=("interval_segment_twice.cl", "interval_leaf.cl", "interval_leaves.cl", "search_interval.cl"),
    guarantee="finds every crossing, by proof; a ray whose proof rounding forbids is undecided",
    writes=("bands_twice",),
    words=("double_double.cl", *_ROWS[-1].words),
    is_guaranteed=True,
)

METHODS: Mapping[str, Method] = MappingProxyType({row.name: row for row in _ROWS})


def choose(name: str, *, is_polynomial: bool, is_polyhedron: bool = False, is_joined: bool = False) -> Method | None:
    """Return the method of a name, None where it does not serve a surface.

    Parameters
    ----------
    name : str
        As in `[numerics]`; "auto" is the first of the table's guaranteed methods that serves the surface.
    is_polynomial : bool
        Whether a polynomial of F's sign is known.
    is_polyhedron : bool
        Whether the solid's planes are known.
    is_joined : bool
        Whether F is max and min of polynomials.
    """
    serving = [
        row
        for row in _ROWS
        if (is_polynomial or not row.wants_polynomial)
        and (is_polyhedron or not row.wants_planes)
        and (is_joined or not row.wants_leaves)
    ]
    asked = (row for row in serving if (row.is_guaranteed if name == "auto" else row.name == name))
    return next(asked, METHODS["march"] if name == "auto" else None)
