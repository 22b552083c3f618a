"""Expressions that join polynomials by max and min: their leaves, which are searched one by one."""

from __future__ import annotations

from functools import lru_cache

from lenscl.expr.creases import creased
from lenscl.expr.derive import degree
from lenscl.expr.graph import Expr

MOST_LEAVES = 8  # of an expression: each has words of its own in a kernel
CLOSED = 2  # the highest degree of a leaf whose roots along a ray are known in closed form
_MOST_DEGREE = 12  # as for Surface.polynomial_form, of a stretch of the ray that other leaves leave


@lru_cache(maxsize=256)
def polynomial_leaves(expr: Expr) -> tuple[Expr, ...]:
    """Return the leaves of which an expression is max and min, if these are polynomials in x, y and z.

    Parameters
    ----------
    expr : Expr
        Any expression.

    Returns
    -------
    tuple of Expr
        As `creased` numbers them. Empty if there is only one, if one is no polynomial of degree 12 or less, or if none
        has a degree above 2.
    """
    leaves = tuple(creased(expr, MOST_LEAVES)[1].values())
    degrees = [degree(leaf, "xyz") for leaf in leaves]
    known = [found for found in degrees if found is not None and found <= _MOST_DEGREE]
    if len(leaves) < 2 or len(known) < len(leaves) or max(known) <= CLOSED:
        return ()
    return leaves
