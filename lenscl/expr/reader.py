"""Read an expression from text, by a whitelist on Python's syntax tree. Nothing is ever evaluated as code.

Text goes through three gates, each pointing at the column that stops it: the characters and the nesting, checked before
Python's parser sees anything; Python's parser; and the walk over its tree, which knows numbers, given names, arithmetic
and the functions of the table, and refuses the rest.
"""

from __future__ import annotations

import ast
import difflib
import math
import re
import warnings
from collections.abc import Collection

from lenscl.errors import ExpressionError
from lenscl.expr.graph import MAX_POWER, Expr, build, number, symbol, walk
from lenscl.expr.operations import FUNCTIONS, OPERATIONS

MAX_LENGTH = 100_000  # characters
MAX_NODES = 5_000  # operations, names and numbers as written
MAX_DEPTH = 200  # brackets in brackets, powers of powers, signs of signs

_ALLOWED = re.compile(r"[A-Za-z0-9_.,()+\-*/^ \t\r\n]*")
_TOKEN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|\*\*|[^\s]")
_NUMBER = re.compile(r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_BINARY: dict[type[ast.operator], str] = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "pow"}
_ADVICE = {
    "−": "write the minus sign as -",
    "–": "write the minus sign as -",
    "·": "write products as *",
    "×": "write products as *",
    "²": "write powers as ^2",
    "³": "write powers as ^3",
    "√": "write sqrt(...)",
    "[": "group with ( and )",
    "{": "group with ( and )",
    "=": "write the surface as an expression that is negative inside, without =",
    "<": "write the surface as an expression that is negative inside; for pieces use min, max and abs",
    ">": "write the surface as an expression that is negative inside; for pieces use min, max and abs",
    "|": "write abs(...)",
}


def parse(text: str, symbols: Collection[str]) -> Expr:
    """Read an expression in numbers, `symbols`, `+ - * /`, `^` or `**`, brackets and the functions of the table.

    `^` is the power, as `**`: it binds tighter than a sign before it and to the right. A whole exponent is an integer
    power, for any base; any other is `pow(u, p)`, which has a value for u >= 0 only. `min` and `max` take two operands
    or more. Numbers are decimal.

    Parameters
    ----------
    text : str
        At most `MAX_LENGTH` characters, `MAX_NODES` parts, nested at most `MAX_DEPTH` deep.
    symbols : collection of str
        The names that may occur.

    Raises
    ------
    ExpressionError
        With the column (from 0) at which the text is refused.
    """
    columns = _gate(text)
    return _Reader(text, columns, symbols).read()


def _gate(text: str) -> list[int]:
    """Refuse what Python's parser need not see. Return the column of each character that it will be given."""
    if len(text) > MAX_LENGTH:
        raise ExpressionError(
            f"an expression may have at most {MAX_LENGTH} characters, this has {len(text)}", text, MAX_LENGTH
        )
    if not text.strip():
        raise ExpressionError("the expression is empty; write F(x, y, z), negative inside", text, 0)
    allowed = _ALLOWED.match(text)
    if allowed is None or allowed.end() < len(text):
        column = allowed.end() if allowed else 0
        found = text[column]
        advice = _ADVICE.get(found, "allowed are numbers, names, ( ) , and + - * / ^")
        raise ExpressionError(f"unexpected {found!a}; {advice}", text, column)
    _check_nesting(text)
    columns = [0]  # of the bracket that is put around the text
    for column, character in enumerate(text):
        columns += [column, column] if character == "^" else [column]
    return [*columns, len(text)]


def _check_nesting(text: str) -> None:
    """Check that brackets match, and bound how deep Python's parser must go: brackets, powers and signs."""
    opened: list[int] = []
    pending = 0  # signs and powers since the last operand or bracket
    tokens = 0
    chain = [0]  # powers in a row, for each open bracket
    for match in _TOKEN.finditer(text):
        token, column = match.group(), match.start()
        tokens += token not in "(),"
        if tokens > 2 * MAX_NODES:
            raise ExpressionError(f"an expression may have at most {MAX_NODES} parts; split the solid", text, column)
        pending = pending + 1 if token in ("+", "-") else 0
        if token == "(":
            opened.append(column)
            chain.append(0)
        elif token == ")":
            if not opened:
                raise ExpressionError("this bracket was never opened", text, column)
            opened.pop()
            chain.pop()
        elif token in ("^", "**"):
            chain[-1] += 1
        elif token in (",", "*", "/"):
            chain[-1] = 0
        if len(opened) > MAX_DEPTH or pending > MAX_DEPTH or sum(chain) > MAX_DEPTH:
            raise ExpressionError(f"nested more than {MAX_DEPTH} deep", text, column)
    if opened:
        raise ExpressionError("this bracket is never closed", text, opened[-1])


class _Reader:
    """The walk over the tree. Chains of operators are read in a loop, so only brackets and powers go deeper."""

    def __init__(self, text: str, columns: list[int], symbols: Collection[str]) -> None:
        self._text, self._columns = text, columns
        self._symbols = symbols
        self._parts = 0

    def read(self) -> Expr:
        source = "(" + re.sub(r"[\t\r\n]", " ", self._text).replace("^", "**") + ")"
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")  # Python only warns of "2and"
                tree = ast.parse(source, mode="eval")
        except SyntaxError as fault:
            column = self._columns[min(max((fault.offset or 1) - 1, 0), len(self._columns) - 1)]
            raise ExpressionError("this does not read as an expression", self._text, column) from None
        except (RecursionError, MemoryError, ValueError, OverflowError):
            raise ExpressionError("too deeply nested or too long; split the solid", self._text, 0) from None
        expr = self._value(tree.body)
        if sum(1 for _ in walk([expr])) > MAX_NODES:
            raise ExpressionError(f"an expression may have at most {MAX_NODES} parts; split the solid", self._text, 0)
        return expr

    def _refuse(self, at: ast.expr, message: str) -> ExpressionError:
        return ExpressionError(message, self._text, self._column(at))

    def _column(self, at: ast.expr) -> int:
        return self._columns[min(at.col_offset, len(self._columns) - 1)]

    def _value(self, tree: ast.expr) -> Expr:
        spine: list[ast.BinOp] = []
        while isinstance(tree, ast.BinOp) and not isinstance(tree.op, ast.Pow):
            spine.append(tree)
            tree = tree.left
        value = self._single(tree)
        for each in reversed(spine):
            value = self._binary(each, value, self._value(each.right))
        return value

    def _single(self, tree: ast.expr) -> Expr:
        self._parts += 1
        if self._parts > MAX_NODES:
            raise self._refuse(tree, f"an expression may have at most {MAX_NODES} parts; split the solid")
        match tree:
            case ast.Constant():
                return self._number(tree)
            case ast.Name():
                return self._name(tree)
            case ast.UnaryOp(op=ast.USub()):
                return -self._value(tree.operand)
            case ast.UnaryOp(op=ast.UAdd()):
                return self._value(tree.operand)
            case ast.BinOp(op=ast.Pow()):
                return self._binary(tree, self._value(tree.left), self._value(tree.right))
            case ast.Call():
                return self._call(tree)
            case ast.Attribute():
                raise self._refuse(tree, "attributes (a name after a point) are not allowed")
            case ast.Tuple():
                raise self._refuse(tree, "a comma may only stand between the operands of a function")
            case _:
                raise self._refuse(tree, "only numbers, names, arithmetic and functions are allowed")

    def _number(self, tree: ast.Constant) -> Expr:
        # From the text itself: Python's own value may be an integer of any size
        start, end = tree.col_offset, tree.end_col_offset or 0
        spelled = self._text[self._columns[start] : self._columns[min(end, len(self._columns) - 1)]].strip()
        if not _NUMBER.fullmatch(spelled):
            raise self._refuse(tree, "only decimal numbers are allowed, such as 2, 0.5 or 1e-3")
        value = float(spelled)
        if not math.isfinite(value):
            raise self._refuse(tree, "this number is too large for double precision (1.8e308)")
        return number(value)

    def _name(self, tree: ast.Name) -> Expr:
        if tree.id in self._symbols:
            return symbol(tree.id)
        if tree.id in FUNCTIONS:
            raise self._refuse(tree, f"{tree.id} is a function: write {tree.id}(...)")
        raise self._refuse(tree, f"unknown name {tree.id!r}; {_nearest(tree.id, self._symbols)}")

    def _binary(self, tree: ast.BinOp, left: Expr, right: Expr) -> Expr:
        op = _BINARY.get(type(tree.op))
        if op is None:
            raise self._refuse(tree.right, "this operator is not allowed; use + - * / ^")
        return self._built(tree.right, op, left, right)

    def _built(self, at: ast.expr, op: str, *args: Expr) -> Expr:
        """Build a node, unless it is a constant with no finite value or a power beyond the limit."""
        if op == "/" and args[1].value == 0.0:
            raise self._refuse(at, "division by zero")
        if op == "pow" and args[1].value is not None:
            exponent = args[1].value
            if exponent == int(exponent) and abs(exponent) > MAX_POWER:
                raise self._refuse(at, f"whole exponents go from -{MAX_POWER} to {MAX_POWER}")
            if args[0].value == 0.0 and exponent < 0.0:
                raise self._refuse(at, "division by zero")
        made = build(op, *args)
        if op in ("+", "-", "*", "/", "pow") and made.value is None and all(each.value is not None for each in args):
            whole = op != "pow" or made.op != "pow"
            if whole:
                raise self._refuse(at, "this constant has no finite value in double precision")
        return made

    def _call(self, tree: ast.Call) -> Expr:
        if not isinstance(tree.func, ast.Name):
            raise self._refuse(tree.func, "only a function's name may stand before a bracket; write products as *")
        name = tree.func.id
        if name not in FUNCTIONS:
            what = "a value, not a function; write products as *" if name in self._symbols else "no known function"
            raise self._refuse(tree.func, f"{name!r} is {what}; {_nearest(name, FUNCTIONS)}")
        if tree.keywords or any(isinstance(each, ast.Starred) for each in tree.args):
            raise self._refuse(tree, f"{name} takes plain operands only")
        arity, given = OPERATIONS[name].arity, len(tree.args)
        many = name in ("min", "max")
        if (given < arity) if many else (given != arity):
            wanted = f"{arity} or more operands" if many else f"{arity} operand{'s' * (arity > 1)}"
            raise self._refuse(tree, f"{name} takes {wanted}, got {given}")
        args = [self._value(each) for each in tree.args]
        self._parts += 1
        value = self._built(tree, name, *args[:arity])
        for each in args[arity:]:
            value = build(name, value, each)
        return value


def _nearest(name: str, known: Collection[str]) -> str:
    close = difflib.get_close_matches(name[:40], sorted(known), n=1)
    return f"did you mean {close[0]!r}?" if close else f"known are {', '.join(sorted(known))}"
