"""Paths as they were followed, surface by surface; and what is known of the surfaces and media that they meet."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.selfcheck.hits import Hits
from lenscl.accuracy.selfcheck.legs import Clear, to_picture
from lenscl.config import Picture
from lenscl.status import RayStatus
from lenscl.tracing import Ends

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Pixels = NDArray[np.intp]

LANDS = tuple(int(status) for status in RayStatus if status.lands)
LEAVES = (*LANDS, int(RayStatus.BEHIND))  # all lenses, for good
STOPS = (int(RayStatus.BLOCKED), int(RayStatus.TOTAL_REFLECTION))  # at the last surface, with the direction before it


@dataclass(frozen=True, kw_only=True, eq=False)
class Walk:
    """N rays up to K surfaces each, and the M surface points that they meet, in all.

    Attributes
    ----------
    points, directions : float64 array, shape (K + 1, N, 3)
        Starts and surface points, world, and the directions behind them.
    ends : Ends
        Of the same rays.
    screen : Picture or None
        Where it stops light.
    """

    points: Array = field(repr=False)
    directions: Array = field(repr=False)
    ends: Ends = field(repr=False)
    screen: Picture | None = field(default=None, repr=False)

    @property
    def most(self) -> int:
        """How many surfaces of a ray are looked at."""
        return len(self.points) - 1

    @cached_property
    def _met(self) -> tuple[Pixels, Pixels]:
        event, ray = np.nonzero(np.arange(1, self.most + 1)[:, None] <= self.ends.events)
        return event, ray

    @property
    def event(self) -> Pixels:
        """Of each surface point, in its ray, counted from 0."""
        return self._met[0]

    @property
    def ray(self) -> Pixels:
        """The number of each surface point's ray."""
        return self._met[1]

    @cached_property
    def start(self) -> Array:
        """Where the leg to each surface point starts, shape (M, 3)."""
        start: Array = self.points[self.event, self.ray]
        return start

    @cached_property
    def before(self) -> Array:
        """The direction before each surface point, shape (M, 3)."""
        before: Array = self.directions[self.event, self.ray]
        return before

    @cached_property
    def at(self) -> Array:
        """The surface points, shape (M, 3)."""
        at: Array = self.points[self.event + 1, self.ray]
        return at

    @cached_property
    def after(self) -> Array:
        """The direction behind each surface point, shape (M, 3); that before it where the ray ended there."""
        after: Array = self.directions[self.event + 1, self.ray]
        return after

    @cached_property
    def last(self) -> Mask:
        """Whether a surface point is the last of its ray."""
        last: Mask = self.event + 1 == self.ends.events[self.ray]
        return last

    @cached_property
    def is_blocked(self) -> Mask:
        """Whether the ray ended there on an opaque lens."""
        blocked: Mask = self.last & (self.ends.status[self.ray] == STOPS[0])
        return blocked

    @cached_property
    def is_reflected(self) -> Mask:
        """Whether the ray ended there by total reflection."""
        reflected: Mask = self.last & (self.ends.status[self.ray] == STOPS[1])
        return reflected

    @cached_property
    def finite(self) -> Mask:
        """Whether all of it are numbers."""
        finite: Mask = np.all(np.isfinite(np.stack([self.before, self.at, self.after])), axis=(0, 2))
        return finite

    @cached_property
    def landing(self) -> Array:
        """Where last legs end on a picture that stops light, shape (M, 3); no number where none does."""
        place = np.full(self.at.shape, np.nan)
        stopped = np.flatnonzero(self.last & (self.ends.status[self.ray] == RayStatus.PICTURE))
        if self.screen is not None and stopped.size:
            origin, direction = self.at[stopped], self.after[stopped]
            place[stopped] = origin + to_picture(self.screen, origin, direction)[:, None] * direction
        return place

    @cached_property
    def length(self) -> Array:
        """Of the leg to each surface point."""
        length: Array = np.linalg.norm(self.at - self.start, axis=1)
        return length


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Interfaces:
    """What is known of the M surface points of a walk, and of the legs between them; arrays of M.

    Attributes
    ----------
    hits : Hits
        The surface that each point is held to.
    value_bound : float64 array
        How large |F| may be there, with what the surfaces before it leave.
    residual, bound : float64 array
        How far off Snell's law is, and what rounding allows.
    n_before, n_after : float64 array
        Indices of the media that the ray comes from and goes on in; no number where one is not known.
    ratio : float64 array
        At least n_before / n_after and n_after / n_before.
    agrees, tells : bool array
        Whether the ray ends there if, and only if, one of the media is opaque; and whether the media are known.
    legs : Clear
        That must be free of surfaces that change the medium.
    leg_of : int array
        The surface point that each of these legs ends at.
    allowed : float64 array, shape (N,)
        How large |F| may be where the last legs start.
    unseen : int
        Legs of which nothing is known.
    apart, turned : float64 array
        How far surfaces in contact are from each other at the point, scene units along the ray, and radians.
    in_contact, twice : bool array
        Whether surfaces are in contact there, or one with a picture that stops light; and whether the ray is said to
        meet the next one at the same place, or to go on from there.
    """

    hits: Hits = field(repr=False)
    value_bound: Array = field(repr=False)
    residual: Array = field(repr=False)
    bound: Array = field(repr=False)
    n_before: Array = field(repr=False)
    n_after: Array = field(repr=False)
    ratio: Array = field(repr=False)
    agrees: Mask = field(repr=False)
    tells: Mask = field(repr=False)
    legs: Clear = field(repr=False)
    leg_of: Pixels = field(repr=False)
    allowed: Array = field(repr=False)
    unseen: int = 0
    apart: Array = field(repr=False)
    turned: Array = field(repr=False)
    in_contact: Mask = field(repr=False)
    twice: Mask = field(repr=False)
