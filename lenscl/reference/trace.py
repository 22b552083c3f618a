"""Twin of kernels/trace.cl and lens.cl, and of their forms for nested solids: every ray through every surface.

A ray carries the set of solids that it travels in. Where they overlap, the last of `Scene.by_priority` is the medium; a
surface that does not change the medium is passed without an event, and faces in contact are one interface. Solids that
are apart are the case of sets of one.

source    nested dielectrics: Schmidt & Budge, Simple nested dielectrics in ray traced images, JGT 7(2), 2002
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens, Scene
from lenscl.expr import evaluate, evaluate_with_error, gradient
from lenscl.reference import contact, march, mirror, rays, screen, snell
from lenscl.reference.placement import Placement
from lenscl.reference.stops import picture_stops
from lenscl.status import RayStatus

Array = NDArray[np.float64]
_NOWHERE = -1
_BOX_MARGIN = 2.0**-10  # of the box's extent, as the solid must lie strictly inside
_PLACING = 16 * np.finfo(float).eps  # of the lengths at hand: what placing a point in a lens's space may lose


@dataclass(frozen=True, slots=True, kw_only=True)
class Steps:
    """The steps of a trace; a test replaces one by a faulty version."""

    film_rays: Callable[[Scene], tuple[Array, Array]] = rays.film_rays
    placement: Callable[[Lens], Placement] = Placement.of
    first_root: Callable[..., Any] = march.first_root
    by_priority: Callable[[Scene], tuple[int, ...]] = Scene.by_priority
    together: Callable[..., Any] = contact.together
    refract: Callable[..., Any] = snell.refract
    reflect: Callable[[Array, Array], Array] = snell.reflect
    on_mirror: Callable[..., tuple[Any, Any]] = mirror.on_mirror
    land: Callable[..., Any] = screen.land
    stops: Callable[..., Any] = screen.stops


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Paths:
    """The ends of rays, as `RayPaths` has them; `total` counts each ray's total reflections."""

    st: Array = field(repr=False)
    status: NDArray[np.uint8] = field(repr=False)
    events: NDArray[np.uint8] = field(repr=False)
    origin: Array = field(repr=False)
    direction: Array = field(repr=False)
    total: NDArray[np.uint8] = field(repr=False)

    def counts(self) -> dict[RayStatus, int]:
        """Return how many rays ended how; they sum to the rays."""
        return {status: int(np.count_nonzero(self.status == status)) for status in RayStatus}


def trace(scene: Scene, steps: Steps | None = None) -> Paths:
    """Trace every film pixel, row by row; arrays of shape (rows * columns, ...)."""
    steps = steps or Steps()
    return trace_rays(scene, *steps.film_rays(scene), steps=steps)


def trace_rays(scene: Scene, origins: Array, directions: Array, steps: Steps | None = None) -> Paths:
    """Trace given rays; directions unit, arrays of shape (N, 3)."""
    tracer = _Tracer(scene, np.array(origins, float), np.array(directions, float), steps or Steps())
    while tracer.travels.any():
        tracer.to_next_surface()
    return tracer.landed()


class _Tracer:
    """N rays among L lenses. `point` is where a ray is; `origin` where its last event was, or its start."""

    def __init__(self, scene: Scene, origin: Array, direction: Array, steps: Steps) -> None:
        n, lenses = len(origin), len(scene.lenses)
        self.scene, self.steps = scene, steps
        self.origin, self.direction, self.point = origin, direction, origin.copy()
        self.inside, self.on = np.zeros((2, lenses, n), dtype=np.bool_)
        self.events, self.total = np.zeros(n, np.int64), np.zeros(n, np.int64)
        self.status = np.full(n, RayStatus.UNDECIDED, dtype=np.uint8)
        self.travels = np.ones(n, dtype=np.bool_)
        self.lands = np.zeros(n, dtype=np.bool_)
        self.order = np.array(steps.by_priority(scene), dtype=np.int64)
        self.is_screen = picture_stops(scene)
        for number, lens in enumerate(scene.lenses):
            self._start_on(number, lens)

    def _start_on(self, number: int, lens: Lens) -> None:
        placement = self.steps.placement(lens)
        local = placement.point_to_local(self.origin)
        f, bound, normal = _known(lens, placement, local, self.origin)
        near = _in_box(lens, local)
        touches = near & (np.abs(f) <= bound)
        enters = np.sum(normal * self.direction, axis=1) < 0
        self.on[number] = touches
        self.inside[number] = (touches & enters) | (near & (f < 0) & ~touches)

    def medium(self, inside: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Return the numbers of the lenses that are the media in sets of solids, shape (L, N) -> (N,); -1 for none."""
        ranked = inside[self.order][::-1]  # the highest first
        found: NDArray[np.int64] = np.where(ranked.any(axis=0), self.order[::-1][np.argmax(ranked, axis=0)], _NOWHERE)
        return found

    def to_next_surface(self) -> None:
        """Take every travelling ray to its next surface and through it."""
        asks = np.flatnonzero(self.travels)
        shape = len(self.scene.lenses), len(asks)
        t, spread, found = np.full(shape, np.inf), np.zeros(shape), np.zeros(shape, dtype=np.bool_)
        point, normal = np.zeros((*shape, 3)), np.zeros((*shape, 3))
        doubt = np.full(len(asks), np.inf)  # up to where every search is proved
        for number in range(shape[0]):
            place, found[number], unsure, point[number], normal[number], spread[number] = self._meet(number, asks)
            t[number] = np.where(found[number], place, np.inf)
            doubt = np.where(unsure, np.minimum(doubt, place), doubt)

        crossed, edge = self.steps.together(t, found, spread, normal)
        met, row = found.any(axis=0), np.arange(len(asks))
        lens_met = np.argmin(t, axis=0)
        points, point, normal = point, point[lens_met, row], normal[lens_met, row]
        length = np.linalg.norm(normal, axis=1)
        last = np.where(crossed, t, -np.inf).max(axis=0)
        edge |= ~((length > 0) & np.isfinite(length))
        landing, unsure = self._landing(asks, np.where(met, t[lens_met, row], np.inf), spread[lens_met, row], normal)
        stopped = np.isfinite(landing)
        met &= ~stopped
        proved_to = np.where(met, last, landing)
        undecided = ((doubt <= proved_to) & np.isfinite(doubt)) | (met & edge) | unsure
        inside = self.inside[:, asks]
        before, after = self.medium(inside), self.medium(inside ^ crossed)
        passes = met & (before == after)
        trapped = met & ~undecided & ~passes & (self.events[asks] >= self.scene.numerics.max_events)
        reflects, open_edge = self._mirrors(asks, points, found & crossed, before, after)
        undecided |= open_edge & met & ~passes & ~trapped
        self.status[asks[trapped]] = RayStatus.TRAPPED
        self.lands[asks[~met & ~undecided]] = True
        goes = met & ~undecided & ~trapped
        self.travels[asks[~goes]] = False

        # Within one medium the ray goes straight on
        go = asks[goes]
        self.point[go], self.on[:, go] = point[goes], crossed[:, goes]
        self.inside[:, asks[goes & passes]] ^= crossed[:, goes & passes]
        bends = goes & ~passes
        leaves = inside[lens_met, row][bends]
        facing = np.where(leaves[:, None], -1.0, 1.0) * normal[bends] / length[bends, None]
        self._bend(asks[bends], facing, before[bends], after[bends], crossed[:, bends], reflects[bends])

    def _mirrors(
        self,
        asks: NDArray[np.intp],
        points: Array,
        met: NDArray[np.bool_],
        before: NDArray[np.int64],
        after: NDArray[np.int64],
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return which rays meet a mirrored face of a solid that is a medium there, and of which that is not known."""
        reflects, edge = np.zeros((2, len(asks)), np.bool_)
        for number, lens in enumerate(self.scene.lenses):
            some = np.flatnonzero(met[number] & ((before == number) | (after == number))) if lens.mirror else asks[:0]
            if not some.size:
                continue
            point, start = points[number, some], self.point[asks[some]]
            reach = np.maximum(np.abs(point), np.abs(start)).max(axis=1)
            direction = self.direction[asks[some]]
            coated, unsure = self.steps.on_mirror(lens, self.steps.placement(lens), point, direction, reach)
            reflects[some] |= coated & ~unsure
            edge[some] |= unsure
        return reflects, edge & ~reflects

    def _landing(
        self, asks: NDArray[np.intp], nearest: Array, spread: Array, normal: Array
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Return where the picture ends rays before the next surface, inf where not, and of which rounding hides it."""
        if not self.is_screen:
            return np.full(len(asks), np.inf), np.zeros(len(asks), dtype=np.bool_)
        found: tuple[Array, NDArray[np.bool_]] = self.steps.stops(
            self.point[asks], self.direction[asks], self.scene.picture, nearest, spread, normal
        )
        return found

    def _meet(self, number: int, asks: NDArray[np.intp]) -> tuple[Any, ...]:
        lens = self.scene.lenses[number]
        placement = self.steps.placement(lens)
        o, d = placement.point_to_local(self.point[asks]), placement.vector_to_local(self.direction[asks])
        inside, departs = self.inside[number, asks], self.on[number, asks]
        enter, leave = _span(lens, o, d)
        enter = np.where(inside | departs, 0.0, enter)
        start = o + enter[:, None] * d
        length = np.maximum(leave - enter, 0.0)
        t, found, unsure = self.steps.first_root(
            lambda p: evaluate(lens.surface.expression, _values(lens, p)),
            start,
            d,
            length,
            inside,
            departs,
            self.scene.numerics.step,
        )
        p = start + t[:, None] * d
        world = placement.point_to_world(p)
        _, bound, normal = _known(lens, placement, p, np.maximum(np.abs(world), np.abs(self.point[asks])))
        with np.errstate(all="ignore"):
            spread = bound / np.abs(np.sum(normal * self.direction[asks], axis=1))
        return enter + t, found, unsure, world, normal, spread

    def _bend(
        self,
        go: NDArray[np.intp],
        facing: Array,
        before: NDArray[np.int64],
        after: NDArray[np.int64],
        crossed: NDArray[np.bool_],
        mirrors: NDArray[np.bool_],
    ) -> None:
        index = np.array([*(lens.n for lens in self.scene.lenses), self.scene.n_medium])  # the last is at _NOWHERE
        refract = self.steps.refract if self.scene.numerics.snell == "exact" else snell.refract_paraxial
        bent, total = refract(self.direction[go], facing, index[before] / index[after])
        turned = self.steps.reflect(self.direction[go], facing)
        follows = self.scene.effects.total_reflection != "end"

        came = self.direction[go]
        self.origin[go] = self.point[go]
        self.events[go] += 1
        total &= ~mirrors
        self.total[go] += total
        self.inside[:, go] ^= crossed & ~total & ~mirrors
        self.direction[go] = np.where(total[:, None], turned if follows else self.direction[go], bent)
        self.direction[go[mirrors]] = turned[mirrors]
        if not follows:
            self.status[go[total]] = RayStatus.TOTAL_REFLECTION
            self.travels[go[total]] = False
        opaque = np.array([*(self.scene.blocks(number) for number in range(len(self.scene.lenses))), False])
        blocks = (opaque[before] | opaque[after]) & ~mirrors
        self.status[go[blocks]] = RayStatus.BLOCKED
        self.direction[go[blocks]] = came[blocks]  # nothing bends it
        self.travels[go[blocks]] = False

    def landed(self) -> Paths:
        """Return the ends, the last legs met with the picture's plane."""
        st = np.full((len(self.origin), 2), -1.0)
        lands = np.flatnonzero(self.lands)
        st[lands], self.status[lands] = self.steps.land(self.point[lands], self.direction[lands], self.scene.picture)
        return Paths(
            st=st,
            status=self.status,
            events=self.events.astype(np.uint8),
            origin=self.origin,
            direction=self.direction,
            total=self.total.astype(np.uint8),
        )


def _known(lens: Lens, placement: Placement, local: Array, world: Array) -> tuple[Array, Array, Array]:
    """Return F at points, how large rounding may make it on the surface, and its gradient as world vectors.

    `world` holds coordinates as large as those on the points' way.
    """
    f, rounding = evaluate_with_error(lens.surface.expression, _values(lens, local))
    normal = placement.normal_to_world(_gradient(lens, local))
    moved = _PLACING * (np.abs(world) + np.abs(placement.centre)).sum(axis=1)
    with np.errstate(all="ignore"):
        bound = rounding + moved * np.linalg.norm(normal, axis=1)
    return f, np.where(np.isfinite(bound), bound, rounding), normal


def _values(lens: Lens, local: Array) -> dict[str, Any]:
    return {**lens.values, "x": local[:, 0], "y": local[:, 1], "z": local[:, 2]}


def _gradient(lens: Lens, local: Array) -> Array:
    slopes = [evaluate(slope, _values(lens, local)) for slope in gradient(lens.surface.expression)]
    return np.stack([np.broadcast_to(slope, len(local)) for slope in slopes], axis=-1)


def _box(lens: Lens) -> tuple[Array, Array]:
    low, high = (np.asarray(corner, float) for corner in lens.surface.promised or lens.surface.box(lens.values))
    margin = _BOX_MARGIN * (high - low) if lens.surface.promised is None else 0.0
    return low - margin, high + margin


def _in_box(lens: Lens, local: Array) -> NDArray[np.bool_]:
    low, high = _box(lens)
    inside: NDArray[np.bool_] = np.all((local >= low) & (local <= high), axis=1)
    return inside


def _span(lens: Lens, o: Array, d: Array) -> tuple[Array, Array]:
    """Return where rays enter and leave the box, ahead of their origin; leave < enter where they miss it."""
    low, high = _box(lens)
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (low - o) / d, (high - o) / d
    along = d == 0
    misses = (along & ((o < low) | (o > high))).any(axis=1)
    enter = np.where(along, 0.0, np.minimum(a, b)).max(axis=1)
    leave = np.where(along, np.inf, np.maximum(a, b)).min(axis=1)
    return np.maximum(enter, 0.0), np.where(misses, -1.0, leave)
