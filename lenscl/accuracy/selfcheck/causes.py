"""Why a ray may have broken a law: told from where its path lies, and from whether it holds in double precision.

Four causes can be shown: two solids that share a place on the path, an expression that has no value there, a part of a
lens that `march` has passed over, and rounding. Where none of them is found the device is what is left.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import combinations, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.selfcheck.findings import Failure
from lenscl.accuracy.selfcheck.hits import SAFETY
from lenscl.config import Lens, Scene
from lenscl.device import Device
from lenscl.errors import LensclError
from lenscl.expr import evaluate_with_error, gradient
from lenscl.reference import Placement
from lenscl.status import RayStatus
from lenscl.tracing import Ends, methods_of

Array = NDArray[np.float64]

_SAMPLES = 129  # of a leg
_OF_PATHS = ("surface", "snell", "stop", "return", "ahead", "map")  # laws that other lenses in the way may break
_STAYS = (RayStatus.BLOCKED, RayStatus.TOTAL_REFLECTION)  # where the last surface is
_EPS = float(np.finfo(np.float64).eps)


def with_causes(
    failures: Mapping[int, Failure],
    scene: Scene,
    device: Device,
    points: Array,
    ends: Ends,
    eps: float,
    holds_in_double: Callable[[int], bool],
) -> tuple[Failure, ...]:
    """Return failures, by the number of their ray, with their likely causes.

    Parameters
    ----------
    failures : mapping
    scene : Scene
    device : Device
        Where the rays were traced.
    points : float64 array, shape (K + 1, N, 3)
        The rays' starts and surface points, world.
    ends : Ends
        Of the same N rays.
    eps : float
        Of the precision that the rays were carried in.
    holds_in_double : callable
        Whether a ray, by its number, keeps the laws of paths in double precision, and was not carried in it.
    """
    found = []
    for ray, failure in failures.items():
        cause, about = _of_path(failure, scene, points[:, ray], ends, ray, eps)
        if not cause and failure.law != "map" and _holds(holds_in_double, ray):
            cause = "rounding"
        if not cause:
            cause, about = "device", f"{device.label}, driver {device.driver}"
        found.append(replace(failure, cause=cause, about=about))
    return tuple(found)


def _holds(holds_in_double: Callable[[int], bool], ray: int) -> bool:
    try:
        return holds_in_double(ray)
    except LensclError:  # the device refuses
        return False


def _of_path(failure: Failure, scene: Scene, points: Array, ends: Ends, ray: int, eps: float) -> tuple[str, str]:
    """Return a cause that lies on the path at the failure, and the lenses that it names; empty if there is none."""
    if failure.law not in _OF_PATHS:
        return "", ""
    legs = _legs(failure, scene, points, ends, ray)
    if not legs:
        return "", ""
    share = np.linspace(0.0, 1.0, _SAMPLES)[:, None]
    way = np.stack([start + share * (end - start) for start, end in legs])
    values = [_values(lens, way.reshape(-1, 3), eps) for lens in scene.lenses]
    f, most = (np.stack(each).reshape(len(values), *way.shape[:2]) for each in zip(*values, strict=True))

    # A place inside two lenses, or a surface point that is on both, or on one and in the other. The samples at the ends
    # of legs are surface points
    inside, holds = f < -most, f <= most
    holds[:, :, 1:-1] = inside[:, :, 1:-1]
    shared = {
        pair: int((holds[pair[0]] & holds[pair[1]]).sum()) for pair in combinations(range(len(scene.lenses)), 2)
    }  # fmt: skip
    if shared and (pair := max(shared, key=lambda one: shared[one])) and shared[pair]:
        return "overlap", " and ".join(scene.lens_key(number) for number in pair)

    # A surface point where an expression has no value, and no other lens is met
    if failure.event:
        at = points[failure.event]
        there = [_values(lens, at[None], eps) for lens in scene.lenses]
        if not any(value[0] <= bound[0] for value, bound in there):
            for number, (lens, (value, _)) in enumerate(zip(scene.lenses, there, strict=True)):
                if _in_box(lens, at[None])[0] and not np.isfinite(value[0]):
                    return "no number", scene.lens_key(number)

    # A leg that goes through a surface, and no event was made of it
    if not all(method.is_guaranteed for method in methods_of(scene)):
        through = np.any(f > most, axis=2) & np.any(inside, axis=2)
        for lens_number in np.flatnonzero(through.any(axis=1)):
            return "lost", scene.lens_key(int(lens_number))
    return "", ""


def _legs(failure: Failure, scene: Scene, points: Array, ends: Ends, ray: int) -> list[tuple[Array, Array]]:
    """Return the ends of the legs before and behind the failure's surface, or of all of the path."""
    met = min(int(ends.events[ray]), len(points) - 1)
    places = list(points[: met + 1])
    if met == ends.events[ray] and RayStatus(ends.status[ray]) not in _STAYS:
        places.append(ends.origin[ray] + _reach(scene, ends.origin[ray]) * ends.direction[ray])
    legs = list(pairwise(places))
    if failure.event:
        legs = legs[max(failure.event - 1, 0) : failure.event + 1]
    return [leg for leg in legs if np.isfinite(leg).all()]


def _reach(scene: Scene, origin: Array) -> float:
    """Return a length that leads from a point past every lens."""
    far = 0.0
    for lens in scene.lenses:
        placement = Placement.of(lens)
        low, high = lens.surface.box(lens.values)
        corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
        far = max(far, float(np.linalg.norm(placement.point_to_world(corners) - origin, axis=1).max()))
    return far


def _in_box(lens: Lens, points: Array) -> NDArray[np.bool_]:
    local = Placement.of(lens).point_to_local(points)
    low, high = (np.asarray(corner) for corner in lens.surface.box(lens.values))
    slack = 1e-6 * (high - low)
    found: NDArray[np.bool_] = ((local >= low - slack) & (local <= high + slack)).all(axis=1)
    return found


def _values(lens: Lens, points: Array, eps: float) -> tuple[Array, Array]:
    """Return F at points, shape (N, 3), and what rounding makes of it there; infinite outside the lens's box."""
    placement = Placement.of(lens)
    local = placement.point_to_local(points)
    at: dict[str, Any] = {**lens.values, **dict(zip("xyz", local.T, strict=True))}
    with np.errstate(all="ignore"):
        f, rounding = (np.broadcast_to(e, len(points)) for e in evaluate_with_error(lens.surface.expression, at))
        slopes = [evaluate_with_error(each, at)[0] for each in gradient(lens.surface.expression)]
        slope = sum(np.abs(np.broadcast_to(each, len(points))) for each in slopes)
        size = np.abs(local).max(axis=1) + np.abs(placement.centre / placement.stretch).max()
        most = SAFETY * (rounding * eps / _EPS + slope * eps * size)
    most = np.where(np.isfinite(most), most, 0.0)
    return np.where(_in_box(lens, points), f, np.inf), most
