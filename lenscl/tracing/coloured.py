"""Colours of lenses: any two whose solids may share a point differ. Few colours then tell a set of many lenses.

Boxes in the world decide: where they are apart so are the solids. A plate with a thousand lenses on it has one colour
more than the lenses among themselves.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
from lenscl.errors import StudyError
from lenscl.tracing.boxes import world_boxes

MOST_COLOURS = 24  # bits of a set: a whole number that single precision holds
_MARGIN = 1e-6  # of the lengths at hand, by which boxes have to be apart: far more than single precision rounds
_TOGETHER = 2**22  # pairs of boxes that are looked at together

Array = NDArray[np.float64]


def colours_of(scene: Scene) -> tuple[int, ...]:
    """Return the colour of each lens, from 0.

    Raises
    ------
    StudyError
        If there are more than a set holds.
    """
    low, high = world_boxes(scene.lenses)
    colours = _coloured(low.tobytes(), high.tobytes())
    if max(colours) >= MOST_COLOURS:
        raise StudyError(
            [
                f"lens: the boxes of more than {MOST_COLOURS} lenses overlap each other, and some of their solids may "
                "touch or overlap; move them apart, or leave some out: `lenscl explain` names those not proved apart"
            ]
        )
    return colours


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
    beside: list[list[int]] = [[] for _ in range(len(low))]
    order = np.argsort(low[:, 0])
    ends = np.searchsorted(low[order, 0], high[order, 0], side="right")  # boxes that begin before this one ends
    begin = 0
    while begin < len(order):
        counts = np.maximum(ends[begin:] - np.arange(begin, len(order)) - 1, 0)
        stop = begin + max(1, int(np.searchsorted(np.cumsum(counts), _TOGETHER)))
        counts = counts[: stop - begin]
        first = np.repeat(np.arange(begin, begin + len(counts)), counts)
        second = first + 1 + np.arange(len(first)) - np.repeat(np.cumsum(counts) - counts, counts)
        one, other = order[first], order[second]
        meets = ((low[one] <= high[other]) & (low[other] <= high[one])).all(axis=1)
        for i, j in zip(one[meets].tolist(), other[meets].tolist(), strict=True):
            beside[i].append(j)
            beside[j].append(i)
        begin += len(counts)
    return beside
