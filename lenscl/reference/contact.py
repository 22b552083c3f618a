"""Which surfaces a ray meets at one place: faces in contact are one interface, and edges are told from them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_PARALLEL = 1e-6  # sine of the angle between normals of faces that are one interface


def together(t: Array, found: Mask, spread: Array, normal: Array) -> tuple[Mask, Mask]:
    """Return which surfaces each ray meets first, within rounding of each other.

    Parameters
    ----------
    t : float64 array, shape (L, N)
        Where each of N rays first meets each of L surfaces.
    found : bool array, shape (L, N)
        Whether it does.
    spread : float64 array, shape (L, N)
        How far rounding may move `t`.
    normal : float64 array, shape (L, N, 3)
        Of any length.

    Returns
    -------
    met : bool array, shape (L, N)
        The nearest, all that lie within rounding of it, all that lie within rounding of those, and so on.
    unsure : bool array, shape (N,)
        Whether their normals differ: the ray meets an edge, and which surface it meets first is not known.
    """
    rays = np.arange(t.shape[1])
    nearest = np.argmin(np.where(found, t, np.inf), axis=0)
    met = np.zeros_like(found)
    met[nearest, rays] = found[nearest, rays]
    for _ in range(len(t) - 1):
        high = np.where(met, t + spread, -np.inf).max(axis=0)
        met |= found & (t - spread <= high)
    first = normal[nearest, rays]
    sine = np.linalg.norm(np.cross(first, normal), axis=-1)
    with np.errstate(invalid="ignore", over="ignore"):
        parallel = sine <= _PARALLEL * np.linalg.norm(first, axis=-1) * np.linalg.norm(normal, axis=-1)
    return met, (met & ~parallel).any(axis=0)
