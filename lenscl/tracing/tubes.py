"""Tubes of rays: where the rays of their corners end, and how their light spreads over the picture's cells.

Input: the ends of traced rays, and the flux through each tube. Output: the light on every cell, and the light that ends
in each other way. Together they are all the light.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
from lenscl.status import RayStatus
from lenscl.tracing.overlap import Cells
from lenscl.tracing.raymap import BrightCells

LANDS = tuple(int(status) for status in RayStatus if status.lands)
# A tube's corners on a grid of corners: corner, right, down, far
CORNERS = (np.s_[..., :-1, :-1], np.s_[..., :-1, 1:], np.s_[..., 1:, :-1], np.s_[..., 1:, 1:])
_TRIANGLES = ([0, 1, 2], [1, 3, 2])  # of them
_PARTS = 3  # of a cell, each way, whose light is told apart: steps of a clipped edge fall below 48 of 255 codes
_EVEN_PARTS = 1e-3  # of the brightest part of a cell: parts that differ by less clip as their mean does, to half a code
_MOST_CELLS = 2**24  # of a picture whose cells have parts: they take nine times the memory
_TOGETHER = 2**20  # parts of cells at a time
_AGREES = 0.3  # of a triangle's light: by so much it may differ from what its corners gather, which else say nothing
_EVEN = 0.002  # of what corners gather: less shows no slope
_SHOWN = 0.25  # cells: a smaller triangle shows none
_FLAT = 0.02  # cells: nor does one so narrow

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TubeRays:
    """Ends of rays, shape (...): places in cells of the picture, and the shares that surfaces and insides let on.

    `left` is of shape (..., C): of red, green and blue where something absorbs, else all alike, and 1. `gathered` is,
    by the Jacobian, the light that a cell gets around the ray's place were nothing reflected or absorbed: negative
    where the map is turned over, infinite on a fold, of no meaning where the ray has no place.
    """

    place: Array
    status: NDArray[np.uint8]
    events: NDArray[np.uint8]
    refracted: Array
    left: Array  # of what was refracted
    gathered: Array

    @classmethod
    def of(cls, ends: Mapping[str, Any], scene: Scene, through: Array, *shape: int) -> TubeRays:
        """Return the ends that a trace yields, in another shape; what no effect weakens goes on as it is.

        `through`, shape (...), is the flux through the film where the rays pass it, by area in film pixels.
        """
        count = ends["status"].size
        refracted = ends["transmittance"].astype(np.float64).ravel() if "transmittance" in ends else np.ones(count)
        left = ends["transmission"].astype(np.float64) if "transmission" in ends else np.ones((count, 1))
        j = ends["jacobian"].astype(np.float64).reshape(count, 2, 2)
        area = (j[:, 0, 1] * j[:, 1, 0] - j[:, 0, 0] * j[:, 1, 1]) * scene.picture.columns * scene.picture.rows
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            gathered = through.ravel() / area
        return cls(
            place=ends["st"].astype(np.float64).reshape(*shape, 2) * scene.picture.size,
            status=ends["status"].reshape(shape),
            events=ends["events"].reshape(shape),
            refracted=refracted.reshape(shape),
            left=left.reshape(*shape, left.shape[-1]),
            gathered=gathered.reshape(shape),
        )

    @classmethod
    def joined(cls, parts: Sequence[TubeRays], axis: int = 0) -> TubeRays:
        """Return rays of several side by side."""
        return cls(*(np.concatenate([getattr(part, name) for part in parts], axis) for name in cls.__slots__))

    def some(self, which: Any) -> TubeRays:
        """Return some of the rays, by their first axes."""
        return TubeRays(*(getattr(self, name)[which] for name in self.__slots__))

    def shaped(self, *shape: int) -> TubeRays:
        """Return the rays in another shape."""
        return TubeRays(
            place=self.place.reshape(*shape, 2),
            status=self.status.reshape(shape),
            events=self.events.reshape(shape),
            refracted=self.refracted.reshape(shape),
            left=self.left.reshape(*shape, self.left.shape[-1]),
            gathered=self.gathered.reshape(shape),
        )

    def of_tubes(self) -> TubeRays:
        """Return the corners of all tubes, shape (N, 4), of rays that stand on grids (..., rows, columns)."""

        def corners(array: NDArray[Any]) -> NDArray[Any]:
            return np.stack([array[part].ravel() for part in CORNERS], axis=1)

        def each(arrays: Array) -> Array:
            return np.stack([corners(array) for array in np.moveaxis(arrays, -1, 0)], axis=-1)

        status, events, refracted, gathered = (
            corners(array) for array in (self.status, self.events, self.refracted, self.gathered)
        )
        return TubeRays(each(self.place), status, events, refracted, each(self.left), gathered)

    def is_torn(self) -> NDArray[np.bool_]:
        """Say of tubes' corners, shape (N, 4), whether their rays end otherwise, or meet other surfaces."""
        end = np.where(np.isin(self.status, LANDS), 0, 1 + self.status.astype(np.int32)) * 256 + self.events
        torn: NDArray[np.bool_] = (end[:, 0] != end[:, 1]) | (end[:, 0] != end[:, 2]) | (end[:, 0] != end[:, 3])
        return torn

    def is_seen(self, size: tuple[int, int], least: float) -> NDArray[np.bool_]:
        """Say which tubes, corners (N, 4), may put light on the picture, and are larger than so many cells there.

        By the boxes around their places; `size` is that of the picture in cells.
        """
        low, high = _extremes(self.place)
        found: NDArray[np.bool_] = np.maximum(*(high - low).T) > least
        for corner in range(4):
            found &= np.isin(self.status[:, corner], LANDS)
        for axis in (0, 1):
            found &= (low[:, axis] <= size[axis]) & (high[:, axis] >= 0.0)
        return found

    def is_varied(self, by: float) -> NDArray[np.bool_]:
        """Say at the corners of which tubes, (N, 4), surfaces or insides let on too unlike parts, shape (N,).

        Corners may differ by a part of their mean: in what surfaces let on, and in the way through what absorbs, which
        goes by the logarithm of what is left and so is the same in every colour.
        """
        way = -np.log(np.maximum(self.left, np.finfo(np.float64).tiny))
        found = np.zeros(len(self.status), dtype=bool)
        for each in (self.refracted, way.sum(axis=-1)):
            least, most = _extremes(each)
            found |= most - least > by * _mean(each)
        return found

    def is_uneven(self, flux: Array, by: float, least: float) -> NDArray[np.bool_]:
        """Say which tubes' light is not what their corners gather, by more than a part of it, shape (N,).

        What is off in a tube that is e < 1 cells wide shows only where it lies on a cell's border, as a part e does,
        and is of its cell's light a part e: so e^2 times as much.

        Parameters
        ----------
        flux : float64 array, shape (N, 2)
            Through both triangles of each.
        by : float
            Which part.
        least : float
            Light on a cell: of less than that, as of that.
        """
        found = np.zeros(len(flux), dtype=bool)
        for number, triangle in enumerate(_TRIANGLES):
            let = self.refracted[:, triangle]
            carried, area = flux[:, number] * _mean(let), _area(self.place[:, triangle])
            off = _off(self.gathered[:, triangle] * let, carried, area)
            low, high = _extremes(self.place[:, triangle])
            wide = np.minimum(np.maximum(*(high - low).T), 1.0)
            found |= ~(off * wide**2 <= by * (carried + least * np.abs(area)))
        return found


def _extremes(arrays: Array) -> tuple[Array, Array]:
    """Return the least and the largest along the second axis, which is short: numpy's own are slow there."""
    each = np.moveaxis(arrays, 1, 0)
    return reduce(np.minimum, each), reduce(np.maximum, each)


def _mean(arrays: Array, axis: int = 1) -> Array:
    each = list(np.moveaxis(arrays, axis, 0))
    mean: Array = sum(each[1:], each[0]) / len(each)
    return mean


def _area(triangles: Array) -> Array:
    a, b, c = (triangles[:, corner] for corner in range(3))
    area: Array = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
    return area


def _off(gathered: Array, carried: Array, area: Array) -> Array:
    """Return by how much triangles carry another light than what corners, shape (N, 3), gather; NaN on a fold."""
    with np.errstate(invalid="ignore", over="ignore"):
        least, most = _extremes(gathered)
        is_one = (least >= 0.0) | (most <= 0.0)
        off: Array = np.abs(_mean(gathered) * area - carried)
    off[~is_one] = np.nan
    return off


class Account:
    """What the picture's cells have got, where the rest of the light has gone, and records of what that took.

    Cells get light of each channel; what has gone elsewhere counts by the channels' weights, shape (C,).
    """

    def __init__(self, scene: Scene, weights: Array) -> None:
        columns, rows = scene.picture.size
        self.weights = weights
        self.side = parts_of_cells(scene)
        self.parts = Cells(self.side * rows, self.side * columns, len(weights))
        self.landed = 0.0  # on the picture or beside it
        self.not_excluded = 0.0  # through tubes whose light may end elsewhere
        self.bent = 0.0  # through other tubes, that lenses have bent
        self.records: list[Mapping[str, Any]] = []
        self.ends = dict.fromkeys((*(status.name.lower() for status in RayStatus), "reflected", "absorbed"), 0.0)

    def add_tubes(self, corners: TubeRays, flux: Array, is_told: NDArray[np.bool_] | None = None) -> None:
        """Spread the light of tubes, shape (N, 4); flux, shape (N, 2), is that of their triangles.

        `is_told`, shape (N,), marks those that `not_excluded` counts; without it, it counts none of them.
        """
        lands = np.isin(corners.status[:, 0], LANDS)
        is_straight = corners.events[:, 0] <= (corners.status[:, 0] == RayStatus.BLOCKED)
        self.bent += float(flux[~is_straight if is_told is None else ~is_straight & ~is_told].sum())
        for number, triangle in enumerate(_TRIANGLES):
            share = corners.refracted[:, triangle]
            let = share[..., np.newaxis] * corners.left[:, triangle]
            arrives = self._weigh(flux[:, number], _mean(share), _mean(let))
            self._end(corners.status[:, 0], lands, arrives)
            gathered = (corners.gathered[:, triangle] * share)[lands]
            through = (flux[:, number] * _mean(share))[lands]
            self._spread(
                corners.place[lands][:, triangle], arrives[lands], through, gathered, corners.left[lands][:, triangle]
            )

    def _spread(self, places: Array, carried: Array, through: Array, gathered: Array, left: Array) -> None:
        """Spread light, shape (N, C), over triangles by what their corners gather where that agrees with it.

        The corners gather so much, (N, 3), of what gets through in all, (N,), and leave so much of that, (N, 3, C).
        """
        area = _area(places)
        agrees = _off(gathered, through, area) <= _AGREES * through
        low, high = _extremes(places)
        wide = np.maximum(*(high - low).T)
        agrees &= (wide > _SHOWN) & (np.abs(area) > _FLAT * wide)
        with np.errstate(invalid="ignore"):
            arrives = np.abs(gathered)[..., np.newaxis] * left
            least, most = _extremes(arrives)
            agrees &= (most - least > _EVEN * (least + most)).any(axis=-1)
        self.parts.spread(self.side * places[~agrees], carried[~agrees])
        self.parts.spread(self.side * places[agrees], carried[agrees], arrives[agrees])

    def add_rays(self, rays: TubeRays, flux: Array) -> None:
        """Let the light of tubes, shape (N,), go where single rays go."""
        lands = np.isin(rays.status, LANDS)
        arrives = self._weigh(flux, rays.refracted, rays.refracted[:, np.newaxis] * rays.left)
        self._end(rays.status, lands, arrives)
        self.parts.drop(self.side * rays.place[lands], arrives[lands])

    def _weigh(self, flux: Array, refracted: Array, left: Array) -> Array:
        self.ends["reflected"] += float((flux * (1.0 - refracted)).sum())
        self.ends["absorbed"] += float((flux * (refracted - left @ self.weights)).sum())
        return flux[:, np.newaxis] * left

    def _end(self, status: NDArray[np.uint8], lands: NDArray[np.bool_], arrives: Array) -> None:
        weighed = arrives @ self.weights
        self.landed += float(weighed[lands].sum())
        for number, light in enumerate(np.bincount(status[~lands], weighed[~lands], len(RayStatus))):
            self.ends[RayStatus(number).name.lower()] += float(light)

    def close(self, direct: Array) -> tuple[Array, BrightCells]:
        """Return what the cells have got, and account for what has landed.

        Parameters
        ----------
        direct : float64 array, shape (H, W)
            What the source sends to each cell.

        Returns
        -------
        irradiance : float64 array, shape (H, W, C)
            Ratios to `direct`.
        bright : BrightCells
        """
        (rows, columns), side, channels = direct.shape, self.side, len(self.weights)
        irradiance, bright, got = np.empty((rows, columns, channels)), [], 0.0
        band = max(1, _TOGETHER // (side**2 * columns))
        for first, parts in zip(range(0, rows, band), self.parts.bands(side * band), strict=True):
            some = slice(first, first + band)
            each = parts.reshape(-1, side, columns, side, channels)
            got += float((parts @ self.weights).sum())
            irradiance[some] = each.sum(axis=(1, 3)) / direct[some, :, np.newaxis]
            each = np.moveaxis(each, 1, 2).reshape(-1, side**2, channels)
            each = each / (direct[some].reshape(-1, 1, 1) / side**2)
            most = each.max(axis=1)
            numbers = np.flatnonzero(((most > 1.0) & (most - each.min(axis=1) > _EVEN_PARTS * most)).any(axis=1))
            bright.append((numbers + first * columns, each[numbers].astype(np.float32)))
        self.ends["picture"] = got
        self.ends["off_picture"] = self.landed - got
        return irradiance, BrightCells(*(np.concatenate(arrays) for arrays in zip(*bright, strict=True)))


def parts_of_cells(scene: Scene) -> int:
    """Return into how many parts each way the cells of a scene's picture are divided where their light is bright."""
    return _PARTS if scene.picture.columns * scene.picture.rows <= _MOST_CELLS else 1
