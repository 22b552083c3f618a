"""How a small change of a ray's start grows along its path: the path differentiated, event by event.

A change moves the start across the ray and turns the direction. From one surface to the next a point moves with the
direction and slides along the surface; the normal turns there by what F's second derivatives say; and the direction
behind follows by the derivative of the law that bends it. All of it is in closed form, from the points and directions
that were traced, so no step has to be chosen, and growth of any size comes out to many digits.

source    ray differentials: Igehy, Tracing Ray Differentials, SIGGRAPH 1999
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens, Scene
from lenscl.expr import Expr, differentiate, evaluate, gradient
from lenscl.tracing import Placement, picture_numbers

Array = NDArray[np.float64]


class Growth:
    """The derivative of a path with respect to relative changes of its start; taken from event to event.

    Parameters
    ----------
    direction : float64 array, shape (3,)
        World, unit: along the first leg.
    reach : float
        Scene units: a relative change e moves the start by e times this.
    """

    def __init__(self, direction: Array, reach: float) -> None:
        across = np.eye(3) - np.outer(direction, direction)
        nothing = np.zeros((3, 3))
        self._reach = reach
        self._place: Array = np.hstack([reach * across, nothing])  # d point / d (start, direction)
        self._turn: Array = np.hstack([nothing, across])

    def to_surface(self, leg: float, direction: Array, normal: Array) -> float | None:
        """Take a leg, scene units long, to a surface; return the growth up to there, None where it has no bound."""
        with np.errstate(all="ignore"):
            moved = self._place + leg * self._turn
            self._place = moved - np.outer(direction, normal @ moved) / (normal @ direction)
        return _norm(self._place / self._reach)

    def through(
        self, direction: Array, normal: Array, bend: Array, eta: float, k: float, *, total: bool, paraxial: bool
    ) -> None:
        """Go through the surface.

        Parameters
        ----------
        direction, normal : float64 array, shape (3,)
            Unit; the normal against the ray.
        bend : float64 array, shape (3, 3)
            How this normal turns as the point moves: see `normal_bend`.
        eta, k : float
            n_before / n_after, and as `Event.k`.
        total, paraxial : bool
            Whether the ray is totally reflected; whether it is bent by the paraxial rule.
        """
        with np.errstate(all="ignore"):
            cosine = -direction @ normal
            turned = bend @ self._place
            d_cosine = -(normal @ self._turn + direction @ turned)
            if total:
                self._turn = self._turn + 2.0 * (np.outer(normal, d_cosine) + cosine * turned)
            elif paraxial:
                behind = eta * direction + (eta - 1.0) * cosine * normal
                change = eta * self._turn + (eta - 1.0) * (np.outer(normal, d_cosine) + cosine * turned)
                length = np.linalg.norm(behind)
                unit = behind / length
                self._turn = (change - np.outer(unit, unit @ change)) / length
            else:
                # The direction behind is eta d + (eta c - sqrt k) N, and k = 1 - eta^2 (1 - c^2)
                root = np.sqrt(k)
                along = (eta - eta * eta * cosine / root) * d_cosine
                self._turn = eta * self._turn + np.outer(normal, along) + (eta * cosine - root) * turned

    def on_picture(self, scene: Scene, origin: Array, direction: Array) -> float | None:
        """Take the last leg to the picture's plane; return the growth up to (s, t)."""
        numbers = picture_numbers(scene)
        normal, corner = numbers["normal"], numbers["corner"]
        with np.errstate(all="ignore"):
            moved = self._place + (corner - origin) @ normal / (direction @ normal) * self._turn
            place = moved - np.outer(direction, normal @ moved) / (normal @ direction)
        return _norm(np.stack([numbers["dual_s"] @ place, numbers["dual_t"] @ place]))


def normal_bend(lens: Lens, face: Expr, point: Array) -> Array:
    """Return how a face's outward unit normal turns as a point on it moves, world, shape (3, 3), per scene unit.

    Where F has no second derivatives there the numbers are not finite.
    """
    placement = Placement.of(lens)
    at = {**lens.values, **dict(zip("xyz", placement.local(point), strict=True))}
    slopes = gradient(face)
    g = placement.to_local.T @ np.array([float(evaluate(slope, at)) for slope in slopes])
    seconds = np.array([[float(evaluate(differentiate(slope, axis), at)) for axis in "xyz"] for slope in slopes])
    with np.errstate(all="ignore"):
        length = np.linalg.norm(g)
        normal = g / length
        hessian = placement.to_local.T @ seconds @ placement.to_local
        bend: Array = (np.eye(3) - np.outer(normal, normal)) @ hessian / length
    return bend


def _norm(changes: Array) -> float | None:
    """Return the largest singular value."""
    return float(np.linalg.norm(changes, 2)) if np.isfinite(changes).all() else None
