"""Light on the picture: tubes of rays carry it from the source through the film and the lenses.

Input: a traced map whose scene asks for `caustics`. Output: the same map with a `Caustic`.

The corners of the film's pixels are traced. A pixel is a tube of two triangles, and the light through each keeps to it:
it is spread evenly over the triangle between the places of its corners' rays, by exact area. Where rays focus the
triangles are small, or turned over; both are as they should be, and no light is lost or made. Where something absorbs,
red, green and blue go the same way in different amounts; all together counts by luminance, or in light of one of
several wavelengths by what each has of that. What a picture without lenses gets is what its cells see of the source;
`irradiance` is the ratio.

A tube is cut into 4 x 4 whose corners are traced, those again into 4 x 4 and those into 2 x 2, where it is

- torn: its corners' rays end otherwise, or meet other surfaces; what is torn to the last goes where the ray through its
  middle goes. Rays that land beside the picture and those that land on it are one sheet: its edge tears nothing;
- folded, or crossed by a jump: all corners of a film's pixel are edges by the rule of `lenscl.tracing.samples`;
- bent: its corners gather the light unevenly, by more than a tenth, over more than half a cell;
- at a small lens: where a lens's box covers few film pixels, corners of whole pixels may pass beside it.

So irradiance is that of exact optics but for how it changes across such a tube. Without lenses that is by how much the
light changes across a film pixel, some four times its angle as the source sees it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
from lenscl.config.scene import Frozen
from lenscl.effects.colours import LUMINANCE, basis
from lenscl.status import RayStatus
from lenscl.tracing.film import rays_through
from lenscl.tracing.flux import flux_of_cells, flux_through
from lenscl.tracing.launch import trace
from lenscl.tracing.memory import hold
from lenscl.tracing.placement import Placement
from lenscl.tracing.raymap import Caustic, RayMap
from lenscl.tracing.samples import edges, trace_given
from lenscl.tracing.tubes import CORNERS, LANDS, Account, TubeRays

_SIDES = (4, 4, 2)  # tubes that one is cut into, each way, and what of those is to be cut, and so on
_BENT = 0.1  # by which part a tube's corners may differ in what they gather
_SEEN = 0.5  # cells: what is smaller shows no shape
_TUBES = 2**18  # that are handled at a time
_TOGETHER = 2**14  # that are cut at a time
_GRIDS = 8  # of the picture's cells in memory at a time, for each channel
_SMALL = 8.0  # film pixels across a lens's box below which those around it are cut

Array = NDArray[np.float64]


def with_caustic(raymap: RayMap) -> RayMap:
    """Return a map with the light on its picture where the scene's `effects.caustics` asks for that; else itself.

    Raises
    ------
    StudyError
        If film or picture are seen edge-on from the source.
    TraceError
        If there is not enough memory for the picture's cells.
    """
    if not raymap.scene.effects["caustics"]:
        return raymap
    _check_memory(raymap)
    if "wavelengths" not in raymap.added:
        return _lit(raymap, LUMINANCE)
    weights = basis(raymap.wavelengths)
    return _together_lit(raymap, [_lit(*each) for each in zip(raymap.layers(), weights, strict=True)])


def _check_memory(raymap: RayMap) -> None:
    """Refuse light on more cells than there is memory for: of one wavelength at work, and what is kept of each."""
    columns, rows = raymap.scene.picture.size
    channels, many = 3 if "transmission" in raymap.added else 1, len(raymap.layers())
    kept = 2 * many * (channels + 1) if many > 1 else 0
    hold(
        8 * rows * columns * (_GRIDS * channels + kept),
        "effects.caustics",
        f"the cells of a picture of {columns:,} x {rows:,} with their light",
        "use a smaller picture.size",
    )


def _together_lit(raymap: RayMap, layers: list[RayMap]) -> RayMap:
    """Return a map of several wavelengths with the light of all of them."""
    caustics = [layer.caustic for layer in layers if layer.caustic is not None]
    coloured, ends = [one.rgb for one in caustics if one.rgb is not None], caustics[0].shares
    return replace(
        raymap,
        caustic=Caustic(
            irradiance=np.stack([one.irradiance for one in caustics]),
            rgb=np.stack(coloured) if coloured else None,
            flux=caustics[0].flux,
            shares=Frozen({end: float(np.mean([one.shares[end] for one in caustics])) for end in ends}),
            cut=sum(one.cut for one in caustics),
        ),
        trace_seconds=sum(layer.trace_seconds for layer in layers),
        escalated=raymap.escalated + sum(layer.escalated - raymap.escalated for layer in layers),
    )


def _lit(raymap: RayMap, seen: Array) -> RayMap:
    """Return a map of one wavelength with its light; `seen` says what red, green and blue count for in it."""
    scene, film = raymap.scene, raymap.scene.film
    direct, through = flux_of_cells(scene, scene.picture).sum(axis=-1), flux_of_cells(scene, film)
    grid = trace(_corner_scene(scene), device=raymap.device)
    ends = {"st": grid.st, "status": grid.status, "events": grid.events, **grid.added}
    rays = TubeRays.of(ends, scene, *grid.status.shape)
    is_sheet = np.isin(grid.status, LANDS)
    is_edge = edges(replace(grid, status=np.where(is_sheet, np.uint8(RayStatus.PICTURE), grid.status)))
    cut = np.logical_and.reduce([is_edge[part] for part in CORNERS]) | _is_bent(rays, scene.picture.size)
    cut |= _at_small_lenses(scene)

    is_coloured = "transmission" in grid.added
    weights = seen if is_coloured else np.ones(1)
    account = Account(scene, weights)
    band = max(1, _TUBES // film.columns)
    for top in range(0, film.rows, band):
        some = ~cut[top : top + band]
        account.add_tubes(rays.rows(top, top + band + 1).of_tubes(some), through[top : top + band][some])
    _add_cut(account, raymap, np.argwhere(cut).astype(np.float64))
    filled, records = account.close(), account.records
    total, gathered = float(through.sum()), filled / direct[..., np.newaxis]
    return replace(
        raymap,
        caustic=Caustic(
            irradiance=gathered @ weights,
            rgb=gathered if is_coloured else None,
            flux=total,
            shares=Frozen({name: light / total + 0.0 for name, light in account.ends.items()}),  # no -0
            cut=int(cut.sum()),
        ),
        trace_seconds=sum((record["trace_seconds"] for record in records), raymap.trace_seconds + grid.trace_seconds),
        escalated=sum((record["escalated"] for record in records), raymap.escalated + grid.escalated),
    )


def _at_small_lenses(scene: Scene) -> NDArray[np.bool_]:
    """Say which film pixels the straight rays to the box of a lens go through that is few pixels wide on the film."""
    film = scene.film
    found = np.zeros((film.rows, film.columns), dtype=bool)
    corner, right, down = (np.asarray(v, dtype=np.float64) for v in (film.corner, film.right, film.down))
    normal = np.cross(right, down)
    spans = np.linalg.pinv(np.stack([right / film.columns, down / film.rows], axis=1))
    for lens in scene.lenses:
        box = Placement.of(lens).corners()
        along = box - scene.source.at if scene.source.at is not None else np.asarray(scene.source.direction)
        with np.errstate(all="ignore"):
            times = ((box - corner) @ normal) / (along @ normal)
            places = (box - times[:, None] * along - corner) @ spans.T
            # A point source looks at a box ahead of it alone
            is_ahead = scene.source.at is None or bool((times < 1.0).all())
        if not is_ahead or not np.isfinite(places).all() or np.ptp(places, axis=0).min() >= _SMALL:
            continue
        low = np.clip(np.floor(places.min(axis=0)) - 1, 0, film.size).astype(int)
        high = np.clip(np.ceil(places.max(axis=0)) + 1, 0, film.size).astype(int)
        found[low[1] : high[1], low[0] : high[0]] = True
    return found


def _add_cut(account: Account, raymap: RayMap, at: Array) -> None:
    """Add the light through film pixels that are to be cut.

    Parameters
    ----------
    account : Account
    raymap : RayMap
    at : float64 array, shape (N, 2)
        Where on the film they begin, (row, column) in pixels.
    """
    size = 1.0
    for level, side in enumerate(_SIDES, 1):
        again = [_cut_once(account, raymap, some, size, side, level == len(_SIDES)) for some in _together(at)]
        at, size = np.concatenate([at[:0], *again]), size / side
    for some in _together(at):
        middles = TubeRays.of(_traced(account, raymap, some + size / 2), raymap.scene, len(some))
        account.add_rays(middles, _flux(raymap.scene, some, size).sum(axis=-1))


def _cut_once(account: Account, raymap: RayMap, at: Array, size: float, side: int, is_last: bool) -> Array:
    """Cut tubes of a size in pixels, `side` x `side`; return where those begin that have to be cut again."""
    step = size / side
    corners = at[:, None, None] + step * np.moveaxis(np.indices((side + 1, side + 1)), 0, -1)
    rays = TubeRays.of(_traced(account, raymap, corners.reshape(-1, 2)), raymap.scene, *corners.shape[:-1])
    begins = corners[:, :-1, :-1]
    tubes = rays.of_tubes(np.ones(begins.shape[:-1], dtype=bool))
    again = _is_torn(tubes).reshape(begins.shape[:-1])
    if not is_last:
        again |= _is_bent(rays, raymap.scene.picture.size)
    account.add_tubes(rays.of_tubes(~again), _flux(raymap.scene, begins[~again], step))
    return begins[again]


def _together(at: Array) -> Iterator[Array]:
    """Yield as many tubes as are cut at a time."""
    yield from (at[first : first + _TOGETHER] for first in range(0, len(at), _TOGETHER))


def _traced(account: Account, raymap: RayMap, at: Array) -> Mapping[str, NDArray[Any]]:
    """Return the ends of rays through places of the film, shape (N, 2), (row, column) in pixels."""
    scene, film = raymap.scene, raymap.scene.film

    def rays_of(numbers: NDArray[np.integer[Any]]) -> tuple[Array, Array]:
        return rays_through(scene, at[numbers, 1] / film.columns, at[numbers, 0] / film.rows)

    job, ends = trace_given(raymap, rays_of, len(at))
    account.records.append(job.record())
    return ends


def _flux(scene: Scene, at: Array, size: float) -> Array:
    """Return the flux through both triangles of squares of the film, shape (N, 2), as in `_add_cut`."""
    film = scene.film
    right, down = np.asarray(film.right) / film.columns, np.asarray(film.down) / film.rows
    corners = np.asarray(film.corner) + at[:, :1] * down + at[:, 1:] * right
    return flux_through(scene, corners, size * right, size * down)


def _is_torn(tubes: TubeRays) -> NDArray[np.bool_]:
    """Say of tubes' corners, shape (N, 4), whether their rays end otherwise, or meet other surfaces."""
    end = np.where(np.isin(tubes.status, LANDS), 0, 1 + tubes.status.astype(np.int32)) * 256 + tubes.events
    torn: NDArray[np.bool_] = (end[:, 0] != end[:, 1]) | (end[:, 0] != end[:, 2]) | (end[:, 0] != end[:, 3])
    return torn


def _reaches(rays: TubeRays, size: tuple[int, int]) -> NDArray[np.bool_]:
    """Say which tubes between corners on grids may put light on the picture, by the box around their places."""
    found = np.ones((1,), dtype=bool)
    for axis in (0, 1):
        corners = [rays.place[..., axis][part] for part in CORNERS]
        found = found & (np.minimum.reduce(corners) <= size[axis]) & (np.maximum.reduce(corners) >= 0.0)
    return found


def _is_bent(rays: TubeRays, size: tuple[int, int]) -> NDArray[np.bool_]:
    """Say which tubes between corners on grids gather light unevenly, by the areas that their steps span there."""
    corner, right, down, far = (rays.place[(*part, slice(None))] for part in CORNERS)
    lands = np.isin(rays.status, LANDS)
    with np.errstate(over="ignore", invalid="ignore"):
        across, below, up, back = right - corner, down - corner, far - right, far - down
        spans = [_cross(across, below), _cross(across, up), _cross(back, below), _cross(back, up)]
        apart = np.maximum.reduce(spans) - np.minimum.reduce(spans)
        wide = np.maximum(np.abs(far - corner), np.abs(right - down))
        is_seen = np.maximum(wide[..., 0], wide[..., 1]) > _SEEN
        uneven = apart > _BENT * sum(np.abs(span) for span in spans) / len(spans)
    bent: NDArray[np.bool_] = uneven & is_seen & np.logical_and.reduce([lands[part] for part in CORNERS])
    return bent & _reaches(rays, size)


def _cross(a: Array, b: Array) -> Array:
    spanned: Array = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return spanned


def _corner_scene(scene: Scene) -> Scene:
    """Return a scene whose film has a pixel around every corner of the scene's pixels."""
    film = scene.film
    right, down = np.asarray(film.right) / film.columns, np.asarray(film.down) / film.rows
    columns, rows = film.columns + 1, film.rows + 1
    return replace(
        scene,
        film=replace(
            film,
            keeps="corner",
            anchor=tuple((np.asarray(film.corner) - (right + down) / 2).tolist()),
            unscaled_right=tuple((right * columns).tolist()),
            unscaled_down=tuple((down * rows).tolist()),
            scale=1.0,
            size=(columns, rows),
        ),
    )
