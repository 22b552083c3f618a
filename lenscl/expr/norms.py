"""The norm (|u|^p + |v|^p)^(1/p), p >= 1, its slope by u, and their derivatives.

Let m be the larger of |u| and |v|, and r <= 1 the ratio of the smaller to m. The norm is m (1 + r^p)^(1/p). No base of
a power exceeds 2, so no power overflows. At u = v = 0 the norm is 0. The slope is sign(u) (|u| / norm)^(p - 1), between
-1 and 1. Norm and slope are smooth where |u| = |v|, though m and r have a crease there. The slope is 0 where u is 0.
For p = 1 the norm has an edge there, and 0 is the mean of the slopes on both sides.
"""

from __future__ import annotations

from typing import Any

from lenscl.expr.graph import Expr, build, number


def _powers(np: Any, u: Any, v: Any, p: Any) -> tuple[Any, Any, Any, Any]:
    """Return m, r^p, r^(p - 1) and (1 + r^p)^(1 / p - 1)."""
    first, second = np.abs(u), np.abs(v)
    large, small = np.maximum(first, second), np.minimum(first, second)
    ratio = np.where(large > 0.0, small / np.where(large > 0.0, large, 1.0), 0.0)
    of_small = np.power(ratio, p - 1.0)
    above = ratio * of_small
    return large, above, of_small, np.power(1.0 + above, 1.0 / p - 1.0)


def value(np: Any, u: Any, v: Any, p: Any) -> Any:
    """Return the norm, on float64 arrays."""
    large, above, _, of_both = _powers(np, u, v, p)
    return large * ((1.0 + above) * of_both)


def slope(np: Any, u: Any, v: Any, p: Any) -> Any:
    """Return its slope by u, on float64 arrays."""
    large, _, of_small, of_both = _powers(np, u, v, p)
    size = np.where(np.abs(u) >= np.abs(v), 1.0, of_small) * of_both
    return np.where(np.isnan(large), np.nan, np.sign(u) * size)


def derivative(w: Expr, u: Expr, v: Expr, p: Expr, du: Expr, dv: Expr, dp: Expr) -> Expr:
    """Differentiate the norm w."""
    by_p = w / p * _mean_logarithm(u, v, w, p)
    return build("norm_slope", u, v, p) * du + build("norm_slope", v, u, p) * dv + by_p * dp


def derivative_of_slope(w: Expr, u: Expr, v: Expr, p: Expr, du: Expr, dv: Expr, dp: Expr) -> Expr:
    """Differentiate the slope w by u."""
    whole, other = build("norm", u, v, p), build("norm_slope", v, u, p)
    share = build("abs", u) / whole
    by_u = (p - 1.0) / whole * build("pow", share, p - 2.0) * (v / whole * other)
    by_v = -((p - 1.0) / whole * w * other)
    by_p = w * (build("log", share) - (p - 1.0) / p * _mean_logarithm(u, v, whole, p))
    return by_u * du + by_v * dv + by_p * dp


def _mean_logarithm(u: Expr, v: Expr, whole: Expr, p: Expr) -> Expr:
    """Return the mean of log(|u| / norm) and log(|v| / norm), weighted by (|u| / norm)^p and (|v| / norm)^p."""
    total = number(0.0)
    for each in (u, v):
        share = build("abs", each) / whole
        total = total + build("pow", share, p) * build("log", share)
    return total
