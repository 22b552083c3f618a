"""The ways to trace a scene: method, precision, Snell's rule, and the steps of the march."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import floor, log10
from typing import Any, Literal

from lenscl.codegen import Precision
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.errors import StudyError
from lenscl.methods import METHODS
from lenscl.tracing import Placement, methods_of

MARCH = "march"
FORERUNNER_STEP = 0.01  # scene units: the march of the program that this one follows
_PARTS = (10, 30, 100, 300)  # steps across the largest lens that are tried beside it
_MOST_STEPS = 10_000  # across the largest lens; a finer march would never come home
_TOLERANCES = (1e-3, 1e-6)  # scene units: the bracket that a march accepts, coarser than its last bits


@dataclass(frozen=True, slots=True, kw_only=True)
class Combination:
    """One way to trace; `step` and `tolerance` in scene units, None where the method does not read them.

    >>> str(Combination(method="march", precision="double", step=0.01)), str(Combination(method="auto"))
    ('march 0.01, double', 'auto, double')
    """

    method: str
    precision: Precision = "double"
    snell: Literal["exact", "paraxial"] = "exact"
    step: float | None = None
    tolerance: float | None = None

    def of(self, scene: Scene) -> Scene:
        """Return a scene that is traced so, whatever it asked for."""
        wanted = {"method": self.method, "precision": self.precision, "snell": self.snell, "step": self.step,
                  "tolerance": self.tolerance}  # fmt: skip
        return scene.replace({f"numerics.{key}": value for key, value in wanted.items() if value is not None})

    def numerics(self) -> dict[str, Any]:
        """Return the keys of `[numerics]` that stand for it."""
        return {name: getattr(self, name) for name in self.__slots__ if getattr(self, name) is not None}

    def __str__(self) -> str:
        step = "" if self.step is None else f" {self.step:g}"
        tolerance = "" if self.tolerance is None else f", tolerance {self.tolerance:g}"
        paraxial = ", paraxial" if self.snell == "paraxial" else ""
        return f"{self.method}{step}, {self.precision}{tolerance}{paraxial}"


def every_combination(scene: Scene, device: Device) -> list[Combination]:
    """Return what a front is made of.

    Every method that serves the scene, in every precision; for the march a range of steps, and of tolerances at the
    forerunner's step; and the paraxial rule.
    """
    methods, precisions = serving(scene), precisions_of(device)
    searches = [name for name in methods if name != MARCH]
    found = [Combination(method=method, precision=precision) for method in searches for precision in precisions]
    found += [Combination(method=searches[0], precision=precision, snell="paraxial") for precision in precisions]
    found += [
        Combination(method=MARCH, precision=precision, step=step) for step in steps(scene) for precision in precisions
    ]
    if (usual := forerunner(device)) in found:
        found += [replace(usual, tolerance=tolerance) for tolerance in _TOLERANCES]
        found.append(replace(usual, snell="paraxial"))
    return found


def forerunner(device: Device) -> Combination:
    """Return the method of the program that this one follows, done right: steps of 0.01, Newton, Snell's law."""
    return Combination(method=MARCH, precision=precisions_of(device)[-1], step=FORERUNNER_STEP)


def precisions_of(device: Device) -> tuple[Precision, ...]:
    """Return the precisions that a device has, the cheapest first."""
    return ("single", "mixed", "double") if device.has_double else ("single",)


def serving(scene: Scene) -> list[str]:
    """Return the methods that serve every lens of a scene, the one that `auto` takes first.

    Where `auto` takes different ones for different lenses, it is a method of its own.
    """
    chosen = {method.name for method in methods_of(scene.replace({"numerics.method": "auto"}))}
    first = chosen.pop() if len(chosen) == 1 else "auto"
    return [first, *(name for name in METHODS if name != first and _serves(name, scene))]


def _serves(name: str, scene: Scene) -> bool:
    try:
        methods_of(scene.replace({"numerics.method": name}))
    except StudyError:
        return False
    return True


def steps(scene: Scene) -> Iterator[float]:
    """Yield steps of the march, from coarse to fine: parts of the largest lens, and the forerunner's."""
    across = max(Placement.of(group.lens).diagonal() for group in scene.lenses.groups)
    every = {FORERUNNER_STEP, *(_rounded(across / part) for part in _PARTS)}
    yield from sorted((step for step in every if across / step <= _MOST_STEPS), reverse=True)


def _rounded(value: float) -> float:
    """Return a length to one digit, so that it can be read."""
    return round(value, -floor(log10(value)))
