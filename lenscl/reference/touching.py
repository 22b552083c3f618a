"""Contact of faces in certified answers: whether two surfaces that a ray meets one after the other are one interface.

Scenes are written in float64, so faces that are meant to coincide may be apart by roundings of their numbers.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lenscl.reference.crossing import UndecidableError
from lenscl.reference.vectors import cross, dot

if TYPE_CHECKING:
    from flint import arb

    from lenscl.reference.vectors import Vector

_CONTACT = 2.0**-48  # of the size of a lens and of its distance from the world's origin: nearer faces are in contact
_GAP = 2.0**-44  # and there is a gap between those that are farther apart; in between it cannot be told
_PARALLEL = 1e-7  # sine of the angle between normals of faces in contact


@dataclass(frozen=True, slots=True)
class Met:
    """The surfaces that a ray meets next, in contact with each other.

    Attributes
    ----------
    lenses : frozenset of int
        Their numbers.
    nearest : int
        The lens whose surface is the first of them.
    t : arb
        Distance along the ray to that surface.
    point, normal : Vector
        World; on that surface, and of it: outward, of any length.
    size : arb
        Of that lens, in scene units.
    places : mapping of int to Vector
        Where each of the surfaces is met, in its lens's own space.
    """

    lenses: frozenset[int]
    nearest: int
    t: arb
    point: Vector
    normal: Vector
    size: arb
    places: Mapping[int, Vector]

    def touches(self, t: arb, normal: Vector, direction: Vector) -> bool:
        """Say whether a surface that the ray meets at `t`, with this normal, is in contact with the nearest.

        Raises
        ------
        UndecidableError
            If the surfaces are neither in contact nor apart, or are met within contact at an edge.
        """
        size = abs(dot(self.point, self.point)).upper().sqrt() + self.size
        cosine = abs(dot(direction, self.normal)) / dot(self.normal, self.normal).sqrt()
        gap = abs(t - self.t) * cosine
        if gap > _GAP * size:
            return False
        if not gap < _CONTACT * size:
            raise UndecidableError("two surfaces are met at places that are neither in contact nor apart")
        across = cross(self.normal, normal)
        if not dot(across, across) < _PARALLEL**2 * dot(self.normal, self.normal) * dot(normal, normal):
            raise UndecidableError("the ray meets an edge that two solids share")
        return True
