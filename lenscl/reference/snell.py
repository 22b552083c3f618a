"""Twins of kernels/snell_*.cl and of the reflection: the textbook's forms."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def refract(d: Array, n: Array, eta: Array) -> tuple[Array, Mask]:
    """Bend directions by Snell's law.

    Parameters
    ----------
    d, n : float64 array, shape (N, 3)
        Unit rays, and unit normals turned against them.
    eta : float64 array, shape (N,)
        n_before / n_after.

    Returns
    -------
    t : float64 array, shape (N, 3)
        Unit directions behind the surface; `d` where totally reflected.
    total : bool array, shape (N,)

    Notes
    -----
    Source: Born & Wolf, Principles of Optics, 7th ed., sec. 3.2.2.
    """
    cos_i = -np.sum(d * n, axis=-1)
    sin_t = eta[:, None] * (d + cos_i[:, None] * n)
    cos2_t = 1.0 - np.sum(sin_t * sin_t, axis=-1)
    total = cos2_t < 0.0
    bent = sin_t - np.sqrt(np.maximum(cos2_t, 0.0))[:, None] * n
    return np.where(total[:, None], d, bent), total


def refract_paraxial(d: Array, n: Array, eta: Array) -> tuple[Array, Mask]:
    """Bend directions as if tangents were sines: the tangential part is scaled by eta; never total.

    Parameters and returns as for `refract`.
    """
    along = np.sum(d * n, axis=-1, keepdims=True) * n
    bent = along + eta[:, None] * (d - along)
    return bent / np.linalg.norm(bent, axis=-1, keepdims=True), np.zeros(len(d), dtype=np.bool_)


def reflect(d: Array, n: Array) -> Array:
    """Turn round the part of `d` along the unit normal `n`; shape (N, 3)."""
    turned: Array = d - 2.0 * np.sum(d * n, axis=-1, keepdims=True) * n
    return turned
