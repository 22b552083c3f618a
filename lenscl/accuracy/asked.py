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
        What to trace. Where it has `numerics.accuracy`, the cheapest way that meets it is taken, and the map is
        checked; `raymap.scene` says which way that was. Pixels are those of `picture.size`: a scene knows no images.
    method, precision : str, optional
        In place of the scene's own, and of a wish for accuracy.
    device : Device or str, optional
        Where to trace: a device or part of its label. Default: the best one here.

    Returns
    -------
    RayMap
        Arrays of shape (rows, columns, ...).

    Raises
    ------
    StudyError
        If the scene cannot be traced as asked, or nothing is as accurate as asked; the message says what to change.
    NoDeviceError, BuildError, TraceError
        If the device is missing or cannot do it.
    LensclError
        If an accuracy near the last digits is asked for and python-flint is missing or broken.
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
    """Trace rays of the caller's own through a scene; its source and film play no part.

    Parameters
    ----------
    scene : Scene
        What to trace through. Where it has `numerics.accuracy`, the cheapest way is taken by which these rays meet it,
        beginning with the one that its own film needs.
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
