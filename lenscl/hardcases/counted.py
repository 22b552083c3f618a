"""Check what a ray map counts along the rays: path length, and what solids absorb, by the medium of each stretch."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lenscl.config import Scene
from lenscl.hardcases.case import ROUNDING, Array, Case, Expected, Level
from lenscl.hardcases.judge import Wrong
from lenscl.tracing import RayMap, RayPaths

_ALIKE = 4.0  # times the largest change that moves of the problem's numbers make
_ROUNDINGS = 32.0  # of a sum over the path, and of the exponential function
_COLOURS = ("red", "green", "blue")


def miscounted(case: Case, scene: Scene, expected: Expected, ends: RayMap | RayPaths, level: Level) -> Iterator[Wrong]:
    """Yield the rays that end as they must, and whose path length or transmission is not that of their stretches."""
    spread = expected.moved[level].length_spread
    if not case.counts_lengths or expected.lengths is None or spread is None:
        return
    exact = expected.answers
    is_same = (ends.status.ravel() == exact.status) & (ends.events.ravel() == exact.events)
    is_same &= (exact.st != -1.0).any(axis=1) & expected.moved[level].is_stable
    names = [*(f"lens.{lens.name}" if lens.name else "the lens" for lens in scene.lenses), "the medium around"]
    sums = list(_sums(scene, ends, expected.lengths, spread, level))
    for ray in np.flatnonzero(is_same).tolist():
        for what, found, must_be, allowed in sums:
            if not abs(found[ray] - must_be[ray]) <= allowed[ray]:
                way = " and ".join(
                    f"{length:.6g} in {name}"
                    for length, name in zip(expected.lengths[ray], names, strict=True)
                    if length > 0.0
                )
                yield Wrong(ray=ray, what=f"{what} is {found[ray]:.9g}; it must be {must_be[ray]:.9g}, after {way}")
                break


def _sums(
    scene: Scene, ends: RayMap | RayPaths, lengths: Array, spread: Array, level: Level
) -> Iterator[tuple[str, Array, Array, Array]]:
    """Yield what is counted along rays: its name, and as found, as it must be, and how far off it may be, (N,) each."""
    rounding = _ROUNDINGS * ROUNDING[level]
    if "path_length" in ends.added:
        n = np.array([*(lens.n for lens in scene.lenses), scene.n_medium])
        must_be = lengths @ n
        found = ends.added["path_length"].ravel().astype(np.float64)
        yield "path length", found, must_be, _ALIKE * spread @ n + rounding * must_be
    if "transmission" in ends.added:
        each = np.array([*(lens.absorption for lens in scene.lenses), (0.0, 0.0, 0.0)])
        colours = ends.added["transmission"].reshape(-1, 3).astype(np.float64)
        depths, moves = lengths @ each, spread @ each
        for number, colour in enumerate(_COLOURS):
            left = np.exp(-depths[:, number])
            off = left * (_ALIKE * moves[:, number] + rounding * (1.0 + depths[:, number]))
            yield f"transmission of {colour} light", colours[:, number], left, off
