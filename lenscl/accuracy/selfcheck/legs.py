"""The last legs of rays: that they land where the map says, and that nothing lies in their way."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.selfcheck.hits import SAFETY
from lenscl.config import Lens, Picture, Scene
from lenscl.expr import evaluate_with_error, gradient
from lenscl.reference import Placement, land

Array = NDArray[np.float64]

_SAMPLES = 48  # of the way through a lens's box: what is thinner than a part of it may be passed over here, too
_EPS = float(np.finfo(np.float64).eps)


def landings(picture: Picture, origin: Array, direction: Array, st: Array, eps: float) -> tuple[Array, Array]:
    """Return how far places on a picture are from where legs meet its plane, and what rounding allows.

    Parameters
    ----------
    picture : Picture
    origin, direction : float64 arrays, shape (N, 3)
        Of last legs that land, as the kernel has them.
    st : float64 array, shape (N, 2)
        Where it says that they land.
    eps : float
        Of the precision that the rays were carried in.
    """
    solved, _ = land(origin, direction, picture)
    right, down, corner = (np.asarray(each) for each in (picture.right, picture.down, picture.corner))
    across = np.cross(right, down)
    normal = across / np.linalg.norm(across)
    steep = np.abs(direction @ normal)
    distance = np.abs((corner - origin) @ normal) / steep
    # A length that is off moves the place by as much over the cosine; duals are as long as the spans are thin
    dual = max(np.linalg.norm(right), np.linalg.norm(down)) / np.linalg.norm(across)
    length = np.linalg.norm(origin, axis=1) + np.linalg.norm(corner) + distance
    bound = SAFETY * eps * (dual * length / steep + np.abs(st).max(axis=1) + 1.0)
    return np.abs(solved - st).max(axis=1), bound


def obstacles(scene: Scene, origin: Array, direction: Array, allowed: Array, eps: float) -> tuple[Array, Array]:
    """Return how deep legs that leave all lenses go through one, in terms of F, and what rounding allows there.

    Parameters
    ----------
    scene : Scene
    origin, direction : float64 arrays, shape (N, 3)
    allowed : float64 array, shape (N,)
        How large |F| may be where a leg starts on a surface.
    eps : float
        Of the precision that the rays were carried in.
    """
    depth, bound = np.zeros(len(origin)), np.ones(len(origin))
    for lens in scene.lenses:
        placement = Placement.of(lens)
        start, along = placement.point_to_local(origin), placement.vector_to_local(direction)
        enter, leave = _span(lens, start, along)
        share = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
        t = enter[:, None] + share * np.maximum(leave - enter, 0.0)[:, None]
        points = (start[:, None] + t[:, :, None] * along[:, None]).reshape(-1, 3)
        values: dict[str, Any] = {**lens.values, **dict(zip("xyz", points.T, strict=True))}
        f, rounding = (
            np.broadcast_to(each, len(points)) for each in evaluate_with_error(lens.surface.expression, values)
        )
        slopes = [evaluate_with_error(each, values)[0] for each in gradient(lens.surface.expression)]
        slope = sum(np.abs(np.broadcast_to(each, len(points))) for each in slopes)
        size = np.abs(points).max(axis=1) + np.repeat(np.abs(start).max(axis=1), _SAMPLES)
        most = SAFETY * (rounding * eps / _EPS + slope * eps * size) + np.repeat(allowed, _SAMPLES)
        ratio = np.where((leave > enter).repeat(_SAMPLES) & np.isfinite(most), np.maximum(-f, 0.0) / most, 0.0)
        worst = ratio.reshape(-1, _SAMPLES).argmax(axis=1) + np.arange(len(origin)) * _SAMPLES
        deeper = ratio[worst] > depth / bound
        depth = np.where(deeper, np.maximum(-f[worst], 0.0), depth)
        bound = np.where(deeper, most[worst], bound)
    return depth, bound


def _span(lens: Lens, start: Array, along: Array) -> tuple[Array, Array]:
    """Return where legs enter and leave a lens's box, ahead of their start; not beyond where they miss it."""
    low, high = (np.asarray(corner) for corner in lens.surface.box(lens.values))
    first, second = (low - start) / along, (high - start) / along
    outside = ((along == 0) & ((start < low) | (start > high))).any(axis=1)
    enter = np.where(along == 0, 0.0, np.minimum(first, second)).max(axis=1)
    leave = np.where(along == 0, np.inf, np.maximum(first, second)).min(axis=1)
    enter = np.maximum(enter, 0.0)
    return enter, np.where(outside | ~np.isfinite(leave), enter, leave)
