"""Why a ray may have broken a law: told from where its path lies, and from whether it holds in double precision.

Three causes can be shown: an expression that has no value on the path, a part of a lens that `march` has passed over,
and rounding. Where none of them is found, and two solids share a place on the path, what is left is that the media
there were told wrongly; else it is the device.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.selfcheck.findings import Failure
from lenscl.accuracy.selfcheck.media import AROUND, NEAR, UNKNOWN, in_box, media_at, values_of
from lenscl.config import Lens, Scene
from lenscl.device import Device
from lenscl.errors import LensclError
from lenscl.status import RayStatus
from lenscl.tracing import Ends, methods_of, near_points, world_boxes

Array = NDArray[np.float64]

_SAMPLES = 129  # of a leg
_OF_PATHS = ("surface", "contact", "snell", "stop", "return", "ahead", "map")  # laws of surfaces and media
_STAYS = (RayStatus.BLOCKED, RayStatus.TOTAL_REFLECTION)  # where the last surface is


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
        legs = _legs(failure, scene, points[:, ray], ends, ray) if failure.law in _OF_PATHS else []
        cause, about = _of_path(failure, scene, legs, points[:, ray], eps) if legs else ("", "")
        if not cause and failure.law != "map" and _holds(holds_in_double, ray):
            cause = "rounding"
        if not cause and legs and (about := _shared(scene, legs, eps)):
            cause = "media"
        if not cause:
            cause, about = "device", f"{device.label}, driver {device.driver}"
        found.append(replace(failure, cause=cause, about=about))
    return tuple(found)


def _holds(holds_in_double: Callable[[int], bool], ray: int) -> bool:
    try:
        return holds_in_double(ray)
    except LensclError:  # the device refuses
        return False


def _of_path(
    failure: Failure, scene: Scene, legs: list[tuple[Array, Array]], points: Array, eps: float
) -> tuple[str, str]:
    """Return a cause that lies on the path at the failure, and the lens that it names; empty if there is none."""
    # A surface point where an expression has no value, and no other lens is met
    if failure.event:
        at = points[failure.event]
        near = _near(scene, at[None])
        there = [_values(scene.lenses[number], at[None], eps) for number in near]
        if not any(value[0] <= bound[0] for value, bound in there):
            for number, (value, _) in zip(near, there, strict=True):
                if in_box(scene.lenses[number], at[None])[0] and not np.isfinite(value[0]):
                    return "no number", scene.lens_key(number)

    # A leg that goes from one medium into another, and no event was made of it
    if not all(method.is_guaranteed for method in methods_of(scene)):
        way = _samples(legs)
        for media in media_at(scene, way.reshape(-1, 3), eps).reshape(way.shape[:2]):
            seen = [int(medium) for medium in dict.fromkeys(media[media != UNKNOWN].tolist())]
            if len(seen) > 1:
                return "lost", scene.lens_key(seen[1] if seen[0] == AROUND else seen[0])
    return "", ""


def _shared(scene: Scene, legs: list[tuple[Array, Array]], eps: float) -> str:
    """Return two lenses that share a place on the path, of several those that share the most; empty if there are none.

    The place lies in both, or is a surface point that is on both, or on one and in the other.
    """
    way = _samples(legs)
    near = _near(scene, way.reshape(-1, 3))
    if len(near) < 2:
        return ""
    values = [_values(scene.lenses[number], way.reshape(-1, 3), eps) for number in near]
    f, most = (np.stack(each).reshape(len(values), *way.shape[:2]) for each in zip(*values, strict=True))
    holds = f <= most
    holds[:, :, 1:-1] = (f < -most)[:, :, 1:-1]  # the samples at the ends of legs are surface points
    shared = {
        pair: int((holds[pair[0]] & holds[pair[1]]).sum()) for pair in combinations(range(len(near)), 2)
    }  # fmt: skip
    pair = max(shared, key=lambda one: shared[one], default=None)
    return " and ".join(scene.lens_key(near[place]) for place in pair) if pair and shared[pair] else ""


def _near(scene: Scene, points: Array) -> list[int]:
    """Return the lenses, by number, in whose boxes some points may lie."""
    found: list[int] = np.unique(near_points(scene.lenses, points, NEAR, NEAR)[1]).tolist()
    return found


def _samples(legs: list[tuple[Array, Array]]) -> Array:
    """Return points along legs, from end to end; shape (legs, samples, 3)."""
    share = np.linspace(0.0, 1.0, _SAMPLES)[:, None]
    return np.stack([start + share * (end - start) for start, end in legs])


def _values(lens: Lens, points: Array, eps: float) -> tuple[Array, Array]:
    """Return F, and what rounding makes of it; none where that is not known."""
    f, most = values_of(lens, points, eps)
    return f, np.where(np.isfinite(most), most, 0.0)


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
    low, high = world_boxes(scene.lenses)
    return float(np.linalg.norm(np.maximum(np.abs(low - origin), np.abs(high - origin)), axis=1).max())
