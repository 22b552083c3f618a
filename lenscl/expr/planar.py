"""Expressions that are the largest of functions linear in x, y and z: the planes of a convex polyhedron."""

from __future__ import annotations

from functools import lru_cache

from lenscl.expr.creases import creased
from lenscl.expr.derive import polynomial
from lenscl.expr.graph import Expr, number, walk

MOST_PLANES = 256  # an expression of more is searched by its leaves, as any other
_FEWEST = 4  # no bounded solid has less
_AXES = ("x", "y", "z")
_LINEAR = frozenset({"symbol", "+", "-", "neg", "*", "/", "max", "min", "abs"})  # with these, what holds x, y or z

Plane = tuple[Expr, Expr, Expr, Expr]  # a, b, c, d of a x + b y + c z - d


@lru_cache(maxsize=256)
def planes_of(expr: Expr) -> tuple[Plane, ...]:
    """Return the planes whose half spaces a x + b y + c z <= d meet in the solid `expr <= 0`.

    Parameters
    ----------
    expr : Expr
        Any expression.

    Returns
    -------
    tuple of (a, b, c, d)
        Expressions without x, y and z. Empty unless the expression is a `max` of 4 to 256 functions that are linear in
        x, y and z, after `abs` and what is added to a `max` are taken out.
    """
    moves: set[Expr] = set()  # what depends on x, y or z
    for each in walk([expr]):
        if (each.op == "symbol" and str(each.name) in _AXES) or any(arg in moves for arg in each.args):
            if each.op not in _LINEAR:
                return ()
            moves.add(each)
    if expr.op == "symbol" or not any(each.op in ("max", "min", "abs") for each in moves):
        return ()
    joined, leaves = creased(expr, MOST_PLANES)
    if len(leaves) < _FEWEST or any(each.op not in ("max", "symbol") for each in walk([joined])):
        return ()
    found = [_plane(leaf) for leaf in leaves.values()]
    return tuple(plane for plane in found if plane is not None) if None not in found else ()


def _plane(leaf: Expr) -> Plane | None:
    """Return a leaf's coefficients, None where it is not linear."""
    if any(each.op in ("max", "min", "abs") and each.depends_on(_AXES) for each in walk([leaf])):
        return None
    zero, one = (number(0.0),), (number(0.0), number(1.0))
    slopes: list[Expr] = []
    constant = number(0.0)
    for axis in _AXES:
        found = polynomial(leaf, {other: one if other == axis else zero for other in _AXES})
        if found is None or len(found) > 2 or any(each.depends_on(_AXES) for each in found):
            return None
        constant = found[0]
        slopes.append(found[1] if len(found) == 2 else number(0.0))
    everywhere = polynomial(leaf, dict.fromkeys(_AXES, one))  # x y is linear along each axis, but not along this line
    if everywhere is None or len(everywhere) != 2:
        return None
    a, b, c = slopes
    return a, b, c, -constant
