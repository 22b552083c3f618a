"""The derivative of a map by differences of rays traced beside, in double precision."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lenscl import trace_rays
from lenscl.config import Scene
from lenscl.tracing.numbers import parallel_source

Array = NDArray[np.float64]

_LANDS = (0, 1)  # statuses of rays that meet the picture's plane


@dataclass(frozen=True, eq=False)
class Slopes:
    """Of N film pixels, d(s, t)/d(row, column) by differences, shape (N, 2, 2).

    `error`, shape (N,), is how far they may be off, as a share of the largest; infinite where a ray beside takes
    another path, or does not meet the picture's plane.
    """

    jacobian: Array = field(repr=False)
    error: Array = field(repr=False)


def slopes(scene: Scene, rows: Array, columns: Array, step: float = 1e-3) -> Slopes:
    """Trace four rays beside each pixel's centre in both directions, one and two steps of a pixel away.

    The differences are exact for polynomials of degree 4: f' = (8 (f(h) - f(-h)) - (f(2h) - f(-2h))) / 12 h, off by
    h^4 f'''''/30. How they differ from those of the second order bounds what is left wherever the map is smooth.
    """
    scene = scene.replace({"effects.footprint": False, "numerics.precision": "double"})
    steps = step * np.array([1.0, -1.0, 2.0, -2.0])
    moved = [(rows, columns), *((rows + h, columns) for h in steps), *((rows, columns + h) for h in steps)]
    origins, directions = (np.concatenate(each) for each in zip(*(_rays(scene, *at) for at in moved), strict=True))
    ends = trace_rays(scene, origins, directions)
    st = ends.st.reshape(9, -1, 2)
    alike = np.isin(ends.status, _LANDS).reshape(9, -1).all(axis=0)
    alike &= (ends.events.reshape(9, -1) == ends.events.reshape(9, -1)[0]).all(axis=0)
    near = np.stack([st[1] - st[2], st[5] - st[6]], axis=-1) / (2.0 * step)
    far = np.stack([st[3] - st[4], st[7] - st[8]], axis=-1) / (4.0 * step)
    found = (4.0 * near - far) / 3.0
    size = np.maximum(np.abs(found).max(axis=(1, 2)), 1e-100)  # 0 where nothing lands
    left = (np.abs(far - near).max(axis=(1, 2)) / size) ** 2 * 10.0  # of the fourth order, as the square of the second
    noise = 1e-14 * (1.0 + np.abs(st[0]).max(axis=1)) / (step * size)
    return Slopes(found, np.where(alike, left + noise, np.inf))


def _rays(scene: Scene, rows: Array, columns: Array) -> tuple[Array, Array]:
    """Return the rays through places on the film, in pixels from the centre of pixel (0, 0)."""
    film = scene.film
    s, t = (columns + 0.5) / film.columns, (rows + 0.5) / film.rows
    targets = np.asarray(film.corner) + s[:, None] * np.asarray(film.right) + t[:, None] * np.asarray(film.down)
    if scene.source.at is not None:
        source = np.broadcast_to(np.asarray(scene.source.at), targets.shape)
        return source, targets - source
    direction, plane = parallel_source(scene)
    return targets + (plane - targets @ direction)[:, None] * direction, np.broadcast_to(direction, targets.shape)
