"""Light on the picture: tubes of rays carry it from the source through the film and the lenses.

Input: a traced map whose scene asks for `caustics`. Output: the same map with a `Caustic`.

The corners of the film's pixels are traced. A pixel is a tube of two triangles, and the light through each keeps to it:
it is spread evenly over the triangle between the places of its corners' rays, by exact area. Where rays focus the
triangles are small, or turned over; both are as they should be, and no light is lost or made. Where something absorbs,
red, green and blue go the same way in different amounts; all together counts by luminance, or in light of one of
several wavelengths by what each has of that. What a picture without lenses gets is what its cells see of the source;
`irradiance` is the ratio.

A triangle has a density that is linear between those at its corners, by the Jacobian of their rays, where these agree
with the light that it carries; else its light is spread evenly. A tube is cut into 2 x 2 whose corners are traced,
those again and so on, where it is

- torn: its corners' rays end otherwise, or meet other surfaces. Rays that land beside the picture and those that land
  on it are one sheet: its edge tears nothing;
- folded, or crossed by a jump: all corners of a film's pixel are edges by the rule of `lenscl.tracing.samples`;
- bent: its light differs from what its corners gather, by more than 2 % where it is a cell wide or more;
- varied: what surfaces and insides let on differs between its corners by half;
- at an outline: bounds of the lenses do not exclude that one lies in it, see `lenscl.tracing.outlines`.

What ends otherwise than corners say, unseen, lies at an outline. So the account has a figure of what is not excluded:
the light of all tubes that are torn, bent or at an outline in the end, which are some `_ALL_TO` film pixels wide, or
less if they are few. What is torn goes where the rays through the middles of its quarters go. A tube stays bent on a
fold, and where an edge of a lens parts its light: there its triangles reach over places that get none. Bounds find the
outlines that straight rays meet. Light that a lens has bent and that may meet a surface after that is looked after by
corners alone: all of it is in that figure, too, and named for itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Effects, Scene
from lenscl.config.scene import Frozen
from lenscl.effects.colours import LUMINANCE, basis
from lenscl.status import RayStatus
from lenscl.tracing.film import rays_through
from lenscl.tracing.flux import flux_at, flux_of_cells, flux_through
from lenscl.tracing.launch import trace
from lenscl.tracing.memory import hold
from lenscl.tracing.outlines import Outlines
from lenscl.tracing.raymap import BrightCells, Caustic, RayMap
from lenscl.tracing.samples import edges, trace_given
from lenscl.tracing.start import locate
from lenscl.tracing.tubes import CORNERS, LANDS, Account, TubeRays, parts_of_cells

_PICTURE = np.uint8(RayStatus.PICTURE)
_BENT = 0.02  # by which part a tube's light may differ from what its corners gather
_VARIED = 0.5  # by which part the corners of a tube may differ in what is let on
_VARIED_TO = 1 / 8  # film pixels: tubes are cut for that no smaller
_DARK = 1e-3  # of what the source sends: of less light on a cell, as of so much
_SEEN = 0.25  # cells: what is smaller shows no shape
_ALL_TO = 1 / 32  # film pixels: tubes are cut to that size, however many they are
_BENT_TO = 1 / 64  # film pixels: and to that, if they are bent and few
_SMALLEST = 1 / 1024  # film pixels: and to that, if they are torn or may be, and are few
_FEW = 20_000
_ENOUGH = 1e-6  # of the light: if no more may go elsewhere, nothing is cut for that
_TUBES = 2**18  # that are handled at a time
_TOGETHER = 2**14  # that are cut at a time
_GRIDS = 4  # of the parts of the picture's cells in memory at a time, for each channel
_WHOLE = 5  # and of the cells, as many

# Corners of 2 x 2 tubes, (row, column), row by row; of those the ones that the tube that is cut has not, and where in
# its corners and those each one stands
_GRID = np.moveaxis(np.indices((3, 3)), 0, -1).reshape(9, 2)
_BETWEEN = [1, 3, 4, 5, 7]
_ORDER = [0, 4, 1, 5, 6, 7, 2, 8, 3]
_QUARTERS = np.array([[0.25, 0.25], [0.25, 0.75], [0.75, 0.25], [0.75, 0.75]])

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


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
        return _lit(raymap, LUMINANCE, Outlines(raymap.scene))
    weights, outlines = basis(raymap.wavelengths), Outlines(raymap.scene)
    return _together_lit(raymap, [_lit(*each, outlines) for each in zip(raymap.layers(), weights, strict=True)])


def _check_memory(raymap: RayMap) -> None:
    """Refuse light on more cells than there is memory for: of one wavelength at work, and what is kept of each."""
    columns, rows = raymap.scene.picture.size
    channels, many = 3 if "transmission" in raymap.added else 1, len(raymap.layers())
    kept = 2 * many * (channels + 1) if many > 1 else 0
    hold(
        8 * rows * columns * ((_GRIDS * parts_of_cells(raymap.scene) ** 2 + _WHOLE) * channels + kept),
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
            bright=_together_bright(caustics),
            flux=caustics[0].flux,
            shares=Frozen({end: float(np.mean([one.shares[end] for one in caustics])) for end in ends}),
            cut=sum(one.cut for one in caustics),
            not_excluded=float(np.mean([one.not_excluded for one in caustics])),
            bent=float(np.mean([one.bent for one in caustics])),
        ),
        trace_seconds=sum(layer.trace_seconds for layer in layers),
        escalated=raymap.escalated + sum(layer.escalated - raymap.escalated for layer in layers),
    )


def _together_bright(caustics: list[Caustic]) -> BrightCells:
    """Return the cells that are bright in the light of any of several wavelengths."""
    cells = reduce(np.union1d, [one.bright.cells for one in caustics])
    parts = []
    for one in caustics:
        whole = one.irradiance[..., np.newaxis] if one.rgb is None else one.rgb
        whole = whole.reshape(-1, 1, whole.shape[-1])[cells]
        each = np.repeat(whole.astype(np.float32), one.bright.irradiance.shape[1], axis=1)
        each[np.searchsorted(cells, one.bright.cells)] = one.bright.irradiance
        parts.append(each)
    return BrightCells(cells, np.stack(parts))


def _lit(raymap: RayMap, seen: Array, outlines: Outlines) -> RayMap:
    """Return a map of one wavelength with its light; `seen` says what red, green and blue count for in it."""
    scene, film = raymap.scene, raymap.scene.film
    direct, through = flux_of_cells(scene, scene.picture).sum(axis=-1), flux_of_cells(scene, film)
    grid = trace(_corner_scene(scene), device=raymap.device)
    is_edge = edges(replace(grid, status=np.where(np.isin(grid.status, LANDS), _PICTURE, grid.status)))
    cut = np.logical_and.reduce([is_edge[part] for part in CORNERS]) | outlines.pixels()

    is_coloured = "transmission" in grid.added
    weights = seen if is_coloured else np.ones(1)
    tubes = _Tubes(scene, grid, Account(scene, weights), outlines, _DARK * float(direct.mean()))
    band = max(1, _TUBES // film.columns)
    bands = [slice(top, min(top + band, film.rows)) for top in range(0, film.rows, band)]
    left = TubeRays.joined([tubes.add_pixels(rows, cut[rows], through[rows]) for rows in bands])
    total = float(through.sum())
    tubes.add_cut(np.argwhere(cut).astype(np.float64), left, total)
    account = tubes.account
    bent = account.bent if _may_meet_more(scene) else 0.0
    (gathered, bright), records = account.close(direct), account.records
    return replace(
        raymap,
        caustic=Caustic(
            irradiance=gathered @ weights,
            rgb=gathered if is_coloured else None,
            bright=bright,
            flux=total,
            shares=Frozen({name: light / total + 0.0 for name, light in account.ends.items()}),  # no -0
            cut=int(cut.sum()),
            not_excluded=(account.not_excluded + bent) / total,
            bent=bent / total,
        ),
        trace_seconds=sum((record["trace_seconds"] for record in records), raymap.trace_seconds + grid.trace_seconds),
        escalated=sum((record["escalated"] for record in records), raymap.escalated + grid.escalated),
    )


@dataclass(frozen=True, slots=True)
class _Tubes:
    """Tubes of a scene's light, added to an account."""

    scene: Scene
    grid: RayMap  # of the corners of film pixels
    account: Account
    outlines: Outlines
    dark: float  # light on a cell that is as good as none

    def add_pixels(self, rows: slice, cut: Mask, flux: Array) -> TubeRays:
        """Add the tubes through some rows of film pixels that are not to be cut, and return the corners of the others.

        Those that are to be cut for their corners are marked in `cut`, too.
        """
        some = slice(rows.start, rows.stop + 1)
        grid = self.grid
        ends = {"st": grid.st, "status": grid.status, "events": grid.events, **grid.added}
        ends = {name: array[some] for name, array in ends.items()}
        at = np.moveaxis(np.indices(ends["status"].shape), 0, -1) + np.array([rows.start, 0])
        tubes = TubeRays.of(ends, self.scene, self._through(at), *at.shape[:-1]).of_tubes()
        flux = flux.reshape(-1, 2)
        cut |= (self._is_bent(tubes, flux, 1.0) | tubes.is_torn()).reshape(cut.shape)
        keeps = ~cut.ravel()
        self.account.add_tubes(tubes.some(keeps), flux[keeps])
        return tubes.some(~keeps)

    def add_cut(self, at: Array, tubes: TubeRays, total: float) -> None:
        """Add the light through film pixels that are to be cut.

        Parameters
        ----------
        at : float64 array, shape (N, 2)
            Where on the film they begin, (row, column) in pixels.
        tubes : TubeRays
            Their corners, shape (N, 4).
        total : float
            The light of the whole film.
        """
        size = 1.0
        while len(at):
            size /= 2
            cut = [self._cut_once(at[some], tubes.some(some), size) for some in _together(len(at))]
            at, is_torn, is_marked, is_bent = (
                np.concatenate(arrays) for arrays in zip(*(c[0] for c in cut), strict=True)
            )
            tubes = TubeRays.joined([each for _, each in cut])
            # An outline that no bounds follow to smaller tubes is not looked for in those
            self.outlines.refine(size / 2)
            is_sought = is_torn | (is_marked & (size > self.outlines.finest))
            is_open = is_torn | is_marked
            is_told = is_open | is_bent
            flux = _flux(self.scene, at, size)
            is_cut = is_bent & (size > (_BENT_TO if is_bent.sum() <= _FEW else _ALL_TO))
            is_worth = is_sought.sum() <= _FEW and flux[is_open].sum() > _ENOUGH * total
            if size > (_SMALLEST if is_worth else _ALL_TO):
                is_cut |= is_sought
            self.account.not_excluded += float(flux[is_told & ~is_cut].sum())
            whole, torn = ~is_cut & ~is_torn, ~is_cut & is_torn
            self.account.add_tubes(tubes.some(whole), flux[whole], is_told[whole])
            self._add_torn(at[torn], flux[torn].sum(axis=-1), size)
            at, tubes = at[is_cut], tubes.some(is_cut)

    def _cut_once(self, at: Array, tubes: TubeRays, size: float) -> tuple[tuple[Array, Mask, Mask, Mask], TubeRays]:
        """Cut tubes, by their corners, into 2 x 2 of a size in pixels, and add those that are as they should be.

        Returns
        -------
        at : float64 array, shape (N, 2)
            Where those begin that are not.
        is_torn, is_marked, is_bent : bool array, shape (N,)
            Why: the light is torn there; an outline may lie there; the light is uneven.
        tubes : TubeRays
            Their corners, shape (N, 4).
        """
        grid = at[:, None] + size * _GRID
        rays = TubeRays.joined([tubes, self._traced(grid[:, _BETWEEN])], axis=1).some((slice(None), _ORDER))
        begins = grid.reshape(-1, 3, 3, 2)[:, :-1, :-1].reshape(-1, 2)
        tubes, flux = rays.shaped(len(at), 3, 3).of_tubes(), _flux(self.scene, begins, size)
        is_torn, is_marked = tubes.is_torn(), self.outlines.among(begins, size)
        is_bent = self._is_bent(tubes, flux, size) & ~is_torn
        again = is_torn | is_marked | is_bent
        self.account.add_tubes(tubes.some(~again), flux[~again])
        return (begins[again], is_torn[again], is_marked[again], is_bent[again]), tubes.some(again)

    def _add_torn(self, at: Array, flux: Array, size: float) -> None:
        """Let the light through torn tubes go where the rays through the middles of their quarters go."""
        for some in _together(len(at)):
            middles = at[some, None] + size * _QUARTERS
            quarters = np.repeat(flux[some, None] / 4, 4, axis=1).ravel()
            self.account.add_rays(self._traced(middles).shaped(quarters.size), quarters)

    def _is_bent(self, tubes: TubeRays, flux: Array, size: float) -> Mask:
        """Say which tubes gather light unevenly where that is seen on the picture, or let on unlike parts of it."""
        is_bent = tubes.is_seen(self.scene.picture.size, _SEEN)
        is_bent[is_bent] = tubes.some(is_bent).is_uneven(flux[is_bent], _BENT, self.dark)
        return is_bent | tubes.is_varied(_VARIED) if size > _VARIED_TO else is_bent

    def _traced(self, at: Array) -> TubeRays:
        """Return the ends of rays through places of the film, shape (..., 2), (row, column) in pixels."""
        film, places = self.scene.film, at.reshape(-1, 2)

        def rays_of(numbers: NDArray[np.integer[Any]]) -> tuple[Array, Array]:
            return rays_through(self.scene, places[numbers, 1] / film.columns, places[numbers, 0] / film.rows)

        job, ends = trace_given(self.grid, rays_of, len(places))
        self.account.records.append(job.record())
        return TubeRays.of(ends, self.scene, self._through(at), *at.shape[:-1])

    def _through(self, at: Array) -> Array:
        return flux_at(self.scene, _points(self.scene, at))


def _together(count: int) -> Iterator[slice]:
    """Yield as many tubes as are cut at a time; of none once."""
    yield from (slice(first, first + _TOGETHER) for first in range(0, max(count, 1), _TOGETHER))


def _flux(scene: Scene, at: Array, size: float) -> Array:
    """Return the flux through both triangles of squares of the film, shape (N, 2), as in `_add_cut`."""
    film = scene.film
    right, down = np.asarray(film.right) / film.columns, np.asarray(film.down) / film.rows
    return flux_through(scene, _points(scene, at), size * right, size * down)


def _points(scene: Scene, at: Array) -> Array:
    """Return places of the film, shape (..., 2), (row, column) in pixels, in space."""
    film = scene.film
    right, down = np.asarray(film.right) / film.columns, np.asarray(film.down) / film.rows
    points: Array = np.asarray(film.corner) + at[..., :1] * down + at[..., 1:] * right
    return points


def _may_meet_more(scene: Scene) -> bool:
    """Say whether light that a lens has bent may meet another one, or the same one again."""
    groups = scene.lenses.groups
    if not any(group.lens.mirror or not scene.stops_light(group) for group in groups):
        return False
    first, at = groups[0].lens, scene.source.at
    if len(scene.lenses) > 1 or not first.surface.is_convex:
        return True
    is_within = at is not None and locate(scene, np.array([at], dtype=np.float64))[0][0] >= 0
    return bool(first.mirror) and (not first.is_mirror or is_within)


def _corner_scene(scene: Scene) -> Scene:
    """Return a scene whose film has a pixel around every corner of the scene's pixels; rays tell their Jacobian."""
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
        effects=Effects({**scene.effects, "footprint": True, "antialias": 1}),
    )
