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
_FIRST_CELLS = 2**8  # that are left when it is decided whether to go on
_MOST_CELLS = 2**9
_SLICE = 1 / 16  # of the box: slices of it are cut off where the solid is not in them
_ACROSS = 24  # cells of a slice in either direction
_MOST_ROUNDS = 8
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
    least, most = np.maximum(low, cells.min(axis=0) - half), np.minimum(high, cells.max(axis=0) + half)
    overlap = _OVERLAP * np.maximum(np.abs(low), np.abs(high))
    for _ in range(_MOST_ROUNDS):
        cuts = [_is_cut(expr, values, least, most, overlap, axis, end) for axis in range(3) for end in (0, 1)]
        if not any(cuts):
            break
    margin = _MARGIN * (most - least) + _BLUR * np.maximum(np.abs(least), np.abs(most))
    (x, y, z), (u, v, w) = np.maximum(low, least - margin).tolist(), np.minimum(high, most + margin).tolist()
    return (x, y, z), (u, v, w)


def _is_cut(
    expr: Expr, values: Mapping[str, float], low: Array, high: Array, overlap: Array, axis: int, end: int
) -> bool:
    """Cut a slice off one end of a box, in place, if it is proved that the solid is not in it."""
    slice_low, slice_high = low.copy(), high.copy()
    (slice_high if end == 0 else slice_low)[axis] = low[axis] + abs(end - _SLICE) * (high[axis] - low[axis])
    counts = [1 if each == axis else _ACROSS for each in range(3)]
    half = (slice_high - slice_low) / (2 * np.array(counts))
    steps = np.stack(np.meshgrid(*(2 * np.arange(count) + 1 for count in counts)), axis=-1).reshape(-1, 3)
    if _may_hold(expr, values, slice_low + steps * half, half + overlap).any():
        return False
    (low if end == 0 else high)[axis] = (slice_high if end == 0 else slice_low)[axis]
    return True


def _is_small(cells: Array, half: Array, low: Array, high: Array) -> bool:
    filled = cells.max(axis=0) - cells.min(axis=0) + 2.0 * half
    return bool((filled < _SHARE * (high - low)).any())


def _may_hold(expr: Expr, values: Mapping[str, float], cells: Array, half: Array) -> NDArray[np.bool_]:
    """Say in which cells bounds do not exclude the solid."""
    box = {name: (value, value) for name, value in values.items()}
    box |= {name: (cells[:, i] - half[i], cells[:, i] + half[i]) for i, name in enumerate("xyz")}
    least, _ = bounds(expr, box)
    return np.broadcast_to(~(least > 0.0), len(cells))
