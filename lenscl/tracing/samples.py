"""More rays than one a film pixel: where they go, and which pixels need them.

Input: a traced map whose scene asks for `antialias`. Output: the same map with `samples`. A film pixel of n x n samples
is traced as n x n pixels of a film n times as fine, by the same kernel, in tiles.

`antialias = "edges"` refines a pixel with 4 x 4 samples where something about its ray and that of one of the eight
around it, or of the next in its row or column, says that colours may end between the two:

- their status or their number of events differ: a silhouette, a crease of the view, or the picture's edge;
- their places are apart by a jump: more than half a pixel of `picture.size`, and more than four times the steps before
  and behind it, of rays with the same events. Towards a silhouette steps grow like a square root, by less than that;
- the map turns over between them: the parallelograms of their steps to the right and down have opposite orientation,
  as on the two sides of a fold, and are not all smaller than half a pixel.

A detail that passes between the rays of pixels and changes none of them is not found; n x n samples everywhere find it
if it is n times as large.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from lenscl import codegen
from lenscl.config import Scene
from lenscl.config.scene import Frozen
from lenscl.effects import EDGE_SAMPLES
from lenscl.errors import TraceError
from lenscl.status import RayStatus
from lenscl.tracing.film import film_rays
from lenscl.tracing.job import Job, given_ends, tiles, unit_vectors
from lenscl.tracing.memory import hold
from lenscl.tracing.raymap import RayMap, Samples

_JUMP = 4.0  # times the steps around it: where places go like sqrt(x), as near a silhouette, it is at most 2.4
_VISIBLE = 0.5  # pixels of the picture: smaller steps show no edge
_AT_A_TIME = 2**20  # rays made on the host at a time
_OWN = ("st", "status", "events")  # arrays of any samples
_LANDS = tuple(int(status) for status in RayStatus if status.lands)

Array = NDArray[np.float64]
Ends = dict[str, NDArray[Any]]


def with_samples(raymap: RayMap) -> RayMap:
    """Return a map with the samples that its scene's `effects.antialias` asks for; itself where that is 1.

    Raises
    ------
    TraceError
        If there is no memory for the samples.
    """
    if raymap.scene.effects["antialias"] == 1:
        return raymap
    try:
        return _sampled(raymap)
    except (TraceError, MemoryError) as error:
        if isinstance(error, TraceError) and not isinstance(error.__cause__, MemoryError):
            raise
        raise TraceError(
            "effects.antialias: there is no memory for so many rays; ask for fewer a pixel, "
            'for "edges", or for a smaller film'
        ) from error


def _sampled(raymap: RayMap) -> RayMap:
    asked, layers = raymap.scene.effects["antialias"], raymap.layers()
    if asked == "edges":
        side = EDGE_SAMPLES
        pixels = np.flatnonzero(np.logical_or.reduce([edges(layer) for layer in layers]))
    else:
        side, pixels = cast(int, asked), np.arange(layers[0].status.size)
    _check_memory(layers, side, len(pixels))
    is_whole = asked != "edges"
    if "wavelengths" in raymap.added:
        fields = _of_each(layers, side, pixels, is_whole=is_whole)
    else:
        fields = _traced(raymap, side, pixels, is_whole=is_whole)
    return replace(
        raymap,
        samples=Samples(side=side, pixels=pixels, **{name: fields[name] for name in (*_OWN, "added")}),
        trace_seconds=raymap.trace_seconds + fields["trace_seconds"],
        escalated=raymap.escalated + fields["escalated"],
    )


def _check_memory(layers: Sequence[RayMap], side: int, pixels: int) -> None:
    """Refuse samples that do not fit beside those of one wavelength, of which they are put together."""
    rays = pixels * side**2
    one = layers[0]
    each = sum(array.nbytes for array in (one.st, one.status, one.events, *one.added.values())) // one.status.size
    many = len(layers)
    light, wish = (f" at {many} wavelengths", "for fewer wavelengths, ") if many > 1 else ("", "")
    hold(
        rays * each * (many + 1 if many > 1 else 1),
        "effects.antialias",
        f"{side} x {side} rays of each of {pixels:,} film pixels{light}",
        f'ask for fewer a pixel, {wish}for "edges", or for a smaller film',
    )


def _traced(layer: RayMap, side: int, pixels: NDArray[np.integer[Any]], *, is_whole: bool) -> dict[str, Any]:
    """Return the fields of the samples of some pixels, or of all, of a map of one wavelength."""
    if is_whole:
        job, ends = _every_pixel(layer, side)
    else:
        job, ends = trace_given(
            layer,
            lambda numbers: sample_rays(layer.scene, numbers, side, pixels),
            len(pixels) * side**2,
            finer(layer.scene, side),
        )
    return job.result(ends, len(pixels), side**2)


def _of_each(
    layers: Sequence[RayMap], side: int, pixels: NDArray[np.integer[Any]], *, is_whole: bool
) -> dict[str, Any]:
    """Return the fields of the samples of all wavelengths, with an axis of those in front.

    One wavelength's own are let go before the next one's are traced.
    """
    arrays: dict[str, NDArray[Any]] = {}
    seconds, escalated = 0.0, 0
    for number, layer in enumerate(layers):
        fields = _traced(layer, side, pixels, is_whole=is_whole)
        for name, array in {**{name: fields[name] for name in _OWN}, **fields["added"]}.items():
            if name not in arrays:
                arrays[name] = np.empty((len(layers), *array.shape), array.dtype)
            arrays[name][number] = array
        seconds += fields["trace_seconds"]
        escalated += fields["escalated"]
        del fields, array
    own = {name: arrays.pop(name) for name in _OWN}
    return {**own, "added": Frozen(arrays), "trace_seconds": seconds, "escalated": escalated}


def edges(raymap: RayMap) -> NDArray[np.bool_]:
    """Return which pixels of a map are to be refined, shape (rows, columns); the module says by what rule."""
    status, events = raymap.status, raymap.events
    lands, lit = np.isin(status, _LANDS), status == RayStatus.PICTURE
    places = raymap.st.astype(np.float64) * raymap.scene.picture.size
    found = np.zeros(status.shape, dtype=bool)
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        here, there = _pairs(status.shape, down, right)
        _mark(found, here, there, (status[here] != status[there]) | (events[here] != events[there]))
    with np.errstate(invalid="ignore"):
        for down, right in ((0, 1), (1, 0)):
            here, there = _pairs(status.shape, down, right)
            is_one = lands[here] & lands[there] & (events[here] == events[there]) & (lit[here] | lit[there])
            step = np.linalg.norm(places[there] - places[here], axis=-1)
            _mark(found, here, there, _is_jump(np.where(is_one, step, np.nan), axis=1 if right else 0))
        turned = _orientation(places, lands, events)
        for down, right in ((0, 1), (1, 0)):
            here, there = _pairs(turned.shape, down, right)
            is_lit = lit[: turned.shape[0], : turned.shape[1]]
            _mark(found, here, there, (turned[here] * turned[there] < 0) & (is_lit[here] | is_lit[there]))
    return found


def sample_rays(scene: Scene, samples: NDArray[np.integer], side: int, pixels: NDArray[np.integer]) -> Any:
    """Return origins and directions, shape (N, 3), of samples.

    Parameters
    ----------
    scene : Scene
    samples : int array, shape (N,)
        Numbers of samples: side x side a pixel, row by row, pixel by pixel.
    side : int
    pixels : int array, shape (P,)
        The film's numbers of those pixels.
    """
    pixel, inner = pixels[samples // side**2], samples % side**2
    row = pixel // scene.film.columns * side + inner // side
    column = pixel % scene.film.columns * side + inner % side
    fine = finer(scene, side)
    return film_rays(fine, row * fine.film.columns + column)


def finer(scene: Scene, side: int) -> Scene:
    """Return a scene with side x side pixels of the film for every one."""
    film = scene.film
    return replace(scene, film=replace(film, size=(film.columns * side, film.rows * side)))


def _every_pixel(raymap: RayMap, side: int) -> tuple[Job, Ends]:
    scene, film = raymap.scene, raymap.scene.film
    job = Job.prepare(finer(scene, side), scene.source.kind, "map", None, None, raymap.device)
    each = side**2
    ends = job.empty_ends(raymap.status.size * each)
    for row, column, columns, first, count in tiles(film.rows, film.columns, each):
        part = job.empty_ends(count * each)
        job.run(part, (row * side, column * side, columns * side, count * each), 0, ())

        # The tile has the rows of its pixels' samples side by side; a pixel's are to stand together
        for name, array in part.items():
            rest = array.shape[1:]
            block = array.reshape(count // columns, side, columns, side, *rest).swapaxes(1, 2)
            ends[name][first * each : (first + count) * each] = block.reshape(count * each, *rest)
    job.decide(ends, lambda samples: sample_rays(scene, samples, side, np.arange(raymap.status.size)))
    return job, ends


def trace_given(
    raymap: RayMap,
    rays_of: Callable[[NDArray[np.integer[Any]]], tuple[Array, Array]],
    count: int,
    scene: Scene | None = None,
) -> tuple[Job, Ends]:
    """Trace rays of a map's scene that are no pixels', as the map's own are traced.

    Parameters
    ----------
    raymap : RayMap
    rays_of : callable
        The origins and directions, shape (N, 3), of rays by their numbers, shape (N,); a direction of 0 is no ray.
    count : int
        How many there are.
    scene : Scene, optional
        The map's, with film pixels of another size, where these rays are those of such.

    Returns
    -------
    Job, mapping of str to array
        Their ends, one row a ray. Where there was no ray the status is UNDECIDED.
    """
    # The kernel is the film's but for the start of a ray: what was proved of rays from the source holds for these
    whole = raymap.kernel.structure
    structure = replace(whole, rays="given", effects=tuple(effect for effect in whole.effects if not effect.layers))
    job = Job(scene or raymap.scene, codegen.kernel_source(structure), raymap.device)
    ends = job.empty_ends(count)
    for first in range(0, count, _AT_A_TIME):
        numbers = np.arange(first, min(first + _AT_A_TIME, count))
        points, vectors = rays_of(numbers)
        goes = (vectors != 0).max(axis=1)
        part = given_ends(job, points, unit_vectors(np.where(goes[:, None], vectors, 1.0)))
        part["status"][~goes], part["events"][~goes], part["st"][~goes] = RayStatus.UNDECIDED, 0, -1.0
        for name, array in part.items():
            ends[name][numbers] = array
    job.decide(ends, rays_of)
    return job, ends


def _pairs(shape: tuple[int, ...], down: int, right: int) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Return two windows of an image: every pixel that has a neighbour so far down and right, and that neighbour."""
    rows, columns = shape[0], shape[1]
    here = slice(0, rows - down), slice(max(0, -right), columns - max(0, right))
    return here, (slice(down, rows), slice(max(0, right), columns + min(0, right)))


def _mark(found: NDArray[np.bool_], here: Any, there: Any, apart: NDArray[np.bool_]) -> None:
    found[here] |= apart
    found[there] |= apart


def _is_jump(step: NDArray[np.float64], axis: int) -> NDArray[np.bool_]:
    """Say which steps are jumps; NaN is no step, nor is one that is judged by nothing but those."""
    padded = np.pad(step, [(1, 1) if each == axis else (0, 0) for each in (0, 1)], constant_values=np.nan)
    before, after = (np.take(padded, range(first, first + step.shape[axis]), axis=axis) for first in (0, 2))
    return (step > _VISIBLE) & (step > _JUMP * np.fmax(before, after))


def _orientation(
    places: NDArray[np.float64], lands: NDArray[np.bool_], events: NDArray[np.uint8]
) -> NDArray[np.float64]:
    """Return 1 or -1 for how the map turns the steps right and down, 0 where that is unknown or small.

    Shape (rows - 1, columns - 1); a step is one of rays that land, with the same events.
    """
    rows, columns = lands.shape
    corner, right, below = (slice(0, rows - 1), slice(0, columns - 1)), (slice(0, rows - 1), slice(1, columns)), (
        slice(1, rows), slice(0, columns - 1))  # fmt: skip
    known = lands[corner] & lands[right] & lands[below]
    known &= (events[corner] == events[right]) & (events[corner] == events[below])
    across, down = places[right] - places[corner], places[below] - places[corner]
    known &= np.maximum(np.abs(across).max(axis=-1), np.abs(down).max(axis=-1)) > _VISIBLE
    turn = np.sign(across[..., 0] * down[..., 1] - across[..., 1] * down[..., 0])
    return np.where(known, turn, 0.0)
