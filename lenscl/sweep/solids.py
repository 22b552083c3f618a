"""What a user's expression is like in the bounds promised for it, by looking at a grid of places there."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from lenscl.config import Lens
from lenscl.expr import Expr, evaluate
from lenscl.lenses import Box

_PLACES = 33  # along each side of the bounds; odd, so that the centre is one of them


def solid_spots(lens: Lens) -> Iterator[tuple[str, str]]:
    """Yield (kind, message) for what is odd about a lens's solid; the catalogue's are known to be sound."""
    surface = lens.surface
    if surface.promised is None:
        return
    lowest, lacking = _look(surface.expression, tuple(sorted(lens.values.items())), surface.promised)
    if not lowest < 0.0:
        yield (
            "no-inside",
            f"no point with F < 0 found in its bounds, at {_PLACES**3} places: no lens will be seen, unless the solid "
            "is very thin; an expression that changes no sign, such as a squared one, has no inside",
        )
    if lacking > 0.0:
        share = max(0.1, 100.0 * lacking)
        yield "no-value", f"F has no value in part of its bounds ({share:.1f} % of them); rays there end undecided"


@lru_cache(maxsize=1024)  # a sweep of anything else asks for the same solid at every point
def _look(expression: Expr, values: tuple[tuple[str, float], ...], bounds: Box) -> tuple[float, float]:
    """Return the least value of F in the bounds, Inf if it has none, and the share of places where it has none."""
    sides = (np.linspace(low, high, _PLACES) for low, high in zip(*bounds, strict=True))
    x, y, z = np.meshgrid(*sides, indexing="ij", sparse=True)
    found = evaluate(expression, {**dict(values), "x": x, "y": y, "z": z})
    lacks = np.isnan(found)
    return float(np.where(lacks, np.inf, found).min()), float(lacks.mean())
