"""Find out, once and in double precision, what the points lie in from which rays start."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Group, Lens, Scene
from lenscl.expr import bounds, evaluate, evaluate_with_error, gradient
from lenscl.tracing.boxes import near_points, pairs_by_table
from lenscl.tracing.placement import Placement

_NOWHERE = -1
_BITS = 62  # of a set of lenses in an array of numbers; larger sets are whole numbers of Python
_AT_ONCE = 2**20  # pairs of a point and a lens that are evaluated together
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
    inside, on, unknown = np.full((3, len(points)), _NOWHERE, dtype=np.int32)
    for some in _sides(scene, points):
        for into, which in ((on, some.touches), (inside, some.inside), (unknown, some.untold)):
            np.maximum.at(into, some.points[which], some.lenses[which].astype(np.int32))
    untold = unknown != _NOWHERE
    inside[untold] = on[untold] = unknown[untold]
    return inside, on


def locate_sets(scene: Scene, points: NDArray[np.float64]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the sets of lenses that each point lies in, and on the surfaces of which it lies.

    A set is a whole number that has a bit for each lens, in the order of priority, lowest first: `Scene.by_priority`.
    Else as for `locate`.
    """
    dtype = np.int64 if len(scene.lenses) <= _BITS else object
    inside, on = np.zeros((2, len(points)), dtype=dtype)
    bits = np.zeros(len(scene.lenses), dtype=dtype)
    bits[list(scene.by_priority())] = [1 << place for place in range(len(bits))]
    for some in _sides(scene, points):
        for into, which in ((on, some.touches | some.untold), (inside, some.inside | some.untold)):
            np.bitwise_or.at(into, some.points[which], bits[some.lenses[which]])
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
    ranks, of = np.argsort(scene.by_priority()), np.array(colours, dtype=np.int64)
    for some in _sides(scene, points):
        bits = 1 << of[some.lenses]
        for into, which in ((on, some.touches | some.untold), (inside, some.inside | some.untold)):
            np.bitwise_or.at(into, some.points[which], bits[which])
        lies = some.touches | some.inside | some.untold
        solids[some.points[lies], of[some.lenses[lies]]] = ranks[some.lenses[lies]]
    return inside, on, solids


def holding(scene: Scene, point: Sequence[float]) -> tuple[list[int], list[int]]:
    """Return the lenses, by number, that a point of the world lies in, and those on whose surfaces it lies.

    Of lenses where neither is known, both lists have the number.
    """
    inside, on = set(), set()
    for some in _sides(scene, np.array([point], dtype=np.float64)):
        inside.update(some.lenses[some.inside | some.untold].tolist())
        on.update(some.lenses[some.touches | some.untold].tolist())
    return sorted(inside), sorted(on)


@dataclass(frozen=True, slots=True, eq=False)
class _Sides:
    """On which side of lenses some points lie; arrays of as many pairs of a point and a lens, shape (K,).

    Attributes
    ----------
    points, lenses : int array
        Numbers of both.
    touches, inside, untold : bool array
        Whether the point is on the surface, inside and not on it, or neither is known.
    """

    points: NDArray[np.intp]
    lenses: NDArray[np.intp]
    touches: NDArray[np.bool_]
    inside: NDArray[np.bool_]
    untold: NDArray[np.bool_]


def _sides(scene: Scene, points: NDArray[np.float64]) -> Iterator[_Sides]:
    """Yield, table by table, the sides of all lenses in whose boxes points lie."""
    for group, at, numbers in pairs_by_table(scene.lenses, *near_points(scene.lenses, points)):
        for first in range(0, len(at), _AT_ONCE):
            part = slice(first, first + _AT_ONCE)
            yield _sides_of(group, points, at[part], numbers[part])


def _sides_of(group: Group, points: NDArray[np.float64], at: NDArray[np.intp], numbers: NDArray[np.intp]) -> _Sides:
    """Return the sides of copies of a lens that points lie on, of those pairs of which the point is in the box."""
    lens, placement = group.lens, Placement.of(group.lens)
    centres = group.centres[numbers - group.first]
    local = np.einsum("...j,ij->...i", points[at] - centres, placement.to_local)
    near = np.flatnonzero(((local >= placement.box[0]) & (local <= placement.box[1])).all(axis=-1))
    at, numbers, local, centres = at[near], numbers[near], local[near], centres[near]
    if near.size == 0:
        none = np.zeros(0, dtype=bool)
        return _Sides(at, numbers, none, none, none)
    values = {**lens.values, **dict(zip("xyz", local.T, strict=True))}
    f, rounding = (np.broadcast_to(each, len(at)) for each in evaluate_with_error(lens.surface.expression, values))

    # The local point is itself rounded: add what that does to F
    reach = (np.abs(points[at]) + np.abs(centres)) @ np.abs(placement.to_local).T
    moved = _PLACING_ROUNDINGS * np.finfo(np.float64).eps * reach
    slopes = [evaluate(slope, values) for slope in gradient(lens.surface.expression)]
    with np.errstate(invalid="ignore", over="ignore"):
        bound = rounding + sum(np.abs(slope) * moved[:, axis] for axis, slope in enumerate(slopes))
    bound = np.where(np.isfinite(bound), bound, rounding)
    touches, is_inside, untold = np.abs(f) <= bound, f < 0.0, np.zeros(len(at), dtype=bool)

    # Where F's rounding is not known its bounds about the point may tell the sign: max(known, log(0)) has one. On a
    # surface they shrink with the box that they are taken over; beside a pole they do not, and nothing is known
    unsure = np.flatnonzero(np.isinf(rounding))
    if unsure.size:
        low, high = _about(lens, local[unsure], moved[unsure])
        wide_low, wide_high = _about(lens, local[unsure], _WIDER * moved[unsure])
        touches[unsure], is_inside[unsure] = (low <= 0.0) & (high >= 0.0), high < 0.0
        with np.errstate(invalid="ignore"):
            shrinks = high - low <= (wide_high - wide_low) / np.sqrt(_WIDER)
        untold[unsure] = touches[unsure] & (np.isnan(f[unsure]) | np.isinf(low) | np.isinf(high) | ~shrinks)
    return _Sides(at, numbers, touches, is_inside & ~touches, untold)


def _about(
    lens: Lens, local: NDArray[np.float64], moved: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return bounds of F over boxes about local points, of so much to either side along each axis."""
    about = {axis: (at - by, at + by) for axis, at, by in zip("xyz", local.T, moved.T, strict=True)}
    fixed = {name: (value, value) for name, value in lens.values.items()}
    return bounds(lens.surface.expression, {**fixed, **about})
