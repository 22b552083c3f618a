"""What the surfaces of a scene are at the points where rays are said to have met them, and how exactly that is known.

Everything is evaluated anew in float64, from the lens as the study states it, by the twin's placement. Bounds are for
numbers of the precision that the rays were carried in: a point is known to its rounding, so F there is known to
|grad F| times that and the rounding of F itself, and the normal to how far it turns within the point's rounding and to
the rounding of its own gradient. A bound has a factor of `SAFETY` over what is counted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lenscl.codegen import faces_of
from lenscl.config import Lens, Scene
from lenscl.expr import Expr, evaluate, evaluate_with_error, gradient
from lenscl.reference import Placement
from lenscl.tracing import TOLERANCE, methods_of, near_points

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SAFETY = 3.0  # for constants that are not counted one by one: OpenCL's 2.5 ulp division, the rounding of parameters
_NEAR = 4.0  # bounds: a face whose value is within so many is one the point may lie on
_MARGIN = 0.01  # of a box, on all sides: so far from it a point may belong to its lens
_PLACING = 64.0  # roundings of the lengths at hand: more than `may_hold` allows for, however a lens is turned
_MOST_TURN = 0.05  # radians: a normal known no better than that says nothing of how a ray bends
_MOST_MOVED = 0.01  # of the lens's extent on any axis: a point known no better than that says nothing of F
# kernels/newton.cl goes no further where 64 move^3 <= eps last^2, in lengths of a bracket that is no longer than the
# lens, for the next move should then be of rounding's size; it may be as long as move^2, (eps / 64)^(2/3)
_SETTLES = 64.0
_HIDES = 64.0  # times the rounding of a point: from farther off no turn of the normal is taken in proportion
_DOUBLE = float(np.finfo(np.float64).eps)
_MOST_RANK = 1e300  # of a lens whose surface is elsewhere
_MOVES = np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerance:
    """How far from a surface a search may leave a point, besides rounding: a length, and a part of the lens's size."""

    length: float = 0.0
    share: float = 0.0

    @classmethod
    def of(cls, scene: Scene, eps: float) -> Tolerance:
        """Return what the searches of a scene leave, `eps` being that of the precision that rays are carried in."""
        numerics, methods, length = scene.numerics, methods_of(scene), 0.0
        if any("tolerance" in method.reads for method in methods):
            length = TOLERANCE[numerics.precision] if numerics.tolerance is None else numerics.tolerance
        polished = numerics.precision == "mixed" or any(method.ending == "polished" for method in methods)
        return cls(length=length, share=(eps / _SETTLES) ** (2 / 3) if polished else 0.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hits:
    """Surface points of rays; arrays of N points, those of faces of M faces a point, the faces of any lens.

    Attributes
    ----------
    lens : int array, shape (N,)
        The number of the lens met.
    value, bound : float64 array, shape (N,)
        |F|, and how large it may be.
    index : float64 array, shape (N,)
        Refractive index of that lens.
    size : float64 array, shape (N,)
        The way through its box, scene units.
    place : float64 array, shape (N,)
        How exactly the point is known, scene units, but for the rounding of F.
    noise, slope : float64 array, shape (N,)
        How large the rounding of F itself is, at the most, and |grad F| per scene unit: together they say by how much
        a search displaces the surface.
    normal : float64 array, shape (N, M, 3)
        Unit, outward, of each face that the point may lie on; faces in the order of `lenscl.codegen.faces_of`.
    turn : float64 array, shape (N, M)
        How far that normal may be turned, radians; infinite for faces that the point does not lie on, and for
        all where one that it may lie on has no normal that is known well enough.
    swing : float64 array, shape (N, M)
        How far it turns within `reach`, radians: a point found from elsewhere may lie so far off.
    reach : float64 array, shape (N,)
        The search's tolerance and noise / slope, scene units.
    """

    lens: NDArray[np.intp] = field(repr=False)
    value: Array = field(repr=False)
    bound: Array = field(repr=False)
    index: Array = field(repr=False)
    size: Array = field(repr=False)
    place: Array = field(repr=False)
    normal: Array = field(repr=False)
    turn: Array = field(repr=False)
    swing: Array = field(repr=False)
    noise: Array = field(repr=False)
    slope: Array = field(repr=False)
    reach: Array = field(repr=False)


def hits_of(scene: Scene, points: Array, eps: float, tolerance: Tolerance) -> Hits:
    """Return what the lenses of a scene are at points, shape (N, 3), each of them taken to be on one lens's surface.

    Parameters
    ----------
    scene : Scene
    points : float64 array, shape (N, 3)
        World, scene units.
    eps : float
        Of the precision that the rays were carried in.
    tolerance : Tolerance
        What the search leaves besides rounding.
    """
    return candidates(scene, points, eps, tolerance)[0]


def candidates(scene: Scene, points: Array, eps: float, tolerance: Tolerance) -> tuple[Hits, Hits, Mask]:
    """Return the lens that each point lies on, the one that comes next, and whether it lies on that one as well.

    Parameters are those of `hits_of`. A point belongs to the lens of whose surface it is nearest in terms of bounds,
    among those in whose box it is. A lens of which nothing is known at the point comes behind all that the point lies
    on, and before those that it does not lie on.
    """
    near = np.unique(near_points(scene.lenses, points, 2.0 * _MARGIN, _PLACING * eps)[1]).tolist()
    lenses = [_Placed(number, scene.lenses[number], eps, tolerance) for number in near]
    faces = max(len(faces_of(group.lens.surface)[1]) for group in scene.lenses.groups)
    n = len(points)
    first, second = _none(n, faces), _none(n, faces)
    ranks = np.full((2, n), np.inf)
    for lens in lenses:
        at = np.arange(n) if len(scene.lenses) == 1 else np.flatnonzero(lens.may_hold(points))
        if not at.size:
            continue
        here = lens.hits(points[at])
        rank = rank_of(here)
        nearer = rank < ranks[0, at]
        next_best = ~nearer & (rank < ranks[1, at])
        _copy(second, first, at[nearer], at[nearer])  # what was the first until now
        ranks[1, at[nearer]] = ranks[0, at[nearer]]
        _copy(first, here, at[nearer], nearer)
        ranks[0, at[nearer]] = rank[nearer]
        _copy(second, here, at[next_best], next_best)
        ranks[1, at[next_best]] = rank[next_best]
    return first, second, (ranks[1] <= 1.0) & np.isfinite(second.bound)


def hits_on_each(scene: Scene, points: Array, eps: float, tolerance: Tolerance) -> tuple[Hits, ...]:
    """Return what each lens of a scene is at all points, lens by lens; parameters are those of `hits_of`.

    Outside a lens's box |F| is infinite, and it has no normal.
    """
    lenses = [_Placed(number, lens, eps, tolerance) for number, lens in enumerate(scene.lenses)]
    faces = max(len(lens.leaves) for lens in lenses)
    every = []
    for lens in lenses:
        made = _none(len(points), faces)
        made.lens[:], made.index[:], made.size[:] = lens.number, lens.lens.n, lens.size
        at = np.flatnonzero(lens.may_hold(points))
        if at.size:
            _copy(made, lens.hits(points[at]), at, np.arange(len(at)))
        every.append(made)
    return tuple(every)


def rank_of(hits: Hits) -> Array:
    """Return |F| in terms of its bound, at most 1 where the point lies on the surface; where that is not known, beyond.

    What is not known is no success: it must not win against a lens whose surface is met.
    """
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        ratio = np.where(hits.value > 0.0, np.minimum(hits.value / hits.bound, _MOST_RANK), 0.0)
    unknown = np.nextafter(1.0, 2.0)
    return np.where(~np.isfinite(hits.bound), unknown, np.where(np.isnan(hits.value), _MOST_RANK, ratio))


def _none(n: int, faces: int) -> Hits:
    return Hits(
        lens=np.zeros(n, np.intp), value=np.full(n, np.inf), bound=np.zeros(n), index=np.ones(n), size=np.zeros(n),
        place=np.zeros(n), normal=np.zeros((n, faces, 3)), turn=np.full((n, faces), np.inf), swing=np.zeros((n, faces)),
        noise=np.zeros(n), slope=np.ones(n), reach=np.zeros(n),
    )  # fmt: skip


def _copy(into: Hits, source: Hits, to: NDArray[np.intp], which: Mask | NDArray[np.intp]) -> None:
    """Copy some points' rows; a lens may have fewer faces than there is room for."""
    for name in ("lens", "value", "bound", "index", "size", "place", "noise", "slope", "reach"):
        getattr(into, name)[to] = getattr(source, name)[which]
    count = source.turn.shape[1]
    into.normal[to, :count], into.turn[to, :count] = source.normal[which], source.turn[which]
    into.swing[to, :count], into.turn[to, count:] = source.swing[which], np.inf


def chosen(which: Mask, hits: Hits, others: Hits) -> Hits:
    """Return hits with those of other lenses in the place of some, `which` of shape (N,)."""
    made = _none(len(which), hits.turn.shape[1])
    for source, taken in ((hits, ~which), (others, which)):
        _copy(made, source, np.flatnonzero(taken), taken)
    return made


class _Placed:
    """One lens of a scene, and its faces."""

    def __init__(self, number: int, lens: Lens, eps: float, tolerance: Tolerance) -> None:
        self.number, self.lens, self.eps = number, lens, eps
        self.placement = Placement.of(lens)
        self.to_local = np.abs(self.placement.vector_to_local(np.eye(3)).T)
        self.to_world = np.abs((self.placement.point_to_world(np.eye(3)) - self.placement.centre).T)
        self.box = np.array(lens.surface.box(lens.values), dtype=np.float64)
        self.reach = np.abs(self.box).max(axis=0)
        self.size = float(np.linalg.norm(self.to_world @ (self.box[1] - self.box[0])))
        self.tolerance = tolerance.length + tolerance.share * self.size
        dtype = np.float32 if eps > _DOUBLE else np.float64
        self.values = {name: float(dtype(value)) for name, value in lens.values.items()}  # as the kernel has them
        self.joined, self.leaves = faces_of(lens.surface)

    def may_hold(self, points: Array) -> Mask:
        local = self.placement.point_to_local(points)
        slack = SAFETY * self._rounding(points) + _MARGIN * (self.box[1] - self.box[0])
        inside: Mask = np.all((local >= self.box[0] - slack) & (local <= self.box[1] + slack), axis=1)
        return inside

    def _rounding(self, points: Array) -> Array:
        """Return how far points are moved on each local axis by a rounding of each number on their way; (N, 3)."""
        world = np.abs(points) + np.abs(self.placement.centre) + self.to_world @ self.reach
        moved: Array = self.eps * (world @ self.to_local.T)
        return moved

    def hits(self, points: Array) -> Hits:
        local = self.placement.point_to_local(points)
        moved = self._rounding(points)
        beside = local[None] + _MOVES[:, None] * moved[None]  # the points, and beside them on each axis, both ways
        faces = [self._face(leaf, local, beside, moved) for leaf in self.leaves]
        value, bound, normal, turn, swing, noise, slope = (np.stack(part, axis=1) for part in zip(*faces, strict=True))

        # The point lies on the face that F shows, or on another one whose value is as near to zero
        whole = evaluate(self.joined, {f"leaf_{i}": value[:, i] for i in range(len(self.leaves))})
        near = np.isfinite(bound) & (np.abs(value) <= _NEAR * bound)
        counts = near | (value == whole[:, None])
        vague = (counts & ~(turn < _MOST_TURN)).any(axis=1)[:, None]
        with np.errstate(all="ignore"):
            depths = np.where(counts & np.isfinite(noise / slope), noise / slope, 0.0)
        worst, rows = np.argmax(depths, axis=1), np.arange(len(points))
        reach = self.tolerance + depths[rows, worst]
        known = moved + reach[:, None] * np.linalg.norm(self.to_local, axis=1)
        lost = (known > _MOST_MOVED * (self.box[1] - self.box[0])).any(axis=1)
        lost |= self._is_on_a_domains_end(whole, beside)
        return Hits(
            lens=np.full(len(points), self.number),
            value=np.abs(whole),
            bound=np.where(lost, np.inf, np.where(counts, bound, 0.0).max(axis=1)),
            index=np.full(len(points), self.lens.n),
            size=np.full(len(points), self.size),
            place=np.linalg.norm(SAFETY * moved @ self.to_world.T, axis=1) + self.tolerance,
            normal=normal,
            turn=np.where(counts & ~vague & ~lost[:, None], turn, np.inf),
            swing=swing,
            noise=noise[rows, worst],
            slope=slope[rows, worst],
            reach=reach,
        )

    def _is_on_a_domains_end(self, whole: Array, beside: Array) -> Mask:
        """Return where F is no number, but is one within the rounding of the point."""
        found: Mask = np.isnan(whole)
        if found.any():
            about = {**self.values, **dict(zip("xyz", np.moveaxis(beside[:, found], -1, 0), strict=True))}
            with np.errstate(all="ignore"):
                leaves = {f"leaf_{i}": evaluate(leaf, about) for i, leaf in enumerate(self.leaves)}
                values = np.broadcast_to(evaluate(self.joined, leaves), (len(beside), int(found.sum())))
            found[found] = ~np.isnan(values).all(axis=0)
        return found

    def _face(self, leaf: Expr, local: Array, beside: Array, moved: Array) -> tuple[Array, ...]:
        """Return what `Hits` has of one face: value, bound, normal, turn, swing, noise and slope."""
        at = {**self.values, **dict(zip("xyz", local.T, strict=True))}
        about = {**self.values, **dict(zip("xyz", np.moveaxis(beside, -1, 0), strict=True))}
        slopes = gradient(leaf)
        grow = self.eps / _DOUBLE  # rounding errors are in proportion to the unit roundoff, to first order
        with np.errstate(all="ignore"):
            value, noise = evaluate_with_error(leaf, at)
            noises = np.stack([grow * evaluate_with_error(slope, at)[1] for slope in slopes], axis=-1)
            g = np.stack([evaluate(slope, about) for slope in slopes], axis=-1)
            along = np.linalg.norm(self.placement.normal_to_world(g), axis=-1)
            bound = SAFETY * (grow * noise + np.sum(np.abs(g[0]) * moved, axis=-1)) + along[0] * self.tolerance
            normals = self.placement.normal_to_world(g) / along[..., None]
            turned = np.linalg.norm(normals[1:] - normals[0], axis=-1).sum(axis=0)
            rounded = (noises + 4.0 * self.eps * np.abs(g[0])) @ self.to_local / along[0][..., None]
            deep = SAFETY * grow * noise / along[0]
            strides = (self.tolerance + deep)[:, None] * np.linalg.norm(self.to_local, axis=1)
            swing = SAFETY * turned * (strides / moved).max(axis=-1)
            # Where F hides more than rounding of the point does, its slopes beside the point tell nothing but noise
            hides = np.flatnonzero((strides > _HIDES * moved).any(axis=1) & (deep > 0.0) & np.isfinite(deep))
            if hides.size:
                swing[hides] = SAFETY * self._turned(slopes, local[hides], strides[hides])
            turn = SAFETY * (turned + np.linalg.norm(rounded, axis=-1) + self.eps)
        known = np.isfinite(turn) & np.isfinite(normals[0]).all(axis=-1)
        bound = np.where(np.isfinite(bound), bound, np.inf)
        normal = np.where(known[:, None], normals[0], 0.0)
        known &= np.isfinite(swing)
        return (
            value, bound, normal, np.where(known, turn, np.inf), np.where(known, swing, 0.0), SAFETY * grow * noise,
            along[0],
        )  # fmt: skip

    def _turned(self, slopes: Sequence[Expr], local: Array, strides: Array) -> Array:
        """Return how far a normal turns, in all, within strides on each axis of points, both of shape (N, 3)."""
        beside = local[None] + _MOVES[:, None] * strides[None]
        about = {**self.values, **dict(zip("xyz", np.moveaxis(beside, -1, 0), strict=True))}
        g = np.stack([np.broadcast_to(evaluate(slope, about), beside.shape[:2]) for slope in slopes], axis=-1)
        normals = self.placement.normal_to_world(g)
        normals = normals / np.linalg.norm(normals, axis=-1)[..., None]
        turned: Array = np.linalg.norm(normals[1:] - normals[0], axis=-1).sum(axis=0)
        return turned
