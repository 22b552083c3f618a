"""Check a ray map by itself: on a sample of its rays, what must hold of every path, whatever the lens.

Four laws are checked at every surface point of some 64 rays, or of rays that are given, followed through the device's
own kernels, and two more on their last legs:

    length    directions stay unit
    surface   |F| = 0 where a surface is met
    snell     rays bend there by the scene's rule, and turn back only where there is no way through
    return    sent back along each leg, a ray comes back the way it came
    ahead     nothing lies in the way of a ray that has left the lenses: F is nowhere negative
    place     it lands where its last leg meets the picture's plane

and one more that joins them to a map: the followed ray ends as the map says that its pixel did. Nothing is compared
with another program's answer. Every residual is held against a bound of its own, made of the roundings that the
precision makes unavoidable at that very place, so 1 is the most that a healthy ray shows.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.selfcheck.bends import bends, stopped
from lenscl.accuracy.selfcheck.findings import LAWS, MOST_FAILURES, UNCHECKED, Failure, SelfCheck
from lenscl.accuracy.selfcheck.hits import SAFETY, Hits, Tolerance, hits_of
from lenscl.accuracy.selfcheck.legs import landings, obstacles
from lenscl.accuracy.selfcheck.returns import Leg, Return, sent_back
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.status import RayStatus
from lenscl.tracing import Ends, Follower, RayMap, film_rays, methods_of

Array = NDArray[np.float64]
Pixels = NDArray[np.intp]

_CELLS = 8  # along each side of the part of the film that shows a lens
_LONGEST = 8  # rays with the most events
_MOST_EVENTS = 16  # surfaces of a ray that are looked at
_BESIDE = (4.0, 16.0)  # roundings
_CORNERS = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])  # a tetrahedron's
_LANDS = tuple(int(status) for status in RayStatus if status.lands)
_LARGEST = 1e30  # a residual that is no number is written as this


def check_map(raymap: RayMap) -> SelfCheck:
    """Check a sample of a map's rays by laws that hold without any reference.

    Parameters
    ----------
    raymap : RayMap
        As traced. The rays are traced again on its device by its method, in its precision. Of several wavelengths each
        is checked, and a failure names its own.

    Raises
    ------
    BuildError, TraceError
        If the device refuses to trace them again.
    """
    checks = [_checked(layer) for layer in raymap.layers()]
    if "wavelengths" in raymap.added:
        checks = [check.at_wavelength(nm) for check, nm in zip(checks, raymap.wavelengths.tolist(), strict=True)]
    return sum(checks, SelfCheck())


def _checked(raymap: RayMap) -> SelfCheck:
    pixels = sampled(raymap.events)
    if not pixels.size:
        return SelfCheck()
    with np.errstate(all="ignore"):  # a broken ray may hold anything; what is no number is a failure, not a warning
        return _Check(raymap, pixels).result()


def check_rays(scene: Scene, device: Device, origins: Array, vectors: Array) -> SelfCheck:
    """Check rays of the caller's own by the laws of paths; there is no map to hold their ends against.

    Parameters
    ----------
    scene : Scene
        With the method and the precision to follow them in.
    device : Device
        Where to trace.
    origins, vectors : float64 array, shape (N, 3)
        World, scene units; vectors of any length but 0.

    Returns
    -------
    SelfCheck
        A failure's ray is its column; of rays that meet nothing the last leg is checked.

    Raises
    ------
    BuildError, TraceError
        If the device refuses to trace them.
    """
    with np.errstate(all="ignore"):  # as in `check_map`
        return _Paths(scene, device, origins, vectors).result()


def sampled(events: NDArray[np.uint8]) -> Pixels:
    """Return the pixels to look at: one of each cell of the part of a film that shows lenses, and some of most events.

    Parameters
    ----------
    events : uint8 array, shape (rows, columns)
        Of a ray map.

    Returns
    -------
    int array, shape (N,)
        Numbers of pixels whose rays meet a lens, ascending; the same for the same events.
    """
    row, column = np.nonzero(events)
    if not row.size:
        return np.zeros(0, np.intp)
    cell = np.zeros(len(row), np.intp)
    for place in (row, column):
        first, count = place.min(), np.ptp(place) + 1
        cell = cell * _CELLS + (place - first) * min(_CELLS, count) // count
    order = np.argsort(cell, kind="stable")
    _, begins, counts = np.unique(cell[order], return_index=True, return_counts=True)
    numbers = row * events.shape[1] + column
    most = np.argsort(-events[row, column].astype(np.int16), kind="stable")[:_LONGEST]
    return np.unique(np.concatenate([numbers[order[begins + counts // 2]], numbers[most]]))


class _Paths:
    """The check of given rays at work."""

    def __init__(self, scene: Scene, device: Device, origins: Array, vectors: Array) -> None:
        self.scene, self.origins, self.vectors = scene, origins, vectors
        self.follower = Follower(scene, device, "check")
        self.eps = float(np.finfo(self.follower.dtype).eps)
        self.methods = methods_of(self.scene)
        self.may_lose = not all(method.is_guaranteed for method in self.methods)
        self.unchecked: Counter[str] = Counter()
        self.worst: dict[str, float] = {}
        self.failed = 0
        self.failures: dict[int, Failure] = {}  # the first of each ray
        self.surfaces = self.returned = 0

    def result(self) -> SelfCheck:
        ends = self._ends()
        most = int(min(ends.events.max(), _MOST_EVENTS))
        if most:
            self._check_paths(ends, most)
        else:
            self._check_last_legs(ends, np.zeros(len(ends.events)))
        failures = [self.failures[ray] for ray in sorted(self.failures)]
        return SelfCheck(
            rays=len(self.origins),
            surfaces=self.surfaces,
            returned=self.returned,
            unchecked={why: self.unchecked[why] for why in UNCHECKED if self.unchecked[why]},
            worst={law: self.worst[law] for law in LAWS if law in self.worst},
            failed=self.failed,
            failures=tuple(failures[:MOST_FAILURES]),
        )

    def _ends(self) -> Ends:
        """Follow the rays to their ends."""
        ends = self.follower.ends(self.origins, self.vectors, self.scene.numerics.max_events)
        self.unchecked["undecided"] += int((ends.status == RayStatus.UNDECIDED).sum())
        return ends

    def _pixel(self, ray: int) -> tuple[int, int]:
        """Return the row and the column by which a ray is named."""
        return 0, ray

    def _check_paths(self, ends: Ends, most: int) -> None:
        """Check every surface point of the sample, the k-th of which is where a limit of k events ends a ray."""
        self.unchecked["cut"] += int((ends.events > most).sum())
        each = [self.follower.ends(self.origins, self.vectors, k) for k in range(1, most)]
        each.append(ends if ends.events.max() <= most else self.follower.ends(self.origins, self.vectors, most))
        start = self.follower.starts(self.origins, self.vectors)
        points = np.stack([start[0], *(end.origin for end in each)])
        directions = np.stack([start[1], *(end.direction for end in each)])
        event, ray = np.nonzero(np.arange(1, most + 1)[:, None] <= ends.events)  # event counts from 0 here
        self.surfaces = len(ray)
        before, after, at = directions[event, ray], directions[event + 1, ray], points[event + 1, ray]
        hits = hits_of(self.scene, at, self.eps, Tolerance.of(self.scene, self.eps))

        self._check_lengths(directions, ends, hits, event, ray)
        finite = np.isfinite(np.stack([before, at, after])).all(axis=(0, 2))
        sums = np.zeros(points.shape[:2])  # a search that starts on a surface takes off what F is there
        sums[event + 1, ray] = hits.bound
        bound = np.cumsum(sums, axis=0)[event + 1, ray]
        self._note("surface", ray, event + 1, np.where(np.isfinite(at).all(axis=1), hits.value, _LARGEST), bound)

        allowed = np.zeros(len(ends.events))
        np.maximum.at(allowed, ray, np.where(np.isfinite(hits.bound), hits.bound, np.inf))
        self._check_last_legs(ends, allowed)

        # A ray that ended by total reflection keeps its direction
        stops = (ends.status[ray] == RayStatus.TOTAL_REFLECTION) & (event + 1 == ends.events[ray])
        residual, bound = bends(self.scene, hits, before, after, self.eps)
        if stops.any():
            r, b = stopped(self.scene, hits, before, self.eps)
            residual, bound = np.where(stops, r, residual), np.where(stops, b, bound)
        self.unchecked["singular"] += int((~np.isfinite(bound) | ~np.isfinite(hits.bound)).sum())
        self._note("snell", ray, event + 1, residual, bound)

        # Legs that are known to their end: up to the next surface, or with nothing ahead of them
        last = event + 1 == ends.events[ray]
        leaves = ~np.isin(ends.status[ray], (RayStatus.TRAPPED, RayStatus.UNDECIDED, RayStatus.TOTAL_REFLECTION))
        legs = np.flatnonzero((np.where(last, leaves, event + 1 < most)) & finite & np.isfinite(bound))
        if legs.size:
            following = points[np.minimum(event[legs] + 2, most), ray[legs]]
            end = np.where(last[legs, None], np.nan, following)
            self._check_returns(legs, hits, before, at, after, end, event[legs], ray[legs])

    def _check_lengths(self, directions: Array, ends: Ends, hits: Hits, event: Pixels, ray: Pixels) -> None:
        """Hold |d| against a few roundings at each surface, and against what becomes of those made before.

        Snell's rule as kernels/snell_exact.cl has it takes |d| = 1 for granted: of an excess e it makes
        (1 - 2 cos_t^2 + 2 eta cos_i cos_t) e, which is 2 eta at most. The paraxial rule makes directions unit anew.
        """
        face, rays = np.argmin(hits.turn, axis=1), np.arange(len(ray))
        normal, known = hits.normal[rays, face], np.isfinite(hits.turn[rays, face])
        cos_i, cos_t = (np.einsum("ni,ni->n", directions[at, ray], normal) for at in (event, event + 1))
        n_before = np.where(cos_i > 0.0, hits.index, self.scene.n_medium)
        n_after = np.where(cos_i > 0.0, self.scene.n_medium, hits.index)
        largest = np.maximum(hits.index / self.scene.n_medium, self.scene.n_medium / hits.index)
        eta = np.where(known, n_before / n_after, largest)
        factor = np.where(cos_i * cos_t < 0.0, 1.0, np.abs(1.0 - 2.0 * cos_t**2 + 2.0 * eta * np.abs(cos_i * cos_t)))
        factor = np.where(known, factor, 2.0 * largest + 1.0)
        grows, made = np.ones(directions.shape[:2]), np.zeros(directions.shape[:2])
        grows[event + 1, ray], made[event + 1, ray] = factor, SAFETY * self.eps * (1.0 + eta)
        bounds = [np.full(directions.shape[1], SAFETY * self.eps)]
        for k in range(1, len(directions)):
            bounds.append(grows[k] * bounds[-1] + made[k])
        events, rays = np.nonzero(np.arange(len(directions))[:, None] <= ends.events)
        residual = np.abs(np.linalg.norm(directions[events, rays], axis=1) - 1.0)
        self._note("length", rays, events, residual, np.stack(bounds)[events, rays])

    def _check_last_legs(self, ends: Ends, allowed: Array) -> None:
        """Hold places against the legs that lead to them, and look along these for what was passed over.

        `allowed`, shape (N,), is how large |F| may be where the leg starts.
        """
        finite = np.isfinite(np.hstack([ends.origin, ends.direction, ends.st])).all(axis=1)
        lands = np.flatnonzero(np.isin(ends.status, _LANDS) & finite)
        if not lands.size:
            return
        legs = ends.origin[lands], ends.direction[lands]
        residual, bound = landings(self.scene.picture, *legs, ends.st[lands], self.eps)
        self._note("place", lands, 0, residual, bound)

        residual, bound = obstacles(self.scene, *legs, allowed[lands], self.eps)
        if self.may_lose:
            self.unchecked["lost"] += int((residual > bound).sum())
        else:
            self._note("ahead", lands, ends.events[lands], residual, bound)

    def _check_returns(
        self, legs: Pixels, hits: Hits, before: Array, at: Array, after: Array, end: Array, event: Pixels, ray: Pixels
    ) -> None:
        turn = np.where(np.isfinite(hits.turn[legs]), hits.turn[legs] + hits.swing[legs], 0.0).max(axis=1)
        eta = np.maximum(hits.index / self.scene.n_medium, self.scene.n_medium / hits.index)[legs]
        unturned = turn + SAFETY * self.eps
        face = np.argmin(hits.turn[legs], axis=1)
        normal = hits.normal[legs, face]
        # What a turn of the normal does to a direction is magnified where that grazes the surface
        steep = np.abs(np.einsum("ni,ni->n", before[legs], normal))
        slack = eta * unturned / np.maximum(steep, np.sqrt(unturned))
        legs_back = Leg(
            before=before[legs], at=at[legs], along=after[legs], end=end, size=hits.size[legs],
            place=hits.place[legs], slack=slack,
        )  # fmt: skip
        back = sent_back(self.follower, self.scene, legs_back, self.eps, may_lose=self.may_lose)
        told = back.kind == Return.CAME
        self.returned = int(told.sum())
        self.unchecked["borderline"] += int((back.kind == Return.UNDECIDED).sum())
        self.unchecked["lost"] += int((back.kind == Return.LOST).sum())
        self._note("return", ray[told], event[told] + 1, back.residual[told], back.bound[told])

    def _note(self, law: str, rays: Pixels, events: Any, residual: Array, bound: Array) -> None:
        """Keep the worst of residuals and the first failure of each ray."""
        residual = np.where(np.isfinite(residual), residual, _LARGEST)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.nan_to_num(residual / bound, nan=0.0, posinf=_LARGEST)
        self.worst[law] = max(self.worst.get(law, 0.0), float(ratio.max(initial=0.0)))
        for i in np.flatnonzero(ratio > 1.0):
            self.failed += 1
            ray = int(rays[i])
            event = int(np.broadcast_to(events, ratio.shape)[i])
            row, column = self._pixel(ray)
            failure = Failure(
                row=row, column=column, event=event, law=law, residual=float(residual[i]), bound=float(bound[i])
            )
            if ray not in self.failures or event < self.failures[ray].event:
                self.failures[ray] = failure


class _Check(_Paths):
    """One map's check at work."""

    def __init__(self, raymap: RayMap, pixels: Pixels) -> None:
        super().__init__(raymap.scene, raymap.device, *film_rays(raymap.scene, pixels))
        self.raymap, self.pixels = raymap, pixels

    def _pixel(self, ray: int) -> tuple[int, int]:
        row, column = divmod(int(self.pixels[ray]), self.scene.film.columns)
        return row, column

    def _ends(self) -> Ends:
        """Follow the sample to its end; where a ray ends otherwise than the map says, ask rays beside it."""
        numerics = self.scene.numerics
        ends = super()._ends()
        undecided = ends.status == RayStatus.UNDECIDED
        status, events = (array.ravel()[self.pixels] for array in (self.raymap.status, self.raymap.events))
        differs = np.flatnonzero(~undecided & ((ends.status != status) | (ends.events != events)))
        if self.may_lose:  # a rounding of a march's steps decides what it loses, beside the pixel as well as on it
            self.unchecked["lost"] += len(differs)
        elif differs.size:
            beside = self._rays_beside(differs)
            alike = np.ones(len(differs), dtype=np.bool_)
            for vectors in beside:
                other = self.follower.ends(self.origins[differs], vectors, numerics.max_events)
                alike &= (other.status == ends.status[differs]) & (other.events == ends.events[differs])
            self.unchecked["borderline"] += int((~alike).sum())
            residual = np.abs(ends.events.astype(float) - events)[differs]
            self._note("map", differs, 0, np.where(alike, np.maximum(residual, 1.0), 0.0), np.full(len(differs), 0.5))
        return ends

    def _rays_beside(self, rays: Pixels) -> list[Array]:
        """Return directions that are off by more than the rounding of the kernel's own film pixels, on all sides."""
        vectors, origins = self.vectors[rays], self.origins[rays]
        size = np.abs(origins) + np.abs(origins + vectors)
        aside = self.eps * size.max(axis=1, keepdims=True)
        return [vectors + reach * aside * corner for reach in _BESIDE for corner in _CORNERS]
