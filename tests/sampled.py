"""A slow ray tracer that knows nothing of lenscl: a text evaluated by numpy, dense sampling, bisection, Snell's law.

`compared` sets the rays of lenscl beside it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import lenscl
from lenscl import RayStatus
from lenscl.config import Scene
from lenscl.tracing import RayPaths

Array = NDArray[np.float64]
Field = Callable[[Array], Array]  # F at points, shape (..., 3)
_WORDS = {
    name: getattr(np, name) for name in ("sqrt", "cbrt", "exp", "log", "sin", "cos", "tan", "tanh", "hypot", "abs")
}
_WORDS |= {name: getattr(np, name) for name in ("sinh", "cosh", "sign", "floor", "mod", "pi")}
_WORDS |= {"asin": np.arcsin, "acos": np.arccos, "atan": np.arctan}
_HALVINGS = 60
_MOST_EVENTS = 16


def field(text: str, **values: float) -> Field:
    """Return F of a text, as Python and numpy read it."""

    def largest(*args: Any) -> Any:
        return np.max(np.broadcast_arrays(*args), axis=0)

    def smallest(*args: Any) -> Any:
        return np.min(np.broadcast_arrays(*args), axis=0)

    words = _WORDS | {"max": largest, "min": smallest, "pow": np.power, "atan2": np.arctan2}
    code = compile(text.replace("^", "**"), "F", "eval")

    def at(points: Array) -> Array:
        x, y, z = np.moveaxis(points, -1, 0)
        with np.errstate(all="ignore"):
            found: Array = eval(code, {"__builtins__": {}}, {**words, **values, "x": x, "y": y, "z": z})
        return np.broadcast_to(found, x.shape)

    return at


@dataclass(frozen=True)
class Sampled:
    """Where rays went: last points and directions, shape (N, 3), their events, and whether sampling tells."""

    origin: Array
    direction: Array
    events: NDArray[np.int64]
    sure: NDArray[np.bool_]


def film_rays(scene: Scene) -> tuple[Array, Array]:
    """Return a scene's rays, shape (N, 3): from its point source through the middles of the film's pixels."""
    film = scene.film
    columns, rows = film.size
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    corner, right, down = (np.asarray(each, float) for each in (film.corner, film.right, film.down))
    points = corner + (j.ravel()[:, None] + 0.5) / columns * right + (i.ravel()[:, None] + 0.5) / rows * down
    source = np.asarray(scene.source.at, float)
    way = points - source
    return np.broadcast_to(source, way.shape).copy(), way / np.linalg.norm(way, axis=1, keepdims=True)


def sampled(F: Field, origin: Array, direction: Array, index: float, half: float, samples: int = 600) -> Sampled:
    """Follow rays through one solid about the origin, within a ball of radius `half`, by its field alone."""
    o, d = origin.copy(), direction.copy()
    inside = np.zeros(len(o), bool)
    events = np.zeros(len(o), np.int64)
    sure = np.ones(len(o), bool)
    alive = np.ones(len(o), bool)
    step = 1e-6 * half
    for _ in range(_MOST_EVENTS):
        rays = np.flatnonzero(alive)
        if not rays.size:
            break
        middle = -np.sum(o[rays] * d[rays], axis=1)
        reach = np.sqrt(np.maximum(half**2 - np.sum((o[rays] + middle[:, None] * d[rays]) ** 2, axis=1), 0.0))
        start = np.maximum(middle - reach, np.where(events[rays] > 0, step, 0.0))
        t = start[:, None] + np.linspace(0, 1, samples) * np.maximum(middle + reach - start, 0.0)[:, None]
        values = F(o[rays, None] + t[..., None] * d[rays, None])
        side = np.where(inside[rays], -1.0, 1.0)[:, None]
        crossed = side * values < 0.0
        met = crossed.any(axis=1)
        first = crossed.argmax(axis=1)
        # Where a local least value is small next to the change from sample to sample, a chord may lie between
        size = side * values
        least = (size[:, 1:-1] < size[:, :-2]) & (size[:, 1:-1] < size[:, 2:])
        hidden = least & (size[:, 1:-1] < np.maximum(size[:, :-2], size[:, 2:]) - size[:, 1:-1])
        before = np.arange(1, samples - 1) < np.where(met, first, samples)[:, None]
        sure[rays] &= ~(hidden & before).any(axis=1) & ~(met & (first == 0)) & ~np.isnan(values).any(axis=1)
        alive[rays[~met]] = False
        rays, t, first, side = rays[met], t[met], first[met], side[met, 0]
        low, high = (t[np.arange(len(t)), np.maximum(first - back, 0)] for back in (1, 0))
        for _ in range(_HALVINGS):
            mid = 0.5 * (low + high)
            beyond = side * F(o[rays] + mid[:, None] * d[rays]) < 0.0
            low, high = np.where(beyond, low, mid), np.where(beyond, mid, high)
        o[rays] += (0.5 * (low + high))[:, None] * d[rays]
        normal = np.stack([F(o[rays] + h) - F(o[rays] - h) for h in step * np.eye(3)], axis=1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        d[rays], through = _bent(d[rays], normal, np.where(inside[rays], index, 1.0 / index))
        inside[rays] ^= through
        events[rays] += 1
    return Sampled(o, d, events, sure & ~alive)


def _bent(d: Array, normal: Array, eta: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Refract unit directions, eta = n before over n behind; or reflect them, and say which are refracted."""
    c = np.sum(d * normal, axis=1)
    k = 1.0 - eta**2 * (1.0 - c**2)
    through = k >= 0.0
    along = np.where(through, np.sign(c) * np.sqrt(np.maximum(k, 0.0)) - eta * c, 0.0)
    turned = np.where(through[:, None], eta[:, None] * d + along[:, None] * normal, d - 2.0 * c[:, None] * normal)
    return turned / np.linalg.norm(turned, axis=1, keepdims=True), through


def off(found: Sampled, origin: Array, direction: Array) -> Array:
    """Return how far last legs are apart, shape (N,): of their points and directions."""
    apart = np.linalg.norm(found.direction - direction, axis=1)
    return np.asarray(np.maximum(apart, np.linalg.norm(np.cross(origin - found.origin, direction), axis=1)))


@dataclass(frozen=True)
class Compared:
    """Rays of lenscl and of sampling: which of them, shape (N,), both decide, and how far their last legs are apart."""

    paths: RayPaths
    said: Sampled
    told: NDArray[np.bool_]
    apart: Array


def compared(scene: Scene, F: Field, half: float, chosen: NDArray[np.bool_] | slice = slice(None)) -> Compared:
    """Trace the film's rays, or those chosen, through one lens of index 1.5 within a ball of radius `half`, both ways.

    Rays that meet nothing are not told.
    """
    origin, direction = (each[chosen] for each in film_rays(scene))
    said = sampled(F, origin, direction, 1.5, half)
    paths = lenscl.trace_rays(scene, origin, direction)
    told = said.sure & (paths.status != RayStatus.UNDECIDED) & (paths.events > 0)
    return Compared(paths, said, told, off(said, paths.origin, paths.direction))
