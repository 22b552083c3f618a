"""Which lenses the film's rays may reach: one that none can get to is left out of the kernel.

Rays stay in the pyramid from the source through the film's edges, or in the prism of parallel light, up to the first
surface that bends them. A lens whose box lies outside is met by those alone that another lens has bent. What a lens may
do to a ray's direction is bounded where it is convex and reflects no ray on: each of two refractions turns it by 90
degrees less the critical angle at most. So the directions that leave a lens lie in a cone about the film's axis, and
what is in none of the cones from any lens that is reached is out of reach.

Whatever else bends rays may send them anywhere, and then no lens is left out.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from math import acos, asin, inf, pi

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
from lenscl.tracing.placement import Placement

_CLEARANCE = 1e-5  # of the lengths at hand, or radians: single precision takes a ray astray by less
_MOST_STEPS = 1024  # from lens to lens; rays that may go on farther are taken to go anywhere

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Ball:
    """What is known of where a lens is."""

    centre: Array
    radius: float

    @classmethod
    def around(cls, corners: Array) -> _Ball:
        centre = corners.mean(axis=0)
        return cls(centre, float(np.linalg.norm(corners - centre, axis=1).max()))

    def sees(self, other: _Ball, axis: Array, angle: float) -> bool:
        """Say whether a ray from here may meet another ball that makes such an angle with an axis at most."""
        apart = other.centre - self.centre
        distance, reach = float(np.linalg.norm(apart)), (self.radius + other.radius) * (1.0 + _CLEARANCE)
        if distance <= reach:
            return True
        off = acos(min(1.0, max(-1.0, float(apart @ axis) / distance)))
        return off - asin(reach / distance) <= angle + _CLEARANCE


def reached(scene: Scene, reflecting: Collection[int]) -> dict[int, str]:
    """Return the lenses that rays of the film may reach, by number, each with how.

    Parameters
    ----------
    scene : Scene
    reflecting : collection of int
        The lenses in which a ray may be reflected totally and go on.
    """
    corners = [Placement.of(lens).corners() for lens in scene.lenses]
    planes = _planes(scene)
    found = {
        number: "rays of the film pass through its box"
        for number, box in enumerate(corners)
        if planes is None or not _is_outside(box, *planes)
    }
    if not found:  # as it stands the kernel serves the scene's next version, too; a shorter one is not worth building
        return dict.fromkeys(range(len(corners)), "no ray of the film gets to a lens; a kernel has one at least")
    if len(found) == len(corners):
        return found

    # Follow the cones of directions from lens to lens until none grows
    axis, widest = _directions(scene)
    balls = [_Ball.around(box) for box in corners]
    angles = dict.fromkeys(found, widest)  # with the axis, of rays that arrive at a lens
    queue, steps = list(found), 0
    while queue:
        i, steps = queue.pop(), steps + 1
        if not _bends(scene, i):
            continue
        leaves = min(pi, angles[i] + _deviation(scene, i, reflecting)) if steps < _MOST_STEPS else pi
        for j, ball in enumerate(balls):
            if j != i and leaves > angles.get(j, -1.0) and balls[i].sees(ball, axis, leaves):
                angles[j] = leaves
                found.setdefault(j, f"rays that {scene.lens_key(i)} has bent may meet it")
                queue.append(j)
    return found


def _bends(scene: Scene, number: int) -> bool:
    return not scene.blocks(number) and any(layer.lenses[number].n != layer.n_medium for layer in scene.layers())


def _deviation(scene: Scene, number: int, reflecting: Collection[int]) -> float:
    """Return by how much a lens may turn a ray at most, in radians; inf where that is not bounded."""
    if number in reflecting or scene.numerics.snell != "exact" or not scene.lenses[number].surface.is_convex:
        return inf
    ratios = [layer.lenses[number].n / layer.n_medium for layer in scene.layers()]
    return 2.0 * max(acos(min(ratio, 1.0 / ratio)) for ratio in ratios)


def _planes(scene: Scene) -> tuple[Array, Array] | None:
    """Return planes around the film's straight rays: points, and unit normals inwards; None where film is edge-on."""
    corner, right, down = (np.asarray(v, dtype=np.float64) for v in _film(scene))
    around = np.stack([corner, corner + right, corner + right + down, corner + down])
    if scene.source.at is not None:
        source = np.asarray(scene.source.at, dtype=np.float64)
        towards = around - source
        normals = [*np.cross(towards, np.roll(towards, -1, axis=0)), np.cross(right, down)]
        points = np.stack([source] * 5)
    else:
        direction = np.asarray(scene.source.direction, dtype=np.float64)
        towards = np.stack([direction] * 4)
        normals = list(np.cross(np.roll(around, -1, axis=0) - around, direction))
        points = around
    lengths = np.linalg.norm(normals, axis=1)
    middle = corner + (right + down) / 2
    if not (lengths > 0.0).all():
        return None
    units = np.array(normals) / lengths[:, None]
    inwards = ((middle - points) * units).sum(axis=1)
    if (np.abs(inwards) <= _CLEARANCE * np.linalg.norm(middle - points, axis=1)).any():
        return None
    return points, units * np.sign(inwards)[:, None]


def _film(scene: Scene) -> tuple[Array, Array, Array]:
    film = scene.film
    corner, right, down = (np.asarray(v, dtype=np.float64) for v in (film.corner, film.right, film.down))
    return corner, right, down


def _is_outside(box: Array, points: Array, normals: Array) -> bool:
    """Say whether a box's corners, shape (8, 3), lie beyond one of the planes all together."""
    from_plane = box[:, None] - points
    heights = (from_plane * normals).sum(axis=-1)
    sizes = np.linalg.norm(from_plane, axis=-1)
    return bool((heights < -_CLEARANCE * sizes.max(axis=0)).all(axis=0).any())


def _directions(scene: Scene) -> tuple[Array, float]:
    """Return the unit axis of a cone that holds the directions of the film's rays, and its half-angle."""
    if scene.source.at is None:
        direction = np.asarray(scene.source.direction, dtype=np.float64)
        return direction / np.linalg.norm(direction), 0.0
    corner, right, down = _film(scene)
    towards = np.stack([corner, corner + right, corner + right + down, corner + down]) - scene.source.at
    units = towards / np.linalg.norm(towards, axis=1)[:, None]
    axis = units.mean(axis=0) / np.linalg.norm(units.mean(axis=0))
    cosine = float((units @ axis).min())
    return axis, acos(min(1.0, cosine)) if cosine > 0.0 else pi  # beyond 90 degrees the cone is not convex
