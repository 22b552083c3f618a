"""Propagate the rounding along a ray's path to the picture: a first-order bound on the error of (s, t).

A backward pass goes from the picture to the start. For every leg and every surface it computes d(s, t) / d(point) and
d(s, t) / d(direction) in closed form: two rows of three numbers each. Each rounding error is multiplied by the row at
its place. All products are added with their worst signs. So the sum is a bound to first order, even where a surface or
a focus makes errors cancel.

A forward pass takes samples of the rounding errors with random signs, to estimate the errors of point and direction at
each surface. From them, the surface's curvature and the cosines of both angles it computes `bend`: the relative error
of the first-order derivatives there. The bound grows by `bend` times the errors at that surface. Where `bend` is large,
there is no bound.

source    ray differentials: Igehy, Tracing Ray Differentials, SIGGRAPH 1999; the law as in kernels/snell_exact.cl
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.media import Apart, Overlapping
from lenscl.accuracy.meeting import Glasses, Meeting, U, dot, norm
from lenscl.config import Scene
from lenscl.tracing import Judge, Meetings, RayPaths, picture_numbers

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_MOST_BEND = 0.25  # with a larger one there is no bound
_SECOND_ORDER = 4.0  # factor on `bend`: the second derivative may be larger within the errors' reach
_SAMPLES, _SEED = 4, 18
_SPREAD = 3.0  # root mean squares of the samples, taken as the largest error
_AT_ONCE = 2**13  # rays: their arrays fit into caches
_UNIT = 4.0  # u: error of a direction that was made unit


@dataclass(frozen=True, slots=True, eq=False)
class Carried:
    """Effects of rounding on N rays; inf where there is no bound.

    Attributes
    ----------
    bound : (N,)
        Bound on max(|ds|, |dt|).
    moved, tilted : (N,)
        Of the surfaces met, the largest displacement by the rounding of F, scene units, and the largest angle by which
        a normal may be turned.
    """

    bound: Array = field(repr=False)
    moved: Array = field(repr=False)
    tilted: Array = field(repr=False)


def carried(
    judge: Judge,
    scene: Scene,
    points: Array,
    units: Array,
    paths: RayPaths,
    rays: NDArray[np.intp],
    place: Array,
    turn: Array,
) -> Carried:
    """Return the effects of rounding on some rays that land.

    Parameters
    ----------
    judge, scene : Judge, Scene
        A scene and its judge.
    points, units, paths, rays
        As for `Judge.meetings`.
    place, turn : float64 array, shape (N, 3)
        Bounds on the error of each number of the start and of the unit direction.
    """
    met = list(judge.meetings(points, units, paths, rays))
    bound, moved, tilted = np.full(len(points), np.inf), np.zeros(len(points)), np.zeros(len(points))
    glasses = Glasses(scene)
    alike = rays[np.argsort(paths.events[rays], kind="stable")]  # rays of as many surfaces together
    for first in range(0, len(rays), _AT_ONCE):
        some = np.sort(alike[first : first + _AT_ONCE])
        way = _Way(scene, glasses, points[some].T, units[some].T, place[some].T, turn[some].T, nests=judge.nests)
        for each in met[: paths.events[some].max(initial=0)]:
            goes = np.flatnonzero(paths.events[some] >= each.surface)
            way.meet(goes, each, np.searchsorted(each.rays, some[goes]))
        bound[some], moved[some], tilted[some] = way.landed(paths.origin[some].T, paths.direction[some].T)
    return Carried(bound, moved, tilted)


class _Way:
    """The paths of some rays: `meet` is a step of the forward pass, through one surface; `landed` is the backward pass.

    After `landed`, `rows` are d(s, t) / d(point) and d(s, t) / d(direction) at the start, shape (2, 3, M).
    """

    def __init__(
        self,
        scene: Scene,
        glasses: Glasses,
        start: Array,
        direction: Array,
        place: Array,
        turn: Array,
        *,
        nests: bool = False,
    ) -> None:
        self._scene = scene
        self._at, self._along = np.array(start, order="C"), np.array(direction, order="C")
        self._place, self._turn = place, turn
        count = start.shape[1]
        self._met: list[tuple[Meeting, Array, Array, Array]] = []
        self._is_known = np.ones(count, bool)
        self._moved, self._tilted = np.zeros((2, count))
        # Samples of the errors of point and direction so far: each rounding error at its bound, with a random sign
        signs = _signs(2, 0, 0)
        self._off, self._turned = signs[0] * place, signs[1] * turn
        self._media: Apart | Overlapping
        self._media = Overlapping(scene, glasses, self._at, self._along) if nests else Apart(glasses, self._at)

    def meet(self, rays: NDArray[np.intp], met: Meetings, part: NDArray[np.intp]) -> None:
        """Take rays to the next surface and through it: numbers `rays` here are numbers `part` in `met`."""
        point, after = np.array(met.origin[part].T, order="C"), np.array(met.direction[part].T, order="C")
        self._is_known[rays] &= met.is_theirs[part]
        was_told = np.zeros(len(rays), bool)
        found = self._media.met(rays, self._at[:, rays], self._along[:, rays], point, after, met.surface == 1)
        for meeting, is_known in found:
            mine = rays[meeting.rays]
            was_told[meeting.rays] = True
            off, turned, bend = self._grown(meeting, mine, met.surface)
            self._is_known[mine] &= is_known & (bend <= _MOST_BEND)
            self._met.append((replace(meeting, rays=mine), off, turned, bend))
            self._moved[mine] = np.maximum(self._moved[mine], meeting.level)
            self._tilted[mine] = np.maximum(self._tilted[mine], norm(meeting.tilt))
        self._is_known[rays] &= was_told
        self._at[:, rays], self._along[:, rays] = point, after

    def _grown(self, at: Meeting, rays: NDArray[np.intp], surface: int) -> tuple[Array, Array, Array]:
        """Return the errors of point and direction behind a surface, and the relative error `bend` of first order."""
        signs = _signs(6, surface, at.lens)
        off, turned = self._off[:, :, rays], self._turned[:, :, rays]
        n, d = at.normal, at.before
        with np.errstate(all="ignore"):
            off = off + at.leg * turned + signs[0] * at.searched
            slides = (dot(n, off) + signs[1, :, 0] * at.level) / at.cosine
            off = off + slides[:, None] * d + signs[2] * at.told
            swung = np.stack([dot(at.hessian, each) for each in off]) + signs[3] * at.tilt
            swung -= dot(n, swung)[:, None] * n
            closer = dot(turned, n) + dot(swung, d)  # -d cosine
            part = (at.along * at.eta * closer - at.along * at.along * dot(turned, d)) / at.behind
            bent = at.eta * turned - part[:, None] * n - at.along * swung
            if at.total.any():
                bent = np.where(at.total, turned - 2.0 * closer[:, None] * n + 2.0 * at.cosine * swung, bent)
            angle = _spread(turned) + _spread(swung)
            bent = bent + signs[4] * (_UNIT * U * np.maximum(1.0, at.eta))

            sine = np.sqrt(np.maximum(1.0 - at.cosine * at.cosine, 0.0))
            curved = np.sqrt((at.hessian * at.hessian).sum(axis=(0, 1)))
            near_critical = at.eta * at.eta * at.cosine * sine / (at.behind * at.behind)
            bend = angle / at.cosine + np.where(at.total | (at.eta == 1.0), 0.0, near_critical * angle)
            bend += curved * _spread(off)
        off = off + signs[5] * at.placed
        self._off[:, :, rays], self._turned[:, :, rays] = off, bent
        return _spread(off), _spread(bent), np.nan_to_num(bend, nan=np.inf)

    def landed(self, origin: Array, direction: Array) -> tuple[Array, Array, Array]:
        """Return the bounds, and the largest displacement and tilt of surfaces by the rounding of F."""
        with np.errstate(all="ignore"):
            place, turn, bound, distance = _landing(self._scene, origin, direction)
            moved = self._media.passed(origin, direction, distance)
            if moved is not None:
                bound += _sum(place, moved)
            for at, off, turned, bend in reversed(self._met):
                bound[:, at.rays] += _through(at, place, turn, off, turned, bend)
            bound += _sum(place, self._place) + _sum(turn, self._turn)
            self.rows = place, turn
            most = bound.max(axis=0)
        return np.where(self._is_known & np.isfinite(most), most, np.inf), self._moved, self._tilted


def _landing(scene: Scene, origin: Array, direction: Array) -> tuple[Array, Array, Array, Array]:
    """Return the rows of the last leg's point and direction, (2, 3, M), the effect of its rounding, (2, M), and length.

    The length has the shape (M,).
    """
    numbers = picture_numbers(scene)
    normal, duals = numbers["normal"][:, None], np.stack([numbers["dual_s"], numbers["dual_t"]])[:, :, None]
    to_corner = origin - numbers["corner"][:, None]
    falls = dot(normal, direction)
    distance = np.abs(dot(normal, to_corner) / falls)
    rates = dot(duals, direction)
    place = duals - (rates / falls)[:, None] * normal
    # Roundings of two dot products and their quotient; then of two more, and of the sum
    sizes = np.abs(to_corner) + distance * np.abs(direction)
    astray = 5.0 * U * dot(np.abs(normal), sizes) / np.abs(falls)
    rounded = U * dot(np.abs(place), np.abs(to_corner)) + np.abs(rates) * astray + 6.0 * U * dot(np.abs(duals), sizes)
    return place, distance * place, rounded, distance


def _through(at: Meeting, place: Array, turn: Array, off: Array, turned: Array, bend: Array) -> Array:
    """Take the rows back through a surface and the leg before it, in place.

    Return the effect of the rounding there, shape (2, M).
    """
    w, v = turn[:, :, at.rays], place[:, :, at.rays]
    n, d = at.normal, at.before
    beyond = _SECOND_ORDER * bend * (norm(v) * off + norm(w) * turned)

    # Refraction: t = eta d - along n, along = excess / (eta c + b), b^2 = c^2 + excess |n x d|^2, for d of any length
    by_n = dot(w, n)
    part = by_n * (at.along * at.eta / at.behind)
    ahead = at.eta * w - part[:, None] * n + (by_n * (at.along * at.along / at.behind))[:, None] * d
    normal = -at.along * w - part[:, None] * d
    sine = np.maximum(1.0 - at.cosine * at.cosine, 0.0)
    quicker = -(2.0 * at.eta + at.along * (at.cosine - at.eta * sine / at.behind)) / (at.eta * at.cosine + at.behind)
    index = np.where(at.eta == 1.0, 0.0, np.abs(dot(w, d) - by_n * quicker))
    size = 3.0 * at.eta * np.abs(d) + 8.0 * np.abs(at.along * n)

    # Total reflection: t = d - 2 (d.n) n
    if at.total.any():
        ahead = np.where(at.total, w - 2.0 * by_n[:, None] * n, ahead)
        normal = np.where(at.total, 2.0 * (at.cosine * w - by_n[:, None] * d), normal)
        index = np.where(at.total, 0.0, index)
        size = np.where(at.total, np.abs(d) + 8.0 * at.cosine * np.abs(n), size)
    normal = normal - dot(normal, n)[:, None] * n

    # A displaced point has another normal. A displaced ray moves the point along the ray, too
    point = v + np.stack([dot(at.hessian, each) for each in normal])
    along = dot(point, d)
    line = point + (along / at.cosine)[:, None] * n
    rounded = (
        _sum(line, at.searched) + _sum(point, at.told) + _sum(v, at.placed) + np.abs(along) * (at.level / at.cosine)
        + _sum(normal, at.tilt + 4.0 * U) + 4.0 * U * (np.abs(ahead).sum(axis=1) + at.eta * index) + U * _sum(w, size)
    )  # fmt: skip
    place[:, :, at.rays], turn[:, :, at.rays] = line, ahead + at.leg * line
    return np.asarray(rounded + beyond)


def _signs(count: int, surface: int, lens: int) -> Array:
    """Return random signs for samples of vectors, shape (count, S, 3, 1): the same for every ray and every run."""
    return np.random.default_rng((_SEED, surface, lens)).choice((-1.0, 1.0), (count, _SAMPLES, 3, 1))


def _spread(samples: Array) -> Array:
    """Return an estimate of the largest length of vectors, from samples of shape (S, 3, M)."""
    largest: Array = _SPREAD * np.sqrt(dot(samples, samples).mean(axis=0))
    return largest


def _sum(rows: Array, sizes: Array) -> Array:
    """Return the largest change of (s, t), by its rows, if numbers have errors up to `sizes`."""
    return dot(np.abs(rows), sizes)
