"""Pictures that the program draws itself, so that a first look through a lens needs no files.

Each is a function that paints on a canvas of sample points (`shapes`), in order from back to front.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from lenscl.errors import StudyError
from lenscl.imaging.encoding import linear_from_srgb
from lenscl.imaging.library import LARGEST_SIDE
from lenscl.imaging.shapes import Canvas, Covered, Place, curve, light, render


def draw(name: str, size: int | tuple[int, int] = 512) -> NDArray[np.uint8]:
    """Draw a sample picture.

    Parameters
    ----------
    name : str
        One of `SAMPLES`.
    size : int or (int, int)
        Columns and rows, or the side of a square, in pixels.

    Returns
    -------
    uint8 array, shape (rows, columns, 3)
        sRGB-encoded.

    Raises
    ------
    StudyError
        If there is no such sample, or no such size.
    """
    if name not in _DRAWN:
        raise StudyError([f"{name}: there is no sample of that name; it is one of {', '.join(sorted(_DRAWN))}"])
    width, height = (size, size) if isinstance(size, int) else size
    if not (1 <= width <= LARGEST_SIDE and 1 <= height <= LARGEST_SIDE):
        raise StudyError([f"size: {width} x {height} cannot be drawn; sides go from 1 to {LARGEST_SIDE} pixels"])
    return render(_DRAWN[name][1], width, height)


def _checkers(canvas: Canvas) -> None:
    """Paint eight squares each way, and one of its own colour in each corner to tell the corners apart."""
    column, row = np.floor(4 * canvas.x).astype(int), np.floor(4 * canvas.y).astype(int)
    canvas.fill(np.ones(column.shape, dtype=bool), "f4ead5")
    canvas.fill((column + row) % 2 == 0, "26323f")
    for corner, colour in {(-4, -4): "c8402f", (3, -4): "e9b53c", (3, 3): "3f8f5b", (-4, 3): "2f6fb0"}.items():
        canvas.fill((column == corner[0]) & (row == corner[1]), colour)


def _cat(canvas: Canvas) -> None:
    """Paint a ginger cat that sits and looks at you."""
    _cat_room(canvas)
    _cat_body(canvas)
    _cat_head(canvas)
    _cat_face(canvas)


_FUR, _STRIPE, _CREAM, _PINK, _INK = "e8963a", "b9621c", "fff3df", "f0918f", "3a2418"


def _cat_room(canvas: Canvas) -> None:
    wall = np.clip((canvas.y[..., np.newaxis] + 1) / 2, 0, 1)
    canvas.everywhere(light("8fcfd0") * (1 - wall) + light("d8efe4") * wall)
    canvas.fill(canvas.ellipse((0.0, -0.1), (0.86, 0.86)), "f7e3a1")
    canvas.fill(canvas.y > 0.82, "7a5a86")
    canvas.fill(canvas.ellipse((0.0, 0.93), (0.82, 0.11)), "5c4268")


def _cat_body(canvas: Canvas) -> None:
    tail = curve((0.3, 0.84), (0.95, 0.95), (0.98, 0.35), (0.66, 0.3))
    tail_shape = canvas.stroke(tail, 0.2, 0.15)
    canvas.fill(tail_shape, _FUR)
    for i in (8, 12, 16, 20):
        (x0, y0), (x1, y1) = tail[i], tail[i + 1]
        across = [(x0 - 4 * (y1 - y0), y0 + 4 * (x1 - x0)), (x0 + 4 * (y1 - y0), y0 - 4 * (x1 - x0))]
        canvas.fill(canvas.stroke(across, 0.055, 0.03) & tail_shape, _STRIPE)
    canvas.fill(canvas.stroke(tail[22:], 0.155), _CREAM)

    canvas.fill(canvas.ellipse((0.0, 0.56), (0.42, 0.42)), _FUR)
    for side in (-1, 1):
        canvas.fill(canvas.ellipse((0.3 * side, 0.73), (0.22, 0.24)), _FUR)
        for height in (0.44, 0.56, 0.68):
            flank = curve(
                (0.5 * side, height), (0.4 * side, height + 0.03), (0.33 * side, height + 0.03), (0.27 * side, height)
            )
            canvas.fill(canvas.stroke(flank, 0.06, 0.015) & canvas.ellipse((0.0, 0.62), (0.46, 0.46)), _STRIPE)
    canvas.fill(canvas.ellipse((0.0, 0.5), (0.22, 0.3)), _CREAM)
    for side in (-1, 1):
        canvas.fill(canvas.stroke([(0.13 * side, 0.55), (0.14 * side, 0.88)], 0.2), _FUR)
        canvas.fill(canvas.ellipse((0.15 * side, 0.92), (0.14, 0.08)), _CREAM)
        for toe in (-0.045, 0.045):
            canvas.fill(canvas.stroke([(0.15 * side + toe, 0.91), (0.15 * side + toe, 0.97)], 0.014), _STRIPE)


def _cat_head(canvas: Canvas) -> None:
    for side in (-1, 1):
        canvas.fill(canvas.triangle((0.55 * side, -0.2), (0.5 * side, -0.88), (0.06 * side, -0.5)), _FUR)
        canvas.fill(canvas.triangle((0.46 * side, -0.36), (0.45 * side, -0.74), (0.2 * side, -0.5)), _PINK)
    head = canvas.ellipse((0.0, -0.17), (0.57, 0.46))
    canvas.fill(head, _FUR)
    for side in (-1, 1):
        canvas.fill(canvas.triangle((0.5 * side, -0.1), (0.68 * side, 0.08), (0.36 * side, 0.2)), _FUR)
        for height in (-0.16, -0.06, 0.04):
            cheek = curve(
                (0.62 * side, height), (0.54 * side, height), (0.5 * side, height), (0.42 * side, height + 0.02)
            )
            canvas.fill(canvas.stroke(cheek, 0.055, 0.015) & head, _STRIPE)
    for x, low in ((-0.15, -0.42), (0.0, -0.36), (0.15, -0.42)):
        canvas.fill(canvas.stroke([(x * 1.1, -0.7), (x, low)], 0.085, 0.02) & head, _STRIPE)


def _cat_face(canvas: Canvas) -> None:
    canvas.fill(canvas.ellipse((0.0, 0.15), (0.13, 0.1)), _CREAM)
    for side in (-1, 1):
        eye = (0.235 * side, -0.2)
        canvas.fill(canvas.ellipse(eye, (0.138, 0.148)), _INK)
        canvas.fill(canvas.ellipse(eye, (0.118, 0.128)), "b7d24c")
        canvas.fill(canvas.ellipse((eye[0], eye[1] + 0.03), (0.1, 0.09)), "d6e77c")
        canvas.fill(canvas.ellipse(eye, (0.05, 0.112)), _INK)
        canvas.fill(canvas.ellipse((eye[0] + 0.035, eye[1] - 0.055), (0.03, 0.03)), "ffffff")
        canvas.fill(canvas.ellipse((0.115 * side, 0.06), (0.155, 0.115)), _CREAM)
        for dot in ((0.14, 0.03), (0.2, 0.065), (0.13, 0.09)):
            canvas.fill(canvas.ellipse((dot[0] * side, dot[1]), (0.011, 0.011)), _STRIPE)
        mouth = curve((0.0, 0.05), (0.02 * side, 0.15), (0.13 * side, 0.15), (0.16 * side, 0.09))
        canvas.fill(canvas.stroke(mouth, 0.022, 0.012), _INK)
        for start, end in (((0.22, 0.03), (0.8, -0.08)), ((0.24, 0.07), (0.84, 0.08)), ((0.22, 0.11), (0.78, 0.24))):
            (x0, y0), (x1, y1) = start, end
            bow: list[Place] = curve((x0 * side, y0), (0.4 * side, y0 - 0.03), (0.6 * side, y1 - 0.02), (x1 * side, y1))
            canvas.fill(canvas.stroke(bow, 0.016, 0.006), "fffaf0")
    canvas.fill(canvas.triangle((-0.075, -0.045), (0.075, -0.045), (0.0, 0.045)), _PINK)
    canvas.fill(canvas.ellipse((0.0, -0.045), (0.075, 0.026)), _PINK)


def _chart(canvas: Canvas) -> None:
    """Paint a Siemens star of 36 pairs, line groups that halve their pitch, a grey scale and rings."""
    canvas.fill(np.ones(canvas.x.shape, dtype=bool), "f2f2f2")
    radius, angle = np.hypot(canvas.x, canvas.y), np.arctan2(canvas.y, canvas.x)
    edge = np.maximum(np.abs(canvas.x), np.abs(canvas.y))
    canvas.fill((edge > 0.95) & (edge < 0.975), "111111")

    # The star's lines are as far apart as its radius says, down to nothing in the middle
    star = radius < 0.56
    canvas.fill(star, "ffffff")
    canvas.fill(star & (np.sin(36 * angle) > 0), "111111")
    for ring in (0.14, 0.28, 0.42, 0.575):
        canvas.fill(np.abs(radius - ring) < 0.006, "c8402f")

    # One group of bars a corner, upright and lying; 1, 2, 4, 8 pairs in 0.1
    for corner, pairs in (((-1, -1), 1), ((1, -1), 2), ((1, 1), 4), ((-1, 1), 8)):
        for upright in (True, False):
            _bars(canvas, corner, pairs, upright)

    # Eleven greys in even steps of their codes, along the top and the bottom
    for step in range(11):
        code = f"{round(255 * step / 10):02x}" * 3
        left = -0.44 + 0.08 * step
        canvas.fill(canvas.box((left, -0.86), (left + 0.08, -0.7)), code)
        canvas.fill(canvas.box((-left - 0.08, 0.7), (-left, 0.86)), code)


def _bars(canvas: Canvas, corner: tuple[int, int], pairs: int, upright: bool) -> None:
    # The lying group stands inwards along x, and the upright one inwards along y, of the corner's empty square
    middle = (0.8 * corner[0], 0.6 * corner[1]) if upright else (0.6 * corner[0], 0.8 * corner[1])
    low, high = (middle[0] - 0.1, middle[1] - 0.1), (middle[0] + 0.1, middle[1] + 0.1)
    across = canvas.x - low[0] if upright else canvas.y - low[1]
    canvas.fill(canvas.box(low, high) & (np.mod(across * 10 * pairs, 1) < 0.5), "111111")


def _wheel(canvas: Canvas) -> None:
    """Paint every hue around, its saturation outwards; a ring of twelve pure hues; greys outside."""
    radius, angle = np.hypot(canvas.x, canvas.y), np.arctan2(-canvas.y, canvas.x)
    turn = np.mod(angle / (2 * np.pi), 1)
    canvas.fill(np.ones(radius.shape, dtype=bool), "2b2b2e")
    disc = radius < 0.72
    saturation = (radius[disc] / 0.72)[:, np.newaxis]
    canvas.colour[disc] = linear_from_srgb(_hue(turn[disc]) * saturation + 1 - saturation)
    steps = (radius > 0.76) & (radius < 0.94)
    canvas.colour[steps] = linear_from_srgb(_hue(np.arange(13) / 12))[np.rint(turn[steps] * 12).astype(int)]
    gap = np.abs(np.mod(turn * 12 + 0.5, 1) - 0.5) > 0.5 - 0.012 * 12 / (2 * np.pi) / np.maximum(radius, 0.1)
    canvas.fill(steps & gap, "2b2b2e")


def _hue(turn: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the sRGB values of pure hues, 0 red, 1/3 green, 2/3 blue."""
    sixth = np.asarray(turn, np.float64)[..., np.newaxis] * 6
    hue: NDArray[np.float64] = np.clip(np.abs(np.mod(sixth + np.array([0.0, 4.0, 2.0]), 6) - 3) - 1, 0, 1)
    return hue


def _grid(canvas: Canvas) -> None:
    """Paint ten by ten cells, each with its column and row; x red, y green, so that mirroring and turning show."""
    cells_x, cells_y = 5 * (canvas.x[0] + 1), 5 * (canvas.y[:, 0] + 1)
    column, row = np.clip(np.floor(cells_x), 0, 9).astype(int), np.clip(np.floor(cells_y), 0, 9).astype(int)
    i, j = np.arange(10)[np.newaxis, :], np.arange(10)[:, np.newaxis]
    tints = np.stack(np.broadcast_arrays(0.80 + 0.018 * i, 0.97 - 0.012 * (i + j), 0.80 + 0.018 * j), axis=-1)
    canvas.everywhere(linear_from_srgb(tints)[row[:, np.newaxis], column])
    for per_cell, width, colour in ((5, 0.02, "c3ccd4"), (1, 0.04, "4c5b6b")):
        upright, lying = (
            _near_line(per_cell * cells_x, width * per_cell),
            _near_line(per_cell * cells_y, width * per_cell),
        )
        canvas.fill(upright | lying[:, np.newaxis], colour)

    # In every cell, its column's digit left and its row's digit right
    left, right = (cells_x - column - 0.3) / 0.26, (cells_x - column - 0.7) / 0.26
    height = (cells_y - row - 0.5) / 0.48
    for (x0, y0), (x1, y1), digits in _SEGMENTS:
        on_left, on_right = ((side > x0 - 0.09) & (side < x1 + 0.09) for side in (left, right))
        on_height = (height > y0 - 0.05) & (height < y1 + 0.05)
        canvas.fill((on_left & np.isin(column, digits)) & on_height[:, np.newaxis], "b3372b")
        canvas.fill(on_right & (on_height & np.isin(row, digits))[:, np.newaxis], "2c7a4b")
    canvas.fill(np.abs(canvas.y) < 0.011, "d0402f")
    canvas.fill(np.abs(canvas.x) < 0.011, "2f9a57")
    canvas.fill(canvas.triangle((1.0, 0.0), (0.94, -0.035), (0.94, 0.035)), "d0402f")
    canvas.fill(canvas.triangle((0.0, 1.0), (-0.035, 0.94), (0.035, 0.94)), "2f9a57")


def _near_line(cells: NDArray[np.floating], width: float) -> Covered:
    is_near: Covered = np.abs(cells - np.rint(cells)) < width / 2
    return is_near


# The strokes of seven-segment digits: ends in a box from (-1/2, -1/2) to (1/2, 1/2), and the digits that use each
_SEGMENTS: tuple[tuple[Place, Place, tuple[int, ...]], ...] = (
    ((-0.4, -0.42), (0.4, -0.42), (0, 2, 3, 5, 6, 7, 8, 9)),
    ((-0.4, 0.0), (0.4, 0.0), (2, 3, 4, 5, 6, 8, 9)),
    ((-0.4, 0.42), (0.4, 0.42), (0, 2, 3, 5, 6, 8, 9)),
    ((-0.4, -0.42), (-0.4, 0.0), (0, 4, 5, 6, 8, 9)),
    ((0.4, -0.42), (0.4, 0.0), (0, 1, 2, 3, 4, 7, 8, 9)),
    ((-0.4, 0.0), (-0.4, 0.42), (0, 2, 6, 8)),
    ((0.4, 0.0), (0.4, 0.42), (0, 1, 3, 4, 5, 6, 7, 8, 9)),
)

_DRAWN: Mapping[str, tuple[str, Callable[[Canvas], None]]] = {
    "cat": ("a ginger cat that sits and looks at you", _cat),
    "chart": ("a resolution chart: Siemens star, line groups, grey scale", _chart),
    "checkers": ("eight by eight squares with coloured corners", _checkers),
    "grid": ("a ruled grid with numbered cells and coloured axes", _grid),
    "wheel": ("a colour wheel", _wheel),
}

SAMPLES: Mapping[str, str] = MappingProxyType({name: summary for name, (summary, _) in _DRAWN.items()})
"""The samples by name, each with what it shows."""
