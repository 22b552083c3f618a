"""How far the places of a map may be from exact physics: a bound on the error of (s, t), ray by ray.

A ray is traced in double precision. Two things are then asked of it.

1. How far may rounding take its place? `carried` counts every rounding on the way, at each surface that is met and on
   each leg between, in the size of the numbers that were rounded. Each is taken to the picture by the derivative of the
   path in closed form, and all are added by their worst signs. Where first order does not hold, there is no bound.
   Where solids overlap or touch, the media are found anew from F at each surface; if they do not explain how the ray
   was bent, there is no bound. Surfaces that a ray crosses within one medium round as well, and are counted.
2. May rounding take another path? The ray is traced five times more, with its start, the lenses and the indices moved
   by some times what is rounded. The moves are the corners of a simplex, so that one of them crosses what decides the
   path, if that is near. Where a lens takes back moves of the start, as at a focus, larger ones follow, up to what the
   bound allows. Where a moved ray takes another path, there is no bound.

What the moves show of the place is also a bound from below on the bound: it is of second order, too, and sees edges. A
map of any precision and method is held against the double trace: its bound is how far the two are apart, and the double
trace's own bound.

The second part is no proof. bench/validate_error_map.py holds the bounds against certified answers.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.accuracy.carried import Carried, carried
from lenscl.accuracy.meeting import U
from lenscl.accuracy.rounding import MOVES, moves, reach
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.errors import TraceError
from lenscl.status import RayStatus
from lenscl.tracing import Judge, Nudge, RayMap, RayPaths, checked_rays, film_rays

Array = NDArray[np.float64]

NO_BOUND = -1.0
_EPS = float(np.finfo(np.float64).eps)
_ULPS = 4.0  # of each number of the start, of normals and of indices
_FILM = 4.0  # u: of the sums that make a place on the film, and a start of parallel light
_UNIT = 6.0  # u: of a direction made unit, and of parallel light once more
_FARTHER = 4.0  # times what is rounded: how far moves go, as a quarter of each may be all that tells
_NUDGE = _FARTHER * _ULPS * _EPS
# What else rounds on the way, and what no move of the start shows where a surface takes it back: normals and indices
_NUDGES = tuple(
    Nudge(turn=(_NUDGE * b, _NUDGE * c, _NUDGE * d), eta_in=_NUDGE * a, eta_out=_NUDGE * b) for a, b, c, d in MOVES
)
_TAKEN_BACK = 8.0  # times what moves of the start show: bounds are mostly twice that
_LARGEST_MOVE = 1e-3  # radians, and of the lenses' largest coordinate
_LENGTH = 2.0 * _FARTHER
_PART = 2**17  # rays made at once: some 100 MB
_LANDED = tuple(int(status) for status in RayStatus if status.lands)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Places:
    """Where rays land by a double trace, and how far that may be from exact physics.

    Attributes
    ----------
    st : float64 array, shape (N, 2)
        Picture coordinates; (-1, -1) where the ray has no place.
    status, events : uint8 array, shape (N,)
        How it ended, and surfaces met.
    bound : float64 array, shape (N,)
        On max(|ds|, |dt|); -1 where none can be given: the ray has no place, rounding may decide its
        path, or it leaves too little of F.
    """

    st: Array = field(repr=False)
    status: NDArray[np.uint8] = field(repr=False)
    events: NDArray[np.uint8] = field(repr=False)
    bound: Array = field(repr=False)


def place_bounds(
    scene: Scene, origins: ArrayLike, directions: ArrayLike, *, device: Device | str | None = None
) -> Places:
    """Trace rays in double precision, with a bound on the error of where they land.

    Parameters
    ----------
    scene : Scene
        Its numbers are taken as exact, and Snell's law too. Source and film play no part, nor do the numerics but for
        `max_events`. Indices are those of the d line.
    origins, directions : array_like, shape (N, 3)
        World, scene units, taken as exact; directions of any length but 0.
    device : Device or str, optional
        As for `trace`.

    Returns
    -------
    Places
        The bounds are validated, not proved: see this module.

    Raises
    ------
    TraceError, StudyError, NoDeviceError, BuildError
        As `trace_rays`.
    """
    points, units = checked_rays(origins, directions)
    return _joined([_places(scene, points[part], units[part], device) for part in _parts(len(points))])


def pixel_bounds(scene: Scene, pixels: ArrayLike, *, device: Device | str | None = None) -> Places:
    """Trace the rays of film pixels, numbered row by row, as `place_bounds` does; errors as there."""
    numbers = np.asarray(pixels, dtype=np.intp)
    return _joined([_pixel_places(scene, numbers[part], device) for part in _parts(len(numbers))])


def error_at(raymap: RayMap, pixels: ArrayLike) -> Array:
    """Return the error bounds of a map of one wavelength, as `error_map` has them, at pixels numbered row by row."""
    _check_device(raymap)
    numbers = np.asarray(pixels, dtype=np.intp)
    return np.concatenate([_bounds_of(raymap, numbers[part]) for part in _parts(len(numbers))])


def error_map(raymap: RayMap) -> Array:
    """Return a bound on the error of every place of a map, against exact physics of the scene as it is written.

    The rays are traced again in double precision, seven times or more; this module's text says what the bound is based
    on.

    Parameters
    ----------
    raymap : RayMap
        Of any method, precision and form of Snell's law.

    Returns
    -------
    float64 array, shape (rows, columns)
        On max(|ds|, |dt|), in picture coordinates; -1 where the map has no place, or no bound can be given. Of several
        wavelengths each is traced again: shape (K, rows, columns).

    Raises
    ------
    TraceError
        If the map's device has no double precision.
    """
    _check_device(raymap)
    if "wavelengths" in raymap.added:
        return np.stack([error_map(layer) for layer in raymap.layers()])
    bounds = np.empty(raymap.status.shape)
    flat = bounds.reshape(-1)
    for part in _parts(flat.size):
        flat[part] = _bounds_of(raymap, np.arange(part.start, min(part.stop, flat.size)))
    return bounds


def _check_device(raymap: RayMap) -> None:
    if not raymap.device.has_double:
        raise TraceError(
            f"{raymap.device.label} has no double precision, and error bounds are made in it; "
            "choose another of `lenscl devices` by LENSCL_DEVICE"
        )


def _bounds_of(raymap: RayMap, pixels: NDArray[np.intp]) -> Array:
    places = _pixel_places(raymap.scene, pixels, raymap.device)
    apart = np.abs(raymap.st.reshape(-1, 2)[pixels] - places.st).max(axis=1)
    has_bound = np.isin(raymap.status.ravel()[pixels], _LANDED) & (places.bound >= 0)
    bounds: Array = np.where(has_bound, apart + places.bound, NO_BOUND)
    return bounds


def _pixel_places(scene: Scene, pixels: NDArray[np.intp], device: Device | str | None) -> Places:
    """Trace the rays of one part of the pixels. They are made here, so that rounds as well."""
    origins, directions = film_rays(scene, pixels)
    goes: NDArray[np.bool_] = np.asarray(directions.any(axis=1))  # a pixel on the source has no direction
    points, units = checked_rays(origins, np.where(goes[:, None], directions, (0.0, 0.0, 1.0)))
    corner, *spans = np.abs([scene.film.corner, scene.film.right, scene.film.down])
    target = _FILM * U * (corner + np.sum(spans, axis=0))
    if scene.source.at is None:
        # A start is its target, taken back along the direction: what that is off turns the ray about the target
        back = np.linalg.norm(points - scene.film.corner, axis=1)[:, None] + np.abs(spans).sum()
        place = target + _FILM * U * (np.abs(points) + back)
        places = _places(scene, points, units, device, place=place)
    else:
        distance = np.where(goes, np.linalg.norm(directions, axis=1), 1.0)[:, None]
        places = _places(scene, points, units, device, turn=target / distance)
    places.st[~goes], places.bound[~goes] = -1.0, NO_BOUND
    places.status[~goes], places.events[~goes] = RayStatus.UNDECIDED, 0
    return places


def _places(
    scene: Scene,
    points: Array,
    units: Array,
    device: Device | str | None,
    *,
    place: Array | float = 0.0,
    turn: Array | float = 0.0,
) -> Places:
    """Trace one part of the rays; `place` and `turn` are how far each number of start and direction is off already."""
    judge = Judge(scene, device)
    found = judge.paths(points, units)
    off = np.broadcast_to(place, points.shape)
    turned = np.broadcast_to(turn, points.shape) + _UNIT * U
    bound = np.full(len(points), NO_BOUND)
    lands = np.flatnonzero(np.isin(found.status, _LANDED))
    if lands.size:
        rounded = carried(judge, scene, points, units, found, lands, off, turned)
        some = lands[np.isfinite(rounded.bound[lands])]
        seen = _seen(judge, scene, points, units, found, some, rounded, off, turned)
        bound[some] = np.where(seen >= 0.0, np.maximum(rounded.bound[some], seen), NO_BOUND)
    return Places(st=found.st, status=found.status, events=found.events, bound=bound)


def _seen(
    judge: Judge,
    scene: Scene,
    points: Array,
    units: Array,
    found: RayPaths,
    rays: NDArray[np.intp],
    rounded: Carried,
    place: Array,
    turn: Array,
) -> Array:
    """Return how far some rays' places are moved by moves of rounding's size; -1 where another path comes of one."""
    points, units, st, events = points[rays], units[rays], found.st[rays], found.events[rays]
    across = _ULPS * _EPS * np.maximum(_largest_of(points), reach(scene)) + _largest_of(place[rays])
    turned = _ULPS * _EPS + _largest_of(turn[rays])
    across = _FARTHER * np.maximum(across, rounded.moved[rays])
    turned = _FARTHER * np.maximum(turned, rounded.tilted[rays])
    seen = np.zeros(st.shape)
    is_same = np.ones(len(rays), bool)
    for nudge, (move, bend) in zip(_NUDGES, moves(units), strict=True):
        moved = judge.paths(points + across[:, None] * move, units + turned[:, None] * bend, nudge)
        is_same &= np.isin(moved.status, _LANDED) & (moved.events == events)
        seen += np.square(np.where(is_same[:, None], moved.st - st, 0.0))
    seen = np.sqrt(seen.max(axis=1)) / _LENGTH

    # Where a lens takes back what moves the start, larger moves show as much as may become of what is rounded behind it
    few = np.flatnonzero(is_same & (rounded.bound[rays] > _TAKEN_BACK * seen))
    if few.size:
        with np.errstate(divide="ignore"):
            more = rounded.bound[rays[few]] / seen[few]
        more = np.minimum(more, _LARGEST_MOVE / np.maximum(turned[few], across[few] / max(reach(scene), _EPS)))
        points, units, events = points[few], units[few], events[few]
        across, turned = more * across[few], more * turned[few]
        for move, bend in moves(units):
            moved = judge.paths(points + across[:, None] * move, units + turned[:, None] * bend)
            is_same[few] &= np.isin(moved.status, _LANDED) & (moved.events == events)
    return np.where(is_same, seen, NO_BOUND)


def _largest_of(vectors: Array) -> Array:
    """Return the largest size of three numbers, shape (N,): column by column, which takes an eighth of the time."""
    largest: Array = np.maximum.reduce(list(np.abs(vectors).T))
    return largest


def _parts(count: int) -> Iterator[slice]:
    for first in range(0, max(count, 1), _PART):
        yield slice(first, first + _PART)


def _joined(parts: list[Places]) -> Places:
    return Places(
        **{each.name: np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(Places)}
    )
