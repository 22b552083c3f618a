"""Lenses of two faces and a rim about the z axis: how far they reach, and whether the faces make a lens.

The face of a vertex at z = v is z = v + sag(r). The vertices lie at z = -thickness / 2 (front) and z = thickness / 2
(back), the rim at r = diameter / 2. A curvature is positive where its centre lies towards greater z: the sign that lens
design programs give it for light along z.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from lenscl.lenses.rows import spelled
from lenscl.lenses.solid import Box, Problem, Values

_PLACES = 128  # where a face that may rise and fall is looked at first; an asphere of r^20 turns twenty times at most
_THIRDS = 60  # steps that narrow a bracket by 2/3 each, to 3e-11 of it: its least value is then exact to rounding
ROUNDING = 16 * 2.0**-52  # relative, of what is compared here: a dozen operations


@dataclass(frozen=True, slots=True, kw_only=True)
class Face:
    """One face: a conic and even terms.

    Attributes
    ----------
    c : float
        Curvature at the vertex.
    k : float
        Conic constant: 0 a sphere, -1 a paraboloid, less a hyperboloid, more an ellipsoid.
    even : tuple of float
        A4, A6, A8 of the terms A4 r^4 + A6 r^6 + A8 r^8 that are added to the conic.
    terms : tuple of (int, float)
        Powers and coefficients of further such terms.
    keys : str
        The parameters that bend it, as a message calls them.
    """

    c: float
    k: float = 0.0
    even: tuple[float, float, float] = (0.0, 0.0, 0.0)
    terms: tuple[tuple[int, float], ...] = ()
    keys: str = ""

    def sag(self, r: float) -> float:
        """Return z over the vertex, c r^2 / (1 + sqrt(1 - (1 + k) c^2 r^2)) and the even terms, for r <= `reach`."""
        q = r * r
        root = math.sqrt(max(1.0 - (1.0 + self.k) * self.c * self.c * q, 0.0))
        a4, a6, a8 = self.even
        more = sum(value * r**power for power, value in self.terms)
        return self.c * q / (1.0 + root) + q * q * (a4 + q * (a6 + q * a8)) + more

    @property
    def reach(self) -> float:
        """The radius where the conic ends, upright; infinite for a plane, a paraboloid and a hyperboloid."""
        bend = abs(self.c) * math.sqrt(max(1.0 + self.k, 0.0))
        return 1.0 / bend if bend > 0.0 else math.inf

    @property
    def is_conic(self) -> bool:
        """Whether it has no terms; then it rises, or falls, all the way to the rim."""
        return not any(self.even) and not any(value for _, value in self.terms)


Faces = Callable[[Values], tuple[Face, Face]]  # from a row's values to its front and back


@dataclass(frozen=True, slots=True)
class SingletBox:
    """The tight box of a lens of two faces and `thickness`, for values within its rules.

    Attributes
    ----------
    faces : callable
    across : str
        The key of its size across, along which the faces are bent.
    along : str
        That of its size along x where it is rectangular and its faces are bent along y only.
    """

    faces: Faces
    across: str = "diameter"
    along: str = "diameter"

    def __call__(self, values: Values) -> Box:
        """Return the lowest and the highest corner."""
        front, back = self.faces(values)
        rim, side, half = 0.5 * values[self.across], 0.5 * values[self.along], 0.5 * values["thickness"]
        low = least(front.sag, rim, monotone=front.is_conic) - half
        high = half - least(lambda r: -back.sag(r), rim, monotone=back.is_conic)
        return (-side, -rim, low), (side, rim, high)


@dataclass(frozen=True, slots=True)
class SingletRules:
    """What keeps two faces from making a lens: a conic that ends before the rim, or faces that cross.

    `across` is the key of the size along which the faces are bent.
    """

    faces: Faces
    across: str = "diameter"

    def __call__(self, values: Values) -> Iterator[Problem]:
        """Yield (key, what is wrong); of faces that end, no more is told."""
        front, back = self.faces(values)
        diameter, thickness = values[self.across], values["thickness"]
        rim = 0.5 * diameter
        face = min(front, back, key=lambda each: each.reach)
        if rim > face.reach * (1.0 + ROUNDING):
            yield (
                self.across,
                f"must be at most {spelled(2.0 * face.reach, up=False)}, where the face of {face.keys} ends, "
                f"got {diameter!r}; lower it, or bend that face less",
            )
            return

        def apart(r: float) -> float:  # of the faces, but for the thickness
            return back.sag(r) - front.sag(r)

        # The slope of two spheres' distance, r (c2 / root2 - c1 / root1), changes no sign: they need no search
        are_spheres = front.is_conic and back.is_conic and front.k == back.k == 0.0
        needed = -least(apart, rim, monotone=are_spheres)
        size = abs(front.sag(rim)) + abs(back.sag(rim)) + thickness
        if needed > thickness + ROUNDING * size:
            yield (
                "thickness",
                f"must be at least {spelled(needed, up=True)}, or the faces cross before the rim, got {thickness!r}; "
                f"raise it, or lower {self.across}",
            )


def least(of: Callable[[float], float], end: float, *, monotone: bool) -> float:
    """Return the least value of a smooth function on [0, end]: of the best of some places, closed in on."""
    if monotone:
        return min(of(0.0), of(end))
    places = [end * i / _PLACES for i in range(_PLACES)] + [end]
    best = min(range(_PLACES + 1), key=lambda i: of(places[i]))
    low, high = places[max(best - 1, 0)], places[min(best + 1, _PLACES)]
    for _ in range(_THIRDS):
        third = (high - low) / 3.0
        if of(low + third) < of(high - third):
            high -= third
        else:
            low += third
    return min(of(places[best]), of(low))
