"""Polynomials of many rays in float64, with bounds on their errors, and discs that hold their roots.

Input: coefficients as arrays, each with a bound on its error. Output: sums and products with bounds again, and for the
roots of the exact polynomials discs about the eigenvalues of companion matrices. Overflow gives infinite discs;
underflow is not accounted for, so coefficients should be of sizes between 1e-150 and 1e150.
"""

from __future__ import annotations

from itertools import zip_longest

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Mask = NDArray[np.bool_]

UNIT = 2.0**-53  # roundoff
SLACK = 1.0 + 2.0**-20  # an error bound is itself some dozens of rounded operations


class Rows:
    """Polynomials of many rays: coefficient k of every ray in `c[k]`, a bound on its error in `e[k]`."""

    __slots__ = ("c", "e")

    def __init__(self, c: list[Array], e: list[Array]) -> None:
        self.c, self.e = c, e

    def __add__(self, other: Rows) -> Rows:
        return self._paired(other, 1.0)

    def __sub__(self, other: Rows) -> Rows:
        return self._paired(other, -1.0)

    def _paired(self, other: Rows, sign: float) -> Rows:
        zero = np.zeros(1)
        c = [a + sign * b for a, b in zip_longest(self.c, other.c, fillvalue=zero)]
        e = [a + b for a, b in zip_longest(self.e, other.e, fillvalue=zero)]
        return Rows(c, [(error + UNIT * np.abs(value)) * SLACK for error, value in zip(e, c, strict=True)])

    def __mul__(self, other: Rows) -> Rows:
        degree = len(self.c) + len(other.c) - 2
        c, e = [], []
        for k in range(degree + 1):
            terms = [(i, k - i) for i in range(len(self.c)) if 0 <= k - i < len(other.c)]
            value, size, error = np.zeros(1), np.zeros(1), np.zeros(1)
            for i, j in terms:
                a, b = self.c[i], other.c[j]
                value, size = value + a * b, size + np.abs(a * b)
                error = error + np.abs(a) * other.e[j] + self.e[i] * (np.abs(b) + other.e[j])
            c.append(value)
            e.append((error + len(terms) * UNIT * size) * SLACK)
        return Rows(c, e)

    def deflated(self, known: Mask) -> Rows:
        """Drop the constant term and divide by t, where the root at 0 is known."""
        c, e = (np.stack(np.broadcast_arrays(*part, known)[:-1]) for part in (self.c, self.e))
        down = np.concatenate([c[1:], np.zeros_like(c[:1])]), np.concatenate([e[1:], np.zeros_like(e[:1])])
        return Rows(list(np.where(known, down[0], c)), list(np.where(known, down[1], e)))

    def about(self, middle: Array, half: Array) -> Rows:
        """Write in u, t = middle + half u."""
        nothing = np.zeros(len(middle))
        t = Rows([middle, half], [UNIT * np.abs(middle), UNIT * np.abs(half)])
        result = Rows([nothing + self.c[-1]], [nothing + self.e[-1]])
        for value, error in zip(self.c[-2::-1], self.e[-2::-1], strict=True):
            result = result * t + Rows([value], [error])
        return result

    def roots(self) -> tuple[Complex, Array, Mask]:
        """Return discs that hold every root, and which hold one real root: (centre, radius, alone), shape (N, degree).

        Beyond a polynomial's own degree the centres are infinite. Radii are infinite where a leading coefficient may be
        0 but is not known to be, or all are.
        """
        c, e = (np.stack(np.broadcast_arrays(*part), axis=1) for part in (self.c, self.e))
        n = c.shape[1] - 1
        place, radius = np.full((len(c), max(n, 1)), np.inf + 0j), np.zeros((len(c), max(n, 1)))
        alone = np.zeros(place.shape, dtype=np.bool_)
        vanishes = (c == 0) & (e == 0)
        degree = n - np.argmin(vanishes[:, ::-1], axis=1)
        place[vanishes.all(axis=1)], radius[vanishes.all(axis=1)] = 0.0, np.inf
        for k in range(1, n + 1):
            rows = np.flatnonzero((degree == k) & ~vanishes.all(axis=1))
            if rows.size:
                place[rows, :k], radius[rows, :k], alone[rows, :k] = _discs(c[rows, : k + 1], e[rows, : k + 1])
        return place, radius, alone


class Float64:
    """Polynomials of many rays, as `pieces.Kind`."""

    def number(self, value: float) -> Rows:
        """Make a constant, the same for every ray."""
        return Rows([np.array([float(value)])], [np.zeros(1)])

    def sign(self, p: Rows) -> int | None:
        """Return the sign of a constant, None for what varies."""
        return int(np.sign(p.c[0][0])) if len(p.c) == 1 and p.c[0].size == 1 else None

    def quotient(self, p: Rows, constant: Rows) -> Rows:
        """Divide by a constant, not 0."""
        v, error = constant.c[0], constant.e[0]
        c = [a / v for a in p.c]
        room = np.abs(v) - error
        return Rows(c, [(e + np.abs(q) * error) / room + UNIT * np.abs(q) for q, e in zip(c, p.e, strict=True)])


def _discs(c: Array, e: Array) -> tuple[Complex, Array, Mask]:
    """Return discs as `Rows.roots` does, shape (N, n), of coefficients (N, n + 1) of degree n.

    Smith: round any n different centres, discs of radius n |p(centre)| / |leading product of gaps| hold all roots, and
    as many as there are discs in each set of discs that meet.
    """
    n = c.shape[1] - 1
    leading = c[:, -1]
    sure = (np.abs(leading) > 2 * e[:, -1]) & np.all(np.isfinite(c), axis=1)
    matrix = np.zeros((len(c), n, n))
    matrix[:, range(1, n), range(n - 1)] = 1.0
    matrix[:, :, -1] = np.where(sure[:, None], -c[:, :-1] / leading[:, None], 0.0)
    sure &= np.all(np.isfinite(matrix), axis=(1, 2))
    matrix[~sure] = 0.0
    place = np.linalg.eigvals(matrix).astype(complex)

    # Discs need centres that differ: nudge equal ones by a step that is small beside any use
    gap = place[:, :, None] - place[:, None, :]
    twins = np.tril(np.abs(gap) <= 2.0**-45 * (1.0 + np.abs(place))[:, :, None], k=-1).sum(axis=2)
    place = place + twins * 2.0**-30 * (1.0 + np.abs(place))
    gap = place[:, :, None] - place[:, None, :]
    gap[:, range(n), range(n)] = 1.0

    # |p| at each centre, with the error of Horner's rule in complex numbers and of the coefficients
    value, size = np.zeros_like(place), np.zeros(place.shape)
    for k in range(n, -1, -1):
        value = value * place + c[:, k : k + 1]
        size = size * np.abs(place) + (e[:, k : k + 1] + 8 * n * UNIT * np.abs(c[:, k : k + 1]))
    least = (np.abs(leading) - e[:, -1])[:, None] * np.prod(np.abs(gap), axis=2)
    radius = n * (np.abs(value) + size) / least * SLACK
    radius = np.where(sure[:, None] & np.isfinite(radius), radius, np.inf)

    # One root in a disc about a real centre: its conjugate is in it too, so it is real
    meets = np.abs(gap) <= radius[:, :, None] + radius[:, None, :]
    meets[:, range(n), range(n)] = False
    return place, radius, (place.imag == 0.0) & ~meets.any(axis=2)
