"""The laws of paths, held on given rays: what `check_map` and `check_rays` have in common.

Which laws these are is told in `lenscl.accuracy.selfcheck.check`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.selfcheck.arranged import arranged
from lenscl.accuracy.selfcheck.causes import with_causes
from lenscl.accuracy.selfcheck.findings import LAWS, MOST_FAILURES, UNCHECKED, SelfCheck
from lenscl.accuracy.selfcheck.hits import SAFETY, Hits
from lenscl.accuracy.selfcheck.legs import Clear, landings, obstacles, through_picture, to_picture
from lenscl.accuracy.selfcheck.media import AROUND, UNKNOWN, media_along
from lenscl.accuracy.selfcheck.returns import Leg, Return, Returned, sent_back, sent_to_start
from lenscl.accuracy.selfcheck.separate import separate
from lenscl.accuracy.selfcheck.tally import Tally
from lenscl.accuracy.selfcheck.walk import LANDS, LEAVES, STOPS, Interfaces, Walk
from lenscl.device import Device
from lenscl.status import RayStatus
from lenscl.tracing import Ends, Follower, methods_of

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Pixels = NDArray[np.intp]

_MOST_EVENTS = 16  # surfaces of a ray that are looked at
_LARGEST = 1e30  # a residual that is no number is written as this
_HALF = 0.5  # between none and one


class Paths:
    """The check of given rays at work."""

    def __init__(self, follower: Follower, device: Device, origins: Array, vectors: Array) -> None:
        self.scene, self.device, self.origins, self.vectors = follower.scene, device, origins, vectors
        self.follower = follower
        self.eps = float(np.finfo(self.follower.dtype).eps)
        self.may_lose = not all(method.is_guaranteed for method in methods_of(self.scene))
        self.tally = Tally(self._pixel)
        self.held = np.zeros(len(origins), np.bool_)  # rays of which something at a surface or on a leg was compared
        self.undecided = np.zeros(len(origins), np.bool_)
        self.surfaces = self.returned = 0

    def result(self) -> SelfCheck:
        """Follow the rays, hold every law, and return what was found."""
        ends = self._ends()
        most = int(min(ends.events.max(), _MOST_EVENTS))
        if most:
            points = self._check_paths(ends, most)
        else:
            points = self.follower.starts(self.origins, self.vectors)[0][None]
            self._check_legs(ends, np.zeros(len(ends.events)))
        untold = ~self.held | self.undecided
        self.tally.unchecked["undecided"] += int(self.undecided.sum())
        return SelfCheck(
            rays=len(self.origins),
            untold=int(untold.sum()),
            surfaces=self.surfaces,
            returned=self.returned,
            unchecked={why: self.tally.unchecked[why] for why in UNCHECKED if self.tally.unchecked[why]},
            worst={law: self.tally.worst[law] for law in LAWS if law in self.tally.worst},
            failed=self.tally.failed,
            failures=with_causes(
                {ray: self.tally.failures[ray] for ray in sorted(self.tally.failures)[:MOST_FAILURES]},
                self.scene, self.device, points, ends, self.eps, self._holds_in_double,
            ),
        )  # fmt: skip

    def _ends(self) -> Ends:
        """Follow the rays to their ends."""
        ends = self.follower.ends(self.origins, self.vectors, self.scene.numerics.max_events)
        self.undecided = ends.status == RayStatus.UNDECIDED
        return ends

    def _pixel(self, ray: int) -> tuple[int, int]:
        """Return the row and the column by which a ray is named."""
        return 0, ray

    def _holds_in_double(self, ray: int) -> bool:
        """Return whether a ray keeps the laws of paths in double precision, and was not carried in it."""
        if self.scene.numerics.precision == "double" or not self.device.has_double:
            return False
        scene = self.scene.replace({"numerics.precision": "double"})
        follower = Follower(scene, self.device, "check")
        finer = Paths(follower, self.device, self.origins[[ray]], self.vectors[[ray]]).result()
        return finer.failed == 0 and finer.checked == 1

    def _check_paths(self, ends: Ends, most: int) -> Array:
        """Check every surface point of the sample, the k-th of which is where a limit of k events ends a ray.

        Returns the start and those points, shape (most + 1, N, 3).
        """
        self.tally.unchecked["cut"] += int((ends.events > most).sum())
        each = [self.follower.ends(self.origins, self.vectors, k) for k in range(1, most)]
        each.append(ends if ends.events.max() <= most else self.follower.ends(self.origins, self.vectors, most))
        start = self.follower.starts(self.origins, self.vectors)
        points = np.stack([start[0], *(end.origin for end in each)])
        directions = np.stack([start[1], *(end.direction for end in each)])
        screen = self.scene.picture if self.follower.stops else None
        walk = Walk(points=points, directions=directions, ends=ends, screen=screen)
        event, ray, at, is_blocked = walk.event, walk.ray, walk.at, walk.is_blocked
        self.surfaces = len(ray)
        known_of = arranged if self.follower.nests else separate
        known = known_of(self.scene, walk, self.eps)
        hits = known.hits

        self._check_lengths(walk, known)
        value = np.where(np.isfinite(at).all(axis=1), hits.value, _LARGEST)
        self.held[ray[self.tally.note("surface", ray, event + 1, value, known.value_bound)]] = True
        if known.in_contact.any():
            bound = np.where(known.in_contact, _HALF, np.inf)
            self.tally.note("contact", ray, event + 1, known.twice.astype(np.float64), bound)

        if is_blocked.any() or any(map(self.scene.stops_light, self.scene.lenses.groups)):
            turned = np.where(is_blocked, np.linalg.norm(walk.after - walk.before, axis=1), 0.0)
            bound = np.where(known.tells, SAFETY * self.eps, np.inf)
            self.tally.note("stop", ray, event + 1, np.where(known.agrees, turned, 1.0), bound)
        bent = np.where(is_blocked, np.inf, known.bound)  # nothing bends what is blocked
        is_known = np.isfinite(hits.bound) & (np.isfinite(known.bound) | is_blocked)
        self.tally.unchecked["singular"] += int((~is_known).sum())
        self.tally.note("snell", ray, event + 1, known.residual, bent)

        self.tally.unchecked["unseen"] += known.unseen
        self._check_legs(ends, known.allowed, (known.legs, ray[known.leg_of], event[known.leg_of] + 1))
        self._check_returns(walk, known, bent)
        return points

    def _check_returns(self, walk: Walk, known: Interfaces, bent: Array) -> None:
        """Send rays back along legs; `bent`, shape (M,), is infinite where nothing is known of how a ray is bent."""
        hits, event, ray, most = known.hits, walk.event, walk.ray, walk.most

        # What rounding leaves of F along a ray's way: a search that starts on a surface takes that for 0
        slid = np.zeros(len(ray))
        for number in np.unique(hits.lens):
            own = hits.lens == number
            left = np.zeros(walk.points.shape[:2])
            left[event[own] + 1, ray[own]] = np.where(np.isfinite(hits.noise[own]), hits.noise[own], 0.0)
            slid[own] = np.cumsum(left, axis=0)[event[own] + 1, ray[own]]
        if self.follower.nests:  # where a surface is passed that is no event, too
            slid += np.where(np.isfinite(hits.noise), hits.noise, 0.0)

        # Legs that are known to their end: up to the next surface, or with nothing ahead of them
        onward = np.where(walk.last, np.isin(walk.ends.status[ray], LEAVES), event + 1 < most)
        legs = np.flatnonzero(onward & walk.finite & np.isfinite(bent))
        ways = []
        if legs.size:
            following = walk.points[np.minimum(event[legs] + 2, most), ray[legs]]
            end = np.where(walk.last[legs, None], walk.landing[legs], following)
            ways.append(self._sent_back(legs, walk, known, end, slid))
        # Where a ray was blocked another one along its last leg is blocked as well: the way back, turned round
        stops = np.flatnonzero(walk.is_blocked & walk.finite & np.isfinite(hits.bound) & (event < most))
        if stops.size:
            place = hits.place[stops] + self._slips(hits, stops, walk.before, slid) + known.apart[stops]
            leg = Leg(
                before=-walk.before[stops], at=walk.at[stops], along=-walk.before[stops], end=walk.start[stops],
                size=hits.size[stops], place=place, slack=np.full(len(stops), SAFETY * self.eps),
            )  # fmt: skip
            ways.append((stops, sent_back(self.follower, self.scene, leg, self.eps, may_lose=self.may_lose)))
        for which, back in ways:
            self.returned += int(self._note_returns(back, ray[which], event[which] + 1).sum())
        first = stops[event[stops] == 0] if stops.size else stops
        if first.size:
            back = sent_to_start(self.follower, walk.start[first], walk.at[first], self.eps, may_lose=self.may_lose)
            self._note_returns(back, ray[first], event[first] + 1)

    def _check_lengths(self, walk: Walk, known: Interfaces) -> None:
        """Hold |d| against a few roundings at each surface, and against what becomes of those made before.

        Snell's rule as kernels/snell_exact.cl has it takes |d| = 1 for granted: of an excess e it makes
        (1 - 2 cos_t^2 + 2 eta cos_i cos_t) e, which is 2 eta at most. The paraxial rule makes directions unit anew.
        """
        hits, event, ray, directions, ends = known.hits, walk.event, walk.ray, walk.directions, walk.ends
        face, rays = np.argmin(hits.turn, axis=1), np.arange(len(ray))
        normal = hits.normal[rays, face]
        cos_i, cos_t = (np.einsum("ni,ni->n", directions[at, ray], normal) for at in (event, event + 1))
        eta = known.n_before / known.n_after
        is_known, largest = np.isfinite(hits.turn[rays, face]) & np.isfinite(eta), known.ratio
        eta = np.where(is_known, eta, largest)
        factor = np.where(cos_i * cos_t < 0.0, 1.0, np.abs(1.0 - 2.0 * cos_t**2 + 2.0 * eta * np.abs(cos_i * cos_t)))
        factor = np.where(is_known, factor, 2.0 * largest + 1.0)
        stops = np.isin(ends.status[ray], STOPS) & walk.last  # with the direction before it
        factor = np.where(stops, np.maximum(factor, 1.0), factor)
        grows, made = np.ones(directions.shape[:2]), np.zeros(directions.shape[:2])
        grows[event + 1, ray], made[event + 1, ray] = factor, SAFETY * self.eps * (1.0 + eta)
        bounds = [np.full(directions.shape[1], SAFETY * self.eps)]
        for k in range(1, len(directions)):
            bounds.append(grows[k] * bounds[-1] + made[k])
        events, rays = np.nonzero(np.arange(len(directions))[:, None] <= ends.events)
        residual = np.abs(np.linalg.norm(directions[events, rays], axis=1) - 1.0)
        self.tally.note("length", rays, events, residual, np.stack(bounds)[events, rays])

    def _check_legs(self, ends: Ends, allowed: Array, more: tuple[Clear, Pixels, Pixels] | None = None) -> None:
        """Hold places against the legs that lead to them, and look along legs for what was passed over.

        `allowed`, shape (N,), is how large |F| may be where the last leg starts. `more` are legs that must be free as
        well, with the ray of each and the surface that it ends at.
        """
        finite = np.isfinite(np.hstack([ends.origin, ends.direction, ends.st])).all(axis=1)
        lands, leaves = (np.flatnonzero(np.isin(ends.status, some) & finite) for some in (LANDS, LEAVES))
        meets_none = ends.events == 0
        if lands.size:
            residual, bound = landings(
                self.scene.picture, ends.origin[lands], ends.direction[lands], ends.st[lands], self.eps
            )
            told = lands[self.tally.note("place", lands, 0, residual, bound)]
            self.held[told[meets_none[told]]] = True
        away = self._away(ends, leaves, allowed[leaves])
        if self.follower.stops:
            origin, direction, length, ray = away.origin, away.direction, away.length, leaves
            event = ends.events[leaves].astype(np.intp)
            if more is not None:
                legs, ray, event = away.and_also(more[0]), np.append(leaves, more[1]), np.append(event, more[2])
                origin, direction, length = legs.origin, legs.direction, legs.length
            self.tally.note(
                "ahead", ray, event, *through_picture(self.scene.picture, origin, direction, length, self.eps)
            )
        known = away.within != UNKNOWN
        self.tally.unchecked["unseen"] += int((~known).sum())
        away, leaves = away.some(known), leaves[known]
        legs, rays_of, events_of = away, leaves, ends.events[leaves].astype(np.intp)
        if more is not None:
            legs, rays_of, events_of = away.and_also(more[0]), np.append(leaves, more[1]), np.append(events_of, more[2])
        if not rays_of.size:
            return
        residual, bound = obstacles(self.scene, legs, self.eps, nests=self.follower.nests)
        if self.may_lose:
            lost = residual > bound
            self.tally.unchecked["lost"] += int(lost.sum())
            bound = np.where(lost, np.inf, bound)
            compared = self.tally.note("ahead", rays_of, events_of, residual, bound) | lost
        else:
            compared = self.tally.note("ahead", rays_of, events_of, residual, bound)
        self.tally.unchecked["unseen"] += int((~compared).sum())
        told = rays_of[compared]
        self.held[told[meets_none[told]]] = True

    def _away(self, ends: Ends, rays: Pixels, allowed: Array) -> Clear:
        """Return the last legs of rays: around all lenses, but for those that end on a picture that stops them."""
        origin, direction = ends.origin[rays], ends.direction[rays]
        length, within = np.full(len(rays), np.inf), np.full(len(rays), AROUND)
        stopped = np.flatnonzero((ends.status[rays] == RayStatus.PICTURE) & self.follower.stops)
        if stopped.size:
            length[stopped] = to_picture(self.scene.picture, origin[stopped], direction[stopped])
            place = origin[stopped] + length[stopped, None] * direction[stopped]
            within[stopped] = media_along(self.scene, origin[stopped], place, self.eps, allowed[stopped])
        return Clear(origin=origin, direction=direction, length=length, within=within, allowed=allowed)

    def _slips(self, hits: Hits, legs: Pixels, along: Array, slid: Array) -> Array:
        """Return by how much the rounding of F may shift some points along the ways back to them, scene units.

        `slid` is how far F may be off 0 at the points of `hits`; what the search of the way back rounds is added.
        """
        normal = hits.normal[legs, np.argmin(hits.turn[legs], axis=1)]
        steep = np.abs(np.einsum("ni,ni->n", along[legs], normal))
        with np.errstate(divide="ignore", invalid="ignore"):
            slip = (slid[legs] + hits.noise[legs]) / (hits.slope[legs] * steep)
        return np.where(np.isfinite(slip), slip, np.inf)

    def _sent_back(self, legs: Pixels, walk: Walk, known: Interfaces, end: Array, slid: Array
                   ) -> tuple[Pixels, Returned]:  # fmt: skip
        """Send rays back along legs that start at some surface points, and end at others; `slid` as for `_slips`."""
        hits, before, after = known.hits, walk.before, walk.after
        slip = self._slips(hits, legs, after, slid) + known.apart[legs]
        with np.errstate(divide="ignore", invalid="ignore"):
            farther = np.where(slip > 0.0, np.maximum(slip / hits.reach[legs], 1.0), 1.0)[:, None]
        turn = np.where(np.isfinite(hits.turn[legs]), hits.turn[legs] + farther * hits.swing[legs], 0.0).max(axis=1)
        unturned = turn + known.turned[legs] + SAFETY * self.eps
        face = np.argmin(hits.turn[legs], axis=1)
        normal = hits.normal[legs, face]
        # What a turn of the normal does to a direction is magnified where that grazes the surface
        steep = np.abs(np.einsum("ni,ni->n", before[legs], normal))
        slack = known.ratio[legs] * unturned / np.maximum(steep, np.sqrt(unturned))
        legs_back = Leg(
            before=before[legs], at=walk.at[legs], along=after[legs], end=end, size=hits.size[legs],
            place=hits.place[legs] + slip, slack=slack,
        )  # fmt: skip
        return legs, sent_back(self.follower, self.scene, legs_back, self.eps, may_lose=self.may_lose)

    def _note_returns(self, back: Returned, ray: Pixels, events: Pixels) -> Mask:
        """Note ways back of some rays from some surfaces; return which could be compared."""
        self.tally.unchecked["borderline"] += int((back.kind == Return.UNDECIDED).sum())
        self.tally.unchecked["lost"] += int((back.kind == Return.LOST).sum())
        bound = np.where(back.kind == Return.CAME, back.bound, np.inf)
        return self.tally.note("return", ray, events, back.residual, bound)
