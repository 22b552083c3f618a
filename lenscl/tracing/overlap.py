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
        self._changes = np.zeros((channels, rows * (columns + 1)))
        self._changed = np.zeros((channels, rows))  # by how much in all, whichever way

    def spread(self, triangles: Array, carried: Array) -> None:
        """Spread light over triangles.

        Parameters
        ----------
        triangles : float64 array, shape (N, 3, 2)
            Corners (x, y): cell (row, column) is [column, column + 1) x [row, row + 1). Finite; either way round.
        carried : float64 array, shape (N, C)
            What each triangle carries.
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
        a, b, c = (triangles[:, corner] for corner in range(3))
        doubled = _cross(b - a, c - a)
        longest = np.maximum(_extent(triangles, 0), _extent(triangles, 1))
        is_thin = np.abs(doubled) <= 2 * _THIN * np.maximum(longest, 1.0)
        self.drop(_middles(triangles[is_thin]).reshape(-1, 2), np.repeat(carried[is_thin] / 16, 16, axis=0))

        triangles, density = triangles[~is_thin], 2 * carried[~is_thin] / doubled[~is_thin, np.newaxis]
        for some in _parts(triangles, self.rows, self.columns):
            part = triangles[some]
            starts, ends = part.reshape(-1, 2), part[:, [1, 2, 0]].reshape(-1, 2)
            self._add_edges(starts, ends, np.repeat(density[some], 3, axis=0))

    def drop(self, points: Array, carried: Array) -> None:
        """Put light, shape (N, C), on points (x, y), shape (N, 2): each within one cell, or beyond the grid."""
        x, y = points[:, 0], points[:, 1]
        inside = (x >= 0) & (x < self.columns) & (y >= 0) & (y < self.rows)
        cell = points[inside].astype(np.int64)
        at = cell[:, 1] * self.columns + cell[:, 0]
        for dropped, part in zip(self._dropped, carried[inside].T, strict=True):
            np.add.at(dropped, at, part)

    def filled(self) -> Array:
        """Return what the cells have got, shape (rows, columns, C).

        What the running sum may leave by rounding where there is nothing is taken for nothing. It goes by all changes
        in a row, whichever way, not by what is left of them: triangles of small area are dense.
        """
        changes = self._changes.reshape(-1, self.rows, self.columns + 1)
        spread = np.cumsum(changes, axis=-1)[..., : self.columns]
        spread[np.abs(spread) <= _ROUNDING * self._changed[..., np.newaxis]] = 0.0
        spread += self._dropped.reshape(spread.shape)
        return np.moveaxis(spread, 0, -1)

    def _add_edges(self, starts: Array, ends: Array, density: Array) -> None:
        """Add what edges change of a running sum along the rows."""
        rows = self.rows
        # Cut the edges at the rows' borders; turned upwards they count the other way
        is_down = ends[:, 1] >= starts[:, 1]
        down = np.where(is_down[:, np.newaxis], -density, density)
        low, high = (np.where(is_down[:, np.newaxis], *pair) for pair in ((starts, ends), (ends, starts)))
        first = np.clip(np.floor(low[:, 1]), 0, rows).astype(np.int64)
        last = np.clip(np.ceil(high[:, 1]), 0, rows).astype(np.int64)
        edge, row = _counted(first, last)
        slope = np.divide(
            high[:, 0] - low[:, 0], high[:, 1] - low[:, 1], where=high[:, 1] > low[:, 1], out=0 * low[:, 0]
        )
        top, bottom = np.maximum(low[edge, 1], row), np.minimum(high[edge, 1], row + 1)
        x_top, x_bottom = (low[edge, 0] + slope[edge] * (y - low[edge, 1]) for y in (top, bottom))
        # A triangle's edges meet in one point: apart by rounding, they would leave light in a cell beyond it
        x_bottom = np.where(high[edge, 1] <= row + 1, high[edge, 0], x_bottom)
        change = down[edge] * np.maximum(bottom - top, 0.0)[:, np.newaxis]
        self._add_pieces(row, x_top, x_bottom, change)

    def _add_pieces(self, row: NDArray[np.int64], x_top: Array, x_bottom: Array, change: Array) -> None:
        """Add what pieces of edges within a row each change, shape (N, C), once they are passed."""
        columns = self.columns
        # Cut each piece at the columns' borders; column -1 is all that is left of the grid, the last all that is right
        left, right = np.minimum(x_top, x_bottom), np.maximum(x_top, x_bottom)
        first = np.clip(np.floor(left), -1, columns).astype(np.int64)
        last = np.maximum(np.clip(np.ceil(right), 0, columns + 1).astype(np.int64), first + 1)
        piece, column = _counted(first, last)
        begin = np.where(column >= 0, np.maximum(left[piece], column), left[piece])
        stop = np.where(column < columns, np.minimum(right[piece], column + 1), right[piece])
        wide = right[piece] > left[piece]
        share = np.divide(stop - begin, right[piece] - left[piece], where=wide, out=np.ones(len(piece)))
        beyond = np.clip((begin + stop) / 2, 0, columns) - np.clip(column, 0, columns)  # of the way through its cell

        # What is right of the piece in its own cell, then the rest of it from the next one on
        is_in = column < columns
        piece, column, share, beyond = piece[is_in], column[is_in], share[is_in], beyond[is_in]
        at = row[piece] * (columns + 1) + np.maximum(column, 0)
        for changes, changed, whole in zip(self._changes, self._changed, change.T, strict=True):
            part = whole[piece] * share
            np.add.at(changes, at, part * (1 - beyond))
            np.add.at(changes, at + 1, part * beyond)
            changed += np.bincount(row, np.abs(whole), self.rows)


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
