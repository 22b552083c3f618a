"""The one table of operations. A row holds all that is known of an operation; every other module reads it here.

Derivatives and polynomials are rules on nodes. The numeric rules take the module that they compute with as their
first argument (`np` is numpy, `iv` is `lenscl.expr.intervals`): reading and differentiating text imports no numpy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from lenscl.expr import norms
from lenscl.expr.graph import Expr, build, number
from lenscl.expr.simplify import ZERO, power

Coefficients = tuple[Expr, ...]  # of 1, t, t^2, ...

# How tightly an operation binds, for brackets in text
CHOICE, SUM, NEGATION, PRODUCT, POWER, ATOM = range(6)
FREE = CHOICE  # an operand between commas never needs brackets


@dataclass(frozen=True, slots=True, kw_only=True)
class Operation:
    """One row.

    Attributes
    ----------
    arity : int
        Number of operands.
    user : bool
        Whether a user may call it by its name.
    evaluate : callable(np, *operands)
        The meaning, on float64 arrays. Every other rule is tested against it.
    derivative : callable(node, *operands, *their derivatives)
        The derivative of the node.
    polynomial : callable(*operands) or None
        Coefficients from coefficients, or None where there is none; without a rule only constants stay polynomials.
    interval : callable(iv, *operands)
        Outward-rounded enclosure from enclosures. It contains the exact value and the computed one.
    rounding : callable(np, value, *operands, *their errors) or None
        Bound on the error of the computed value; without a rule it comes from `interval`.
    text, c : str
        Infix spelling, and OpenCL C.
    level, needs, c_level, c_needs : int, tuple of int
        How tightly it binds, and how tightly each operand must; in C, if that differs.
    named : bool
        In C the operands stand more than once, so they must be names.
    stem : str
        What a temporary that holds it is called.
    fragments : tuple of str
        Files of kernels/ beyond the vocabulary that its C text calls functions of.
    """

    name: str
    arity: int
    evaluate: Callable[..., Any]
    derivative: Callable[..., Expr]
    interval: Callable[..., Any]
    text: str
    c: str
    stem: str
    polynomial: Callable[..., Coefficients | None] | None = None
    rounding: Callable[..., Any] | None = None
    user: bool = True
    level: int = ATOM
    needs: tuple[int, ...] = ()
    c_level: int | None = None
    c_needs: tuple[int, ...] | None = None
    named: bool = False
    fragments: tuple[str, ...] = ()


UNIT_ROUNDOFF = 2.0**-53
TINY = 5e-324  # what a product or quotient may lose to underflow


def _call(name: str, arity: int) -> str:
    return f"{name}({', '.join(['{}'] * arity)})"


def _function(name: str, arity: int, **rules: Any) -> Operation:
    """Row of a function that is called alike in text and in C unless told."""
    defaults = {"text": _call(name, arity), "c": _call(name, arity), "stem": name, "needs": (FREE,) * arity}
    return Operation(name=name, arity=arity, **(defaults | rules))


def _paired(op: str, u: Coefficients, v: Coefficients) -> Coefficients:
    n = max(len(u), len(v))
    u, v = u + (ZERO,) * (n - len(u)), v + (ZERO,) * (n - len(v))
    return tuple(build(op, a, b) for a, b in zip(u, v, strict=True))


def _product(u: Coefficients, v: Coefficients) -> Coefficients:
    total = [ZERO] * (len(u) + len(v) - 1)
    for i, a in enumerate(u):
        for j, b in enumerate(v):
            total[i + j] = total[i + j] + a * b
    return tuple(total)


def _square(u: Coefficients) -> Coefficients:
    total = [ZERO] * (2 * len(u) - 1)
    for i, a in enumerate(u):
        total[2 * i] = total[2 * i] + power(a, 2)
        for j in range(i + 1, len(u)):
            total[i + j] = total[i + j] + 2.0 * a * u[j]
    return tuple(total)


def _power_polynomial(u: Coefficients, n: Coefficients) -> Coefficients:
    exponent = whole(n[0])
    result: Coefficients = (number(1.0),)
    for bit in bin(exponent)[2:]:
        result = _square(result) if len(result) > 1 else (power(result[0], 2),)
        if bit == "1":
            result = _product(result, u)
    return result


def whole(n: Expr) -> int:
    """Return the exponent of an integer power."""
    assert n.value is not None
    return int(n.value)


def integer_power(u: Any, n: int) -> Any:
    """Raise to the power n >= 0 by the products that the C text uses: u^n = (u^(n/2))^2, or u^(n-1) u."""
    if n <= 1:
        return u**n
    if n % 2:
        return integer_power(u, n - 1) * u
    half = integer_power(u, n // 2)
    return half * half


def _power_rounding(np: Any, w: Any, u: Any, n: Any, eu: Any, _en: Any) -> Any:
    size, reach = np.abs(u), np.abs(u) + eu
    # n - 1 products of relative error u each; 4 more for the terms of this line itself
    return (
        integer_power(reach, int(n))
        - integer_power(size, int(n))
        + (int(n) + 4) * UNIT_ROUNDOFF * integer_power(reach, int(n))
        + int(n) * TINY
    )


def _quotient_rounding(np: Any, w: Any, u: Any, v: Any, eu: Any, ev: Any) -> Any:
    room = np.abs(v) - ev  # the divisor's least size
    return np.where(room > 0.0, (eu + np.abs(w) * ev) / np.where(room > 0.0, room, 1.0), np.inf) + (
        2 * UNIT_ROUNDOFF * np.abs(w) + TINY
    )


def _choice_rounding(np: Any, w: Any, u: Any, v: Any, eu: Any, ev: Any) -> Any:
    sure = np.abs(u - v) * (1.0 - 4 * UNIT_ROUNDOFF) > eu + ev
    return np.where(sure, np.where(w == u, eu, ev), np.maximum(eu, ev))


def _where_rounding(np: Any, w: Any, a: Any, b: Any, u: Any, v: Any, ea: Any, eb: Any, eu: Any, ev: Any) -> Any:
    sure = np.abs(a - b) * (1.0 - 4 * UNIT_ROUNDOFF) > ea + eb
    either = np.maximum(np.abs(u - w) + eu, np.abs(v - w) + ev)
    return np.where(sure, np.where(a < b, eu, ev), either)


def _where(a: Expr, b: Expr, u: Expr, v: Expr) -> Expr:
    return build("where", a, b, u, v)


def _other_leg(u: Expr) -> Expr:
    """Return sqrt(1 - u^2), of which nothing cancels near u = 1 and u = -1."""
    return build("sqrt", (1.0 - u) * (1.0 + u))


_ROWS: tuple[Operation, ...] = (
    Operation(
        name="+", arity=2, user=False, stem="sum", text="{} + {}", c="{} + {}", level=SUM, needs=(SUM, PRODUCT),
        evaluate=lambda np, u, v: u + v,
        derivative=lambda w, u, v, du, dv: du + dv,
        polynomial=lambda u, v: _paired("+", u, v),
        interval=lambda iv, u, v: iv.add(u, v),
        rounding=lambda np, w, u, v, eu, ev: eu + ev + UNIT_ROUNDOFF * np.abs(w),
    ),
    Operation(
        name="-", arity=2, user=False, stem="difference", text="{} - {}", c="{} - {}", level=SUM, needs=(SUM, PRODUCT),
        evaluate=lambda np, u, v: u - v,
        derivative=lambda w, u, v, du, dv: du - dv,
        polynomial=lambda u, v: _paired("-", u, v),
        interval=lambda iv, u, v: iv.add(u, iv.negate(v)),
        rounding=lambda np, w, u, v, eu, ev: eu + ev + UNIT_ROUNDOFF * np.abs(w),
    ),
    Operation(
        name="neg", arity=1, user=False, stem="negative", text="-{}", c="-{}", level=NEGATION, needs=(PRODUCT,),
        evaluate=lambda np, u: -u,
        derivative=lambda w, u, du: -du,
        polynomial=lambda u: tuple(-each for each in u),
        interval=lambda iv, u: iv.negate(u),
        rounding=lambda np, w, u, eu: eu,
    ),
    Operation(
        name="*", arity=2, user=False, stem="product", text="{} * {}", c="{} * {}", level=PRODUCT,
        needs=(PRODUCT, POWER),
        evaluate=lambda np, u, v: u * v,
        derivative=lambda w, u, v, du, dv: du * v + u * dv,
        polynomial=_product,
        interval=lambda iv, u, v: iv.multiply(u, v),
        rounding=lambda np, w, u, v, eu, ev: (
            _scaled_error(np, u, ev) + _scaled_error(np, v, eu) + eu * ev + UNIT_ROUNDOFF * np.abs(w) + TINY
        ),
    ),
    Operation(
        name="/", arity=2, user=False, stem="quotient", text="{} / {}", c="{} / {}", level=PRODUCT,
        needs=(PRODUCT, POWER),
        evaluate=lambda np, u, v: np.true_divide(u, v),
        derivative=lambda w, u, v, du, dv: du / v if dv is ZERO else (du - w * dv) / v,
        polynomial=lambda u, v: tuple(each / v[0] for each in u) if len(v) == 1 else None,
        interval=lambda iv, u, v: iv.divide(u, v),
        rounding=_quotient_rounding,
    ),
    Operation(
        name="power", arity=2, user=False, stem="power", text="{}^{}", c="", level=POWER, needs=(ATOM, ATOM),
        evaluate=lambda np, u, n: integer_power(u, int(n)),
        derivative=lambda w, u, n, du, dn: float(whole(n)) * power(u, whole(n) - 1) * du,
        polynomial=_power_polynomial,
        interval=lambda iv, u, n: iv.integer_power(u, int(n.lo)),
        rounding=_power_rounding,
    ),
    _function(
        "sqrt", 1, stem="root",
        evaluate=lambda np, u: np.sqrt(u),
        derivative=lambda w, u, du: du / (2.0 * w),
        interval=lambda iv, u: iv.rising(u, "sqrt", ulps=1, domain=0.0, least=0.0),
    ),
    _function(
        "cbrt", 1, stem="cube_root", c="cbrt{on_lanes}({0})",
        evaluate=lambda np, u: np.cbrt(u),
        derivative=lambda w, u, du: du / (3.0 * power(w, 2)),
        interval=lambda iv, u: iv.rising(u, "cbrt", ulps=4),
    ),
    _function(
        "abs", 1, stem="size", named=True, c_level=CHOICE, c_needs=(POWER,), c="{0} < {zero} ? -{0} : {0}",
        evaluate=lambda np, u: np.where(u < 0.0, -u, u),
        derivative=lambda w, u, du: _where(u, ZERO, -du, du),
        interval=lambda iv, u: iv.magnitude(u),
        rounding=lambda np, w, u, eu: eu,
    ),
    _function(
        "min", 2, stem="least", named=True, c_level=CHOICE, c_needs=(SUM, SUM), c="{0} < {1} ? {0} : {1}",
        evaluate=lambda np, u, v: np.where(u < v, u, v),
        derivative=lambda w, u, v, du, dv: _where(u, v, du, dv),
        interval=lambda iv, u, v: iv.least(u, v),
        rounding=_choice_rounding,
    ),
    _function(
        "max", 2, stem="greatest", named=True, c_level=CHOICE, c_needs=(SUM, SUM), c="{0} < {1} ? {1} : {0}",
        # u where they are equal, where min takes v: so min + max = u + v, and their derivatives too
        evaluate=lambda np, u, v: np.where(u < v, v, u),
        derivative=lambda w, u, v, du, dv: _where(u, v, dv, du),
        interval=lambda iv, u, v: iv.negate(iv.least(iv.negate(v), iv.negate(u))),
        rounding=_choice_rounding,
    ),
    _function(
        "where", 4, user=False, stem="branch", text="{} < {} ? {} : {}", c="{} < {} ? {} : {}",
        level=CHOICE, needs=(SUM,) * 4,
        evaluate=lambda np, a, b, u, v: np.where(a < b, u, v),
        derivative=lambda w, a, b, u, v, da, db, du, dv: _where(a, b, du, dv),
        interval=lambda iv, a, b, u, v: iv.where(a, b, u, v),
        rounding=_where_rounding,
    ),
    _function(
        "exp", 1,
        evaluate=lambda np, u: np.exp(u),
        derivative=lambda w, u, du: w * du,
        interval=lambda iv, u: iv.rising(u, "exp", ulps=4, least=0.0),
    ),
    _function(
        "log", 1,
        evaluate=lambda np, u: np.log(u),
        derivative=lambda w, u, du: du / u,
        interval=lambda iv, u: iv.rising(u, "log", ulps=4, domain=0.0),
    ),
    _function(
        "sin", 1, c="sin{on_lanes}({0})",
        evaluate=lambda np, u: np.sin(u),
        derivative=lambda w, u, du: build("cos", u) * du,
        interval=lambda iv, u: iv.sine(u),
    ),
    _function(
        "cos", 1, c="cos{on_lanes}({0})",
        evaluate=lambda np, u: np.cos(u),
        derivative=lambda w, u, du: -build("sin", u) * du,
        interval=lambda iv, u: iv.cosine(u),
    ),
    _function(
        "tan", 1, c="tan{on_lanes}({0})",
        evaluate=lambda np, u: np.tan(u),
        derivative=lambda w, u, du: (1.0 + power(w, 2)) * du,
        interval=lambda iv, u: iv.tangent(u),
    ),
    _function(
        "atan2", 2, stem="angle",
        evaluate=lambda np, u, v: np.arctan2(u, v),
        derivative=lambda w, u, v, du, dv: (v * du - u * dv) / (power(v, 2) + power(u, 2)),
        interval=lambda iv, u, v: iv.angle(u, v),
    ),
    _function(
        "asin", 1, stem="arc", c="asin{on_lanes}({0})", fragments=("arcs.cl",),
        evaluate=lambda np, u: np.arcsin(u),
        derivative=lambda w, u, du: du / _other_leg(u),
        interval=lambda iv, u: iv.arc_sine(u),
    ),
    _function(
        "acos", 1, stem="arc", c="acos{on_lanes}({0})", fragments=("arcs.cl",),
        evaluate=lambda np, u: np.arccos(u),
        derivative=lambda w, u, du: -du / _other_leg(u),
        interval=lambda iv, u: iv.arc_cosine(u),
    ),
    _function(
        "atan", 1, stem="arc", c="atan{on_lanes}({0})", fragments=("arcs.cl",),
        evaluate=lambda np, u: np.arctan(u),
        derivative=lambda w, u, du: du / (1.0 + power(u, 2)),
        interval=lambda iv, u: iv.arc_tangent(u),
    ),
    _function(
        "sinh", 1, c="sinh{on_lanes}({0})", fragments=("hyperbolics.cl",),
        evaluate=lambda np, u: np.sinh(u),
        derivative=lambda w, u, du: build("cosh", u) * du,
        interval=lambda iv, u: iv.rising(u, "sinh", ulps=4),
    ),
    _function(
        "cosh", 1, c="cosh{on_lanes}({0})", fragments=("hyperbolics.cl",),
        evaluate=lambda np, u: np.cosh(u),
        derivative=lambda w, u, du: build("sinh", u) * du,
        interval=lambda iv, u: iv.rising(iv.magnitude(u), "cosh", ulps=4, least=1.0),
    ),
    _function(
        "tanh", 1,
        evaluate=lambda np, u: np.tanh(u),
        derivative=lambda w, u, du: (1.0 - power(w, 2)) * du,
        interval=lambda iv, u: iv.rising(u, "tanh", ulps=4, least=-1.0, greatest=1.0),
    ),
    _function(
        "hypot", 2, stem="distance",
        evaluate=lambda np, u, v: np.hypot(u, v),
        derivative=lambda w, u, v, du, dv: (u * du + v * dv) / w,
        interval=lambda iv, u, v: iv.distance(u, v),
    ),
    _function(
        "pow", 2, stem="pow", named=True, c_level=CHOICE, c_needs=(SUM, FREE),
        c="{0} < {zero} ? {nan} : pow{on_lanes}({0}, {1})",  # not powr: it is NaN for 0^0
        evaluate=lambda np, u, p: np.where(u >= 0.0, np.power(u, p), np.nan),
        derivative=lambda w, u, p, du, dp: (
            p * build("pow", u, p - 1.0) * du if dp is ZERO else w * (dp * build("log", u) + p * du / u)
        ),
        interval=lambda iv, u, p: iv.real_power(u, p),
    ),
    _function(
        "sign", 1, stem="side", c="sign{on_lanes}({0})", fragments=("jumps.cl",),
        evaluate=lambda np, u: np.sign(u),  # 0 at 0
        derivative=lambda w, u, du: ZERO,  # but where it jumps: see lenscl.expr.jumps
        interval=lambda iv, u: iv.stepping(u, "sign"),
    ),
    _function(
        "floor", 1, stem="whole", c="floor{on_lanes}({0})", fragments=("jumps.cl",),
        evaluate=lambda np, u: np.floor(u),
        derivative=lambda w, u, du: ZERO,
        interval=lambda iv, u: iv.stepping(u, "floor"),
    ),
    _function(
        "norm", 3, user=False, c="norm_v({0}, {1}, {2})", fragments=("norms.cl",),
        evaluate=norms.value,
        derivative=norms.derivative,
        interval=lambda iv, u, v, p: iv.norm(u, v, p),
    ),
    _function(
        "norm_slope", 3, user=False, c="norm_slope_v({0}, {1}, {2})", stem="lean", fragments=("norms.cl",),
        evaluate=norms.slope,
        derivative=norms.derivative_of_slope,
        interval=lambda iv, u, v, p: iv.norm_slope(u, v, p),
    ),
)  # fmt: skip


def _scaled_error(np: Any, u: Any, error: Any) -> Any:
    """Return |u| error, 0 where the error is 0 (also for an infinite u)."""
    return np.where(error == 0.0, 0.0, np.abs(u) * error)


OPERATIONS: dict[str, Operation] = {row.name: row for row in _ROWS}
