"""Every operation of kernels/interval.cl encloses what it says, in both precisions and every packet width."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from methods.bands import Bands
from numpy.typing import NDArray
from probe import FORMS, REALS
from thinned import thinned

from lenscl.expr import OPERATIONS, Expr, band_text, number, symbol
from lenscl.expr.graph import node
from lenscl.expr.interval_writer import CALLS

Array = NDArray[Any]
X, Y, Z, K = (symbol(name) for name in ("x", "y", "z", "k"))
COUNT = 4096
FLAT = node("*", K, K)
CLAMPED = node("min", node("max", X, number(-1.0)), number(1.0))


def norm(u: Any, v: Any, p: Any) -> Any:
    return (np.abs(u) ** p + np.abs(v) ** p) ** (1 / np.longdouble(p))


def lean(u: Any, v: Any, p: Any) -> Any:
    return np.sign(u) * (np.abs(u) / norm(u, v, p)) ** (p - 1)


# An expression, its meaning in long double, and the sign its operands are drawn with
CASES: dict[str, tuple[Expr, Callable[..., Any], str]] = {
    "+": (node("+", X, Y), lambda x, y, z, k: x + y, ""),
    "+ exact": (node("+", X, K), lambda x, y, z, k: x + k, ""),
    "+ rounded": (node("+", X, number(0.1)), lambda x, y, z, k: x + np.longdouble(0.1), ""),
    "-": (node("-", X, Y), lambda x, y, z, k: x - y, ""),
    "- exact": (node("-", K, X), lambda x, y, z, k: k - x, ""),
    "neg": (node("neg", X), lambda x, y, z, k: -x, ""),
    "*": (node("*", X, Y), lambda x, y, z, k: x * y, ""),
    "* exact": (node("*", X, K), lambda x, y, z, k: x * k, ""),
    "* flat": (node("*", X, FLAT), lambda x, y, z, k: x * (k * k), ""),
    "square": (node("*", X, X), lambda x, y, z, k: x * x, ""),
    "power 5": (node("power", X, number(5.0)), lambda x, y, z, k: x**5, ""),
    "power 6": (node("power", X, number(6.0)), lambda x, y, z, k: x**6, ""),
    "/": (node("/", X, Y), lambda x, y, z, k: x / y, ""),
    "/ flat": (node("/", X, FLAT), lambda x, y, z, k: x / (k * k), ""),
    "sqrt": (node("sqrt", X), lambda x, y, z, k: np.sqrt(x), "+"),
    "sqrt of a square": (node("sqrt", node("*", X, X)), lambda x, y, z, k: np.abs(x), ""),
    "cbrt": (node("cbrt", X), lambda x, y, z, k: np.cbrt(x), ""),
    "abs": (node("abs", X), lambda x, y, z, k: np.abs(x), ""),
    "min": (node("min", X, Y), lambda x, y, z, k: np.minimum(x, y), ""),
    "max": (node("max", X, Y), lambda x, y, z, k: np.maximum(x, y), ""),
    "where": (node("where", X, Y, Z, K), lambda x, y, z, k: np.where(x < y, z, k), ""),
    "exp": (node("exp", X), lambda x, y, z, k: np.exp(x), ""),
    "log": (node("log", X), lambda x, y, z, k: np.log(x), "+"),
    "sin": (node("sin", X), lambda x, y, z, k: np.sin(x), ""),
    "cos": (node("cos", X), lambda x, y, z, k: np.cos(x), ""),
    "tan": (node("tan", X), lambda x, y, z, k: np.tan(x), ""),
    "atan2": (node("atan2", X, Y), lambda x, y, z, k: np.arctan2(x, y), ""),
    "asin": (node("asin", X), lambda x, y, z, k: np.arcsin(x), "1"),
    "acos": (node("acos", X), lambda x, y, z, k: np.arccos(x), "1"),
    "asin within": (node("asin", CLAMPED), lambda x, y, z, k: np.arcsin(np.clip(x, -1, 1)), ""),
    "acos within": (node("acos", CLAMPED), lambda x, y, z, k: np.arccos(np.clip(x, -1, 1)), ""),
    "atan": (node("atan", X), lambda x, y, z, k: np.arctan(x), ""),
    "sinh": (node("sinh", X), lambda x, y, z, k: np.sinh(x), ""),
    "cosh": (node("cosh", X), lambda x, y, z, k: np.cosh(x), ""),
    "sign": (node("sign", X), lambda x, y, z, k: np.sign(x), ""),
    "sign of a number": (node("sign", node("+", X, node("sign", K))), lambda x, y, z, k: np.sign(x + np.sign(k)), ""),
    "floor": (node("floor", X), lambda x, y, z, k: np.floor(x), ""),
    "floor of a number": (node("*", X, node("floor", K)), lambda x, y, z, k: x * np.floor(k), ""),
    "tanh": (node("tanh", X), lambda x, y, z, k: np.tanh(x), ""),
    "hypot": (node("hypot", X, Y), lambda x, y, z, k: np.hypot(x, y), ""),
    "pow": (node("pow", X, K), lambda x, y, z, k: np.power(x, k), "+"),
    "pow of a square": (node("pow", node("*", X, X), K), lambda x, y, z, k: np.power(x * x, k), ""),
    "pow flat": (node("pow", X, FLAT), lambda x, y, z, k: np.power(x, k * k), "+"),
    "norm": (node("norm", X, Y, K), lambda x, y, z, k: norm(x, y, k), ""),
    "norm flat": (node("norm", X, Y, FLAT), lambda x, y, z, k: norm(x, y, k * k), ""),
    "norm 1": (node("norm", X, Y, number(1.0)), lambda x, y, z, k: np.abs(x) + np.abs(y), ""),
    "norm_slope": (node("norm_slope", X, Y, K), lambda x, y, z, k: lean(x, y, k), ""),
    "norm_slope flat": (node("norm_slope", X, Y, FLAT), lambda x, y, z, k: lean(x, y, k * k), ""),
}


def drawn(rng: np.random.Generator, dtype: Any, sign: str) -> Array:
    """Return bands (mid, rise, error), as the precision holds them: wide ones, narrow ones, some about zero."""
    mid = rng.choice([-1.0, 1.0], COUNT) * 10.0 ** rng.uniform(-3, 1, COUNT)
    width = np.abs(mid) * 10.0 ** rng.uniform(-9, 0.5, COUNT)
    if sign == "+":
        mid, width = np.abs(mid), np.minimum(width, 0.6 * np.abs(mid))
    if sign == "1":  # up to 1 in size, some all the way
        mid = np.where(np.abs(mid) < 1.0, mid, 1.0 / mid)
        width = np.minimum(width, rng.choice([0.6, 0.99], COUNT) * (1.0 - np.abs(mid)))
    rise = rng.choice([-1.0, 0.0, 1.0], COUNT) * width
    error = rng.choice([0.0, 1e-3, 1.0], COUNT) * width * 0.5
    return np.stack([mid, rise, error], 1).astype(dtype).astype(np.float64)


def places(rng: np.random.Generator) -> Array:
    """Return numbers of [-1, 1], the ends two times of three: an enclosure fails there first."""
    return np.where(rng.random(COUNT) < 2 / 3, rng.choice([-1.0, 1.0], COUNT), rng.uniform(-1, 1, COUNT))


def violations(
    names: Sequence[str], precision: str, width: int, edit: Callable[[str], str] | None = None
) -> dict[str, tuple[int, int]]:
    """Return, for each case, how many values lie outside their band, and how many bands say anything."""
    result = {}
    for sign in ("", "+", "1"):
        chosen = [name for name in names if CASES[name][2] == sign]
        if not chosen:
            continue
        rng = np.random.default_rng(7)
        x, y, z = (drawn(rng, REALS[precision], sign) for _ in range(3))
        k = np.full(COUNT, 1.5)
        bands = Bands([CASES[name][0] for name in chosen], precision, width, edit)(x, y, z, k)
        for name, band in zip(chosen, bands, strict=True):
            mid, rise, error = band.T.astype(np.longdouble)
            known = np.isfinite(error)
            outside = np.zeros(COUNT, bool)
            for _ in range(8):
                u = places(rng).astype(np.longdouble)
                values = [b[:, 0] + b[:, 1] * u + b[:, 2] * places(rng) for b in (x, y, z)]
                with np.errstate(all="ignore"):
                    value = CASES[name][1](*values, k.astype(np.longdouble))
                own = 2.0**-60 * (
                    np.abs(mid) + np.abs(rise) + error
                )  # this test's roundings; exact operations add none
                outside |= known & ~(np.abs(value - (mid + rise * u)) <= error + own)
            result[name] = int(outside.sum()), int(known.sum())
    return result


def test_every_operation_of_the_table_has_a_band() -> None:
    assert set(CALLS) | {"power"} == set(OPERATIONS)
    assert {name.split()[0] for name in CASES} >= set(CALLS)


@pytest.mark.parametrize(
    ("precision", "width"), thinned(FORMS, [("single", 1), ("single", 16), ("double", 2), ("double", 8)])
)
def test_every_value_lies_in_the_band(precision: str, width: int) -> None:
    said = 0
    for name, (outside, known) in violations(list(CASES), precision, width).items():
        assert outside == 0, name
        assert known > COUNT // 3, name
        said += known
    assert said > 0.8 * COUNT * len(CASES)


@pytest.mark.parametrize("precision", ["single", "double"])
def test_error_shrinks_with_the_square_of_the_segment(precision: str) -> None:
    band = Bands([expr for expr, _, _ in CASES.values()], precision, 1)
    wide, narrow = (
        band(np.array([[0.9, w, 0.0]]), np.array([[1.1, w, 0.0]]), np.array([[0.7, w, 0.0]]), 1.5)[:, 0, 2]
        for w in (0.08, 0.02)
    )
    for name, before, after in zip(CASES, wide, narrow, strict=True):
        least = 3.5 if name.startswith("norm_slope") else 12.0  # which is seen between its ends, not about a line
        noise = 400 if name.startswith("norm") else 100  # of two powers
        assert after <= max(before / least, noise * np.finfo(REALS[precision]).eps), name


@pytest.mark.parametrize("precision", ["single", "double"])
def test_what_is_undefined_somewhere_is_unknown(precision: str) -> None:
    whole = np.array([[0.0, 1.0, 0.0]])
    expressions = [node("sqrt", X), node("log", X), node("/", K, X), node("pow", X, K), node("tan", node("*", K, X))]
    assert not np.isfinite(Bands(expressions, precision, 1)(whole, whole, whole, 2.0)[..., 2]).any()


def test_the_slope_of_a_norm_is_told_on_its_axis_and_not_at_an_edge() -> None:
    """Of bands of x and y, k the exponent: on the axis anything from -1 to 1, at an edge nothing."""
    zero, wide = np.array([[0.0, 0.0, 1e-16]]), np.array([[0.5, 0.1, 1e-16]])
    slope = Bands([node("norm_slope", X, Y, K)], "double", 1)
    for k, x, y, told in (
        (2.0, zero, zero, 1.01),
        (1.0, zero, zero, 1.01),
        (2.0, zero, wide, 1e-13),
        (1.5, zero, wide, 1e-7),
        (1.0, zero, wide, np.inf),
        (1.01, zero, wide, np.inf),
        (1.0, wide, zero, 1e-11),
        (1.01, zero - [0, 0, 1e-16], wide, 1e-2),  # exactly in the plane there is a slope, if p - 1 is not too little
    ):
        mid, _, error = slope(x, y, y, k)[0, 0]
        assert error <= told if np.isfinite(told) else not np.isfinite(error), (k, error)
        assert not np.isfinite(told) or told > 1.0 or abs(mid) <= told or x is wide


def test_what_is_made_of_the_unknown_is_unknown() -> None:
    unknown, fine, zero = (
        np.array([[*line, error]]) for line, error in (((0.3, 0.1), np.inf), ((0.2, 0.1), 0), ((0, 0), 0))
    )
    band = Bands([expr for expr, _, _ in CASES.values()], "double", 1)
    tried = 0
    for other in (fine, zero):
        for unsure in ("x", "y", "z", "xy", "xz", "yz", "xyz"):
            x, y, z = (unknown if axis in unsure else other for axis in "xyz")
            bands = band(x, y, z, 1.5)
            for (name, (expr, _, _)), error in zip(CASES.items(), bands[:, 0, 2], strict=True):
                if name == "where" and unsure in ("x", "y", "z", "xy"):
                    continue  # whichever the condition, a choice is one of its branches, and k is known
                if expr.depends_on(unsure):
                    assert not np.isfinite(error), (name, unsure)
                    tried += 1
    assert tried > 200


BROKEN = {
    "rounding forgotten": ("#define ROUNDING ((realv)REAL_EPSILON)", "#define ROUNDING ((realv)0)", ("+", "*", "sin")),
    "the bend of a product": ("(abs_v(bend) + size_a", "(size_a", ("*",)),
    "the bend of a square": ("(bend + (realv)2", "((realv)2", ("square",)),
    "a kink taken as a line": ("HALF * room +", "", ("abs", "min", "max")),
    "curvature forgotten": ("* bend +", "* (realv)0 +", ("exp", "log", "tan", "tanh", "pow", "asin", "atan", "sinh")),
    "a wave taken as a line": ("(falls + bends) * LOOSEN +", "", ("sin", "cos")),
    "the tangent forgotten": ("(HALF * LOOSEN) * abs_v(bulge) +", "", ("sqrt", "cbrt", "/", "hypot")),
    "a norm taken as its chord": ("(abs_v(HALF * end + HALF * start - value) + (", "((", ("norm", "norm 1")),
    "a norm's operand taken as exact": ("(a.error + b.error)", "(realv)0", ("norm", "norm flat")),
    "a slope between the wrong ends": ("low >= (realv)0 ? far : near", "near", ("norm_slope", "norm_slope flat")),
    "the other branch": ("band_high(apart) < (realv)0, first", "apart.mid < (realv)0, first", ("where",)),
}


@pytest.mark.parametrize("fault", BROKEN)
def test_a_fault_in_the_bands_is_seen(fault: str) -> None:
    old, new, names = BROKEN[fault]

    def edit(text: str) -> str:
        assert old in text
        return text.replace(old, new)

    for name, (outside, _) in violations(names, "double", 8, edit).items():
        assert outside > 0, name


def test_the_text_reads_as_written() -> None:
    text = band_text(
        {"band": node("-", node("*", X, X), node("*", K, K))},
        symbols={"x": "p.x", "k": "s.k"},
        bands="x",
        precision="double",
    )
    assert text.results["band"] == "band_subtract(band_square(p.x), kk)"
    assert text.statements == (
        "const band_t kk = band_multiply(band_exact((realv)s.k), band_exact((realv)s.k));   // k * k",
    )
