"""The rays of single film pixels, in double precision on the host: for the few that are looked at one by one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
from lenscl.tracing.numbers import parallel_source

Array = NDArray[np.float64]


def film_rays(scene: Scene, pixels: NDArray[np.integer]) -> tuple[Array, Array]:
    """Return origins and directions, shape (N, 3), of the rays through film pixels; directions are not unit.

    Parameters
    ----------
    scene : Scene
        Its source and film.
    pixels : int array, shape (N,)
        Numbers of pixels, row by row.
    """
    film = scene.film
    return rays_through(scene, (pixels % film.columns + 0.5) / film.columns, (pixels // film.columns + 0.5) / film.rows)


def rays_through(scene: Scene, s: Array, t: Array) -> tuple[Array, Array]:
    """Return origins and directions of the rays through any places of the film, shape (N,) each; as `film_rays`.

    s goes along its `right`, t along its `down`, 0 to 1.
    """
    film = scene.film
    spans = s[:, None] * np.asarray(film.right) + t[:, None] * np.asarray(film.down)
    targets = np.asarray(film.corner, dtype=np.float64) + spans
    if scene.source.at is not None:
        source = np.broadcast_to(np.asarray(scene.source.at, dtype=np.float64), targets.shape)
        return source, targets - source
    direction, plane = parallel_source(scene)
    return targets + (plane - targets @ direction)[:, None] * direction, np.broadcast_to(direction, targets.shape)
