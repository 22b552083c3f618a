"""Rays that are aimed, and their cases, for the families of hard cases.

Lenses stand untouched at the origin unless said otherwise.
"""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens
from lenscl.expr import evaluate, gradient
from lenscl.hardcases import Array, Case

Rays = tuple[Array, Array]  # origins and directions, shape (N, 3)

TINY = 10.0 ** -np.arange(2.0, 13.0)  # 1e-2 ... 1e-12
_PROJECTIONS = 60  # Newton's steps to the surface; a thin tube is a double root until they are near


def aimed_case(name: str, family: str, why: str, scene: str, some: Rays, **more: Any) -> Case:
    """Return the case of a scene's text and some rays; `more` as `Case` has it."""
    return Case(name=name, family=family, why=why, scene=scene, origins=some[0], directions=some[1], **more)


def generator(name: str) -> np.random.Generator:
    """Return random numbers of a case's own."""
    return np.random.default_rng(int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "little"))


def unit(vectors: Any) -> Array:
    """Return vectors, shape (..., 3), scaled to length 1."""
    array = np.asarray(vectors, np.float64)
    scaled: Array = array / np.linalg.norm(array, axis=-1, keepdims=True)
    return scaled


def both_signs(sizes: Array) -> Array:
    """Return numbers and their negatives, and 0 between them."""
    return np.concatenate([sizes, [0.0], -sizes[::-1]])


def rays(origins: Any, directions: Any) -> Rays:
    """Return rays from points and directions that are broadcast against each other."""
    o, d = np.broadcast_arrays(np.asarray(origins, np.float64), np.asarray(directions, np.float64))
    return o.reshape(-1, 3).copy(), d.reshape(-1, 3).copy()


def joined(*parts: Rays) -> Rays:
    """Return the rays of all parts."""
    origins, directions = zip(*parts, strict=True)
    return np.concatenate(origins), np.concatenate(directions)


def from_afar(points: Any, directions: Any, distance: float) -> Rays:
    """Return rays that pass through points, starting so far before them."""
    ahead = unit(directions)
    return rays(np.asarray(points, np.float64) - distance * ahead, ahead)


def down_on(random: np.random.Generator, count: int, width: float, height: float = 4.0, slant: float = 0.3) -> Rays:
    """Return rays that come down from a plane z = height, through a square of z = 0, a little slanted."""
    at = np.column_stack([random.uniform(-width, width, (count, 2)), np.zeros(count)])
    ahead = np.column_stack([random.uniform(-slant, slant, (count, 2)), -np.ones(count)])
    return rays(at - height * ahead / ahead[:, 2:] * -1.0, ahead)


def tangents(lens: Lens, random: np.random.Generator, points: int, offsets: Array, distance: float) -> Rays:
    """Return rays past points of a surface, each at every offset along its normal, outwards where it is more than 0."""
    place, normal = surface_points(lens, random, points)
    along = unit(np.cross(normal, unit(random.normal(size=(points, 3)))))
    through = place[:, None] + offsets[:, None] * normal[:, None]
    return from_afar(through, np.broadcast_to(along[:, None], through.shape), distance)


def surface_points(lens: Lens, random: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Return points of a surface and its unit normals there, shape (N, 3), by Newton's method from within its box."""
    expression, slopes = lens.surface.expression, gradient(lens.surface.expression)
    low, high = (np.asarray(corner) for corner in lens.surface.box(lens.values))
    place = random.uniform(low, high, (20 * count, 3))
    with np.errstate(all="ignore"):
        for _ in range(_PROJECTIONS):
            value, normal = _at(expression, lens, place), _slopes(slopes, lens, place)
            place = place - value[:, None] * normal / (normal * normal).sum(axis=1, keepdims=True)
        value, normal = _at(expression, lens, place), _slopes(slopes, lens, place)
        steep = np.linalg.norm(normal, axis=1)
        near = np.abs(value) <= 1e-14 * steep * np.linalg.norm(high - low)
    good = np.flatnonzero(near & (place >= low).all(axis=1) & (place <= high).all(axis=1))[:count]
    if len(good) < count:
        raise SystemExit(f"{lens.formula}: only {len(good)} points of its surface were found")
    return place[good], unit(normal[good])


def _at(expression: Any, lens: Lens, place: Array) -> Array:
    values = {**lens.values, **dict(zip("xyz", place.T, strict=True))}
    found: Array = np.broadcast_to(evaluate(expression, values), len(place))
    return found


def _slopes(slopes: Any, lens: Lens, place: Array) -> NDArray[np.float64]:
    return np.stack([_at(slope, lens, place) for slope in slopes], axis=1)
