"""Twin of kernels/search_march.cl and newton.cl: fixed steps, then bisection."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_HALVINGS = 60  # a bracket of one step shrinks below an ulp of its ends


def first_root(
    f: Callable[[Array], Array],
    origin: Array,
    direction: Array,
    length: Array,
    inside: Mask,
    departs: Mask,
    step: float,
) -> tuple[Array, Mask, Mask]:
    """Find where each ray first crosses the surface, by samples a step apart.

    Parameters
    ----------
    f : callable
        F at local points, shape (N, 3) -> (N,); negative inside.
    origin, direction : float64 array, shape (N, 3)
        Local rays; t counts scene units.
    length : float64 array, shape (N,)
        How far each ray is followed.
    inside, departs : bool array, shape (N,)
        Whether the ray travels in the solid; whether it starts on the surface, so that the root at 0 is removed.
    step : float
        Distance between samples, scene units.

    Returns
    -------
    t, found, undecided : arrays, shape (N,)
        `t` is the crossing where found; where undecided, the last sample that was proved.
    """
    side = np.where(inside, -1.0, 1.0)
    f_start = np.where(departs, f(origin), 0.0)

    def value(rays: NDArray[np.intp], t: Array) -> Array:
        points = origin[rays] + t[:, None] * direction[rays]
        return side[rays] * (f(points) - f_start[rays])

    low, high, last = np.zeros_like(length), np.zeros_like(length), np.zeros_like(length)
    rays = np.flatnonzero(length > 0)
    steps = 0
    while rays.size:
        steps += 1
        t = np.minimum(steps * step, length[rays])
        low[rays], high[rays] = high[rays], t
        last[rays] = value(rays, t)
        rays = rays[(last[rays] >= 0) & (t < length[rays])]
    found = last < 0
    undecided = ~found & (inside | np.isnan(last))

    # Halve the bracket; where the ray starts on the surface, of (F - F_start) / t, which shares its sign for t > 0
    rays = np.flatnonzero(found)
    a, b = low[rays], high[rays]
    for _ in range(_HALVINGS):
        middle = 0.5 * (a + b)
        before = value(rays, middle) < 0
        a, b = np.where(before, a, middle), np.where(before, middle, b)
    high[rays] = 0.5 * (a + b)
    return np.where(undecided, low, high), found, undecided
