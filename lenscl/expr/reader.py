"""Read an expression from text, by a whitelist on Python's syntax tree. Nothing is ever evaluated as code.

Text goes through three gates, each pointing at the column that stops it: the characters, words and nesting, checked
before Python's parser sees anything; Python's parser; and the walk over its tree, which knows numbers, given names,
arithmetic and the functions of the table, and refuses the rest.
"""

from __future__ import annotations

import ast
import keyword
import math
import re
from collections.abc import Collection
from functools import reduce

from lenscl.errors import ExpressionError
from lenscl.expr import advice
from lenscl.expr.graph import MAX_POWER, Expr, build, number, symbol, walk
from lenscl.expr.words import CONSTANTS, FUNCTIONS, called, operands_of

MAX_LENGTH = 100_000  # characters
MAX_NODES = 5_000  # operations, names and numbers as written
MAX_DEPTH = 200  # brackets in brackets, powers of powers, signs of signs

_ALLOWED = re.compile(r"[A-Za-z0-9_.,()+\-*/^ \t\r\n]*")
_TOKEN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|\*\*|[^\s]")
_NUMBER = re.compile(r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_BINARY: dict[type[ast.operator], str] = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "pow"}
_CHAINED = ("min", "max")  # of two operands or more
_TOO_MANY = f"an expression may have at most {MAX_NODES} parts; split the solid"


def parse(text: str, symbols: Collection[str], *, own: str = "") -> Expr:
    """Read an expression in numbers, `symbols`, `+ - * /`, `^` or `**`, brackets and the functions of the table.

    `^` is the power, as `**`: it binds tighter than a sign before it and to the right. A whole exponent is an integer
    power, for any base; any other is `pow(u, p)`, which has a value for u >= 0 only. `min` and `max` take two operands
    or more. `mod(u, v)` is u - v floor(u / v), between 0 and v, and `sign(0)` is 0. `pi` is the constant, unless it is
    one of `symbols`. Numbers are decimal.

    Parameters
    ----------
    text : str
        At most `MAX_LENGTH` characters, `MAX_NODES` parts, nested at most `MAX_DEPTH` deep.
    symbols : collection of str
        The names that may occur.
    own : str, optional
        Where a user gives numbers of his own, for what is said of a name that is none of these.

    Raises
    ------
    ExpressionError
        With the column (from 0) at which the text is refused.
    """
    columns = _gate(text)
    return _Reader(text, columns, symbols, own).read()


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
        hint = advice.for_character(text, column)
        raise ExpressionError(f"unexpected {advice.shown(text[column])}; {hint}", text, column)
    _check_tokens(text)
    columns = [0]  # of the bracket that is put around the text
    for column, character in enumerate(text):
        columns += [column, column] if character == "^" else [column]
    return [*columns, len(text)]


def _check_tokens(text: str) -> None:
    """Refuse words that are no arithmetic, and bound how deep Python's parser must go: brackets, powers, signs."""
    opened: list[int] = []
    powers = [0]  # in a row, for each open bracket
    signs = parts = 0
    before = ""  # the last token: "name", "value" (a number or a closing bracket) or an operator
    for match in _TOKEN.finditer(text):
        token, column = match.group(), match.start()
        kind = "name" if token[0].isalpha() or token[0] == "_" else "value" if token[0] in ".0123456789" else token
        if token in keyword.kwlist:
            raise ExpressionError(f"{token!r} is not allowed; only arithmetic and functions are", text, column)
        if token == ".":
            hint = advice.for_module(text, column)
            raise ExpressionError(f"attributes (a name after a point) are not allowed{_after(hint)}", text, column)
        if before in ("name", "value") and (kind in ("name", "value") or (kind == "(" and before == "value")):
            hint = advice.for_missing_operator(text, column, match.end())
            raise ExpressionError(f"an operator is missing before this; {hint}", text, column)
        if kind == "value":
            _check_number(token, text, column)
        parts += token not in ("(", ")", ",")
        signs = signs + 1 if token in ("+", "-") else 0
        if token == "(":
            opened.append(column)
            powers.append(0)
        elif token == ")":
            if not opened:
                raise ExpressionError("this bracket was never opened", text, column)
            opened.pop()
            powers.pop()
        elif token in ("^", "**"):
            powers[-1] += 1
        elif token in (",", "*", "/"):
            powers[-1] = 0
        if parts > 2 * MAX_NODES:
            raise ExpressionError(_TOO_MANY, text, column)
        if len(opened) > MAX_DEPTH or signs > MAX_DEPTH or powers[-1] > MAX_DEPTH:
            raise ExpressionError(f"nested more than {MAX_DEPTH} deep", text, column)
        before = "value" if token == ")" else kind
    if opened:
        raise ExpressionError("this bracket is never closed", text, opened[-1])


def _check_number(token: str, text: str, column: int) -> None:
    if not _NUMBER.fullmatch(token):
        raise ExpressionError("a number is written like 2, 0.5 or 1e-3", text, column)
    if not math.isfinite(float(token)):
        raise ExpressionError("this number is too large for double precision (1.8e308)", text, column)


class _Reader:
    """The walk over the tree, in a loop: how deep a text may go does not depend on the caller's stack."""

    def __init__(self, text: str, columns: list[int], symbols: Collection[str], own: str) -> None:
        self._text, self._columns = text, columns
        self._symbols, self._own = symbols, own

    def read(self) -> Expr:
        source = "(" + re.sub(r"[\t\r\n]", " ", self._text).replace("^", "**") + ")"
        try:
            tree = ast.parse(source, mode="eval")
        except SyntaxError as fault:
            column = self._columns[min(max((fault.offset or 1) - 1, 0), len(self._columns) - 1)]
            raise ExpressionError("this does not read as an expression", self._text, column) from None
        except (RecursionError, MemoryError, ValueError, OverflowError):
            raise ExpressionError("too deeply nested or too long; split the solid", self._text, 0) from None
        expr = self._value(tree.body)
        if sum(1 for _ in walk([expr])) > MAX_NODES:
            raise ExpressionError(_TOO_MANY, self._text, 0)
        return expr

    def _value(self, root: ast.expr) -> Expr:
        parts = 0
        made: list[Expr] = []
        stack: list[tuple[ast.expr, int | None]] = [(root, None)]
        while stack:
            tree, count = stack.pop()
            if count is not None:
                args = made[len(made) - count :]
                made[len(made) - count :] = [self._made(tree, args)]
                continue
            parts += 1
            if parts > MAX_NODES:
                raise self._refuse(tree, _TOO_MANY)
            operands = self._operands(tree)
            stack.append((tree, len(operands)))
            stack.extend((operand, None) for operand in reversed(operands))
        return made[0]

    def _refuse(self, at: ast.expr, message: str) -> ExpressionError:
        return ExpressionError(message, self._text, self._columns[min(at.col_offset, len(self._columns) - 1)])

    def _refuse_comma(self, tree: ast.Tuple) -> ExpressionError:
        message = "a comma may only stand between the operands of a function"
        comma = advice.decimal_comma(self._spelled(tree))
        if comma is None:
            return self._refuse(tree, message)
        column = self._columns[tree.col_offset] + comma
        return ExpressionError(f"{message}; a decimal is written with a point, like 0.5", self._text, column)

    def _spelled(self, tree: ast.expr) -> str:
        """Return a node as it is written."""
        end = min(tree.end_col_offset or 0, len(self._columns) - 1)
        return self._text[self._columns[tree.col_offset] : self._columns[end]]

    def _operands(self, tree: ast.expr) -> list[ast.expr]:
        """Return the operands of a node that is allowed."""
        match tree:
            case ast.Constant() | ast.Name():
                return []
            case ast.UnaryOp(op=ast.USub() | ast.UAdd()):
                return [tree.operand]
            case ast.BinOp():
                if type(tree.op) not in _BINARY:
                    raise self._refuse(tree.right, "this operator is not allowed; use + - * / ^")
                return [tree.left, tree.right]
            case ast.Call():
                self._check_call(tree)
                return tree.args
            case ast.Tuple():
                raise self._refuse_comma(tree)
            case _:
                raise self._refuse(tree, "only numbers, names, arithmetic and functions are allowed")

    def _check_call(self, tree: ast.Call) -> None:
        if not isinstance(tree.func, ast.Name):
            raise self._refuse(tree.func, "only a function's name may stand before a bracket; write products as *")
        name = tree.func.id
        if name in self._symbols:
            raise self._refuse(tree.func, f"{name!r} is a value, not a function; write products as *")
        if name not in FUNCTIONS:
            raise self._refuse(tree.func, f"unknown function {name!r}; {advice.for_function(name)}")
        if tree.keywords or any(isinstance(each, ast.Starred) for each in tree.args):
            raise self._refuse(tree, f"{name} takes plain operands only")
        arity, given = operands_of(name), len(tree.args)
        many = name in _CHAINED
        if (given < arity) if many else (given != arity):
            wanted = f"{arity} or more operands" if many else f"{arity} operand{'s' * (arity > 1)}"
            comma = "" if advice.decimal_comma(self._spelled(tree)) is None else "; a decimal is written like 0.5"
            raise self._refuse(tree, f"{name} takes {wanted}, got {given}{comma}")

    def _made(self, tree: ast.expr, args: list[Expr]) -> Expr:
        match tree:
            case ast.Constant():
                return self._number(tree)
            case ast.Name():
                return self._name(tree)
            case ast.UnaryOp():
                return -args[0] if isinstance(tree.op, ast.USub) else args[0]
            case ast.BinOp():
                return self._built(tree.right, _BINARY[type(tree.op)], args[0], args[1])
            case ast.Call(func=ast.Name(id=name)) if name in _CHAINED:
                return reduce(lambda u, v: build(name, u, v), args)
            case ast.Call(func=ast.Name(id=name)):
                return self._built(tree.args[-1], name, *args)
        raise AssertionError(f"an operation that passed the whitelist cannot be built: {ast.dump(tree)[:80]}")

    def _number(self, tree: ast.Constant) -> Expr:
        # From the text: Python's own value may be an integer of any size, True or an ellipsis
        spelled = self._spelled(tree).strip()
        if not _NUMBER.fullmatch(spelled):
            raise self._refuse(tree, "a number is written like 2, 0.5 or 1e-3")
        return number(float(spelled))

    def _name(self, tree: ast.Name) -> Expr:
        if tree.id in self._symbols:
            return symbol(tree.id)
        if tree.id in CONSTANTS:
            return number(CONSTANTS[tree.id])
        if tree.id in FUNCTIONS:
            raise self._refuse(tree, f"{tree.id} is a function: write {tree.id}(...)")
        raise self._refuse(tree, f"unknown name {tree.id!r}; {advice.for_name(tree.id, self._symbols, self._own)}")

    def _built(self, at: ast.expr, op: str, *args: Expr) -> Expr:
        """Build a node, unless it is a constant without a finite value or a power beyond the limit."""
        constant = all(each.value is not None for each in args)
        if op in ("/", "mod") and args[1].value == 0.0:
            raise self._refuse(at, "division by zero")
        whole = False
        if op == "pow" and args[1].value is not None:
            exponent = args[1].value
            whole = exponent == int(exponent)
            if whole and abs(exponent) > MAX_POWER:
                raise self._refuse(at, f"whole exponents go from -{MAX_POWER} to {MAX_POWER}")
            if args[0].value == 0.0 and exponent < 0.0:
                raise self._refuse(at, "division by zero")
        made = called(op, *args) if op in FUNCTIONS else build(op, *args)
        if constant and made.value is None and (whole or op in ("+", "-", "*", "/")):
            raise self._refuse(at, "this constant has no finite value in double precision")
        return made


def _after(hint: str) -> str:
    return f"; {hint}" if hint else ""
