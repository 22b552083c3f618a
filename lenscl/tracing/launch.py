"""Launch the trace of a scene, tile by tile.

Tiles bound the memory a film takes on the device; one launch traces one tile.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl import codegen, device, effects, methods
from lenscl.codegen import KernelSource, Structure
from lenscl.config import Scene
from lenscl.device import Buffer, Device
from lenscl.errors import StudyError, TraceError
from lenscl.methods import LAST_RESORT, Method
from lenscl.status import RayStatus
from lenscl.tracing.film import film_rays
from lenscl.tracing.numbers import scene_numbers
from lenscl.tracing.placement import Placement
from lenscl.tracing.raymap import RayMap, RayPaths
from lenscl.tracing.start import locate

_TILE_PIXELS = 2**20  # about 19 MB of buffers in double; the most that kernels/film.cl allows
_ALMOST_ALONE = 4  # of a packet's lanes, one in so many may be put aside, as in kernels/parks.cl
_MARCH_STEPS = 10**6  # steps through a lens's box beyond which `march` would never come home
_REALS: dict[str, type[np.floating[Any]]] = {"single": np.float32, "double": np.float64}
_MAP = (("st", 2), ("status", 0), ("events", 0))  # name, reals a ray; 0: one byte
_ARRAYS = {"map": _MAP, "legs": (*_MAP, ("origin", 3), ("direction", 3))}  # as the kernels' ends_*.cl take them


def trace(
    scene: Scene, *, method: str | None = None, precision: str | None = None, device: Device | str | None = None
) -> RayMap:
    """Trace the ray of every film pixel.

    Parameters
    ----------
    scene : Scene
        What to trace.
    method, precision : str, optional
        In place of the scene's own.
    device : Device or str, optional
        Where to trace: a device or part of its label. Default: the best one here.

    Returns
    -------
    RayMap
        Arrays of shape (rows, columns, ...).

    Raises
    ------
    StudyError, NoDeviceError, BuildError, TraceError
        If the scene cannot be traced as asked; the message says what to change.
    """

    def traced(ends: Literal["map", "legs"]) -> tuple[_Job, dict[str, Any]]:
        job = _Job.prepare(scene, scene.source.kind, ends, method, precision, device)
        film = job.scene.film
        arrays = job.empty_ends(film.rows * film.columns)
        for row, column, columns, first, count in _tiles(film.rows, film.columns):
            job.run(arrays, (row, column, columns, count), first, ())
        job.decide(arrays, lambda undecided: film_rays(job.scene, undecided))
        return job, _shaped(arrays, film.rows, film.columns)

    def legs() -> tuple[NDArray[Any], NDArray[Any]]:
        _, arrays = traced("legs")
        return arrays["origin"], arrays["direction"]

    job, arrays = traced("map")
    return RayMap(**arrays, legs=legs, **job.record())


def trace_rays(
    scene: Scene,
    origins: ArrayLike,
    directions: ArrayLike,
    *,
    method: str | None = None,
    precision: str | None = None,
    device: Device | str | None = None,
) -> RayPaths:
    """Trace rays of the caller's own through a scene; its source and film play no part.

    Parameters
    ----------
    scene : Scene
        What to trace through.
    origins, directions : array_like, shape (N, 3)
        World, scene units. Directions need not be unit; origins may lie inside a lens.
    method, precision, device
        As for `trace`.

    Returns
    -------
    RayPaths
        Arrays of shape (N, ...).

    Raises
    ------
    TraceError
        If the arrays are not (N, 3) and finite, or a direction is zero; the message names the first such ray.
    StudyError, NoDeviceError, BuildError
        As for `trace`.
    """
    points, units = _checked_rays(origins, directions)
    return _traced_rays(_Job.prepare(scene, "given", "legs", method, precision, device), points, units)


def _traced_rays(job: _Job, points: NDArray[np.float64], units: NDArray[np.float64]) -> RayPaths:
    inside, on = locate(job.scene, points)
    ends = job.empty_ends(len(points))
    for first in range(0, len(points), _TILE_PIXELS):
        part = slice(first, first + _TILE_PIXELS)
        count = len(points[part])
        arrays = [points[part].astype(job.dtype), units[part].astype(job.dtype), inside[part], on[part]]
        job.run(ends, (0, first, count, count), first, [job.device.upload(job.padded(array)) for array in arrays])
    job.decide(ends, lambda undecided: (points[undecided], units[undecided]))
    return RayPaths(**_shaped(ends, len(points)), **job.record())


def kernel_source(scene: Scene, *, rays: str | None = None, device: Device | str | None = None) -> KernelSource:
    """Return the kernel that traces a scene on a device; `rays="given"` for the one of `trace_rays`."""
    ends = "legs" if rays == "given" else "map"
    return codegen.kernel_source(_structure(scene, rays or scene.source.kind, ends, _chosen(device)))


def methods_of(scene: Scene) -> tuple[Method, ...]:
    """Return the method that searches each lens.

    Raises
    ------
    StudyError
        If the one asked for does not serve a lens.
    """
    wanted, chosen, problems = scene.numerics.method, [], []
    for number, lens in enumerate(scene.lenses):
        is_polynomial = lens.surface.sign_polynomial(lens.values) is not None
        method = methods.choose(wanted, is_polynomial=is_polynomial)
        if method is None:
            which = f'lens "{lens.name}"' if lens.name else f"lens[{number}]"
            problems.append(
                f'numerics.method: "{wanted}" searches polynomials, and {which} ({lens.surface.name}) is none '
                'with these parameters; use "auto"'
            )
        else:
            chosen.append(method)
    if problems:
        raise StudyError(problems)
    return tuple(chosen)


class _Job:
    """A scene made ready for launches: its program, its numbers on the device, and the time spent."""

    def __init__(self, scene: Scene, source: KernelSource, chosen: Device) -> None:
        self.scene, self.source, self.device = scene, source, chosen
        self.dtype = _REALS[source.structure.carried]
        self._seconds, self._escalated = 0.0, 0
        self._program = chosen.build(source.text)
        self._numbers = chosen.upload(source.layout.pack(scene_numbers(scene, source), self.dtype))
        self._arrays = _ARRAYS[source.structure.ends]
        self._buffers: dict[str, Buffer] = {}

    @classmethod
    def prepare(
        cls, scene: Scene, rays: str, ends: str, method: str | None, precision: str | None, wanted: Device | str | None
    ) -> _Job:
        asked = {"numerics.method": method, "numerics.precision": precision}
        scene = scene.replace({key: value for key, value in asked.items() if value is not None})
        chosen = _chosen(wanted)
        structure = _structure(scene, rays, ends, chosen)
        _check_steps(scene, structure)
        return cls(scene, codegen.kernel_source(structure), chosen)

    def empty_ends(self, rays: int) -> dict[str, NDArray[Any]]:
        """Return arrays for the ends of so many rays, one row a ray."""
        try:
            return {
                name: np.empty((rays, n), self.dtype) if n else np.empty(rays, np.uint8) for name, n in self._arrays
            }
        except MemoryError as error:
            raise TraceError(
                f"film.size: there is no memory for the map of {rays:,} pixels; use a smaller film"
            ) from error

    def padded(self, array: NDArray[Any]) -> NDArray[Any]:
        """Return rows repeated at the end up to whole packets."""
        missing = -len(array) % self.source.structure.width
        return np.concatenate([array, np.repeat(array[-1:], missing, axis=0)])

    def run(
        self, ends: dict[str, NDArray[Any]], tile: tuple[int, int, int, int], first: int, rays: Sequence[Buffer]
    ) -> None:
        """Trace a tile into the rows of `ends` from `first` on."""
        count, width = tile[3], self.source.structure.width
        packets = -(-count // width)
        for name, numbers in self._arrays:
            nbytes = packets * width * (numbers * np.dtype(self.dtype).itemsize or 1)
            if name not in self._buffers or self._buffers[name].nbytes < nbytes:
                self._buffers[name] = self.device.empty(nbytes)
        parking = _Parking(self.device, self.source.structure, packets) if self.source.structure.parks else None
        self._launch(tile, packets, rays, parking.arguments(False) if parking else ())
        for name, _ in self._arrays:
            self.device.download(self._buffers[name], ends[name][first : first + count])
        if parking is None or not (places := parking.places()).size:
            return

        # Carry on those that were put aside; their ends come in the order in which they were
        again = len(places)
        self._launch((0, 0, again, again), -(-again // width), rays, parking.arguments(True))
        for name, array in ends.items():
            part = np.empty((again, *array.shape[1:]), array.dtype)
            self.device.download(self._buffers[name], part)
            array[first + places] = part

    def _launch(
        self, tile: tuple[int, int, int, int], packets: int, rays: Sequence[Buffer], parking: Sequence[Any]
    ) -> None:
        outputs = [self._buffers[name] for name, _ in self._arrays]
        most = np.int32(self.scene.numerics.max_events)
        arguments = [self._numbers, np.array(tile, np.int32), most, *outputs, *rays, *parking]
        self._seconds += self._program.run("trace", -(-packets // self.source.structure.run), arguments)

    def decide(self, ends: dict[str, NDArray[Any]], rays_of: Callable[[NDArray[np.intp]], tuple[Any, Any]]) -> None:
        """Trace again, in the next precision that device and lenses allow, the rays that were left undecided."""
        undecided = np.flatnonzero(ends["status"] == RayStatus.UNDECIDED)
        if not undecided.size or (next_job := self._more_precise()) is None:
            return
        points, vectors = rays_of(undecided)
        goes = vectors.any(axis=1)  # a film pixel on the source has no direction
        undecided = undecided[goes]
        again = _traced_rays(next_job, points[goes], _units(vectors[goes]))
        for name, array in ends.items():
            array[undecided] = getattr(again, name)
        self._escalated = len(undecided)
        self._seconds += again.trace_seconds

    def _more_precise(self) -> _Job | None:
        """Return the job of the next precision: double after single and mixed, then twice that where lenses have it."""
        scene = self.scene.replace({"numerics.precision": "double"})
        source = self.source.structure
        structure = _structure(scene, "given", "legs", self.device) if self.device.has_double else None
        if source.precision == "double":
            methods_now = tuple(
                LAST_RESORT if row.is_guaranteed and codegen.has_twice(surface) else row
                for row, surface in zip(source.methods, source.lenses, strict=True)
            )
            if methods_now == source.methods:
                return None
            assert structure is not None
            structure = replace(structure, methods=methods_now)
        return None if structure is None else _Job(scene, codegen.kernel_source(structure), self.device)

    def record(self) -> dict[str, Any]:
        """Return what a result says of how it was made."""
        return {
            "trace_seconds": self._seconds,
            "escalated": self._escalated,
            "kernel": self.source,
            "scene": self.scene,
            "device": self.device,
        }


class _Parking:
    """Where a launch puts aside the last few rays of its packets, as kernels/parks.cl does."""

    def __init__(self, chosen: Device, structure: Structure, packets: int) -> None:
        words, width = structure.ray_words, structure.width
        room = packets * (width // _ALMOST_ALONE) + width  # a packet's worth beyond is read, not used
        self._device = chosen
        self._count = chosen.upload(np.zeros(1, np.int32))
        self._places = chosen.empty(4 * room)
        self._words = chosen.empty(np.dtype(_REALS[structure.carried]).itemsize * words * room)

    def arguments(self, carries_on: bool) -> tuple[Any, ...]:
        """Return what the kernel takes; the second launch carries on what the first put aside."""
        return np.int32(carries_on), self._count, self._places, self._words

    def places(self) -> NDArray[np.int32]:
        """Return the rays that were put aside, by their numbers in the launch."""
        count = np.empty(1, np.int32)
        self._device.download(self._count, count)
        places = np.empty(int(count[0]), np.int32)
        self._device.download(self._places, places)
        return places


def _shaped(arrays: dict[str, NDArray[Any]], *shape: int) -> dict[str, Any]:
    return {name: array.reshape(*shape, *array.shape[1:]) for name, array in arrays.items()}


def _chosen(wanted: Device | str | None) -> Device:
    return wanted if isinstance(wanted, Device) else device.choose(wanted)


def _structure(scene: Scene, rays: Any, ends: Any, chosen: Device) -> Structure:
    numerics = scene.numerics
    if numerics.precision != "single" and not chosen.has_double:
        raise TraceError(
            f"numerics.precision: {chosen.label} has no double precision; "
            'set precision = "single", or choose another of `lenscl devices` by LENSCL_DEVICE'
        )
    width = chosen.width("single" if numerics.precision == "single" else "double")
    return Structure(
        lenses=tuple(lens.surface for lens in scene.lenses),
        rays=rays,
        ends=ends,
        methods=methods_of(scene),
        snell=numerics.snell,
        effects=effects.wanted({key: getattr(scene.effects, key) for key in effects.EFFECTS}),
        precision=numerics.precision,
        width=width,
        run=chosen.run,
        parks=chosen.run > 1 and width >= _ALMOST_ALONE,
    )


def _check_steps(scene: Scene, structure: Structure) -> None:
    if "step" not in structure.reads():
        return
    diagonal = max(Placement.of(lens).diagonal() for lens in scene.lenses)
    if diagonal > _MARCH_STEPS * scene.numerics.step:
        raise StudyError(
            [
                f"numerics.step: {scene.numerics.step:g} would take more than {_MARCH_STEPS:,} steps through a lens "
                f"{diagonal:g} across; use at least {diagonal / _MARCH_STEPS:.3g}"
            ]
        )


def _tiles(rows: int, columns: int) -> Iterator[tuple[int, int, int, int, int]]:
    """Yield (first row, first column, columns, first pixel, pixels): whole rows, or parts of one that is too long."""
    if columns > _TILE_PIXELS:
        for row in range(rows):
            for column in range(0, columns, _TILE_PIXELS):
                part = min(_TILE_PIXELS, columns - column)
                yield row, column, part, row * columns + column, part
        return
    together = _TILE_PIXELS // columns
    for row in range(0, rows, together):
        yield row, 0, columns, row * columns, columns * min(together, rows - row)


def _checked_rays(origins: ArrayLike, directions: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    try:
        points, vectors = np.asarray(origins, dtype=np.float64), np.asarray(directions, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise TraceError(f"origins, directions: expected arrays of numbers, shape (N, 3): {error}") from error
    for name, array in (("origins", points), ("directions", vectors)):
        if array.ndim != 2 or array.shape[1] != 3:
            raise TraceError(f"{name}: expected an array of shape (N, 3), got {array.shape}")
        if not np.isfinite(array).all():
            ray = int(np.flatnonzero(~np.isfinite(array).all(axis=1))[0])
            raise TraceError(f"{name}[{ray}]: expected finite numbers, got {array[ray]}")
    if len(points) != len(vectors):
        raise TraceError(f"expected as many directions as origins, got {len(vectors)} and {len(points)}")
    if not (some := vectors.any(axis=1)).all():
        raise TraceError(f"directions[{int(np.flatnonzero(~some)[0])}]: a direction must not be zero")
    return points, _units(vectors)


def _units(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    scaled = vectors / np.abs(vectors).max(axis=1, keepdims=True)  # whose squares stay within the range of numbers
    unit: NDArray[np.float64] = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
    return unit
