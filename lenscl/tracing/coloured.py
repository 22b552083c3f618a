"""Colours of lenses: any two whose solids may share a point differ. Few colours then tell a set of many lenses.

Boxes in the world decide: where they are apart so are the solids. They are those in which rays search the solids, not
bounds that are much wider. A plate with a thousand lenses on it has one colour more than the lenses among themselves.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lenses, Scene
from lenscl.errors import StudyError
from lenscl.tracing.boxes import BoxTree
from lenscl.tracing.placement import Placement
from lenscl.tracing.tight import search_box

MOST_COLOURS = 24  # bits of a set: a whole number that single precision holds
_MARGIN = 1e-6  # of the lengths at hand, by which boxes have to be apart: far more than single precision rounds
_FIRST_ASK, _MOST_ASK, _AT_ONCE = 64, 2**14, 2**20  # boxes whose neighbours are sought together, and pairs of boxes

Array = NDArray[np.float64]


def colours_of(scene: Scene) -> tuple[int, ...]:
    """Return the colour of each lens, from 0.

    Raises
    ------
    StudyError
        If there are more than a set holds.
    """
    low, high = _solid_boxes(scene.lenses)
    colours = _coloured(low.tobytes(), high.tobytes())
    if max(colours) >= MOST_COLOURS:
        raise StudyError(
            [
                f"lens: the boxes of the lenses overlap too much to be told apart by {MOST_COLOURS} colours; give "
                "narrower lens.bounds where lenses have bounds, move lenses apart so that fewer touch or overlap, "
                "or leave some out"
            ]
        )
    return colours


def _solid_boxes(lenses: Lenses) -> tuple[Array, Array]:
    """Return the corners, shape (N, 3) each, of boxes of the world about the boxes in which lenses are searched."""
    low, high = np.empty((2, len(lenses), 3))
    for group in lenses.groups:
        solid, part = group.lens.solid, slice(group.first, group.first + len(group))
        corners = replace(Placement.of(solid), box=search_box(solid)).corners()
        low[part], high[part] = group.centres + corners.min(axis=0), group.centres + corners.max(axis=0)
    return low, high


@lru_cache(maxsize=16)
def _coloured(low: bytes, high: bytes) -> tuple[int, ...]:
    """Return colours for boxes by their corners, the most entangled first: each takes the first that is free."""
    beside = _neighbours(*(np.frombuffer(each).reshape(-1, 3) for each in (low, high)))
    colours = [-1] * len(beside)
    for box in sorted(range(len(beside)), key=lambda box: -len(beside[box])):
        taken = {colours[other] for other in beside[box]}
        colours[box] = next(colour for colour in range(len(taken) + 1) if colour not in taken)
    return tuple(colours)


def _neighbours(low: Array, high: Array) -> list[list[int]]:
    """Return for each box the numbers of those that overlap with it, or are as near as the margin."""
    slack = _MARGIN * np.maximum(np.abs(low), np.abs(high)).max(axis=1, keepdims=True)
    low, high = low - slack, high + slack
    tree = BoxTree(low, high)
    beside: list[list[int]] = []
    first, count = 0, _FIRST_ASK
    while first < len(low):
        asks, found = tree.meeting(low[first : first + count], high[first : first + count])
        others = found != asks + first
        asks, found = asks[others], found[others]
        size = min(count, len(low) - first)
        ends = np.searchsorted(asks, np.arange(1, size))
        beside += [each.tolist() for each in np.split(found, ends)]
        first += size
        # As many at a time as memory allows, going by those before
        count = int(np.clip(_AT_ONCE * count / max(len(asks), 1), 1, min(_MOST_ASK, 4 * count)))
    return beside
