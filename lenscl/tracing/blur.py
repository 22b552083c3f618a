"""How far rounding may move the places where rays meet a lens: what tells contact from a gap.

Where two surfaces are met within that of each other, they are taken as one interface. It is an estimate with room to
spare, not a bound that is proved: F's rounding is looked at in samples of the box, and taken for the whole surface.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Literal

import numpy as np

from lenscl.config import Lens
from lenscl.expr import Expr, evaluate_with_error
from lenscl.methods import Method
from lenscl.tracing.filled import extent
from lenscl.tracing.placement import Placement

_EPSILON = {"single": 2.0**-23, "double": 2.0**-52}
_SAMPLES = 4096  # of the box
_NEAREST = 0.1  # of them, by |F|: those that say what F's rounding is near the surface
_ROOM = 2.0  # times what was seen


def blur_of(lens: Lens, expression: Expr, precision: Literal["single", "double"]) -> Mapping[str, float]:
    """Return what rounding may change of F near a lens's surface, and the lens's size in the world.

    Parameters
    ----------
    lens : Lens
    expression : Expr
        F as the kernel computes it.
    precision : str
        That rays are carried in.
    """
    return {
        "noise": _noise(lens.solid, expression) * _EPSILON[precision] / _EPSILON["double"],
        "size": _size(lens),
    }


def searched(lens: Lens, method: Method) -> Expr:
    """Return F of a lens as its method computes it."""
    return (lens.surface.polynomial_form if method.wants_polynomial else None) or lens.surface.expression


def _size(lens: Lens) -> float:
    """Return half the diagonal of what the solid fills, in the world."""
    return replace(Placement.of(lens), box=np.stack(extent(lens))).diagonal() / 2.0


@lru_cache(maxsize=256)
def _noise(lens: Lens, expression: Expr) -> float:
    """Return what double precision may lose of F near the surface."""
    low, high = extent(lens)
    points = np.random.default_rng(0).uniform(low, high, (_SAMPLES, 3))
    f, rounding = evaluate_with_error(expression, {**lens.values, **dict(zip("xyz", points.T, strict=True))})
    f, rounding = (np.broadcast_to(each, _SAMPLES) for each in (f, rounding))
    is_known = np.isfinite(f) & np.isfinite(rounding)
    if not is_known.any():
        return float("inf")
    f, rounding = np.abs(f[is_known]), rounding[is_known]
    return _ROOM * float(rounding[f <= np.quantile(f, _NEAREST)].max())
