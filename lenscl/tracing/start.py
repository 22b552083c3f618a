"""Find out, once and in double precision, what the points lie in from which rays start."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens, Scene
from lenscl.expr import bounds, evaluate, evaluate_with_error, gradient
from lenscl.tracing.placement import Placement

_NOWHERE = -1
_BITS = 62  # of a set of lenses in an array of numbers; larger sets are whole numbers of Python
_WIDER = 64  # times the box that a point may be moved in: over that F's bounds are as much wider, where F is smooth
_PLACING_ROUNDINGS = 8  # in (p - centre) to local: one subtraction, three products, two sums, and the map's own


def locate(scene: Scene, points: NDArray[np.float64]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the number of the lens each point lies in, and of the lens on whose surface it lies; -1 for none.

    Parameters
    ----------
    scene : Scene
        The lenses.
    points : float64 array, shape (N, 3)
        World, scene units.

    Returns
    -------
    inside, on : int32 array, shape (N,)
        A point is on a surface where |F| is within the bound of its rounding error; it is inside where F < 0 beyond
        that. Whether a ray that starts on a surface travels inside is decided by its direction. Where F has no value,
        or none that is known, both are the lens's number: no ray from there is decided.
    """
    inside = np.full(len(points), _NOWHERE, dtype=np.int32)
    on = np.full(len(points), _NOWHERE, dtype=np.int32)
    unknown = on.copy()
    for number, touches, is_inside, is_unknown in _sides(scene, points):
        on[touches] = inside[is_inside] = number
        unknown[is_unknown] = number
    untold = unknown != _NOWHERE
    inside[untold] = on[untold] = unknown[untold]
    return inside, on


def locate_sets(scene: Scene, points: NDArray[np.float64]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the sets of lenses that each point lies in, and on the surfaces of which it lies.

    A set is a whole number that has a bit for each lens, in the order of priority, lowest first: `Scene.by_priority`.
    Else as for `locate`.
    """
    inside, on = np.zeros((2, len(points)), dtype=np.int64 if len(scene.lenses) <= _BITS else object)
    bits = {number: 1 << place for place, number in enumerate(scene.by_priority())}
    for number, touches, is_inside, is_unknown in _sides(scene, points):
        on[np.union1d(touches, is_unknown)] |= bits[number]
        inside[np.union1d(is_inside, is_unknown)] |= bits[number]
    return inside, on


def locate_colours(
    scene: Scene, points: NDArray[np.float64], colours: tuple[int, ...]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return the sets of lenses that each point lies in, and on the surfaces of which it lies, by the lenses' colours.

    Returns
    -------
    inside, on : int64 array, shape (N,)
        A bit for each colour; else as for `locate`.
    solids : int64 array, shape (N, colours)
        The lens of each colour in either set, by its place in `Scene.by_priority`; -1 for none.
    """
    inside, on = np.zeros((2, len(points)), dtype=np.int64)
    solids = np.full((len(points), max(colours) + 1), _NOWHERE, dtype=np.int64)
    ranks = np.argsort(scene.by_priority())
    for number, touches, is_inside, is_unknown in _sides(scene, points):
        colour = colours[number]
        on[np.union1d(touches, is_unknown)] |= 1 << colour
        inside[np.union1d(is_inside, is_unknown)] |= 1 << colour
        solids[np.concatenate([touches, is_inside, is_unknown]), colour] = ranks[number]
    return inside, on, solids


def _sides(
    scene: Scene, points: NDArray[np.float64]
) -> Iterator[tuple[int, NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]]:
    """Yield lenses, by number, with the points that lie on each one's surface, inside it, and neither is known of."""
    for number, lens in enumerate(scene.lenses):
        placement = Placement.of(lens)
        local = placement.local(points)
        near = np.flatnonzero(((local >= placement.box[0]) & (local <= placement.box[1])).all(axis=-1))
        if near.size == 0:
            continue
        values = {**lens.values, **dict(zip("xyz", local[near].T, strict=True))}
        f, rounding = evaluate_with_error(lens.surface.expression, values)

        # The local point is itself rounded: add what that does to F
        reach = (np.abs(points[near]) + np.abs(placement.centre)) @ np.abs(placement.to_local).T
        moved = _PLACING_ROUNDINGS * np.finfo(np.float64).eps * reach
        slopes = [evaluate(slope, values) for slope in gradient(lens.surface.expression)]
        with np.errstate(invalid="ignore", over="ignore"):
            bound = rounding + sum(np.abs(slope) * moved[:, axis] for axis, slope in enumerate(slopes))
        bound = np.where(np.isfinite(bound), bound, rounding)

        touches, is_inside, untold = np.abs(f) <= bound, f < 0.0, np.zeros(0, np.intp)

        # Where F's rounding is not known its bounds about the point may tell the sign: max(known, log(0)) has one. On a
        # surface they shrink with the box that they are taken over; beside a pole they do not, and nothing is known
        unsure = np.flatnonzero(np.isinf(rounding))
        if unsure.size:
            low, high = _about(lens, local[near[unsure]], moved[unsure])
            wide_low, wide_high = _about(lens, local[near[unsure]], _WIDER * moved[unsure])
            touches[unsure], is_inside[unsure] = (low <= 0.0) & (high >= 0.0), high < 0.0
            with np.errstate(invalid="ignore"):
                shrinks = high - low <= (wide_high - wide_low) / np.sqrt(_WIDER)
            untold = unsure[touches[unsure] & (np.isnan(f[unsure]) | np.isinf(low) | np.isinf(high) | ~shrinks)]
        yield number, near[touches], near[is_inside & ~touches], near[untold]


def _about(
    lens: Lens, local: NDArray[np.float64], moved: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return bounds of F over boxes about local points, of so much to either side along each axis."""
    about = {axis: (at - by, at + by) for axis, at, by in zip("xyz", local.T, moved.T, strict=True)}
    fixed = {name: (value, value) for name, value in lens.values.items()}
    return bounds(lens.surface.expression, {**fixed, **about})
