"""Angles that make an expression jump where they turn over, told from those that do not."""

from __future__ import annotations

import numpy as np
import pytest

from lenscl.expr import evaluate, jumps, parse

SMOOTH = (
    "x + y*z",
    "cos(5*atan2(y, x))",
    "x - 0.1*sin(2*atan2(y, x) + z)^2",
    "tan(-3*atan2(y, x) + atan2(y, x))",
    "cos(atan2(y, x)/0.5 - k)",
    "exp(sin(4*(atan2(y, x) + x)))",
)
STEPPING = ("sign(x)", "floor(3*x) + y", "mod(x + 0.25, 0.5)^2", "x*sign(x)", "max(z, mod(x, y))")
JUMPING = (
    "atan2(y, x)",
    "atan2(y, x) + z",
    "sin(0.5*atan2(y, x))",
    "sin(k*atan2(y, x))",
    "sin(atan2(y, x)^3)",
    "x*atan2(y, x)",
    "max(abs(atan2(y, x)) - 3, z)",
    "cos(2*atan2(y, x)) + atan2(y, x)",
)
NAMES = ["x", "y", "z", "k"]


@pytest.mark.parametrize("text", SMOOTH)
def test_whole_turns_through_waves_are_no_jump(text: str) -> None:
    assert jumps(parse(text, NAMES)) == ()
    assert gap(text) < 1e-6


@pytest.mark.parametrize("text", JUMPING)
def test_other_angles_jump(text: str) -> None:
    (angle,) = jumps(parse(text, NAMES))
    assert str(angle) == "atan2(y, x)"
    assert gap(text) > 1e-3 or text.startswith("max(abs")  # of which the two sides are alike, and nothing is known


@pytest.mark.parametrize("text", STEPPING)
def test_every_sign_and_floor_may_jump(text: str) -> None:
    (step,) = jumps(parse(text, NAMES))
    assert step.op == ("sign" if "sign" in text else "floor")
    assert str(step) in str(parse(text, NAMES))


def gap(text: str) -> float:
    """Return the largest difference across the cut, at a few places beside it."""
    x, z = np.linspace(-1.3, -0.1, 7), np.linspace(-0.4, 0.5, 7)
    sides = [evaluate(parse(text, NAMES), {"x": x, "y": y + 0 * x, "z": z, "k": 1.3}) for y in (1e-9, -1e-9)]
    return float(np.abs(sides[0] - sides[1]).max())
