"""What tracing yields, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.codegen import KernelSource
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.status import RayStatus


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Rays:
    """The ends of rays. Lengths are in scene units; real arrays have the precision traced (float32 or float64).

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
    kernel : KernelSource
        What traced them.
    scene : Scene
        What was traced, with any method or precision asked for in the call.
    device : Device
        Where.
    """

    st: NDArray[Any] = field(repr=False)
    status: NDArray[np.uint8] = field(repr=False)
    events: NDArray[np.uint8] = field(repr=False)
    origin: NDArray[Any] = field(repr=False)
    direction: NDArray[Any] = field(repr=False)
    trace_seconds: float
    kernel: KernelSource = field(repr=False)
    scene: Scene = field(repr=False)
    device: Device

    def counts(self) -> dict[RayStatus, int]:
        """Return how many rays ended how; they sum to the rays."""
        counted = np.bincount(self.status.ravel(), minlength=len(RayStatus))
        return {status: int(counted[status]) for status in RayStatus}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RayMap(_Rays):
    """Where the ray of every film pixel lands; arrays of shape (rows, columns, ...)."""

    __doc__ = f"{__doc__}\n\n{_Rays.__doc__}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RayPaths(_Rays):
    """Where given rays land; arrays of shape (N, ...)."""

    __doc__ = f"{__doc__}\n\n{_Rays.__doc__}"
