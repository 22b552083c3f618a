"""Where rays of a scene should land, by the float64 twin, and how far a ray map is from that.

The twin takes its first roots from companion matrices, which prove that no earlier one is left out, and then halves
the disc that holds the root by signs of F itself. Nothing of it is shared with the kernels.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from lenscl import reference
from lenscl.accuracy.bench.measurement import Error, Quantiles
from lenscl.config import Lens, Scene
from lenscl.errors import LensclError
from lenscl.reference import Paths, Steps, companion
from lenscl.status import RayStatus
from lenscl.tracing import RayMap

Array = NDArray[np.float64]

CELLS = 64  # along each side of the film; a ray is followed in each
LEAST = 300  # rays through the lens, for 99 % of them to be told from all; on smaller lenses the cells are halved
_SEED = 20  # of the places in the cells, so that every run looks at the same rays
_HALVINGS = 60  # any disc shrinks below an ulp of its ends
_FINE_STEP = 1e-3  # scene units, where no companion matrix tells the roots
_LAST_BIT = 1.0 + np.finfo(np.float64).eps * np.array([1.0, -1.0, 1.0])  # turns a direction by about as much
_LANDED = (RayStatus.PICTURE, RayStatus.OFF_PICTURE)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Expected:
    """The ends that some rays of a film should have.

    Attributes
    ----------
    pixels : int array, shape (N,)
        Which rays: numbers of pixels, row by row.
    paths : Paths
        Their ends.
    floor : float
        As in `Error`.
    against : str
        What says so, for people.
    """

    pixels: NDArray[np.intp] = field(repr=False)
    paths: Paths = field(repr=False)
    floor: float
    against: str

    @classmethod
    def of(cls, scene: Scene, cells: int = CELLS, least: int = LEAST) -> Self:
        """Follow one ray of every cell of the film.

        Parameters
        ----------
        scene : Scene
        cells : int
            Along each side of the film; its pixels, if they are fewer.
        least : int
            Rays that should meet a lens; the cells are halved until they do or are pixels.
        """
        if len(scene.lenses) == 1 and _is_judged(scene.lenses[0]):
            steps, roots = Steps(first_root=_judged_root(scene.lenses[0])), "first roots from companion matrices"
        else:
            scene = scene.replace({"numerics.step": min(_FINE_STEP, scene.numerics.step)})
            steps, roots = Steps(), f"first roots by steps of {scene.numerics.step:g}"
        every_origin, every_direction = reference.film_rays(scene)
        while True:
            pixels = _sampled(scene.film.columns, scene.film.rows, cells)
            origins, directions = every_origin[pixels], every_direction[pixels]
            paths = reference.trace_rays(scene, origins, directions, steps)
            if np.count_nonzero(paths.events) >= least or cells >= max(scene.film.size):
                break
            cells *= 2
        moved = reference.trace_rays(scene, origins, directions * _LAST_BIT, steps)
        both = _comparable(paths.status, paths.events, moved.status, moved.events)
        floor = _quantiles(_largest(paths.st[both] - moved.st[both], scene.picture.size)).high
        return cls(pixels=pixels, paths=paths, floor=floor, against=f"the float64 twin, {roots}")

    def error_of(self, raymap: RayMap) -> Error:
        """Compare a map of the same scene."""
        st = raymap.st.reshape(-1, 2)[self.pixels].astype(np.float64)
        status, events = raymap.status.ravel()[self.pixels], raymap.events.ravel()[self.pixels]
        paths = self.paths
        decided = (status != RayStatus.UNDECIDED) & (paths.status != RayStatus.UNDECIDED)
        lens = (events > 0) | (paths.events > 0)
        differs = decided & lens & ((status != paths.status) | (events != paths.events))
        both = _comparable(paths.status, paths.events, status, events)
        apart, size = st[both] - paths.st[both], raymap.scene.picture.size
        return Error(
            against=self.against,
            sampled=int(lens.sum()),
            compared=int(both.sum()),
            differ=float(differs.sum() / max(int(lens.sum()), 1)),
            pixels=_quantiles(_largest(apart, size)),
            coordinates=_quantiles(_largest(apart, (1, 1))),
            floor=self.floor,
            unknown=float((~decided).sum() / max(int((lens | ~decided).sum()), 1)),
        )


def _sampled(columns: int, rows: int, cells: int) -> NDArray[np.intp]:
    """Return one pixel at a random place in every cell, so that no symmetry of a scene is hit again and again."""
    random = np.random.default_rng(_SEED)
    across, down = min(cells, columns), min(cells, rows)
    place = random.uniform(size=(2, down, across))
    row = ((np.arange(down)[:, None] + place[0]) * rows / down).astype(np.intp)
    column = ((np.arange(across) + place[1]) * columns / across).astype(np.intp)
    pixels: NDArray[np.intp] = (row * columns + column).ravel()
    return pixels


def _comparable(status: Any, events: Any, other_status: Any, other_events: Any) -> NDArray[np.bool_]:
    """Return which rays met a lens, and the picture's plane after as many events on both sides."""
    both: NDArray[np.bool_] = (events > 0) & (events == other_events)
    return both & np.isin(status, _LANDED) & np.isin(other_status, _LANDED)


def _largest(apart: Array, size: tuple[int, int]) -> Array:
    largest: Array = np.abs(apart * np.asarray(size, float)).max(axis=-1)
    return largest


def _quantiles(errors: Array) -> Quantiles:
    if not errors.size:
        return Quantiles(median=0.0, high=0.0, largest=0.0)
    middle, high, largest = np.quantile(errors, (0.5, 0.99, 1.0))
    return Quantiles(median=float(middle), high=float(high), largest=float(largest))


def _is_judged(lens: Lens) -> bool:
    """Whether signs along a ray follow from polynomials; asked of any one ray."""
    try:
        companion.first_roots(lens.surface.expression, lens.values, np.zeros((1, 3)), np.ones((1, 3)), 1.0)
    except LensclError:
        return False
    return True


def _judged_root(lens: Lens) -> Any:
    """Return a step for `reference.trace_rays`: first roots of one lens by companion matrices, then by signs of F."""

    def first_root(f: Any, origin: Array, direction: Array, length: Array, inside: Any, departs: Any, _: float) -> Any:
        t, found, undecided = np.zeros(len(length)), np.zeros(len(length), np.bool_), np.zeros(len(length), np.bool_)
        ahead = np.flatnonzero(length > 0)
        judged = companion.first_roots(
            lens.surface.expression, lens.values, origin[ahead], direction[ahead], length[ahead], departs=departs[ahead]
        )
        found[ahead], undecided[ahead] = judged.found, judged.undecided

        # The disc holds the root; its last bits are told by F, less what it is at a rounded start
        rays = ahead[judged.found]
        o, d, before = origin[rays], direction[rays], judged.before[judged.found]
        centre, radius = judged.t[judged.found], judged.radius[judged.found]
        low, high = np.maximum(centre - radius, 0.0), centre + radius
        at_start = np.where(departs[rays], f(o), 0.0)
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            is_before = before * (f(o + middle[:, None] * d) - at_start) > 0
            low, high = np.where(is_before, middle, low), np.where(is_before, high, middle)
        t[rays] = 0.5 * (low + high)
        return t, found, undecided | (inside & ~found)  # a ray in a solid leaves it

    return first_root
