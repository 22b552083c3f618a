"""Squares of the film in which an outline of a lens may lie, as seen from the source: by interval bounds, not by rays.

Input: a scene. Output: squares of the film. Outside them, neighbouring straight rays from the source meet each lens
equally often.

A straight ray p + t d meets the surface of a solid F <= 0 where F = 0. From ray to ray, the number of these roots
changes only at an outline: a place where F = 0 and the slope along the ray, grad F . d, is 0, too. This follows from
the implicit function theorem, since a solid lies inside its box. The box of a lens is bisected repeatedly. A part is
discarded if no ray of the film meets it, if interval bounds exclude F = 0 in it, or if they exclude that the slope is 0
in it. The parts that are left are projected from the source onto the film.

For an F that jumps, bounds of the slope exclude nothing; where bounds of F are unknown, they exclude nothing either.
Parts are bisected no further than the size asked for. `_MOST_OPERATIONS` limits their number: beyond that, squares that
are larger stay marked.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Group, Lens, Scene
from lenscl.expr import Expr, bounds, build, gradient, jumps, symbol
from lenscl.expr.graph import walk
from lenscl.tracing.numbers import parallel_source
from lenscl.tracing.placement import Placement

_MOST_OPERATIONS = 2.0e7  # on all parts of all lenses together: some two or three seconds
_TOGETHER = 2**14  # parts that are looked at at a time
_PAD = 1e-7  # of the film, by which squares are wider: single precision takes a ray astray by less
_ROUNDING = 2.0**-45  # relative, of places in a lens's own space
_TINY = 1e-9  # of a lens's box: a part that is still wide surrounds the source
_NEAR = 1e-9  # of the film's distance: nearer to the source a place has no direction to speak of
_CORNERS = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)]) * 2.0 - 1.0
_OF_PARTS = ("middles", "halves", "origin", "way")
_WAY = ("way_x", "way_y", "way_z")  # direction of the rays at x, y, z, in the lens's own space

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class _Parts:
    """Parts of the boxes of a lens, or of an array's, in which outlines may lie; arrays of N parts, shape (N, 3).

    A place in the lens's own space is taken to columns, rows and distance, all by that, by `onto`, shape (3, 3), and by
    adding `origin`. The direction of rays there is `way`, and changes with the place by `turns`, shape (3,).
    """

    lens: Lens
    placement: Placement
    slope: Expr | None  # along a ray; None where it says nothing
    onto: Array
    turns: Array
    operations: int  # of bounds on a part
    middles: Array
    halves: Array
    origin: Array
    way: Array

    @property
    def some(self) -> Iterator[_Parts]:
        """Yield them, so many at a time."""
        for first in range(0, len(self.middles), _TOGETHER):
            yield self.of(slice(first, first + _TOGETHER))

    def of(self, some: Any) -> _Parts:
        """Return some of them."""
        return replace(self, **{name: getattr(self, name)[some] for name in _OF_PARTS})

    def bisected(self) -> _Parts:
        """Return each of them cut in two across its longest side."""
        axis = (self.halves * np.linalg.norm(self.placement.to_world, axis=0)).argmax(axis=1)
        step = np.where(np.arange(3) == axis[:, None], self.halves / 2.0, 0.0)
        middles, halves = np.concatenate([self.middles - step, self.middles + step]), self.halves - step
        origin, way = (np.concatenate([each, each]) for each in (self.origin, self.way))
        return replace(self, middles=middles, halves=np.concatenate([halves, halves]), origin=origin, way=way)

    def on_film(self, film: tuple[int, int]) -> tuple[Array, Array, Mask]:
        """Return the least and the largest (column, row) that they cover, and whether rays of the film may meet them.

        A part that reaches the source's distance may cover any place of the film.
        """
        size = np.array(film, dtype=np.float64)
        middles, halves = self.middles @ self.onto.T + self.origin, self.halves[:, None] * self.onto
        corners = np.stack([middles + halves @ signs for signs in _CORNERS])
        places, ahead = corners[..., :2], corners[..., 2:]
        nearest, farthest = ahead.min(axis=0), ahead.max(axis=0)
        with np.errstate(all="ignore"):
            seen = places / ahead
            low, high = seen.min(axis=0), seen.max(axis=0)
            pad = _PAD * (size + np.abs(low) + np.abs(high))
        low, high = np.where(nearest > _NEAR, low - pad, -1.0), np.where(nearest > _NEAR, high + pad, size + 1.0)

        # The sides of the light's pyramid; behind the source they go on, the other way round
        slack = _PAD * size * np.maximum(np.abs(nearest), np.abs(farthest))
        beyond = (places.max(axis=0) < -slack) | ((places - size * ahead).min(axis=0) > slack)
        meets = (low < size) & (high > 0.0) & ~beyond
        return low, high, (farthest[:, 0] > -_NEAR) & meets[:, 0] & meets[:, 1]

    def may_have_outline(self) -> Mask:
        """Say of each whether bounds leave room for a place with F = 0 where F does not change along the ray."""
        halves = self.halves * (1.0 + _ROUNDING) + _ROUNDING * np.abs(self.middles)
        ranges: dict[str, Any] = {name: (value, value) for name, value in self.lens.values.items()}
        ranges |= {
            name: (self.middles[:, i] - halves[:, i], self.middles[:, i] + halves[:, i]) for i, name in enumerate("xyz")
        }
        low, high = bounds(self.lens.surface.expression, ranges)
        keeps: Mask = (low <= 0.0) & (high >= 0.0)
        if self.slope is None:
            return keeps
        way = self.way + self.turns * self.middles
        wide = self.turns * halves + _ROUNDING * (np.abs(self.way) + np.abs(way))
        ranges |= {name: (way[:, i] - wide[:, i], way[:, i] + wide[:, i]) for i, name in enumerate(_WAY)}
        ranges = {name: tuple(each[keeps] if np.ndim(each) else each for each in pair) for name, pair in ranges.items()}
        low, high = bounds(self.slope, ranges)
        keeps[keeps] = (low <= 0.0) & (high >= 0.0)
        return keeps


class Outlines:
    """Which squares of the film may have an outline of a lens in them.

    Parameters
    ----------
    scene : Scene
    """

    def __init__(self, scene: Scene) -> None:
        self.size = (scene.film.columns, scene.film.rows)
        self._left = _MOST_OPERATIONS
        self._scene = scene
        self._parts: list[_Parts] = []
        self._is_unknown = False  # where a part that rays meet cannot be told from all of the film
        self.finest = np.inf  # size of the smallest squares for which there were operations enough
        self._keys: dict[float, NDArray[np.int64]] = {}
        self._grid: Mask | None = None

    def pixels(self) -> Mask:
        """Return which film pixels may have an outline in them, shape (rows, columns)."""
        if self._grid is None:
            self._parts = [_kept(_whole(self._scene, group), self.size) for group in self._scene.lenses.groups]
            self._part(1.0)
            self.finest = 1.0
            columns, rows = self.size
            changes = np.zeros((rows + 1, columns + 1), np.int64)
            for low, high in self._squares(1.0):
                for sign, row, column in ((1, low, low), (-1, low, high), (-1, high, low), (1, high, high)):
                    np.add.at(changes, (row[:, 1], column[:, 0]), sign)
            self._grid = (changes.cumsum(axis=0).cumsum(axis=1)[:-1, :-1] > 0) | self._is_unknown
        return self._grid

    def among(self, at: Array, size: float) -> Mask:
        """Say which squares of the film may have an outline in them.

        Parameters
        ----------
        at : float64 array, shape (N, 2)
            Where they begin, (row, column) in film pixels.
        size : float
            Their side in film pixels: 1, 1/2, 1/4 and so on, asked for in this order.
        """
        grid = self.pixels()
        self.refine(size)
        finest = max(size, self.finest)
        row, column = np.floor(at / finest).astype(np.int64).T
        if finest == 1.0:
            return np.asarray(grid[row, column])
        keys = self._keys[finest]
        key = row * round(self.size[0] / finest) + column
        found: Mask = keys[np.minimum(np.searchsorted(keys, key), len(keys) - 1)] == key
        return found

    def refine(self, size: float) -> None:
        """Look at squares of a size, half that of the last ones, where there are operations enough for that."""
        if self._is_unknown or not size < self.finest <= 2.0 * size or not self._part(size):
            return
        columns, found = round(self.size[0] / size), [np.array([-1], np.int64)]
        for low, high in self._squares(size):
            wide = high - low
            for down in range(int(wide[:, 1].max(initial=0))):
                for right in range(int(wide[:, 0].max(initial=0))):
                    some = (wide[:, 1] > down) & (wide[:, 0] > right)
                    found.append(np.unique((low[some, 1] + down) * columns + low[some, 0] + right))
        self._keys[size] = np.unique(np.concatenate(found))
        self.finest = size

    def _squares(self, size: float) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """Yield the first squares that parts cover, and those behind the last, (column, row), shape (N, 2)."""
        most = np.array([round(each / size) for each in self.size])
        for lens in self._parts:
            for part in lens.some:
                low, high, _ = part.on_film(self.size)
                first = np.clip(np.floor(low / size), 0, most).astype(np.int64)
                yield first, np.clip(np.floor(high / size) + 1, 0, most).astype(np.int64)

    def _part(self, size: float) -> bool:
        """Part all lenses until their parts cover no more than a square each way; say if there was room for that."""
        for number, left in enumerate(self._parts):
            done: list[_Parts] = []
            while len(left.middles):
                is_wide = _is_wider(left, size, self.size)
                done.append(left.of(~is_wide))
                left = left.of(is_wide)
                is_tiny = (left.halves <= _TINY * np.abs(left.placement.box).max(axis=0)).all(axis=1)
                cost = 2.0 * len(left.middles) * left.operations
                self._is_unknown |= bool(is_tiny.any())
                if cost > self._left or self._is_unknown:
                    self._parts[number] = _together([*done, left])
                    return False
                self._left -= cost
                left = _kept(left.bisected(), self.size)
            self._parts[number] = _together([*done, left])
        return True


def _whole(scene: Scene, group: Group) -> _Parts:
    """Return the boxes of all copies of a lens, each as one part."""
    lens, film = group.lens, scene.film
    placement, surface = Placement.of(lens.solid), lens.surface.expression
    ways = [build("*", slope, symbol(way)) for slope, way in zip(gradient(surface), _WAY, strict=True)]
    slope = None if jumps(surface) else build("+", build("+", ways[0], ways[1]), ways[2])
    corner = np.asarray(film.corner, dtype=np.float64)
    if scene.source.at is None:
        direction, _ = parallel_source(scene)
        start, third, turns = corner, direction, np.zeros(3)
        way = np.broadcast_to(placement.to_local @ direction, (len(group), 3))
    else:
        start = np.asarray(scene.source.at, dtype=np.float64)
        third, turns, way = corner - start, np.ones(3), -placement.local(start - group.centres)
    spans = np.stack([np.asarray(film.right) / film.columns, np.asarray(film.down) / film.rows, third], axis=1)
    inverse = np.linalg.inv(spans)
    onto, origin = inverse @ placement.to_world, (group.centres - start) @ inverse.T
    if scene.source.at is None:
        onto[2], origin[:, 2] = 0.0, 1.0
    low, high = placement.box
    operations = sum(1 for _ in walk([surface] if slope is None else [surface, slope]))
    middles, halves = (np.tile(each, (len(group), 1)) for each in ((low + high) / 2, (high - low) / 2))
    return _Parts(lens, placement, slope, onto, turns, operations, middles, halves, origin, way)


def _kept(parts: _Parts, film: tuple[int, int]) -> _Parts:
    """Return the parts in which an outline may lie that rays of the film may meet."""
    found = [parts.of(slice(0, 0))]
    for some in parts.some:
        seen = some.of(some.on_film(film)[2])
        found.append(seen.of(seen.may_have_outline()))
    return _together(found)


def _is_wider(parts: _Parts, size: float, film: tuple[int, int]) -> Mask:
    """Say which parts cover more than a size in pixels."""
    found = [np.zeros(0, dtype=bool)]
    for some in parts.some:
        low, high, _ = some.on_film(film)
        found.append((high - low).max(axis=1) > size)
    return np.concatenate(found)


def _together(parts: Sequence[_Parts]) -> _Parts:
    joined: dict[str, Any] = {name: np.concatenate([getattr(each, name) for each in parts]) for name in _OF_PARTS}
    return replace(parts[0], **joined)
