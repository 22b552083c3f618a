"""Where a face of a lens bends sharply: creases of abs, min, max and where inside a function, which stay in one face.

An edge between faces is none: the search takes max and min apart into faces, each with its own normal. Where a crease
is inside a function or a product it cannot, and the face has two normals along it. From small boxes that may hold both
the surface and a change of branch Newton's method goes to where both are, and such a point counts where the normals
close by on its two sides differ.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lenscl.codegen import faces_of
from lenscl.config import Lens
from lenscl.expr import Expr, gradient
from lenscl.expr.graph import walk
from lenscl.lenses import Box
from lenscl.sweep.boxes import Array, Points, Values, may_be_zero, most_boxes, parted, value_at, vectors_at

_LEVELS = 7  # halvings of the lens
_STARTS = 256  # of Newton's method, for each branch
_NEWTONS = 10
_FARTHEST = 2.0  # boxes that Newton's method may go
_ON = 1e-9  # of the lens: how near to the surface it has to come
_CLOSE = 2.0**-30  # of the lens: how far from a crease its two sides are looked at
_SHARP = 1e-3  # between unit normals of the two sides; on a smooth surface they differ by that distance over its radius


def crease_points(lens: Lens) -> Points:
    """Return points along the creases of a lens's faces, in its own space, some of each."""
    leaves = tuple(leaf for leaf in faces_of(lens.surface)[1] if _branches(leaf))
    if not leaves:
        return ()
    return _creases(lens.surface.expression, leaves, tuple(sorted(lens.values.items())), lens.surface.box(lens.values))


def _branches(leaf: Expr) -> list[Expr]:
    """Return what changes its sign where the leaf changes branch."""
    found: dict[Expr, None] = {}
    for each in walk([leaf]):
        if each.op == "abs":
            found[each.args[0]] = None
        elif each.op in ("min", "max", "where"):
            found[each.args[0] - each.args[1]] = None
        elif each.op == "norm":  # with p = 1 or little more
            found |= dict.fromkeys(arg for arg in each.args[:2] if arg.op != "norm")
    return [branch for branch in found if branch.depends_on("xyz")]


@lru_cache(maxsize=1024)  # a sweep of anything else asks for the same solid at every point
def _creases(expression: Expr, leaves: tuple[Expr, ...], values: tuple[tuple[str, float], ...], box: Box) -> Points:
    given, size = dict(values), np.subtract(box[1], box[0])
    most = most_boxes(expression)
    side, lows = size, np.array([box[0]], dtype=np.float64)
    for _ in range(_LEVELS):
        side = 0.5 * side
        lows = parted(lows, side)
        lows = lows[may_be_zero(expression, given, lows, side)]
        if len(lows) > most:
            break
    found = [np.zeros((0, 3))]
    for leaf in leaves:
        of_leaf = lows[may_be_zero(leaf, given, lows, side)]
        for branch in _branches(leaf):
            boxes = of_leaf[may_be_zero(branch, given, of_leaf, side)]
            boxes = boxes[:: max(1, len(boxes) // _STARTS)]
            points, across = _where_both_are_zero(leaf, branch, given, boxes + 0.5 * side, side)
            found.append(points[_is_sharp(expression, leaf, given, points, across, float(size.max()))])
    points = np.concatenate(found)
    _, first = np.unique(np.round(points / (_ON * size.max())), axis=0, return_index=True)
    return tuple((float(x), float(y), float(z)) for x, y, z in points[first])


def _is_sharp(
    expression: Expr, leaf: Expr, given: Values, points: Array, across: Array, size: float
) -> NDArray[np.bool_]:
    """Whether points are on the surface, and the normals beside them differ."""
    slopes, close = gradient(leaf), _CLOSE * size * across
    sides = (vectors_at(slopes, given, points + way) for way in (-close, close))
    with np.errstate(all="ignore"):
        lengths, normals = zip(*(_units(vectors) for vectors in sides), strict=True)
        sharp = np.linalg.norm(normals[0] - normals[1], axis=1) > _SHARP
        on = np.abs(value_at(expression, given, points)) <= _ON * size * np.maximum(*lengths)
    return np.asarray(sharp & on)


def _where_both_are_zero(leaf: Expr, branch: Expr, given: Values, start: Array, side: Array) -> tuple[Array, Array]:
    """Return points, shape (N, 3), where Newton's method finds both zero near a start, and the branch's unit slopes."""
    points, slopes = start, (gradient(leaf), gradient(branch))
    for _ in range(_NEWTONS):
        rows = np.stack([vectors_at(each, given, points) for each in slopes], axis=1)
        values = np.stack([value_at(each, given, points) for each in (leaf, branch)], axis=1)
        usable = np.isfinite(rows).all(axis=(1, 2)) & np.isfinite(values).all(axis=1)
        usable &= (np.abs(points - start) <= _FARTHEST * side).all(axis=1)
        start, points, rows, values = (each[usable] for each in (start, points, rows, values))
        points = points - (np.linalg.pinv(rows) @ values[..., None])[..., 0]
    across = _units(vectors_at(slopes[1], given, points))[1]
    known = np.isfinite(across).all(axis=1) & (np.abs(points - start) <= _FARTHEST * side).all(axis=1)
    return points[known], across[known]


def _units(vectors: Array) -> tuple[Array, Array]:
    lengths = np.linalg.norm(vectors, axis=1)
    with np.errstate(all="ignore"):
        return lengths, vectors / lengths[:, None]
