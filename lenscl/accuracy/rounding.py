"""What is known of a scene about the rounding of its rays: sizes that `bounds` makes its moves and terms from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
from lenscl.expr import evaluate_with_error, gradient
from lenscl.tracing import Placement, RayPaths, picture_numbers

Array = NDArray[np.float64]

_MOST_NOISE = 1e-6  # of a lens, or radians: beyond, moves are too large for their effects to be in proportion


def surface_noise(scene: Scene, paths: RayPaths) -> tuple[Array, Array]:
    """Return how far rounding in F may displace the surface that each ray met last, and tilt its normal.

    It is usually below the ulps of a start; not so where F is a difference of large numbers. It is inf where rounding
    leaves too little of F for a bound: beyond a millionth of the lens, or of a radian.
    """
    displaced, tilted = np.zeros((2, len(paths.events)))
    for lens in scene.lenses:
        placement, expression = Placement.of(lens), lens.surface.expression
        local = placement.local(paths.origin)
        low, high = placement.box
        near = paths.events > 0
        for axis in range(3):
            near &= (local[:, axis] >= low[axis]) & (local[:, axis] <= high[axis])
        if not near.any():
            continue
        values = {**lens.values, **dict(zip("xyz", local[near].T, strict=True))}
        with np.errstate(all="ignore"):
            _, rounding = evaluate_with_error(expression, values)
            slopes, errors = zip(*(evaluate_with_error(each, values) for each in gradient(expression)), strict=True)
            normal = np.einsum("in,ij->nj", slopes, placement.to_local)
            error = np.einsum("in,ij->nj", errors, np.abs(placement.to_local))
            steepness = np.sqrt((normal * normal).sum(axis=1))
            moves, tilts = rounding / steepness, np.sqrt((error * error).sum(axis=1)) / steepness
        moves = np.where(moves <= _MOST_NOISE * placement.diagonal(), moves, np.inf)
        tilts = np.where(tilts <= _MOST_NOISE, tilts, np.inf)
        displaced[near] = np.maximum(displaced[near], moves)
        tilted[near] = np.maximum(tilted[near], tilts)
    return displaced, tilted


def last_leg(scene: Scene, paths: RayPaths) -> Array:
    """Return how far a place moves, by what a turn of one inside a lens grows to on the way out.

    It grows by the ratio of indices, and no move of the start or of a whole lens shows that where the way in took as
    much away: what grows beyond one is missing there. 0 where no lens is met.
    """
    numbers = picture_numbers(scene)
    falls = paths.direction @ numbers["normal"]
    with np.errstate(all="ignore"):
        distance = np.abs((numbers["corner"] - paths.origin) @ numbers["normal"] / falls)
        moves = [
            np.linalg.norm(dual - np.outer(paths.direction @ dual / falls, numbers["normal"]), axis=1)
            for dual in (numbers["dual_s"], numbers["dual_t"])
        ]
        size: Array = np.where(paths.events > 0, (growth(scene) - 1.0) * distance * np.maximum(*moves), 0.0)
    return size


def growth(scene: Scene) -> float:
    """Return by how much a turn inside a lens can grow on the way out."""
    return max((1.0, *(lens.n / scene.n_medium for lens in scene.lenses)))


def reach(scene: Scene) -> float:
    """Return the largest coordinate of the lenses: a hit is computed from numbers of that size."""
    return max((float(np.abs(Placement.of(lens).corners()).max()) for lens in scene.lenses), default=0.0)


def landing(scene: Scene, st: Array) -> Array:
    """Return the size of what picture coordinates are summed up from: more than they are where spans are sheared."""
    numbers, picture = picture_numbers(scene), scene.picture
    dual = max(float(np.linalg.norm(numbers[name])) for name in ("dual_s", "dual_t"))
    right, down = float(np.linalg.norm(picture.right)), float(np.linalg.norm(picture.down))
    size: Array = dual * (right * (1.0 + np.abs(st[:, 0])) + down * (1.0 + np.abs(st[:, 1])))
    return size
