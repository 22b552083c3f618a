"""Trace a scene as its study asks: by the method and precision it names, or as accurately as it wants."""

from __future__ import annotations

from functools import cache

from numpy.typing import ArrayLike

from lenscl import device as devices
from lenscl import tracing
from lenscl.accuracy.planner import Planner
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.tracing import RayMap, RayPaths


def trace(
    scene: Scene, *, method: str | None = None, precision: str | None = None, device: Device | str | None = None
) -> RayMap:
    """Trace the ray of every film pixel.

    Parameters
    ----------
    scene : Scene
        What to trace. With `numerics.accuracy`, the fastest configuration that meets the accuracy is used, and the map
        is tested; `raymap.scene` states the configuration. The accuracy is in pixels of `picture.size`, because a scene
        has no images.
    method, precision : str, optional
        They replace those of the scene, and its `numerics.accuracy`.
    device : Device or str, optional
        A device, or part of its label. Default: the best device.

    Returns
    -------
    RayMap
        Arrays of shape (rows, columns, ...).

    Raises
    ------
    StudyError
        If the scene cannot be traced in this way, or the accuracy is out of reach; the message says what to change.
    NoDeviceError, BuildError, TraceError
        If the device is missing, or a kernel cannot be built or run.
    LensclError
        If the accuracy is near the rounding of double precision, and python-flint is missing or broken.
    """
    if scene.numerics.accuracy is None or method is not None or precision is not None:
        return tracing.complete(tracing.trace(scene, method=method, precision=precision, device=device))
    raymap, _ = planner_of(device).trace(scene)
    return raymap


def trace_rays(
    scene: Scene,
    origins: ArrayLike,
    directions: ArrayLike,
    *,
    method: str | None = None,
    precision: str | None = None,
    device: Device | str | None = None,
) -> RayPaths:
    """Trace given rays through a scene; its source and film are not used.

    Parameters
    ----------
    scene : Scene
        What to trace through. With `numerics.accuracy`, the fastest configuration that meets the accuracy on these rays
        is used; the search starts with the one that the scene's own film needs.
    origins, directions : array_like, shape (N, 3)
        World, scene units. Directions need not be unit; origins may lie inside a lens.
    method, precision, device
        As for `trace`.

    Returns
    -------
    RayPaths
        Arrays of shape (N, ...).

    Raises
    ------
    TraceError
        If the arrays are not (N, 3) and finite, an origin's number is beyond 1e30, or a direction is zero; the message
        names the first such ray.
    StudyError, NoDeviceError, BuildError, LensclError
        As for `trace`.
    """
    if scene.numerics.accuracy is not None and method is None and precision is None:
        return planner_of(device).trace_rays(scene, origins, directions)[0]
    return tracing.trace_rays(scene, origins, directions, method=method, precision=precision, device=device)


def planner_of(device: Device | str | None = None) -> Planner:
    """Return the planner of a device, one for the process, so that what it learned of a scene is not learned again."""
    return _planner(device if isinstance(device, Device) else devices.choose(device))


@cache
def _planner(device: Device) -> Planner:
    return Planner(device)
