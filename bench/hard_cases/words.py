"""The words of expressions that came later than the first edition: each in a solid whose rays are decided."""

from __future__ import annotations

from collections.abc import Iterator

from hard_cases.aims import aimed_case, down_on, generator
from hard_cases.scenes import scene, user
from lenscl.hardcases import Case

_EDITION, _RAYS = 3, 30
_SOLIDS = (
    (
        "arcs",
        "max(x^2 + y^2 + z^2 - 0.7, asin(0.8*x) + acos(0.8*y) - pi/2 + 0.2*atan(3*z))",
        "a sheet within their domains",
    ),
    ("hyperbolic", "cosh(1.5*x) + sinh(y)^2 + z^2 - 1.5", "a smooth convex solid"),
    (
        "jumps beside the solid",
        "x^2 + y^2 + z^2 - 0.6 + 0.05*sign(x + 3) + 0.05*floor(0.3*x + 1.5) + 0.1*mod(x + 2, 10)",
        "sign, floor and mod have no jump within the bounds",
    ),
)


def cases() -> Iterator[Case]:
    """Yield them."""
    for what, text, why in _SOLIDS:
        name = f"words: {what}"
        yield aimed_case(
            name, "words", why, scene(user(text, 1.2)), down_on(generator(name), _RAYS, 0.9), edition=_EDITION
        )
