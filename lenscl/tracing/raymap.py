"""What tracing yields, as frozen values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.codegen import KernelSource
from lenscl.config import Scene
from lenscl.config.scene import Frozen
from lenscl.device import Device
from lenscl.effects import EFFECTS
from lenscl.status import RayStatus

_ADDED_BY = {
    effect.key: {output.name for some in effect.variants.values() for one in some for output in one.adds}
    | {"wavelengths" for some in effect.variants.values() for one in some if one.layers}
    for effect in EFFECTS.values()
}


@dataclass(frozen=True, kw_only=True, eq=False)
class _Rays:
    """The ends of rays. Lengths are in scene units; real arrays have the precision traced (float32 or float64).

    With `effects.dispersion` every array of rays has one more axis in front, of the K wavelengths: `st` is of shape
    (K, ..., 2), and the attribute `wavelengths`, float64 of shape (K,), has them in nm.

    Attributes
    ----------
    st : real array, shape (..., 2)
        Picture coordinates: s along right, t along down, both in [0, 1) on the picture; (-1, -1) where the status
        says that the ray has no place on the picture's plane.
    status : uint8 array, shape (...)
        Values of `RayStatus`.
    events : uint8 array, shape (...)
        Surfaces met: entries, exits and total reflections. 0 says that the ray missed every lens.
    origin, direction : real array, shape (..., 3)
        The last straight leg: its start, a surface point or the source, and its unit direction.
    trace_seconds : float
        Device time of all launches.
    escalated : int
        How many rays were undecided in single precision and traced again in double.
    kernel : KernelSource
        What traced them; of the escalated ones, all but their precision.
    scene : Scene
        What was traced, with any method or precision asked for in the call.
    device : Device
        Where.
    added : mapping of str to array
        What the scene's effects add, by name. Each is an attribute, too: `raymap.path_length`.
    """

    st: NDArray[Any] = field(repr=False)
    status: NDArray[np.uint8] = field(repr=False)
    events: NDArray[np.uint8] = field(repr=False)
    trace_seconds: float
    escalated: int
    kernel: KernelSource = field(repr=False)
    scene: Scene = field(repr=False)
    device: Device
    added: Mapping[str, NDArray[Any]] = field(default=Frozen(), repr=False)

    def __getattr__(self, name: str) -> NDArray[Any]:
        # Asked for what is no attribute of its own
        added: Mapping[str, NDArray[Any]] = self.__dict__.get("added", {})
        if name in added:
            return added[name]
        effect = next((key for key, names in _ADDED_BY.items() if name in names), None)
        advice = f"; trace with effects.{effect} for it" if effect else ""
        raise AttributeError(f"{type(self).__name__} has no {name}{advice}")

    def counts(self) -> dict[RayStatus, int]:
        """Return how many rays ended how; they sum to the rays, those of all wavelengths counted."""
        counted = np.bincount(self.status.ravel(), minlength=len(RayStatus))
        return {status: int(counted[status]) for status in RayStatus}


@dataclass(frozen=True, kw_only=True, eq=False)
class RayMap(_Rays):
    """Where the ray of every film pixel lands; arrays of shape (rows, columns, ...).

    `origin` and `direction` are three times as large as the rest and seldom asked for: they are traced when first
    read. `trace_seconds` does not count that.
    """

    __doc__ = f"{__doc__}\n\n{_Rays.__doc__}"

    legs: Callable[[], tuple[NDArray[Any], NDArray[Any]]] = field(repr=False)

    @property
    def origin(self) -> NDArray[Any]:
        """Where the last straight leg starts."""
        return self._legs[0]

    @property
    def direction(self) -> NDArray[Any]:
        """Its unit direction."""
        return self._legs[1]

    def layers(self) -> tuple[RayMap, ...]:
        """Return the map of each wavelength as one without that axis; itself, alone, where it has none.

        The scene of each is in light of its wavelength, `Scene.at_wavelength`. Each has its share of the seconds, and
        counts in `escalated` the rays of all.
        """
        if "wavelengths" not in self.added:
            return (self,)
        scenes = self.scene.layers()
        return tuple(self._layer(number, scene) for number, scene in enumerate(scenes))

    def _layer(self, number: int, scene: Scene) -> RayMap:
        return replace(
            self,
            st=self.st[number],
            status=self.status[number],
            events=self.events[number],
            scene=scene,
            trace_seconds=self.trace_seconds / len(self.status),
            added=Frozen({name: array[number] for name, array in self.added.items() if name != "wavelengths"}),
            legs=lambda: (self.origin[number], self.direction[number]),
        )

    @cached_property
    def _legs(self) -> tuple[NDArray[Any], NDArray[Any]]:
        return self.legs()


@dataclass(frozen=True, kw_only=True, eq=False)
class RayPaths(_Rays):
    """Where given rays land; arrays of shape (N, ...)."""

    __doc__ = f"{__doc__}\n\n{_Rays.__doc__}"

    origin: NDArray[Any] = field(repr=False)
    direction: NDArray[Any] = field(repr=False)
