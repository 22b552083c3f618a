"""Certified first roots: the surface along a ray as an exact rational polynomial, its real roots as enclosures.

Input: one ray in a surface's own space, its float64 numbers taken as exact. Output: every root of F ahead of it, with
proved multiplicity, and the exact signs of F between. Nothing here rounds but the enclosures, and they say by how much.
Needs python-flint, from the extra `accuracy`; it is imported when the first ray is asked for. Its working precision
(`flint.ctx.prec`) is one for the process: ask from one thread at a time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise
from operator import mul
from typing import TYPE_CHECKING, Any

from lenscl.errors import LensclError
from lenscl.expr import Expr, parse
from lenscl.expr.graph import walk
from lenscl.lenses import Surface
from lenscl.reference.library import python_flint
from lenscl.reference.pieces import Piece, Tree, along, folded, leaves, shifted

if TYPE_CHECKING:
    from flint import arb, fmpq, fmpq_poly, fmpz_poly

_ACCURACY = 80  # bits: radius <= 2^-80 t
_FIRST_BITS, _MOST_BITS = 128, 1 << 20
_CONSTANT_BITS = 600  # of a cube root at the origin, where it has to be a rational number; see `first_root`
_INTEGER_CHOICE = {"min": min, "max": max}


@dataclass(frozen=True, slots=True, kw_only=True)
class Root:
    """A root of F ahead of the ray's origin.

    Attributes
    ----------
    t : flint.arb
        Encloses the root and no other, with a radius of at most 2^-80 t.
    multiplicity : int
        Of the polynomial that has the sign of F there. Where several pieces of a min or max vanish, the least of
        theirs: the edge of a cube may be touched with multiplicity 1, so `crosses` is decided by signs, not by this.
    before, after : int
        The exact signs of F on either side, up to the neighbouring roots; 0 where F is zero on that whole stretch.
    """

    t: arb
    multiplicity: int
    before: int
    after: int

    @property
    def crosses(self) -> bool:
        """Whether F changes sign; else the ray touches, or a stretch on which F is zero ends here."""
        return self.before * self.after < 0

    def encloses(self, t: Any) -> bool:
        """Say whether a rational number lies in the enclosure, exactly (`arb.contains` would round it first)."""
        low, high = _ends(self.t)
        return bool(low <= _exact(t) <= high)

    def distance(self, t: float) -> float:
        """Return an upper bound on |t - root| for a computed t, to float64; nothing cancels."""
        return float(abs(python_flint().arb(_exact(t)) - self.t).upper())


@dataclass(frozen=True, slots=True, kw_only=True)
class Certified:
    """What is proved of one ray.

    Attributes
    ----------
    roots : tuple of Root
        Every root in (0, length], in order.
    start : int
        The exact sign of F just after t = 0; 0 where F is zero on a whole stretch there.
    inside : bool
        As asked: whether the ray travels in the solid.
    """

    roots: tuple[Root, ...]
    start: int
    inside: bool

    @property
    def crossing(self) -> Root | None:
        """The first root at which F changes sign; of a polynomial, of odd multiplicity."""
        return next((root for root in self.roots if root.crosses), None)

    @property
    def touch(self) -> Root | None:
        """The first root at which F keeps its sign, if it comes before the crossing; of a polynomial, an even one."""
        for root in self.roots:
            if root.crosses:
                return None
            if root.before * root.after > 0:
                return root
        return None

    @property
    def holds(self) -> bool:
        """Whether F has the ray's sign all the way to the crossing but for touches: > 0 outside, < 0 inside."""
        side = -1 if self.inside else 1
        for root in self.roots:
            if root.before != side:
                return False
            if root.crosses:
                return True
        return self.start == side and all(root.after == side for root in self.roots)


def first_root(
    expression: Expr,
    values: Mapping[str, float],
    origin: Sequence[float],
    direction: Sequence[float],
    length: float,
    *,
    departs: bool = False,
    inside: bool = False,
) -> Certified:
    """Prove where one ray meets a surface.

    Parameters
    ----------
    expression : Expr
        F in x, y, z and parameters: polynomials, abs, min and max of them, and sums with one cube root.
    values : mapping of str to float
        The parameters.
    origin, direction : three numbers
        The ray `origin + t direction` in the surface's own space; the direction need not be unit.
    length : float
        Roots are sought for 0 < t <= length; scene units if `direction` is unit in the world.
    departs : bool
        The origin is a rounded point of the surface; see Notes.
    inside : bool
        The ray travels in the solid. This changes nothing but `Certified.holds`.

    Returns
    -------
    Certified

    Raises
    ------
    LensclError
        If no polynomial decides the sign of F along the ray, a number is not finite, or python-flint is missing or
        broken.

    Notes
    -----
    All numbers (floats, integers, fractions) are taken as exact rationals, so the polynomial along the ray is exact.

    The known root of a ray that departs is removed by asking for the roots of `(F(t) - F(0)) / t`: the constant term
    is dropped and t divided out, so that the root at 0 is exact, and gone. This moves the surface to the level set
    through the rounded origin, by a rounding error; the same constant is taken from every piece of a min or max. Where
    F holds a cube root, F(0) is rounded to 600 bits and what that leaves of the constant term is dropped too.

    Roots: squarefree parts are isolated by `fmpz_poly.complex_roots` (certified, the bits doubled until every real root
    stands apart and is known to 2^-80); signs between roots and multiplicities come from exact evaluation at rationals.
    """
    flint = python_flint()
    kind = _Exact()
    numbers = {name: kind.number(value) for name, value in values.items()}
    ray = {name: flint.fmpq_poly([_exact(o), _exact(d)]) for name, o, d in zip("xyz", origin, direction, strict=True)}
    tree = along(expression, {**numbers, **ray}, kind)
    followed = _departed(tree) if departs else [piece.same_sign() for piece in leaves(tree)]
    pieces = [polynomial.numer() for polynomial in followed]  # over a positive denominator: the same signs
    ends, gaps = _isolated(pieces, _exact(length))

    def sign_between(k: int) -> int:
        return folded(tree, [_sign(piece(gaps[k])) for piece in pieces], _INTEGER_CHOICE)

    factors = [piece.factor_squarefree()[1] if piece.degree() >= 0 else [] for piece in pieces]
    before = start = sign_between(0)
    roots = []
    for k, t in enumerate(ends):
        after = sign_between(k + 1)
        orders = [_multiplicity(factor, gaps[k], gaps[k + 1]) for factor in factors]
        here = [0 if order else _sign(piece(gaps[k])) for order, piece in zip(orders, pieces, strict=True)]
        is_root = folded(tree, here, _INTEGER_CHOICE) == 0
        if is_root and (before or after):  # within a stretch on which F is zero no point is worth a name
            roots.append(Root(t=t, multiplicity=min(o for o in orders if o), before=before, after=after))
        before = after
    return Certified(roots=tuple(roots), start=start, inside=inside)


def sign_polynomial(surface: Surface) -> Expr | None:
    """Return an expression without roots that has the sign of a surface's F everywhere.

    Returns
    -------
    Expr or None
        A polynomial in x, y and z, or min, max and abs of polynomials: F itself where it is one. For the heart the
        sextic `A^3 - z^3 (0.1 x^2 + y^2)`, of the same number 0.1 as F. For the torus the quartic alone, which is
        right for r <= R only: of a spindle it has the inner sheet too, and F, min(quartic, A), must be used.
        None where there is none, as for the superellipsoid, or none is known, as for the conic singlet.

    Notes
    -----
    Where rays depart, `first_root` should be given the heart's F, not this: taking F(0) from the sextic splits its
    triple root on the equator z = 0, and some rays that start there then have a root within rounding of their origin.
    """
    if surface.promised is None and surface.name in _EQUIVALENT:
        return parse(_EQUIVALENT[surface.name], ["x", "y", "z", *(each.name for each in surface.parameters)])
    allowed = {"number", "symbol", "+", "-", "neg", "*", "/", "power", "min", "max", "abs"}
    choices: set[Expr] = set()  # what holds a min, max or abs
    for each in walk([surface.as_written]):
        if each.op not in allowed or (each.op == "/" and each.args[1].depends_on("xyz")):
            return None
        chosen = [arg for arg in each.args if arg in choices]
        if chosen or each.op in ("min", "max", "abs"):
            choices.add(each)
        others = [arg for arg in each.args if arg is not chosen[0] and arg.depends_on("xyz")] if chosen else []
        if chosen and (each.op == "power" or (each.op == "*" and (others or len(chosen) > 1))):
            return None  # a product's sign is not the choice's where the other factor changes its own
    return surface.as_written


_EQUIVALENT = {
    "torus": "(x^2 + y^2 - R^2 + (z^2 - r^2))^2 + 4*R^2*(z^2 - r^2)",
    "heart": "(2*x^2 + 2*y^2 + z^2 - 1)^3 - z^3*(0.1*x^2 + y^2)",
}


class _Exact:
    """Polynomials over the rationals, as `pieces.Kind`."""

    def number(self, value: float) -> fmpq_poly:
        polynomial: fmpq_poly = python_flint().fmpq_poly([_exact(value)])
        return polynomial

    def sign(self, p: fmpq_poly) -> int | None:
        return _sign(p[0]) if p.degree() <= 0 else None

    def quotient(self, p: fmpq_poly, constant: fmpq_poly) -> fmpq_poly:
        return p / constant[0]


def _exact(value: Any) -> fmpq:
    try:
        flint = python_flint()
        rational: fmpq = value if isinstance(value, flint.fmpq) else flint.fmpq(*value.as_integer_ratio())
    except (OverflowError, ValueError):
        raise LensclError(f"a ray and its parameters must be finite numbers, got {value!r}") from None
    return rational


def _sign(value: Any) -> int:
    return int(value > 0) - int(value < 0)


def _departed(tree: Tree[fmpq_poly]) -> list[fmpq_poly]:
    """Return the sign polynomials of F(t) - F(0), the known root divided out where a piece has it."""
    flint = python_flint()
    at_origin = [_constant(piece) for piece in leaves(tree)]
    level = folded(tree, at_origin, _INTEGER_CHOICE)
    moved = leaves(shifted(tree, flint.fmpq_poly([level])))
    polynomials = []
    for piece, value in zip(moved, at_origin, strict=True):
        polynomial = piece.same_sign()
        if value == level:  # divide by t > 0, which changes no sign ahead
            polynomial = flint.fmpq_poly(polynomial.coeffs()[1:])
        polynomials.append(polynomial)
    return polynomials


def _constant(piece: Piece[fmpq_poly]) -> fmpq:
    """Return a piece's value at t = 0; that of a cube root to 600 bits, exact where it is 0."""
    if piece.root is None:
        return piece.u[0]
    flint = python_flint()
    v, w = piece.root
    with flint.ctx.workprec(_CONSTANT_BITS):
        size = flint.arb(abs(w[0])).root(3)
        root = _middle(size) * _sign(w[0])
    value: fmpq = piece.u[0] + v[0] * root
    return value


def _isolated(pieces: Sequence[fmpz_poly], length: fmpq) -> tuple[list[arb], list[fmpq]]:
    """Isolate the roots in (0, length] of a product.

    Returns
    -------
    roots : list of arb
        In order, disjoint, each to 2^-80 of itself.
    gaps : list of fmpq
        One more rational numbers, > 0: gap k lies between root k - 1 and root k, and between their other neighbours.
    """
    flint = python_flint()
    product = reduce(mul, [piece for piece in pieces if piece.degree() >= 0], flint.fmpz_poly([1]))
    while product[0] == 0:  # a root at 0 is not ahead
        product = flint.fmpz_poly(product.coeffs()[1:])
    simple = product // product.gcd(product.derivative())  # every root once
    bits = _FIRST_BITS
    while bits <= _MOST_BITS:
        with flint.ctx.workprec(bits):
            real = [root.real for root, _ in simple.complex_roots() if root.imag == 0]
        ahead = sorted((_ends(t) for t in real if _ends(t)[1] > 0), key=lambda pair: pair[0])
        apart = all(a[1] < b[0] for a, b in pairwise(ahead))
        if apart and all(low > 0 and (high - low) * 2**_ACCURACY <= low for low, high in ahead):
            break
        bits *= 2
    else:
        raise LensclError(f"two roots along a ray lie too close to be told apart by {_MOST_BITS} bits")

    middles = [(a[1] + b[0]) / 2 for a, b in pairwise(ahead)]
    gaps = [ahead[0][0] / 2, *middles, ahead[-1][1] + 1] if ahead else [flint.fmpq(1)]
    within = [_reaches(simple, low, high, length) for low, high in ahead]
    with flint.ctx.workprec(bits + 64):
        roots = [_ball(low, high) for (low, high), near in zip(ahead, within, strict=True) if near]
    return roots, gaps


def _reaches(simple: fmpz_poly, low: fmpq, high: fmpq, length: fmpq) -> bool:
    """Say whether the only root in [low, high], a simple one, is at most `length`."""
    if high <= length or low > length:
        return bool(high <= length)
    at_low, at_length = _sign(simple(low)), _sign(simple(length))
    return at_low * at_length <= 0


def _multiplicity(factors: Sequence[tuple[fmpz_poly, int]], low: fmpq, high: fmpq) -> int:
    """Return the multiplicity of the only root between two rationals, 0 if this polynomial has none there."""
    return next((order for factor, order in factors if _sign(factor(low)) != _sign(factor(high))), 0)


def _ends(ball: arb) -> tuple[fmpq, fmpq]:
    middle, radius = _middle(ball), _middle(ball.rad())
    return middle - radius, middle + radius


def _middle(ball: arb) -> fmpq:
    flint = python_flint()
    mantissa, exponent = (int(part) for part in ball.mid().man_exp())
    rational: fmpq = flint.fmpq(mantissa) * flint.fmpq(2) ** exponent
    return rational


def _ball(low: fmpq, high: fmpq) -> arb:
    flint = python_flint()
    ball: arb = flint.arb(low).union(flint.arb(high))
    return ball
