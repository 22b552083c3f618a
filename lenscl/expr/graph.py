"""Expressions as a graph: equal structure is the same object, so shared parts are found by identity."""

from __future__ import annotations

import hashlib
import math
import threading
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from weakref import WeakValueDictionary

MAX_POWER = 64  # largest integer power: products for it stay few, and nothing is computed without bound


@dataclass(frozen=True, slots=True, weakref_slot=True, eq=False, repr=False)
class Expr:
    """One node. Made by `number`, `symbol`, `parse` and the arithmetic operators, never directly.

    Attributes
    ----------
    op : str
        `"number"`, `"symbol"` or the name of a row of `OPERATIONS`.
    args : tuple of Expr
        The operands. An integer power holds its exponent as a number.
    value : float or None
        Of a number.
    name : str or None
        Of a symbol.
    """

    op: str
    args: tuple[Expr, ...] = ()
    value: float | None = None
    name: str | None = None

    def depends_on(self, names: Collection[str]) -> bool:
        """Say whether any of these symbols occurs."""
        return any(each.op == "symbol" and each.name in names for each in walk([self]))

    def __add__(self, other: Expr | float) -> Expr:
        return build("+", self, as_expr(other))

    def __radd__(self, other: float) -> Expr:
        return build("+", as_expr(other), self)

    def __sub__(self, other: Expr | float) -> Expr:
        return build("-", self, as_expr(other))

    def __rsub__(self, other: float) -> Expr:
        return build("-", as_expr(other), self)

    def __mul__(self, other: Expr | float) -> Expr:
        return build("*", self, as_expr(other))

    def __rmul__(self, other: float) -> Expr:
        return build("*", as_expr(other), self)

    def __truediv__(self, other: Expr | float) -> Expr:
        return build("/", self, as_expr(other))

    def __rtruediv__(self, other: float) -> Expr:
        return build("/", as_expr(other), self)

    def __pow__(self, other: Expr | float) -> Expr:
        return build("pow", self, as_expr(other))

    def __neg__(self) -> Expr:
        return build("neg", self)

    def __str__(self) -> str:
        from lenscl.expr.printing import infix  # the spelling lives in the table, which is built from this module

        return infix(self)

    __repr__ = __str__

    def __reduce__(self) -> tuple[object, ...]:
        return _rebuilt, (listing(self),)  # flat: a deep graph needs no deep stack


_nodes: WeakValueDictionary[tuple[object, ...], Expr] = WeakValueDictionary()
_lock = threading.Lock()


def _intern(op: str, args: tuple[Expr, ...], value: float | None = None, name: str | None = None) -> Expr:
    key = (op, args, value, name)
    with _lock:
        found = _nodes.get(key)
        if found is None:
            found = _nodes[key] = Expr(op, args, value, name)
    return found


def number(value: float) -> Expr:
    """Make the node of a finite number.

    Raises
    ------
    ValueError
        For NaN and infinities.
    """
    value = float(value)
    if not math.isfinite(value):
        raise ValueError(f"a number in an expression must be finite, got {value}")
    return _intern("number", (), value + 0.0)  # + 0.0 turns -0.0 into 0.0: one node for zero


def symbol(name: str) -> Expr:
    """Make the node of a named quantity: a coordinate or a parameter."""
    return _intern("symbol", (), None, name)


def node(op: str, *args: Expr) -> Expr:
    """Make a node as it stands, without simplifying."""
    return _intern(op, args)


def build(op: str, *args: Expr) -> Expr:
    """Make a node, simplified by the first rule of `simplify.RULES` that fits."""
    from lenscl.expr.simplify import RULES  # the rules are made of this module's nodes

    for rule in RULES.get(op, ()):
        result = rule.apply(*args)
        if result is not None:
            return result
    return node(op, *args)


def as_expr(value: Expr | float) -> Expr:
    """Make a number a node; leave a node as it is."""
    return value if isinstance(value, Expr) else number(value)


def walk(roots: Iterable[Expr]) -> Iterator[Expr]:
    """Yield every node once, operands before the nodes that use them. Deep graphs need no deep stack."""
    seen: set[Expr] = set()
    for root in roots:
        stack = [(root, False)]
        while stack:
            each, ready = stack.pop()
            if ready:
                yield each
            elif each not in seen:
                seen.add(each)
                stack.append((each, True))
                stack.extend((arg, False) for arg in reversed(each.args))


Row = tuple[str, tuple[int, ...], float | None, str | None]  # op, places of the operands, value, name


def listing(expr: Expr) -> tuple[Row, ...]:
    """List the nodes, operands first, each with the places of its operands in the list."""
    place: dict[Expr, int] = {}
    rows = []
    for each in walk([expr]):
        place[each] = len(place)
        rows.append((each.op, tuple(place[arg] for arg in each.args), each.value, each.name))
    return tuple(rows)


def _rebuilt(rows: tuple[Row, ...]) -> Expr:
    made: list[Expr] = []
    for op, places, value, name in rows:
        made.append(_intern(op, tuple(made[place] for place in places), value, name))
    return made[-1]


def digest(expr: Expr) -> str:
    """Name the structure: equal for the same graph in any process, different for another one."""
    return hashlib.sha256(repr(listing(expr)).encode()).hexdigest()[:16]
