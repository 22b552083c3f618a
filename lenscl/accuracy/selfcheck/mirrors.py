"""Which surface points lie on mirrored faces, as far as rounding shows it; found anew from the faces' functions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.selfcheck.hits import SAFETY, Hits
from lenscl.accuracy.selfcheck.media import Media
from lenscl.accuracy.selfcheck.walk import Walk
from lenscl.config import Scene
from lenscl.reference import Placement, on_mirror

Mask = NDArray[np.bool_]

_DOUBLE = float(np.finfo(np.float64).eps)


def met_mirrors(scene: Scene, walk: Walk, hits: Hits, eps: float) -> tuple[Mask, Mask]:
    """Return which points lie on a mirrored face of their lens, and of which that is not known; shape (M,)."""
    mirrors, unsure = np.zeros((2, len(walk.ray)), np.bool_)
    for number in range(len(scene.lenses)):
        own = hits.lens == number
        if scene.lenses[number].mirror and own.any():
            found = _on_mirror(scene, walk, number, own, eps)
            mirrors[own], unsure[own] = found
    return mirrors & ~unsure, unsure


def met_mirrors_between(
    scene: Scene, walk: Walk, on: Mask, before: Media, other: Media, eps: float
) -> tuple[Mask, Mask]:
    """Return the same where solids touch or overlap: of a lens that is a medium there, and on whose surface a point is.

    `on` has the shape (lenses, M); `before` and `other` are the media on both sides.
    """
    mirrors, unsure = np.zeros((2, len(walk.ray)), np.bool_)
    for number in range(len(scene.lenses)):
        own = on[number] & ((before == number) | (other == number))
        if scene.lenses[number].mirror and own.any():
            is_coated, is_unsure = _on_mirror(scene, walk, number, own, eps)
            mirrors[own] |= is_coated & ~is_unsure
            unsure[own] |= is_unsure
    return mirrors, unsure & ~mirrors


def _on_mirror(scene: Scene, walk: Walk, number: int, own: Mask, eps: float) -> Sequence[Mask]:
    lens = scene.lenses[number]
    reach = np.maximum(np.abs(walk.at[own]), np.abs(walk.start[own])).max(axis=1)
    coarser = SAFETY * eps / _DOUBLE
    return on_mirror(lens, Placement.of(lens), walk.at[own], walk.before[own], reach, coarser)
