"""Twin of kernels/screen.cl and picture_stops.cl: the picture's plane by a linear solve."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Picture
from lenscl.status import RayStatus

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_FARTHEST = 1e30
_ROUNDING = 16 * np.finfo(float).eps  # of the lengths at hand: what may be lost of a place on the picture's plane
_PARALLEL = 1e-6  # sine of the angle between the normals of a picture and of a face that it lies on


def land(origin: Array, direction: Array, picture: Picture) -> tuple[Array, NDArray[np.uint8]]:
    """Return picture coordinates, shape (N, 2), and statuses, shape (N,), of rays on their last leg.

    Solves `corner + s right + t down = origin + distance direction` for each ray.
    """
    solved, solvable = _solved(origin, direction, picture)
    st = np.full((len(origin), 2), -1.0)
    status = np.full(len(origin), RayStatus.BEHIND, dtype=np.uint8)
    meets = (solved[:, 2] > 0) & np.all(np.abs(solved[:, :2]) <= _FARTHEST, axis=1)
    within = np.all((solved[:, :2] >= 0) & (solved[:, :2] < 1), axis=1)
    st[solvable[meets]] = solved[meets, :2]
    status[solvable[meets]] = np.where(within[meets], RayStatus.PICTURE, RayStatus.OFF_PICTURE)
    return st, status


def stops(
    origin: Array, direction: Array, picture: Picture, nearest: Array, spread: Array, normal: Array
) -> tuple[Array, Mask]:
    """Return where the picture's parallelogram ends rays: before a surface does, or on a face that lies on it.

    Parameters
    ----------
    origin, direction : float64 array, shape (N, 3)
        Of the rays; directions unit.
    picture : Picture
    nearest : float64 array, shape (N,)
        Where each ray meets the next surface; inf where it meets none.
    spread : float64 array, shape (N,)
        How far rounding may move that.
    normal : float64 array, shape (N, 3)
        Of that surface, of any length.

    Returns
    -------
    distance : float64 array, shape (N,)
        Along the rays that it ends; inf for the others.
    unsure : bool array, shape (N,)
        Whether rounding hides it: at an edge of the picture, where the picture crosses a surface, and on the picture.
    """
    count = len(origin)
    solved, solvable = _solved(origin, direction, picture)
    place = np.full((count, 3), np.inf)
    place[solvable] = solved
    right, down = np.asarray(picture.right, float), np.asarray(picture.down, float)
    across = np.cross(right, down)
    unit = across / np.linalg.norm(across)
    with np.errstate(all="ignore"):
        distance = place[:, 2]
        lengths = np.abs(origin).max(axis=1) + np.abs(picture.corner).max() + np.abs(distance)
        blur = _ROUNDING * lengths / np.abs(direction @ unit)
        aside = (_ROUNDING * lengths + blur)[:, None] * np.linalg.norm([right, down], axis=1) / np.linalg.norm(across)
        beside = np.abs(place[:, :2] - 0.5) - 0.5
        may_be_on = (beside <= aside[:, ::-1]).all(axis=1) & (distance > -blur)
        is_on = (beside < -aside[:, ::-1]).all(axis=1) & (distance > blur)
        met, reach = np.isfinite(nearest), blur + np.where(np.isfinite(spread), spread, np.inf)
        is_before, is_behind = ~met | (distance + reach < nearest), met & (distance - reach > nearest)
        sine = np.linalg.norm(np.cross(normal, unit), axis=1)
        lies_along = met & (sine <= _PARALLEL * np.linalg.norm(normal, axis=1))
    stopped = is_on & ~is_behind & (is_before | lies_along)
    unsure = may_be_on & ~is_behind & ~stopped & (met | (distance <= blur))
    return np.where(stopped, distance, np.inf), unsure


def _solved(origin: Array, direction: Array, picture: Picture) -> tuple[Array, NDArray[np.intp]]:
    """Return (s, t, distance) of the rays that are not parallel to the picture's plane, and the numbers of those."""
    matrix = np.empty((len(origin), 3, 3))
    matrix[:, :, 0], matrix[:, :, 1], matrix[:, :, 2] = picture.right, picture.down, -direction
    solvable = np.flatnonzero(np.linalg.det(matrix))
    solved = np.linalg.solve(matrix[solvable], (origin[solvable] - picture.corner)[:, :, None])[:, :, 0]
    return np.asarray(solved, np.float64), solvable
