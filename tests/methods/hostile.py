"""Rays that try to make a search of first roots fail: tangent, grazing, along axes, from the surface itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens
from lenscl.expr import differentiate, evaluate, gradient
from lenscl.tracing import Placement

Array = NDArray[np.float64]
_PROJECTIONS = 60  # of Newton's steps to the surface; a thin tube is a double root until they are near
_SHRINK = 2.0**-12  # of the box: rays start so far within it, yet outside the solid; no step into the box rounds them


@dataclass(frozen=True, eq=False)
class Rays:
    """N rays: where they start, just inside the lens's box, unit directions, and how long they are in the box."""

    origin: Array
    direction: Array
    length: Array
    ordinary: NDArray[np.bool_]

    def some(self, which: NDArray[Any]) -> Rays:
        """Return the rays of a mask or of indices."""
        return Rays(self.origin[which], self.direction[which], self.length[which], self.ordinary[which])

    def rounded(self) -> Rays:
        """Return the rays as single precision has them."""
        origin, direction = (np.asarray(each, np.float32).astype(float) for each in (self.origin, self.direction))
        return Rays(origin, direction, self.length, self.ordinary)


class Aim:
    """Makes rays at one lens, which stands untouched at the origin."""

    def __init__(self, lens: Lens, seed: int) -> None:
        self.lens, self.rng = lens, np.random.default_rng(seed)
        box = Placement.of(lens).box
        self.low, self.high = box + _SHRINK * (box[1] - box[0]) * np.array([[1.0], [-1.0]])
        self.size = float(np.linalg.norm(self.high - self.low))

    def rays(self, count: int) -> Rays:
        """Return rays from all round: half of them aimed anywhere in the box, half hostile."""
        makers = (self.aimed, self.tangent, self.asymptotic, self.grazing, self.along_axes, self.thin)
        shares = (count // 2, *[count // 10] * 5)  # and half as many again: not all are kept
        parts = [make(share + share // 2) for make, share in zip(makers, shares, strict=True)]
        through, direction = (np.concatenate(each) for each in zip(*parts, strict=True))
        rays = self.entering(through, direction, np.arange(len(through)) < len(parts[0][0]))
        shuffled = self.rng.permutation(len(rays.length))
        kinds = [shuffled[rays.ordinary[shuffled] == kind][: count // 2] for kind in (True, False)]
        return rays.some(np.concatenate(kinds))

    def entering(
        self, through: Array, direction: Array, ordinary: NDArray[np.bool_], enter: float | None = None
    ) -> Rays:
        """Return rays from where they enter the box (or from `enter`), along directions that `trace_rays` leaves alone.

        What does not meet the box is left out, and so is a direction that does not settle as a unit vector.
        """
        for _ in range(4):
            direction = unit(direction)
        with np.errstate(divide="ignore", invalid="ignore"):
            sides = (self.low - through) / direction, (self.high - through) / direction
        start, end = np.fmin(*sides).max(axis=1), np.fmax(*sides).min(axis=1)
        kept = (start < end) & np.all(unit(direction) == direction, axis=1)
        start = start if enter is None else np.full(len(end), enter)
        origin = through + np.where(kept, start, 0.0)[:, None] * direction
        return Rays(origin, direction, end - start + 4 * _SHRINK * self.size, ordinary).some(kept)

    def aimed(self, count: int) -> tuple[Array, Array]:
        """Anywhere in the box, from all round."""
        return self.rng.uniform(self.low, self.high, (count, 3)), self.rng.normal(size=(count, 3))

    def grazing(self, count: int) -> tuple[Array, Array]:
        """Through the faces and edges of the tight box, where the solid touches them, and tiny distances from them."""
        through, direction = self.aimed(count)
        low, high = (np.asarray(corner) for corner in self.lens.surface.box(self.lens.values))
        onto = self.rng.random((count, 3)) < 0.4
        face = np.where(self.rng.random((count, 3)) < 0.5, low, high)
        through = np.where(onto, face * (1.0 - self._tiny((count, 3))), through)
        return through, direction * np.where(onto, 0.0 + self._tiny((count, 3)), 1.0)

    def along_axes(self, count: int) -> tuple[Array, Array]:
        """Along x, y or z, or tilted a little; on planes and axes of symmetry, or a little beside."""
        direction = np.eye(3)[self.rng.integers(0, 3, count)] * self._signs((count, 1))
        tilts = self.rng.random((count, 3)) < 0.3
        through = self.rng.uniform(self.low, self.high, (count, 3))
        where = self.rng.random((count, 3))
        through = np.where(where < 0.2, 0.0, np.where(where < 0.4, self._tiny((count, 3)), through))
        return through, direction + np.where(tilts, self._tiny((count, 3)), 0.0)

    def tangent(self, count: int) -> tuple[Array, Array]:
        """Past a point of the surface at 1e-2 ... 1e-12 of the box's size on either side, along any tangent."""
        point, normal = self.surface_points(count)
        side, _ = self._tangents(normal)
        return point + self.size * self._tiny((count, 1)) * normal, side + self._tilts(count) * normal

    def asymptotic(self, count: int) -> tuple[Array, Array]:
        """The same along a direction in which the surface does not bend, where it has one: nearly triple roots."""
        point, normal = self.surface_points(count)
        u, v = self._tangents(normal)
        at = self._at(point)
        second = [[np.broadcast_to(evaluate(differentiate(slope, axis), at), count) for axis in "xyz"] for slope in
                  gradient(self.lens.surface.expression)]  # fmt: skip
        hessian = np.transpose(second, (2, 0, 1))
        uu, uv, vv = (np.einsum("ni,nij,nj->n", a, hessian, b) for a, b in ((u, u), (u, v), (v, v)))
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            share = (np.sqrt(uv**2 - uu * vv) - uv) / vv
        bends = np.where(np.isfinite(share), share, 0.0)[:, None]
        return point + self.size * self._tiny((count, 1)) * normal, u + bends * v + self._tilts(count) * normal

    def thin(self, count: int) -> tuple[Array, Array]:
        """Through points little below the surface, in any direction; an eighth at the local origin and where z is 0."""
        point, normal = self.surface_points(count)
        point = point - self.size * np.abs(self._tiny((count, 1))) * normal
        eighth = slice(0, count // 8)
        point[eighth] *= np.where(self.rng.random((count // 8, 3)) < 0.5, 1.0, self._tiny((count // 8, 3)))
        return point, self.rng.normal(size=(count, 3))

    def starting(self, count: int) -> Rays:
        """Return rays that start in the box: a third on the surface, to rounding, the others down to 1e-15 beside it.

        Half of them run along it, tilted to it by little.
        """
        point, normal = self.surface_points(count)
        beside = self._signs((count, 1)) * self.size * 10.0 ** self.rng.uniform(-15.0, -1.0, (count, 1))
        away = np.where(self.rng.random((count, 1)) < 1 / 3, 0.0, beside)
        along = self._tangents(normal)[0] + self._tiny((count, 1)) * normal
        direction = np.where(self.rng.random((count, 1)) < 0.5, along, self.rng.normal(size=(count, 3)))
        rays = self.entering(point + away * normal, direction, np.zeros(count, dtype=bool), enter=0.0)
        return rays.some(np.all((rays.origin > self.low) & (rays.origin < self.high), axis=1))

    def surface_points(self, count: int) -> tuple[Array, Array]:
        """Return points of the surface, to rounding, and unit normals."""
        found: list[Array] = []
        while sum(map(len, found)) < count:
            p, good = self.onto(self.rng.uniform(self.low, self.high, (2 * count, 3)))
            found.append(p[good & np.all((p > self.low) & (p < self.high), axis=1)])
        point = np.concatenate(found)[:count]
        return point, unit(self.slopes(point))

    def onto(self, point: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return where Newton's steps along the gradient take points, and whether that is the surface, to rounding."""
        p = point
        with np.errstate(all="ignore"):
            for _ in range(_PROJECTIONS):
                step = self._step(p)
                far = np.linalg.norm(step, axis=1, keepdims=True) / (0.1 * self.size)
                p = p - step / np.maximum(far, 1.0)
            good = np.linalg.norm(self._step(p), axis=1) < 1e-13 * self.size
        return p, good

    def values(self, point: Array) -> Array:
        """Return F at points."""
        return evaluate(self.lens.surface.expression, self._at(point))

    def slopes(self, point: Array) -> Array:
        """Return grad F at points, shape (N, 3)."""
        parts = [evaluate(slope, self._at(point)) for slope in gradient(self.lens.surface.expression)]
        return np.stack([np.broadcast_to(part, len(point)) for part in parts], axis=1)

    def _step(self, point: Array) -> Array:
        slopes = self.slopes(point)
        step: Array = (self.values(point) / np.sum(slopes**2, axis=1))[:, None] * slopes
        return step

    def _at(self, point: Array) -> dict[str, Array | float]:
        return {**self.lens.values, **dict(zip("xyz", point.T, strict=True))}

    def _tangents(self, normal: Array) -> tuple[Array, Array]:
        u = unit(np.cross(normal, self.rng.normal(size=normal.shape)))
        return u, np.cross(normal, u)

    def _tilts(self, count: int) -> Array:
        return np.where(self.rng.random((count, 1)) < 0.3, self._tiny((count, 1)), 0.0)

    def _tiny(self, shape: tuple[int, ...]) -> Array:
        """Return numbers of either sign, from 1e-2 down to 1e-12."""
        return self._signs(shape) * 10.0 ** self.rng.uniform(-12.0, -2.0, shape)

    def _signs(self, shape: tuple[int, ...]) -> Array:
        return np.where(self.rng.random(shape) < 0.5, -1.0, 1.0)


def unit(v: Array) -> Array:
    """Return unit vectors, by the operations of `trace_rays`."""
    scaled = v / np.abs(v).max(axis=1, keepdims=True)
    shortened: Array = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
    return shortened
