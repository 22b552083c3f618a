"""How much light a source sends through parallelograms: through film pixels, and straight to the picture's cells.

A point source shines alike in all directions: the flux through something is its solid angle. Parallel light is even
across its direction: the flux is the area, seen along it. Either is that of two triangles a parallelogram, corner,
right, down and right, far, down. Source of the solid angle: Van Oosterom & Strackee, The solid angle of a plane
triangle, IEEE Trans. Biomed. Eng. 30 (1983), eq. 8.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Film, Picture, Scene
from lenscl.errors import StudyError
from lenscl.tracing.numbers import parallel_source

Array = NDArray[np.float64]

# Pixels at a time: vectors take ten times the memory of what comes of them, and should stay in caches
_TOGETHER = 2**14
_EDGE_ON = 1e-9  # sine of the angle at which a screen is seen: less is as good as none


def flux_through(scene: Scene, corners: Array, right: Array, down: Array) -> Array:
    """Return the flux through both triangles of parallelograms, shape (..., 2), steradian or area.

    Parameters
    ----------
    scene : Scene
        Its source.
    corners : float64 array, shape (..., 3)
    right, down : float64 array, shape (3,)
        What spans each of them.
    """
    normal = np.cross(right, down)
    if scene.source.at is None:
        direction, _ = parallel_source(scene)
        return np.full((*corners.shape[:-1], 2), abs(float(direction @ normal)) / 2)
    a = corners - np.asarray(scene.source.at, dtype=np.float64)
    b, c, d = a + right, a + down, a + right + down
    triple = np.abs(a @ normal)  # of either triangle's corners, without the difference of nearly equal products
    ab, ac, bc, bd, cd = (_dot(*pair) for pair in ((a, b), (a, c), (b, c), (b, d), (c, d)))
    to_a, to_b, to_c, to_d = (np.sqrt(_dot(vector, vector)) for vector in (a, b, c, d))
    below_abc = to_a * to_b * to_c + bc * to_a + ac * to_b + ab * to_c
    below_bdc = to_b * to_d * to_c + cd * to_b + bc * to_d + bd * to_c
    return 2 * np.arctan2(triple[..., np.newaxis], np.stack([below_abc, below_bdc], axis=-1))


def flux_at(scene: Scene, points: Array) -> Array:
    """Return the flux through the film at points of it, shape (..., 3), by area in film pixels: shape (...)."""
    film = scene.film
    normal = np.cross(np.asarray(film.right) / film.columns, np.asarray(film.down) / film.rows)
    if scene.source.at is None:
        direction, _ = parallel_source(scene)
        return np.full(points.shape[:-1], abs(float(direction @ normal)))
    towards = points - np.asarray(scene.source.at, dtype=np.float64)
    dense: Array = np.abs(towards @ normal) / _dot(towards, towards) ** 1.5
    return dense


def flux_of_cells(scene: Scene, screen: Film | Picture) -> Array:
    """Return the flux through every pixel of a screen, were there no lenses, shape (rows, columns, 2).

    Raises
    ------
    StudyError
        If the screen is seen edge-on from the source, so that no light goes through it.
    """
    right, down = np.asarray(screen.right) / screen.columns, np.asarray(screen.down) / screen.rows
    normal = np.cross(screen.right, screen.down)
    if scene.source.at is None:
        direction, _ = parallel_source(scene)
        sine = abs(float(direction @ normal)) / float(np.linalg.norm(normal))
    else:
        far = np.asarray(screen.centre) - np.asarray(scene.source.at)
        sine = abs(float(far @ normal)) / (float(np.linalg.norm(far) * np.linalg.norm(normal)) or 1.0)
    if not sine > _EDGE_ON:
        name = "film" if isinstance(screen, Film) else "picture"
        raise StudyError(
            [
                f"effects.caustics: the {name}'s plane runs through the source, or along parallel light, and gets no "
                f"light by itself; move or turn the {name}, or the source"
            ]
        )
    flux = np.empty((screen.rows, screen.columns, 2))
    row_starts = np.asarray(screen.corner) + np.arange(screen.columns)[:, None] * right
    band = max(1, _TOGETHER // screen.columns)
    for top in range(0, screen.rows, band):
        rows = np.arange(top, min(top + band, screen.rows))[:, None, None]
        flux[top : top + band] = flux_through(scene, row_starts + rows * down, right, down)
    return flux


def _dot(a: Array, b: Array) -> Array:
    product: Array = np.einsum("...i,...i->...", a, b)
    return product
