"""How a path carries on small changes of its start: by rays beside it, traced by the kernels themselves.

The start of a ray is four numbers: two across it, in units of the lens's size, and the two parts of n times its
direction across it. A path maps them linearly, to first order, onto the same four of its end. That map is symplectic,
which is what conservation of etendue and Malus's theorem say of it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from physics.paths import Paths

from lenscl.tracing import Placement

Array = NDArray[np.float64]

STEP = {"double": 2.0**-12, "mixed": 2.0**-12, "single": 2.0**-6}  # eps^(1/3) about: rounding and curvature are alike
_STRAIGHT = 0.1  # where a map changes by more from one step to twice that, it is none of first order
_SYMPLECTIC = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.eye(2), np.zeros((2, 2))]])


def across(direction: Array) -> Array:
    """Return two unit vectors across each direction and each other, shape (N, 2, 3)."""
    axis = np.eye(3)[np.argmin(np.abs(direction), axis=1)]
    u = np.cross(direction, axis)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return np.stack([u, np.cross(direction, u)], axis=1)


@dataclass(frozen=True, eq=False)
class Differential:
    """Of N paths through E surfaces, the maps from their starts to behind each surface, shape (E + 1, N, 4, 4).

    `error`, shape (E + 1, N), is how far a map may be off, in the Frobenius norm; infinite where a ray beside takes
    another path, or where a surface's normal is not known.
    """

    maps: Array = field(repr=False)
    error: Array = field(repr=False)


def differential(paths: Paths) -> Differential:
    """Trace rays beside each path, once and twice a step away, and return how it carries changes on."""
    step, size = STEP[paths.scene.numerics.precision], _size(paths)
    near, same_near = _differences(paths, size, step)
    far, same_far = _differences(paths, size, 2.0 * step)
    curved = np.linalg.norm(far - near, axis=(2, 3))
    noise = _noise(paths, near, size)
    error = np.where(same_near & same_far, curved + 2.0 * noise / step, np.inf)
    return Differential(near, np.where(np.isfinite(error), error, np.inf))


def symplectic(paths: Paths) -> tuple[Array, Array]:
    """Etendue: each map keeps n^2 dA dOmega cos, the whole symplectic form and its determinant.

    Returns residuals and bounds for the maps up to every surface that is met, in the order of `met`.
    """
    found = differential(paths)
    event, ray = paths.met
    maps, error = found.maps[event + 1, ray], found.error[event + 1, ray]
    form = np.swapaxes(maps, 1, 2) @ _SYMPLECTIC @ maps - _SYMPLECTIC
    length = np.linalg.norm(maps, axis=(1, 2))
    residual = np.maximum(np.abs(form).max(axis=(1, 2)), np.abs(np.linalg.det(maps) - 1.0))
    with np.errstate(invalid="ignore"):
        bound = (2.0 * length + error) * error
    return residual, np.where(error < _STRAIGHT * length, bound, np.inf)


def _size(paths: Paths) -> float:
    """Return the largest width of any lens's box in the world."""
    return max(float(np.ptp(Placement.of(lens).corners(), axis=0).max()) for lens in paths.scene.lenses)


def _differences(paths: Paths, size: float, step: float) -> tuple[Array, NDArray[np.bool_]]:
    """Return the maps by central differences, and behind which surfaces all rays beside still take the same path."""
    origin, direction = paths.given[0], paths.directions[0]  # as given: rounded, a start may lie elsewhere
    frame = across(direction)
    shifts = [(sign * step * size * frame[:, i], 0.0) for i in (0, 1) for sign in (1, -1)]
    turns = [(0.0, sign * step * frame[:, i]) for i in (0, 1) for sign in (1, -1)]
    origins = np.concatenate([origin + shift for shift, _ in shifts + turns])
    directions = np.concatenate([direction + turn for _, turn in shifts + turns])
    beside = Paths.of(paths.scene, paths.device, origins, directions, max(len(paths.points) - 1, 1))
    n = len(origin)
    n_first, n_after = _index_behind(paths)
    ways, same = [], []
    inputs = None
    for k in range(len(paths.points)):
        index = n_first if k == 0 else n_after[k]
        if k < len(beside.points):
            points, along = (each[k].reshape(8, n, 3) for each in (beside.points, beside.directions))
        else:  # none beside comes so far, and what stands here counts as unlike
            points, along = (np.broadcast_to(each[k], (8, n, 3)) for each in (paths.points, paths.directions))
        coordinates = _coordinates(points, along, paths.points[k], paths.directions[k], index, size)
        change = (coordinates[0::2] - coordinates[1::2]) / 2.0  # (4, N, 4): of each of the four
        columns = np.moveaxis(change, 0, 2)
        if inputs is None:
            inputs = columns
        ways.append(columns @ np.linalg.inv(inputs))
        events = beside.events.reshape(8, n)
        alike = (events >= k).all(axis=0) & (paths.events >= k)
        if k:
            alike &= same[-1] & (_way(beside, k, n) == _way(paths, k, n)).all(axis=0)
        same.append(alike)
    return np.stack(ways), np.stack(same)


def _way(paths: Paths, k: int, n: int) -> NDArray[np.intp]:
    """Return which face each ray met k-th, from which side and to which, as one number; shape (-1, N)."""
    event, ray = paths.met
    here = event + 1 == k
    normal, _ = paths.normal
    sides = [np.einsum("ij,ij->i", paths.directions[event + i, ray], normal) > 0.0 for i in (0, 1)]
    found = np.zeros(len(paths.events), np.intp)
    found[ray[here]] = (4 * np.argmin(paths.hits.turn, axis=1) + 2 * sides[0] + sides[1])[here]
    return found.reshape(-1, n)


def _index_behind(paths: Paths) -> tuple[Array, Array]:
    """Return the index in which each ray starts, and that behind each surface, shape (E + 1, N)."""
    event, ray = paths.met
    before, after = paths.before_and_after
    behind = np.full(paths.points.shape[:2], paths.scene.n_medium)
    behind[event + 1, ray] = after
    first = np.full(len(paths.events), paths.scene.n_medium)
    first[ray[event == 0]] = before[event == 0]
    return first, behind


def _coordinates(points: Array, along: Array, at: Array, direction: Array, index: Array, size: float) -> Array:
    """Return the four numbers of rays beside a ray, shape (8, N, 4), in the plane through its point across it."""
    frame = across(direction)
    along = along / np.linalg.norm(along, axis=2, keepdims=True)
    with np.errstate(all="ignore"):
        distance = np.einsum("kni,ni->kn", at - points, direction) / np.einsum("kni,ni->kn", along, direction)
        place = np.einsum("kni,nji->knj", points - at + distance[:, :, None] * along, frame) / size
    turn = np.einsum("kni,nji->knj", along, frame) * index[:, None]
    found: Array = np.nan_to_num(np.concatenate([place, turn], axis=2), posinf=0.0, neginf=0.0)
    return found


def _noise(paths: Paths, maps: Array, size: float) -> Array:
    """Return what rounding at every surface before and at it does to the four numbers behind a surface, (E + 1, N).

    What a surface rounds, its place and the direction behind it, the rest of the path carries on: by its map, which is
    the whole one without that of the part before.
    """
    event, ray = paths.met
    made = np.zeros(paths.points.shape[:2])
    made[0] = paths.eps * (np.linalg.norm(paths.points[0], axis=1) / size + 1.0)
    made[event + 1, ray] = paths.hits.place / size + paths.slack * paths.hits.index
    total = np.zeros_like(made)
    with np.errstate(all="ignore"):
        lengths = np.linalg.norm(maps, axis=(2, 3))
        for k in range(len(made)):
            # A symplectic map's inverse is as long as itself
            carried = [made[i] * (lengths[k] * lengths[i] if i < k else 1.0) for i in range(k + 1)]
            total[k] = np.sum(carried, axis=0)
    return total


def wavefront(paths: Paths) -> tuple[Array, Array]:
    """Malus and Dupin: of rays from one point, the surfaces of equal optical path behind each surface are across them.

    Rays beside are turned by a step about the start. Residuals are how far the surface rises along the ray over that
    step, bounds what its curvature beyond the second order and rounding make of it; in the order of `met`.
    """
    step = STEP[paths.scene.numerics.precision]
    near, same_near, apart = _rises(paths, step)
    far, same_far, apart_far = _rises(paths, 2.0 * step)
    farther, same_farther, _ = _rises(paths, 4.0 * step)
    spread = np.linalg.norm(apart, axis=3).max(axis=0)
    straight = np.linalg.norm(apart_far - apart, axis=3).max(axis=0) <= _STRAIGHT * spread
    event, ray = paths.met
    made = np.zeros(paths.points.shape[:2])
    turned = np.zeros(paths.points.shape[:2])
    largest = np.maximum(paths.hits.index, paths.scene.n_medium)
    made[event + 1, ray] = 4.0 * largest * (paths.hits.place + paths.eps * paths.leg)
    turned[event + 1, ray] = paths.slack * largest
    made[0] = paths.eps * np.linalg.norm(paths.points[0], axis=1)
    noise = np.cumsum(made, axis=0) / step + np.cumsum(turned * spread, axis=0)
    bends = [np.abs(each).max(axis=0) for each in (far - near, farther - far)]
    # It rises by the step squared: so do the changes, fourfold from one to the next, where nothing else matters
    straight &= (2.0 * bends[0] <= bends[1] + noise) & (bends[1] <= 8.0 * bends[0] + noise)
    bound = bends[0] + 2.0 * noise
    told = same_near & same_far & same_farther & np.isfinite(bound) & straight
    residual = np.abs(near).max(axis=0)
    return residual[event + 1, ray], np.where(told, bound, np.inf)[event + 1, ray]


def _rises(paths: Paths, step: float) -> tuple[Array, NDArray[np.bool_], Array]:
    """Return how far the wavefront rises in both directions, (2, E + 1, N), whether the paths beside are alike, and how
    far apart they meet it, (2, E + 1, N, 3): all for a step of 1."""
    origin, direction = paths.given[0], paths.directions[0]  # as given: rounded, a start may lie elsewhere
    frame = across(direction)
    turns = [sign * step * frame[:, i] for i in (0, 1) for sign in (1, -1)]
    origins = np.concatenate([origin] * 4)
    directions = np.concatenate([direction + turn for turn in turns])
    beside = Paths.of(paths.scene, paths.device, origins, directions, max(len(paths.points) - 1, 1))
    n, depth = len(origin), len(paths.points)
    lengths, lengths_beside = _optical_lengths(paths), _optical_lengths(beside).reshape(-1, 4, n)
    _, n_after = _index_behind(paths)
    rises, same, apart = np.zeros((2, depth, n)), np.zeros((depth, n), bool), np.zeros((2, depth, n, 3))
    same[0] = True
    for k in range(1, min(depth, len(beside.points))):
        points, along = (each[k].reshape(4, n, 3) for each in (beside.points, beside.directions))
        shift = (lengths[k] - lengths_beside[k]) / n_after[k]
        front = points + shift[:, :, None] * along
        apart[:, k] = (front[0::2] - front[1::2]) / (2.0 * step)
        rises[:, k] = n_after[k] * np.einsum("kni,ni->kn", apart[:, k], paths.directions[k])
        events = beside.events.reshape(4, n)
        same[k] = same[k - 1] & (events >= k).all(axis=0) & (paths.events >= k)
        same[k] &= (_way(beside, k, n) == _way(paths, k, n)).all(axis=0)
    return rises, same, apart


def _optical_lengths(paths: Paths) -> Array:
    """Return the sum of n times length from the start up to each surface, shape (E + 1, N)."""
    event, ray = paths.met
    legs = np.zeros(paths.points.shape[:2])
    legs[event + 1, ray] = paths.before_and_after[0] * paths.leg
    found: Array = np.cumsum(legs, axis=0)
    return found
