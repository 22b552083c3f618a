"""Where the surface lies beside a traced point, proved in float64: between two places of opposite signs of F.

The line through the traced point along the ray is taken as exact in the lens's own space. F is enclosed at places on it
by interval arithmetic, each place with the rounding of its own coordinates; a sign is one that the whole enclosure has.
Places stand ever farther from the point on both sides, by factors of two, until F has proved signs there; the stretch
between is then parted again and again as long as that proves more. The precision of the trace plays no part but for the
point, so a root found in single precision lies aside of the bracket's middle by what single precision lost.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens
from lenscl.expr import bounds
from lenscl.tracing import Placement

Array = NDArray[np.float64]

_UNIT = 2.0**-53
_NEAREST = 2.0**-6  # ulps of the point's coordinates; nearer, nothing has two signs
_PARTS = 32  # of a stretch that is parted
_WORTH = 0.75  # a stretch that shrinks less is as short as it gets


def root_bracket(
    lens: Lens, point: Array, direction: Array, farthest: float, *, leaves: bool
) -> tuple[float, float] | None:
    """Return the two places, in scene units along the ray from the point, or None where there are none.

    Parameters
    ----------
    lens : Lens
        That is met.
    point, direction : float64 array, shape (3,)
        World, direction unit.
    farthest : float
        How far from the point places may be, scene units.
    leaves : bool
        Whether the ray was inside: F < 0 before the surface then, else F > 0.
    """
    placement = Placement.of(lens)
    base, along = placement.local(point), placement.to_local @ direction
    values = {name: (value, value) for name, value in lens.values.items()}

    def signs(places: Array) -> NDArray[np.int8]:
        """Return 1 where F surely has its sign before the surface, -1 where it has the other one, else 0."""
        steps = places[:, None] * along
        at = base + steps
        width = np.where(places[:, None] == 0.0, 0.0, 2.0 * _UNIT * (np.abs(steps) + np.abs(at)))
        box = {name: (at[:, i] - width[:, i], at[:, i] + width[:, i]) for i, name in enumerate("xyz")}
        low, high = bounds(lens.surface.expression, {**values, **box})
        found = (low > 0.0).astype(np.int8) - (high < 0.0).astype(np.int8)
        return -found if leaves else found

    # Coordinates may be 0: then the lens's own size says what an ulp is
    size = max(float(np.abs(base).max()), 2.0**-20 * float(np.abs(placement.box).max()))
    smallest = _NEAREST * 2.0 * _UNIT * size / float(np.linalg.norm(along))
    if not smallest < farthest < np.inf:
        return None
    steps = smallest * 2.0 ** np.arange(np.ceil(np.log2(farthest / smallest)))
    found = _between(places := np.concatenate([-steps[::-1], [0.0], steps]), signs(places))
    while found is not None:
        low, high = found
        places = np.linspace(low, high, _PARTS + 1)
        finer = _between(places, signs(places))
        if finer is None or not finer[1] - finer[0] < _WORTH * (high - low):
            break
        found = finer
    return found


def _between(places: Array, signs: NDArray[np.int8]) -> tuple[float, float] | None:
    """Return the places beside the change of sign that is nearest to 0."""
    known = np.flatnonzero(signs)
    changes = np.flatnonzero((signs[known][:-1] > 0) & (signs[known][1:] < 0))
    if not changes.size:
        return None
    before, after = places[known[changes]], places[known[changes + 1]]
    nearest = np.argmin(np.abs(before + after))
    return float(before[nearest]), float(after[nearest])
