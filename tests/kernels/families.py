"""The families of trace kernels: what a kernel may differ in, and rows that hold every pair of it at least once."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from functools import cache
from itertools import combinations, count, islice
from typing import Any, Literal, get_args, get_type_hints

import numpy as np
from probe import of_width
from scenes import make_scene

from lenscl import codegen, methods
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.tracing.film import film_rays
from lenscl.tracing.job import Job, given_ends, unit_vectors
from lenscl.tracing.structure import structure_of

LAST_RESORT = "last resort"
_CANDIDATES = 200  # looked at for each row
_SMALL = {
    "size": [5, 7],
    "right": [0.6, 0.0, 0.0],
    "down": [0.0, -0.6, 0.0],
}  # 35 rays: no whole number of packets of any width but one
_BOX = [[-1.2] * 3, [1.2] * 3]
_POLYNOMIALS = (
    {"surface": "torus", "R": 0.5, "r": 0.2},
    {"surface": "sphere", "r": 0.3, "centre": [0.1, 0.0, 1.4]},
    {"surface": "x**4 + y**4 + z**4 - k", "k": 0.2, "bounds": _BOX, "centre": [0.0, 0.0, -1.5]},
)
_OTHERS = (
    {"surface": "prism", "rotate": [20.0, 30.0, 10.0], "stretch": [0.5, 0.5, 0.5]},
    {"surface": "heart", "centre": [0.1, 0.0, 1.4], "rotate": [-90.0, -90.0, 0.0], "stretch": [0.3, 0.3, 0.3]},
    {"surface": "exp(x*x) + abs(y) + z*z*z*z*z*z - 1.4", "bounds": _BOX, "centre": [0.0, 0.0, -1.5]},
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Family:
    """One kernel in everything that two kernels may differ in, but their surfaces."""

    method: Literal["march", "guarded", "polynomial", "interval", "auto", "last resort"]
    precision: Literal["single", "mixed", "double"]
    rays: Literal["point", "parallel", "given"]
    ends: Literal["map", "legs"]
    total: Literal["follow", "end"]
    lenses: Literal["one", "several"]
    snell: Literal["exact", "paraxial"]
    width: Literal[1, 2, 4, 8, 16, 32]
    counts: Literal["counted", "uncounted"]

    def pairs(self) -> frozenset[Any]:
        """Return every two of its properties."""
        return frozenset(combinations([(each.name, getattr(self, each.name)) for each in fields(self)], 2))

    def is_made(self) -> bool:
        """Return whether the program makes such a kernel."""
        return NEVER_MADE.isdisjoint(self.pairs())


def _never_made() -> Iterator[Any]:
    """Yield the pairs that no kernel of the program has, for the reason that stands above them."""
    # Rays of the caller's own always have their last leg told
    yield ("rays", "given"), ("ends", "map")
    # 32 lanes fill two registers of the widest there are, in single precision alone
    yield from ((("precision", precision), ("width", 32)) for precision in ("mixed", "double"))
    # What double leaves open is traced as given rays
    yield from ((("method", LAST_RESORT), ("precision", precision)) for precision in ("single", "mixed"))
    yield from ((("method", LAST_RESORT), ("rays", rays)) for rays in ("point", "parallel"))
    yield ("method", LAST_RESORT), ("ends", "map")
    yield ("method", LAST_RESORT), ("width", 32)
    # Steps are counted for a film's map
    yield ("method", LAST_RESORT), ("counts", "counted")
    yield ("rays", "given"), ("counts", "counted")
    yield ("ends", "legs"), ("counts", "counted")


NEVER_MADE: frozenset[Any] = frozenset(_never_made())
CHOICES = {name: get_args(hint) for name, hint in get_type_hints(Family).items()}


def wanted_pairs() -> frozenset[Any]:
    """Return all pairs that some kernel has."""
    every = (
        ((one, a), (other, b)) for one, other in combinations(CHOICES, 2) for a in CHOICES[one] for b in CHOICES[other]
    )
    return frozenset(every) - NEVER_MADE


@cache
def all_pairs() -> tuple[Family, ...]:
    """Return families that hold every pair, the ones that hold most new pairs first."""
    rng, missing, found = random.Random(0), set(wanted_pairs()), []
    while missing:
        start = dict(min(missing, key=repr))
        drawn = (_drawn(rng, start) for _ in count())
        made = islice((family for family in drawn if family.is_made()), _CANDIDATES)
        best = max(made, key=lambda family: len(missing & family.pairs()))
        missing -= best.pairs()
        found.append(best)
    return tuple(found)


def _drawn(rng: random.Random, start: dict[str, Any]) -> Family:
    return Family(**{name: rng.choice(values) for name, values in CHOICES.items()} | start)


def each_once(families: tuple[Family, ...]) -> tuple[Family, ...]:
    """Return the first of them that hold every single choice."""
    missing, found = {(name, value) for name, values in CHOICES.items() for value in values}, []
    for family in families:
        has = {(name, getattr(family, name)) for name in CHOICES}
        if missing & has:
            found.append(family)
            missing -= has
    assert not missing
    return tuple(found)


def scene_of(family: Family) -> Scene:
    """Return a scene of a family; its film is small."""
    takes_all = family.method in ("march", "interval", "auto")
    lenses = _OTHERS if takes_all else _POLYNOMIALS
    if family.lenses == "one":
        lenses = lenses[:1]
    parallel = {"kind": "parallel", "direction": [0.02, 0.03, -1.0]}
    return make_scene(
        *({**lens, "name": f"lens_{number}"} for number, lens in enumerate(lenses)),
        source=parallel if family.rays == "parallel" else None,
        film=_SMALL,
        effects={"total_reflection": family.total},
        numerics={
            "method": "interval" if family.method == LAST_RESORT else family.method,
            "precision": family.precision,
            "snell": family.snell,
            "step": 0.1,
            "max_events": 6,
        },
    )


def ends_of(family: Family, here: Device) -> dict[str, Any]:
    """Trace a family's film on a device of any width; what is left undecided is not traced again."""
    here = of_width(here, family.width, family.width)
    scene = scene_of(family)
    structure = structure_of(scene, family.rays, family.ends, here)
    structure = replace(structure, counts=family.counts == "counted")
    if family.method == LAST_RESORT:
        structure = replace(structure, methods=dict.fromkeys(structure.lenses, methods.LAST_RESORT))
    job = Job(scene, codegen.kernel_source(structure), here, kind="memory")
    if family.rays != "given":
        return job.run_film()
    points, vectors = film_rays(scene, np.arange(scene.film.rows * scene.film.columns))
    return given_ends(job, points, unit_vectors(vectors))
