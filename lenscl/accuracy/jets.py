"""F with its first and second derivatives at points, and bounds on the rounding of F and its gradient: face by face."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lenscl.codegen import faces_of
from lenscl.expr import Expr, differentiate, evaluate, evaluate_together, gradient
from lenscl.expr.graph import walk
from lenscl.lenses import Surface

Array = NDArray[np.float64]

_PAIRS = tuple((i, j) for i in range(3) for j in range(i, 3))
_SECOND = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])  # where in _PAIRS an entry of the symmetric matrix stands
_NODES = 2**21  # values of an expression's nodes that are in memory at once


class Jets:
    """F in the form that the search uses: one polynomial, or the faces of F one by one.

    Parameters
    ----------
    values : mapping of str to float
        The lens's parameters.
    surface : Surface
    whole : Expr or None
        The polynomial that is searched in the place of F; None if F is searched by its faces.
    """

    def __init__(self, values: Mapping[str, float], surface: Surface, whole: Expr | None) -> None:
        self._values = values
        self._joined, self._faces = faces_of(surface) if whole is None else (whole, (whole,))

    def at(self, local: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Return F, its error, its gradient and errors (3, M), and its second derivatives (3, 3, M), in local space.

        These are the numbers of the face whose value F has there, whatever the errors of other faces.
        """
        count = local.shape[1]
        made, errors = np.full((10, count), np.nan), np.full((4, count), np.inf)
        shown = self._shown(local)
        for number, face in enumerate(self._faces):
            some = np.flatnonzero(shown == number)
            slopes, seconds, nodes = _derivatives(face)
            exprs = (face, *slopes, *seconds)
            step = max(2**8, _NODES // nodes)
            for first in range(0, len(some), step):
                part = some[first : first + step]
                values = {**self._values, **dict(zip("xyz", local[:, part], strict=True))}
                made[:, part], errors[:, part] = evaluate_together(exprs, values, with_error=4)
        return made[0], errors[0], made[1:4], errors[1:], made[4:][_SECOND]

    def _shown(self, local: Array) -> NDArray[np.intp]:
        """Return the number of the face whose value F has, -1 where F is NaN."""
        if len(self._faces) == 1:
            return np.zeros(local.shape[1], np.intp)
        values = {**self._values, **dict(zip("xyz", local, strict=True))}
        found, _ = evaluate_together(self._faces, values)
        whole = evaluate(self._joined, {f"leaf_{i}": value for i, value in enumerate(found)})
        same = np.stack(found) == whole
        shown: NDArray[np.intp] = np.where(same.any(axis=0), same.argmax(axis=0), -1)
        return shown


@lru_cache(maxsize=512)
def _derivatives(expression: Expr) -> tuple[tuple[Expr, ...], tuple[Expr, ...], int]:
    """Return the first and second derivatives, and how many nodes they have."""
    slopes = gradient(expression)
    seconds = tuple(differentiate(slopes[i], "xyz"[j]) for i, j in _PAIRS)
    return slopes, seconds, sum(1 for _ in walk([expression, *slopes, *seconds]))
