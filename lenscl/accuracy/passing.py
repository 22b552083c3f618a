"""Surfaces that a ray crosses within one medium: how many there are on a leg, and what each adds to the rounding.

Where solids overlap, the surface of one may lie within another that is the medium there: kernels/trace_nested.cl. A ray
that crosses it is not bent, but its origin moves there, and so the ray's line is rounded once more.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.meeting import Glass, U, dot, mapped
from lenscl.expr import evaluate

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_LOOKS, _MOST_LOOKS = 32, 2**13  # places on a leg where the sign of F is taken
_UNSEEN = 2  # surfaces that may lie between two such places
_GOLDEN = (5.0**0.5 - 1.0) / 2.0  # places that follow no period of F
_AT_ONCE = 2**10  # legs: their places fit into caches


def inside(glass: Glass, points: Array) -> Mask:
    """Say of which world points, shape (3, M), F is negative."""
    found = np.zeros(points.shape[1], bool)
    near = np.flatnonzero(glass.holds(points))
    if near.size:
        local = glass.placement.local(points[:, near].T)
        values = {**glass.lens.values, **dict(zip("xyz", local.T, strict=True))}
        found[near] = evaluate(glass.lens.surface.expression, values) < 0.0
    return found


def crossed(glass: Glass, start: Array, end: Array, is_in: tuple[Mask, Mask], is_on: tuple[Mask, Mask]) -> Array:
    """Return how many times legs cross a lens's surface between their ends, at most.

    Parameters
    ----------
    glass : Glass
    start, end : float64 array, shape (3, M)
        World.
    is_in, is_on : pairs of bool arrays, shape (M,)
        Whether the leg lies in the solid just behind its start and just before its end; and whether these lie on the
        lens's surface, which is then not counted.
    """
    differs = is_in[0] != is_in[1]
    if glass.lens.surface.is_convex:
        once: Array = np.where(is_in[0] | is_on[0] | is_on[1], 0.0, 2.0 * _meets_box(glass, start, end))
        return np.where(differs, 1.0, once)
    most = np.where(differs | is_in[0] | _meets_box(glass, start, end), np.inf, 0.0)
    some = np.flatnonzero(most)
    for first in range(0, len(some), _AT_ONCE):
        part = some[first : first + _AT_ONCE]
        most[part] = _UNSEEN + _changes(glass, start[:, part], end[:, part], is_in[0][part], is_in[1][part])
    if glass.lens.surface.sign_polynomial(glass.lens.values) is not None:
        most = np.minimum(most, glass.lens.surface.degree or np.inf)
    return most


def _changes(glass: Glass, start: Array, end: Array, first: Mask, last: Mask) -> Array:
    """Return how many changes of F's sign are seen between ends of known sign, with as many looks as it takes."""
    seen = np.full(start.shape[1], -1.0)
    rays, looks = np.arange(start.shape[1]), _LOOKS
    while rays.size and looks <= _MOST_LOOKS:
        at = (np.arange(looks) + 0.25 + 0.5 * (np.arange(looks) * _GOLDEN % 1.0))[:, None] / looks
        places = start[:, None, rays] + at * (end - start)[:, None, rays]
        signs = inside(glass, places.reshape(3, -1)).reshape(looks, -1)
        signs = np.concatenate([first[None, rays], signs, last[None, rays]])
        changes = np.count_nonzero(signs[1:] != signs[:-1], axis=0)
        finer = changes > seen[rays]  # more looks see more, or all have been seen
        seen[rays] = np.maximum(seen[rays], changes)
        rays, looks = rays[finer], 2 * looks
    return seen


def _meets_box(glass: Glass, start: Array, end: Array) -> Mask:
    """Say which legs may meet a lens's box: not those that lie beyond one of its faces."""
    ends = np.stack([glass.placement.local(each.T) for each in (start, end)])
    low, high = glass.placement.box
    beyond = (ends.max(axis=0) < low) | (ends.min(axis=0) > high)
    meets: Mask = ~beyond.any(axis=1)
    return meets


def displaced(glass: Glass, start: Array, direction: Array, end: Array) -> Array:
    """Return a bound on how far a ray is moved across by the rounding of one crossing, shape (3, M), world.

    The terms are those of `Glass.met`, for a point anywhere between `start` and `end`.
    """
    placement = glass.placement
    sizes, lengths = np.abs(placement.to_local), np.abs(placement.to_world)
    centre = placement.centre[:, None]
    off = np.maximum(np.abs(start - centre), np.abs(end - centre))
    leg = np.sqrt(dot(end - start, end - start))
    reach, rates = mapped(sizes, off), mapped(sizes, np.abs(direction))
    turned = glass.rotated * off.sum(axis=0)
    searched = mapped(lengths, U * (4.0 * reach + 5.0 * leg * rates + 2.0 * reach)) + turned
    told = mapped(lengths, U * (2.0 * reach + 3.0 * leg * rates))
    placed = U * (4.0 * mapped(lengths, reach) + np.maximum(np.abs(start), np.abs(end))) + turned
    moved: Array = searched + told + placed
    return moved
