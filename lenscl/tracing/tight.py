"""The box in which rays search a lens: its bounds, or what its solid fills of these where they are much wider.

A user's bounds are a promise that the solid lies strictly inside; they may be far too wide. In a wide box a polynomial
along the ray loses its digits, and bounds say nothing of it before the ray is cut into many parts. The solid's own box
is found by interval arithmetic, which proves that it holds the solid. It is taken where it is less than half as long as
the bounds in at least one direction; else the bounds stay as they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens
from lenscl.expr import Expr, Facts, bounds
from lenscl.lenses.solid import Box

Array = NDArray[np.float64]

_SHARE = 0.5  # of the bounds' length in a direction; what is longer is left as it is
_FIRST_CELLS = 2**6  # that are left when it is decided whether to go on
_MOST_CELLS = 2**10
_MOST_HALVINGS = 120  # of bounds that are 1e12 times as long as the solid, in three directions
_MARGIN = 2.0**-10  # of the box that is found, added on every side, as to a catalogue surface's
_BLUR = 1e-6  # of the coordinates: more than rounding to single precision moves a face of the box
_OVERLAP = 2.0**-46  # of the bounds: neighbouring cells overlap by more than their corners are rounded


def search_box(lens: Lens) -> Array:
    """Return the lowest and the highest corner of the box that rays are clipped to, local, shape (2, 3)."""
    from lenscl.tracing.placement import Placement

    box = Placement.of(lens).box
    found = tightened(lens)
    return box if found is None else found


def tightened(lens: Lens) -> Array | None:
    """Return a much smaller box that holds a user's solid, or None where the bounds are not that wide."""
    surface = lens.surface
    if surface.promised is None or surface.planes:
        return None
    found = _tightened(surface.expression, surface.promised, tuple(sorted(lens.values.items())))
    return None if found is None else np.array(found)


@lru_cache(maxsize=256)  # a sweep of anything else asks for the same solid at every point
def _tightened(expr: Expr, promised: Box, items: tuple[tuple[str, float], ...]) -> Box | None:
    values = dict(items)
    if not Facts(promised, values).is_total(expr):
        return None  # where F has no value, rays are undecided, and stay so
    low, high = (np.array(corner) for corner in promised)
    cells, half = ((low + high) / 2)[None], (high - low) / 2
    for step in range(_MOST_HALVINGS):
        overlap = half + _OVERLAP * np.maximum(np.abs(low), np.abs(high))
        cells = cells[_may_hold(expr, values, cells, overlap)]
        if not len(cells):
            return None  # no solid: whoever looks for it is told elsewhere
        if len(cells) > _MOST_CELLS:
            break
        if len(cells) > _FIRST_CELLS and not _is_small(cells, half, low, high):
            return None
        axis = step % 3
        half = half.copy()
        half[axis] /= 2
        moved = np.eye(3)[axis] * half[axis]
        cells = np.concatenate([cells - moved, cells + moved])
    if not _is_small(cells, half, low, high):
        return None
    least, most = cells.min(axis=0) - half, cells.max(axis=0) + half
    margin = _MARGIN * (most - least) + _BLUR * np.maximum(np.abs(least), np.abs(most))
    (x, y, z), (u, v, w) = np.maximum(low, least - margin).tolist(), np.minimum(high, most + margin).tolist()
    return (x, y, z), (u, v, w)


def _is_small(cells: Array, half: Array, low: Array, high: Array) -> bool:
    filled = cells.max(axis=0) - cells.min(axis=0) + 2.0 * half
    return bool((filled < _SHARE * (high - low)).any())


def _may_hold(expr: Expr, values: Mapping[str, float], cells: Array, half: Array) -> NDArray[np.bool_]:
    """Say in which cells bounds do not exclude the solid."""
    box = {name: (value, value) for name, value in values.items()}
    box |= {name: (cells[:, i] - half[i], cells[:, i] + half[i]) for i, name in enumerate("xyz")}
    least, _ = bounds(expr, box)
    return np.broadcast_to(~(least > 0.0), len(cells))
