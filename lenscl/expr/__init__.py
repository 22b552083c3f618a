"""Expressions: text in, one graph, and from one table of operations everything that is made of it.

`parse` reads text by a whitelist; `evaluate`, `evaluate_with_error` and `bounds` compute with numpy; `differentiate`,
`gradient` and `polynomial` make further graphs; `c_text` spells them in OpenCL C with shared parts named.

>>> from lenscl.expr import gradient, parse
>>> F = parse("(R - sqrt(x^2 + y^2))^2 + z^2 - r^2", symbols=["x", "y", "z", "R", "r"])
>>> print(gradient(F)[2])
2 * z
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from lenscl.expr.c_writer import CText, c_text
from lenscl.expr.creases import creased
from lenscl.expr.derive import degree, derivative_along, differentiate, gradient, magnitude, pieces, polynomial
from lenscl.expr.facts import Facts
from lenscl.expr.graph import Expr, build, digest, number, symbol
from lenscl.expr.interval_writer import band_text
from lenscl.expr.jumps import jumps
from lenscl.expr.operations import OPERATIONS, Operation
from lenscl.expr.reader import parse
from lenscl.expr.root_free import never_negative, root_polynomial
from lenscl.expr.sign_form import sign_form
from lenscl.expr.twice_writer import is_rational, twice_text
from lenscl.expr.words import FUNCTIONS

if TYPE_CHECKING:  # these compute with numpy, which reading and writing expressions does not wait for
    from lenscl.expr.enclose import bounds, least
    from lenscl.expr.undefined import why_undefined
    from lenscl.expr.values import evaluate, evaluate_together, evaluate_with_error

__all__ = [
    "FUNCTIONS",
    "OPERATIONS",
    "CText",
    "Expr",
    "Facts",
    "Operation",
    "band_text",
    "bounds",
    "build",
    "c_text",
    "creased",
    "degree",
    "derivative_along",
    "differentiate",
    "digest",
    "evaluate",
    "evaluate_together",
    "evaluate_with_error",
    "gradient",
    "is_rational",
    "jumps",
    "least",
    "magnitude",
    "never_negative",
    "number",
    "parse",
    "pieces",
    "polynomial",
    "root_polynomial",
    "sign_form",
    "symbol",
    "twice_text",
    "why_undefined",
]

_NUMERIC = {
    "bounds": "enclose",
    "least": "enclose",
    "evaluate": "values",
    "evaluate_together": "values",
    "evaluate_with_error": "values",
    "why_undefined": "undefined",
}


def __getattr__(name: str) -> Any:
    if name not in _NUMERIC:
        raise AttributeError(f"module 'lenscl.expr' has no attribute {name!r}")
    return getattr(import_module(f"lenscl.expr.{_NUMERIC[name]}"), name)
