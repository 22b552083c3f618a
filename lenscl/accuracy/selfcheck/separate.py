"""The surface points of paths through solids that are apart: each is one lens's surface, with the medium around it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.selfcheck.bends import bends, stopped
from lenscl.accuracy.selfcheck.hits import Hits, Tolerance, candidates, chosen
from lenscl.accuracy.selfcheck.legs import Clear, sides
from lenscl.accuracy.selfcheck.mirrors import met_mirrors
from lenscl.accuracy.selfcheck.walk import Interfaces, Walk
from lenscl.config import Scene

Array = NDArray[np.float64]


def separate(scene: Scene, walk: Walk, eps: float) -> Interfaces:
    """Return what is known of a walk's surface points.

    Parameters
    ----------
    scene : Scene
        Whose solids are apart.
    walk : Walk
    eps : float
        Of the precision that the rays were carried in.
    """
    event, ray, n = walk.event, walk.ray, len(walk.ray)

    # Where two lenses touch a ray may have met either
    hits, others, touches = candidates(scene, walk.at, eps, Tolerance.of(scene, eps))
    residual, bound = _bends(scene, walk, hits, eps)
    mirrors, unsure = met_mirrors(scene, walk, hits, eps)
    if touches.any():
        r, b = _bends(scene, walk, others, eps)
        better = touches & np.isfinite(b) & ~(residual / bound <= r / b)
        residual, bound = np.where(better, r, residual), np.where(better, b, bound)
        hits, others = chosen(better, hits, others), chosen(better, others, hits)
        mirrors, unsure = met_mirrors(scene, walk, hits, eps)

    face = np.argmin(hits.turn, axis=1)
    leaves = np.einsum("ni,ni->n", walk.before, hits.normal[np.arange(n), face]) > 0.0
    sums = np.zeros(walk.points.shape[:2])  # a search that starts on a surface takes off what F is there
    sums[event + 1, ray] = hits.bound

    blocks = np.concatenate([np.full(len(group), scene.stops_light(group)) for group in scene.lenses.groups])
    ends = blocks[hits.lens] & ~mirrors
    agrees = (ends == walk.is_blocked) | (touches & (blocks[others.lens] == walk.is_blocked))

    # Legs that must be free: of each ray the first one, the one up to where it ended, and the one behind all lenses
    side = np.where(touches, 0, sides(hits, walk.before))
    free = (event == 0) | ((walk.is_blocked | walk.is_reflected) & (event < walk.most))
    free &= walk.finite & (side != 0)
    allowed = np.zeros(len(walk.ends.events))
    np.maximum.at(allowed, ray, np.where(np.isfinite(hits.bound), hits.bound, np.inf))
    legs = Clear(
        origin=walk.start[free], direction=walk.before[free], length=walk.length[free],
        within=np.where(side[free] > 0, hits.lens[free], -1), allowed=allowed[ray[free]],
    )  # fmt: skip
    return Interfaces(
        hits=hits,
        value_bound=np.cumsum(sums, axis=0)[event + 1, ray],
        residual=residual,
        bound=bound,
        n_before=np.where(leaves, hits.index, scene.n_medium),
        n_after=np.where(leaves, scene.n_medium, hits.index),
        ratio=np.maximum(hits.index / scene.n_medium, scene.n_medium / hits.index),
        agrees=agrees,
        tells=np.isfinite(hits.bound) & ~unsure,
        legs=legs,
        leg_of=np.flatnonzero(free),
        allowed=allowed,
        apart=np.zeros(n),
        turned=np.zeros(n),
        in_contact=np.zeros(n, np.bool_),
        twice=np.zeros(n, np.bool_),
    )


def _bends(scene: Scene, walk: Walk, hits: Hits, eps: float) -> tuple[Array, Array]:
    mirrors, unsure = met_mirrors(scene, walk, hits, eps)
    residual, bound = bends(scene, hits, walk.before, walk.after, eps, mirrors)
    bound = np.where(unsure, np.inf, bound)
    if walk.is_reflected.any():  # and ended there, in the direction in which it came
        r, b = stopped(scene, hits, walk.before, eps)
        residual, bound = np.where(walk.is_reflected, r, residual), np.where(walk.is_reflected, b, bound)
    return residual, bound
