"""Which pixels of a film are looked at closely: some of every kind, and always some of the hard ones.

Where a ray map changes abruptly, errors are largest and methods fail; such pixels are few, so a plain sample would miss
them. The film is split into strata, each is sampled by itself, and a weight says for how many pixels a ray stands.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.statistics import Strata
from lenscl.status import RayStatus
from lenscl.tracing import RayMap

# In order of precedence: a pixel belongs to the first that fits
MANY = "many"  # the most events
EDGE = "edge"  # beside a pixel that ends otherwise: silhouettes, and where total reflection sets in
STEEP = "steep"  # the map is stretched most: near the critical angle, grazing
LENS = "lens"  # other rays that meet a lens
FREE = "free"  # rays that meet none
STRATA = (MANY, EDGE, STEEP, LENS, FREE)
# With 600 plain rays the 99 % quantile has an upper bound that is not just the largest of them
USUAL: Mapping[str, int] = {MANY: 80, EDGE: 120, STEEP: 100, LENS: 600, FREE: 150}
_MANY, _STEEP = 0.98, 0.95  # quantiles, of the rays that meet a lens, from which on they count as such
_SEED = 20  # every run looks at the same pixels
_ALL, _BUT_LAST, _BUT_FIRST = slice(None), slice(None, -1), slice(1, None)
NEIGHBOURS = (((_BUT_LAST, _ALL), (_BUT_FIRST, _ALL)), ((_ALL, _BUT_LAST), (_ALL, _BUT_FIRST)))  # below; to the right
_LANDS = tuple(int(status) for status in RayStatus if status.lands)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sample:
    """Some pixels of a film.

    Attributes
    ----------
    pixels : int array, shape (N,)
        Numbers of pixels, row by row.
    drawn : Strata
        For how many pixels of the film each stands; strata are places in `STRATA`.
    sizes : tuple of int
        Pixels of the film in each stratum.
    """

    pixels: NDArray[np.intp] = field(repr=False)
    drawn: Strata = field(repr=False)
    sizes: tuple[int, ...]

    @classmethod
    def of(cls, raymap: RayMap, wanted: Mapping[str, int] = USUAL) -> Self:
        """Take so many pixels of each stratum of a map, or all where it has fewer."""
        kinds = strata(raymap).ravel()
        random = np.random.default_rng(_SEED)
        pixels, weights, stratum, sizes = [], [], [], []
        for place, name in enumerate(STRATA):
            members = np.flatnonzero(kinds == place)
            taken = random.choice(members, min(wanted[name], len(members)), replace=False)
            pixels.append(np.sort(taken))
            weights.append(np.full(len(taken), len(members) / max(len(taken), 1)))
            stratum.append(np.full(len(taken), place, np.uint8))
            sizes.append(len(members))
        return cls(
            pixels=np.concatenate(pixels),
            drawn=Strata(np.concatenate(weights), np.concatenate(stratum)),
            sizes=tuple(sizes),
        )

    def counts(self) -> dict[str, int]:
        """Return how many rays of each stratum are in it."""
        return {name: int(np.count_nonzero(self.drawn.stratum == place)) for place, name in enumerate(STRATA)}


def strata(raymap: RayMap) -> NDArray[np.uint8]:
    """Return each pixel's place in `STRATA`, shape (rows, columns)."""
    lands = np.isin(raymap.status, _LANDS)
    ends = raymap.events.astype(np.int32) * len(RayStatus) + np.where(lands, 0, raymap.status)
    edge = np.zeros(ends.shape, np.bool_)
    stretch = np.zeros(ends.shape)
    for here, there in NEIGHBOURS:
        differs = ends[here] != ends[there]
        edge[here] |= differs
        edge[there] |= differs
        apart = np.abs(raymap.st[here].astype(np.float64) - raymap.st[there]).max(axis=-1)
        apart = np.where(differs | ~lands[here], 0.0, apart)
        stretch[here], stretch[there] = np.maximum(stretch[here], apart), np.maximum(stretch[there], apart)

    lens = raymap.events > 0
    kinds = np.where(lens, STRATA.index(LENS), STRATA.index(FREE)).astype(np.uint8)
    if lens.any():
        kinds[lens & (stretch > np.quantile(stretch[lens], _STEEP))] = STRATA.index(STEEP)
    kinds[edge] = STRATA.index(EDGE)
    if lens.any():
        usual, most = np.quantile(raymap.events[lens], (0.5, _MANY))
        kinds[lens & (raymap.events >= most) & (raymap.events > usual)] = STRATA.index(MANY)
    return kinds
