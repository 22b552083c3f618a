"""Paths of rays, surface by surface, as the kernels trace them, and laws of paths that `check_rays` does not hold.

Every law gives a residual and a bound for each ray or surface. Bounds are made of what the precision rounds at each
surface, `Hits.place` and the angle that goes with it, carried on by the path's own differential: nothing is tuned.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl import RayStatus, reference
from lenscl.accuracy.selfcheck.hits import SAFETY, Hits, Tolerance, hits_of
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.expr import evaluate_with_error, gradient
from lenscl.reference import Placement
from lenscl.tracing import Follower

Array = NDArray[np.float64]
Law = tuple[Array, Array]  # residuals and bounds, the latter infinite where nothing can be said

_DOUBLE = 2.0**-52
_UNIFORM = 40  # samples of a leg, and beside its ends
_NEAR_ENDS = 2.0 ** -np.arange(2.0, 14.0)


@dataclass(frozen=True, eq=False)
class Paths:
    """N rays followed through at most E surfaces: where they are after k of them, shape (E + 1, N, 3)."""

    scene: Scene
    device: Device
    follower: Follower
    given: tuple[Array, Array] = field(repr=False)
    points: Array = field(repr=False)
    directions: Array = field(repr=False)
    status: NDArray[np.uint8] = field(repr=False)
    events: NDArray[np.uint8] = field(repr=False)
    st: Array = field(repr=False)

    @classmethod
    def of(cls, scene: Scene, device: Device, origins: Array, directions: Array, most: int | None = None) -> Paths:
        """Follow rays through at most so many surfaces, the scene's `max_events` unless told."""
        follower = Follower(scene, device)
        limit = scene.numerics.max_events if most is None else most
        ends = follower.ends(origins, directions, limit)
        start = follower.starts(origins, directions)
        each = [follower.ends(origins, directions, k) for k in range(1, int(ends.events.max()))]
        each += [ends] if ends.events.any() else []
        points = np.stack([start[0], *(end.origin for end in each)])
        along = np.stack([start[1], *(end.direction for end in each)])
        return cls(scene, device, follower, (origins, directions), points, along, ends.status, ends.events, ends.st)

    @property
    def eps(self) -> float:
        """Of the precision that rays are carried in."""
        return float(np.finfo(self.follower.dtype).eps)

    @cached_property
    def met(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return every surface that is met: after how many others, and by which ray."""
        event, ray = np.nonzero(np.arange(1, len(self.points))[:, None] <= self.events)
        return event, ray

    @cached_property
    def hits(self) -> Hits:
        """What is known of the surfaces that are met, in the order of `met`."""
        event, ray = self.met
        return hits_of(self.scene, self.points[event + 1, ray], self.eps, Tolerance.of(self.scene, self.eps))

    @cached_property
    def normal(self) -> tuple[Array, Array]:
        """Return unit normals, and how far they may be turned; infinite where no face has a normal of its own."""
        face = np.argmin(self.hits.turn, axis=1)
        rows = np.arange(len(face))
        alone = np.isfinite(self.hits.turn).sum(axis=1) == 1  # on an edge either face may be the one that is met
        turn = np.where(alone, self.hits.turn[rows, face] + self.hits.swing[rows, face], np.inf)
        return self.hits.normal[rows, face], turn

    @cached_property
    def before_and_after(self) -> tuple[Array, Array]:
        """Return the refractive indices before and behind each surface."""
        event, ray = self.met
        normal, _ = self.normal
        comes_out = _dot(self.directions[event, ray], normal) > 0.0
        stays_in = _dot(self.directions[event + 1, ray], normal) < 0.0
        medium = self.scene.n_medium
        return np.where(comes_out, self.hits.index, medium), np.where(stays_in, self.hits.index, medium)

    @cached_property
    def leg(self) -> Array:
        """The length of the leg that leads to each surface."""
        event, ray = self.met
        found: Array = np.linalg.norm(self.points[event + 1, ray] - self.points[event, ray], axis=1)
        return found

    @cached_property
    def slack(self) -> Array:
        """How far a direction behind each surface may be off where its point may be another, too."""
        return self.slack_of(self.normal[1])

    def slack_of(self, turn: Array) -> Array:
        """Return how far directions behind surfaces may be off by turned normals, magnified where they graze."""
        event, ray = self.met
        ratio = self.hits.index / self.scene.n_medium
        eta = np.maximum(ratio, 1.0 / ratio)
        turned = turn + SAFETY * self.eps
        steep = np.abs(_dot(self.directions[event + 1, ray], self.normal[0]))
        with np.errstate(invalid="ignore"):
            found: Array = (1.0 + eta) * turned / np.maximum(steep, np.sqrt(turned))
        return found


def _dot(a: Array, b: Array) -> Array:
    product: Array = np.einsum("...i,...i->...", a, b)
    return product


def stationary(paths: Paths) -> Law:
    """Fermat: moved along its surface, no surface point between two others changes the optical path, to first order.

    From the points alone: how the path n |P - A| + n' |B - P| changes with P, across the normal.
    """
    event, ray = paths.met
    inner = np.flatnonzero(event + 1 < paths.events[ray])
    event, ray = event[inner], ray[inner]
    a, p, b = (paths.points[event + k, ray] for k in range(3))
    legs = [np.linalg.norm(p - a, axis=1), np.linalg.norm(b - p, axis=1)]
    n, n_after = (each[inner] for each in paths.before_and_after)
    normal, turn = (each[inner] for each in paths.normal)
    with np.errstate(all="ignore"):
        change = n[:, None] * (p - a) / legs[0][:, None] - n_after[:, None] * (b - p) / legs[1][:, None]
        residual = np.linalg.norm(np.cross(normal, change), axis=1)
        # Each point is known to its place; the points before and behind are of this ray's surfaces, or its start
        place = paths.hits.place
        at = np.full(paths.points.shape[:2], 0.0)
        at[0] = SAFETY * paths.eps * np.linalg.norm(paths.points[0], axis=1)
        at[paths.met[0] + 1, paths.met[1]] = place
        moved = [at[event, ray] + at[event + 1, ray], at[event + 1, ray] + at[event + 2, ray]]
        bound = SAFETY * paths.eps * (n + n_after) + turn * np.linalg.norm(change, axis=1)
        bound = bound + SAFETY * (n * moved[0] / legs[0] + n_after * moved[1] / legs[1])
    return np.nan_to_num(residual, nan=0.0), np.where(np.isfinite(bound), bound, np.inf)


def unobstructed(paths: Paths) -> Law:
    """No sign change of F lies on a leg: its sign at samples, where rounding cannot turn it, is the leg's own.

    The residual is how deep F is on the wrong side, the bound what rounding of F, of the leg and of its ends allows.
    """
    event, ray = paths.met
    legs = list(zip(event, ray, strict=True))
    share = np.unique(np.concatenate([(np.arange(_UNIFORM) + 0.5) / _UNIFORM, _NEAR_ENDS, 1.0 - _NEAR_ENDS]))
    start, end = paths.points[event, ray], paths.points[event + 1, ray]
    worst, most = np.zeros(len(legs)), np.ones(len(legs))
    around = np.full(paths.points.shape[:2], 0.0)  # how large |F| may be at each point
    around[event + 1, ray] = np.where(np.isfinite(paths.hits.bound), paths.hits.bound, np.inf)
    allowed = np.maximum(around[event, ray], around[event + 1, ray])
    normal, turn = paths.normal
    inside = _dot(paths.directions[event, ray], normal) > 0.0
    sure = np.abs(_dot(paths.directions[event, ray], normal)) > turn
    for number, lens in enumerate(paths.scene.lenses):
        placement = Placement.of(lens)
        local = [placement.point_to_local(each) for each in (start, end)]
        points = local[0][:, None] + share[:, None] * (local[1] - local[0])[:, None]
        at: dict[str, Any] = {**lens.values, **dict(zip("xyz", np.moveaxis(points, -1, 0), strict=True))}
        f, rounding = (
            np.broadcast_to(each, points.shape[:2]) for each in evaluate_with_error(lens.surface.expression, at)
        )
        slope = sum(np.abs(np.broadcast_to(evaluate_with_error(g, at)[0], points.shape[:2])) for g in
                    gradient(lens.surface.expression))  # fmt: skip
        size = (
            np.abs(local[0]).max(axis=1)
            + np.abs(local[1]).max(axis=1)
            + np.abs(placement.centre / placement.stretch).max()
        )
        bound = SAFETY * (rounding * paths.eps / _DOUBLE + slope * paths.eps * size[:, None]) + allowed[:, None]
        sign = np.where(inside & (paths.hits.lens == number), -1.0, 1.0)[:, None]
        with np.errstate(invalid="ignore"):
            ratio = np.nan_to_num(np.maximum(-sign * f, 0.0) / bound)
        deepest = np.arange(len(legs)), np.argmax(ratio, axis=1)
        deeper = ratio[deepest] >= worst / most
        worst = np.where(deeper, np.maximum(-sign * f, 0.0)[deepest], worst)
        most = np.where(deeper, bound[deepest], most)
    return worst, np.where(sure, most, np.inf)


def decided(paths: Paths) -> Law:
    """No ray is left undecided: for ordinary rays only. Residuals are 1 where one is."""
    undecided = paths.status == RayStatus.UNDECIDED
    return undecided.astype(float), np.full(len(undecided), 0.5)


def within_box(paths: Paths) -> Law:
    """Every point lies in the bounding box of its lens, to its place."""
    event, ray = paths.met
    at = paths.points[event + 1, ray]
    outside = np.full(len(at), np.inf)
    for lens in paths.scene.lenses:
        placement = Placement.of(lens)
        local = placement.point_to_local(at)
        low, high = (np.asarray(corner) for corner in lens.surface.box(lens.values))
        beyond = np.maximum(np.maximum(low - local, local - high), 0.0) * np.abs(placement.stretch)
        outside = np.minimum(outside, np.linalg.norm(beyond, axis=1))
    return outside, paths.hits.place


def landing_statuses(paths: Paths) -> Law:
    """A ray that ends on its last leg is on the picture, beside it or goes nowhere, as a plain solve says of that leg.

    Residuals are 1 where the statuses differ; where the picture's edge, or a leg along it, is within rounding, nothing
    is said.
    """
    ended = np.isin(paths.status, (RayStatus.PICTURE, RayStatus.OFF_PICTURE, RayStatus.BEHIND))
    last = paths.events.astype(np.intp), np.arange(len(paths.events))
    origin, direction = paths.points[last], paths.directions[last]
    st, status = reference.land(origin, direction, paths.scene.picture)
    normal = np.cross(paths.scene.picture.right, paths.scene.picture.down)
    span = min(np.linalg.norm(paths.scene.picture.right), np.linalg.norm(paths.scene.picture.down))
    falls = _dot(direction, normal / np.linalg.norm(normal))
    away = _dot(origin - np.asarray(paths.scene.picture.corner), normal / np.linalg.norm(normal))
    reach = np.linalg.norm(origin, axis=1) + np.linalg.norm(paths.scene.picture.corner) + span
    with np.errstate(all="ignore"):
        near_edge = np.minimum(np.abs(st), np.abs(st - 1.0)).min(axis=1) < 64 * paths.eps * (
            reach / span / np.abs(falls) + np.abs(st).max(axis=1)
        )
    told = ended & ~near_edge & (np.abs(falls) > 64 * paths.eps) & (np.abs(away) > 64 * paths.eps * reach)
    return (status != paths.status).astype(float), np.where(told, 0.5, np.inf)


def limits(paths: Paths) -> Law:
    """A limit of k events traps just the rays that have more, after k; the others end as without it, to the last bit.

    Residuals are 1 where that is not so.
    """
    wrong = np.zeros(len(paths.events))
    for k in range(1, int(paths.events.max()) + 1):
        ends = paths.follower.ends(*paths.given, k)
        trapped = (ends.status == RayStatus.TRAPPED) & (ends.events == k)
        same = (ends.status == paths.status) & (ends.events == paths.events) & (ends.st == paths.st).all(axis=1)
        wrong = np.maximum(wrong, np.where(paths.events > k, ~trapped, ~same))
    return wrong, np.full(len(wrong), 0.5)
