"""Whether a solid keeps inside the bounds that were promised for it, and what to do where it does not."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from lenscl.expr import Expr, evaluate, why_undefined

_SIDE = 33  # samples along each edge of a face; odd, so that its middle is one
_CLOSER = 129  # likewise, of wider bounds before they are proposed
_INSIDE = 17  # likewise of the bounds' inside
_MOSTLY = 0.5  # of the faces' samples, where F is taken to be negative on them
_FAR, _NEARLY = 4.0, 0.9  # likewise, where the bounds are so many times as wide
_ZOOMS, _ZOOM = 40, 0.7  # towards where F is greatest
_GROWTH = 1.25  # of a face's distance from the middle, each time that the solid is found on it
_FARTHEST = 32.0  # times as far as it was
_LONGEST = 120  # characters of an expression that is written out
_END = "a ball, max(F, x^2 + y^2 + z^2 - radius^2), or a box, max(F, abs(x) - side, ...)"

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Values = Mapping[str, float]
Vec3 = tuple[float, float, float]
Box = tuple[Vec3, Vec3]


def face_problem(expression: Expr, values: Values, box: Box, formula: str = "F") -> str | None:
    """Look for F <= 0 on the faces of a box, on 33 x 33 points of each.

    Parameters
    ----------
    expression : Expr
        F in x, y, z and the names of `values`.
    values : mapping of str to float
        The parameters.
    box : pair of corners
        Lowest and highest, local coordinates.
    formula : str
        The expression as it was written.

    Returns
    -------
    str or None
        What is wrong, where, and what to do; None where nothing was found, which is no proof that nothing is there.
    """
    low, high = box
    if not all(math.isfinite(end) for end in (*low, *high)) or not all(a < b for a, b in zip(low, high, strict=True)):
        return f"must be two corners of finite numbers, each low below its high, got {[list(low), list(high)]}"
    return _problem(expression, tuple(sorted(values.items())), box, formula)


@lru_cache(maxsize=64)  # a sweep of anything else asks for the same solid at every point
def _problem(expression: Expr, items: tuple[tuple[str, float], ...], box: Box, formula: str) -> str | None:
    values, points = dict(items), _faces(box, _SIDE)
    F = _values(expression, values, points)
    reached = np.flatnonzero(F <= 0.0)
    if not reached.size:
        return None
    place = int(reached[0])
    axis, which = divmod(place // _SIDE**2, 2)
    x, y, z = points[:, place]
    return (
        f"the solid must lie strictly inside, but on the face {'xyz'[axis]} = {box[which][axis]:g} it holds the point "
        f"({x:g}, {y:g}, {z:g}), where F = {F[place]:.3g}; "
        + _advice(expression, values, box, points[:, place], F, formula)
    )


def _advice(expression: Expr, values: Values, box: Box, point: Array, F: Array, formula: str) -> str:
    """Return what to do about a solid that is on the faces of its bounds; F has the samples of these."""
    undefined = why_undefined(expression, {**values, **dict(zip("xyz", map(float, point), strict=True))})
    if undefined is not None:
        return f"there F holds {undefined[0]}: write {undefined[1]}, or draw the bounds so that they leave it out"
    low, high = (np.asarray(corner) for corner in box)
    unit = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, _INSIDE + 2)[1:-1]] * 3, indexing="ij")).reshape(3, -1)
    points = low[:, None] + unit * (high - low)[:, None]
    inside = _values(expression, values, points)
    if not (inside > 0.0).any():  # what is positive may be smaller than the places are apart
        peak = _peak(expression, values, points[:, int(np.argmax(inside))], low, high)
        points = np.concatenate([points, peak], axis=1)
        unit = np.concatenate([unit, (peak - low[:, None]) / (high - low)[:, None]], axis=1)
        inside = _values(expression, values, points)
    is_negative, is_positive = inside <= 0.0, (inside > 0.0) & np.isfinite(inside)
    on_faces = float((F <= 0.0).mean())
    outward = np.abs(2.0 * unit - 1.0).max(axis=0)
    if _seems_reversed(on_faces, outward, is_negative, is_positive):
        return _reversed(f"{_share(on_faces)} places looked at on the faces", points, inside, formula)
    wider, endless = _wider(expression, values, box)
    if endless == "xyz" and is_positive.any():
        far = float((_values(expression, values, _faces(_scaled(box, np.full((2, 3), _FAR)), _SIDE)) <= 0.0).mean())
        if far > _NEARLY:
            where = f"{_share(far)} places looked at on the faces of bounds {_FAR:g} times as wide"
            return _reversed(where, points, inside, formula)
    fills = ""
    if is_negative.all():
        fills = f"F is negative at all {is_negative.size} places looked at inside, too: the solid fills the bounds; "
    if wider is not None:
        return f"{fills}widen the bounds: {_written(wider)} would hold it; or end the solid by {_END}"
    along = " and ".join(part for part in (", ".join(endless[:-1]), endless[-1]) if part)
    return f"{fills}along {along} it goes on beyond bounds {_FARTHEST:g} times as wide, so end the solid by {_END}"


def _peak(expression: Expr, values: Values, start: Array, low: Array, high: Array) -> Array:
    """Return where near a place inside the bounds F is greatest, shape (3, 1)."""
    offsets = np.stack(np.meshgrid(*[(-1.0, 0.0, 1.0)] * 3)).reshape(3, -1)
    best, step = start[:, None], (high - low)[:, None] / _INSIDE
    for _ in range(_ZOOMS):
        tried = np.clip(best + step * offsets, low[:, None], high[:, None])
        F = _values(expression, values, tried)
        best, step = tried[:, [int(np.argmax(np.where(np.isfinite(F), F, -np.inf)))]], _ZOOM * step
    return best


def _seems_reversed(on_faces: float, outward: Array, is_negative: Mask, is_positive: Mask) -> bool:
    """Whether F is negative on most of the faces, and positive nearer to the middle than it is negative."""
    if on_faces <= _MOSTLY or not is_positive.any():
        return False
    return not is_negative.any() or bool(np.median(outward[is_positive]) < np.median(outward[is_negative]))


def _reversed(where: str, points: Array, inside: Array, formula: str) -> str:
    most = int(np.argmax(np.where(np.isfinite(inside), inside, -np.inf)))
    x, y, z = points[:, most]
    place = f"({x:.3g}, {y:.3g}, {z:.3g}), where F = {inside[most]:.3g}"
    written = f"-({formula})" if len(formula) <= _LONGEST else "-(F)"
    return (
        f"F is negative at {where} and positive inside, as at {place}: "
        f"its sign seems to be reversed, for F is negative inside a solid; try {written}. "
        f"If the solid is what lies around that place, end it by {_END}"
    )


def _share(share: float) -> str:
    return "all" if share == 1.0 else f"{100.0 * share:.0f} % of all"


def _wider(expression: Expr, values: Values, box: Box) -> tuple[Box | None, str]:
    """Return wider bounds on whose faces the solid is not found; or None, and the axes along which it goes on."""
    scale = np.ones((2, 3))
    while True:
        wide = _scaled(box, scale)
        for side in (_SIDE, _CLOSER):
            found = _values(expression, values, _faces(wide, side)).reshape(3, 2, -1) <= 0.0
            if found.any():
                break
        else:
            return wide, ""
        again = found.any(axis=2).T
        endless = np.flatnonzero((again & (scale >= _FARTHEST)).any(axis=0))
        if endless.size:
            return None, "".join("xyz"[axis] for axis in endless)
        scale = np.where(again, scale * _GROWTH, scale)


def _scaled(box: Box, scale: Array) -> Box:
    """Return bounds whose faces lie so many times as far from the middle, of low and high faces along each axis."""
    ends = np.array(box, dtype=np.float64)
    low, high = ends.mean(axis=0) + np.array([[-1.0], [1.0]]) * scale * (0.5 * np.ptp(ends, axis=0))
    return _vec3(low), _vec3(high)


def _values(expression: Expr, values: Values, points: Array) -> Array:
    """Return F at points, shape (3, N); Inf where F is no number: no solid is found there, a ray ends undecided."""
    F = evaluate(expression, {**values, **dict(zip("xyz", points, strict=True))})
    return np.where(np.isnan(F), np.inf, F)


def _faces(box: Box, side: int) -> Array:
    """Return the samples of all faces, shape (3, 6 * side * side): of the low x, the high x, the low y and so on."""
    low, high = box
    return np.concatenate([_face(low, high, axis, end, side) for axis, end in product(range(3), (low, high))], axis=1)


def _face(low: Vec3, high: Vec3, axis: int, end: Vec3, side: int) -> Array:
    """Return the samples of one face, shape (3, side * side)."""
    ticks = [np.array([end[k]]) if k == axis else np.linspace(low[k], high[k], side) for k in range(3)]
    return np.stack([part.ravel() for part in np.meshgrid(*ticks, indexing="ij")])


def _vec3(corner: Array) -> Vec3:
    x, y, z = (float(f"{end:.4g}") for end in corner)
    return x, y, z


def _written(box: Box) -> str:
    low, high = (", ".join(f"{end:g}" for end in corner) for corner in box)
    return f"[[{low}], [{high}]]"
