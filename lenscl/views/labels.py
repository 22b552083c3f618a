"""Where the labels of many points go so that all can be read: beside their point, or farther off with a line to it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import cos, hypot, pi, sin

_TURNS = 24  # directions tried around a point
_REACHES = (16, 28, 44, 64, 88, 116, 150, 190, 240)  # pixels from it
_POINT = 7  # half the side of a marker, in pixels: no label lies on one
_GAP = 2  # pixels between two labels


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle in pixels."""

    left: float
    low: float
    right: float
    high: float

    def overlap(self, other: Box) -> float:
        """Return the area that two share."""
        across = min(self.right, other.right) - max(self.left, other.left)
        up = min(self.high, other.high) - max(self.low, other.low)
        return max(across, 0.0) * max(up, 0.0)


def place_labels(
    points: Sequence[tuple[float, float]], sizes: Sequence[tuple[float, float]], frame: Box
) -> list[tuple[float, float]]:
    """Return the middle of each label: of places around its point the nearest at which it hides least.

    Parameters
    ----------
    points : sequence of (float, float)
        Where the points are, in pixels; x to the right, y up.
    sizes : sequence of (float, float)
        Width and height of each label.
    frame : Box
        Labels stay inside.
    """
    taken = [Box(x - _POINT, y - _POINT, x + _POINT, y + _POINT) for x, y in points]
    found: list[tuple[float, float]] = []
    for (x, y), (width, height) in zip(points, sizes, strict=True):
        best, least = (x, y), float("inf")
        for middle in _around(x, y, width, height):
            box = _box(middle, width, height)
            outside = width * height - box.overlap(frame)
            hidden = sum(box.overlap(each) for each in taken)
            cost = 50 * (hidden + outside) + hypot(middle[0] - x, middle[1] - y)
            if cost < least:
                best, least = middle, cost
        found.append(best)
        taken.append(_box(best, width + _GAP, height + _GAP))
    return found


def _around(x: float, y: float, width: float, height: float) -> Iterator[tuple[float, float]]:
    for reach in _REACHES:
        for turn in range(_TURNS):
            c, s = cos(2 * pi * turn / _TURNS), sin(2 * pi * turn / _TURNS)
            yield x + (reach + width / 2) * c, y + (reach + height / 2) * s


def _box(middle: tuple[float, float], width: float, height: float) -> Box:
    x, y = middle
    return Box(x - width / 2, y - height / 2, x + width / 2, y + height / 2)
