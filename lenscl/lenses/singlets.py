"""Lenses of two faces and a rim about the z axis: how far they reach, and whether the faces make a lens.

The face of a vertex at z = v is z = v + sag(r). The vertices lie at z = -thickness / 2 (front) and z = thickness / 2
(back), the rim at r = diameter / 2. A curvature is positive where its centre lies towards greater z: the sign that lens
design programs give it for light along z.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from lenscl.lenses.solid import Box, Problem, Values

_PLACES = 128  # where a face that may rise and fall is looked at first; an even asphere turns four times at most
_THIRDS = 60  # steps that narrow a bracket by 2/3 each, to 3e-11 of it: its least value is then exact to rounding
_ROUNDING = 16 * 2.0**-52  # relative, of what is compared here: a dozen operations


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
    keys : str
        The parameters that bend it, as a message calls them.
    """

    c: float
    k: float = 0.0
    even: tuple[float, float, float] = (0.0, 0.0, 0.0)
    keys: str = ""

    def sag(self, r: float) -> float:
        """Return z over the vertex, c r^2 / (1 + sqrt(1 - (1 + k) c^2 r^2)) and the even terms, for r <= `reach`."""
        q = r * r
        root = math.sqrt(max(1.0 - (1.0 + self.k) * self.c * self.c * q, 0.0))
        a4, a6, a8 = self.even
        return self.c * q / (1.0 + root) + q * q * (a4 + q * (a6 + q * a8))

    @property
    def reach(self) -> float:
        """The radius where the conic ends, upright; infinite for a plane, a paraboloid and a hyperboloid."""
        bend = abs(self.c) * math.sqrt(max(1.0 + self.k, 0.0))
        return 1.0 / bend if bend > 0.0 else math.inf

    @property
    def is_conic(self) -> bool:
        """Whether it has no even terms; then it rises, or falls, all the way to the rim."""
        return not any(self.even)


Faces = Callable[[Values], tuple[Face, Face]]  # from a row's values to its front and back


@dataclass(frozen=True, slots=True)
class SingletBox:
    """The tight box of a lens of two faces, `thickness` and `diameter`, for values within its rules."""

    faces: Faces

    def __call__(self, values: Values) -> Box:
        """Return the lowest and the highest corner."""
        front, back = self.faces(values)
        rim, half = 0.5 * values["diameter"], 0.5 * values["thickness"]
        low = _least(front.sag, rim, monotone=front.is_conic) - half
        high = half - _least(lambda r: -back.sag(r), rim, monotone=back.is_conic)
        return (-rim, -rim, low), (rim, rim, high)


@dataclass(frozen=True, slots=True)
class SingletRules:
    """What keeps two faces from making a lens: a conic that ends before the rim, or faces that cross."""

    faces: Faces

    def __call__(self, values: Values) -> Iterator[Problem]:
        """Yield (key, what is wrong); of faces that end, no more is told."""
        front, back = self.faces(values)
        diameter, thickness = values["diameter"], values["thickness"]
        rim = 0.5 * diameter
        face = min(front, back, key=lambda each: each.reach)
        if rim > face.reach * (1.0 + _ROUNDING):
            yield (
                "diameter",
                f"must be at most {_spelled(2.0 * face.reach, up=False)}, where the face of {face.keys} ends, "
                f"got {diameter!r}; lower it, or bend that face less",
            )
            return

        def apart(r: float) -> float:  # of the faces, but for the thickness
            return back.sag(r) - front.sag(r)

        # The slope of two spheres' distance, r (c2 / root2 - c1 / root1), changes no sign: they need no search
        are_spheres = front.is_conic and back.is_conic and front.k == back.k == 0.0
        needed = -_least(apart, rim, monotone=are_spheres)
        size = abs(front.sag(rim)) + abs(back.sag(rim)) + thickness
        if needed > thickness + _ROUNDING * size:
            yield (
                "thickness",
                f"must be at least {_spelled(needed, up=True)}, or the faces cross before the rim, got {thickness!r}; "
                "raise it, or lower diameter",
            )


def _least(of: Callable[[float], float], end: float, *, monotone: bool) -> float:
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


def _spelled(value: float, *, up: bool) -> str:
    """Spell a limit in six digits, on its permitted side."""
    text = f"{value:.6g}"
    if float(text) < value if up else float(text) > value:
        text = f"{value * (1 + 5e-6 if up else 1 - 5e-6):.6g}"
    return text
