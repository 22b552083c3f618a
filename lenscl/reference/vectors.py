"""Vectors of three balls."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from flint import arb

    Vector = tuple[arb, arb, arb]


def vector(numbers: Sequence[float]) -> Vector:
    """Make three exact numbers a vector."""
    from flint import arb

    x, y, z = (arb(float(each)) for each in numbers)
    return x, y, z


def dot(a: Vector, b: Vector) -> arb:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def turned(rows: Iterable[Any], v: Vector) -> Vector:
    """Multiply a matrix, by its rows, with a vector."""
    x, y, z = (dot(tuple(row), v) for row in rows)
    return x, y, z


def plus(a: Vector, b: Vector) -> Vector:
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def minus(a: Vector, b: Vector) -> Vector:
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def times(k: arb, v: Vector) -> Vector:
    """Return k v."""
    return k * v[0], k * v[1], k * v[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product, right-handed."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def unit(v: Vector) -> Vector:
    """Scale to length one; not finite where the length may be zero."""
    length = dot(v, v).sqrt()
    return v[0] / length, v[1] / length, v[2] / length
