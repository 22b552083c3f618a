"""Where an expression bends sharply: its smooth leaves, and how max and min join them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from lenscl.expr.graph import Expr, build, node, symbol, walk

_OTHER = {"max": "min", "min": "max"}
_Tree: TypeAlias = "Expr | tuple[str, _Tree, _Tree]"  # a leaf, or max or min of two


def creased(expr: Expr, most: int) -> tuple[Expr, dict[str, Expr]]:
    """Take an expression apart at the creases of max, min and abs.

    abs(x) - 1 is max(x - 1, -x - 1), max(leaf_0, leaf_1) with two smooth leaves. A crease stays inside a leaf where it
    cannot be taken out, in a function or a factor that may have either sign, or where too many leaves would come of it.

    Parameters
    ----------
    expr : Expr
        Any expression.
    most : int
        So many leaves at most, 1 or more.

    Returns
    -------
    joined : Expr
        The expression with symbols for its leaves; max and min of them and nothing else.
    leaves : dict of str to Expr
        By the symbol's name, from left to right: "leaf_0", "leaf_1", ...
    """
    trees: dict[Expr, _Tree] = {}
    for each in walk([expr]):
        found = _lifted(each, [trees[arg] for arg in each.args])
        trees[each] = found if _count(found) <= most else each
    leaves: dict[Expr, str] = {}

    def join(tree: _Tree) -> Expr:
        if isinstance(tree, Expr):
            return symbol(leaves.setdefault(tree, f"leaf_{len(leaves)}"))
        op, first, second = tree
        return node(op, join(first), join(second))

    joined = join(trees[expr])
    return joined, {name: leaf for leaf, name in leaves.items()}


def _lifted(each: Expr, args: list[_Tree]) -> _Tree:
    """Return a node's tree from those of its operands."""
    op = each.op
    if op in _OTHER:
        return op, args[0], args[1]
    if op == "abs":
        return "max", args[0], _negated(args[0])
    if all(isinstance(arg, Expr) for arg in args):
        return each
    if op == "neg":
        return _negated(args[0])
    if op in ("+", "-"):
        first, second = args[0], args[1] if op == "+" else _negated(args[1])
        return _mapped(first, lambda one: _mapped(second, lambda other: build("+", one, other)))
    factors = [i for i, arg in enumerate(each.args) if arg.value is not None]
    if factors and (op == "*" or (op == "/" and factors == [1])):
        (i,) = factors
        value, creases = each.args[i], args[1 - i]
        assert value.value is not None
        positive = creases if value.value >= 0.0 else _negated(creases)
        size = build("abs", value)
        return _mapped(positive, lambda leaf: build(op, leaf, size))
    return each


def _negated(tree: _Tree) -> _Tree:
    if isinstance(tree, Expr):
        return build("neg", tree)
    op, first, second = tree
    return _OTHER[op], _negated(first), _negated(second)


def _mapped(tree: _Tree, change: Callable[[Expr], _Tree]) -> _Tree:
    """Return a tree with every leaf changed by a function that rises with it."""
    if isinstance(tree, Expr):
        return change(tree)
    op, first, second = tree
    return op, _mapped(first, change), _mapped(second, change)


def _count(tree: _Tree) -> int:
    return 1 if isinstance(tree, Expr) else _count(tree[1]) + _count(tree[2])
