"""Between which media a traced ray meets a surface, and which lens's surface that is.

Where solids are proved apart that is the lens met and what is around, in turn. Else the medium is looked up where the
ray has it beyond doubt: in the middle of a leg, along which no medium changes, whatever surfaces lie on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.selfcheck.hits import Hits, Tolerance, hits_of
from lenscl.config import Lenses, Scene
from lenscl.tracing import holding, locate_sets, touching

Array = NDArray[np.float64]

_PLACES = (0.5, 0.375, 0.625, 0.25, 0.75)  # of a leg: where its medium is looked up, the first that lies on no surface
_ACROSS = 2.0**10  # roundings of a point: so far behind it the medium is looked up where no leg leads there


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Meeting:
    """A ray at a surface.

    Attributes
    ----------
    lens : int
        Whose surface it is; of two in contact, that of the medium before.
    before, behind : int or None
        The lenses that are the media on the incident side and beyond the surface; None around all lenses.
    leaves : bool
        Whether the ray comes from inside that lens's solid.
    cemented : bool
        Whether it is the surface of both media's lenses.
    hits : Hits
        What is known of the lens there, in row `row`.
    """

    lens: int
    before: int | None
    behind: int | None
    leaves: bool
    cemented: bool
    hits: Hits
    row: int

    def n_before(self, scene: Scene) -> float:
        """Return the index on the incident side."""
        return _index(scene, self.before)

    def n_behind(self, scene: Scene) -> float:
        """Return the index beyond the surface."""
        return _index(scene, self.behind)


class Media(Protocol):
    """The media of one ray."""

    def meeting(self, row: int, *, leaves: bool) -> Meeting:
        """Return what is met at a surface point; `leaves` says whether the ray comes from inside a solid, if apart."""
        ...


def media_of(scene: Scene, points: Array, directions: Array, end: Array | None, eps: float) -> Media:
    """Return the media of a ray, from its start and surface points, shape (N + 1, 3), and the directions behind each.

    Parameters
    ----------
    scene : Scene
    points, directions : float64 array, shape (N + 1, 3)
        World; directions unit.
    end : float64 array, shape (3,), optional
        A place that the last leg leads to.
    eps : float
        Of the precision that the ray was carried in.
    """
    tolerance = Tolerance.of(scene, eps)
    if not touching(scene.lenses, range(len(scene.lenses))):
        return _Apart(hits_of(scene, points[1:], eps, tolerance))
    alone = [replace(scene, lenses=Lenses.of([lens])) for lens in scene.lenses]
    each = [hits_of(one, points[1:], eps, Tolerance.of(one, eps)) for one in alone]
    return _Nested(scene, points, directions, end, eps, each)


def starts_in(scene: Scene, start: Array, direction: Array) -> tuple[int, ...]:
    """Return the lenses whose solids a ray starts in, lowest priority first; on a surface, it is in what it enters."""
    eps, found = float(np.finfo(np.float64).eps), []
    inside, on = (set(each) for each in holding(scene, start.tolist()))
    for number in scene.by_priority() if inside or on else ():
        is_in = number in inside
        if number in on and not is_in:
            alone = replace(scene, lenses=Lenses.of([scene.lenses[number]]))
            hits = hits_of(alone, start[None], eps, Tolerance())
            is_in = bool(hits.normal[0, int(np.argmin(hits.turn[0]))] @ direction < 0.0)
        if is_in:
            found.append(number)
    return tuple(found)


class _Apart:
    def __init__(self, hits: Hits) -> None:
        self._hits = hits

    def meeting(self, row: int, *, leaves: bool) -> Meeting:
        lens = int(self._hits.lens[row])
        before, behind = (lens, None) if leaves else (None, lens)
        return Meeting(
            lens=lens, before=before, behind=behind, leaves=leaves, cemented=False, hits=self._hits, row=row
        )  # fmt: skip


class _Nested:
    def __init__(
        self, scene: Scene, points: Array, directions: Array, end: Array | None, eps: float, each: Sequence[Hits]
    ) -> None:
        self._scene, self._points, self._directions, self._eps, self._each = scene, points, directions, eps, each
        legs = [self._on_leg(*ends) for ends in pairwise(points)]
        last = self._ahead(len(points) - 1, directions[-1]) if end is None else self._on_leg(points[-1], end)
        self._media = [*legs, last]

    def meeting(self, row: int, *, leaves: bool) -> Meeting:
        before, behind = self._media[row], self._media[row + 1]
        if before == behind:  # it is reflected, and no leg leads to the other side
            behind = self._ahead(row + 1, self._directions[row])
        ranks = {lens: self._rank(lens, row) for lens in (before, behind) if lens is not None}
        if before == behind or not ranks:  # thinner than can be told
            nearest = min(range(len(self._each)), key=lambda lens: self._rank(lens, row))
            before, behind = (before, None) if before == nearest else (before, nearest)
            ranks = {nearest: 0.0}
        lens = min(ranks, key=ranks.__getitem__)
        cemented = len(ranks) == 2 and all(rank <= 1.0 for rank in ranks.values())
        if cemented and before is not None:
            lens = before
        return Meeting(
            lens=lens, before=before, behind=behind, leaves=lens == before, cemented=cemented, hits=self._each[lens],
            row=row,
        )  # fmt: skip

    def _rank(self, lens: int, row: int) -> float:
        """Return |F| of a lens in terms of its bound: at most 1 where the point lies on its surface."""
        value, bound = float(self._each[lens].value[row]), float(self._each[lens].bound[row])
        return value / bound if np.isfinite(value) and np.isfinite(bound) and bound > 0.0 else 1e300 * (value != 0.0)

    def _on_leg(self, start: Array, end: Array) -> int | None:
        return self._medium(start + np.array(_PLACES)[:, None] * (end - start))

    def _ahead(self, row: int, direction: Array) -> int | None:
        point = self._points[row]
        reach = np.abs(point).sum() + max(float(np.abs(lens.centre).max()) for lens in self._scene.lenses)
        return self._medium((point + _ACROSS * self._eps * reach * direction)[None])

    def _medium(self, places: Array) -> int | None:
        """Return the lens that is the medium at the first place that lies on no surface."""
        inside, on = locate_sets(self._scene, places)
        chosen = int(inside[int(np.argmin(on != 0))])
        return self._scene.by_priority()[chosen.bit_length() - 1] if chosen else None


def _index(scene: Scene, lens: int | None) -> float:
    return scene.n_medium if lens is None else scene.lenses[lens].n
