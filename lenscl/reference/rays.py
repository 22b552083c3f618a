"""Twin of the kernels that make rays: one ray a film pixel."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Film, Picture, Scene
from lenscl.reference.placement import Placement

Array = NDArray[np.float64]


def film_rays(scene: Scene) -> tuple[Array, Array]:
    """Return origins and unit directions, shape (rows * columns, 3), pixels row by row.

    Pixel (row, column) has its centre at ((column + 1/2) / columns, (row + 1/2) / rows) of the film's spans.
    """
    film = scene.film
    s = (np.arange(film.columns) + 0.5) / film.columns
    t = (np.arange(film.rows) + 0.5) / film.rows
    spans = np.multiply.outer(t, film.down)[:, None, :] + np.multiply.outer(s, film.right)[None, :, :]
    targets = (np.asarray(film.corner, float) + spans).reshape(-1, 3)
    if scene.source.kind == "point":
        origins = np.broadcast_to(np.asarray(scene.source.at, float), targets.shape)
        return origins.copy(), _unit(targets - origins)

    # Parallel light starts on the plane normal to it, on the source side of everything
    direction = _unit(np.asarray(scene.source.direction, float))
    plane = min(corner @ direction for corner in _everything(scene))
    back = plane - targets @ direction
    return targets + back[:, None] * direction, np.tile(direction, (len(targets), 1))


def _everything(scene: Scene) -> list[Array]:
    corners = [*_corners(scene.film), *_corners(scene.picture)]
    for lens in scene.lenses:
        low, high = lens.surface.box(lens.values)
        box = np.array(list(itertools.product(*zip(low, high, strict=True))))
        corners.extend(Placement.of(lens).point_to_world(box))
    return corners


def _corners(screen: Film | Picture) -> list[Array]:
    right, down = np.asarray(screen.right, float), np.asarray(screen.down, float)
    return [np.asarray(screen.corner, float) + i * right + j * down for i in (0, 1) for j in (0, 1)]


def _unit(v: Array) -> Array:
    unit: Array = v / np.linalg.norm(v, axis=-1, keepdims=True)
    return unit
