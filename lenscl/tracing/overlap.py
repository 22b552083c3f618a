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
_ROUNDING = 1e-11  # of the brightest cell: what the running sum may leave where there is nothing
_TOGETHER = 2**20  # pieces of edges in memory at a time, some hundred bytes each

Array = NDArray[np.float64]


def spread(triangles: Array, carried: Array, rows: int, columns: int) -> Array:
    """Return what the cells of a grid get, shape (rows, columns).

    Parameters
    ----------
    triangles : float64 array, shape (N, 3, 2)
        Corners (x, y): cell (row, column) is [column, column + 1) x [row, row + 1). Finite; either way round.
    carried : float64 array, shape (N,)
        What each triangle carries.
    rows, columns : int
    """
    reaches = np.ones(len(triangles), dtype=bool)
    for axis, size in enumerate((columns, rows)):
        a, b, c = (triangles[:, corner, axis] for corner in range(3))
        reaches &= (np.minimum(np.minimum(a, b), c) < size) & (np.maximum(np.maximum(a, b), c) >= 0)
    triangles, carried = triangles[reaches], carried[reaches]
    a, b, c = (triangles[:, corner] for corner in range(3))
    doubled = _cross(b - a, c - a)
    longest = np.maximum(_extent(triangles, 0), _extent(triangles, 1))
    is_thin = np.abs(doubled) <= 2 * _THIN * np.maximum(longest, 1.0)
    grid = drop(_middles(triangles[is_thin]).reshape(-1, 2), np.repeat(carried[is_thin] / 16, 16), rows, columns)

    triangles, density = triangles[~is_thin], 2 * carried[~is_thin] / doubled[~is_thin]
    changes = np.zeros(rows * (columns + 1))
    for some in _parts(triangles, rows, columns):
        part = triangles[some]
        starts, ends = part.reshape(-1, 2), part[:, [1, 2, 0]].reshape(-1, 2)
        changes += _edge_changes(starts, ends, np.repeat(density[some], 3), rows, columns)
    filled: Array = np.cumsum(changes.reshape(rows, columns + 1), axis=1)[:, :columns]
    return grid + np.where(np.abs(filled) > _ROUNDING * np.abs(filled).max(), filled, 0.0)


def drop(points: Array, carried: Array, rows: int, columns: int) -> Array:
    """Return what the cells of a grid get of points (x, y), shape (N, 2), each within one cell or beyond the grid."""
    x, y = points[:, 0], points[:, 1]
    inside = (x >= 0) & (x < columns) & (y >= 0) & (y < rows)
    cell = points[inside].astype(np.int64)
    numbers = cell[:, 1] * columns + cell[:, 0]
    got: Array = np.bincount(numbers, carried[inside], rows * columns).astype(np.float64)  # whole numbers of nothing
    return got.reshape(rows, columns)


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


def _edge_changes(starts: Array, ends: Array, density: Array, rows: int, columns: int) -> Array:
    """Return what edges change of a running sum along the rows, shape (rows (columns + 1),)."""
    # Cut the edges at the rows' borders; turned upwards they count the other way
    down = np.where(ends[:, 1] >= starts[:, 1], -density, density)
    low, high = (np.where((ends[:, 1] >= starts[:, 1])[:, None], *pair) for pair in ((starts, ends), (ends, starts)))
    first = np.clip(np.floor(low[:, 1]), 0, rows).astype(np.int64)
    last = np.clip(np.ceil(high[:, 1]), 0, rows).astype(np.int64)
    edge, row = _counted(first, last)
    slope = np.divide(high[:, 0] - low[:, 0], high[:, 1] - low[:, 1], where=high[:, 1] > low[:, 1], out=0 * low[:, 0])
    top, bottom = np.maximum(low[edge, 1], row), np.minimum(high[edge, 1], row + 1)
    x_top, x_bottom = (low[edge, 0] + slope[edge] * (y - low[edge, 1]) for y in (top, bottom))
    height = down[edge] * np.maximum(bottom - top, 0.0)

    # Cut each piece at the columns' borders; column -1 is all that is left of the grid, the last all that is right
    left, right = np.minimum(x_top, x_bottom), np.maximum(x_top, x_bottom)
    first = np.clip(np.floor(left), -1, columns).astype(np.int64)
    last = np.maximum(np.clip(np.ceil(right), 0, columns + 1).astype(np.int64), first + 1)
    piece, column = _counted(first, last)
    begin = np.where(column >= 0, np.maximum(left[piece], column), left[piece])
    stop = np.where(column < columns, np.minimum(right[piece], column + 1), right[piece])
    wide = right[piece] > left[piece]
    share = np.divide(stop - begin, right[piece] - left[piece], where=wide, out=np.ones(len(piece)))
    part = height[piece] * share
    beyond = np.clip((begin + stop) / 2, 0, columns) - np.clip(column, 0, columns)  # of the way through its cell

    # What is right of the piece in its own cell, then the rest of it from the next one on
    at = row[piece] * (columns + 1) + np.clip(column, 0, columns)
    size = rows * (columns + 1)
    is_in = column < columns
    changes: Array = np.bincount(at[is_in], (part * (1 - beyond))[is_in], size + 1).astype(np.float64)
    changes += np.bincount(at[is_in] + 1, (part * beyond)[is_in], size + 1)
    return changes[:size]


def _counted(first: NDArray[np.int64], last: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return each i as often as there are whole numbers in [first[i], last[i]), and those numbers."""
    count = np.maximum(last - first, 0)
    which = np.repeat(np.arange(len(count)), count)
    begins = np.cumsum(count) - count
    return which, np.arange(len(which)) - begins[which] + first[which]
