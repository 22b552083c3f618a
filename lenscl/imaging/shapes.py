"""A canvas of sample points, and shapes as questions about them.

Coordinates have their origin in the middle, x to the right and y down; the shorter side reaches from -1 to 1. A shape
is a boolean array: which sample points it covers. Colours are linear light; pixels are means over their sample points,
which is what makes edges smooth.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lenscl.imaging.encoding import encode, linear_from_srgb

Covered: TypeAlias = NDArray[np.bool_]
Place: TypeAlias = tuple[float, float]

_SAMPLES_A_SIDE = 4  # sample points of one pixel, each way
_BAND = 64  # pixel rows drawn at once: a picture of any size needs little memory


def light(hex_colour: str) -> NDArray[np.float64]:
    """Return the linear light of a colour written as in HTML, "e8a33d"."""
    codes = [int(hex_colour[i : i + 2], 16) for i in (0, 2, 4)]
    return linear_from_srgb(np.array(codes) / 255)


@dataclass(slots=True)
class Canvas:
    """Sample points (rows, columns) with their colours so far."""

    x: NDArray[np.float32]
    y: NDArray[np.float32]
    colour: NDArray[np.float32]  # (rows, columns, 3), linear light

    def fill(self, covered: Covered, colour: str) -> None:
        """Give every covered point one colour."""
        if covered.any():
            self.colour[covered] = light(colour)

    def everywhere(self, colours: NDArray[np.float64]) -> None:
        """Give every point its own colour, (rows, columns, 3), linear light."""
        self.colour[...] = colours

    def ellipse(self, centre: Place, radii: Place) -> Covered:
        """Return what lies in an upright ellipse."""
        covered, near, x, y = self._near(centre, centre, max(radii))
        covered[near] = ((x - centre[0]) / radii[0]) ** 2 + ((y - centre[1]) / radii[1]) ** 2 <= 1
        return covered

    def box(self, low: Place, high: Place) -> Covered:
        """Return what lies in an upright rectangle."""
        return (self.x >= low[0]) & (self.x < high[0]) & (self.y >= low[1]) & (self.y < high[1])

    def triangle(self, a: Place, b: Place, c: Place) -> Covered:
        """Return what lies in a triangle."""
        covered, near, x, y = self._near(np.min([a, b, c], axis=0), np.max([a, b, c], axis=0), 0.0)
        sides = [(q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) for p, q in ((a, b), (b, c), (c, a))]
        covered[near] = np.logical_and.reduce([s >= 0 for s in sides]) | np.logical_and.reduce([s <= 0 for s in sides])
        return covered

    def stroke(self, places: Sequence[Place], width: float, end_width: float | None = None) -> Covered:
        """Return what a round brush covers along straight pieces; its width may change evenly on the way."""
        widths = np.linspace(width, width if end_width is None else end_width, len(places))
        total = np.zeros(self.x.shape, dtype=bool)
        for p, q, w0, w1 in zip(places[:-1], places[1:], widths[:-1], widths[1:], strict=True):
            covered, near, x, y = self._near(np.minimum(p, q), np.maximum(p, q), max(w0, w1) / 2)
            dx, dy = q[0] - p[0], q[1] - p[1]
            way = np.clip(((x - p[0]) * dx + (y - p[1]) * dy) / (dx * dx + dy * dy), 0, 1)
            distance2 = (x - p[0] - way * dx) ** 2 + (y - p[1] - way * dy) ** 2
            covered[near] = distance2 <= ((w0 + way * (w1 - w0)) / 2) ** 2
            total |= covered
        return total

    def _near(
        self, low: Sequence[float] | NDArray[Any], high: Sequence[float] | NDArray[Any], margin: float
    ) -> tuple[Covered, tuple[slice, slice], NDArray[np.float32], NDArray[np.float32]]:
        """Return an empty cover, the window of it that a box reaches, and the points there."""
        columns, rows = (
            slice(*np.searchsorted(line, (low[i] - margin, high[i] + margin)))
            for i, line in enumerate((self.x[0], self.y[:, 0]))
        )
        near = (rows, columns)
        return np.zeros(self.x.shape, dtype=bool), near, self.x[near], self.y[near]


def curve(a: Place, b: Place, c: Place, d: Place, pieces: int = 24) -> list[Place]:
    """Return places along the cubic Bezier curve from a to d."""
    u = np.linspace(0, 1, pieces + 1)[:, np.newaxis]
    points = (1 - u) ** 3 * np.array(a) + 3 * u * (1 - u) ** 2 * np.array(b)
    points = points + 3 * u**2 * (1 - u) * np.array(c) + u**3 * np.array(d)
    return [(float(x), float(y)) for x, y in points]


def render(paint_on: Callable[[Canvas], None], width: int, height: int) -> NDArray[np.uint8]:
    """Return a picture (height, width, 3), sRGB-encoded uint8, drawn band by band."""
    n = _SAMPLES_A_SIDE
    unit = 2 / min(width, height)
    columns = ((np.arange(width * n) + 0.5) / n - width / 2) * unit
    picture = np.empty((height, width, 3), np.uint8)
    for top in range(0, height, _BAND):
        rows = min(_BAND, height - top)
        lines = ((np.arange(rows * n) + 0.5) / n + top - height / 2) * unit
        x, y = np.meshgrid(columns.astype(np.float32), lines.astype(np.float32))
        canvas = Canvas(x, y, np.zeros((*x.shape, 3), np.float32))
        paint_on(canvas)
        means = canvas.colour.reshape(rows, n, width, n, 3).mean(axis=(1, 3), dtype=np.float64)
        picture[top : top + rows] = encode(means, np.uint8, "srgb")
    return picture
