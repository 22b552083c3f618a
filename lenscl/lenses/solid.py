"""What a surface is: an implicit function with parameters, its bounding box and its rules."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass

from lenscl.expr import Expr, degree, digest
from lenscl.expr.joined import polynomial_leaves
from lenscl.expr.planar import Plane, planes_of

Vec3 = tuple[float, float, float]
Box = tuple[Vec3, Vec3]  # lowest and highest corner, lens-local coordinates
Values = Mapping[str, float]
_MOST_DEGREE = 8  # beyond, the terms at a box's far side, 4^degree times F, drown what F is near the surface
Problem = tuple[str, str]  # the key of the lens table, what is wrong


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A number that shapes a surface.

    Attributes
    ----------
    name : str
        As it stands in the lens table and in the expression; case matters.
    default : float
        Its value where none is given.
    low, high : float
        The range, ends included, but `low` not when `low_open`.
    meaning : str
        What it is, in a few words.
    """

    name: str
    default: float
    low: float
    high: float
    low_open: bool = False
    meaning: str

    def problem(self, value: float) -> str | None:
        """Say what is wrong with a value, or None."""
        if not math.isfinite(value):
            return f"must be a finite number, got {value!r}"
        if value > self.high or value < self.low or (self.low_open and value == self.low):
            return f"must be {self.range_text()}, got {value!r}"
        return None

    def range_text(self) -> str:
        """Say the range, as in `more than 0 and at most 2`."""
        low = f"more than {self.low:g}" if self.low_open else f"at least {self.low:g}"
        return f"{low} and at most {self.high:g}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Surface:
    """A solid F(x, y, z) <= 0 in lens-local coordinates; F < 0 inside, its gradient points outward.

    Attributes
    ----------
    name : str
        Its name in the catalogue, or `"expression"` for a user's own.
    expression : Expr
        F in x, y, z and the parameters, in its best-conditioned form.
    parameters : tuple of Parameter
    summary, formula, source : str
        One line on it; the formula as printed in books (a user's expression as written); where that comes from.
    written : Expr or None
        F as the user wrote it, where `expression` is another one of the same sign. Proofs are about `as_written`.
    polynomial : Expr or None
        A polynomial in x, y, z of the same sign as F, where F itself is none.
    holds : callable or None
        Whether `polynomial` has F's sign for these parameter values; None: always.
    extent : callable
        From the parameters' values to the tight box of F <= 0; see `box`.
    rules : callable or None
        From values that are each in range to (key, what is wrong) for those that do not go together.
    promised : Box or None
        For a user's expression the bounds that were given with it.
    is_convex : bool
        Whether the solid is convex for all values: a ray that has left it never meets it again.
    optional : tuple of Parameter
        Parameters that may be left out, and then are not in `parameters` and not in the code.
    with_optional : callable or None
        From the names of some of them to the surface that has these.
    by_planes : bool
        Whether a solid of flat faces is searched by its planes; else by its leaves, as any other.
    variant : str
        What tells surfaces of one name apart that have different code; empty where there is one.
    given_as : str
        The key of a lens table that holds the parameters as a list; empty where each has a key of its own.
    faces : tuple of (str, Expr)
        The faces that a mirror may name, each a function that is negative on its inner side; their `max` has F's sign.
        Empty where a catalogue surface is one face, and for solids of planes and expressions: see `face_functions`.
    plane_names : tuple of str
        Of a solid of planes, the face that each of its planes belongs to; empty where they are numbered.
    """

    name: str
    expression: Expr
    parameters: tuple[Parameter, ...] = ()
    summary: str
    formula: str
    source: str
    written: Expr | None = None
    polynomial: Expr | None = None
    holds: Callable[[Values], bool] | None = None
    extent: Callable[[Values], Box] | None = None
    rules: Callable[[Values], Iterator[Problem]] | None = None
    promised: Box | None = None
    is_convex: bool = False
    optional: tuple[Parameter, ...] = ()
    with_optional: Callable[[Collection[str]], Surface] | None = None
    by_planes: bool = True
    variant: str = ""
    given_as: str = ""
    faces: tuple[tuple[str, Expr], ...] = ()
    plane_names: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """Identity of the structure: surfaces of equal keys have the same generated code."""
        if self.promised is None:
            return f"{self.name}_{self.variant}" if self.variant else self.name
        names = " ".join(parameter.name for parameter in self.parameters)
        return f"{self.name}_{hashlib.sha256(f'{digest(self.expression)} {names}'.encode()).hexdigest()[:16]}"

    @property
    def keys(self) -> tuple[str, ...]:
        """The parameters that have a key of their own in a lens table."""
        every = dict.fromkeys(parameter.name for parameter in (*self.parameters, *self.optional))
        return () if self.given_as else tuple(every)

    @property
    def planes(self) -> tuple[Plane, ...]:
        """The planes a x + b y + c z = d of a convex polyhedron's faces, as (a, b, c, d); empty for other solids."""
        return planes_of(self.expression) if self.by_planes else ()

    @property
    def polynomial_leaves(self) -> tuple[Expr, ...]:
        """The polynomials of which F is max and min; empty where F is not so, or is searched as a whole."""
        return () if self.planes or self.polynomial_form is not None else polynomial_leaves(self.expression)

    @property
    def as_written(self) -> Expr:
        """F as it was given, before any form of the same sign was taken: with every number as it stands there."""
        return self.expression if self.written is None else self.written

    def sign_polynomial(self, values: Values) -> Expr | None:
        """Return a polynomial in x, y, z that has F's sign everywhere, for these parameter values, if one is known."""
        return self.polynomial_form if self.holds is None or self.holds(values) else None

    @property
    def polynomial_form(self) -> Expr | None:
        """F itself where it is a polynomial in x, y, z of a degree that can be searched as one, else `polynomial`."""
        found = degree(self.expression, "xyz")
        return self.expression if found is not None and found <= _MOST_DEGREE else self.polynomial

    @property
    def degree(self) -> int | None:
        """The degree in which F is searched as a polynomial, 2 at least; None where it is not."""
        form = self.polynomial_form
        found = None if form is None else degree(form, "xyz")
        return None if found is None else max(found, 2)

    def box(self, values: Values) -> Box:
        """Return the smallest box that holds F <= 0, for these parameter values, in local coordinates.

        A catalogue surface's is widened by 1e-6 of its size, more than the rounding of single precision, so that no
        point of the surface lies on a face. A user's is as promised, or what a polyhedron fills of that.
        """
        if self.promised is not None:
            return self._filled(self.promised, values) if self.planes else self.promised
        assert self.extent is not None
        low, high = self.extent(values)
        margin = 1e-6 * max(b - a for a, b in zip(low, high, strict=True))
        return _moved(low, -margin), _moved(high, margin)

    def _filled(self, promised: Box, values: Values) -> Box:
        """Return the part of its bounds that a polyhedron fills, widened as a catalogue surface's box is."""
        from lenscl.lenses.planes import solid_of  # numpy, which reading a study need not wait for

        wrong, (low, high) = solid_of(self.planes, tuple(sorted(values.items())))
        if wrong:
            return promised
        margin = 1e-6 * max(b - a for a, b in zip(low, high, strict=True))
        lows = (max(a - margin, b) for a, b in zip(low, promised[0], strict=True))
        highs = (min(a + margin, b) for a, b in zip(high, promised[1], strict=True))
        (x, y, z), (u, v, w) = lows, highs
        return ((x, y, z), (u, v, w)) if x < u and y < v and z < w else promised

    def problems(self, values: Values) -> Iterator[Problem]:
        """Yield (key, what is wrong) for every rule that the values break.

        Keys are parameter names, or `bounds` where F <= 0 is found on a face of a user's bounds: a solid that reaches
        out of them would be cut off without a surface there.
        """
        broken = False
        for parameter in self.parameters:
            wrong = parameter.problem(values[parameter.name])
            if wrong is not None:
                broken = True
                yield parameter.name, wrong
        if broken:
            return
        if self.rules is not None:
            yield from self.rules(values)
        if self.promised is not None:
            from lenscl.lenses.faces import face_problem  # numpy, which reading a study need not wait for

            wrong = face_problem(self.expression, values, self.promised, self.formula)
            if wrong is not None:
                yield "bounds", wrong


def _moved(corner: Vec3, by: float) -> Vec3:
    x, y, z = corner
    return x + by, y + by, z + by
