"""Which rays of the film are aimed at which lenses, were there no others to bend them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Group, Scene
from lenscl.sweep.view import is_in_view, on_film
from lenscl.tracing import Placement

Points = NDArray[np.float64]

_NEVER_ZERO = 1e-300  # stands for a direction's zero: a quotient by it lies beyond every box, and is no NaN
MOST_PASSED = 16  # copies of an array that every ray of the film is looked at for


def film_rays_of(scene: Scene, pixels: NDArray[np.int64]) -> tuple[Points, Points]:
    """Return origins and directions, shape (N, 3), of the straight rays through the centres of some film pixels."""
    film = scene.film
    u, v = (pixels % film.columns + 0.5) / film.columns, (pixels // film.columns + 0.5) / film.rows
    right, down = np.asarray(film.right, dtype=np.float64), np.asarray(film.down, dtype=np.float64)
    on_film = np.asarray(film.corner, dtype=np.float64) + u[:, None] * right + v[:, None] * down
    if scene.source.at is not None:
        origins = np.broadcast_to(np.asarray(scene.source.at, dtype=np.float64), on_film.shape)
        return origins, on_film - origins
    return on_film, np.broadcast_to(np.asarray(scene.source.direction, dtype=np.float64), on_film.shape)


def every_pixel(scene: Scene, most: int) -> NDArray[np.int64]:
    """Return film pixels, at most about so many, spread over the rows and columns."""
    stride = max(1, int(np.ceil(np.sqrt(scene.film.columns * scene.film.rows / most))))
    rows, columns = np.arange(0, scene.film.rows, stride), np.arange(0, scene.film.columns, stride)
    return (rows[:, None] * scene.film.columns + columns).ravel()


def is_aimed_at(scene: Scene, lens: Placement, pixels: NDArray[np.int64]) -> bool:
    """Whether the line of any of these film rays, ahead of a point source, crosses a lens's box."""
    origins, directions = film_rays_of(scene, pixels)
    return bool(_crosses(scene, lens, origins - lens.centre, directions).any())


def _crosses(scene: Scene, lens: Placement, origins: Points, directions: Points) -> NDArray[np.bool_]:
    """Say which lines, from origins about a lens's centre, cross its box; ahead of a point source."""
    origins, directions = origins @ lens.to_local.T, directions @ lens.to_local.T
    directions = np.where(directions == 0.0, _NEVER_ZERO, directions)
    with np.errstate(over="ignore"):
        one, other = (lens.box[0] - origins) / directions, (lens.box[1] - origins) / directions
    enters, leaves = np.minimum(one, other).max(axis=1), np.maximum(one, other).min(axis=1)
    if scene.source.at is not None:
        enters = np.maximum(enters, 0.0)
    found: NDArray[np.bool_] = enters <= leaves
    return found


def passed_by(scene: Scene, group: Group, out: NDArray[np.bool_]) -> list[int]:
    """Return the lenses of a table, by number, that rays are to be sought for that are aimed at them.

    Parameters
    ----------
    scene : Scene
    group : Group
        Its copies are returned that the ray nearest to their middle misses, `MOST_PASSED` of them at most.
    out : bool array, shape (N,)
        Of which lenses of the scene it is known that none are; they are not returned.
    """
    lens = Placement.of(group.lens.solid)
    middles = lens.centre + lens.box.mean(axis=0) @ lens.to_world.T + group.centres
    film = np.nan_to_num(on_film(scene, middles), nan=-1.0)
    column, row = (
        np.clip(part, 0, most - 1).astype(np.int64) for part, most in zip(film.T, scene.film.size, strict=True)
    )
    origins, directions = film_rays_of(scene, row * scene.film.columns + column)
    missed = ~_crosses(scene, lens, origins - group.centres, directions) & ~out[group.first : group.first + len(group)]
    return [group.first + place for place in np.flatnonzero(missed)[:MOST_PASSED].tolist()]


def copies_to_look_at(scene: Scene, group: Group) -> list[int]:
    """Return the lenses of a table, by number, that tell what is hard to see of it.

    Of an array they are the nearest and the farthest from the source that are in view, and the one most in the middle
    of the film.
    """
    if group.at is None:
        return [group.first]
    film = on_film(scene, group.centres)
    (seen,) = np.nonzero(is_in_view(scene, film))
    if not seen.size:
        return [group.first]
    normal = np.cross(np.asarray(scene.film.right), np.asarray(scene.film.down))
    depth = np.abs((group.centres[seen] - np.asarray(scene.source.at or (0.0, 0.0, 0.0))) @ normal)
    off = np.linalg.norm(film[seen] - np.array(scene.film.size) / 2, axis=1)
    chosen = dict.fromkeys(int(seen[at]) for at in (np.argmax(depth), np.argmin(depth), np.argmin(off)))
    return [group.first + place for place in chosen]
