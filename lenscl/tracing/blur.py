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
from lenscl.expr import Expr, evaluate, evaluate_with_error
from lenscl.lenses import coat_functions
from lenscl.methods import Method
from lenscl.tracing.filled import extent
from lenscl.tracing.placement import Placement

_EPSILON = {"single": 2.0**-23, "double": 2.0**-52}
_SAMPLES = 4096  # of the box
_NEAREST = 0.1  # of them, by |F|: those that say what F's rounding is near the surface
_ROOM = 2.0  # times what was seen
_FEW = 256  # samples that show what a rounded parameter changes
_MOST_PARAMETERS = 24  # that are looked at one by one


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


def coat_noise(lens: Lens, precision: Literal["single", "double"]) -> float:
    """Return what rounding may change of the functions of a lens's mirrored faces and of its others, near its surface.

    In single precision the parameters are rounded, too.
    """
    coats = coat_functions(lens.surface, lens.coated)
    noise = sum(_noise(lens.solid, each, lens.surface.expression) for each in coats)
    if precision == "double":
        return noise
    noise *= _EPSILON["single"] / _EPSILON["double"]
    if len(lens.values) > _MOST_PARAMETERS:  # planes: each number rounds no more than its product does in that noise
        return 2.0 * noise
    return noise + sum(_moved_by_parameters(lens.solid, each) for each in coats)


@lru_cache(maxsize=256)
def _moved_by_parameters(lens: Lens, expression: Expr) -> float:
    """Return what rounding of a lens's parameters to single precision changes of an expression, in its box."""
    low, high = extent(lens)
    at = dict(zip("xyz", np.random.default_rng(0).uniform(low, high, (_FEW, 3)).T, strict=True))
    usual = evaluate(expression, {**lens.values, **at})
    moved = 0.0
    for name, value in lens.values.items():
        if (rounded := float(np.float32(value))) != value and expression.depends_on([name]):
            off = np.abs(evaluate(expression, {**lens.values, name: rounded, **at}) - usual)
            moved += float(off[np.isfinite(off)].max(initial=0.0))
    return moved


def _size(lens: Lens) -> float:
    """Return half the diagonal of what the solid fills, in the world."""
    return replace(Placement.of(lens), box=np.stack(extent(lens))).diagonal() / 2.0


@lru_cache(maxsize=256)
def _noise(lens: Lens, expression: Expr, surface: Expr | None = None) -> float:
    """Return what double precision may lose of an expression near the surface, where it is 0 unless that is given."""
    low, high = extent(lens)
    points = np.random.default_rng(0).uniform(low, high, (_SAMPLES, 3))
    f, rounding = evaluate_with_error(expression, {**lens.values, **dict(zip("xyz", points.T, strict=True))})
    f, rounding = (np.broadcast_to(each, _SAMPLES) for each in (f, rounding))
    if surface is not None:
        f = evaluate(surface, {**lens.values, **dict(zip("xyz", points.T, strict=True))})
    is_known = np.isfinite(f) & np.isfinite(rounding)
    if not is_known.any():
        return float("inf")
    f, rounding = np.abs(f[is_known]), rounding[is_known]
    return _ROOM * float(rounding[f <= np.quantile(f, _NEAREST)].max())
