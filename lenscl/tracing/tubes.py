"""Tubes of rays: where their corners' rays go, and what the picture's cells get of the light in them.

Input: the ends that a trace yields, and the flux through each tube. Output: what every cell has got, and where the rest
has gone, so that all light is accounted for.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
from lenscl.status import RayStatus
from lenscl.tracing.overlap import Cells

LANDS = tuple(int(status) for status in RayStatus if status.lands)
# A tube's corners on a grid of corners: corner, right, down, far
CORNERS = (np.s_[..., :-1, :-1], np.s_[..., :-1, 1:], np.s_[..., 1:, :-1], np.s_[..., 1:, 1:])
_TRIANGLES = ([0, 1, 2], [1, 3, 2])  # of them

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TubeRays:
    """Ends of rays, shape (...): places in cells of the picture, and the shares that surfaces and insides let on.

    `left` is of shape (..., C): of red, green and blue where something absorbs, else all alike, and 1.
    """

    place: Array
    status: NDArray[np.uint8]
    events: NDArray[np.uint8]
    refracted: Array
    left: Array  # of what was refracted

    @classmethod
    def of(cls, ends: Mapping[str, Any], scene: Scene, *shape: int) -> TubeRays:
        """Return the ends that a trace yields, in another shape; what no effect weakens goes on as it is."""
        count = ends["status"].size
        refracted = ends["transmittance"].astype(np.float64).ravel() if "transmittance" in ends else np.ones(count)
        left = ends["transmission"].astype(np.float64) if "transmission" in ends else np.ones((count, 1))
        return cls(
            place=ends["st"].astype(np.float64).reshape(*shape, 2) * scene.picture.size,
            status=ends["status"].reshape(shape),
            events=ends["events"].reshape(shape),
            refracted=refracted.reshape(shape),
            left=left.reshape(*shape, -1),
        )

    def rows(self, first: int, last: int) -> TubeRays:
        """Return the rays of some rows of a grid."""
        some = slice(first, last)
        return TubeRays(self.place[some], self.status[some], self.events[some], self.refracted[some], self.left[some])

    def of_tubes(self, which: NDArray[np.bool_]) -> TubeRays:
        """Return the corners of some tubes, shape (N, 4), of rays that stand at corners on grids (..., rows, columns).

        `which`, shape (..., rows - 1, columns - 1), says of which.
        """

        def corners(array: NDArray[Any]) -> NDArray[Any]:
            return np.stack([array[part][which] for part in CORNERS], axis=1)

        def each(arrays: Array) -> Array:
            return np.stack([corners(array) for array in np.moveaxis(arrays, -1, 0)], axis=-1)

        status, events, refracted = (corners(array) for array in (self.status, self.events, self.refracted))
        return TubeRays(each(self.place), status, events, refracted, each(self.left))


class Account:
    """What the picture's cells have got, where the rest of the light has gone, and records of what that took.

    Cells get light of each channel; what has gone elsewhere counts by the channels' weights, shape (C,).
    """

    def __init__(self, scene: Scene, weights: Array) -> None:
        columns, rows = scene.picture.size
        self.weights = weights
        self.cells = Cells(rows, columns, len(weights))
        self.landed = 0.0  # on the picture or beside it
        self.records: list[Mapping[str, Any]] = []
        self.ends = dict.fromkeys((*(status.name.lower() for status in RayStatus), "reflected", "absorbed"), 0.0)

    def add_tubes(self, corners: TubeRays, flux: Array) -> None:
        """Spread the light of tubes, shape (N, 4); flux, shape (N, 2), is that of their triangles."""
        lands = np.isin(corners.status[:, 0], LANDS)
        for number, triangle in enumerate(_TRIANGLES):
            share = corners.refracted[:, triangle]
            left = (share[..., np.newaxis] * corners.left[:, triangle]).mean(axis=1)
            arrives = self._weigh(flux[:, number], share.mean(axis=1), left)
            self._end(corners.status[:, 0], lands, arrives)
            self.cells.spread(corners.place[lands][:, triangle], arrives[lands])

    def add_rays(self, rays: TubeRays, flux: Array) -> None:
        """Let the light of tubes, shape (N,), go where single rays go."""
        lands = np.isin(rays.status, LANDS)
        arrives = self._weigh(flux, rays.refracted, rays.refracted[:, np.newaxis] * rays.left)
        self._end(rays.status, lands, arrives)
        self.cells.drop(rays.place[lands], arrives[lands])

    def _weigh(self, flux: Array, refracted: Array, left: Array) -> Array:
        self.ends["reflected"] += float((flux * (1.0 - refracted)).sum())
        self.ends["absorbed"] += float((flux * (refracted - left @ self.weights)).sum())
        return flux[:, np.newaxis] * left

    def _end(self, status: NDArray[np.uint8], lands: NDArray[np.bool_], arrives: Array) -> None:
        weighed = arrives @ self.weights
        self.landed += float(weighed[lands].sum())
        for number, light in enumerate(np.bincount(status[~lands], weighed[~lands], len(RayStatus))):
            self.ends[RayStatus(number).name.lower()] += float(light)

    def close(self) -> Array:
        """Return what the cells have got, shape (H, W, C), and account for what has landed."""
        filled = self.cells.filled()
        self.ends["picture"] = float((filled @ self.weights).sum())
        self.ends["off_picture"] = self.landed - self.ends["picture"]
        return filled
