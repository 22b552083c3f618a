"""Which of many boxes meet others, or hold points: a tree of boxes, walked by all that ask at once.

Boxes lie in the world, along its axes. They are sorted along a Morton curve (G. M. Morton, 1966), and each level of the
tree holds two neighbours of the level below in one box.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Group, Lenses
from lenscl.tracing.placement import Placement

Array = NDArray[np.float64]
Numbers = NDArray[np.intp]

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
def tree_of(lenses: Lenses) -> BoxTree:
    """Return the tree of `world_boxes`."""
    return BoxTree(*world_boxes(lenses))


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

    def _part(self, low: Array, high: Array, first: int) -> tuple[Numbers, Numbers]:
        asks, node = np.arange(len(low)), np.zeros(len(low), np.intp)
        for level, (its_low, its_high) in zip(range(len(self._levels))[::-1], self._levels[::-1], strict=True):
            meets = ((low[asks] <= its_high[node]) & (high[asks] >= its_low[node])).all(axis=1)
            asks, node = asks[meets], node[meets]
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
