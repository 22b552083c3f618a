"""Whether rays bend at surface points as they should: without any search, and well conditioned everywhere.

Snell's law says that `n_before d - n_after t` lies along the normal N; the law of reflection says it with n_before
twice. The part of that vector across N is the residual. It says nothing of the normal part, which |t| = 1 and the side
of t settle, so nothing here is amplified at the critical angle, or at grazing incidence. The paraxial rule gives the
direction behind the surface itself, up to its length: the part of t across that is its residual.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.selfcheck.hits import SAFETY, Hits
from lenscl.config import Scene

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_FAR_OFF = 1e30  # a residual that is no number


def bends(scene: Scene, hits: Hits, before: Array, after: Array, eps: float, mirrors: Mask) -> tuple[Array, Array]:
    """Return residuals and bounds, shape (N,), of rays that come to surface points along `before` and leave by `after`.

    A point on the edge of several faces is held to the one that serves best. Where no face has a normal that is known
    well enough, the bound is infinite. `mirrors`, shape (N,), says which rays meet a mirrored face.
    """
    every = [
        _bent(scene, hits, face, before, after, eps, *_indices(scene, hits, leaves), leaves, turns_back, mirrors)
        for face, leaves, turns_back in product(range(hits.turn.shape[1]), (False, True), (False, True))
    ]
    return _best(hits, every)


def bends_between(
    scene: Scene, hits: Hits, before: Array, after: Array, eps: float, n_before: Array, n_other: Array,
    turns_back: Mask, mirrors: Mask,
) -> tuple[Array, Array]:  # fmt: skip
    """Return the same as `bends` where the media on both sides are known, and whether the ray stays in the first.

    Parameters
    ----------
    n_before, n_other : float64 array, shape (N,)
        Refractive indices of the medium that a ray comes from, and of the one behind the surface.
    turns_back : bool array, shape (N,)
        Whether the ray goes on in the medium that it comes from.
    mirrors : bool array, shape (N,)
        Whether it meets a mirrored face.
    """
    every = []
    for face, leaves in product(range(hits.turn.shape[1]), (False, True)):
        through, back = (
            _bent(scene, hits, face, before, after, eps, n_before, n_other, leaves, turned, mirrors)
            for turned in (False, True)
        )
        every.append(tuple(np.where(turns_back, b, a) for a, b in zip(through, back, strict=True)))
    return _best(hits, every)


def mirrored(hits: Hits, before: Array) -> Array:
    """Return what total reflection makes of directions, by the normal of the face that is known best."""
    normal = hits.normal[np.arange(len(before)), np.argmin(hits.turn, axis=1)]
    turned: Array = before - 2.0 * _dot(before, normal)[:, None] * normal
    return turned


def _best(hits: Hits, every: Sequence[tuple[Array, ...]]) -> tuple[Array, Array]:
    """Return of several residuals and bounds of each ray those that serve best."""
    residual, bound = (np.stack(part) for part in zip(*every, strict=True))
    best = np.argmin(np.where(np.isfinite(bound), residual / bound, np.inf), axis=0)
    rays = np.arange(len(hits.turn))
    return residual[best, rays], np.where(np.isfinite(hits.turn).any(axis=1), bound[best, rays], np.inf)


def _indices(scene: Scene, hits: Hits, leaves: bool) -> tuple[Array, Array]:
    """Return the indices before and behind surfaces of lenses that are apart."""
    n_medium = np.full_like(hits.index, scene.n_medium)
    return (hits.index, n_medium) if leaves else (n_medium, hits.index)


def _bent(
    scene: Scene, hits: Hits, face: int, d: Array, t: Array, eps: float, n_before: Array, n_other: Array, leaves: bool,
    turns_back: bool, mirrors: Mask,
) -> tuple[Array, Array]:  # fmt: skip
    """Return the worst residual, with its bound, of a ray that meets one face from one side and goes to one side.

    A mirrored face turns it back, by the exact law of reflection. Nothing else does so where there is a way through.
    """
    turn = hits.turn[:, face]
    normal = -hits.normal[:, face] if leaves else hits.normal[:, face]  # against the ray
    n_after = n_before if turns_back else n_other
    eta = n_before / n_other
    aside = turn + SAFETY * eps  # of a cosine

    # It comes from the one side and goes to the other, or stays
    cos_before, cos_after = -_dot(d, normal), _dot(t, normal) if turns_back else -_dot(t, normal)
    pairs = [(-cos_before, aside), (-cos_after, aside)]

    with np.errstate(invalid="ignore", over="ignore"):
        is_exact = scene.numerics.snell == "exact"
        if mirrors.any() and not turns_back:
            pairs.append((np.where(mirrors, 1.0, 0.0), np.full_like(turn, eps)))
        if not (is_exact or turns_back):
            along = -cos_before[:, None] * normal
            ideal = along + eta[:, None] * (d - along)
            length = np.linalg.norm(ideal, axis=1)
            across = np.where(_dot(t, ideal) > 0.0, np.linalg.norm(np.cross(t, ideal), axis=1), length)
            pairs.append((across, SAFETY * eps * (1.0 + eta) + 2.0 * np.abs(1.0 - eta) * turn))
        else:
            change = n_before[:, None] * d - n_after[:, None] * t
            across = np.linalg.norm(np.cross(normal, change), axis=1)
            pairs.append((across, SAFETY * eps * (n_before + n_after) + turn * np.linalg.norm(change, axis=1)))
            if turns_back:  # only where there is no way through: the squared cosine there is not above zero
                sin = np.linalg.norm(np.cross(normal, d), axis=1)
                through = 1.0 - (eta * sin) ** 2 if is_exact else np.ones_like(turn)  # the paraxial rule has one always
                through_bound = SAFETY * eps * (1.0 + eta**2) + 2.0 * eta**2 * turn if is_exact else eps
                pairs.append((np.where(mirrors, 0.0, through), np.broadcast_to(through_bound, turn.shape)))
        residual, bound = (np.stack(part) for part in zip(*pairs, strict=True))
        residual = np.where(np.isfinite(residual), residual, _FAR_OFF)
        worst = np.argmax(np.where(np.isfinite(bound), residual / bound, 0.0), axis=0)
    rays = np.arange(len(turn))
    return np.maximum(residual[worst, rays], 0.0), bound[worst, rays]


def stopped(scene: Scene, hits: Hits, before: Array, eps: float) -> tuple[Array, Array]:
    """Return residuals and bounds of rays that end by total reflection at points: whether there is a way out."""
    best_residual, best_bound = np.zeros(len(before)), np.full(len(before), np.inf)
    smallest = np.full(len(before), np.inf)
    for face, leaves in product(range(hits.turn.shape[1]), (False, True)):
        normal = hits.normal[:, face]
        turned = before - 2.0 * _dot(before, normal)[:, None] * normal
        indices = _indices(scene, hits, leaves)
        none = np.zeros(len(before), np.bool_)
        residual, bound = _bent(scene, hits, face, before, turned, eps, *indices, leaves, True, none)
        with np.errstate(invalid="ignore"):
            ratio = np.where(np.isfinite(bound), residual / bound, np.inf)
        better = ratio < smallest
        smallest = np.where(better, ratio, smallest)
        best_residual = np.where(better, residual, best_residual)
        best_bound = np.where(better, bound, best_bound)
    return best_residual, best_bound


def _dot(a: Array, b: Array) -> Array:
    products: Array = np.einsum("ni,ni->n", a, b)
    return products
