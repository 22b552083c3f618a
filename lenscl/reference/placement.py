"""Twin of kernels/placement.cl: a lens's own space, by turning vectors one axis after another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Placement:
    """How a lens stands: stretched, then turned about the fixed axes x, y, z, then moved."""

    centre: Array  # shape (3,), scene units
    stretch: Array  # shape (3,)
    rotate: Array  # shape (3,), radians

    @classmethod
    def of(cls, lens: Lens) -> Placement:
        """Return the placement of a scene's lens."""
        return cls(np.array(lens.centre, float), np.array(lens.stretch, float), np.radians(lens.rotate))

    def point_to_local(self, world: Array) -> Array:
        """Return points, shape (N, 3), in the lens's space."""
        return self.vector_to_local(world - self.centre)

    def vector_to_local(self, world: Array) -> Array:
        """Return directions, shape (N, 3), in the lens's space; their length changes so that t does not."""
        v = world
        for axis in (2, 1, 0):
            v = _turn(v, axis, -self.rotate[axis])
        return v / self.stretch

    def point_to_world(self, local: Array) -> Array:
        """Return points, shape (N, 3), in the world."""
        v = local * self.stretch
        for axis in (0, 1, 2):
            v = _turn(v, axis, self.rotate[axis])
        return v + self.centre

    def normal_to_world(self, gradient: Array) -> Array:
        """Return gradients, shape (N, 3), as world vectors along the normal: by the inverse transpose."""
        v = gradient / self.stretch
        for axis in (0, 1, 2):
            v = _turn(v, axis, self.rotate[axis])
        return v


def _turn(v: Array, axis: int, angle: float) -> Array:
    """Turn vectors right-handedly about a coordinate axis."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    c, s = np.cos(angle), np.sin(angle)
    turned = v.copy()
    turned[..., first] = c * v[..., first] - s * v[..., second]
    turned[..., second] = s * v[..., first] + c * v[..., second]
    return turned
