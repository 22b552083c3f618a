"""Which of many boxes meet others, or hold points: a tree of boxes, walked by all that ask at once.

Boxes lie in the world, along its axes. They are sorted along a Morton curve (G. M. Morton, 1966), and each level of the
tree holds two neighbours of the level below in one box.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Group, Lenses
from lenscl.tracing.placement import Placement

Array = NDArray[np.float64]
Numbers = NDArray[np.intp]
Mask = NDArray[np.bool_]

FEW = 8  # lenses: of so many, each is asked of everything
_BITS = 20  # of each axis in a place's number along the curve
_AT_ONCE = 2**16  # that ask at a time
_WIDER = 1e-12  # of the lengths at hand: what rounding may do to a corner


def group_box(group: Group) -> tuple[Array, Array]:
    """Return the corners of a box of the world about a table's lens, as it would stand at the origin."""
    corners = Placement.of(group.lens.solid).corners()
    return corners.min(axis=0), corners.max(axis=0)


@lru_cache(maxsize=16)
def world_boxes(lenses: Lenses) -> tuple[Array, Array]:
    """Return the lowest and highest corners, shape (N, 3) each, of boxes of the world about the boxes of all lenses."""
    low, high = np.empty((2, len(lenses), 3))
    for group in lenses.groups:
        own, part = group_box(group), slice(group.first, group.first + len(group))
        low[part], high[part] = group.centres + own[0], group.centres + own[1]
    slack = _WIDER * np.maximum(np.abs(low), np.abs(high)).max(axis=1, keepdims=True)
    low, high = low - slack, high + slack
    low.flags.writeable = high.flags.writeable = False
    return low, high


@lru_cache(maxsize=16)
def tree_of(lenses: Lenses, wider: float = 0.0, rounding: float = 0.0) -> BoxTree:
    """Return the tree of `world_boxes`, each wider on all sides by parts of its extent and of its distance."""
    low, high = world_boxes(lenses)
    room = wider * (high - low) + rounding * np.maximum(np.abs(low), np.abs(high)).max(axis=1, keepdims=True)
    return BoxTree(low - room, high + room)


def pairs_by_table(lenses: Lenses, asks: Numbers, numbers: Numbers) -> Iterator[tuple[Group, Numbers, Numbers]]:
    """Yield each table with those pairs, of who asks and the number of a lens, that are about a lens of it."""
    order = np.argsort(numbers, kind="stable")
    asks, numbers = asks[order], numbers[order]
    ends = np.searchsorted(numbers, [group.first for group in lenses.groups[1:]])
    for group, its_asks, its_numbers in zip(lenses.groups, np.split(asks, ends), np.split(numbers, ends), strict=True):
        if len(its_asks):
            yield group, its_asks, its_numbers


def near_points(lenses: Lenses, points: Array, wider: float = 0.0, rounding: float = 0.0) -> tuple[Numbers, Numbers]:
    """Return the pairs of a point, shape (N, 3), and the number of a lens in whose box of the world it may lie.

    Of few lenses every pair is returned; boxes are wider as for `tree_of`.
    """
    if len(lenses) <= FEW:
        return np.tile(np.arange(len(points)), len(lenses)), np.repeat(np.arange(len(lenses)), len(points))
    return tree_of(lenses, wider, rounding).meeting(points, points)


def near_legs(lenses: Lenses, start: Array, along: Array, length: Array, wider: float = 0.0) -> tuple[Numbers, Numbers]:
    """Return the pairs of a leg and the number of a lens through whose box of the world it may go, as `near_points`.

    Legs start at points, shape (N, 3), and go along vectors, as many of their lengths as `length`, shape (N,), says.
    """
    if len(lenses) <= FEW:
        return np.tile(np.arange(len(start)), len(lenses)), np.repeat(np.arange(len(lenses)), len(start))
    return tree_of(lenses, wider).crossed(start, along, length)


class BoxTree:
    """Boxes, by number.

    Parameters
    ----------
    low, high : float64 array, shape (N, 3)
        Their corners; N is 1 at least.
    """

    def __init__(self, low: Array, high: Array) -> None:
        self._order = _along_curve(low + (high - low) / 2)
        self._levels = [(low[self._order], high[self._order])]
        while len(self._levels[-1][0]) > 1:
            below_low, below_high = self._levels[-1]
            pairs = np.arange(0, len(below_low), 2)
            self._levels.append(
                (np.minimum.reduceat(below_low, pairs, axis=0), np.maximum.reduceat(below_high, pairs, axis=0))
            )

    def meeting(self, low: Array, high: Array) -> tuple[Numbers, Numbers]:
        """Return which boxes, shape (M, 3) a corner, meet which of the tree's: numbers of both, sorted, shape (K,).

        Boxes that touch meet; a point is a box of both corners at one place.
        """
        parts = [
            self._part(low[first : first + _AT_ONCE], high[first : first + _AT_ONCE], first)
            for first in range(0, len(low), _AT_ONCE)
        ] or [(np.zeros(0, np.intp), np.zeros(0, np.intp))]
        asks, found = (np.concatenate(each) for each in zip(*parts, strict=True))
        return asks, found

    def crossed(self, start: Array, along: Array, length: Array) -> tuple[Numbers, Numbers]:
        """Return which boxes legs go through, as `meeting`; legs are those of `near_legs`."""
        flat = along == 0.0
        with np.errstate(divide="ignore"):
            inverse = 1.0 / np.where(flat, 1.0, along)

        def meets(asks: Numbers, low: Array, high: Array) -> Mask:
            one, other = (low - start[asks]) * inverse[asks], (high - start[asks]) * inverse[asks]
            within = (start[asks] >= low) & (start[asks] <= high)
            enters = np.where(flat[asks], np.where(within, -np.inf, np.inf), np.minimum(one, other)).max(axis=1)
            leaves = np.where(flat[asks], np.inf, np.maximum(one, other)).min(axis=1)
            room = _WIDER * (np.abs(enters) + np.abs(leaves))  # no number where both are infinite
            missed: Mask = (enters > leaves + room) | (leaves < 0.0) | (enters > length[asks])
            return np.asarray(~missed)

        with np.errstate(over="ignore", invalid="ignore"):
            return self._walked(len(start), 0, meets)

    def _part(self, low: Array, high: Array, first: int) -> tuple[Numbers, Numbers]:
        def meets(asks: Numbers, its_low: Array, its_high: Array) -> Mask:
            return np.asarray(((low[asks] <= its_high) & (high[asks] >= its_low)).all(axis=1))

        return self._walked(len(low), first, meets)

    def _walked(
        self, count: int, first: int, meets: Callable[[Numbers, Array, Array], Mask]
    ) -> tuple[Numbers, Numbers]:
        """Return which boxes so many meet that ask, and who, by their numbers from `first` on."""
        asks, node = np.arange(count), np.zeros(count, np.intp)
        for level, (its_low, its_high) in zip(range(len(self._levels))[::-1], self._levels[::-1], strict=True):
            which = meets(asks, its_low[node], its_high[node])
            asks, node = asks[which], node[which]
            if level:
                asks, node = np.repeat(asks, 2), (2 * node[:, None] + np.arange(2)).ravel()
                there = node < len(self._levels[level - 1][0])
                asks, node = asks[there], node[there]
        found = self._order[node]
        order = np.lexsort((found, asks))
        return asks[order] + first, found[order]


def _along_curve(middles: Array) -> Numbers:
    """Return the numbers of places, shape (N, 3), in their order along a Morton curve."""
    low = middles.min(axis=0)
    size = float((middles.max(axis=0) - low).max()) or 1.0
    whole = ((middles - low) / size * (2**_BITS - 1)).astype(np.uint64)
    code = np.zeros(len(middles), np.uint64)
    for axis in range(3):
        spread = whole[:, axis]
        for shift, mask in _SPREADS:
            spread = (spread | (spread << np.uint64(shift))) & np.uint64(mask)
        code |= spread << np.uint64(axis)
    return np.argsort(code, kind="stable")


# Each moves bits apart until two zeros stand between any two of 21
_SPREADS = (
    (32, 0x1F00000000FFFF),
    (16, 0x1F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)
