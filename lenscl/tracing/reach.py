"""Which lenses the film's rays may reach: one that none can get to is left out of the kernel.

Rays stay in the pyramid from the source through the film's edges, or in the prism of parallel light, up to the first
surface that bends them. A lens whose box lies outside is met by those alone that another lens has bent. What a lens may
do to a ray's direction is bounded where it is convex and reflects no ray on: each of two refractions turns it by 90
degrees less the critical angle at most. So the directions that leave a lens lie in a cone about the film's axis, and
what is in none of the cones from any lens that is reached is out of reach.

Whatever else bends rays, a mirror among it, may send them anywhere, and then no lens is left out.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from math import acos, inf, pi

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
from lenscl.tracing.placement import Placement

_CLEARANCE = 1e-5  # of the lengths at hand, or radians: single precision takes a ray astray by less
_MOST_STEPS = 1024  # from lens to lens; rays that may go on farther are taken to go anywhere

Array = NDArray[np.float64]


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
    layers = scene.layers()
    centres = np.array([box.mean(axis=0) for box in corners])
    radii = np.array([np.linalg.norm(box - box.mean(axis=0), axis=1).max() for box in corners])
    angles = np.full(len(corners), -1.0)  # with the axis, of rays that arrive at a lens; -1 where none do
    angles[list(found)] = widest
    queue, steps = list(found), 0
    while queue:
        i, steps = queue.pop(), steps + 1
        is_passive = scene.blocks(i) or all(layer.lenses[i].n == layer.n_medium for layer in layers)
        if is_passive and not scene.lenses[i].mirror:
            continue
        leaves = min(pi, angles[i] + _deviation(scene, layers, i, reflecting)) if steps < _MOST_STEPS else pi
        seen = (angles < leaves) & (_least_angles(centres - centres[i], radii + radii[i], axis) <= leaves + _CLEARANCE)
        seen[i] = False
        angles[seen] = leaves
        for j in np.flatnonzero(seen).tolist():
            found.setdefault(j, f"rays that {scene.lens_key(i)} has bent may meet it")
            queue.append(j)
    return found


def _least_angles(apart: Array, reach: Array, axis: Array) -> Array:
    """Return the least angle with an axis, shape (N,), of a line from one ball to another.

    `apart`, shape (N, 3), is between their centres; `reach`, shape (N,), the sum of their radii. It is -1 for balls
    that touch.
    """
    distance, reach = np.linalg.norm(apart, axis=1), reach * (1.0 + _CLEARANCE)
    is_apart = distance > reach
    far = np.where(is_apart, distance, 1.0)
    off = np.arccos(np.clip(apart @ axis / far, -1.0, 1.0)) - np.arcsin(np.where(is_apart, reach, 0.0) / far)
    return np.where(is_apart, off, -1.0)


def _deviation(scene: Scene, layers: Sequence[Scene], number: int, reflecting: Collection[int]) -> float:
    """Return by how much a lens may turn a ray at most, in radians; inf where that is not bounded."""
    lens = scene.lenses[number]
    if number in reflecting or lens.mirror or scene.numerics.snell != "exact" or not lens.surface.is_convex:
        return inf
    ratios = [layer.lenses[number].n / layer.n_medium for layer in layers]
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
