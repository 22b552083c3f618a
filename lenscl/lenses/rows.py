"""What the rows of the catalogue are written with."""

from __future__ import annotations

from lenscl.expr import Expr, parse
from lenscl.lenses.solid import Parameter

LARGEST = 1e12  # of a length: its fourth power still fits single precision a thousand times smaller, and double always


def length(name: str, default: float, meaning: str) -> Parameter:
    """Return a parameter that is a length, more than 0."""
    return Parameter(name=name, default=default, low=0.0, low_open=True, high=LARGEST, meaning=meaning)


def signed(name: str, default: float, meaning: str) -> Parameter:
    """Return a parameter that may be of either sign, or 0."""
    return Parameter(name=name, default=default, low=-LARGEST, high=LARGEST, meaning=meaning)


def read(text: str, *parameters: str) -> Expr:
    """Return F, written in x, y, z and the parameters."""
    return parse(text, ["x", "y", "z", *parameters])


def spelled(value: float, *, up: bool) -> str:
    """Spell a limit in six digits, on its permitted side."""
    text = f"{value:.6g}"
    if float(text) < value if up else float(text) > value:
        text = f"{value * (1 + 5e-6 if up else 1 - 5e-6):.6g}"
    return text
