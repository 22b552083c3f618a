"""How far the places of a map may be from exact physics: a bound on the error of (s, t), ray by ray.

A ray is traced in double precision, as it is and four times with a start beside it. Rounding on the way acts like a
small move of the start, of its origin across the ray and of its direction: four numbers. The four moves change each of
them by a few ulps and are orthogonal, so that the root of the sum of squares of what they do to the place is the length
of its gradient, whichever direction is amplified most. The bound is what that length makes of the ulps. A surface can
take back a move of the start, and what rounds there is then not seen:

- A face met at a grazing angle hardly passes on a turn of the ray. So each of the four also goes through lenses that
  are turned, and whose ratios of indices are changed, by as many ulps.
- An index of n divides a turn on the way in, and multiplies what rounds inside on the way out: `last_leg` adds that,
  and a ray that meets more than two surfaces is turned by n times as much from the start.
- Where F is a difference of large numbers, its surface is displaced by more than ulps: `surface_noise` makes the moves
  larger, by a bound on the rounding of F where the ray met its last surface.

Where a moved ray takes another path, rounding may decide the path, and there is no bound. A map of any precision and
method is held against that double trace: its bound is how far the two are apart, and the double trace's own bound.

The numbers of ulps are chosen by measurement; nothing here is proved. bench/validate_error_map.py holds the bounds
against certified answers: in each precision, all of 146,000 pixels of 65 scenes were within their bounds. In double the
worst error was a third of its bound, and half of them were less than a hundredth. Without the turned lenses, the growth
by the index or the noise of F, bounds fail on the scenes there that are made for it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.accuracy.rounding import growth, landing, last_leg, reach, surface_noise
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.errors import TraceError
from lenscl.status import RayStatus
from lenscl.tracing import Nudge, RayMap, checked_rays, film_rays, trace_to_judge

Array = NDArray[np.float64]

NO_BOUND = -1.0
_EPS = float(np.finfo(np.float64).eps)
_ULPS = 4.0  # of every number of the start; the worst error that was seen is what 1.4 would make
_INSIDE = 8.0  # ulps that a direction inside a lens may be off; most are one or two, growing with its slant
_ONE_PASS = 2  # events; a ray that meets more carries on what has grown already
_LANDING = 1.0  # ulps of what the picture coordinates are summed up from
# Whether a move adds to the offsets and turns or takes away: orthogonal, and each has all four at once
_SIGNS = ((1, 1, 1, 1), (1, -1, 1, -1), (1, 1, -1, -1), (1, -1, -1, 1))
# What else rounds on the way, and what no move of the start shows where a surface takes it back: normals and indices
_NUDGES = tuple(
    Nudge(
        turn=(_ULPS * _EPS * b, _ULPS * _EPS * c, _ULPS * _EPS * d), eta_in=_ULPS * _EPS * a, eta_out=_ULPS * _EPS * b
    )
    for a, b, c, d in _SIGNS
)
_LENGTH = float(np.sqrt(len(_SIGNS)))  # of such a move, in units of each number's own
_PART = 2**17  # rays made at once: about 90 MB
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

    The rays are traced again in double precision, five times; this module's text says what the bound is based on.

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
    size = _largest(scene.film.corner, scene.film.right, scene.film.down)
    if scene.source.at is None:
        places = _places(scene, points, units, device, offset=size)
    else:
        distance = np.where(goes, np.linalg.norm(directions, axis=1), 1.0)
        places = _places(scene, points, units, device, turn=max(size, _largest(scene.source.at)) / distance)
    places.st[~goes], places.bound[~goes] = -1.0, NO_BOUND
    places.status[~goes], places.events[~goes] = RayStatus.UNDECIDED, 0
    return places


def _places(
    scene: Scene,
    points: Array,
    units: Array,
    device: Device | str | None,
    *,
    offset: float = 0.0,
    turn: Array | float = 0.0,
) -> Places:
    """Trace one part of the rays; `offset` and `turn` are sizes of what they were computed from, if they were."""
    found = trace_to_judge(scene, points, units, device)
    across = _ULPS * _EPS * np.maximum(np.abs(points).max(axis=1), max(reach(scene), offset))
    turned = _ULPS * _EPS * (1.0 + np.broadcast_to(turn, across.shape))
    displaced, tilted = surface_noise(scene, found)
    is_told = np.isfinite(displaced) & np.isfinite(tilted)
    displaced, tilted = np.where(is_told, (displaced, tilted), 0.0)
    across, turned = np.maximum(across, displaced), np.maximum(turned, tilted)
    turned *= np.where(found.events > _ONE_PASS, growth(scene), 1.0)
    squares, is_same = np.zeros(found.st.shape), np.isin(found.status, _LANDED) & is_told
    for nudge, (move, bend) in zip(_NUDGES, _moves(units), strict=True):
        moved = trace_to_judge(scene, points + across[:, None] * move, units + turned[:, None] * bend, device, nudge)
        is_same &= np.isin(moved.status, _LANDED) & (moved.events == found.events)
        squares += np.square(np.where(is_same[:, None], moved.st - found.st, 0.0))
    bound = np.sqrt(squares.max(axis=1)) / _LENGTH
    bound += _LANDING * _EPS * landing(scene, found.st) + _INSIDE * _EPS * last_leg(scene, found)
    is_same &= np.isfinite(bound)
    return Places(st=found.st, status=found.status, events=found.events, bound=np.where(is_same, bound, NO_BOUND))


def _moves(units: Array) -> Iterator[tuple[Array, Array]]:
    """Yield moves of origins and of unit directions, across them, by one unit of each of the four numbers of a ray."""
    u, v = _across(units)
    (a, b), (c, d) = ((x * u + y * v, x * v - y * u) for x, y in _angles(units))
    for first, second, third, fourth in _SIGNS:
        yield first * a + second * b, third * c + fourth * d


def _across(units: Array) -> tuple[Array, Array]:
    """Return two unit vectors across each direction and each other (Duff et al., JCGT 6(1), 2017)."""
    x, y, z = units.T
    sign = np.where(z < 0.0, -1.0, 1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    u = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=1)
    v = np.stack([b, sign + y * y * a, -y], axis=1)
    return u, v


def _angles(units: Array) -> Iterator[tuple[Array, Array]]:
    """Yield cosine and sine of two angles a ray, which follow no symmetry of a scene and are the same every time."""
    odd = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)
    mixed = (np.ascontiguousarray(units).view(np.uint64) * odd).sum(axis=1, dtype=np.uint64)
    for factor in odd[:2]:
        angle = 2.0 * np.pi * ((mixed * factor) >> np.uint64(11)) / 2.0**53
        yield np.cos(angle)[:, None], np.sin(angle)[:, None]


def _largest(*vectors: tuple[float, float, float]) -> float:
    return float(np.abs(np.array(vectors)).max())


def _parts(count: int) -> Iterator[slice]:
    for first in range(0, max(count, 1), _PART):
        yield slice(first, first + _PART)


def _joined(parts: list[Places]) -> Places:
    return Places(
        **{each.name: np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(Places)}
    )
