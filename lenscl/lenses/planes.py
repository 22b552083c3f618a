"""Convex polyhedra as half spaces a x + b y + c z <= d: their rows for a search, and the box that holds the solid.

Input: the coefficients as expressions, and the values of the parameters. A row is divided by the largest of |a|, |b|
and |c|, so that errors of different planes can be compared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lenscl.expr import Expr, evaluate_together
from lenscl.lenses.solid import Box

Array = NDArray[np.float64]
Plane = tuple[Expr, Expr, Expr, Expr]

WORDS = 6  # numbers of a plane in a kernel: a, b, c, d, d - g and g, see `search_rows`
_ROUNDINGS = 8.0  # eps: of a x + b y + c z - d on a ray and of rounding a row; twice what a count of them gives
_INERT = (0.0, 0.0, 0.0, 1e30)  # a plane that holds everything
_PARALLEL = 1e-12  # sine of an angle: planes that are more alike have no edge that could be computed
_BLUR = 2.0**-48  # of the size: error of an edge's end, a dozen operations
_FLAT = 1e-12  # of the size: a solid that is thinner has no inside
_UNBOUNDED = "must enclose a solid, but it goes on without end in some direction; add a plane that ends it there"
_NOWHERE: Box = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def search_rows(planes: tuple[Plane, ...], values: Mapping[str, float], eps: float) -> tuple[Array, float]:
    """Return the numbers that kernels/search_planes.cl reads.

    Parameters
    ----------
    planes : tuple of (a, b, c, d)
        Expressions in the parameters.
    values : mapping of str to float
        The parameters.
    eps : float
        Of the precision of the search.

    Returns
    -------
    rows : float64 array, shape (N, 6)
        a, b, c, d, d - g and g, with max(|a|, |b|, |c|) = 1.
    share : float
        At p = o + t w, a computed a x + b y + c z - d is wrong by at most `share` times the sum of the sizes of the
        coordinates of o and of w, and g.
    """
    return _search_rows(planes, tuple(sorted(values.items())), eps)


@lru_cache(maxsize=64)  # as for `solid_of`
def _search_rows(planes: tuple[Plane, ...], items: tuple[tuple[str, float], ...], eps: float) -> tuple[Array, float]:
    table, errors = rows_of(planes, dict(items))
    slopes, constants = errors[:, :3].max(axis=1), errors[:, 3] + _ROUNDINGS * eps * np.abs(table[:, 3])
    nearest: dict[tuple[float, ...], int] = {}
    for i, row in enumerate(table):
        other = nearest.setdefault(tuple(row[:3]), i)
        if other == i:
            continue
        # Of planes that face the same way only the nearest bounds the solid: which of two it is never matters
        near, far = (i, other) if row[3] < table[other, 3] else (other, i)
        nearest[tuple(row[:3])] = near
        constants[near], slopes[near] = max(constants[near], constants[far]), max(slopes[near], slopes[far])
        table[far], constants[far], slopes[far] = _INERT, 0.0, 0.0
    rows = np.column_stack([table, table[:, 3] - constants, constants])
    rows.setflags(write=False)
    return rows, float(slopes.max()) + _ROUNDINGS * eps


def rows_of(planes: Sequence[Plane], values: Mapping[str, float]) -> tuple[Array, Array]:
    """Return rows a, b, c, d with max(|a|, |b|, |c|) = 1, and bounds on their errors, both of shape (N, 4).

    A plane without a normal keeps its d: where that is negative, no point lies in the half space.
    """
    made, errors = evaluate_together([each for plane in planes for each in plane], values, with_error=4 * len(planes))
    table = np.array(made, dtype=np.float64).reshape(-1, 4)
    error = np.array(errors, dtype=np.float64).reshape(-1, 4)
    size = np.abs(table[:, :3]).max(axis=1, keepdims=True)
    size = np.where(size > 0.0, size, 1.0)
    table, error = table / size, error / size
    return table, error + 2.0**-53 * np.abs(table)


@lru_cache(maxsize=64)  # a sweep of anything else asks for the same solid at every point
def solid_of(planes: tuple[Plane, ...], items: tuple[tuple[str, float], ...]) -> tuple[str, Box]:
    """Return what keeps planes from enclosing a solid, or an empty text and the solid's box.

    `items` are the parameters' names and values.
    """
    return enclosed(rows_of(planes, dict(items))[0])


def enclosed(table: Array) -> tuple[str, Box]:
    """Return what keeps rows a, b, c, d from enclosing a solid, or an empty text and the solid's box.

    Two planes have a line in common, which the others clip; what is left of it is an edge of the solid. The box holds
    the ends of all edges and the bounds on their errors.
    """
    empty = ~table[:, :3].any(axis=1)
    never = np.flatnonzero(empty & (table[:, 3] < 0.0))
    if never.size:
        return f"hold no solid: plane {never[0] + 1} has no normal, and 0 <= d is not true of its d", _NOWHERE
    unit = table[~empty] / np.linalg.norm(table[~empty, :3], axis=1, keepdims=True)
    normals, reach = unit[:, :3], unit[:, 3]
    if np.linalg.matrix_rank(normals, tol=_PARALLEL) < 3:
        return _UNBOUNDED, _NOWHERE
    foot, along, blur = _lines(normals, reach)
    low, high = np.full(len(along), -np.inf), np.full(len(along), np.inf)
    slope_low, slope_high = np.ones(len(along)), np.ones(len(along))
    for normal, d in zip(normals, reach, strict=True):
        slope, off = along @ normal, d - foot @ normal
        with np.errstate(divide="ignore", invalid="ignore"):
            t = off / slope
        ends, begins = (slope > _PARALLEL) & (t < high), (slope < -_PARALLEL) & (t > low)
        high, slope_high = np.where(ends, t, high), np.where(ends, slope, slope_high)
        low, slope_low = np.where(begins, t, low), np.where(begins, -slope, slope_low)
        apart = (np.abs(slope) <= _PARALLEL) & (off < -(blur + _BLUR * abs(d)))
        high = np.where(apart, -np.inf, high)
    edge = high > low
    if not edge.any():
        return "hold no solid: no point lies in all of them; turn all signs of a plane, or raise its d", _NOWHERE
    if not np.isfinite(high[edge] - low[edge]).all():
        return _UNBOUNDED, _NOWHERE
    corners, pads = [], []
    for t, slope in ((low[edge], slope_low[edge]), (high[edge], slope_high[edge])):
        corners.append(foot[edge] + t[:, None] * along[edge])
        pads.append((blur[edge] + _BLUR * np.abs(t) + (blur[edge] + _BLUR * np.abs(t)) / slope)[:, None])
    points, margin = np.concatenate(corners), np.concatenate(pads)
    lowest, highest = (points - margin).min(axis=0), (points + margin).max(axis=0)
    depth = float((reach - normals @ points.mean(axis=0)).min())
    if depth <= _FLAT * float((highest - lowest).max()):
        return "hold no solid: what lies in all of them is flat or a point; raise the d of a plane", _NOWHERE
    (x, y, z), (u, v, w) = lowest.tolist(), highest.tolist()
    return "", ((x, y, z), (u, v, w))


def _lines(normals: Array, reach: Array) -> tuple[Array, Array, Array]:
    """Return the lines of pairs of planes: the point nearest to the origin, the unit direction, the point's error."""
    first, second = np.triu_indices(len(normals), 1)
    along = np.cross(normals[first], normals[second])
    sine = np.linalg.norm(along, axis=1)
    some = sine > _PARALLEL
    first, second, along, sine = first[some], second[some], along[some] / sine[some, None], sine[some]
    across = reach[first, None] * normals[second] - reach[second, None] * normals[first]
    foot = np.cross(across, along) / sine[:, None]
    blur = _BLUR * (np.abs(reach[first]) + np.abs(reach[second])) / sine
    return foot, along, blur
