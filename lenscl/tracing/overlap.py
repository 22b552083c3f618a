"""Spread light over a grid by the exact area that triangles share with its cells.

Input: triangles in the plane, in cells of the grid, and what each carries. Output: what every cell gets. A triangle
spreads what it carries evenly over its area; the part of it beyond the grid is left out.

The area to the right of an edge, cell by cell, is linear in the edges. So each edge of each triangle adds, for every
cell that it passes, what it changes from there on in that row; one running sum along the rows then gives the cells of
all triangles together. That is how outlines of letters are filled with exact coverage.

A triangle whose area is lost in rounding has no such density: it is cut into 16, and each puts its part where its
middle is.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

_THIN = 1e-6  # cells, times the longest side: below such an area, the running sum would lose more than a millionth
# Of all changes in a row: what their running sum may leave in the dark. Of lit pictures it left 0.02 eps, of up to
# 100,000 triangles of any shape 0.3
_ROUNDING = 4 * float(np.finfo(np.float64).eps)
_TOGETHER = 2**16  # pieces of edges at a time, some hundred bytes each: few enough to stay in caches

Array = NDArray[np.float64]


class Cells:
    """What the cells of a grid get, in one channel or more.

    The changes of all triangles are kept in one grid, of which a running sum is made once, at the end.

    Parameters
    ----------
    rows, columns : int
    channels : int
        C below.
    """

    def __init__(self, rows: int, columns: int, channels: int = 1) -> None:
        self.rows, self.columns = rows, columns
        self._dropped = np.zeros((channels, rows * columns))
        self._slopes: Array | None = None
        self._changes = np.zeros((channels, rows * (columns + 1)))
        self._changed = np.zeros((channels, rows))  # by how much in all, whichever way

    def spread(self, triangles: Array, carried: Array, gathered: Array | None = None) -> None:
        """Spread light over triangles: evenly, or with a density that is linear over each.

        Parameters
        ----------
        triangles : float64 array, shape (N, 3, 2)
            Corners (x, y): cell (row, column) is [column, column + 1) x [row, row + 1). Finite; either way round.
        carried : float64 array, shape (N, C)
            What each triangle carries.
        gathered : float64 array, shape (N, 3, C), optional
            In which proportion the densities at its corners are; not negative. All 0 is even.
        """
        # What lies within one cell needs no area
        reaches, is_within = np.ones((2, len(triangles)), dtype=bool)
        for axis, size in enumerate((self.columns, self.rows)):
            a, b, c = (triangles[:, corner, axis] for corner in range(3))
            least, most = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
            reaches &= (least < size) & (most >= 0)
            is_within &= np.floor(least) == np.floor(most)
        self.drop(triangles[is_within, 0], carried[is_within])
        reaches &= ~is_within
        triangles, carried = triangles[reaches], carried[reaches]
        gathered = None if gathered is None else gathered[reaches]
        a, b, c = (triangles[:, corner] for corner in range(3))
        doubled = _cross(b - a, c - a)
        longest = np.maximum(_extent(triangles, 0), _extent(triangles, 1))
        is_thin = np.abs(doubled) <= 2 * _THIN * np.maximum(longest, 1.0)
        self.drop(_middles(triangles[is_thin]).reshape(-1, 2), np.repeat(carried[is_thin] / 16, 16, axis=0))

        triangles, density = triangles[~is_thin], 2 * carried[~is_thin] / doubled[~is_thin, np.newaxis]
        for some in _parts(triangles, self.rows, self.columns):
            part = triangles[some]
            starts, ends = part.reshape(-1, 2), part[:, [1, 2, 0]].reshape(-1, 2)
            if gathered is None:
                self._add_edges(starts, ends, np.repeat(density[some], 3, axis=0))
            else:
                planes = _planes(part, density[some], gathered[~is_thin][some], (self.columns / 2, 0.0))
                self._add_sloped_edges(starts, ends, np.repeat(planes, 3, axis=0))

    def drop(self, points: Array, carried: Array) -> None:
        """Put light, shape (N, C), on points (x, y), shape (N, 2): each within one cell, or beyond the grid."""
        x, y = points[:, 0], points[:, 1]
        inside = (x >= 0) & (x < self.columns) & (y >= 0) & (y < self.rows)
        cell = points[inside].astype(np.int64)
        at = cell[:, 1] * self.columns + cell[:, 0]
        for dropped, part in zip(self._dropped, carried[inside].T, strict=True):
            np.add.at(dropped, at, part)

    def filled(self) -> Array:
        """Return what the cells have got, shape (rows, columns, C)."""
        return next(self.bands(self.rows))

    def bands(self, rows: int) -> Iterator[Array]:
        """Yield what the cells have got, so many rows at a time, shape (rows or fewer, columns, C).

        What the running sum may leave by rounding where there is nothing is taken for nothing. It goes by all changes
        in a row, whichever way, not by what is left of them: triangles of small area are dense.
        """
        changes = self._changes.reshape(-1, self.rows, self.columns + 1)
        slopes = None if self._slopes is None else self._slopes.reshape(changes.shape)
        dropped = self._dropped.reshape(-1, self.rows, self.columns)
        for first in range(0, self.rows, rows):
            some = np.s_[:, first : first + rows]
            spread = np.cumsum(changes[some], axis=-1)[..., : self.columns]
            if slopes is not None:
                rise = np.cumsum(slopes[some], axis=-1)[..., : self.columns]
                spread += rise * (np.arange(self.columns) + 0.5 - self.columns / 2)
            spread[np.abs(spread) <= _ROUNDING * self._changed[some][..., np.newaxis]] = 0.0
            yield np.moveaxis(spread + dropped[some], 0, -1)

    def _add_edges(self, starts: Array, ends: Array, density: Array) -> None:
        """Add what edges change of a running sum along the rows."""
        edge, row, left, right, down = self._in_rows(starts, ends)
        piece, column, begin, stop = self._in_columns(left, right)
        change = density[edge] * down[:, np.newaxis]
        share = _share(begin[:, 0], stop[:, 0], left[piece, 0], right[piece, 0])
        beyond = np.clip((begin[:, 0] + stop[:, 0]) / 2, 0, self.columns) - np.clip(column, 0, None)  # through its cell

        # What is right of the piece in its own cell, then the rest of it from the next one on
        at = row[piece] * (self.columns + 1) + np.maximum(column, 0)
        for changes, changed, whole in zip(self._changes, self._changed, change.T, strict=True):
            part = whole[piece] * share
            np.add.at(changes, at, part * (1 - beyond))
            np.add.at(changes, at + 1, part * beyond)
            changed += np.bincount(row, np.abs(whole), self.rows)

    def _add_sloped_edges(self, starts: Array, ends: Array, planes: Array) -> None:
        """Add what edges change of running sums where density is linear.

        planes, shape (N, C, 3): of each edge's triangle, the density in the middle of the columns at y = 0, and by how
        much it rises along x and y. A cell to the right of an edge gets its height times the density at the middles of
        both, which rises from cell to cell: that is the second running sum. In its own cell an edge has L on its right
        and density R at the cell's border, both linear along it; with g the rise, L (R - g L / 2) is integrated, where
        the mean of a product of such is that of their means and a twelfth of the product of their changes.
        """
        if self._slopes is None:
            self._slopes = np.zeros_like(self._changes)
        edge, row, left, right, down = self._in_rows(starts, ends)
        piece, column, begin, stop = self._in_columns(left, right)
        at, middle = row[piece] * (self.columns + 1) + np.maximum(column, 0), self.columns / 2
        height = down[piece] * _share(begin[:, 0], stop[:, 0], left[piece, 0], right[piece, 0])
        is_in = column >= 0  # else all cells are right of it
        border = np.maximum(column, -1) + 1.0
        room, narrower = border - (begin[:, 0] + stop[:, 0]) / 2, begin[:, 0] - stop[:, 0]
        y, lower = (begin[:, 1] + stop[:, 1]) / 2, stop[:, 1] - begin[:, 1]
        for channel, (changes, slopes, changed) in enumerate(
            zip(self._changes, self._slopes, self._changed, strict=True)
        ):
            level, along, downwards = planes[edge[piece], channel].T
            beside = level + downwards * y  # in the middle of the columns
            at_border = beside + along * (border - middle)
            own = room * at_border + narrower * downwards * lower / 12 - along / 2 * (room**2 + narrower**2 / 12)
            own = np.where(is_in, own, beside)
            np.add.at(changes, at, height * own)
            np.add.at(changes, at + 1, height * (beside - own))
            np.add.at(slopes, at + is_in, height * along)
            changed += np.bincount(row[piece], np.abs(height) * (np.abs(beside) + np.abs(along) * middle), self.rows)

    def _in_rows(self, starts: Array, ends: Array) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, Array, Array]:
        """Cut edges at the rows' borders.

        Returns
        -------
        edge, row : int array, shape (M,)
            Of each piece.
        left, right : float64 array, shape (M, 2)
            Its ends.
        down : float64 array, shape (M,)
            By how much it goes down, negative; turned upwards it counts the other way.
        """
        is_down = ends[:, 1] >= starts[:, 1]
        low, high = (np.where(is_down[:, np.newaxis], *pair) for pair in ((starts, ends), (ends, starts)))
        first = np.clip(np.floor(low[:, 1]), 0, self.rows).astype(np.int64)
        last = np.clip(np.ceil(high[:, 1]), 0, self.rows).astype(np.int64)
        edge, row = _counted(first, last)
        slope = np.divide(
            high[:, 0] - low[:, 0], high[:, 1] - low[:, 1], where=high[:, 1] > low[:, 1], out=0 * low[:, 0]
        )
        top, bottom = np.maximum(low[edge, 1], row), np.minimum(high[edge, 1], row + 1)
        x_top, x_bottom = (low[edge, 0] + slope[edge] * (y - low[edge, 1]) for y in (top, bottom))
        # A triangle's edges meet in one point: apart by rounding, they would leave light in a cell beyond it
        x_bottom = np.where(high[edge, 1] <= row + 1, high[edge, 0], x_bottom)
        down = np.where(is_down[edge], -1.0, 1.0) * np.maximum(bottom - top, 0.0)
        ends_of = np.stack([x_top, top], axis=1), np.stack([x_bottom, bottom], axis=1)
        falls = (x_top <= x_bottom)[:, np.newaxis]
        return edge, row, np.where(falls, *ends_of), np.where(falls, *ends_of[::-1]), down

    def _in_columns(self, left: Array, right: Array) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, Array]:
        """Cut pieces of edges, by their ends, at the columns' borders: which piece, column, and its ends there.

        Column -1 is all that is left of the grid; what is right of it is left out.
        """
        columns = self.columns
        first = np.clip(np.floor(left[:, 0]), -1, columns).astype(np.int64)
        last = np.maximum(np.clip(np.ceil(right[:, 0]), 0, columns).astype(np.int64), first + 1)
        piece, column = _counted(first, np.minimum(last, columns))
        start, end = left[piece], right[piece]
        wide = end[:, 0] - start[:, 0]
        slope = np.divide(end[:, 1] - start[:, 1], wide, where=wide > 0, out=np.zeros(len(wide)))
        is_cut_left, is_cut_right = (column >= 0) & (start[:, 0] < column), end[:, 0] > column + 1
        x_begin = np.where(is_cut_left, column, start[:, 0])
        x_stop = np.where(is_cut_right, column + 1, end[:, 0])
        y_begin = np.where(is_cut_left, start[:, 1] + slope * (x_begin - start[:, 0]), start[:, 1])
        y_stop = np.where(is_cut_right, start[:, 1] + slope * (x_stop - start[:, 0]), end[:, 1])
        return piece, column, np.stack([x_begin, y_begin], axis=1), np.stack([x_stop, y_stop], axis=1)


def _share(begin: Array, stop: Array, left: Array, right: Array) -> Array:
    """Return which part of its width a piece has between two places; all of it where it has none."""
    share: Array = np.divide(stop - begin, right - left, where=right > left, out=np.ones(len(begin)))
    return share


def _planes(triangles: Array, density: Array, gathered: Array, origin: tuple[float, float]) -> Array:
    """Return linear densities, shape (N, C, 3): at an origin, and by how much they rise along x and y.

    `density`, shape (N, C), is their mean, signed as the triangle turns; `gathered`, shape (N, 3, C), their proportion.
    """
    mean = gathered.mean(axis=1, keepdims=True)
    at_corners = density[:, np.newaxis] * np.where(mean > 0, gathered / np.where(mean > 0, mean, 1.0), 1.0)
    a, b, c = (triangles[:, corner] for corner in range(3))
    (over, under), doubled = (b - a, c - a), _cross(b - a, c - a)
    more = at_corners[:, 1:] - at_corners[:, :1]
    along = (more[:, 0] * under[:, 1:] - more[:, 1] * over[:, 1:]) / doubled[:, np.newaxis]
    down = (more[:, 1] * over[:, :1] - more[:, 0] * under[:, :1]) / doubled[:, np.newaxis]
    level = at_corners[:, 0] + along * (origin[0] - a[:, :1]) + down * (origin[1] - a[:, 1:])
    return np.stack([level, along, down], axis=-1)


def _cross(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _extent(triangles: Array, axis: int) -> Array:
    a, b, c = (triangles[:, corner, axis] for corner in range(3))
    extent: Array = np.maximum(np.maximum(a, b), c) - np.minimum(np.minimum(a, b), c)
    return extent


def _middles(triangles: Array) -> Array:
    """Return the middles of the 16 equal triangles that each consists of, shape (N, 16, 2)."""
    for _ in range(2):
        between = (triangles + np.roll(triangles, -1, axis=1)) / 2
        corners = np.stack([triangles, between, np.roll(between, 1, axis=1)], axis=2)  # one at each corner
        triangles = np.concatenate([corners, between[:, None]], axis=1).reshape(-1, 3, 2)
    middles: Array = triangles.mean(axis=1)
    return middles.reshape(-1, 16, 2)


def _parts(triangles: Array, rows: int, columns: int) -> Iterator[slice]:
    """Yield the triangles in parts that come to about as many pieces of edges each."""
    held = np.clip(triangles, 0, (columns, rows))
    span = _extent(held, 0) + _extent(held, 1)
    pieces = np.cumsum(3 * (span + 3))
    cuts = np.searchsorted(pieces, np.arange(_TOGETHER, pieces[-1] if len(pieces) else 0, _TOGETHER))
    yield from (slice(*ends) for ends in pairwise(np.unique([0, *cuts, len(triangles)]).tolist()))


def _counted(first: NDArray[np.int64], last: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return each i as often as there are whole numbers in [first[i], last[i]), and those numbers."""
    count = np.maximum(last - first, 0)
    which = np.repeat(np.arange(len(count)), count)
    begins = np.cumsum(count) - count
    return which, np.arange(len(which)) - begins[which] + first[which]
