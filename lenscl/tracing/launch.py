"""Trace a scene: the rays of its film, or rays of the caller's own."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl import codegen
from lenscl.codegen import KernelSource
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.errors import TraceError
from lenscl.tracing.called import steering
from lenscl.tracing.film import film_rays
from lenscl.tracing.job import Job, traced_rays, unit_vectors
from lenscl.tracing.raymap import RayMap, RayPaths
from lenscl.tracing.structure import chosen_device, structure_of

_FARTHEST = 1e30  # scene units: as for picture coordinates; single precision ends at 3e38


def trace(
    scene: Scene, *, method: str | None = None, precision: str | None = None, device: Device | str | None = None
) -> RayMap:
    """Trace the ray of every film pixel by the method and precision that are named.

    What `lenscl.trace` comes to, with its parameters and errors, once it is chosen how to trace: a scene that asks for
    an accuracy is refused unless `method` or `precision` is given. One ray a pixel is traced; `complete` adds more.
    """
    return RayMap(**_film(scene, "map", method, precision, device), legs=film_legs)


def film_legs(raymap: RayMap) -> tuple[NDArray[Any], NDArray[Any]]:
    """Trace the last straight legs of a map's rays: their origins and directions, shape (rows, columns, 3)."""
    fields = _film(steering(raymap.scene), "legs", None, None, raymap.device)  # of which only the legs are kept
    return fields["origin"], fields["direction"]


def _film(
    scene: Scene,
    ends: Literal["map", "legs"],
    method: str | None,
    precision: str | None,
    device: Device | str | None,
) -> dict[str, Any]:
    """Trace the ray of every film pixel; return the fields of a map."""
    job = Job.prepare(scene, scene.source.kind, ends, method, precision, device)
    film = job.scene.film
    arrays = job.run_film()
    job.decide(arrays, lambda undecided: film_rays(job.scene, undecided))
    return job.result(arrays, film.rows, film.columns)


def trace_without(scene: Scene, variant: str, *, device: Device | str | None = None) -> RayMap:
    """Trace the ray of every film pixel with one variant of an effect less than the scene calls for.

    It is for finding out what that costs: where the variant steers rays they go wrong, or end elsewhere. The program
    counts as one of kind "ablation" in `compile_count`.
    """
    job = Job.prepare(scene, scene.source.kind, "map", None, None, device, kind="ablation", without=variant)
    arrays = job.run_film()
    film = job.scene.film
    return RayMap(**job.result(arrays, film.rows, film.columns), legs=_no_legs)


def _no_legs(raymap: RayMap) -> tuple[NDArray[Any], NDArray[Any]]:
    raise TraceError("origin, direction: a map without one of its effects has none; trace the scene")


def trace_rays(
    scene: Scene,
    origins: ArrayLike,
    directions: ArrayLike,
    *,
    method: str | None = None,
    precision: str | None = None,
    device: Device | str | None = None,
) -> RayPaths:
    """Trace rays of the caller's own by the method and precision that are named.

    What `lenscl.trace_rays` comes to, as `trace` is of `lenscl.trace`.
    """
    points, units = checked_rays(origins, directions)
    return traced_rays(Job.prepare(scene, "given", "legs", method, precision, device), points, units)


def kernel_source(scene: Scene, *, rays: str | None = None, device: Device | str | None = None) -> KernelSource:
    """Return the kernel that traces a scene on a device; `rays="given"` for the one of `trace_rays`."""
    ends = "legs" if rays == "given" else "map"
    return codegen.kernel_source(structure_of(scene, rays or scene.source.kind, ends, chosen_device(device)))


def checked_rays(origins: ArrayLike, directions: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return rays as points and unit directions, shape (N, 3); errors as for `lenscl.trace_rays`."""
    try:
        points, vectors = np.asarray(origins, dtype=np.float64), np.asarray(directions, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise TraceError(f"origins, directions: expected arrays of numbers, shape (N, 3): {error}") from error
    for name, array in (("origins", points), ("directions", vectors)):
        if array.ndim != 2 or array.shape[1] != 3:
            raise TraceError(f"{name}: expected an array of shape (N, 3), got {array.shape}")
        if not np.isfinite(array).all():
            ray = int(np.flatnonzero(~np.isfinite(array).all(axis=1))[0])
            raise TraceError(f"{name}[{ray}]: expected finite numbers, got {array[ray]}")
    if (far := (np.abs(points) > _FARTHEST).any(axis=1)).any():
        ray = int(np.flatnonzero(far)[0])
        raise TraceError(f"origins[{ray}]: expected numbers of a size up to {_FARTHEST:g}, got {points[ray]}")
    if len(points) != len(vectors):
        raise TraceError(f"expected as many directions as origins, got {len(vectors)} and {len(points)}")
    if not (some := vectors.any(axis=1)).all():
        raise TraceError(f"directions[{int(np.flatnonzero(~some)[0])}]: a direction must not be zero")
    return points, unit_vectors(vectors)
