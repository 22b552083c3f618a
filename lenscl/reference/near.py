"""Which of very many lenses a ray may meet, or a point may lie in: by balls about them, with room for all rounding.

A lens that is left out is one whose box the whole line of the ray passes by, so nothing certified hangs on this.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lenses
from lenscl.reference.placement import Placement

if TYPE_CHECKING:
    from lenscl.reference.vectors import Vector

_FEW = 8  # lenses: of so many, all are asked
_ROOM = 1e-2  # of a ball, and more than the margin of a box
_FAR = 1e-9  # of the lengths at hand: far more than numbers of double precision lose

Array = NDArray[np.float64]


@lru_cache(maxsize=8)
def balls(lenses: Lenses) -> tuple[Array, Array]:
    """Return the middles, shape (N, 3), and the radii, shape (N,), of balls of the world about the boxes of lenses."""
    middles, radii = np.empty((len(lenses), 3)), np.empty(len(lenses))
    for group in lenses.groups:
        placement = Placement.of(group.lens)
        low, high = (np.asarray(side, dtype=np.float64) for side in group.lens.surface.box(group.lens.values))
        part = slice(group.first, group.first + len(group))
        off = placement.point_to_world((low + high)[None] / 2)[0] - placement.centre
        middles[part] = group.centres + off
        radii[part] = (1.0 + _ROOM) * np.linalg.norm((high - low) / 2 * placement.stretch)
    return middles, radii


def near_line(lenses: Lenses, origin: Vector, direction: Vector | None) -> Iterable[int]:
    """Return the lenses, by number, near the line of a ray, or near a point where there is no direction."""
    if len(lenses) <= _FEW:
        return range(len(lenses))
    middles, radii = balls(lenses)
    start, loose = _doubles(origin)
    away = middles - start
    room = radii + loose + _FAR * (np.abs(middles).max(axis=1) + np.abs(start).max())
    if direction is not None:
        along, turned = _doubles(direction)
        room += turned * (np.linalg.norm(away, axis=1) + radii)
        away = away - (away @ along)[:, None] * along / (along @ along)
    found: list[int] = np.flatnonzero(~(np.linalg.norm(away, axis=1) > room)).tolist()
    return found


def _doubles(ball: Vector) -> tuple[Array, float]:
    """Return the middle of a ball of vectors, and how far off the vector may be."""
    off = sum(float(each.rad().upper()) for each in ball)
    return np.array([float(each.mid()) for each in ball]), off + _FAR * max(abs(float(each.mid())) for each in ball)
