"""Twin of kernels/trace.cl and lens.cl: every ray through every surface, in plain numpy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens, Scene
from lenscl.expr import evaluate, evaluate_with_error, gradient
from lenscl.reference import march, rays, screen, snell
from lenscl.reference.placement import Placement
from lenscl.status import RayStatus

Array = NDArray[np.float64]
_NOWHERE = -1
_BOX_MARGIN = 2.0**-10  # of the box's extent, as the solid must lie strictly inside


@dataclass(frozen=True, slots=True, kw_only=True)
class Steps:
    """The steps of a trace; a test replaces one by a faulty version."""

    film_rays: Callable[[Scene], tuple[Array, Array]] = rays.film_rays
    placement: Callable[[Lens], Placement] = Placement.of
    first_root: Callable[..., Any] = march.first_root
    refract: Callable[..., Any] = snell.refract
    reflect: Callable[[Array, Array], Array] = snell.reflect
    land: Callable[..., Any] = screen.land


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
    def __init__(self, scene: Scene, origin: Array, direction: Array, steps: Steps) -> None:
        n = len(origin)
        self.scene, self.steps = scene, steps
        self.origin, self.direction = origin, direction
        self.inside, self.on = np.full(n, _NOWHERE), np.full(n, _NOWHERE)
        self.events, self.total = np.zeros(n, np.int64), np.zeros(n, np.int64)
        self.status = np.full(n, RayStatus.UNDECIDED, dtype=np.uint8)
        self.travels = np.ones(n, dtype=np.bool_)
        self.lands = np.zeros(n, dtype=np.bool_)
        for number, lens in enumerate(scene.lenses):
            self._start_on(number, lens)

    def _start_on(self, number: int, lens: Lens) -> None:
        placement = self.steps.placement(lens)
        local = placement.point_to_local(self.origin)
        f, rounding = evaluate_with_error(lens.surface.expression, _values(lens, local))
        near = _in_box(lens, local)
        normal = _gradient(lens, local)
        moved = 16 * np.finfo(float).eps * (np.abs(self.origin) + np.abs(placement.centre)).sum(axis=1)
        with np.errstate(all="ignore"):
            bound = rounding + moved * np.linalg.norm(placement.normal_to_world(normal), axis=1)
        touches = near & (np.abs(f) <= np.where(np.isfinite(bound), bound, rounding))
        enters = np.sum(placement.normal_to_world(normal) * self.direction, axis=1) < 0
        self.on[touches] = number
        self.inside[(touches & enters) | (near & (f < 0) & ~touches)] = number

    def to_next_surface(self) -> None:
        """Take every travelling ray to its next surface and through it."""
        n = len(self.origin)
        nearest, lens_met = np.full(n, np.inf), np.full(n, _NOWHERE)
        point, normal = np.zeros((n, 3)), np.zeros((n, 3))
        doubt = np.full(n, np.inf)  # up to where every search is proved
        for number in range(len(self.scene.lenses)):
            asks = np.flatnonzero(self.travels & ((self.inside == number) | (self.inside == _NOWHERE)))
            t, found, unsure, p, g = self._meet(number, asks)
            doubt[asks[unsure]] = np.minimum(doubt[asks[unsure]], t[unsure])
            nearer = found & (t < nearest[asks])
            chosen = asks[nearer]
            nearest[chosen], lens_met[chosen] = t[nearer], number
            point[chosen], normal[chosen] = p[nearer], g[nearer]

        met = self.travels & (lens_met != _NOWHERE)
        length = np.linalg.norm(normal, axis=1)
        undecided = self.travels & (doubt <= nearest) & np.isfinite(doubt)
        undecided |= met & ~((length > 0) & np.isfinite(length))
        trapped = met & ~undecided & (self.events >= self.scene.numerics.max_events)
        self.status[trapped] = RayStatus.TRAPPED
        self.lands |= self.travels & ~met & ~undecided
        self.travels = met & ~undecided & ~trapped
        go = np.flatnonzero(self.travels)
        self._bend(go, point[go], normal[go] / length[go, None], lens_met[go])

    def _meet(self, number: int, asks: NDArray[np.intp]) -> tuple[Any, ...]:
        lens = self.scene.lenses[number]
        placement = self.steps.placement(lens)
        o, d = placement.point_to_local(self.origin[asks]), placement.vector_to_local(self.direction[asks])
        inside, departs = self.inside[asks] == number, self.on[asks] == number
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
        return enter + t, found, unsure, placement.point_to_world(p), placement.normal_to_world(_gradient(lens, p))

    def _bend(self, go: NDArray[np.intp], point: Array, normal: Array, lens_met: NDArray[np.int64]) -> None:
        leaves = self.inside[go] != _NOWHERE
        n_lens = np.array([lens.n for lens in self.scene.lenses])[lens_met]
        n_before = np.where(leaves, n_lens, self.scene.n_medium)
        n_after = np.where(leaves, self.scene.n_medium, n_lens)
        facing = np.where(leaves[:, None], -normal, normal)
        refract = self.steps.refract if self.scene.numerics.snell == "exact" else snell.refract_paraxial
        bent, total = refract(self.direction[go], facing, n_before / n_after)
        turned = self.steps.reflect(self.direction[go], facing)
        follows = self.scene.effects.total_reflection != "end"

        came = self.direction[go]
        self.origin[go], self.on[go] = point, lens_met
        self.events[go] += 1
        self.total[go] += total
        self.inside[go] = np.where(total, self.inside[go], np.where(leaves, _NOWHERE, lens_met))
        self.direction[go] = np.where(total[:, None], turned if follows else self.direction[go], bent)
        if not follows:
            self.status[go[total]] = RayStatus.TOTAL_REFLECTION
            self.travels[go[total]] = False
        blocks = np.array([self.scene.blocks(number) for number in range(len(self.scene.lenses))])[lens_met]
        self.status[go[blocks]] = RayStatus.BLOCKED
        self.direction[go[blocks]] = came[blocks]  # nothing bends it
        self.travels[go[blocks]] = False

    def landed(self) -> Paths:
        """Return the ends, the last legs met with the picture's plane."""
        st = np.full((len(self.origin), 2), -1.0)
        lands = np.flatnonzero(self.lands)
        st[lands], self.status[lands] = self.steps.land(self.origin[lands], self.direction[lands], self.scene.picture)
        return Paths(
            st=st,
            status=self.status,
            events=self.events.astype(np.uint8),
            origin=self.origin,
            direction=self.direction,
            total=self.total.astype(np.uint8),
        )


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
