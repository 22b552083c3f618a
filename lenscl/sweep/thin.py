"""Parts of a lens that are thinner than a film pixel, as the film sees them: rays pass beside them, unseen.

A user's expression is taken apart where it is the least of several, as a union of solids is, and each part is put into
a box of its own: its bounds are cut into slices along each axis in turn, and the outer ones dropped where interval
arithmetic proves that F is not below 0. What is thin askew in such a box, or within a part, is not found.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens, Scene
from lenscl.expr import Expr, creased, evaluate
from lenscl.expr import bounds as bounds_of
from lenscl.expr.graph import build, walk
from lenscl.lenses import Box
from lenscl.sweep.boxes import enclosed, value_at
from lenscl.sweep.view import is_in_view, on_film
from lenscl.tracing import Placement

Array = NDArray[np.float64]

Triple = tuple[float, float, float]

_RING = 64  # places on a torus's ring
_MOST_LEAVES = 16  # that an expression is taken apart into
_MOST_PARTS = 16
_MOST_OPERATIONS = 500  # of all parts together: a tenth of a second or two
_SLICES = 64  # along an axis
_ROUNDS = 4  # of slicing along all three
_PLACES = 9  # along each side of a part's box


def thinnest(scene: Scene, lens: Lens) -> float | None:
    """Return how wide a lens is at its thinnest, in film pixels, None where that is not in view.

    The thinnest way across its box, or those of the parts of an expression, as the film sees it; of a torus also its
    tube, wherever the film looks at it.
    """
    placement = Placement.of(lens)
    boxes = [placement.corners()]
    if lens.surface.promised is not None:
        values = tuple(sorted(lens.values.items()))
        local = _parts(lens.surface.expression, values, lens.surface.promised)
        boxes += [placement.centre + _corners(*box) @ placement.to_world.T for box in local]
    widths = [_across(scene, box) for box in boxes]
    return min((width for width in (*widths, _tube(scene, lens)) if width is not None), default=None)


def _across(scene: Scene, box: Array) -> float | None:
    """Return the least width of a box with these corners in the world, None where it is not in view."""
    corners = on_film(scene, box)
    low, high = corners.min(axis=0), corners.max(axis=0)
    if not ((high >= 0.0) & (low <= np.array(scene.film.size))).all():  # nor where a corner is NaN
        return None
    # Of a convex figure the least width lies across one of its sides
    first, second = np.triu_indices(len(corners), 1)
    sides = corners[second] - corners[first]
    lengths = np.linalg.norm(sides, axis=1)
    sides = sides[lengths > 0.0] / lengths[lengths > 0.0, None]
    widths = np.ptp(corners @ np.stack([-sides[:, 1], sides[:, 0]]), axis=0)
    return float(widths.min()) if len(widths) else 0.0


@lru_cache(maxsize=1024)  # a sweep of anything else asks for the same solid at every point
def _parts(expression: Expr, values: tuple[tuple[str, float], ...], bounds: Box) -> tuple[Box, ...]:
    """Return boxes about the parts of a solid, but for those that are not seen to stand out of the others."""
    joined, leaves = creased(expression, _MOST_LEAVES)
    given, parts = dict(values), _united(joined)
    own = [{str(each.name): leaves[str(each.name)] for each in walk([part]) if each.op == "symbol"} for part in parts]
    if sum(1 for some in own for _ in walk(some.values())) > _MOST_OPERATIONS:
        return ()
    low, high = (np.asarray(corner, dtype=np.float64) for corner in bounds)
    found: list[Box] = []
    for number, part in enumerate(parts):
        tight = _tightened(part, own[number], given, low, high)
        others = [other for k, other in enumerate(parts) if k != number]
        if tight is not None and _stands_out(part, others, leaves, given, *tight):
            found.append((_triple(tight[0]), _triple(tight[1])))
    return tuple(found)


def _united(joined: Expr) -> list[Expr]:
    """Return what a union's F is the least of: max(min(a, b), c) is min(max(a, c), max(b, c))."""
    if joined.op not in ("min", "max"):
        return [joined]
    first, second = (_united(arg) for arg in joined.args)
    if joined.op == "min":
        return [*first, *second]
    if len(first) * len(second) > _MOST_PARTS:
        return [joined]
    return [build("max", one, other) for one in first for other in second]


def _tightened(
    part: Expr, leaves: Mapping[str, Expr], given: Mapping[str, float], low: Array, high: Array
) -> tuple[Array, Array] | None:
    """Return the corners of a smaller box that holds all of a part, None where it is empty."""
    low, high = low.copy(), high.copy()
    for axis in (*range(3),) * _ROUNDS:
        edges = np.linspace(low[axis], high[axis], _SLICES + 1)
        lows, sides = np.tile(low, (_SLICES, 1)), np.tile(high - low, (_SLICES, 1))
        lows[:, axis], sides[:, axis] = edges[:-1], np.diff(edges)
        ranges = {name: enclosed(leaf, given, lows, sides) for name, leaf in leaves.items()}
        (kept,) = np.nonzero(bounds_of(part, ranges)[0] <= 0.0)
        if not len(kept):
            return None
        low[axis], high[axis] = edges[kept[0]], edges[kept[-1] + 1]
    return low, high


def _stands_out(
    part: Expr, others: Sequence[Expr], leaves: Mapping[str, Expr], given: Mapping[str, float], low: Array, high: Array
) -> bool:
    """Whether at some place of a box a part is, and no other."""
    unit = (np.stack(np.meshgrid(*[np.arange(_PLACES)] * 3), axis=-1).reshape(-1, 3) + 0.5) / _PLACES
    points = low + unit * (high - low)
    found = {name: value_at(leaf, given, points) for name, leaf in leaves.items()}
    alone = evaluate(part, found) < 0.0
    for other in others:
        alone &= ~(evaluate(other, found) < 0.0)
    return bool(alone.any())


def _corners(low: Triple, high: Triple) -> Array:
    return np.array(list(product(*zip(low, high, strict=True))))


def _triple(point: Array) -> Triple:
    x, y, z = (float(part) for part in point)
    return x, y, z


def _tube(scene: Scene, lens: Lens) -> float | None:
    if lens.surface.promised is not None or lens.surface.name != "torus":
        return None
    placement, R, r = Placement.of(lens), lens.values["R"], lens.values["r"]
    angles = 2.0 * np.pi * np.arange(_RING) / _RING
    zero, one = np.zeros(_RING), np.ones(_RING)
    outward = np.stack([np.cos(angles), np.sin(angles), zero], axis=1)
    around = np.stack([-np.sin(angles), np.cos(angles), zero], axis=1)
    up = np.stack([zero, zero, one], axis=1)
    ring = on_film(scene, placement.centre + R * outward @ placement.to_world.T)
    along, aside, above = (
        on_film(scene, placement.centre + (R * outward + r * way) @ placement.to_world.T) - ring
        for way in (around, outward, up)
    )
    # The tube's outline is that of the circle across it, measured across the ring
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
    with np.errstate(all="ignore"):
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        widths = 2.0 * np.hypot((aside * normal).sum(axis=1), (above * normal).sum(axis=1))
    seen = is_in_view(scene, ring) & np.isfinite(widths)
    return float(widths[seen].min()) if seen.any() else None
