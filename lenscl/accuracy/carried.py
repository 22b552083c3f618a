"""Carry what is rounded on a ray's way to the picture: a bound of first order on the error of (s, t), and its second.

For every leg and every surface, d(s, t) / d(point) and d(s, t) / d(direction) are made from the last one backwards, in
closed form: two rows of three numbers each. What is rounded at a step then counts by the row there. All roundings are
added by their worst signs, so to first order the sum is a bound, whatever a surface or a focus between takes back.

A second pass, forwards, takes samples of the roundings, of random signs, to tell how far point and direction may be off
at each surface. Over what the surface leaves of proportion (its curvature, the cosines of both sides) that is the part
`bend` by which first order errs: what is off there counts by so much more, and where `bend` is no small part there is
no bound.

source    ray differentials: Igehy, Tracing Ray Differentials, SIGGRAPH 1999; the law as in kernels/snell_exact.cl
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.meeting import Glass, Meeting, U, dot, meetings_of, norm
from lenscl.config import Scene
from lenscl.tracing import Judge, Meetings, RayPaths, picture_numbers

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_MOST_BEND = 0.25  # beyond, first order says nothing
_SECOND_ORDER = 4.0  # times `bend`: a second derivative's part, at the worst places within reach
_SAMPLES, _SEED = 4, 18
_SPREAD = 3.0  # root mean squares of the samples
_AT_ONCE = 2**13  # rays: arrays that stay near the processor
_UNIT = 4.0  # u: of a direction made unit


@dataclass(frozen=True, slots=True, eq=False)
class Carried:
    """What rounding does to N rays; inf where nothing can be said.

    Attributes
    ----------
    bound : (N,)
        On max(|ds|, |dt|).
    moved, tilted : (N,)
        The largest distance by which a surface met may be displaced by the rounding of F, scene units, and the largest
        angle by which its normal may be turned.
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
    """Return what rounding does to some rays that land.

    Parameters
    ----------
    judge, scene : Judge, Scene
        The judge is that of the scene.
    points, units, paths, rays
        As for `Judge.meetings`.
    place, turn : float64 array, shape (N, 3)
        By how much each number of the start and of the unit direction may be off.
    """
    met = list(judge.meetings(points, units, paths, rays))
    bound, moved, tilted = np.full(len(points), np.inf), np.zeros(len(points)), np.zeros(len(points))
    glasses = [Glass(scene, number) for number in range(len(scene.lenses))]
    alike = rays[np.argsort(paths.events[rays], kind="stable")]  # those of many surfaces at once
    for first in range(0, len(rays), _AT_ONCE):
        some = np.sort(alike[first : first + _AT_ONCE])
        way = _Way(scene, glasses, points[some].T, units[some].T, place[some].T, turn[some].T)
        for each in met[: paths.events[some].max(initial=0)]:
            goes = np.flatnonzero(paths.events[some] >= each.surface)
            way.meet(goes, each, np.searchsorted(each.rays, some[goes]))
        bound[some], moved[some], tilted[some] = way.landed(paths.origin[some].T, paths.direction[some].T)
    return Carried(bound, moved, tilted)


class _Way:
    """The ways of some rays: forwards by `meet`, surface after surface, and then backwards, all at once, by `landed`.

    `rows` are then d(s, t) / d(point) and d(s, t) / d(direction) of the start, shape (2, 3, M).
    """

    def __init__(
        self, scene: Scene, glasses: list[Glass], start: Array, direction: Array, place: Array, turn: Array
    ) -> None:
        self._scene, self._glasses = scene, glasses
        self._at, self._along = np.array(start, order="C"), np.array(direction, order="C")
        self._place, self._turn = place, turn
        count = start.shape[1]
        self._met: list[tuple[Meeting, Array, Array, Array]] = []
        self._is_known = np.ones(count, bool)
        self._inside = np.full(count, -1)
        self._moved, self._tilted = np.zeros((2, count))
        # Samples of what point and direction may be off by now: every rounding at its largest, of a sign drawn for it
        signs = _signs(2, 0, 0)
        self._off, self._turned = signs[0] * place, signs[1] * turn
        # By how much F may be off zero where a ray starts, of which lens
        self._departs, self._on = np.zeros(count), np.full(count, -1)
        for glass in glasses:
            near, level = glass.starts(self._at)
            self._departs[near], self._on[near] = level, glass.number

    def meet(self, rays: NDArray[np.intp], met: Meetings, part: NDArray[np.intp]) -> None:
        """Take some rays, by their places here and there, to the next surface and through it."""
        point, after = np.array(met.origin[part].T, order="C"), np.array(met.direction[part].T, order="C")
        self._is_known[rays] &= met.is_theirs[part]
        was_told = np.zeros(len(rays), bool)
        is_first = met.surface == 1
        inside = self._inside[rays]
        found = meetings_of(
            self._glasses, self._at[:, rays], self._along[:, rays], point, after, inside, self._departs[rays],
            self._on[rays],
        )  # fmt: skip
        for meeting in found:
            mine = rays[meeting.rays]
            was_told[meeting.rays] = True
            is_known = meeting.known & (is_first | (meeting.leaves == (inside[meeting.rays] >= 0)))
            off, turned, bend = self._grown(meeting, mine, met.surface)
            self._is_known[mine] &= is_known & (bend <= _MOST_BEND)
            self._met.append((replace(meeting, rays=mine), off, turned, bend))
            self._inside[mine] = np.where(meeting.leaves == meeting.total, meeting.lens, -1)
            self._on[mine] = meeting.lens
            self._departs[mine] = meeting.level + norm(meeting.placed) + norm(meeting.told)
            self._moved[mine] = np.maximum(self._moved[mine], meeting.level)
            self._tilted[mine] = np.maximum(self._tilted[mine], norm(meeting.tilt))
        self._is_known[rays] &= was_told
        self._at[:, rays], self._along[:, rays] = point, after

    def _grown(self, at: Meeting, rays: NDArray[np.intp], surface: int) -> tuple[Array, Array, Array]:
        """Return how far point and direction may be off behind a surface, and what part of it first order misses."""
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
        """Return the bounds, and the largest displacement and turn of surfaces by the rounding of F."""
        with np.errstate(all="ignore"):
            place, turn, bound = _landing(self._scene, origin, direction)
            for at, off, turned, bend in reversed(self._met):
                bound[:, at.rays] += _through(at, place, turn, off, turned, bend)
            bound += _sum(place, self._place) + _sum(turn, self._turn)
            self.rows = place, turn
            most = bound.max(axis=0)
        return np.where(self._is_known & np.isfinite(most), most, np.inf), self._moved, self._tilted


def _landing(scene: Scene, origin: Array, direction: Array) -> tuple[Array, Array, Array]:
    """Return the rows of point and direction of the last leg, shape (2, 3, M), and what rounds on it, (2, M)."""
    numbers = picture_numbers(scene)
    normal, duals = numbers["normal"][:, None], np.stack([numbers["dual_s"], numbers["dual_t"]])[:, :, None]
    to_corner = origin - numbers["corner"][:, None]
    falls = dot(normal, direction)
    distance = np.abs(dot(normal, to_corner) / falls)
    rates = dot(duals, direction)
    place = duals - (rates / falls)[:, None] * normal
    # Two dot products and their quotient; then two more, and the sum
    sizes = np.abs(to_corner) + distance * np.abs(direction)
    astray = 5.0 * U * dot(np.abs(normal), sizes) / np.abs(falls)
    rounded = U * dot(np.abs(place), np.abs(to_corner)) + np.abs(rates) * astray + 6.0 * U * dot(np.abs(duals), sizes)
    return place, distance * place, rounded


def _through(at: Meeting, place: Array, turn: Array, off: Array, turned: Array, bend: Array) -> Array:
    """Take the rows back through a surface and the leg before it, in place; return what rounds there, shape (2, M)."""
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

    # The point carries its normal with it, and slides along the ray as the ray is off its line
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
    """Return signs for the samples of so many vectors, shape (count, S, 3, 1): the same for every ray, at any time."""
    return np.random.default_rng((_SEED, surface, lens)).choice((-1.0, 1.0), (count, _SAMPLES, 3, 1))


def _spread(samples: Array) -> Array:
    """Return how large vectors may be of which there are samples, shape (S, 3, M)."""
    largest: Array = _SPREAD * np.sqrt(dot(samples, samples).mean(axis=0))
    return largest


def _sum(rows: Array, sizes: Array) -> Array:
    """Return what numbers that are off by so much move (s, t) by at most."""
    return dot(np.abs(rows), sizes)
