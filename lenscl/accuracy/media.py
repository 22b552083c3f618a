"""In which media rays travel: which lens they meet next, and the indices there, for `carried`.

`Apart` is for solids that are proved apart: a ray is inside one lens or none. `Overlapping` is for solids that may
touch or overlap: a ray is inside a set of solids, the medium is the one of highest priority, and a ray may meet several
surfaces in contact. Sets and surfaces are found from the signs and sizes of F at the events' points. The kernel's own
sets play no part: Snell's law shows whether those that were found explain the path.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.meeting import Glass, Glasses, Meeting, norm
from lenscl.accuracy.passing import crossed, displaced, inside
from lenscl.config import Scene

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Numbers = NDArray[np.intp]

_IN_CONTACT = 4.0  # times what rounding explains of F: a point that near to a surface may be taken to be on it
_PARALLEL = 1e-6  # sine of the angle between normals in contact; see kernels/lens_nested.cl
_AS_CURVED = 1e-3  # part by which second derivatives of surfaces in contact may differ
_UNTOLD, _NONE = -2, -1  # in place of the rank of a medium: not known, and around all lenses


class Apart:
    """Rays among solids that are apart; a ray's number is its place in `start`, shape (3, N)."""

    def __init__(self, glasses: Glasses, start: Array) -> None:
        count = start.shape[1]
        self._glasses = glasses
        self._inside = np.full(count, -1)
        # Bound on |F| where a leg starts on a lens, and that lens
        self._departs, self._on = np.zeros(count), np.full(count, -1)
        for glass in glasses.near(start):
            near, level = glass.starts(start)
            self._departs[near], self._on[near] = level, glass.number

    def met(
        self, rays: Numbers, start: Array, before: Array, point: Array, after: Array, is_first: bool
    ) -> Iterator[tuple[Meeting, Mask]]:
        """Take some rays through the surface that they meet next.

        Parameters
        ----------
        rays : int array, shape (M,)
            Their numbers.
        start, before, point, after : float64 array, shape (3, M)
            As for `Glass.met`.
        is_first : bool
            Whether it is their first.

        Yields
        ------
        meeting : Meeting
            With one lens, of the rays that meet it, by their places in `rays`.
        is_known : bool array
            Of these, whether it is what the ray did.
        """
        was_inside = self._inside[rays]
        for meeting in self._meetings(rays, start, before, point, after, was_inside):
            mine = rays[meeting.rays]
            is_known = meeting.known & (is_first | (meeting.leaves == (was_inside[meeting.rays] >= 0)))
            self._inside[mine] = np.where(meeting.leaves == meeting.total, meeting.lens, -1)
            self._on[mine] = meeting.lens
            self._departs[mine] = _left(meeting)
            yield meeting, is_known

    def _meetings(
        self, rays: Numbers, start: Array, before: Array, point: Array, after: Array, was_inside: Numbers
    ) -> Iterator[Meeting]:
        """Yield the meetings lens by lens.

        A ray inside a lens meets that lens. A ray outside meets the lens in whose box the point lies; if there are
        several, the one whose |F| rounding explains best.
        """
        found = []
        glasses = {glass.number: glass for glass in self._glasses.near(point)}
        glasses |= {number: self._glasses[number] for number in np.unique(was_inside[was_inside >= 0]).tolist()}
        for _, glass in sorted(glasses.items()):
            is_any = len(self._glasses) == 1 or glass.holds(point)
            some = np.flatnonzero((was_inside == glass.number) | ((was_inside < 0) & is_any))
            if some.size:
                own = np.where(self._on[rays[some]] == glass.number, self._departs[rays[some]], 0.0)
                found.append(glass.met(some, start[:, some], before[:, some], point[:, some], after[:, some], own))
        yield from _nearest(found, len(rays)) if len(found) > 1 else found

    def passed(self, start: Array, direction: Array, distance: Array) -> Array | None:
        """Return None: every surface that is met is an event."""
        return None


class Overlapping:
    """Rays among solids that may touch or overlap; methods as `Apart` has them.

    Parameters
    ----------
    scene : Scene
    glasses : sequence of Glass
        All of its lenses, by number.
    start, direction : float64 array, shape (3, N)
    """

    def __init__(self, scene: Scene, glasses: Sequence[Glass], start: Array, direction: Array) -> None:
        shape = len(glasses), start.shape[1]
        order = scene.by_priority()
        self._glasses = glasses
        self._ranks = {number: rank for rank, number in enumerate(order)}
        self._indices = np.array([scene.n_medium, *(scene.lenses[number].n for number in order)])
        self._medium = np.full(shape[1], _UNTOLD)  # ranks
        # By lens: whether the leg's start lies in the solid, or on its surface, and a bound on |F| there
        self._inside, self._on, self._departs = np.zeros(shape, bool), np.zeros(shape, bool), np.zeros(shape)
        for row, glass in enumerate(glasses):
            self._inside[row] = inside(glass, start)
            near, self._departs[row, near] = glass.starts(start)
            self._on[row, near] = True
            self._inside[row, near] = glass.enters(start[:, near], direction[:, near])

    def met(
        self, rays: Numbers, start: Array, before: Array, point: Array, after: Array, is_first: bool
    ) -> Iterator[tuple[Meeting, Mask]]:
        """As `Apart.met`; of surfaces in contact one meeting stands for all, with the largest of their bounds."""
        count = len(rays)
        is_known = np.ones(count, bool)
        sets = np.zeros((2, len(self._glasses), count), bool)  # of solids, on both sides of the surface
        is_on = np.zeros((len(self._glasses), count), bool)
        coated, unsure = np.zeros((2, len(self._glasses), count), bool)
        touched = []
        for row, glass in enumerate(self._glasses):
            some = np.flatnonzero(glass.holds(point))
            if not some.size:
                continue
            own = np.where(self._on[row, rays[some]], self._departs[row, rays[some]], 0.0)
            one = glass.met(some, start[:, some], before[:, some], point[:, some], after[:, some], own)
            is_known[some] &= ~np.isnan(one.value)
            on = ~(one.doubt > _IN_CONTACT)
            is_on[row, some] = on
            coated[row, some], unsure[row, some] = glass.mirrored(point[:, some], before[:, some], one.leg)
            sets[0, row, some] = np.where(on, one.leaves, one.value < 0.0)
            sets[1, row, some] = np.where(on, ~one.leaves, one.value < 0.0)
            touched.append(one.of(on))

        media = [self._medium_of(each) for each in sets]
        is_known &= (media[0] != media[1]) & (is_first | (media[0] == self._medium[rays]))
        mirrors, open_edge = self._mirrors(media, coated & is_on, unsure & is_on)
        is_known &= ~open_edge
        eta = self._indices[media[0] + 1] / self._indices[media[1] + 1]
        shift = self._displaced(rays, start, before, point, media[0], sets[0], is_on)
        for meeting, is_one in _joined(touched, count):
            mine = meeting.rays
            moved = replace(meeting, searched=meeting.searched + shift[:, mine])
            meeting = moved.between(eta[mine], after[:, mine], mirrors[mine])
            of, total = rays[mine], meeting.total
            self._medium[of] = np.where(total, media[0][mine], media[1][mine])
            self._inside[:, of] = np.where(total, sets[0][:, mine], sets[1][:, mine])
            yield meeting, meeting.known & is_known[mine] & is_one
        self._on[:, rays], self._departs[:, rays] = is_on, 0.0
        for one in touched:
            self._departs[one.lens, rays[one.rays]] = np.maximum(_left(one), np.abs(one.value) + one.level)

    def _medium_of(self, solids: Mask) -> Numbers:
        """Return the highest rank in sets of solids, shape (lenses, M)."""
        highest = np.full(solids.shape[1], _NONE)
        for number, rank in self._ranks.items():
            highest = np.where(solids[number], np.maximum(highest, rank), highest)
        return highest

    def _mirrors(self, media: Sequence[Numbers], coated: Mask, unsure: Mask) -> tuple[Mask, Mask]:
        """Return which rays meet a mirrored face of a lens that is a medium there, and of which that is not known."""
        ranks = [self._ranks[glass.number] for glass in self._glasses]
        is_medium = np.stack([(media[0] == rank) | (media[1] == rank) for rank in ranks])
        mirrors: Mask = (coated & ~unsure & is_medium).any(axis=0)
        return mirrors, (unsure & is_medium).any(axis=0) & ~mirrors

    def _displaced(
        self, rays: Numbers, start: Array, direction: Array, end: Array, medium: Numbers, inside_end: Mask, on_end: Mask
    ) -> Array:
        """Return by how much rounding at surfaces within the medium moves a leg at most, shape (3, M)."""
        shift, crossings = np.zeros(start.shape), np.zeros(len(rays))
        for row, glass in enumerate(self._glasses):
            some = np.flatnonzero(self._ranks[row] < medium)
            if not some.size:
                continue
            of, legs = rays[some], (start[:, some], end[:, some])
            number = crossed(
                glass, *legs, (self._inside[row, of], inside_end[row, some]), (self._on[row, of], on_end[row, some])
            )
            goes = np.flatnonzero(number)
            moved = displaced(glass, legs[0][:, goes], direction[:, some[goes]], legs[1][:, goes])
            shift[:, some[goes]] += number[goes] * moved
            crossings[some] += number
        # The surface at the end is searched from the last of them
        for row, glass in enumerate(self._glasses):
            some = np.flatnonzero(on_end[row] & (crossings > 0.0))
            shift[:, some] += displaced(glass, start[:, some], direction[:, some], end[:, some])
        return shift

    def passed(self, start: Array, direction: Array, distance: Array) -> Array | None:
        """Return a bound on how far surfaces within their medium move the last legs of all rays, shape (3, N).

        `distance` is that of the picture's plane, shape (N,). None where every ray ends around all lenses.
        """
        if not (self._medium > _NONE).any():
            return None
        end = start + distance * direction
        inside_end = np.stack([inside(glass, end) for glass in self._glasses])
        rays = np.arange(start.shape[1])
        return self._displaced(rays, start, direction, end, self._medium, inside_end, np.zeros_like(inside_end))


def _left(meeting: Meeting) -> Array:
    """Return a bound on |F| where rays leave a surface, over the length of F's gradient."""
    bound: Array = meeting.level + norm(meeting.placed) + norm(meeting.told)
    return bound


def _nearest(found: Sequence[Meeting], count: int) -> list[Meeting]:
    """Return for each ray, of several meetings, the one whose |F| rounding explains best."""
    nearest, least = np.full(count, -1), np.full(count, np.inf)
    for meeting in found:
        nearer = ~(meeting.doubt >= least[meeting.rays])
        nearest[meeting.rays[nearer]], least[meeting.rays[nearer]] = meeting.lens, meeting.doubt[nearer]
    return [meeting.of(nearest[meeting.rays] == meeting.lens) for meeting in found]


def _joined(touched: Sequence[Meeting], count: int) -> Iterator[tuple[Meeting, Mask]]:
    """Yield one meeting of each ray, lens by lens, and whether the surfaces that it touches are one interface.

    Which of them a kernel takes the point and normal of, rounding decides.
    """
    times = np.zeros(count, np.intp)
    for one in touched:
        times[one.rays] += 1
    nearest = _nearest(touched, count)
    if (times <= 1).all():
        for one in nearest:
            yield one, np.ones(len(one.rays), bool)
        return
    normal, hessian = np.zeros((3, count)), np.zeros((3, 3, count))
    for one in nearest:
        normal[:, one.rays], hessian[..., one.rays] = one.normal, _along_surface(one)
    most = {name: np.zeros((3, count)) for name in ("searched", "told", "placed", "tilt")}
    level, apart = np.zeros(count), np.zeros((3, count))
    is_one = np.ones(count, bool)
    for one in touched:
        at = one.rays
        for name, values in most.items():
            values[:, at] = np.maximum(values[:, at], getattr(one, name))
        level[at] = np.maximum(level[at], one.level)
        turn = np.abs(one.normal - normal[:, at])
        apart[:, at] = np.maximum(apart[:, at], turn)
        curved, other = _along_surface(one), hessian[..., at]
        sizes = np.sqrt((curved * curved).sum(axis=(0, 1))) + np.sqrt((other * other).sum(axis=(0, 1)))
        unlike = np.sqrt(((curved - other) ** 2).sum(axis=(0, 1)))
        is_one[at] &= (norm(turn) <= _PARALLEL) & (unlike <= _AS_CURVED * sizes)
    most["tilt"] += apart
    for one in nearest:
        at = one.rays
        searched, told, placed, tilt = (values[:, at] for values in most.values())
        yield replace(one, level=level[at], searched=searched, told=told, placed=placed, tilt=tilt), is_one[at]


def _along_surface(meeting: Meeting) -> Array:
    """Return the part of the second derivatives along the surface, which does not hang on F's form: (3, 3, M)."""
    n = meeting.normal
    across = np.eye(3)[..., None] - n[:, None] * n[None]
    part: Array = np.einsum("ijm,jkm,klm->ilm", across, meeting.hessian, across, optimize=True)
    return part
