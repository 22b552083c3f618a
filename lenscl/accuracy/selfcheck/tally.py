"""Keep count of what is held against its bound, what breaks it, and what nobody can tell."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.selfcheck.findings import Failure

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_LARGEST = 1e30  # a residual that is no number is written as this


class Tally:
    """The laws of some rays, as they are compared.

    An unknown is no success: where a bound is infinite or no number, nothing is compared and nothing is counted.

    Parameters
    ----------
    pixel : callable
        The row and the column by which a ray is named.

    Attributes
    ----------
    unchecked : counter
        Of what could not be told, by why.
    worst : dict
        The largest residual of each law that was compared, as a multiple of its bound.
    failed : int
        Residuals beyond their bounds.
    failures : dict
        The first of each ray.
    """

    def __init__(self, pixel: Callable[[int], tuple[int, int]]) -> None:
        self._pixel = pixel
        self.unchecked: Counter[str] = Counter()
        self.worst: dict[str, float] = {}
        self.failed = 0
        self.failures: dict[int, Failure] = {}

    def note(self, law: str, rays: NDArray[np.intp], events: Any, residual: Array, bound: Array) -> Mask:
        """Hold residuals against bounds, shape (N,); return which of them could be compared.

        A residual that is no number breaks its law, unless its bound is unknown.
        """
        compared: Mask = np.isfinite(bound)
        if not compared.any():
            return compared
        residual = np.where(np.isfinite(residual), residual, _LARGEST)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            ratio = np.where(residual > 0.0, np.minimum(residual / bound, _LARGEST), 0.0)
        ratio = np.where(compared, ratio, 0.0)
        self.worst[law] = max(self.worst.get(law, 0.0), float(ratio.max()))
        for i in np.flatnonzero(ratio > 1.0):
            self.failed += 1
            ray, event = int(rays[i]), int(np.broadcast_to(events, ratio.shape)[i])
            if ray in self.failures and event >= self.failures[ray].event:
                continue
            row, column = self._pixel(ray)
            self.failures[ray] = Failure(
                row=row, column=column, event=event, law=law, residual=float(residual[i]), bound=float(bound[i])
            )
        return compared
