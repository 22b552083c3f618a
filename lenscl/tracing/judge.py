"""Trace rays by which others are judged, through the scene or through one that is moved by roundings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.config import Scene
from lenscl.device import Device
from lenscl.tracing.called import steering
from lenscl.tracing.job import Job, traced_rays
from lenscl.tracing.raymap import RayPaths

Array = NDArray[np.float64]

_INDICES = ("n", "n_medium")  # names of numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class Nudge:
    """How the lenses are moved, by so little that only first order counts.

    Attributes
    ----------
    turn : three numbers
        Each lens is turned about its own centre, by these angles (radians) about the world's axes.
    eta_in, eta_out : float
        By which part the ratios of indices grow, on entry and on exit; a ratio of exactly 1 stays. Where solids may
        touch or overlap, any two indices that differ move apart by `eta_in` at least, and `eta_out` plays no part.
    """

    turn: tuple[float, float, float]
    eta_in: float
    eta_out: float

    def of(self, numbers: Mapping[str, ArrayLike], *, nests: bool = False) -> dict[str, ArrayLike]:
        """Return a scene's numbers, moved; `nests`: of a kernel for solids that may touch or overlap."""
        x, y, z = self.turn
        turned = np.eye(3) + np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        moved = dict(numbers)
        for name, value in numbers.items():
            match name.rpartition(".")[2]:
                case "to_world":
                    moved[name] = turned @ np.asarray(value)  # of a lens, or of many
                case "to_local":
                    moved[name] = np.asarray(value) @ turned.T
                case "eta_in" | "eta_out" as side:
                    ratio = np.asarray(value, dtype=np.float64)
                    moved[name] = np.where(ratio == 1.0, ratio, ratio * (1.0 + getattr(self, side)))
        if nests:  # whose kernel divides the indices of two media itself
            indices = {
                name: np.asarray(value, dtype=np.float64)
                for name, value in numbers.items()
                if name.split(".")[-1] in _INDICES
            }
            every = np.unique(np.concatenate([index.ravel() for index in indices.values()]))
            moved |= {
                name: index * (1.0 + self.eta_in * np.searchsorted(every, index)) for name, index in indices.items()
            }
        return moved


@dataclass(frozen=True, slots=True, eq=False)
class Meetings:
    """Where some rays met a surface, each its k-th.

    Attributes
    ----------
    surface : int
        That k, from 1.
    rays : int array, shape (M,)
        Their numbers, rising.
    origin, direction : float64 array, shape (M, 3)
        The point of the surface, and the unit direction behind it, world.
    is_theirs : bool array, shape (M,)
        False where the ray, followed as far as this surface alone, was not told to meet it.
    """

    surface: int
    rays: NDArray[np.intp] = field(repr=False)
    origin: Array = field(repr=False)
    direction: Array = field(repr=False)
    is_theirs: NDArray[np.bool_] = field(repr=False)


class Judge:
    """Traces rays in double precision by method auto and the exact law, at the d line.

    Its program counts as one of kind "judge" in `compile_count`.

    Parameters
    ----------
    scene : Scene
        Of its numerics `max_events` alone plays a part.
    device : Device or str, optional
        As for `trace`.

    Attributes
    ----------
    nests : bool
        Whether solids may touch or overlap, so that rays travel in sets of solids.
    """

    def __init__(self, scene: Scene, device: Device | str | None = None) -> None:
        scene = scene.at_d_line()
        exact = scene if scene.numerics.snell == "exact" else scene.replace({"numerics.snell": "exact"})
        self._job = Job.prepare(steering(exact), "given", "legs", "auto", "double", device, kind="judge")
        self._most = exact.numerics.max_events
        self.nests = bool(self._job.source.structure.nests)

    def paths(self, points: Array, units: Array, nudge: Nudge | None = None, most: int | None = None) -> RayPaths:
        """Trace rays as `checked_rays` returns them, through lenses that are moved, or through so many surfaces."""
        self._job.max_events = self._most if most is None else most
        self._job.change_numbers(
            (lambda numbers: numbers) if nudge is None else lambda numbers: nudge.of(numbers, nests=self.nests)
        )
        return traced_rays(self._job, points, units)

    def meetings(self, points: Array, units: Array, paths: RayPaths, rays: NDArray[np.intp]) -> Iterator[Meetings]:
        """Yield the surfaces that some rays met, the first, the second and so on.

        A ray that may meet k surfaces ends at its k-th one, and the last one is what its path holds. So a ray of two
        surfaces is traced once more.

        Parameters
        ----------
        points, units : float64 array, shape (N, 3)
        paths : RayPaths
            Theirs, by lenses as they stand.
        rays : int array
            The numbers of those that are asked for, rising.
        """
        for surface in range(1, int(paths.events[rays].max(initial=0)) + 1):
            rays = rays[paths.events[rays] >= surface]
            origin, direction = paths.origin[rays], paths.direction[rays]
            is_theirs = np.ones(len(rays), bool)
            if (goes_on := np.flatnonzero(paths.events[rays] > surface)).size:
                found = self.paths(points[rays[goes_on]], units[rays[goes_on]], most=surface)
                origin[goes_on], direction[goes_on] = found.origin, found.direction
                is_theirs[goes_on] = found.events == surface
            yield Meetings(surface, rays, origin, direction, is_theirs)
