"""Follow a few rays surface by surface, as the device traces them: for what looks at whole paths, not at their ends."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
from lenscl.device import Device
from lenscl.tracing.called import steering
from lenscl.tracing.job import Job, given_ends, unit_vectors
from lenscl.tracing.structure import structure_of

Array = NDArray[np.float64]
_MADE_BY = ("legs", "map")  # what is behind a surface, and what is on the picture's plane


@dataclass(frozen=True, slots=True, eq=False)
class Ends:
    """The ends of N rays: the last leg's origin and direction, shape (N, 3), where it lands, status and events."""

    origin: Array = field(repr=False)
    direction: Array = field(repr=False)
    st: Array = field(repr=False)
    status: NDArray[np.uint8] = field(repr=False)
    events: NDArray[np.uint8] = field(repr=False)


class Follower:
    """Traces given rays of one scene again and again, each time up to so many events.

    The event limit is an argument of the kernel: a ray stopped after k events ends at its k-th surface point, with the
    direction behind it. Rays left undecided are not traced again in a higher precision: every point that comes out is
    of the precision asked for.

    Parameters
    ----------
    scene : Scene
        With its method and precision; indices are those of the d line.
    device : Device
        Where to trace.
    kind : str
        What `lenscl.device.compile_count` counts its program as.
    """

    def __init__(self, scene: Scene, device: Device, kind: str = "follow") -> None:
        self._job = Job.prepare(steering(scene.at_d_line()), "given", "legs", None, None, device, kind=kind)

    def finer(self) -> Follower | None:
        """Return what a map's undecided rays are traced again by: the next precision; None where there is none."""
        job = self._job.finer()
        if job is None:
            return None
        other = object.__new__(type(self))
        other._job = job
        return other

    @property
    def scene(self) -> Scene:
        """What is traced, with the precision that it is traced in."""
        return self._job.scene

    @property
    def dtype(self) -> type[np.floating[Any]]:
        """The precision that rays are carried in."""
        return self._job.dtype

    @property
    def nests(self) -> bool:
        """Whether solids may touch or overlap: rays are then followed through sets of them."""
        return bool(self._job.source.structure.nests)

    @property
    def stops(self) -> bool:
        """Whether rays end where they meet the picture first, in a solid too."""
        return self._job.source.structure.stops

    def rounded(self, vectors: Array) -> Array:
        """Return numbers as the kernel gets them."""
        return vectors.astype(self.dtype).astype(np.float64)

    def starts(self, points: Array, vectors: Array) -> tuple[Array, Array]:
        """Return where rays start and their unit directions, shape (N, 3), as the kernel gets them."""
        return self.rounded(points), self.rounded(unit_vectors(vectors))

    def ends(self, points: Array, vectors: Array, max_events: int) -> Ends:
        """Trace rays from points along vectors of any length, shape (N, 3), through at most so many surfaces."""
        self._job.max_events = max_events
        return _ends(given_ends(self._job, points, unit_vectors(vectors)))


class PixelFollower:
    """Traces the ray of one film pixel again and again, each time up to so many events; otherwise as `Follower`.

    The ray is made by the kernel as in a map, rounding for rounding. No events at all give its start and direction.

    Parameters
    ----------
    scene : Scene
        With its method and precision; indices are those of the d line.
    row, column : int
        Of the film.
    device : Device
        Where to trace.
    kind : str
        What `lenscl.device.compile_count` counts its program as.
    """

    def __init__(self, scene: Scene, row: int, column: int, device: Device, kind: str = "follow") -> None:
        self._job = Job.prepare(steering(scene.at_d_line()), scene.source.kind, "legs", None, None, device, kind=kind)
        self._tile = row, column, 1, 1

    @property
    def dtype(self) -> type[np.floating[Any]]:
        """The precision that the ray is carried in."""
        return self._job.dtype

    def ends(self, max_events: int) -> Ends:
        """Trace the ray through at most so many surfaces; arrays of one row."""
        self._job.max_events = max_events
        ends = self._job.empty_ends(1)
        self._job.run(ends, self._tile, 0, ())
        return _ends(ends)


def pixel_effects(
    scene: Scene, row: int, column: int, device: Device, surfaces: int
) -> tuple[Mapping[str, NDArray[Any]], ...]:
    """Return what the effects of a scene make of a film pixel's ray, behind each surface and on the picture's plane.

    Parameters
    ----------
    scene, row, column, device
        As for `PixelFollower`.
    surfaces : int
        How many the ray meets.

    Returns
    -------
    tuple of mapping
        For each surface, and then for the map: by the name of the map's array its numbers, in double. What is known on
        the picture's plane alone stands only in the last. Empty where no effect adds anything.
    """
    scene = scene.at_d_line()
    adds = structure_of(scene, scene.source.kind, "map", device).adds
    if not adds:
        return ()
    tile = row, column, 1, 1
    jobs = {ends: Job.prepare(scene, scene.source.kind, ends, None, None, device, kind="explain") for ends in _MADE_BY}
    late = {
        one.name for effect in jobs["map"].source.structure.effects if "landing" in effect.hooks for one in effect.adds
    }
    found = []
    for most in (*range(1, surfaces + 1), None):
        job = jobs["map" if most is None else "legs"]
        job.max_events = scene.numerics.max_events if most is None else most
        ends = job.empty_ends(1)
        job.run(ends, tile, 0, ())
        names = [one.name for one in adds if most is None or one.name not in late]
        found.append({name: ends[name][0].astype(np.float64) for name in names})
    return tuple(found)


def _ends(ends: Mapping[str, NDArray[Any]]) -> Ends:
    origin, direction, st = (ends[name].astype(np.float64) for name in ("origin", "direction", "st"))
    return Ends(origin, direction, st, ends["status"], ends["events"])
