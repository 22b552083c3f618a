"""Which rays of a map are looked at."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.intp]

_CELLS = 8  # along each side of the part of the film that shows a lens
_LONGEST = 8  # rays with the most events


def sampled(events: NDArray[np.uint8], undecided: NDArray[np.bool_] | None = None) -> Pixels:
    """Return the pixels to look at: one of each cell of the part of a film that shows lenses, and some of most events.

    Parameters
    ----------
    events : uint8 array, shape (rows, columns)
        Of a ray map.
    undecided : bool array, shape (rows, columns), optional
        Pixels whose rays were left undecided: no one knows whether those without events meet a lens.

    Returns
    -------
    int array, shape (N,)
        Numbers of pixels whose rays meet a lens, or may meet one, ascending; the same for the same map.
    """
    row, column = np.nonzero(events if undecided is None else (events > 0) | undecided)
    if not row.size:
        return np.zeros(0, np.intp)
    cell = np.zeros(len(row), np.intp)
    for place in (row, column):
        first, count = place.min(), np.ptp(place) + 1
        cell = cell * _CELLS + (place - first) * min(_CELLS, count) // count
    order = np.argsort(cell, kind="stable")
    _, begins, counts = np.unique(cell[order], return_index=True, return_counts=True)
    numbers = row * events.shape[1] + column
    most = np.argsort(-events[row, column].astype(np.int16), kind="stable")[:_LONGEST]
    return np.unique(np.concatenate([numbers[order[begins + counts // 2]], numbers[most]]))
