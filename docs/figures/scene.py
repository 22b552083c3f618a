"""Draw docs/pictures/scene.svg: source, film, lens and picture of a study, and one ray through them.

    python docs/figures/scene.py

The ray is refracted by Snell's law at both surfaces of a ball of index 1.5. The drawing has a ground of its own, so
that it can be read on a light and on a dark page.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FILE = Path(__file__).parents[1] / "pictures" / "scene.svg"
WIDTH, HEIGHT, SCALE = 880, 400, 150.0
FILM_X, FILM_SIDE, CELLS = 1.35, 0.9, 6
BALL_X, BALL_R, N = 2.75, 0.56, 1.5
PICTURE_X, PICTURE_SIDE = 4.4, 1.65
INK, FILM_INK, LENS_INK, PICTURE_INK, RAY_INK = "#26323f", "#1f6feb", "#2a8c82", "#7a4fb5", "#d1432b"

Point = NDArray[np.float64]


def _flat(point: Point) -> str:
    """Project a point of space: x to the right, z up, y into the page, aslant."""
    x, y, z = point
    return f"{70 + SCALE * (x + 0.42 * y):.1f},{190 - SCALE * (z + 0.2 * y):.1f}"


def _polygon(points: list[Point], style: str) -> str:
    return f'<polygon points="{" ".join(_flat(point) for point in points)}" {style}/>'


def _line(a: Point, b: Point, style: str) -> str:
    (x1, y1), (x2, y2) = (_flat(point).split(",") for point in (a, b))
    return f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" {style}/>'


def _text(at: Point, down: float, words: str, colour: str, size: int = 17, weight: str = "bold") -> str:
    x, y = (float(number) for number in _flat(at).split(","))
    style = f'font-size="{size}" font-weight="{weight}" fill="{colour}" text-anchor="middle"'
    return f'<text x="{x:.1f}" y="{y + down:.1f}" {style}>{words}</text>'


def _square(x: float, side: float, cells: int) -> list[list[Point]]:
    """Return the grid's corners, of a square that is perpendicular to x."""
    ticks = np.linspace(-side / 2, side / 2, cells + 1)
    return [[np.array([x, y, z]) for y in ticks] for z in ticks]


def _refracted(direction: Point, normal: Point, eta: float) -> Point:
    """Return the refracted unit direction; the normal looks against it, eta is the index before over that behind."""
    cosine = -float(direction @ normal)
    bent: Point = eta * direction + (eta * cosine - np.sqrt(1 - eta**2 * (1 - cosine**2))) * normal
    return bent


def _through_ball(start: Point, direction: Point) -> tuple[Point, Point, Point]:
    """Return entry, exit, and the direction behind the ball."""
    centre = np.array([BALL_X, 0.0, 0.0])
    b = float((start - centre) @ direction)
    entry = start + (-b - np.sqrt(b**2 - (start - centre) @ (start - centre) + BALL_R**2)) * direction
    inside = _refracted(direction, (entry - centre) / BALL_R, 1 / N)
    leave = entry - 2 * float((entry - centre) @ inside) * inside
    return entry, leave, _refracted(inside, -(leave - centre) / BALL_R, N)


def main() -> None:
    """Write the file."""
    source = np.zeros(3)
    film, picture = _square(FILM_X, FILM_SIDE, CELLS), _square(PICTURE_X, PICTURE_SIDE, 8)
    row, column = 4, 3  # the pixel whose ray is drawn
    pixel = [film[row][column], film[row][column + 1], film[row + 1][column + 1], film[row + 1][column]]
    through = sum(pixel) / 4.0
    direction = through / np.linalg.norm(through)
    entry, leave, behind = _through_ball(source, direction)
    landing = leave + (PICTURE_X - leave[0]) / behind[0] * behind
    grid = f'stroke="{FILM_INK}" stroke-width="1" stroke-opacity="0.55"'
    bold = f'stroke="{RAY_INK}" stroke-width="2.6" stroke-linecap="round"'
    centre_x, centre_y = _flat(np.array([BALL_X, 0.0, 0.0])).split(",")
    parts = [f'<rect width="{WIDTH}" height="{HEIGHT}" rx="14" fill="#f4f6f8"/>']
    for i in range(8):
        for j in range(8):
            corners = [picture[i][j], picture[i][j + 1], picture[i + 1][j + 1], picture[i + 1][j]]
            tone = "#d9cdec" if (i + j) % 2 else "#f3eefa"
            parts.append(_polygon(corners, f'fill="{tone}"'))
    frame = [picture[0][0], picture[0][-1], picture[-1][-1], picture[-1][0]]
    parts += [
        _polygon(frame, f'fill="none" stroke="{PICTURE_INK}" stroke-width="2"'),
        _line(leave, landing, bold),
        f'<circle cx="{centre_x}" cy="{centre_y}" r="{SCALE * BALL_R:.1f}" fill="#bfe3de" fill-opacity="0.75" '
        f'stroke="{LENS_INK}" stroke-width="2"/>',
        _line(entry, leave, bold),
        _line(through, entry, bold),
        _polygon(
            [film[0][0], film[0][-1], film[-1][-1], film[-1][0]],
            f'fill="#dbe8fb" fill-opacity="0.8" stroke="{FILM_INK}" stroke-width="2"',
        ),
        *(_line(film[i][0], film[i][-1], grid) for i in range(1, CELLS)),
        *(_line(film[0][i], film[-1][i], grid) for i in range(1, CELLS)),
        _polygon(pixel, f'fill="{RAY_INK}" fill-opacity="0.85"'),
        _line(source, through, bold),
    ]
    for point, colour in ((source, INK), (entry, RAY_INK), (leave, RAY_INK), (landing, RAY_INK)):
        x, y = _flat(point).split(",")
        parts.append(f'<circle cx="{x}" cy="{y}" r="{7 if point is source else 4.5}" fill="{colour}"/>')
    below = 178.0
    for x, name, what, colour in (
        (0.12, "source", "rays start here", INK),
        (FILM_X, "film", "one ray a pixel", FILM_INK),
        (BALL_X, "lens", "F(x, y, z) &lt;= 0 inside", LENS_INK),
        (PICTURE_X, "picture", "(s, t) where the ray lands", PICTURE_INK),
    ):
        at = np.array([x, 0.0, 0.0])
        parts += [_text(at, below - 22, name, colour), _text(at, below - 2, what, INK, 13, "normal")]
    title = "A ray from the source through a film pixel, refracted by the lens, landing on the picture"
    FILE.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" '
        f'font-family="system-ui, sans-serif">\n<title>{title}</title>\n' + "\n".join(parts) + "\n</svg>\n",
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
