"""Which medium points lie in where solids touch or overlap: by the signs of F alone, as far as rounding shows them.

Where solids overlap the one of the highest priority is the medium, of equals the later one (Schmidt & Budge, Simple
nested dielectrics in ray traced images, JGT 7(2), 2002). A sign is known where |F| is beyond what rounding makes of it;
a medium is known where the signs of all solids are that may decide. Nothing here asks what a kernel made of a ray.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.selfcheck.hits import SAFETY
from lenscl.config import Lens, Scene
from lenscl.expr import evaluate_with_error, gradient
from lenscl.reference import Placement
from lenscl.tracing import near_points

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Media = NDArray[np.intp]  # numbers of lenses, or one of the following

AROUND = -1  # all solids
UNKNOWN = -2
_DOUBLE = float(np.finfo(np.float64).eps)
_OUT_OF_BOX = 1e-6  # of its extent: beyond that no point lies in the solid, whatever rounding does
NEAR = 1e-3  # of the extent of a box, and of its distance: no point of the solid lies so far out of it
_SHARES = np.array([8, 4, 12, 6, 10, 2, 14, 7, 9, 5, 11, 3, 13, 1, 15]) / 16  # of a leg, from its middle outwards
_NEAREST = 16.0  # roundings from a surface point, where its sides begin to be told
_FARTHEST = 1e-3  # of the size of the scene's numbers there


def ranks(scene: Scene) -> NDArray[np.intp]:
    """Return of each lens, by number, how many others give way to it where solids overlap."""
    found = np.empty(len(scene.lenses), dtype=np.intp)
    found[list(scene.by_priority())] = np.arange(len(found))
    return found


def values_of(lens: Lens, points: Array, eps: float) -> tuple[Array, Array]:
    """Return F at points, shape (N, 3), world, and what rounding makes of it there; infinite outside the lens's box.

    Parameters
    ----------
    lens : Lens
    points : float64 array, shape (N, 3)
    eps : float
        Of the precision that the points are known in.
    """
    placement = Placement.of(lens)
    local = placement.point_to_local(points)
    at: dict[str, Any] = {**lens.values, **dict(zip("xyz", local.T, strict=True))}
    with np.errstate(all="ignore"):
        f, rounding = (np.broadcast_to(e, len(points)) for e in evaluate_with_error(lens.surface.expression, at))
        slopes = [evaluate_with_error(each, at)[0] for each in gradient(lens.surface.expression)]
        slope = sum(np.abs(np.broadcast_to(each, len(points))) for each in slopes)
        size = np.abs(local).max(axis=1) + np.abs(placement.centre / placement.stretch).max()
        most = SAFETY * (rounding * eps / _DOUBLE + slope * eps * size)
    return np.where(in_box(lens, points), f, np.inf), most


def in_box(lens: Lens, points: Array, *, is_local: bool = False) -> Mask:
    """Return which points, shape (N, 3), world or the lens's own, lie in its box, or beside it by a little."""
    local = points if is_local else Placement.of(lens).point_to_local(points)
    low, high = (np.asarray(corner) for corner in lens.surface.box(lens.values))
    slack = _OUT_OF_BOX * (high - low)
    found: Mask = ((local >= low - slack) & (local <= high + slack)).all(axis=1)
    return found


def media_at(scene: Scene, points: Array, eps: float, allowed: Array | float = 0.0) -> Media:
    """Return the number of the lens that is the medium at each point, `AROUND` or `UNKNOWN`; shape (N,).

    Parameters
    ----------
    scene : Scene
    points : float64 array, shape (N, 3)
        World, scene units.
    eps : float
        Of the precision that they are known in.
    allowed : float or float64 array, shape (N,)
        How far surfaces may be displaced besides, in terms of F.
    """
    media = np.full(len(points), AROUND)
    near = np.unique(near_points(scene.lenses, points, NEAR, NEAR)[1])
    for number in near[np.argsort(ranks(scene)[near])].tolist():
        f, most = values_of(scene.lenses[number], points, eps)
        with np.errstate(invalid="ignore"):
            most = most + allowed
            within, without = f < -most, f > most
        outside = np.isposinf(f)
        media = np.where(within, number, np.where(without | outside, media, UNKNOWN))
    return media


def media_along(scene: Scene, start: Array, end: Array, eps: float, allowed: Array) -> Media:
    """Return the medium of legs from some points to others, shape (N, 3): where it is known nearest to their middle."""
    media = np.full(len(start), UNKNOWN)
    for share in _SHARES:
        left = np.flatnonzero(media == UNKNOWN)
        if not left.size:
            break
        media[left] = media_at(scene, start[left] + share * (end - start)[left], eps, allowed[left])
    return media


def media_beside(scene: Scene, at: Array, along: Array, eps: float, allowed: Array) -> tuple[Media, Array]:
    """Return the medium beside surface points on one side, along unit vectors, and how far from them it is known."""
    media, known = np.full(len(at), UNKNOWN), np.zeros(len(at))
    size = np.abs(at).max(axis=1) + max(np.abs(group.centres).max() for group in scene.lenses.groups)
    size += max(lens_size(group.lens) for group in scene.lenses.groups)
    distance = _NEAREST * eps
    while distance < _FARTHEST:
        left = np.flatnonzero(media == UNKNOWN)
        if not left.size:
            break
        points = at[left] + (distance * size[left])[:, None] * along[left]
        media[left], known[left] = media_at(scene, points, eps, allowed[left]), distance * size[left]
        distance *= 4.0
    return media, known


def lens_size(lens: Lens) -> float:
    """Return the way through a lens's box, scene units."""
    placement, box = Placement.of(lens), np.array(lens.surface.box(lens.values), dtype=np.float64)
    linear = np.abs((placement.point_to_world(np.eye(3)) - placement.centre).T)
    return float(np.linalg.norm(linear @ (box[1] - box[0])))


def index_of(scene: Scene, media: Media) -> Array:
    """Return the refractive indices of media; no number where they are unknown."""
    of_lenses = [np.full(len(group), group.lens.n) for group in scene.lenses.groups]
    indices = np.concatenate([*of_lenses, [np.nan, scene.n_medium]])  # the last two: -2 and -1
    found: Array = indices[media]
    return found


def blocks(scene: Scene, media: Media) -> Mask:
    """Return which media end rays; False where they are unknown."""
    of_lenses = [np.full(len(group), scene.stops_light(group)) for group in scene.lenses.groups]
    opaque = np.concatenate([*of_lenses, [False, False]])
    found: Mask = opaque[media]
    return found
