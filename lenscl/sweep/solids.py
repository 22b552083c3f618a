"""What a user's expression is like in the bounds promised for it, by looking at a grid of places there."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens
from lenscl.expr import Expr, evaluate, gradient
from lenscl.lenses import Box

Array = NDArray[np.float64]

PLACES = 33  # along each side of the bounds; odd, so that the centre is one of them
_SURFACE_POINTS = 64
_HALVINGS = 60
_WIDER = (2.0, 4.0, 16.0)  # times as wide as the bounds, where a solid is looked for that is not in them
_MOST_OF_IT = 0.9  # of the faces of the widest, where F is negative all around a place at which it is positive
_FLAT = 1e-6  # of F's rise over a place's width: the gradient of a third power is some 1e-20 of it there


def solid_spots(lens: Lens) -> Iterator[tuple[str, str]]:
    """Yield (kind, message) for what is odd about a lens's solid; the catalogue's are known to be sound."""
    surface = lens.surface
    if surface.promised is None:
        return
    values = tuple(sorted(lens.values.items()))
    lowest = _least(surface.expression, values, surface.promised)
    if not lowest < 0.0:
        yield "no-inside", _no_inside(surface.expression, values, surface.promised, lowest)
    if lowest < 0.0 and _is_flat(surface.expression, values, surface.promised):
        yield (
            "no-slope",
            "the gradient of F is zero on its whole surface, as that of a third power is: there is no normal, and rays "
            "that meet it end undecided; take the root, an expression of the same sign that has a slope",
        )


@lru_cache(maxsize=1024)  # a sweep of anything else asks for the same solid at every point
def _no_inside(expression: Expr, values: tuple[tuple[str, float], ...], bounds: Box, lowest: float) -> str:
    """Return what to say of a solid of which nothing is found in its bounds; F is no less than `lowest` there."""
    start = f"no point with F < 0 found in its bounds, at {PLACES**3} places: "
    if lowest == np.inf:
        return f"{start}F has no value at any of them, and no lens will be seen"
    for times in _WIDER:
        wide = _widened(bounds, times)
        found = on_grid(expression, values, wide)
        if not (found < 0.0).any():
            continue
        place = [float(np.ravel(_grid(wide)["xyz"[axis]])[at]) for axis, at in enumerate(np.argwhere(found < 0.0)[0])]
        where = f"({', '.join(f'{part:.3g}' for part in place)})"
        reversed_sign = "if its sign is reversed, write -(F); else "
        far = on_grid(expression, values, _widened(bounds, _WIDER[-1]))
        around = np.concatenate([np.ravel(np.take(far, (0, -1), axis)) for axis in range(3)]) < 0.0
        advice = reversed_sign if float(around.mean()) > _MOST_OF_IT else ""
        return (
            f"{start}F is {lowest:.3g} at least, and no lens will be seen. Outside of them F is negative, as at "
            f"{where}: {advice}move lens.bounds to where the solid is, in coordinates about the lens's centre"
        )
    return (
        f"{start}F is {lowest:.3g} at least, and no lens will be seen, unless the solid is very thin; an expression "
        "that changes no sign, such as a squared one, has no inside"
    )


@lru_cache(maxsize=1024)  # a sweep of anything else asks for the same solid at every point
def _least(expression: Expr, values: tuple[tuple[str, float], ...], bounds: Box) -> float:
    """Return the least value of F in the bounds, Inf if it has none."""
    found = on_grid(expression, values, bounds)
    return float(np.where(np.isnan(found), np.inf, found).min())


def _widened(bounds: Box, times: float) -> Box:
    ends = np.asarray(bounds, dtype=np.float64)
    low, high = ends.mean(axis=0) + np.array([[-0.5], [0.5]]) * times * np.ptp(ends, axis=0)
    return (float(low[0]), float(low[1]), float(low[2])), (float(high[0]), float(high[1]), float(high[2]))


@lru_cache(maxsize=8)  # each is some hundred kilobytes, and asked for by all that look at one solid
def on_grid(expression: Expr, values: tuple[tuple[str, float], ...], bounds: Box) -> Array:
    """Return F at a grid of places in the bounds and on their faces, along x, y and z."""
    found = evaluate(expression, {**dict(values), **_grid(bounds)})
    found.flags.writeable = False
    return found


def _grid(bounds: Box) -> dict[str, Array]:
    sides = (np.linspace(low, high, PLACES) for low, high in zip(*bounds, strict=True))
    return dict(zip("xyz", np.meshgrid(*sides, indexing="ij", sparse=True), strict=True))


@lru_cache(maxsize=1024)
def _is_flat(expression: Expr, values: tuple[tuple[str, float], ...], bounds: Box) -> bool:
    """Whether the gradient is next to nothing at every one of some points of the surface, found by halving.

    It is held against how F rises to there from a place inside.
    """
    given: dict[str, Any] = dict(values)
    grid = _grid(bounds)
    f = on_grid(expression, values, bounds)
    inside = np.argwhere((f[:-1] < 0.0) & (f[1:] > 0.0))
    inside = inside[:: max(1, len(inside) // _SURFACE_POINTS)]
    i, j, k = inside.T
    x, y, z = (np.ravel(grid[name]) for name in "xyz")
    at: dict[str, Any] = {**given, "y": y[j], "z": z[k]}
    low, high = x[i], x[i + 1]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        is_inside = evaluate(expression, {**at, "x": middle}) < 0.0
        low, high = np.where(is_inside, middle, low), np.where(is_inside, high, middle)
    rise = -f[i, j, k] / np.maximum(low - x[i], np.finfo(np.float64).tiny)
    lengths = [np.abs(evaluate(slope, {**at, "x": low})) for slope in gradient(expression)]
    return bool(len(inside)) and bool((np.maximum.reduce(lengths) <= _FLAT * rise).all())
