"""Rays at one surface: its geometry where they met it, and bounds on the rounding there, for `carried`.

The bounds are sums of worst cases: a number of roundings, times u = 2^-53, times the size of what is rounded. The
numbers of roundings are those of the operations in kernels/lens.cl, placement.cl, snell_exact.cl and mirrored.cl.
`evaluate_with_error` bounds the rounding of F and its gradient. Arrays have the shape (3, M), coordinates first.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field, fields, replace
from typing import overload

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.jets import Jets
from lenscl.config import Scene
from lenscl.methods import choose
from lenscl.reference import Placement as ReferencePlacement
from lenscl.reference import on_mirror
from lenscl.tracing import Placement, near_points

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

U = 2.0**-53
_OTHER_ORDERS = 2.0  # factor: a kernel computes F and its gradient by the same operations in another order
_TURNED = 8.0  # u: error of an entry of a rotation, by the angle in radians, cosine, sine and two products
_ON = 8.0  # ulps of a point's coordinates: a point that close to a surface is taken to be on it, see `locate`
_SURE = 4.0  # factor on that bound, as `locate` computes it in another way
_FAR = 1e-12  # of the lengths at hand: more than rounding moves a point
_BOX_SLACK = 1e-6  # of the box's size: a point on the box may be rounded to a place outside
_SAME_WAY = 1e-6  # radians: largest deviation of the refracted direction from Snell's law, besides its rounding


@dataclass(frozen=True, slots=True, eq=False)
class Meeting:
    """Rays that meet one lens: first the terms of the path's derivative, then bounds on errors by rounding.

    Attributes
    ----------
    rays : int array, shape (M,)
        Their numbers.
    lens : int
        The lens's number.
    before, after, normal : (3, M)
        Directions before and after the surface, and the normal on the ray's side: unit vectors in the world.
    hessian : (3, 3, M)
        Second derivatives of F in the world over the length of its gradient, with the sign of `normal`.
    leg, eta, cosine, behind, along : (M,)
        Length of the leg to here; n_before / n_after; cosines of the angles of incidence and of refraction; and the
        multiple of the normal that refraction subtracts, as in snell_exact.cl.
    total : bool, (M,)
        Whether the ray is reflected, totally or by a mirrored face.
    searched : (3, M), world, scene units
        Bound on the error of the ray's line in the root search: such an error moves the point on the surface.
    told : (3, M)
        Bound on the error of the point at which the normal was computed.
    placed : (3, M)
        Bound on the error of mapping the point to the world: such an error does not turn the normal.
    level : (M,)
        Bound on |F| at the point, over the length of F's gradient: a distance along the normal.
    tilt : (3, M)
        Bound on the error of the normal.
    known : bool, (M,)
        Whether these numbers explain the direction after the surface, so that they describe what the ray did.
    leaves : bool, (M,)
        Whether the ray comes from inside the lens.
    doubt : (M,)
        |F| at the point over the largest value that rounding explains: of several lenses, the ray met that of the
        least.
    value : (M,)
        F at the point over the length of its gradient: the signed distance from the surface, to first order.
    """

    rays: NDArray[np.intp] = field(repr=False)
    lens: int
    before: Array = field(repr=False)
    after: Array = field(repr=False)
    normal: Array = field(repr=False)
    hessian: Array = field(repr=False)
    leg: Array = field(repr=False)
    eta: Array = field(repr=False)
    cosine: Array = field(repr=False)
    behind: Array = field(repr=False)
    along: Array = field(repr=False)
    total: Mask = field(repr=False)
    searched: Array = field(repr=False)
    told: Array = field(repr=False)
    placed: Array = field(repr=False)
    level: Array = field(repr=False)
    tilt: Array = field(repr=False)
    known: Mask = field(repr=False)
    leaves: Mask = field(repr=False)
    doubt: Array = field(repr=False)
    value: Array = field(repr=False)

    def of(self, chosen: Mask) -> Meeting:
        """Return the same for some of the rays."""
        parts = {each.name: getattr(self, each.name) for each in fields(self)}
        return Meeting(**{name: part if name == "lens" else part[..., chosen] for name, part in parts.items()})

    def between(self, eta: Array, after: Array, mirrors: Mask) -> Meeting:
        """Return the same for rays that leave along `after`, another ratio of indices n_before / n_after, and mirrors.

        `mirrors`, shape (M,), says which rays meet a mirrored face.
        """
        along, behind, total, known = _snell(self.before, after, self.normal, self.cosine, self.tilt, eta, mirrors)
        known &= np.isfinite(self.level + self.tilt.sum(axis=0) + self.doubt)
        return replace(self, after=after, eta=eta, along=along, behind=behind, total=total, known=known)


class Glasses(Sequence["Glass"]):
    """The lenses of a scene, by number; each is made when it is asked for."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._made: dict[int, Glass] = {}

    def __len__(self) -> int:
        return len(self._scene.lenses)

    @overload
    def __getitem__(self, number: int) -> Glass: ...

    @overload
    def __getitem__(self, number: slice) -> list[Glass]: ...

    def __getitem__(self, number: int | slice) -> Glass | list[Glass]:
        if isinstance(number, slice):
            return [self[one] for one in range(*number.indices(len(self)))]
        if not 0 <= number < len(self):
            raise IndexError(number)
        if number not in self._made:
            first = self._scene.lenses.group_of(number).first
            self._made[number] = (
                Glass(self._scene, number) if number == first else self[first].copy(self._scene, number)
            )
        return self._made[number]

    def near(self, points: Array) -> list[Glass]:
        """Return those, in the order of their numbers, in whose boxes some of the points, shape (3, M), may lie."""
        numbers = np.unique(near_points(self._scene.lenses, points.T, 2.0 * _BOX_SLACK, _FAR)[1])
        return [self[number] for number in numbers.tolist()]


class Glass:
    """One lens of a scene: its geometry and rounding at points where rays met it.

    Attributes
    ----------
    number : int
    lens : Lens
    placement : Placement
    rotated : float
        Bound on the error of an entry of its rotation.
    """

    def __init__(self, scene: Scene, number: int) -> None:
        self.number, self.lens = number, scene.lenses[number]
        self._n_medium = scene.n_medium
        self.placement = Placement.of(self.lens)
        self._slack = _BOX_SLACK * (self.placement.box[1] - self.placement.box[0])
        self._extent = (self.placement.box[1] - self.placement.box[0])[:, None]
        surface = self.lens.surface
        form = surface.sign_polynomial(self.lens.values)
        method = choose(
            "auto",
            is_polynomial=form is not None,
            is_polyhedron=bool(surface.planes),
            is_joined=bool(surface.polynomial_leaves),
        )
        assert method is not None, "auto serves every surface"
        self._ending = method.ending_for(surface.degree)
        is_whole = form is not None and method.wants_polynomial
        self._jets = Jets(self.lens.values, surface, form if is_whole else None)
        # 0 where all angles are multiples of 90 degrees, whose cosines are exact
        self.rotated = 0.0 if all(angle % 90.0 == 0.0 for angle in self.lens.rotate) else _TURNED * U

    def copy(self, scene: Scene, number: int) -> Glass:
        """Return another copy of the same table's lens."""
        made = copy(self)
        made.number, made.lens = number, scene.lenses[number]
        made.placement = replace(self.placement, centre=np.asarray(made.lens.centre, dtype=np.float64))
        return made

    def holds(self, points: Array) -> Mask:
        """Say which points, shape (3, M), lie in the lens's box."""
        local = self.placement.local(points.T)
        low, high = self.placement.box - np.array([[1.0], [-1.0]]) * self._slack
        inside: Mask = ((local >= low) & (local <= high)).all(axis=1)
        return inside

    def met(
        self, rays: NDArray[np.intp], start: Array, before: Array, point: Array, after: Array, departs: Array
    ) -> Meeting:
        """Return the meeting of rays from `start` along `before`, meet this lens at `point` and leave along `after`.

        `departs` is for rays that start on this lens: a bound on |F| at their start over the length of F's gradient, as
        their search takes the value of F there for zero. It is 0 for others.
        """
        to_local, to_world = self.placement.to_local, self.placement.to_world
        centre = self.placement.centre[:, None]
        away, off = start - centre, point - centre
        local = mapped(to_local, off)
        leg = np.sqrt(dot(point - start, point - start))

        # F and its derivatives, with bounds on their rounding
        value, noise, slopes, errors, seconds = self._jets.at(local)
        with np.errstate(all="ignore"):
            steep = mapped(to_local.T, slopes)
            length = np.sqrt(dot(steep, steep))
            outward = steep / length
            rows = np.stack([mapped(to_local.T, row) for row in seconds])
            hessian = mapped(to_local.T, rows) / length
            slant = dot(outward, before)
            leaves = slant > 0.0
            sign = np.where(leaves, -1.0, 1.0)
            normal, cosine = sign * outward, np.abs(slant)

            # Bounds on the rounding of the search's numbers in local space, mapped to the world
            sizes = np.abs(to_local)
            reach, rates = mapped(sizes, np.abs(away)), mapped(sizes, np.abs(before))
            direction = mapped(to_local, before)
            inside = np.minimum(leg, (self._extent / np.abs(direction)).min(axis=0))  # of the box, at most
            size, inner = np.abs(local), rates * inside
            lengths = np.abs(to_world)
            turned = self.rotated * np.abs(off).sum(axis=0)
            searched = mapped(lengths, U * (4.0 * reach + 5.0 * leg * rates + 2.0 * size)) + turned
            told = mapped(lengths, U * (2.0 * size + 3.0 * inner))
            placed = U * (4.0 * mapped(lengths, size) + np.abs(point)) + turned

            # Bound |F| at the point: by the rounding of F, by the end of the search and by its start
            level = _OTHER_ORDERS * noise / length + departs
            level += self._ended(inside, direction, slopes, errors, seconds) / length
            tilt = mapped(sizes.T, _OTHER_ORDERS * errors + 5.0 * U * np.abs(slopes)) / length + self.rotated

            eta = np.where(leaves, self.lens.n / self._n_medium, self._n_medium / self.lens.n)
            mirrors, unsure = self.mirrored(point, before, leg)
            along, behind, total, known = _snell(before, after, normal, cosine, tilt, eta, mirrors)
            known &= ~unsure
            doubt = np.abs(value) / (noise + length * (level + norm(searched) + norm(told) + norm(placed)))
            known &= np.isfinite(level + tilt.sum(axis=0) + doubt)
            signed = value / length
        return Meeting(
            rays, self.number, before, after, normal, sign * hessian, leg, eta, cosine, behind, along, total, searched,
            told, placed, level, tilt, known, leaves, doubt, signed,
        )  # fmt: skip

    def mirrored(self, points: Array, directions: Array, length: Array) -> tuple[Mask, Mask]:
        """Return which points of the surface, shape (3, M), lie on a mirrored face, and of which that is not known.

        `directions` are those of the rays that came there, and `length`, shape (M,), that of their legs.
        """
        if not self.lens.mirror:
            nowhere = np.zeros(points.shape[1], bool)
            return nowhere, nowhere
        reach = np.abs(points).max(axis=0) + length
        return on_mirror(self.lens, ReferencePlacement.of(self.lens), points.T, directions.T, reach)

    def _ended(self, length: Array, direction: Array, slopes: Array, errors: Array, seconds: Array) -> Array:
        """Return a bound on |F| at the root by the last step of the search, the rounding of F left out.

        `length` is an upper bound of t on the searched segment.
        """
        slope = np.abs(dot(slopes, direction))
        turns = np.abs(dot(np.stack([dot(row, direction) for row in seconds]), direction))
        if self._ending == "polished":  # the search ends with a bracket of four roundings of t: kernels/newton.cl
            off: Array = 8.0 * U * length * slope
            return off
        if self._ending == "corrected":  # the search ends after a Newton step of at most sqrt(eps) t
            off = U * length * length * turns
            return off
        # The coefficients of a quadratic equation are taken where the ray enters the box, or in the chord's middle
        if self.lens.surface.is_convex:
            length = np.minimum(length, 2.0 * slope / turns)
        way = np.abs(direction)
        bent = dot(np.stack([dot(np.abs(row), way) for row in seconds]), way)
        linear = length * dot(_OTHER_ORDERS * errors + 4.0 * U * np.abs(slopes), way)
        off = linear + 4.0 * U * length * length * bent
        return off

    def starts(self, points: Array) -> tuple[NDArray[np.intp], Array]:
        """Return the numbers of the points, shape (3, M), that may lie on the lens's surface, and a bound on |F| there.

        The bound is over the length of F's gradient, as `Meeting.level`.
        """
        near = np.flatnonzero(self.holds(points))
        if not near.size:
            return near, np.empty(0)
        off = points[:, near] - self.placement.centre[:, None]
        value, noise, slopes, _, _ = self._jets.at(mapped(self.placement.to_local, off))
        with np.errstate(all="ignore"):
            length = norm(mapped(self.placement.to_local.T, slopes))
            most = noise / length + 2 * _ON * U * (np.abs(points[:, near]) + np.abs(off)).sum(axis=0)
            is_on = np.abs(value) / length <= _SURE * most
        return near[is_on], (_SURE * most)[is_on]

    def enters(self, points: Array, directions: Array) -> Mask:
        """Say which rays from points on the surface, shape (3, M), go into the solid."""
        off = points - self.placement.centre[:, None]
        _, _, slopes, _, _ = self._jets.at(mapped(self.placement.to_local, off))
        goes: Mask = dot(mapped(self.placement.to_local.T, slopes), directions) < 0.0
        return goes


def _snell(
    before: Array, after: Array, normal: Array, cosine: Array, tilt: Array, eta: Array, mirrors: Mask
) -> tuple[Array, Array, Mask, Mask]:
    """Apply Snell's law, or that of reflection to the rays of `mirrors`.

    Return `along`, `behind` and `total` of a `Meeting`, and whether the law explains `after`.
    """
    with np.errstate(all="ignore"):
        excess = (1.0 - eta) * (1.0 + eta)
        across = dot(before, before) - cosine * cosine
        behind = np.sqrt(cosine * cosine + excess * np.maximum(across, 0.0))
        along = excess / (eta * cosine + behind)
        goes = np.isfinite(along)
        along, behind = np.where(goes, along, 0.0), np.where(goes, behind, 1.0)
        refracted = eta * before - along * normal
        mirrored = before + 2.0 * cosine * normal
        missed, turned_back = _apart(after, refracted), _apart(after, mirrored)
        total: Mask = mirrors | ((eta > 1.0) & (~goes | (turned_back < missed)))
        behind = np.where(mirrors, 1.0, behind)
        miss = np.where(total, turned_back, missed)
        allowed = np.sqrt(dot(tilt, tilt)) * (1.0 + eta) * (1.0 + eta / np.maximum(behind, U))
        known: Mask = miss <= _SAME_WAY * (1.0 + eta) + 4.0 * allowed
    return along, np.where(total, 1.0, behind), total, known


def mapped(matrix: Array, vectors: Array) -> Array:
    """Return vectors, shape (3, ..., M), multiplied by a 3 x 3 matrix: the same bits wherever a vector stands."""
    return np.stack([a * vectors[0] + b * vectors[1] + c * vectors[2] for a, b, c in matrix])


def dot(a: Array, b: Array) -> Array:
    """Return the dot products of vectors, shape (..., 3, M)."""
    product: Array = a[..., 0, :] * b[..., 0, :] + a[..., 1, :] * b[..., 1, :] + a[..., 2, :] * b[..., 2, :]
    return product


def norm(a: Array) -> Array:
    """Return the lengths of vectors, shape (..., 3, M)."""
    length: Array = np.sqrt(dot(a, a))
    return length


def _apart(a: Array, b: Array) -> Array:
    return norm(a - b)
