"""Where a lens's surface has no normal: points at which every direction, or none, is that of the gradient.

Boxes are parted in eight again and again, and those kept on which F may be zero and one of its faces may have a
gradient that is zero or not defined, by interval arithmetic. What is left comes in groups about such points, if there
are any; each is looked at closely, and a point counts where F may be zero within four millionths of the lens and
normals at that distance disagree. Where they agree the gradient is merely small, and where F is not zero the surface
passes by.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lenscl.codegen import faces_of
from lenscl.config import Lens
from lenscl.expr import Expr, differentiate, gradient
from lenscl.lenses import Box
from lenscl.sweep.boxes import Array, Points, Values, enclosed, may_be_zero, most_boxes, parted, value_at, vectors_at

Mask = NDArray[np.bool_]

_LEVELS = 12  # halvings of the lens
_NEAR = 2.0**-18  # of the lens: how close to a point its normals are looked at
_SMALL = 2.0**-3  # of the lens: a group of boxes that is longer may hold several points, or a line
_MOST_POINTS = 200
_STARTS = 512  # of Newton's method, in a group; a point has some fifty boxes about it
_FLAT = 1e-290  # a Hessian so small has no inverse that a number can hold
_NEWTONS = 12
_ZOOMS = 20
_DISAGREE = 0.02  # between unit normals: on a smooth surface they differ by the distance over its radius
_AROUND = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, 5)] * 3), axis=-1).reshape(-1, 3)


def singular_points(lens: Lens) -> Points:
    """Return the points of a lens's surface that have no normal, in its own space; not those of lines and sheets.

    A catalogue solid's edges are none: they are taken apart into faces, each of which has its own normal there.
    """
    box = lens.surface.box(lens.values)
    leaves = tuple(faces_of(lens.surface)[1])
    return _singular(lens.surface.expression, leaves, tuple(sorted(lens.values.items())), box)


@lru_cache(maxsize=1024)  # a sweep of anything else asks for the same solid at every point
def _singular(expression: Expr, leaves: tuple[Expr, ...], values: tuple[tuple[str, float], ...], box: Box) -> Points:
    given, size = dict(values), np.subtract(box[1], box[0])
    most = most_boxes(expression)
    slopes = [gradient(leaf) for leaf in leaves]
    side, lows = size, np.array([box[0]], dtype=np.float64)
    which = np.ones((1, len(leaves)), dtype=np.bool_)
    for _ in range(_LEVELS):
        side = 0.5 * side
        lows = parted(lows, side)
        which = np.repeat(which, len(lows) // len(which), axis=0) & may_be_zero(expression, given, lows, side)[:, None]
        for k, leaf in enumerate(leaves):
            asked = np.flatnonzero(which[:, k])
            asked = asked[may_be_zero(leaf, given, lows[asked], side)] if len(leaves) > 1 else asked
            which[:, k] = False
            which[asked[_may_lack_normal(slopes[k], given, lows[asked], side)], k] = True
        kept = which.any(axis=1)
        lows, which = lows[kept], which[kept]
        if not len(lows):
            return ()
        if len(lows) > most:
            break
    found: list[Array] = []
    for k in range(len(leaves)):
        for boxes in _groups(lows[which[:, k]] + 0.5 * side, side):
            for point in _candidates(expression, slopes[k], given, boxes, side, size):
                is_new = all((np.abs(point - other) > 2.0 * _NEAR * size).any() for other in found)
                if is_new and _normals_disagree(slopes[k], given, point, _NEAR * size):
                    found.append(point)
    return tuple(sorted((float(x), float(y), float(z)) for x, y, z in found))


def _may_lack_normal(slopes: tuple[Expr, ...], given: Values, lows: Array, side: Array) -> Mask:
    """Whether all of the slopes may be zero on boxes, or any of them has no bound there."""
    zero, unbounded = np.ones(len(lows), dtype=np.bool_), np.zeros(len(lows), dtype=np.bool_)
    for slope in slopes:
        low, high = enclosed(slope, given, lows, side)
        zero &= (low <= 0.0) & (high >= 0.0)
        unbounded |= np.isinf(low) | np.isinf(high)
    return zero | unbounded


def _groups(centres: Array, side: Array) -> Iterator[Array]:
    """Yield the centres of each group of boxes that are neighbours, or nearly so."""
    left = centres
    while len(left):
        group = np.arange(len(left)) == 0
        while True:
            low, high = left[group].min(axis=0), left[group].max(axis=0)
            wider = ((left >= low - 1.5 * side) & (left <= high + 1.5 * side)).all(axis=1)
            if (wider == group).all():
                break
            group = wider
        yield left[group]
        left = left[~group]


def _candidates(
    expression: Expr, slopes: tuple[Expr, ...], given: Values, boxes: Array, side: Array, size: Array
) -> Array:
    """Return points of a group, shape (N, 3), at which the surface may lack a normal.

    A small group holds one at most. A large one may hold several, at zeros of the gradient; more than a few of them
    make a line or a sheet, and none counts.
    """
    reach = 0.5 * (np.ptp(boxes, axis=0) + side)
    middle = boxes.min(axis=0) + reach - 0.5 * side
    if (reach <= _SMALL * size).all():
        points = _least_gradient(expression, slopes, given, middle, reach)[None]
    else:
        starts = boxes[:: -(-len(boxes) // min(_STARTS, most_boxes(expression)))]
        points = _zero_gradients(slopes, given, starts, _NEAR * size)
        points = points[(np.abs(points - middle) <= reach).all(axis=1)]
    near = _NEAR * size
    points = points[may_be_zero(expression, given, points - near, 2.0 * near)]
    _, first = np.unique(np.round(points / near), axis=0, return_index=True)
    return points[first] if len(first) <= _MOST_POINTS else points[:0]


def _zero_gradients(slopes: tuple[Expr, ...], given: Values, points: Array, near: Array) -> Array:
    """Return where Newton's method comes to rest from points; it does not where the gradient is not smooth."""
    steps = np.full_like(points, np.inf)
    seconds = [(i, j, differentiate(slopes[i], "xyz"[j])) for i in range(3) for j in range(i, 3)]
    for _ in range(_NEWTONS):
        hessian = np.empty((len(points), 3, 3))
        for i, j, second in seconds:
            hessian[:, i, j] = hessian[:, j, i] = value_at(second, given, points)
        vectors = vectors_at(slopes, given, points)
        scale = np.abs(hessian).max(axis=(1, 2), initial=0.0)
        usable = np.isfinite(scale) & (scale > _FLAT) & np.isfinite(vectors).all(axis=1)
        points, vectors = points[usable], vectors[usable]
        steps = (np.linalg.pinv(hessian[usable]) @ vectors[..., None])[..., 0]
        points = points - steps
    return points[(np.abs(steps) <= near).all(axis=1)]


def _least_gradient(expression: Expr, slopes: tuple[Expr, ...], given: Values, middle: Array, reach: Array) -> Array:
    """Return where about the middle of a group the gradient is least.

    Where it is not defined at the middle, it is not on a line or a sheet through it: then where F is least on that.
    """
    point, step, centre = middle, reach, len(_AROUND) // 2
    for _ in range(_ZOOMS):
        places = point + _AROUND * step
        length = np.linalg.norm(vectors_at(slopes, given, places), axis=1)
        defined = np.isfinite(length)
        if defined[centre]:
            least = int(np.argmin(np.where(defined, length, np.inf)))
            moves = length[least] < 0.75 * length[centre]
        else:
            value = np.abs(value_at(expression, given, places))
            least = int(np.argmin(np.where(defined | np.isnan(value), np.inf, value)))
            moves = True
        point = places[least] if moves else point
        step = 0.5 * step
    return point


def _normals_disagree(slopes: tuple[Expr, ...], given: Values, point: Array, near: Array) -> bool:
    vectors = vectors_at(slopes, given, point + near * _AROUND)
    with np.errstate(all="ignore"):
        normals = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    normals = normals[np.isfinite(normals).all(axis=1)]
    return len(normals) < len(_AROUND) // 2 or float(np.ptp(normals, axis=0).max()) > _DISAGREE
