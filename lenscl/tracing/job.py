"""A scene made ready for launches: what it is compiled to, its numbers on the device, and the launches themselves.

One launch traces one tile, which bounds the memory a film takes on the device.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl import codegen
from lenscl.codegen import KernelSource
from lenscl.config import Scene
from lenscl.config.scene import Frozen
from lenscl.device import Buffer, Device
from lenscl.errors import TraceError
from lenscl.methods import LAST_RESORT
from lenscl.status import RayStatus
from lenscl.tracing.memory import hold
from lenscl.tracing.numbers import index_numbers, scene_numbers
from lenscl.tracing.parking import Parking
from lenscl.tracing.raymap import RayPaths
from lenscl.tracing.start import locate, locate_sets
from lenscl.tracing.structure import check_steps, chosen_device, structure_of

_TILE_PIXELS = 2**20  # about 19 MB of buffers in double; the most that kernels/film.cl allows
_REALS: dict[str, type[np.floating[Any]]] = {"single": np.float32, "double": np.float64}
_MAP = (("st", 2), ("status", 0), ("events", 0))  # name, numbers a ray; 0: one byte
_ARRAYS = {"map": _MAP, "legs": (*_MAP, ("origin", 3), ("direction", 3))}  # as the kernels' ends_*.cl take them


class Job:
    """A scene made ready for launches: its program, its numbers on the device, and the time spent."""

    def __init__(self, scene: Scene, source: KernelSource, chosen: Device, kind: str = "trace") -> None:
        self.scene, self.source, self.device, self.kind = scene, source, chosen, kind
        self.max_events = scene.numerics.max_events
        self.dtype = _REALS[source.structure.carried]
        self._seconds, self._escalated = 0.0, 0
        self.searches, self.steps = 0, 0  # where the structure counts them
        self._program = chosen.build(source.text, kind=kind)
        # The scenes of one wavelength each, that are traced side by side; none where there are no layers
        self.layers = scene.layers() if source.structure.layered else ()
        self.wavelengths = scene.wavelengths if source.structure.layered else ()
        self._sets = max(1, len(self.layers))  # of the scene's numbers
        self._numbers = self._packed(lambda numbers: numbers)
        added = [(output.name, len(output.members)) for output in source.structure.adds]
        self._shapes = {output.name: output.pixel_shape for output in source.structure.adds}
        self._arrays = (*_ARRAYS[source.structure.ends], *added)
        self._buffers: dict[str, Buffer] = {}

    @classmethod
    def prepare(
        cls,
        scene: Scene,
        rays: str,
        ends: str,
        method: str | None,
        precision: str | None,
        wanted: Device | str | None,
        counts: bool = False,
        kind: str = "trace",
        without: str = "",
    ) -> Job:
        """Return the job of a scene, of rays and ends as `Structure` has them; method and precision replace its own.

        `kind` is what its programs count as in `compile_count`; `without` names an effect's variant that is left out.
        """
        asked = {"numerics.method": method, "numerics.precision": precision}
        scene = scene.replace({key: value for key, value in asked.items() if value is not None})
        chosen = chosen_device(wanted)
        structure = structure_of(scene, rays, ends, chosen)
        effects_in = tuple(effect for effect in structure.effects if without not in (effect.name, *effect.builds_on))
        structure = replace(structure, counts=counts, effects=effects_in)
        check_steps(scene, structure)
        return cls(scene, codegen.kernel_source(structure), chosen, kind)

    def change_numbers(self, change: Callable[[Mapping[str, ArrayLike]], Mapping[str, ArrayLike]]) -> None:
        """Put other numbers in the place of the scene's; rays left undecided are traced with the scene's own."""
        self._numbers = self._packed(change)

    def _packed(self, change: Callable[[Mapping[str, ArrayLike]], Mapping[str, ArrayLike]]) -> Buffer:
        """Return the scene's numbers on the device, one set a layer."""
        usual = scene_numbers(self.scene, self.source)
        sets: list[Mapping[str, ArrayLike]]
        sets = [{**usual, **index_numbers(layer, self.source)} for layer in self.layers] or [usual]
        return self.device.upload(
            np.concatenate([self.source.layout.pack(change(numbers), self.dtype) for numbers in sets])
        )

    def empty_ends(self, rays: int) -> dict[str, NDArray[Any]]:
        """Return arrays for the ends of so many rays, one row a ray, behind an axis of layers where there are any."""
        shape = (len(self.layers), rays) if self.layers else (rays,)
        try:
            return {
                name: np.empty((*shape, *self._shapes.get(name, (n,))), self.dtype) if n else np.empty(shape, np.uint8)
                for name, n in self._arrays
            }
        except MemoryError as error:
            key, what, advice = self._asked_for(rays)
            raise TraceError(f"{key}: there is no memory for {what}; {advice}") from error

    def _asked_for(self, rays: int) -> tuple[str, str, str]:
        """Return by which key so many rays are asked for, what they are, and what to do where they are too many."""
        if self.layers:
            what = f"the rays of {rays:,} pixels at {len(self.layers)} wavelengths"
            return "effects.dispersion", what, "ask for fewer wavelengths, or use a smaller film"
        return "film.size", f"the rays of {rays:,} pixels", "use a smaller film"

    def _nbytes(self, numbers: int) -> int:
        """Return what an array takes for a ray, of each layer."""
        return self._sets * (numbers * np.dtype(self.dtype).itemsize or 1)

    @property
    def tile_pixels(self) -> int:
        """How many rays a launch takes, so that those of all layers fit into one tile's memory."""
        return _tile_pixels(self._sets)

    def padded(self, array: NDArray[Any]) -> NDArray[Any]:
        """Return rows repeated at the end up to whole packets."""
        missing = -len(array) % self.source.structure.width
        return np.concatenate([array, np.repeat(array[-1:], missing, axis=0)])

    def run_film(self) -> dict[str, NDArray[Any]]:
        """Trace the ray of every film pixel; return the ends, row by row.

        Raises
        ------
        TraceError
            If there is no memory for them.
        """
        film = self.scene.film
        pixels = film.rows * film.columns
        hold(pixels * sum(self._nbytes(numbers) for _, numbers in self._arrays), *self._asked_for(pixels))
        ends = self.empty_ends(pixels)
        for row, column, columns, first, count in tiles(film.rows, film.columns, self._sets):
            self.run(ends, (row, column, columns, count), first, ())
        return ends

    def run(
        self, ends: dict[str, NDArray[Any]], tile: tuple[int, int, int, int], first: int, rays: Sequence[Buffer]
    ) -> None:
        """Trace a tile into the rows of `ends` from `first` on."""
        count, width = tile[3], self.source.structure.width
        packets, part = -(-count // width), slice(first, first + count)
        for name, numbers in self._arrays:
            nbytes = packets * width * self._nbytes(numbers)
            if name not in self._buffers or self._buffers[name].nbytes < nbytes:
                self._buffers[name] = self.device.empty(nbytes)
        inputs = [*rays, *([np.int32(self._sets)] if self.layers else ())]
        parks = self.source.structure.parks
        parking = Parking(self.device, self.source.structure, packets, self._sets) if parks else None
        self._launch(tile, packets, [*inputs, *(parking.arguments(False) if parking else ())])
        if self.layers:
            self._take(ends, [part] * self._sets, packets * width)
        else:
            for name, array in ends.items():
                self.device.download(self._buffers[name], array[part])
        if parking is None or not (again := max(map(len, aside := parking.places()))):
            return

        # Carry on those that were put aside; their ends come in the order in which they were
        packets = -(-again // width)
        self._launch((0, 0, again, again), packets, [*inputs, *parking.arguments(True)])
        self._take(ends, [first + places for places in aside], packets * width)

    def _take(self, ends: dict[str, NDArray[Any]], rows: Sequence[slice | NDArray[Any]], padded: int) -> None:
        """Take what a launch made into rows of the ends, of every layer; a layer of the launch has so many."""
        for name, array in ends.items():
            layers = array if self.layers else array[np.newaxis]
            made = np.empty((len(layers), padded, *layers.shape[2:]), array.dtype)
            self.device.download(self._buffers[name], made)
            for layer, its_rows, its_made in zip(layers, rows, made, strict=True):
                layer[its_rows] = its_made[: len(layer[its_rows])]

    def _launch(self, tile: tuple[int, int, int, int], packets: int, inputs: Sequence[Any]) -> None:
        outputs = [self._buffers[name] for name, _ in self._arrays]
        most = np.int32(self.max_events)
        items = -(-packets // self.source.structure.run) * self._sets
        counts = np.zeros((items, 2), np.uint32)  # searches and steps of a work-item
        counters = [self.device.upload(counts)] if self.source.structure.counts else []
        arguments = [self._numbers, np.array(tile, np.int32), most, *outputs, *inputs, *counters]
        self._seconds += self._program.run("trace", items, arguments)
        for counter in counters:
            self.device.download(counter, counts)
        self.searches, self.steps = np.add(counts.sum(axis=0, dtype=np.int64), (self.searches, self.steps)).tolist()

    def decide(self, ends: dict[str, NDArray[Any]], rays_of: Callable[[NDArray[np.intp]], tuple[Any, Any]]) -> None:
        """Trace again, in the next precision that device and lenses allow, the rays that were left undecided."""
        for layer, scene in enumerate(self.layers):
            self._decide(scene, {name: array[layer] for name, array in ends.items()}, rays_of)
        if not self.layers:
            self._decide(self.scene, ends, rays_of)

    def _decide(
        self,
        scene: Scene,
        ends: dict[str, NDArray[Any]],
        rays_of: Callable[[NDArray[np.intp]], tuple[Any, Any]],
    ) -> None:
        undecided = np.flatnonzero(ends["status"] == RayStatus.UNDECIDED)
        if not undecided.size or (next_job := self._more_precise(scene)) is None:
            return
        points, vectors = rays_of(undecided)
        goes = vectors.any(axis=1)  # a film pixel on the source has no direction
        undecided = undecided[goes]
        again = decided_ends(next_job, points[goes], unit_vectors(vectors[goes]))
        for name, array in ends.items():
            array[undecided] = again[name]
        self._escalated += len(undecided)
        self._seconds += next_job._seconds

    def finer(self) -> Job | None:
        """Return what traces again the rays that this one leaves undecided; None where nothing is more precise."""
        return self._more_precise(self.scene)

    def _more_precise(self, scene: Scene) -> Job | None:
        """Return the job of the next precision: double after single and mixed, then twice that where lenses have it.

        The scene is this job's own, or of one layer.
        """
        scene = scene.replace({"numerics.precision": "double"})
        source = self.source.structure
        structure = structure_of(scene, "given", source.ends, self.device) if self.device.has_double else None
        if source.precision == "double":
            methods_now = {
                lens: LAST_RESORT
                if row.is_guaranteed and not row.wants_planes and codegen.has_twice(source.lenses[lens])
                else row
                for lens, row in source.methods.items()
            }
            if methods_now == source.methods:
                return None
            assert structure is not None
            structure = replace(structure, lenses=source.lenses, methods=methods_now)  # no others are in reach now
        if structure is None:
            return None
        finer = Job(scene, codegen.kernel_source(structure), self.device, self.kind)
        finer.max_events = self.max_events
        return finer

    def result(self, ends: dict[str, NDArray[Any]], *shape: int) -> dict[str, Any]:
        """Return the fields of a result, its rays in another shape: the ends, and how they were made."""
        layers = (len(self.layers),) if self.layers else ()
        leading = 1 + len(layers)
        arrays = {name: array.reshape(*layers, *shape, *array.shape[leading:]) for name, array in ends.items()}
        own = {name for some in _ARRAYS.values() for name, _ in some}
        added = {name: array for name, array in arrays.items() if name not in own}
        if layers:
            added["wavelengths"] = np.array(self.wavelengths)
        return {
            **{name: array for name, array in arrays.items() if name in own},
            "added": Frozen(added),
            **self.record(),
        }

    def record(self) -> dict[str, Any]:
        """Return what a result says of how it was made."""
        return {
            "trace_seconds": self._seconds,
            "escalated": self._escalated,
            "kernel": self.source,
            "scene": self.scene,
            "device": self.device,
        }


def traced_rays(job: Job, points: NDArray[np.float64], units: NDArray[np.float64]) -> RayPaths:
    """Return the paths of given rays: points and unit directions, shape (N, 3)."""
    return RayPaths(**job.result(decided_ends(job, points, units), len(points)))


def decided_ends(job: Job, points: NDArray[np.float64], units: NDArray[np.float64]) -> dict[str, NDArray[Any]]:
    """Return the ends of given rays, decided as far as that goes."""
    ends = given_ends(job, points, units)
    job.decide(ends, lambda undecided: (points[undecided], units[undecided]))
    return ends


def given_ends(job: Job, points: NDArray[np.float64], units: NDArray[np.float64]) -> dict[str, NDArray[Any]]:
    """Return the ends of given rays as they were traced first; what was left undecided is so still."""
    inside, on = (
        each.astype(job.dtype if job.source.structure.nests else np.int8)
        for each in (locate_sets if job.source.structure.nests else locate)(job.scene, points)
    )
    ends = job.empty_ends(len(points))
    for first in range(0, len(points), job.tile_pixels):
        part = slice(first, first + job.tile_pixels)
        count = len(points[part])
        arrays = [points[part].astype(job.dtype), units[part].astype(job.dtype), inside[part], on[part]]
        job.run(ends, (0, first, count, count), first, [job.device.upload(job.padded(array)) for array in arrays])
    return ends


def _tile_pixels(layers: int) -> int:
    return _TILE_PIXELS // layers


def tiles(rows: int, columns: int, each: int = 1) -> Iterator[tuple[int, int, int, int, int]]:
    """Yield (first row, first column, columns, first pixel, pixels): whole rows, or parts of one that is too long.

    `each` is how many rays a pixel has.
    """
    most = _tile_pixels(each)
    if columns > most:
        for row in range(rows):
            for column in range(0, columns, most):
                part = min(most, columns - column)
                yield row, column, part, row * columns + column, part
        return
    together = most // columns
    for row in range(0, rows, together):
        yield row, 0, columns, row * columns, columns * min(together, rows - row)


def unit_vectors(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return vectors, shape (N, 3), none of them zero, scaled to length 1."""
    scaled = vectors / np.abs(vectors).max(axis=1, keepdims=True)  # whose squares stay within the range of numbers
    unit: NDArray[np.float64] = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
    return unit
