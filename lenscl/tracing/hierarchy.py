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
        Of each node its first child, the second being the next node, and the axis along which the first has the lower
        middles; or ~number of its only solid, and 0.
    """

    boxes: NDArray[np.floating[Any]] = field(repr=False)
    links: NDArray[np.int32] = field(repr=False)


def hierarchy_of(low: Array, high: Array, numbers: NDArray[np.intp], dtype: type[np.floating[Any]]) -> Hierarchy:
    """Return the hierarchy of some boxes.

    Parameters
    ----------
    low, high : float64 array, shape (N, 3)
        Corners of boxes that hold a solid each, N at least 1.
    numbers : int array, shape (N,)
        Of the solids.
    dtype : type
        numpy.float32 or numpy.float64: of the boxes, which are rounded outwards.
    """
    low, high = _outwards(low, high, dtype)
    middles = low + (high - low) / 2
    solids, sizes = np.arange(len(low)), np.array([len(low)])  # node by node of a level
    boxes, links, made = [], [], 0
    while sizes.size:
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
    return Hierarchy(np.concatenate(boxes).astype(dtype), np.concatenate(links).astype(np.int32))


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
