"""How far rounding may move the places where rays meet a lens: what tells contact from a gap.

Where two surfaces are met within that of each other, they are taken as one interface. It is an estimate with room to
spare, not a bound that is proved: F's rounding is looked at in samples of the box, and taken for the whole surface.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Literal

import numpy as np

from lenscl.config import Lens
from lenscl.expr import evaluate_with_error
from lenscl.tracing.placement import Placement

_EPSILON = {"single": 2.0**-23, "double": 2.0**-52}
_ROUNDINGS = 8  # of a local coordinate: the map, the step to the box and along the ray
_SAMPLES = 4096  # of the box
_NEAREST = 0.1  # of them, by |F|: those that say what F's rounding is near the surface
_ROOM = 2.0  # times what was seen


def blur_of(lens: Lens, reach: float, precision: Literal["single", "double"]) -> Mapping[str, float]:
    """Return what rounding may change of F near a lens's surface, and of each local coordinate.

    Parameters
    ----------
    lens : Lens
    reach : float
        How far points of the scene are from the world's origin, at most, scene units.
    precision : str
        That rays are carried in.
    """
    epsilon = _EPSILON[precision]
    return {
        "noise": _noise(lens) * epsilon / _EPSILON["double"],
        "place": _ROUNDINGS * epsilon * 2.0 * reach * float(np.abs(Placement.of(lens).to_local).sum(axis=1).max()),
    }


def screen_blur(reach: float, precision: Literal["single", "double"]) -> float:
    """Return what rounding may do to a point of a ray, and to its distance from a plane, in scene units."""
    return _ROUNDINGS * _EPSILON[precision] * reach


@lru_cache(maxsize=256)
def _noise(lens: Lens) -> float:
    """Return what double precision may lose of F near the surface."""
    low, high = Placement.of(lens).box
    points = np.random.default_rng(0).uniform(low, high, (_SAMPLES, 3))
    f, rounding = evaluate_with_error(
        lens.surface.expression, {**lens.values, **dict(zip("xyz", points.T, strict=True))}
    )
    f, rounding = (np.broadcast_to(each, _SAMPLES) for each in (f, rounding))
    is_known = np.isfinite(f) & np.isfinite(rounding)
    if not is_known.any():
        return float("inf")
    f, rounding = np.abs(f[is_known]), rounding[is_known]
    return _ROOM * float(rounding[f <= np.quantile(f, _NEAREST)].max())
