"""A surface along a ray as pieces whose signs are signs of polynomials: what the judges of first roots work on.

Input: an expression and the ray's x, y, z as polynomials in t, of any kind that adds and multiplies. Output: a tree of
`min` and `max` over pieces `u + v cbrt(w)`, each of which has the sign of the polynomial `u^3 + v^3 w` (of `u` where
there is no cube root). So the sign of the whole is known from signs of polynomials alone, by `folded`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar, cast

from lenscl.errors import LensclError
from lenscl.expr import Expr
from lenscl.expr.graph import walk

P = TypeVar("P")  # polynomials in t of some kind, with + - * and unary -
V = TypeVar("V")

_MOST_PIECES = 64  # of sums of abs, min and max; each sum multiplies their number
_OPPOSITE = {"min": "max", "max": "min"}


class Kind(Protocol[P]):
    """What is asked of a kind of polynomial beside its operators."""

    def number(self, value: float) -> P:
        """Make a constant polynomial."""

    def sign(self, p: P) -> int | None:
        """Return the sign of a polynomial that is constant, None for one that is not."""

    def quotient(self, p: P, constant: P) -> P:
        """Divide by a constant polynomial, not 0."""


@dataclass(frozen=True, slots=True)
class Piece(Generic[P]):
    """`u + v cbrt(w)`, or `u` alone where `root` is None."""

    u: P
    root: tuple[P, P] | None = None  # v, w

    def same_sign(self) -> P:
        """Return the polynomial that has the sign of this piece for every t: cbrt is odd and rises."""
        u: Any = self.u
        if self.root is None:
            return self.u
        v, w = cast(tuple[Any, Any], self.root)
        return cast(P, u * u * u + v * v * v * w)


@dataclass(frozen=True, slots=True)
class Choice(Generic[P]):
    """`min` or `max` of two trees."""

    op: str
    parts: tuple[Tree[P], Tree[P]]


Tree = Piece[P] | Choice[P]


def leaves(tree: Tree[P]) -> Iterator[Piece[P]]:
    """Yield the pieces, left to right."""
    if isinstance(tree, Piece):
        yield tree
    else:
        for part in tree.parts:
            yield from leaves(part)


def folded(tree: Tree[P], values: Sequence[V], by: Mapping[str, Callable[[V, V], V]]) -> V:
    """Combine a value (or a sign) for each piece, left to right, into that of the whole; `by` has `min` and `max`."""
    given = iter(values)

    def fold(part: Tree[P]) -> V:
        if isinstance(part, Piece):
            return next(given)
        left, right = (fold(each) for each in part.parts)
        return by[part.op](left, right)

    return fold(tree)


def shifted(tree: Tree[P], constant: P) -> Tree[P]:
    """Subtract a constant: from every piece, as `min` and `max` let it through."""
    return _mapped(tree, lambda piece: Piece(cast(Any, piece.u) - constant, piece.root))


def along(expression: Expr, given: Mapping[str, P], kind: Kind[P]) -> Tree[P]:
    """Write an expression along a ray as a tree of pieces.

    Parameters
    ----------
    expression : Expr
        Of + - * /, integer powers, abs, min, max, and cube roots that stand in a sum with polynomial factors.
    given : mapping of str to polynomial
        For every symbol: a coordinate `origin + t direction`, or a parameter's constant.
    kind : Kind
        The polynomials.

    Raises
    ------
    LensclError
        If the expression is none of these along this ray; the message names the part.
    """
    maker = _Maker(kind)
    at: dict[Expr, Tree[P]] = {}
    for each in walk([expression]):
        if each.op == "symbol":
            at[each] = Piece(given[str(each.name)])
        elif each.value is not None:
            at[each] = Piece(kind.number(each.value))
        else:
            made = maker.made(each, [at[arg] for arg in each.args])
            if made is None or sum(1 for _ in leaves(made)) > _MOST_PIECES:
                raise LensclError(
                    f"no polynomial decides the sign of {each} along a ray; first roots can be judged for polynomials, "
                    f"abs, min and max of them (at most {_MOST_PIECES} pieces), and sums with one cube root"
                )
            at[each] = made
    return at[expression]


class _Maker(Generic[P]):
    """One rule for each operation, on trees; None where it leaves them."""

    def __init__(self, kind: Kind[P]) -> None:
        self.kind = kind

    def made(self, each: Expr, parts: list[Tree[P]]) -> Tree[P] | None:
        match each.op, parts:
            case "neg", [s]:
                return self.scaled(s, Piece(self.kind.number(-1.0)))
            case "+", [s, t]:
                return self.sum(s, t)
            case "-", [s, t]:
                return self.sum(s, _negative(s=t, kind=self.kind))
            case "*", [s, t]:
                return self.product(s, t)
            case "/", [s, Piece(u=c, root=None)] if self.kind.sign(c):
                return self.scaled(s, Piece(self.kind.quotient(self.kind.number(1.0), c)))
            case "power", [s, _]:
                return self.power(s, int(cast(float, each.args[1].value)))
            case (("min" | "max"), [s, t]):
                return Choice(each.op, (s, t))
            case "abs", [s]:
                return Choice("max", (s, _negative(s=s, kind=self.kind)))
            case "cbrt", [Piece(u=w, root=None)]:
                return Piece(self.kind.number(0.0), (self.kind.number(1.0), w))
        return None

    def sum(self, s: Tree[P] | None, t: Tree[P] | None) -> Tree[P] | None:
        if s is None or t is None:
            return None
        if isinstance(s, Choice):
            return _choice(s.op, [self.sum(part, t) for part in s.parts])
        if isinstance(t, Choice):
            return _choice(t.op, [self.sum(s, part) for part in t.parts])
        u: P = cast(Any, s.u) + t.u
        if s.root is None or t.root is None:
            return Piece(u, s.root or t.root)
        if s.root[1] is not t.root[1]:
            return None
        return Piece(u, (cast(Any, s.root[0]) + t.root[0], s.root[1]))

    def product(self, s: Tree[P], t: Tree[P]) -> Tree[P] | None:
        if isinstance(t, Piece) and t.root is None:
            return self.scaled(s, t)
        return self.scaled(t, s) if isinstance(s, Piece) and s.root is None else None

    def scaled(self, tree: Tree[P], factor: Piece[P]) -> Tree[P] | None:
        f: Any = factor.u
        if isinstance(tree, Piece):
            return Piece(tree.u * f, None if tree.root is None else (tree.root[0] * f, tree.root[1]))
        sign = self.kind.sign(factor.u)
        if sign is None:  # max(u, v) p is neither max nor min of u p and v p where p changes sign
            return None
        return _choice(tree.op if sign >= 0 else _OPPOSITE[tree.op], [self.scaled(part, factor) for part in tree.parts])

    def power(self, s: Tree[P], n: int) -> Tree[P] | None:
        if n == 1:
            return s
        if isinstance(s, Choice) or s.root is not None or n < 0:
            return None
        result: Any = self.kind.number(1.0)
        for _ in range(n):
            result = result * s.u
        return Piece(result)


def _negative(s: Tree[P], kind: Kind[P]) -> Tree[P]:
    negative = _Maker(kind).scaled(s, Piece(kind.number(-1.0)))
    assert negative is not None  # a constant factor is always let through
    return negative


def _choice(op: str, parts: Sequence[Tree[P] | None]) -> Tree[P] | None:
    left, right = parts
    return None if left is None or right is None else Choice(op, (left, right))


def _mapped(tree: Tree[P], by: Callable[[Piece[P]], Piece[P]]) -> Tree[P]:
    if isinstance(tree, Piece):
        return by(tree)
    left, right = (_mapped(part, by) for part in tree.parts)
    return Choice(tree.op, (left, right))
