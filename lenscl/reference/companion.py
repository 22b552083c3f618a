"""A float64 judge of first roots for many rays at once: eigenvalues of companion matrices, and signs of F between them.

Input: rays in a surface's own space. Output: for each the first crossing, or that there is none, or `undecided`. The
polynomial along the ray comes with bounds on the rounding errors of its coefficients; discs round the eigenvalues hold
every root that the exact polynomial has; and the sign of F between discs is read off an interval enclosure of the
expression itself, so a fault in the polynomials is seen there. What these leave open is `undecided`, never guessed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.expr import Expr, bounds
from lenscl.reference.pieces import Tree, along, folded, leaves, shifted
from lenscl.reference.rows import SLACK, UNIT, Float64, Rows

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Signs = NDArray[np.int8]

_CHUNK = 4096  # rays at a time: their arrays stay in the cache
_ARRAY_CHOICE = {"min": np.minimum, "max": np.maximum}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Judged:
    """What is known of N rays.

    Attributes
    ----------
    t : float64 array, shape (N,)
        The first crossing where `found`, else 0.
    radius : float64 array, shape (N,)
        The exact crossing is within this of `t`; 0 where not found.
    found : bool array, shape (N,)
        There is a crossing in (start, length].
    undecided : bool array, shape (N,)
        Roots lie too close, or a sign is too near 0, before anything is proved. Else not `found` means there is none.
    before : int8 array, shape (N,)
        The sign of F after the ray's start; 0 where unknown.
    """

    t: Array = field(repr=False)
    radius: Array = field(repr=False)
    found: Mask = field(repr=False)
    undecided: Mask = field(repr=False)
    before: Signs = field(repr=False)


def first_roots(
    expression: Expr,
    values: Mapping[str, float],
    origin: Array,
    direction: Array,
    length: ArrayLike,
    *,
    start: ArrayLike = 0.0,
    departs: ArrayLike = False,
) -> Judged:
    """Find where each ray first crosses the surface.

    Parameters
    ----------
    expression : Expr
        As for `certified.first_root`.
    values : mapping of str to float
        The parameters, the same for all rays.
    origin, direction : float64 array, shape (N, 3)
        Rays in the surface's own space.
    length, start : float64 array, shape (N,), or number
        Roots are sought for start < t <= length. From far away give the chord in the surface's box: polynomials are
        written about its middle. Where a ray departs, `start` must be 0.
    departs : bool array, shape (N,), or bool
        The origin is a rounded surface point: roots of (F(t) - F(0)) / t are sought, as in `certified.first_root`.

    Returns
    -------
    Judged

    Notes
    -----
    Discs: B. T. Smith, Error bounds for zeros of a polynomial based upon Gerschgorin's theorems, J. ACM 17(4), 1970.
    """
    n = len(origin)
    start, length = (np.broadcast_to(np.asarray(each, float), n) for each in (start, length))
    leaves_it = np.broadcast_to(np.asarray(departs, bool), n)
    judged = Judged(
        t=np.zeros(n),
        radius=np.zeros(n),
        found=np.zeros(n, dtype=np.bool_),
        undecided=np.zeros(n, dtype=np.bool_),
        before=np.zeros(n, dtype=np.int8),
    )
    with np.errstate(all="ignore"):
        for wanted in (False, True):
            rays = np.flatnonzero(leaves_it == wanted)
            for first in range(0, rays.size, _CHUNK):
                chunk = rays[first : first + _CHUNK]
                o, d = np.asarray(origin, float)[chunk], np.asarray(direction, float)[chunk]
                _judge(judged, chunk, _Rays(expression, values, o, d, start[chunk], length[chunk], wanted))
    return judged


@dataclass(frozen=True, slots=True)
class _Rays:
    """Some rays of one kind."""

    expression: Expr
    values: Mapping[str, float]
    origin: Array
    direction: Array
    start: Array
    length: Array
    departs: bool

    def candidates(self) -> tuple[Array, Array, Mask, Mask]:
        """Return where real roots may be, and whether nothing is known of a piece's roots, shape (N,).

        Shape (N, M) each: t (infinite for what is no real root), radius, and whether it is surely one simple root.
        """
        middle, half = 0.5 * (self.start + self.length), 0.5 * (self.length - self.start)
        found, unknown = [], np.zeros(len(middle), dtype=np.bool_)
        polynomials, unsure = self._departed(middle, half) if self.departs else (self._about(middle, half), unknown)
        for polynomial in polynomials:
            place, radius, alone = polynomial.roots()
            real = np.abs(place.imag) <= radius
            unknown |= np.any(np.isinf(radius) & np.isfinite(place.real), axis=1)
            t = middle[:, None] + half[:, None] * place.real
            error = (half[:, None] * radius + 4 * UNIT * (np.abs(t) + np.abs(middle[:, None]))) * SLACK
            found.append((np.where(real, t, np.inf), np.where(real, error, 0.0), alone))
        ts, radii, lonely = zip(*found, strict=True)
        return np.hstack(ts), np.hstack(radii), np.hstack(lonely), unknown | unsure

    def _about(self, middle: Array, half: Array) -> list[Rows]:
        """Return the sign polynomials in u, t = middle + half u."""
        coordinates = {}
        for name, o, d in zip("xyz", self.origin.T, self.direction.T, strict=True):
            step = middle * d
            centre = o + step
            coordinates[name] = Rows(
                [centre, half * d], [UNIT * (np.abs(step) + np.abs(centre)), UNIT * np.abs(half * d)]
            )
        return [piece.same_sign() for piece in leaves(self._tree(coordinates))]

    def _departed(self, middle: Array, half: Array) -> tuple[list[Rows], Mask]:
        """Return the sign polynomials of (F(t) - F(0)) / t in u, and where the origin may be on several pieces."""
        nothing = np.zeros(len(middle))
        coordinates = {
            name: Rows([o, d], [nothing, nothing])
            for name, o, d in zip("xyz", self.origin.T, self.direction.T, strict=True)
        }
        tree = self._tree(coordinates)
        at_origin = [_constant(piece.u, piece.root) for piece in leaves(tree)]
        values, errors = (np.stack(np.broadcast_arrays(*parts)) for parts in zip(*at_origin, strict=True))
        level = folded(tree, list(values), _ARRAY_CHOICE)
        on = np.abs(values - level) <= errors.max(axis=0) + errors
        moved = leaves(shifted(tree, Rows([level], [errors.max(axis=0)])))
        polynomials = [piece.same_sign().deflated(is_on) for piece, is_on in zip(moved, on, strict=True)]
        return [each.about(middle, half) for each in polynomials], np.count_nonzero(on, axis=0) != 1

    def _tree(self, coordinates: Mapping[str, Rows]) -> Tree[Rows]:
        kind = Float64()
        given = {name: kind.number(value) for name, value in self.values.items()}
        return along(self.expression, {**given, **coordinates}, kind)

    def signs(self, t: Array) -> Signs:
        """Return the sign of F (of F - F(0) where the ray departs) at t, shape (N, M); 0 where it is not proved."""
        low, high = self._enclosure(t)
        if self.departs:
            low_start, high_start = self._enclosure(np.zeros((len(t), 1)))
            low, high = low - high_start, high - low_start  # rounding to nearest keeps the sign of a difference
        return (low > 0).astype(np.int8) - (high < 0).astype(np.int8)

    def _enclosure(self, t: Array) -> tuple[Array, Array]:
        box = {}
        for name, o, d in zip("xyz", self.origin.T[:, :, None], self.direction.T[:, :, None], strict=True):
            step = t * d
            p = o + step
            # The point is not on the exact ray: the product and the sum are rounded, and so is p -+ width
            width = np.where(t == 0.0, 0.0, 2 * UNIT * (np.abs(step) + np.abs(p)))
            box[name] = (p - width, p + width)
        return bounds(self.expression, {**{name: (v, v) for name, v in self.values.items()}, **box})


def _judge(judged: Judged, chunk: NDArray[np.intp], rays: _Rays) -> None:
    """Fill in the verdicts of some rays."""
    # Sort what may be a real root ahead; the rest goes behind the end
    t, radius, alone, unknown = rays.candidates()
    start, end = rays.start[:, None], rays.length[:, None]
    ahead = (t + radius > start) & (t - radius <= end)
    t, radius = np.where(ahead, t, np.inf), np.where(ahead, radius, 0.0)
    order = np.argsort(t, axis=1)
    most = int(ahead.sum(axis=1).max(initial=0))
    t, radius = (np.take_along_axis(each, order, axis=1)[:, :most] for each in (t, radius))
    alone, ahead = (np.take_along_axis(each, order, axis=1)[:, :most] for each in (alone, ahead))

    # Part the ray by discs; the ends of the ray are as near as roots are
    low, high = np.where(ahead, t - radius, end), np.where(ahead, t + radius, end)
    reach = np.maximum.accumulate(np.concatenate([start, high], axis=1), axis=1)
    floor = np.minimum.accumulate(np.concatenate([low, end], axis=1)[:, ::-1], axis=1)[:, ::-1]
    crowded = ahead & (~alone | (low <= reach[:, :-1]) | (high >= floor[:, 1:]))
    signs = rays.signs(0.5 * (reach + floor))

    # Go from root to root until the sign changes or nothing can be said
    changes = ahead & (signs[:, :-1] * signs[:, 1:] < 0) & ~crowded
    stops = crowded | (ahead & (signs[:, 1:] == 0)) | changes
    first = np.argmax(stops, axis=1) if most else np.zeros(len(t), dtype=np.intp)
    any_stop = stops.any(axis=1)
    row = np.arange(len(t))
    found = changes[row, first] if most else any_stop
    unknown = unknown | (signs[:, 0] == 0)
    found = found & ~unknown
    judged.undecided[chunk] = unknown | (any_stop & ~found)
    judged.found[chunk], judged.before[chunk] = found, signs[:, 0]
    if most:
        judged.t[chunk], judged.radius[chunk] = (np.where(found, each[row, first], 0.0) for each in (t, radius))


def _constant(u: Rows, root: tuple[Rows, Rows] | None) -> tuple[Array, Array]:
    """Return the value of a piece at t = 0, and a bound on its error."""
    if root is None:
        return u.c[0], u.e[0]
    v, w = root
    size = np.cbrt(w.c[0])
    room = np.maximum(np.abs(w.c[0]) - w.e[0], 0.0)  # |cbrt(w + e) - cbrt(w)| <= 2^(2/3) cbrt(e), e / (3 cbrt(room)^2)
    error = np.fmin(2.0 * np.cbrt(w.e[0]), w.e[0] / (3.0 * np.cbrt(room) ** 2)) + 4 * UNIT * np.abs(size)
    value = u.c[0] + v.c[0] * size
    return value, (u.e[0] + np.abs(v.c[0]) * error + v.e[0] * (np.abs(size) + error) + 4 * UNIT * np.abs(value)) * SLACK
