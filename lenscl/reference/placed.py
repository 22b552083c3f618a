"""A lens of a scene in balls: its own space, its surface there, and where a ray meets it."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import reduce
from typing import TYPE_CHECKING, Any

from lenscl.config import Lens, Lenses
from lenscl.lenses import coat_functions
from lenscl.reference.crossing import first_crossing
from lenscl.reference.jets import Jet, contains_zero, jet
from lenscl.reference.vectors import minus, plus, times, turned, vector

if TYPE_CHECKING:
    from flint import arb

    from lenscl.reference.vectors import Vector

_BOX_MARGIN = 2.0**-10  # of a catalogue box's extent, as the solid must lie strictly inside


class PlacedLenses:
    """The lenses of a scene in balls, by number; each is made when it is asked for."""

    def __init__(self, lenses: Lenses) -> None:
        self._lenses = lenses
        self._made: dict[int, Placed] = {}

    def __getitem__(self, number: int) -> Placed:
        if number not in self._made:
            self._made[number] = Placed(self._lenses[number])
        return self._made[number]

    @property
    def looks(self) -> int:
        """How often F was looked at along rays, so far."""
        return sum(lens.looks for lens in self._made.values())


class Placed:
    """A lens and its own space, in balls."""

    def __init__(self, lens: Lens) -> None:
        from flint import arb

        self.expression = lens.surface.as_written
        self.values = {name: Jet(arb(value), (arb(0),) * 3) for name, value in lens.values.items()}
        self.along = {name: Jet(arb(value), (arb(0),)) for name, value in lens.values.items()}
        # Of its faces, the mirrored ones and the others; None where it has not both
        has_both = bool(lens.mirror) and not lens.is_mirror
        self.coats = coat_functions(lens.surface, lens.coated, as_written=True) if has_both else None
        self.looks = 0  # at F along rays, so far: what an answer costs
        self.centre, self.stretch = vector(lens.centre), vector(lens.stretch)
        self.turns = [_turn(axis, degrees) for axis, degrees in enumerate(lens.rotate)]
        margin = _BOX_MARGIN if lens.surface.promised is None else 0.0
        box = zip(*(lens.surface.promised or lens.surface.box(lens.values)), strict=True)
        self.box = [
            (arb(low) - margin * (arb(high) - low), arb(high) + margin * (arb(high) - low)) for low, high in box
        ]

    @property
    def size(self) -> arb:
        """Half the diagonal of the box in the world, at most."""
        from flint import arb

        half = [(high - low) / 2 * abs(by) for (low, high), by in zip(self.box, self.stretch, strict=True)]
        return sum((each**2 for each in half), arb(0)).sqrt()

    def vector_to_local(self, v: Vector) -> Vector:
        """Take a direction to the lens's own space; its length changes so that t does not."""
        for turn in reversed(self.turns):
            v = turned(zip(*turn, strict=True), v)
        x, y, z = (a / c for a, c in zip(v, self.stretch, strict=True))
        return x, y, z

    def point_to_local(self, p: Vector) -> Vector:
        """Take a point to the lens's own space."""
        return self.vector_to_local(minus(p, self.centre))

    def point_to_world(self, p: Vector) -> Vector:
        """Take a point to the world."""
        x, y, z = (a * c for a, c in zip(p, self.stretch, strict=True))
        return plus(reduce(lambda v, turn: turned(turn, v), self.turns, (x, y, z)), self.centre)

    def normal(self, slopes: Sequence[arb]) -> Vector:
        """Take a gradient to the world, not unit: by the inverse transpose."""
        x, y, z = (a / c for a, c in zip(slopes, self.stretch, strict=True))
        return reduce(lambda v, turn: turned(turn, v), self.turns, (x, y, z))

    def at(self, local: Vector) -> Jet:
        """Return F and its gradient at a local point."""
        from flint import arb

        sides = {
            name: Jet(p, tuple(arb(i == j) for j in range(3)))
            for i, (name, p) in enumerate(zip("xyz", local, strict=True))
        }
        return jet(self.expression, {**self.values, **sides})

    def on_mirror(self, local: Vector) -> int:
        """Return 1 where a surface point lies on a mirrored face, -1 where it lies on another one, 0 on an edge."""
        from flint import arb

        assert self.coats is not None, "asked of a lens that has both kinds of faces"
        at = {name: Jet(p, (arb(0),)) for name, p in zip("xyz", local, strict=True)}
        coat, rest = (jet(each, {**self.along, **at}).value for each in self.coats)
        return int(coat > rest) - int(coat < rest)

    def may_hold(self, local: Vector) -> bool:
        """Say whether a local point may lie in the bounding box."""
        return not any(p < low or p > high for p, (low, high) in zip(local, self.box, strict=True))

    def crossing(
        self, origin: Vector, direction: Vector, bits: int, *, departs: bool, inside: bool
    ) -> tuple[arb, Vector] | None:
        """Return the ray's t at its first crossing, and the local point there."""
        o, d = self.point_to_local(origin), self.vector_to_local(direction)
        enter, leave = self._span(o, d)
        begin = enter * 0 if departs or inside else enter
        if not leave > begin:
            return None
        start = o if departs or inside else plus(o, times(begin, d))

        def along(t: arb) -> Jet:
            self.looks += 1
            ray = {name: Jet(a + t * b, (b,)) for name, a, b in zip("xyz", start, d, strict=True)}
            return jet(self.expression, {**self.along, **ray})

        t = first_crossing(along, leave - begin, bits, departs=departs, side=-1 if inside else 1)
        return None if t is None else (begin + t, plus(start, times(t, d)))

    def _span(self, o: Vector, d: Vector) -> tuple[arb, arb]:
        """Return exact numbers between which the ray ahead is in the box: none of it is left out."""
        from flint import arb

        enter, leave = arb(0), arb(2) ** 200
        for p, v, (low, high) in zip(o, d, self.box, strict=True):
            if contains_zero(v):
                # Along the slab, or nearly: from outside it is far
                gap = low - p if p < low else p - high
                if gap > 0:
                    enter = enter.max(arb(2) ** 200 if v.is_zero() else (gap / abs(v).upper()).lower())
                continue
            a, b = (low - p) / v, (high - p) / v
            enter, leave = enter.max(a.min(b).lower()).mid(), leave.min(a.max(b).upper()).mid()
        return enter, leave


def _turn(axis: int, degrees: float) -> list[list[Any]]:
    """Return the rows of a right-handed turn about a coordinate axis."""
    from flint import arb, fmpq

    angle = Fraction(degrees) / 180
    sine, cosine = arb.sin_cos_pi_fmpq(fmpq(angle.numerator, angle.denominator))
    first, second = (axis + 1) % 3, (axis + 2) % 3
    rows = [[arb(i == j) for j in range(3)] for i in range(3)]
    rows[first][first] = rows[second][second] = cosine
    rows[first][second], rows[second][first] = -sine, sine
    return rows
