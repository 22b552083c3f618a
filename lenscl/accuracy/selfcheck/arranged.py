"""The surface points of paths through solids that touch or overlap: which media they part, and by which surfaces.

The media are told from the signs of F along the legs before and behind a point. What was crossed there is any of the
surfaces that the point lies on; those of solids in contact are one interface. A surface that changes no medium is no
event, and a leg may go through it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.selfcheck.bends import bends_between, mirrored
from lenscl.accuracy.selfcheck.hits import SAFETY, Hits, Tolerance, chosen, hits_on_each, rank_of
from lenscl.accuracy.selfcheck.legs import PARALLEL, Clear, on_picture
from lenscl.accuracy.selfcheck.media import (
    AROUND,
    UNKNOWN,
    Media,
    blocks,
    index_of,
    media_along,
    media_beside,
)
from lenscl.accuracy.selfcheck.mirrors import met_mirrors_between
from lenscl.accuracy.selfcheck.walk import LEAVES, Interfaces, Walk
from lenscl.config import Scene

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Pixels = NDArray[np.intp]
_CLOSE = 4.0  # times as far as a sign is known: from there on another surface is no matter


def arranged(scene: Scene, walk: Walk, eps: float) -> Interfaces:
    """Return what is known of a walk's surface points.

    Parameters
    ----------
    scene : Scene
        Whose solids may touch or overlap.
    walk : Walk
    eps : float
        Of the precision that the rays were carried in.
    """
    event, ray = walk.event, walk.ray
    every = hits_on_each(scene, walk.at, eps, Tolerance.of(scene, eps))
    rank = np.stack([rank_of(hits) for hits in every])
    bounds = np.stack([hits.bound for hits in every])
    on = (rank <= 1.0) & np.isfinite(bounds)
    nearest = _nearest(every)

    # A search that starts on a surface takes off what F is there, at events and at what is passed between them
    most = np.where(on, bounds, 0.0).max(axis=0, initial=0.0)
    allowed = (2.0 * np.bincount(ray, most, minlength=len(walk.ends.events))).astype(np.float64)

    before, after, beyond = _media(scene, walk, every, on, eps, allowed)
    turns_back = before == after
    other = np.where(turns_back | walk.is_blocked, beyond, after)
    n_before, n_other = index_of(scene, before), index_of(scene, other)
    told = np.isfinite(n_before) & np.isfinite(n_other)

    mirrors, unsure = met_mirrors_between(scene, walk, on, before, other, eps)
    told &= ~unsure

    # Of the surfaces that the point lies on the one that serves best
    residual, bound, best = np.zeros(len(ray)), np.full(len(ray), np.inf), nearest.copy()
    smallest = np.full(len(ray), np.inf)
    for number, hits in enumerate(every):
        held = on[number] | (nearest == number)
        if not held.any():
            continue
        goes = np.where(walk.is_reflected[:, None], mirrored(hits, walk.before), walk.after)
        r, b = bends_between(scene, hits, walk.before, goes, eps, n_before, n_other, turns_back, mirrors)
        with np.errstate(invalid="ignore"):
            ratio = np.where(np.isfinite(b), r / b, np.inf)
        better = held & (ratio < smallest)
        smallest, best = np.where(better, ratio, smallest), np.where(better, number, best)
        residual, bound = np.where(better, r, residual), np.where(better, b, bound)
    hits = _picked(every, best)
    apart, turned = _contact(every, on, best, hits, walk.before)
    on_screen = np.zeros(len(ray), np.bool_)
    if walk.screen is not None:
        normal = hits.normal[np.arange(len(ray)), np.argmin(hits.turn, axis=1)]
        on_screen = on_picture(walk.screen, walk.at, normal, eps)
    sums = np.zeros(walk.points.shape[:2])
    sums[event + 1, ray] = hits.bound

    is_opaque = (blocks(scene, before) | blocks(scene, other)) & ~mirrors
    tells = ((before != UNKNOWN) & (other != UNKNOWN) | is_opaque) & ~unsure
    known = walk.finite & (before != UNKNOWN)
    indices = [scene.n_medium, *(group.lens.n for group in scene.lenses.groups)]
    legs = Clear(
        origin=walk.start[known], direction=walk.before[known], length=walk.length[known], within=before[known],
        allowed=allowed[ray[known]],
    )  # fmt: skip
    return Interfaces(
        hits=hits,
        value_bound=np.cumsum(sums, axis=0)[event + 1, ray] + hits.bound,
        residual=residual,
        bound=np.where(told, bound, np.inf),
        n_before=n_before,
        n_after=np.where(turns_back, n_before, n_other),
        ratio=np.full(len(ray), max(indices) / min(indices)),
        agrees=is_opaque == walk.is_blocked,
        tells=tells,
        legs=legs,
        leg_of=np.flatnonzero(known),
        allowed=allowed,
        unseen=int((walk.finite & ~known).sum()),
        apart=np.where(np.isnan(apart), 0.0, apart),
        turned=turned,
        in_contact=np.isfinite(apart) | on_screen,
        twice=_twice(walk, eps) | on_screen,
    )


def _media(
    scene: Scene, walk: Walk, every: Sequence[Hits], on: Mask, eps: float, allowed: Array
) -> tuple[Media, Media, Media]:
    """Return the media before points, behind them along the rays, and beyond the surfaces there; each shape (M,).

    Beyond is looked only where a ray turns back or ends.
    """
    event, ray = walk.event, walk.ray
    before = media_along(scene, walk.start, walk.at, eps, allowed[ray])
    following = np.full((walk.most + 2, len(walk.ends.events)), UNKNOWN)
    following[event, ray] = before
    leaves = walk.last & np.isin(walk.ends.status[ray], LEAVES)
    after = np.where(leaves, AROUND, np.where(walk.is_reflected, before, following[event + 1, ray]))
    stopped = np.flatnonzero(np.isfinite(walk.landing).all(axis=1))
    after[stopped] = media_along(scene, walk.at[stopped], walk.landing[stopped], eps, allowed[ray[stopped]])
    goes_on = np.flatnonzero(~leaves & ~walk.is_blocked & ~walk.is_reflected & (walk.last | (event + 1 == walk.most)))
    after[goes_on] = _beside(scene, walk, every, goes_on, walk.after[goes_on], eps, allowed)

    beyond = np.full(len(ray), UNKNOWN)
    nearest = _nearest(every)
    hits = _picked(every, nearest)
    asks = np.flatnonzero(walk.is_blocked | ((before == after) & (before != UNKNOWN)))
    asks = asks[np.isfinite(hits.turn[asks]).any(axis=1)]
    normal = hits.normal[asks, np.argmin(hits.turn[asks], axis=1)]
    turn = np.where(np.einsum("ni,ni->n", walk.before[asks], normal) < 0.0, -1.0, 1.0)
    found = _beside(scene, walk, every, asks, turn[:, None] * normal, eps, allowed)
    # Beside an edge the normal of one face may lead back into the medium before it
    is_edge = (np.isfinite(hits.turn[asks]).sum(axis=1) > 1) | (on[:, asks].sum(axis=0) > 1)
    beyond[asks] = np.where(is_edge & (found == before[asks]), UNKNOWN, found)
    return before, after, beyond


def _beside(
    scene: Scene, walk: Walk, every: Sequence[Hits], which: Pixels, along: Array, eps: float, allowed: Array
) -> Media:
    """Return the media beside some surface points along vectors.

    A medium is not told where another surface lies closer than where its sign is known: a gap that rounding hides.
    """
    if not which.size:
        return np.zeros(0, np.intp)
    at = walk.at[which]
    media, distance = media_beside(scene, at, along, eps, allowed[walk.ray[which]])
    same = SAFETY * eps * np.abs(at).max(axis=1)
    nearest = _nearest(every)[which]
    for number, hits in enumerate(every):
        with np.errstate(invalid="ignore"):
            off = hits.value[which] / hits.slope[which]
        media[(nearest != number) & (off > same) & (off <= _CLOSE * distance)] = UNKNOWN
    return media


def _nearest(every: Sequence[Hits]) -> Pixels:
    """Return of each point the lens on whose surface it lies most likely."""
    nearest: Pixels = np.argmin(np.stack([rank_of(hits) for hits in every]), axis=0)
    return nearest


def _contact(every: Sequence[Hits], on: Mask, best: Pixels, hits: Hits, before: Array) -> tuple[Array, Array]:
    """Return how far surfaces in contact may be from each other along rays, and how far normals may be turned.

    The former is no number where a point lies on one surface only, or on those of an edge.
    """
    rays = np.arange(len(best))
    normal = hits.normal[rays, np.argmin(hits.turn, axis=1)]
    steep = np.abs(np.einsum("ni,ni->n", before, normal))
    apart, turned = np.full(len(best), np.nan), np.zeros(len(best))
    for number, other in enumerate(every):
        face = np.argmin(other.turn, axis=1)
        sine = np.linalg.norm(np.cross(other.normal[rays, face], normal), axis=1)
        known = np.isfinite(other.turn[rays, face]) & np.isfinite(hits.turn).any(axis=1)
        joins = on[number] & on[best, rays] & (best != number) & known & (sine <= PARALLEL)
        with np.errstate(divide="ignore", invalid="ignore"):
            gap = (other.bound / other.slope + hits.bound / hits.slope) / steep
        apart = np.where(joins, np.fmax(apart, np.where(np.isfinite(gap), gap, np.nan)), apart)
        turned = np.where(joins, np.maximum(turned, sine + other.turn[rays, face] + other.swing[rays, face]), turned)
    return apart, turned


def _twice(walk: Walk, eps: float) -> Mask:
    """Return where rays are said to meet the next surface at the same place, to the rounding of the point."""
    again = ~walk.last & (walk.event + 1 < walk.most)
    following = walk.points[np.minimum(walk.event + 2, walk.most), walk.ray]
    size = np.maximum(np.abs(walk.at), np.abs(following)).max(axis=1)
    near: Mask = again & (np.linalg.norm(following - walk.at, axis=1) <= SAFETY * eps * size)
    return near


def _picked(every: Sequence[Hits], which: Pixels) -> Hits:
    """Return of each point what the lens of a number is there."""
    made = every[0]
    for number, hits in enumerate(every):
        made = chosen(which == number, made, hits)
    return made
