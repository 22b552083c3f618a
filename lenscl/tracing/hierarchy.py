"""A hierarchy of boxes over many solids, as kernels/boxes.cl walks it.

Each node's solids are halved by their middles along the longest extent of these, until one is left. All nodes of one
level are made at a time, so 100,000 solids take 17 turns.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

# A box is made larger on every side by so many roundings of its coordinates: its corners, by the affine map, the rays'
# origins on surfaces, and the solids as the kernel has them, in its precision, err by less
_MARGIN = 64.0
_LEAST = 1e-30  # and by so much, scene units: a difference to a face is then never too small for a number

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Hierarchy:
    """Boxes in boxes.

    Attributes
    ----------
    boxes : float array, shape (N, 6)
        Lowest and highest corner of each node's box, world, scene units; the first node holds all.
    links : int32 array, shape (N, 2)
        Of each node its first child, the second being the next node, or ~number of its only solid; and the axis along
        which the first child has the lower middles, plus 4 times the number of its wide node, which is -1 for none.
    wide_boxes : float array, shape (M, 6, W)
        Of each wide node the boxes that lie some levels below its node: the lowest x of all, and so on. Those beyond
        the last lie at infinity.
    wide_links : int32 array, shape (M, W)
        Of each of them its own wide node, or ~number of its only solid; of those at infinity of some solid.
    """

    boxes: NDArray[np.floating[Any]] = field(repr=False)
    links: NDArray[np.int32] = field(repr=False)
    wide_boxes: NDArray[np.floating[Any]] = field(repr=False)
    wide_links: NDArray[np.int32] = field(repr=False)


def hierarchy_of(
    low: Array, high: Array, numbers: NDArray[np.intp], dtype: type[np.floating[Any]], levels: int = 0
) -> Hierarchy:
    """Return the hierarchy of some boxes.

    Parameters
    ----------
    low, high : float64 array, shape (N, 3)
        Corners of boxes that hold a solid each, N at least 1.
    numbers : int array, shape (N,)
        Of the solids.
    dtype : type
        numpy.float32 or numpy.float64: of the boxes, which are rounded outwards.
    levels : int
        That a wide node spans, so that it has W = 2^levels boxes; 0 for none.
    """
    low, high = _outwards(low, high, dtype)
    middles = low + (high - low) / 2
    solids, sizes = np.arange(len(low)), np.array([len(low)])  # node by node of a level
    boxes, links, made = [], [], 0
    starts = []  # of the levels
    while sizes.size:
        starts.append(made)
        made += len(sizes)
        begins = np.cumsum(sizes) - sizes
        lowest, highest = np.minimum.reduceat(low[solids], begins), np.maximum.reduceat(high[solids], begins)
        boxes.append(np.hstack([lowest, highest]))
        ends = sizes == 1
        extent = np.maximum.reduceat(middles[solids], begins) - np.minimum.reduceat(middles[solids], begins)
        axis = extent.argmax(axis=1)
        children = made + 2 * (np.cumsum(~ends) - 1)
        links.append(np.where(ends, [~numbers[solids[begins]], 0 * axis], [children, axis]).T)

        # Halve what is left
        node = np.repeat(np.arange(len(sizes)), sizes)
        goes_on = ~ends[node]
        solids, node = solids[goes_on], node[goes_on]
        solids = solids[np.lexsort((middles[solids, axis[node]], node))]
        halved = sizes[~ends]
        sizes = np.stack([(halved + 1) // 2, halved // 2], axis=1).ravel()
    every, tree = np.concatenate(boxes), np.concatenate(links)
    wide_of, wide_boxes, wide_links = _wide(every, tree[:, 0], starts, levels)
    tree[:, 1] += 4 * wide_of
    return Hierarchy(every.astype(dtype), tree.astype(np.int32), wide_boxes.astype(dtype), wide_links.astype(np.int32))


def _wide(
    boxes: Array, firsts: NDArray[np.intp], starts: list[int], levels: int
) -> tuple[NDArray[np.intp], Array, NDArray[np.intp]]:
    """Return the number of each node's wide node, and the boxes and links of these.

    Wide nodes stand so many levels apart that the last of them reach the leaves: all of them are nearly full.
    """
    wide_of = np.full(len(boxes), -1)
    if not levels:
        return wide_of, np.empty((0, 6, 1)), np.empty((0, 1), np.intp)
    own = np.zeros(len(boxes), bool)
    for level in range((len(starts) - 1) % levels, len(starts) - 1, levels):
        own[starts[level] : starts[level + 1]] = True
    roots = np.flatnonzero(own & (firsts >= 0))
    wide_of[roots] = np.arange(len(roots))
    below = roots[:, np.newaxis]
    for _ in range(levels):
        first = np.where(below >= 0, firsts[below], -1)
        below = np.stack([np.where(first >= 0, first, below), np.where(first >= 0, first + 1, -1)], axis=-1)
        below = below.reshape(len(roots), 2 * first.shape[1])
    held = np.where((below >= 0)[..., np.newaxis], boxes[below], np.inf)
    links = np.where(firsts[below] < 0, firsts[below], wide_of[below])
    some_lens = firsts[firsts < 0][0]  # what a ray that is no number meets at infinity must be an end
    return wide_of, held.transpose(0, 2, 1), np.where(below >= 0, links, some_lens)


def world_boxes(to_world: Array, centre: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Return the lowest and highest corners in the world of boxes in the spaces of lenses, all of shape (N, 3).

    Parameters
    ----------
    to_world : float64 array, shape (N, 3, 3)
    centre, low, high : float64 array, shape (N, 3)
        As of `Placement`.
    """
    middle = centre + np.einsum("nij,nj->ni", to_world, low + (high - low) / 2)
    half = np.einsum("nij,nj->ni", np.abs(to_world), (high - low) / 2)
    return middle - half, middle + half


def _outwards(low: Array, high: Array, dtype: type[np.floating[Any]]) -> tuple[Array, Array]:
    """Return corners that are numbers of a precision, farther out by the margin."""
    scale = np.maximum(np.abs(low), np.abs(high)).max(axis=1, keepdims=True)
    slack = _MARGIN * float(np.finfo(dtype).eps) * scale + _LEAST
    far = dtype(np.inf)
    lower, higher = np.nextafter((low - slack).astype(dtype), -far), np.nextafter((high + slack).astype(dtype), far)
    return lower.astype(np.float64), higher.astype(np.float64)
