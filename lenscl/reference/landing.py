"""The picture in certified answers: where a ray meets its plane, and whether the picture ends the ray there.

Input: a ray in balls of python-flint, and the surfaces that it meets next. Output: balls about the distance and the
picture coordinates, or the reason why they cannot be told.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from lenscl.config import Picture
from lenscl.reference.crossing import UndecidableError
from lenscl.reference.jets import contains_zero
from lenscl.reference.vectors import cross, dot, minus, times, vector
from lenscl.status import RayStatus

if TYPE_CHECKING:
    from flint import arb

    from lenscl.reference.touching import Met
    from lenscl.reference.vectors import Vector

_FARTHEST = 10**30  # |s| or |t| beyond are BEHIND


@dataclass(frozen=True, slots=True)
class Place:
    """Where a ray meets the picture's plane: the distance along the ray, and the picture coordinates there."""

    distance: arb
    s: arb
    t: arb

    @property
    def status(self) -> RayStatus | None:
        """How a ray ends that lands here; None where the ball lies on an edge of the picture."""
        if self.distance < 0 or abs(self.s) > _FARTHEST or abs(self.t) > _FARTHEST:
            return RayStatus.BEHIND
        if self.is_within:
            return RayStatus.PICTURE
        return RayStatus.OFF_PICTURE if self.is_outside else None

    @property
    def is_within(self) -> bool:
        """Whether the place is proved to lie on the picture's parallelogram."""
        return all(x >= 0 and x < 1 for x in (self.s, self.t))

    @property
    def is_outside(self) -> bool:
        """Whether the place is proved to lie beside it."""
        return any(x < 0 or x >= 1 for x in (self.s, self.t))

    @property
    def radius(self) -> float:
        """The larger radius of the picture coordinates, rounded up."""
        return max(float(each.rad().upper()) for each in (self.s, self.t)) * (1 + 2.0**-50)


class Plane:
    """The plane of a picture."""

    def __init__(self, picture: Picture) -> None:
        self.corner, self.right, self.down = map(vector, (picture.corner, picture.right, picture.down))
        self.normal = cross(self.right, self.down)

    def place(self, origin: Vector, direction: Vector) -> Place | None:
        """Return where a ray meets the plane, ahead of it or behind it; None where the two are parallel."""
        toward = minus(self.corner, origin)
        falls = dot(self.normal, direction)
        if falls.is_zero():
            return None
        if contains_zero(falls):
            raise UndecidableError("the ray is parallel to the picture, or nearly so")
        distance = dot(self.normal, toward) / falls
        point = minus(times(distance, direction), toward)
        square = dot(self.normal, self.normal)
        s, t = dot(cross(point, self.down), self.normal) / square, dot(cross(self.right, point), self.normal) / square
        return Place(distance, s, t)

    def ends(self, origin: Vector, direction: Vector, met: Met) -> bool:
        """Say whether the ray meets the picture before what it meets next, or on a face that lies on the picture.

        Raises
        ------
        UndecidableError
            If that hangs on more bits, or on rounding of the scene's numbers: at an edge of the picture, where the ray
            starts on the plane, and where the picture and a face are neither in contact nor apart.
        """
        place = self.place(origin, direction)
        if place is None or place.distance < 0 or place.is_outside:
            return False
        if not place.distance < met.t and not met.touches(place.distance, self.normal, direction):
            return False
        if not place.distance > 0:
            raise UndecidableError("the ray starts on the picture's plane")
        if not place.is_within:
            raise UndecidableError("the ray meets an edge of the picture")
        return True
