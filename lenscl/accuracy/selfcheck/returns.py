"""Send rays back along the legs of their paths: each must come back through the surface it came from.

A path is reversed surface by surface. From near the far end of every leg a ray goes back, must meet the leg's own
surface first, at the leg's start, and leave it along the leg before, reversed; for the first surface that is the line
through the source, or along the parallel light. Together they are the whole way back; apart, each is as well
conditioned as its own surface, and a rounding of one surface is not magnified by the next.

What it starts in is found anew from F, so a path that lost count of inside and outside does not come back.

How exact a return can be is asked of the device: the same ray, displaced and turned by a few roundings in four ways,
shows how far such a rounding carries. Where the displaced ones meet other surfaces nobody can tell.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
from lenscl.status import RayStatus
from lenscl.tracing import Ends, Follower, locate

Array = NDArray[np.float64]
_ALONG = 0.875  # of a leg: where the way back starts. Not at its end, which is on a surface to its rounding only
_BEYOND = 0.5  # of the lens's size, where the leg is the last
_ROUNDINGS = 8.0  # by which the displaced rays are
_TOLERATED = 4.0  # spreads
_SPLIT = 1e-2  # of the lens's size: rays that come so far apart met other surfaces


class Return(IntEnum):
    """What became of a ray that was sent back."""

    CAME = 0  # back, or not: residual and bound say it
    UNDECIDED = 1  # within rounding of another path
    LOST = 2  # to another surface point, where `march` may have lost one on either way


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Returned:
    """Ways back; arrays of N."""

    residual: Array = field(repr=False)
    bound: Array = field(repr=False)
    kind: NDArray[np.uint8] = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Leg:
    """Legs that start at surface points; arrays of N.

    Attributes
    ----------
    before, at, along : float64 array, shape (N, 3)
        The direction before the surface point, the point, and the direction behind it.
    end : float64 array, shape (N, 3)
        The next surface point; no number where the leg is the last.
    size, place : float64 array, shape (N,)
        As in `Hits`, of the start's lens.
    slack : float64 array, shape (N,)
        How far `before` may be off by what is known of the normal.
    """

    before: Array = field(repr=False)
    at: Array = field(repr=False)
    along: Array = field(repr=False)
    end: Array = field(repr=False)
    size: Array = field(repr=False)
    place: Array = field(repr=False)
    slack: Array = field(repr=False)


def sent_back(follower: Follower, scene: Scene, legs: Leg, eps: float, *, may_lose: bool) -> Returned:
    """Send one ray back along each leg.

    Parameters
    ----------
    follower : Follower
    scene : Scene
    legs : Leg
    eps : float
        Of the precision that rays are carried in.
    may_lose : bool
        Whether the search may pass over surfaces.
    """
    start = np.where(
        np.isnan(legs.end),
        legs.at + (_BEYOND * legs.size)[:, None] * legs.along,
        legs.at + _ALONG * (legs.end - legs.at),
    )
    reach = np.linalg.norm(start, axis=1) + np.linalg.norm(legs.at, axis=1) + legs.size
    every, directions = _beside(start, -legs.along, reach, eps)
    every = follower.rounded(every)
    n, ways = len(start), len(every) // len(start)
    back = follower.ends(every, directions, 1)
    met = back.events.reshape(ways, n) > 0
    on = _on_surfaces(follower, every).reshape(ways, n).any(axis=0)
    place, direction = (array.reshape(ways, n, 3) for array in (back.origin, back.direction))

    # Compare with where and how the leg started
    residuals = np.linalg.norm(place[0] - legs.at, axis=1), np.linalg.norm(direction[0] + legs.before, axis=1)
    spreads = tuple(np.linalg.norm(each[1:] - each[0], axis=2).max(axis=0) for each in (place, direction))
    bounds = _TOLERATED * spreads[0] + legs.place, _TOLERATED * spreads[1] + legs.slack
    with np.errstate(invalid="ignore"):
        ratios = np.stack([residuals[0] / bounds[0], residuals[1] / bounds[1]])
    worst = np.argmax(np.where(np.isnan(ratios), -1.0, ratios), axis=0)  # what is no number hides nothing
    residual, bound = (np.stack(each)[worst, np.arange(n)] for each in (residuals, bounds))
    residual = np.where(met[0], residual, legs.size)  # it met no surface: so far off, or farther
    bound = np.where(met[0], bound, legs.place)

    comes = met[0] & (residual <= bound)
    splits = (met != met[0]).any(axis=0) | (spreads[0] > _SPLIT * legs.size) | _is_undecided(back, met).any(axis=0)
    undecided = on | (splits & ~(comes & (spreads[0] <= _SPLIT * legs.size)))
    elsewhere = ~met[0] | (residuals[0] > bounds[0])
    lost = elsewhere & ~undecided if may_lose else np.zeros_like(elsewhere)
    kind = np.where(undecided, Return.UNDECIDED, np.where(lost, Return.LOST, Return.CAME)).astype(np.uint8)
    return Returned(residual=residual, bound=bound, kind=kind)


def sent_to_start(follower: Follower, starts: Array, at: Array, eps: float, *, may_lose: bool) -> Returned:
    """Send one ray back along each first leg, from near its surface point: nothing may lie before the leg's start.

    Parameters
    ----------
    follower : Follower
    starts, at : float64 array, shape (N, 3)
        Where the rays start, and the first surface points.
    eps : float
        Of the precision that rays are carried in.
    may_lose : bool
        Whether the search may pass over surfaces.
    """
    way = starts - at
    whole = np.linalg.norm(way, axis=1)
    direction = way / whole[:, None]
    near = at + (1.0 - _ALONG) * way
    reach = np.linalg.norm(starts, axis=1) + np.linalg.norm(at, axis=1)
    every, directions = _beside(near, direction, reach, eps)
    every = follower.rounded(every)
    back = follower.ends(every, directions, 1)
    shape = len(every) // len(at), len(at)
    met = back.events.reshape(shape) > 0
    along = np.linalg.norm(back.origin - every, axis=1).reshape(shape)
    early = np.where(met, np.maximum(_ALONG * whole - along, 0.0), 0.0)  # before the start, by so much
    residual = early.min(axis=0)  # a rounding decides whether it is met, where some pass it
    spread = early.max(axis=0) - residual
    bound = _TOLERATED * spread + _ROUNDINGS * eps * reach
    on = _on_surfaces(follower, every).reshape(shape).any(axis=0)
    undecided = on | _is_undecided(back, met).any(axis=0) | ((early > 0.0).any(axis=0) & (early == 0.0).any(axis=0))
    lost = (residual > bound) & ~undecided if may_lose else np.zeros_like(undecided)
    kind = np.where(undecided, Return.UNDECIDED, np.where(lost, Return.LOST, Return.CAME)).astype(np.uint8)
    return Returned(residual=residual, bound=bound, kind=kind)


def _beside(start: Array, direction: Array, reach: Array, eps: float) -> tuple[Array, Array]:
    """Return rays, and behind them four times as many that are displaced and turned by a few roundings."""
    aside, turned = (_ROUNDINGS * eps * reach)[:, None], _ROUNDINGS * eps
    u, v = _across(direction)
    starts, directions = [start], [direction]
    for sign in (1.0, -1.0):
        for one, other in ((u, v), (v, u)):
            starts.append(start + sign * aside * one)
            directions.append(direction + sign * turned * other)
    return np.concatenate(starts), np.concatenate(directions)


def _on_surfaces(follower: Follower, points: Array) -> NDArray[np.bool_]:
    """Return which points lie on surfaces, as far as rounding lets it be told: a ray's side there is not known."""
    on: NDArray[np.bool_]
    on = locate(follower.scene, points)[1] >= 0
    return on


def _is_undecided(back: Ends, met: NDArray[np.bool_]) -> NDArray[np.bool_]:
    undecided: NDArray[np.bool_] = (back.status.reshape(met.shape) == RayStatus.UNDECIDED) & ~met
    return undecided


def _across(direction: Array) -> tuple[Array, Array]:
    """Return two unit vectors across each direction and each other."""
    axis = np.eye(3)[np.argmin(np.abs(direction), axis=1)]
    u = np.cross(direction, axis)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return u, np.cross(direction, u)
