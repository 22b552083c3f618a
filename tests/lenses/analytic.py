"""Rays through the solids of optics in closed form: quadratics for the faces, Snell's law by angles, in long double.

No part of it is shared with the program: a solid is a list of faces, each with its own roots, its explicit sag and its
normal; a root is an event where it lies behind no other face.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Wide = np.longdouble
UNSURE = 1e-9  # nearer to an edge, or to grazing, rounding may decide


class Face(Protocol):
    """A face of a solid: where a ray meets its whole surface, how far points lie beyond it, and which way it looks."""

    def roots(self, o: Array, d: Array) -> Array:
        """Return every t with o + t d on the surface, shape (N, k), NaN where there are fewer."""

    def beyond(self, p: Array) -> Array:
        """Return how far points lie outside, shape (N,); negative inside."""

    def slope(self, p: Array) -> Array:
        """Return a vector along the outward normal, shape (N, 3)."""


def _dot(a: Array, b: Array) -> Array:
    return (a * b).sum(-1)


def _quadratic(a: Array, b: Array, c: Array) -> Array:
    """Return the roots of a t^2 + 2 b t + c, without cancellation."""
    with np.errstate(all="ignore"):
        q = -(b + np.copysign(np.sqrt(b * b - a * c), b))
        return np.stack([q / a, c / q], -1)


@dataclass(frozen=True)
class Plane:
    normal: tuple[float, float, float]
    offset: float

    def roots(self, o: Array, d: Array) -> Array:
        n = np.array(self.normal, Wide)
        with np.errstate(all="ignore"):
            return ((self.offset - o @ n) / (d @ n))[:, None]

    def beyond(self, p: Array) -> Array:
        return p @ np.array(self.normal, Wide) - self.offset

    def slope(self, p: Array) -> Array:
        return np.broadcast_to(np.array(self.normal, Wide), p.shape)


@dataclass(frozen=True)
class Round:
    """x^2 + y^2 = (radius + m (tip - z))^2: a cylinder (m = 0), or the half of a cone that lies below its tip."""

    radius: float
    m: float = 0.0
    tip: float = 0.0

    def roots(self, o: Array, d: Array) -> Array:
        width, narrows = self.radius + self.m * (self.tip - o[:, 2]), -self.m * d[:, 2]
        return _quadratic(
            _dot(d[:, :2], d[:, :2]) - narrows**2,
            _dot(o[:, :2], d[:, :2]) - width * narrows,
            _dot(o[:, :2], o[:, :2]) - width**2,
        )

    def beyond(self, p: Array) -> Array:
        return np.hypot(p[:, 0], p[:, 1]) - (self.radius + self.m * (self.tip - p[:, 2]))

    def slope(self, p: Array) -> Array:
        r = np.hypot(p[:, 0], p[:, 1])
        return np.stack([p[:, 0] / r, p[:, 1] / r, 0 * r + self.m], -1)


@dataclass(frozen=True)
class Ball:
    r: float

    def roots(self, o: Array, d: Array) -> Array:
        return _quadratic(_dot(d, d), _dot(o, d), _dot(o, o) - Wide(self.r) ** 2)

    def beyond(self, p: Array) -> Array:
        return np.sqrt(_dot(p, p)) - self.r

    def slope(self, p: Array) -> Array:
        return p


@dataclass(frozen=True)
class Sag:
    """z = vertex + sag(r), the solid behind it (side 1) or before it (side -1)."""

    c: float
    vertex: float
    side: int
    k: float = 0.0
    even: tuple[float, ...] = (0.0, 0.0, 0.0)
    samples: int = 600  # along a ray, where there are even terms
    reach: float = 1.5

    def sag(self, q: Array) -> Array:
        a4, a6, a8 = self.even
        with np.errstate(invalid="ignore"):
            square = 1 - (1 + Wide(self.k)) * Wide(self.c) ** 2 * q
            root = np.sqrt(np.where((square < 0) & (square > -UNSURE), 0, square))  # points of a rim where it ends
        return self.c * q / (1 + root) + q**2 * (a4 + a6 * q + a8 * q**2)

    def beyond(self, p: Array) -> Array:
        found = self.side * (self.vertex + self.sag(p[..., 0] ** 2 + p[..., 1] ** 2) - p[..., 2])
        return np.where(np.isnan(found), np.inf, found)

    def slope(self, p: Array) -> Array:
        q = p[:, 0] ** 2 + p[:, 1] ** 2
        a4, a6, a8 = self.even
        with np.errstate(invalid="ignore", divide="ignore"):
            root = np.sqrt(1 - (1 + Wide(self.k)) * Wide(self.c) ** 2 * q)
            rise = self.c / root + 4 * a4 * q + 6 * a6 * q**2 + 8 * a8 * q**3  # of the sag with r, over r
        return self.side * np.stack([rise * p[:, 0], rise * p[:, 1], 0 * q - 1], -1)

    def roots(self, o: Array, d: Array) -> Array:
        if any(self.even):
            return self._searched(o, d)
        w, one_k = o[:, 2] - self.vertex, 1 + Wide(self.k)
        t = _quadratic(
            self.c * (_dot(d[:, :2], d[:, :2]) + one_k * d[:, 2] ** 2),
            self.c * (_dot(o[:, :2], d[:, :2]) + one_k * w * d[:, 2]) - d[:, 2],
            self.c * (_dot(o[:, :2], o[:, :2]) + one_k * w**2) - 2 * w,
        )
        with np.errstate(invalid="ignore"):
            near_sheet = 1 - one_k * self.c * (w[:, None] + t * d[:, 2:]) > 0
        return np.where(near_sheet, t, np.nan)

    def _searched(self, o: Array, d: Array) -> Array:
        """By samples within `reach` of the point nearest to the origin, and halving."""
        t = -_dot(o, d)[:, None] + np.linspace(-self.reach, self.reach, self.samples)

        def at(rows: Array, t: Array) -> Array:
            z = o[rows, 2] + t * d[rows, 2]
            q = (o[rows, 0] + t * d[rows, 0]) ** 2 + (o[rows, 1] + t * d[rows, 1]) ** 2
            return self.vertex + self.sag(q) - z

        return _halved(at, t, len(o))


@dataclass(frozen=True)
class Height:
    """z = vertex + sag(x, y), the solid behind it (side 1) or before it (side -1); roots by samples and halving."""

    sag: Callable[[Array, Array], Array]  # analytic: its slopes are taken by complex steps
    vertex: float
    side: int
    samples: int = 600  # along a ray
    reach: float = 1.5

    def beyond(self, p: Array) -> Array:
        with np.errstate(invalid="ignore"):
            found = self.side * (self.vertex + self.sag(p[..., 0], p[..., 1]) - p[..., 2])
        return np.where(np.isnan(found), np.inf, found)

    def slope(self, p: Array) -> Array:
        step = Wide(1e-30)
        x, y = p[:, 0].astype(np.clongdouble), p[:, 1].astype(np.clongdouble)
        rises = [self.sag(x + 1j * step, y).imag / step, self.sag(x, y + 1j * step).imag / step]
        return self.side * np.stack([*rises, 0 * p[:, 0] - 1], -1)

    def roots(self, o: Array, d: Array) -> Array:
        t = -_dot(o, d)[:, None] + np.linspace(-self.reach, self.reach, self.samples)

        def at(rows: Array, t: Array) -> Array:
            x, y, z = (o[rows, i] + t * d[rows, i] for i in range(3))
            with np.errstate(invalid="ignore"):
                return self.vertex + self.sag(x, y) - z

        return _halved(at, t, len(o))


def _halved(at: Callable[[Array, Array], Array], t: Array, count: int) -> Array:
    """Return where a function of rays' numbers and places changes its sign between samples, (N, k), NaN for fewer."""
    values = at(np.arange(count)[:, None], t)
    with np.errstate(invalid="ignore"):
        changes = values[:, 1:] * values[:, :-1] <= 0
    rows, places = np.nonzero(changes)
    low, high, falls = t[rows, places], t[rows, places + 1], values[rows, places] > 0
    for _ in range(60):
        middle = (low + high) / 2
        before = (at(rows, middle) > 0) == falls
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    found = np.full((count, max(1, int(changes.sum(1).max(initial=0)))), np.nan, Wide)
    found[rows, (np.cumsum(changes, 1) - 1)[rows, places]] = low
    return found


def _lens(front: Sag, back: Sag, values: Mapping[str, float]) -> list[Face]:
    return [front, back, Round(values["diameter"] / 2)]


def _radii(signs: tuple[int, int], names: tuple[str, str]) -> Callable[[Mapping[str, float]], list[Face]]:
    def faces(v: Mapping[str, float]) -> list[Face]:
        c1, c2 = (sign / v[name] if sign else 0.0 for sign, name in zip(signs, names, strict=True))
        return _lens(Sag(c1, -v["thickness"] / 2, 1), Sag(c2, v["thickness"] / 2, -1), v)

    return faces


def _conics(v: Mapping[str, float]) -> list[Face]:
    a, b = (tuple(v.get(f"{letter}{power}", 0.0) for power in (4, 6, 8)) for letter in "AB")
    half = v["thickness"] / 2
    return _lens(Sag(v["c1"], -half, 1, v["k1"], a), Sag(v["c2"], half, -1, v["k2"], b), v)


def _ends(half: float) -> list[Face]:
    return [Plane((0, 0, 1), half), Plane((0, 0, -1), half)]


def _prism(v: Mapping[str, float]) -> list[Face]:
    half = math.radians(v["apex"] / 2)
    s, c = Wide(math.sin(half)), Wide(math.cos(half))
    height = v["side"] * c
    sides: list[Face] = [Plane((0, s, c), s * 2 * height / 3), Plane((0, s, -c), s * 2 * height / 3)]
    return [
        *sides,
        Plane((0, -1, 0), height / 3),
        Plane((1, 0, 0), v["length"] / 2),
        Plane((-1, 0, 0), v["length"] / 2),
    ]


def _conic(c: float, k: float, q: Array) -> Array:
    return c * q / (1 + np.sqrt(1 - (1 + Wide(k)) * Wide(c) ** 2 * q))


def _cylinders(v: Mapping[str, float]) -> list[Face]:
    half = v["thickness"] / 2
    return [
        Height(lambda x, y: _conic(v["c1"], v["k1"], y * y) + 0 * x, -half, 1),
        Height(lambda x, y: _conic(v["c2"], v["k2"], y * y) + 0 * x, half, -1),
        *(Plane((side, 0, 0), v["width"] / 2) for side in (1, -1)),
        *(Plane((0, side, 0), v["height"] / 2) for side in (1, -1)),
    ]


def _toric(cx: float, cy: float) -> Callable[[Array, Array], Array]:
    """Return the sag of a circle of curvature cy turned about the line x = 0, z = 1 / cx."""

    def sag(x: Array, y: Array) -> Array:
        s = _conic(cy, 0.0, y * y)
        if cx == 0.0:
            return s + 0 * x
        radius = 1 / Wide(cx)
        return radius - np.sign(cx) * np.sqrt((radius - s) ** 2 - x * x)

    return sag


def _torics(v: Mapping[str, float]) -> list[Face]:
    half = v["thickness"] / 2
    front, back = _toric(v["c1x"], v["c1y"]), _toric(v["c2x"], v["c2y"])
    return [Height(front, -half, 1), Height(back, half, -1), Round(v["diameter"] / 2)]


def _aspheres(v: Mapping[str, float]) -> list[Face]:
    def sag(c: float, k: float, letter: str) -> Callable[[Array, Array], Array]:
        terms = [(power, v[f"{letter}{power}"]) for power in range(1, 21) if f"{letter}{power}" in v]

        def at(x: Array, y: Array) -> Array:
            q = x * x + y * y
            r = np.sqrt(q)
            return _conic(c, k, q) + sum((value * r**power for power, value in terms), 0 * r)

        return at

    half = v["thickness"] / 2
    return [
        Height(sag(v["c1"], v["k1"], "A"), -half, 1),
        Height(sag(v["c2"], v["k2"], "B"), half, -1),
        Round(v["diameter"] / 2),
    ]


def _wedge(v: Mapping[str, float]) -> list[Face]:
    angle = np.deg2rad(Wide(v["angle"]))
    s, c, half = np.sin(angle), np.cos(angle), v["thickness"] / 2
    sides = (((1, 0, 0), "width"), ((-1, 0, 0), "width"), ((0, 1, 0), "height"), ((0, -1, 0), "height"))
    return [Plane((0, 0, -1), half), Plane((0, s, c), c * half), *(Plane(n, v[key] / 2) for n, key in sides)]


def _box(v: Mapping[str, float]) -> list[Face]:
    return [
        Plane(tuple(side * (i == j) for i in range(3)), v[key] / 2) for j, key in enumerate("abc") for side in (1, -1)
    ]


def _planes(v: Mapping[str, float]) -> list[Face]:
    count = len(v) // 4
    rows = [[v[f"{name}{i}"] for name in "abcd"] for i in range(1, count + 1)]
    return [
        Plane(tuple(Wide(x) / np.linalg.norm(row[:3]) for x in row[:3]), row[3] / np.linalg.norm(row[:3]))
        for row in rows
    ]


FACES: dict[str, Callable[[Mapping[str, float]], list[Face]]] = {
    "biconvex": _radii((1, -1), ("R1", "R2")),
    "plano_convex": _radii((1, 0), ("R", "")),
    "meniscus": _radii((1, 1), ("R1", "R2")),
    "ball": lambda v: [Ball(v["diameter"] / 2)],
    "rod": lambda v: [Round(v["diameter"] / 2), *_ends(v["length"] / 2)],
    "prism": _prism,
    "cone": lambda v: [
        Round(0.0, v["diameter"] / 2 / Wide(v["height"]), v["height"] / 2),
        Plane((0, 0, -1), v["height"] / 2),
    ],
    "conic_singlet": _conics,
    "even_asphere_singlet": _conics,
    "biconcave": _radii((-1, 1), ("R1", "R2")),
    "half_ball": lambda v: [Sag(2 / v["diameter"], -v["diameter"] / 4, 1), Plane((0, 0, 1), v["diameter"] / 4)],
    "drum": lambda v: [Ball(v["length"] / 2), Round(v["diameter"] / 2)],
    "cylindrical_singlet": _cylinders,
    "toroidal_singlet": _torics,
    "asphere_singlet": _aspheres,
    "box": _box,
    "wedge": _wedge,
    "polyhedron": _planes,
}


@dataclass(frozen=True)
class Paths:
    """The ends of rays as `lenscl.RayPaths` has them, and which of them rounding might lead elsewhere."""

    origin: Array
    direction: Array
    events: Array
    unsure: Array
    reflected: Array  # how many events were total reflections


def trace(faces: list[Face], origin: Array, direction: Array, n: float, n_medium: float, most: int) -> Paths:
    """Follow rays that start outside, total reflections included, up to so many events."""
    o, d = origin.astype(Wide), direction.astype(Wide)
    d = d / np.sqrt(_dot(d, d))[:, None]
    count = len(o)
    inside, on = np.zeros(count, bool), np.full(count, -1)
    events, reflected, unsure = np.zeros(count, int), np.zeros(count, int), np.zeros(count, bool)
    alive = np.arange(count)
    while alive.size:
        t, face, close = _next(faces, o[alive], d[alive], on[alive])
        unsure[alive] |= close
        met = (face >= 0) & (events[alive] < most)
        alive, t, face = alive[met], t[met], face[met]
        o[alive] += t[:, None] * d[alive]
        events[alive] += 1
        on[alive] = face
        normal = np.zeros((len(alive), 3), Wide)
        for i, each in enumerate(faces):
            normal[face == i] = each.slope(o[alive[face == i]])
        with np.errstate(invalid="ignore"):  # on a rim that a conic ends in; such rays are unsure
            normal /= np.sqrt(_dot(normal, normal))[:, None]
        against = np.where(inside[alive], -1, 1)[:, None] * normal
        cosine = -_dot(d[alive], against)
        unsure[alive] |= ~(np.abs(cosine) >= 1e-4)
        ratio = np.where(inside[alive], Wide(n) / n_medium, Wide(n_medium) / n)
        across = d[alive] + cosine[:, None] * against
        square = 1 - ratio**2 * _dot(across, across)
        unsure[alive] |= np.abs(square) < 1e-6
        total = square < 0
        bent = ratio[:, None] * across - np.sqrt(np.where(total, 0, square))[:, None] * against
        d[alive] = np.where(total[:, None], d[alive] + 2 * cosine[:, None] * against, bent)
        reflected[alive] += total
        inside[alive] ^= ~total
    return Paths(o, d, events, unsure, reflected)


def _next(faces: list[Face], o: Array, d: Array, on: Array) -> tuple[Array, Array, Array]:
    """Return the next event's t, its face (-1: none), and whether an edge is so near that rounding may decide."""
    best, which, close = np.full(len(o), np.inf, Wide), np.full(len(o), -1), np.zeros(len(o), bool)
    for i, face in enumerate(faces):
        t = face.roots(o, d)
        if isinstance(face, Round) and face.m:  # past its tip, two roots are one to the root of rounding
            past = np.cross(np.array([0, 0, face.tip]) - o, d)
            close |= _dot(past, past) < 1e-12
        with np.errstate(invalid="ignore"):
            known = np.argmin(np.where(np.isnan(t), np.inf, np.abs(t)), -1)
            t[(on == i).nonzero()[0], known[on == i]] = np.nan  # where the ray stands
            for k in range(t.shape[1]):
                place = t[:, k]
                p = o + place[:, None] * d
                out = np.full(len(o), -np.inf, Wide)
                for j, other in enumerate(faces):
                    if j != i:
                        out = np.fmax(out, other.beyond(p))
                if isinstance(face, Round) and face.m:
                    out = np.fmax(out, p[:, 2] - face.tip)  # the half of the cone beyond its tip
                ahead = place > 0
                close |= ahead & (np.abs(out) < UNSURE) & (place < best + UNSURE)
                nearer = ahead & (out <= 0) & (place < best)
                best, which = np.where(nearer, place, best), np.where(nearer, i, which)
    return best, which, close
