"""Surfaces that a user writes as an expression."""

from __future__ import annotations

import keyword
import re
from collections.abc import Collection
from dataclasses import dataclass

from lenscl.errors import ExpressionError
from lenscl.expr import FUNCTIONS, Expr, Facts, never_negative, parse, root_polynomial, sign_form
from lenscl.expr.planar import planes_of
from lenscl.lenses.solid import Box, Parameter, Surface, Values

COORDINATES = ("x", "y", "z")
LENS_TABLE_KEYS = frozenset(
    [
        "surface",
        "name",
        "centre",
        "stretch",
        "rotate",
        "n",
        "bounds",
        "planes",
        "absorption",
        "absorbs",
        "priority",
        "mirror",
    ]
)  # parameters stand beside these in a study file
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")
_LARGEST = 1e300


@dataclass(frozen=True, slots=True)
class _NeverNegative:
    """Whether some expressions are proved never to be negative for these values of the parameters."""

    exprs: tuple[Expr, ...]

    def __call__(self, values: Values) -> bool:
        return all(never_negative(each, values) for each in self.exprs)


def user_surface(text: str, parameters: Collection[str], bounds: Box) -> Surface:
    """Make a surface of a user's expression.

    What is searched is an expression of the same sign, `lenscl.expr.sign_form`: that of tanh(5*F) is F.

    Parameters
    ----------
    text : str
        F in x, y, z and the parameters, negative inside.
    parameters : collection of str
        The names of its numbers.
    bounds : Box
        The user's promise: the solid lies strictly inside. `Surface.problems` looks whether it does.

    Raises
    ------
    ExpressionError
        If the text is refused, depends on none of x, y, z, or a parameter's name cannot be used.
    """
    for name in parameters:
        wrong = _name_problem(name)
        if wrong is not None:
            found = re.search(rf"\b{re.escape(name)}\b", text)
            raise ExpressionError(f"parameter {name!r}: {wrong}", text, found.start() if found else 0)
    expression = parse(text, [*COORDINATES, *parameters], own="in the lens table")
    if not expression.depends_on(COORDINATES):
        raise ExpressionError("a surface must depend on x, y or z; this is the same everywhere", text, 0)
    form = sign_form(expression, Facts(bounds))
    planes = planes_of(form)
    polynomial, conditions = root_polynomial(form) or (None, ())
    return Surface(
        name="expression",
        expression=form,
        written=None if form is expression else expression,
        polynomial=polynomial,
        holds=_NeverNegative(conditions) if conditions else None,
        parameters=tuple(
            Parameter(name=name, default=0.0, low=-_LARGEST, high=_LARGEST, meaning="of the expression")
            for name in parameters
        ),
        summary="an expression",
        formula=text,
        source="the study",
        promised=bounds,
        is_convex=bool(planes),
    )


def _name_problem(name: str) -> str | None:
    if name in COORDINATES:
        return "x, y and z are the coordinates; give it another name"
    if name in FUNCTIONS:
        return "this is a function; give it another name"
    if name in LENS_TABLE_KEYS:
        return "this is a key of the lens table; give it another name"
    if keyword.iskeyword(name):
        return "this word cannot be read as a name; give it another one"
    if not _NAME.fullmatch(name):
        return "a name is a letter, then at most 39 letters, digits or _"
    return None
