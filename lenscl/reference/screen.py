"""Twin of kernels/screen.cl: the picture's plane by a linear solve."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Picture
from lenscl.status import RayStatus

Array = NDArray[np.float64]

_FARTHEST = 1e30


def land(origin: Array, direction: Array, picture: Picture) -> tuple[Array, NDArray[np.uint8]]:
    """Return picture coordinates, shape (N, 2), and statuses, shape (N,), of rays on their last leg.

    Solves `corner + s right + t down = origin + distance direction` for each ray.
    """
    matrix = np.empty((len(origin), 3, 3))
    matrix[:, :, 0], matrix[:, :, 1], matrix[:, :, 2] = picture.right, picture.down, -direction
    st = np.full((len(origin), 2), -1.0)
    status = np.full(len(origin), RayStatus.BEHIND, dtype=np.uint8)
    solvable = np.flatnonzero(np.linalg.det(matrix))
    solved = np.linalg.solve(matrix[solvable], (origin[solvable] - picture.corner)[:, :, None])[:, :, 0]
    meets = (solved[:, 2] > 0) & np.all(np.abs(solved[:, :2]) <= _FARTHEST, axis=1)
    within = np.all((solved[:, :2] >= 0) & (solved[:, :2] < 1), axis=1)
    st[solvable[meets]] = solved[meets, :2]
    status[solvable[meets]] = np.where(within[meets], RayStatus.PICTURE, RayStatus.OFF_PICTURE)
    return st, status
