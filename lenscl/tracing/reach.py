"""Which lenses the film's rays may reach: one that none can get to is left out of the kernel.

Rays stay in the pyramid from the source through the film's edges, or in the prism of parallel light, up to the first
surface that bends them. A lens whose box lies outside is met by those alone that another lens has bent. What a lens may
do to a ray's direction is bounded where it is convex and reflects no ray on: each of two refractions turns it by 90
degrees less the critical angle at most. So the directions that leave a lens lie in a cone about the film's axis, and
what is in none of the cones from any lens that is reached is out of reach.

Whatever else bends rays, a mirror among it, may send them anywhere, and then no lens is left out.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from math import acos, inf, pi

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Group, Lenses, Scene
from lenscl.tracing.placement import Placement

_CLEARANCE = 1e-5  # of the lengths at hand, or radians: single precision takes a ray astray by less
_MOST_STEPS = 1024  # from lens to lens; rays that may go on farther are taken to go anywhere
_MOST_LOOKS = 2**24  # at a lens from another: of very many lenses fewer steps are taken

Array = NDArray[np.float64]


def reached(scene: Scene, reflecting: Collection[int]) -> dict[int, str]:
    """Return the lenses that rays of the film may reach, by number, each with how.

    Parameters
    ----------
    scene : Scene
    reflecting : set of int
        The lenses in which a ray may be reflected totally and go on.
    """
    count = len(scene.lenses)
    found = dict.fromkeys(np.flatnonzero(~out_of_view(scene)).tolist(), "rays of the film pass through its box")
    if not found:  # as it stands the kernel serves the scene's next version, too; a shorter one is not worth building
        return dict.fromkeys(range(count), "no ray of the film gets to a lens; a kernel has one at least")
    if len(found) == count:
        return found

    # Follow the cones of directions from lens to lens until none grows
    axis, widest = _directions(scene)
    layers = scene.layers()
    centres, radii = _balls(scene.lenses)
    angles = np.full(count, -1.0)  # with the axis, of rays that arrive at a lens; -1 where none do
    angles[list(found)] = widest
    queue, steps, most = list(found), 0, min(_MOST_STEPS, max(1, _MOST_LOOKS // count))
    turns = _deviations(scene, layers, reflecting)
    while queue and len(found) < count:
        i, steps = queue.pop(), steps + 1
        if i not in turns:
            continue
        leaves = min(pi, angles[i] + turns[i]) if steps < most else pi
        seen = (angles < leaves) & (_least_angles(centres - centres[i], radii + radii[i], axis) <= leaves + _CLEARANCE)
        seen[i] = False
        angles[seen] = leaves
        for j in np.flatnonzero(seen).tolist():
            found.setdefault(j, f"rays that {scene.lens_key(i)} has bent may meet it")
            queue.append(j)
    return found


def out_of_view(scene: Scene) -> NDArray[np.bool_]:
    """Say of each lens whether it is proved that no straight ray of the film passes through its box; shape (N,)."""
    planes = _planes(scene)
    return np.zeros(len(scene.lenses), dtype=bool) if planes is None else _are_outside(scene.lenses, *planes)


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


def _balls(lenses: Lenses) -> tuple[Array, Array]:
    """Return the middles of all lenses' boxes, shape (N, 3), and the radii of the balls about them, shape (N,)."""
    middles, radii = np.empty((len(lenses), 3)), np.empty(len(lenses))
    for group, corners, part in _corners(lenses):
        middles[part] = group.centres + corners.mean(axis=0)
        radii[part] = np.linalg.norm(corners - corners.mean(axis=0), axis=1).max()
    return middles, radii


def _corners(lenses: Lenses) -> Iterator[tuple[Group, Array, slice]]:
    """Yield each table with the corners of its box, shape (8, 3), at the origin, and where its lenses are."""
    for group in lenses.groups:
        yield group, Placement.of(group.lens.solid).corners(), slice(group.first, group.first + len(group))


def _deviations(scene: Scene, layers: Sequence[Scene], reflecting: Collection[int]) -> dict[int, float]:
    """Return by how much lenses may turn a ray at most, by number, in radians; those that turn none are left out.

    It is inf where that is not bounded.
    """
    found: dict[int, float] = {}
    for number, group in enumerate(scene.lenses.groups):
        if group.lens.mirror:
            found |= dict.fromkeys(group.numbers, inf)
            continue
        ratios = [layer.lenses.groups[number].lens.n / layer.n_medium for layer in layers]
        if scene.stops_light(group) or all(ratio == 1.0 for ratio in ratios):
            continue
        is_bounded = scene.numerics.snell == "exact" and group.lens.surface.is_convex
        turn = 2.0 * max(acos(min(ratio, 1.0 / ratio)) for ratio in ratios) if is_bounded else inf
        found |= {one: inf if one in reflecting else turn for one in group.numbers}
    return found


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


def _are_outside(lenses: Lenses, points: Array, normals: Array) -> NDArray[np.bool_]:
    """Say of each lens whether its box's corners lie beyond one of the planes all together; shape (N,)."""
    outside = np.zeros(len(lenses), dtype=bool)
    for group, corners, part in _corners(lenses):
        for point, normal in zip(points, normals, strict=True):
            from_plane = (group.centres - point)[:, None] + corners
            heights, sizes = from_plane @ normal, np.linalg.norm(from_plane, axis=-1)
            outside[part] |= (heights < -_CLEARANCE * sizes.max(axis=1)[:, None]).all(axis=1)
    return outside


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
