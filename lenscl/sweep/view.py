"""What of a scene the film looks at: where a place in the world stands on the film, seen from the source."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
from lenscl.sweep.boxes import Points
from lenscl.tracing import Placement

Array = NDArray[np.float64]


def on_film(scene: Scene, points: Array) -> Array:
    """Return the film coordinates of the straight rays through points, in pixels.

    Parameters
    ----------
    scene : Scene
        Its source and film; lenses bend nothing here.
    points : float64 array, shape (..., 3)
        World, scene units.

    Returns
    -------
    float64 array, shape (..., 2)
        Column and row; pixel (row, column) is where both lie from its number to the next. NaN where no ray of the
        film's plane goes there: behind a point source, or along the film.
    """
    film = scene.film
    corner, right, down = (np.asarray(v, dtype=np.float64) for v in (film.corner, film.right, film.down))
    normal = np.cross(right, down)
    with np.errstate(all="ignore"):
        if scene.source.at is not None:
            source = np.asarray(scene.source.at, dtype=np.float64)
            toward = points - source
            share = ((corner - source) @ normal) / (toward @ normal)
            share = np.where(share > 0.0, share, np.nan)
            place = source + share[..., None] * toward - corner
        else:
            along = np.asarray(scene.source.direction, dtype=np.float64)
            place = points - corner
            place = place - ((place @ normal) / (along @ normal))[..., None] * along
        square = normal @ normal
        column = np.cross(place, down) @ normal / square * film.columns
        row = np.cross(right, place) @ normal / square * film.rows
        found = np.stack([column, row], axis=-1)
    return np.where(np.isfinite(found).all(axis=-1, keepdims=True), found, np.nan)


def is_in_view(scene: Scene, places: Array) -> NDArray[np.bool_]:
    """Whether film coordinates, shape (..., 2), lie on the film; not where they are NaN."""
    return np.asarray(((places >= 0.0) & (places < np.array(scene.film.size))).all(axis=-1))


def place_in_view(scene: Scene, number: int, points: Points) -> tuple[str, int]:
    """Say where one of some points of a lens is, and which film pixel looks at it; and how many are in view.

    The points are of the lens's own space, one or more; told is the first in view, in the world. Where none is, the
    first of all is told without a pixel.
    """
    text, in_view, _ = told_place(scene, number, points)
    return text, in_view


def told_place(scene: Scene, number: int, points: Points) -> tuple[str, int, tuple[float, float, float]]:
    """Return what `place_in_view` does, and the point that is told."""
    placement = Placement.of(scene.lenses[number])
    world = placement.centre + np.array(points) @ placement.to_world.T
    places = on_film(scene, world)
    (seen,) = np.nonzero(is_in_view(scene, places))
    told = seen[0] if seen.size else 0
    size = float(np.abs(world).max())
    x, y, z = (float(part) for part in np.round(world[told], max(0, 6 - int(np.ceil(np.log10(max(size, 1e-300)))))))
    place = f"at ({x + 0.0:g}, {y + 0.0:g}, {z + 0.0:g})"
    if not seen.size:
        return place, 0, points[told]
    column, row = (int(part) for part in places[told])
    return f"{place}, where film pixel ({row}, {column}) looks", int(seen.size), points[told]
