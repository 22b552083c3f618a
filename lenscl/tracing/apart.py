"""Which solids of a scene are proved apart: no point lies in two of them, or on the surfaces of two.

Where two boxes overlap, the part that they share is cut into ever smaller cells, until bounds show of each cell that
one solid or the other is not in it. Solids that touch are never proved apart, nor are those with a gap finer than the
cells. Of many solids only those are looked at whose boxes and balls overlap, and any two that lie alike are looked at
once.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from functools import lru_cache
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens, Lenses
from lenscl.tracing.boxes import tree_of, world_boxes
from lenscl.tracing.filled import ball, may_hold, value
from lenscl.tracing.placement import Placement

MOST_PAIRS = 1000  # of solids that touch or overlap that are told; nobody reads more
_MOST_CELLS = 2**14  # that are left at a time; a face that two solids share is in more of them at every step
_MOST_STEPS = 40  # each halves every cell
_MARGIN = 1e-12  # of the lengths at hand: far more than mapping a cell to the other lens's space loses
_MANY = 256  # pairs of boxes that meet: of so many it pays to look at balls
_FIRST_ASK, _MOST_ASK, _AT_ONCE = 64, 2**14, 2**20  # solids whose neighbours are sought together, and pairs of boxes

Array = NDArray[np.float64]
Numbers = NDArray[np.intp]
_Place = tuple[int, int, int]  # of one solid to another, in whole steps of `_step`


def touching(lenses: Lenses | Sequence[Lens], some: Collection[int]) -> tuple[tuple[int, int], ...]:
    """Return the pairs, by number, of some of a scene's lenses whose solids may touch or overlap.

    Of very many pairs the first `MOST_PAIRS` that are found are returned.
    """
    of_all = Lenses.of(lenses)
    every = len(some) == len(of_all)
    return _touching(of_all.solids, None if every else tuple(sorted(some)))


@lru_cache(maxsize=64)
def _touching(solids: Lenses, some: tuple[int, ...] | None) -> tuple[tuple[int, int], ...]:
    if some is not None and len(some) == 2:
        return (some,) if may_touch(solids[some[0]], solids[some[1]]) else ()
    chosen = None if some is None else np.isin(np.arange(len(solids)), some)
    return tuple(sorted(islice(_pairs(solids, chosen), MOST_PAIRS)))


def may_touch(one: Lens, other: Lens) -> bool:
    """Return whether two solids may touch or overlap; False is proved."""
    solids = Lenses.of((one.solid, other.solid))
    between = np.array([other.centre]) - np.array([one.centre])
    far = np.array([max(np.abs(one.centre).max(), np.abs(other.centre).max())])
    return bool(_may_touch(solids[0], solids[1], between, far)[0])


def _pairs(solids: Lenses, chosen: NDArray[np.bool_] | None) -> Iterator[tuple[int, int]]:
    """Yield pairs of solids, of lower and higher number, that are not proved apart."""
    if len(solids) < 2:
        return
    (low, high), tree = world_boxes(solids), tree_of(solids)
    centres = np.concatenate([group.centres for group in solids.groups])
    far = np.abs(centres).max(axis=1)
    number_of: dict[Lens, int] = {}  # equal solids of several tables are one
    of_tables = [number_of.setdefault(group.lens.solid, len(number_of)) for group in solids.groups]
    shapes, shape = list(number_of), np.repeat(of_tables, [len(group) for group in solids.groups])
    first, count = 0, _FIRST_ASK
    while first < len(solids):
        asks, found = tree.meeting(low[first : first + count], high[first : first + count])
        first, asks = first + count, asks + first
        # As many at a time as memory allows, going by those before
        count = int(np.clip(_AT_ONCE * count / max(len(asks), 1), 1, min(_MOST_ASK, 4 * count)))
        later = found > asks
        asks, found = asks[later], found[later]
        if chosen is not None:
            both = chosen[asks] & chosen[found]
            asks, found = asks[both], found[both]
        if len(asks) > _MANY:
            near = _balls_meet(
                shapes, shape[asks], shape[found], centres[found] - centres[asks], far[asks] + far[found]
            )
            asks, found = asks[near], found[near]
        kinds = shape[asks] * len(shapes) + shape[found]
        for kind in np.unique(kinds).tolist():
            mine = np.flatnonzero(kinds == kind)
            one, other = asks[mine], found[mine]
            a, b = shapes[kind // len(shapes)], shapes[kind % len(shapes)]
            for part in range(0, len(mine), MOST_PAIRS):  # whoever has heard enough asks no further
                i, j = one[part : part + MOST_PAIRS], other[part : part + MOST_PAIRS]
                meets = _may_touch(a, b, centres[j] - centres[i], np.maximum(far[i], far[j]))
                yield from zip(i[meets].tolist(), j[meets].tolist(), strict=True)


def _balls_meet(shapes: Sequence[Lens], one: Numbers, other: Numbers, between: Array, far: Array) -> NDArray[np.bool_]:
    """Say of pairs of solids whether balls about them meet, given the places of the second to the first."""
    middles, radii = (np.array(each) for each in zip(*map(ball, shapes), strict=True))
    reach = radii[one] + radii[other] + 2.0 * _MARGIN * far
    return np.asarray(np.linalg.norm(between + middles[other] - middles[one], axis=1) <= reach)


def _may_touch(a: Lens, b: Lens, between: Array, far: Array) -> NDArray[np.bool_]:
    """Return whether a solid and another, in some places to it, may touch or overlap.

    Parameters
    ----------
    a, b : Lens
        Solids at the origin.
    between : float64 array, shape (N, 3)
        From the centre of the one to that of the other, in the world.
    far : float64 array, shape (N,)
        How far from the origin either may be.
    """
    # Places within a step of each other are one: what is proved of it is proved of all of them
    step = _step(a, b)
    scale = np.ceil(np.log2(np.maximum(far, step))).astype(np.int64)
    with np.errstate(over="ignore"):
        steps = np.round(between / step)
    places, which = np.unique(np.column_stack([steps, scale.astype(np.float64)]), axis=0, return_inverse=True)
    found = [not _apart(a, b, (int(x), int(y), int(z)), int(far_power)) for x, y, z, far_power in places.tolist()]
    return np.array(found, dtype=bool)[which.ravel()]


@lru_cache(maxsize=4096)
def _step(a: Lens, b: Lens) -> float:
    """Return a power of two, about `_MARGIN` of the size of the smaller of two solids."""
    return float(2.0 ** np.floor(np.log2(_MARGIN * min(Placement.of(a).diagonal(), Placement.of(b).diagonal()))))


@lru_cache(maxsize=2**16)
def _apart(a: Lens, b: Lens, place: _Place, far_power: int) -> bool:
    """Return whether solids are proved apart, the second standing in a place to the first, known to half a step."""
    here, there, step = Placement.of(a), Placement.of(b), _step(a, b)
    between = step * np.array(place, dtype=np.float64)
    corners = here.local(there.corners() + between)
    aside = np.abs(here.to_local).sum(axis=1) * step
    low, high = (
        np.maximum(here.box[0], corners.min(axis=0) - aside),
        np.minimum(here.box[1], corners.max(axis=0) + aside),
    )
    if not (low <= high).all():
        return True
    # From a's space to b's, and what that loses
    linear = there.to_local @ here.to_world
    offset = -(there.to_local @ between)
    lost = _MARGIN * (np.abs(there.to_local).sum(axis=1) * 2.0 ** (far_power + 1) + np.abs(there.box).max(axis=0))
    lost += np.abs(there.to_local).sum(axis=1) * step
    middles, halves = ((low + high) / 2)[None], ((high - low) / 2)[None] * (1.0 + _MARGIN)
    for turn in range(_MOST_STEPS):
        keeps = may_hold(a, middles, halves)
        middles, halves = middles[keeps], halves[keeps]
        mapped = middles @ linear.T + offset
        reach = halves @ np.abs(linear).T + lost
        keeps = ((mapped + reach >= there.box[0]) & (mapped - reach <= there.box[1])).all(axis=1)
        keeps[keeps] = may_hold(b, mapped[keeps], reach[keeps])
        middles, halves, mapped = middles[keeps], halves[keeps], mapped[keeps]
        if not len(middles):
            return True
        if len(middles) > _MOST_CELLS or ((value(a, middles) < 0.0) & (value(b, mapped) < 0.0)).any():
            return False
        axis = turn % 3
        halves[:, axis] /= 2
        moved = np.zeros_like(halves)
        moved[:, axis] = halves[:, axis]
        middles, halves = np.concatenate([middles - moved, middles + moved]), np.concatenate([halves, halves])
    return False
