"""The legs of rays: that the last ones land where the map says, and that nothing lies in the way of a leg."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.selfcheck.hits import SAFETY, Hits
from lenscl.accuracy.selfcheck.media import in_box, ranks
from lenscl.config import Lens, Picture, Scene
from lenscl.expr import evaluate_with_error, gradient
from lenscl.reference import Placement, land
from lenscl.tracing import near_legs, pairs_by_table

Array = NDArray[np.float64]

_SAMPLES = 48  # of the way through a lens's box: what is thinner than a part of it may be passed over here, too
_EVENLY = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
_CLOSE = 0.25 ** np.arange(4, 22)  # of a leg, from its ends
PARALLEL = 5e-7  # sine between normals; kernels/lens_nested.cl takes surfaces in contact as one up to twice that
_EDGE = 1e-6  # of the picture: what lands so close to its edge may be on it or beside it
_ROOM = 1e-3  # of a box: rounding takes no leg so far that enters the solid
_AT_ONCE = 2**14  # pairs of a leg and a lens
_ENOUGH = 0.5  # of the samples: where F is known at fewer, nothing is said of a leg
_EPS = float(np.finfo(np.float64).eps)


def landings(picture: Picture, origin: Array, direction: Array, st: Array, eps: float) -> tuple[Array, Array]:
    """Return how far places on a picture are from where legs meet its plane, and what rounding allows.

    Parameters
    ----------
    picture : Picture
    origin, direction : float64 arrays, shape (N, 3)
        Of last legs that land, as the kernel has them.
    st : float64 array, shape (N, 2)
        Where it says that they land.
    eps : float
        Of the precision that the rays were carried in.
    """
    solved, _ = land(origin, direction, picture)
    right, down, corner = (np.asarray(each) for each in (picture.right, picture.down, picture.corner))
    across = np.cross(right, down)
    normal = across / np.linalg.norm(across)
    steep = np.abs(direction @ normal)
    distance = np.abs((corner - origin) @ normal) / steep
    # A length that is off moves the place by as much over the cosine; duals are as long as the spans are thin
    dual = max(np.linalg.norm(right), np.linalg.norm(down)) / np.linalg.norm(across)
    length = np.linalg.norm(origin, axis=1) + np.linalg.norm(corner) + distance
    bound = SAFETY * eps * (dual * length / steep + np.abs(st).max(axis=1) + 1.0)
    return np.abs(solved - st).max(axis=1), bound


def to_picture(picture: Picture, origin: Array, direction: Array) -> Array:
    """Return how far legs, shape (N, 3), are from the picture's plane along them, scene units; negative behind them."""
    right, down, corner = (np.asarray(each) for each in (picture.right, picture.down, picture.corner))
    across = np.cross(right, down)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance: Array = (corner - origin) @ across / (direction @ across)
    return distance


def through_picture(
    picture: Picture, origin: Array, direction: Array, length: Array, eps: float
) -> tuple[Array, Array]:
    """Return how far legs go on behind a picture that stops light, or are from where it does, and what rounding allows.

    Parameters
    ----------
    picture : Picture
    origin, direction : float64 arrays, shape (N, 3)
    length : float64 array, shape (N,)
        Of the legs; infinite where nothing ends them.
    eps : float
        Of the precision that the rays were carried in.
    """
    distance = to_picture(picture, origin, direction)
    st, _ = land(origin, direction, picture)
    right, down, corner = (np.asarray(each) for each in (picture.right, picture.down, picture.corner))
    across = np.cross(right, down)
    steep = np.abs(direction @ across) / np.linalg.norm(across)
    with np.errstate(divide="ignore", invalid="ignore"):
        bound = SAFETY * eps * (np.linalg.norm(origin, axis=1) + np.linalg.norm(corner) + np.abs(distance)) / steep
        aside = bound / min(np.linalg.norm(right), np.linalg.norm(down))
        is_on = (np.abs(st - 0.5) < 0.5 - _EDGE - aside[:, None]).all(axis=1)
        depth = np.minimum(distance, length - distance)
    meets = is_on & np.isfinite(bound) & (depth > 0.0)
    return np.where(meets, depth, 0.0), np.where(np.isfinite(bound), bound, np.inf)


def on_picture(picture: Picture, at: Array, normal: Array, eps: float) -> NDArray[np.bool_]:
    """Return which surface points lie on a picture, to the rounding of the point, on a face parallel to it.

    `normal` is that of the face, unit, shape (N, 3).
    """
    right, down, corner = (np.asarray(each) for each in (picture.right, picture.down, picture.corner))
    across = np.cross(right, down) / np.linalg.norm(np.cross(right, down))
    off = np.abs((at - corner) @ across)
    st, _ = land(at - across, np.broadcast_to(across, at.shape), picture)
    lies: NDArray[np.bool_] = off <= SAFETY * eps * np.maximum(np.abs(at).max(axis=1), np.abs(corner).max())
    lies &= (np.abs(st - 0.5) < 0.5 - _EDGE).all(axis=1)
    lies &= np.linalg.norm(np.cross(normal, across), axis=1) <= PARALLEL
    return lies


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Clear:
    """Legs that must be free of surfaces; arrays of N.

    Attributes
    ----------
    origin, direction : float64 array, shape (N, 3)
        World; unit directions.
    length : float64 array, shape (N,)
        Up to the surface where they end; infinite where they end at none.
    within : int array, shape (N,)
        The number of the lens that they lie in, -1 where they lie in none.
    allowed : float64 array, shape (N,)
        How large |F| may be where they start and end on surfaces.
    """

    origin: Array = field(repr=False)
    direction: Array = field(repr=False)
    length: Array = field(repr=False)
    within: NDArray[np.intp] = field(repr=False)
    allowed: Array = field(repr=False)

    def some(self, which: NDArray[np.bool_]) -> Clear:
        """Return some of these legs."""
        return Clear(**{name: getattr(self, name)[which] for name in self.__slots__})

    def and_also(self, others: Clear) -> Clear:
        """Return these legs, and others behind them."""
        return Clear(**{name: np.concatenate([getattr(self, name), getattr(others, name)]) for name in self.__slots__})


def obstacles(scene: Scene, legs: Clear, eps: float, *, nests: bool = False) -> tuple[Array, Array]:
    """Return how deep legs go through what they should not, in terms of F, and what rounding allows there.

    A leg around the lenses must not go through any; one within a lens must stay in it, and where solids may overlap
    also go through none of higher priority. The bound is infinite where F is known at too few places of the leg to
    tell.

    Parameters
    ----------
    scene : Scene
    legs : Clear
    eps : float
        Of the precision that the rays were carried in.
    nests : bool
        Whether solids may touch or overlap. Legs are then looked at close to their ends as well, where surfaces that
        are not quite in contact leave a gap, and those within a lens in all of their length.
    """
    n = len(legs.origin)
    rank = np.append(ranks(scene), -1)  # -1: around all lenses
    share = np.concatenate([_EVENLY, *((_CLOSE, 1.0 - _CLOSE) if nests else ())])
    depth, bound = np.zeros(n), np.ones(n)
    unknown = np.zeros(n, np.bool_)
    for group, leg, number in pairs_by_table(scene.lenses, *_pairs(scene, legs, nests)):
        lens, placement = group.lens, Placement.of(group.lens.solid)
        start = placement.point_to_local(legs.origin[leg] - group.centres[number - group.first])
        along = placement.vector_to_local(legs.direction[leg])
        within, length, allowed = legs.within[leg], legs.length[leg], legs.allowed[leg]
        enter, leave = _span(lens, start, along)
        leave = np.minimum(leave, length)
        if nests:
            stays = within == number
            enter, leave = np.where(stays, 0.0, enter), np.where(stays, length, leave)
            looks = (rank[number] >= rank[within]) & (leave > enter)
        else:
            looks = ((within == -1) | (within == number)) & (leave > enter)
        for some in _parts(np.flatnonzero(looks)):
            deep, most, tells = _deepest(
                lens, start[some], along[some], enter[some], leave[some], share, allowed[some],
                within[some] == number[some], eps, nests=nests,
            )  # fmt: skip
            at = leg[some]
            np.logical_or.at(unknown, at, ~tells)
            # Of the lenses on a leg the one that it goes through deepest, in terms of what rounding allows
            order = np.lexsort((-np.arange(len(at)), deep / most, at))
            last = order[np.append(at[order][1:] != at[order][:-1], True)]
            deeper = deep[last] / most[last] > (depth / bound)[at[last]]
            depth[at[last[deeper]]], bound[at[last[deeper]]] = deep[last[deeper]], most[last[deeper]]
    return depth, np.where((depth <= bound) & unknown, np.inf, bound)


def _pairs(scene: Scene, legs: Clear, nests: bool) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the pairs of a leg and the number of a lens that it may go through, or, where solids nest, lies in."""
    leg, number = near_legs(scene.lenses, legs.origin, legs.direction, legs.length, _ROOM)
    if not nests:
        return leg, number
    (inside,) = np.nonzero(legs.within >= 0)
    every = np.column_stack([np.append(leg, inside), np.append(number, legs.within[inside])])
    leg, number = np.unique(every, axis=0).T
    return leg, number


def _parts(some: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    return np.split(some, range(_AT_ONCE, len(some), _AT_ONCE)) if some.size else []


def _deepest(
    lens: Lens, start: Array, along: Array, enter: Array, leave: Array, share: Array, allowed: Array,
    stays: NDArray[np.bool_], eps: float, *, nests: bool,
) -> tuple[Array, Array, NDArray[np.bool_]]:  # fmt: skip
    """Return how deep legs go through a lens where they should not, what is allowed, and whether F is known enough.

    Legs, shape (N, 3), are those of the lens's own space, at the origin; `stays` says which are to stay in it.
    """
    samples = len(share)
    t = enter[:, None] + share * (leave - enter)[:, None]
    points = (start[:, None] + t[:, :, None] * along[:, None]).reshape(-1, 3)
    values: dict[str, Any] = {**lens.values, **dict(zip("xyz", points.T, strict=True))}
    f, rounding = (np.broadcast_to(each, len(points)) for each in evaluate_with_error(lens.surface.expression, values))
    slopes = [evaluate_with_error(each, values)[0] for each in gradient(lens.surface.expression)]
    slope = sum(np.abs(np.broadcast_to(each, len(points))) for each in slopes)
    if nests:  # what is out of its box is out of the solid, by so much
        f = np.where(
            in_box(lens, points, is_local=True), f, np.maximum(np.where(np.isfinite(f), np.abs(f), 0.0), slope)
        )
    size = np.abs(points).max(axis=1) + np.repeat(np.abs(start).max(axis=1), samples)
    most = SAFETY * (rounding * eps / _EPS + slope * eps * size) + np.repeat(allowed, samples)
    wrong = np.maximum(np.where(np.repeat(stays, samples), f, -f), 0.0)
    tells = np.isfinite(most) & np.isfinite(f)
    ratio = np.divide(wrong, most, out=np.zeros(len(points)), where=tells & (wrong > 0.0))
    worst = ratio.reshape(-1, samples).argmax(axis=1) + np.arange(len(start)) * samples
    is_deep = ratio[worst] > 0.0
    return (
        np.where(is_deep, wrong[worst], 0.0),
        np.where(is_deep, most[worst], 1.0),
        tells.reshape(-1, samples).mean(axis=1) >= _ENOUGH,
    )


def _span(lens: Lens, start: Array, along: Array) -> tuple[Array, Array]:
    """Return where legs enter and leave a lens's box, ahead of their start; not beyond where they miss it."""
    low, high = (np.asarray(corner) for corner in lens.surface.box(lens.values))
    with np.errstate(divide="ignore", invalid="ignore"):
        first, second = (low - start) / along, (high - start) / along
    outside = ((along == 0) & ((start < low) | (start > high))).any(axis=1)
    enter = np.where(along == 0, 0.0, np.minimum(first, second)).max(axis=1)
    leave = np.where(along == 0, np.inf, np.maximum(first, second)).min(axis=1)
    enter = np.maximum(enter, 0.0)
    return enter, np.where(outside | ~np.isfinite(leave), enter, leave)


def sides(hits: Hits, before: Array) -> NDArray[np.int8]:
    """Return 1 where rays come to surface points from within, -1 from without, 0 where nobody can tell; shape (N,)."""
    along = np.einsum("ni,nfi->nf", before, hits.normal)
    lies_on = np.isfinite(hits.turn)
    within, without = ((~lies_on | (sign * along > hits.turn)).all(axis=1) for sign in (1.0, -1.0))
    told = lies_on.any(axis=1)
    side: NDArray[np.int8] = np.where(told & within, 1, np.where(told & without, -1, 0)).astype(np.int8)
    return side
