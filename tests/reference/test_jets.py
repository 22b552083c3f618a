"""Jets on balls against mpmath: enclosed at every point of the ball, for every operation of the table."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest
from flint import arb, ctx
from hypothesis import event, given
from hypothesis import strategies as st

from lenscl.expr import build, number, parse, symbol
from lenscl.expr.operations import OPERATIONS
from lenscl.reference.jets import Jet, jet

# Each form with the meaning that mpmath gives it; x, y > 0 where a root or a logarithm asks for it
FORMS: dict[str, Any] = {
    "x + y*3 - x*y": lambda x, y: x + y * 3 - x * y,
    "x / (y + 4)": lambda x, y: x / (y + 4),
    "-x^3 + y^4 + x^0": lambda x, y: -(x**3) + y**4 + 1,
    "sqrt(x + 3)": lambda x, y: mpmath.sqrt(x + 3),
    "cbrt(x) + cbrt(y + 3)": lambda x, y: mpmath.sign(x) * mpmath.cbrt(abs(x)) + mpmath.cbrt(y + 3),
    "abs(x)*y": lambda x, y: abs(x) * y,
    "min(x, y)": lambda x, y: min(x, y),
    "max(x*y, x - y)": lambda x, y: max(x * y, x - y),
    "exp(-x) + log(y + 3)": lambda x, y: mpmath.exp(-x) + mpmath.log(y + 3),
    "sin(x)*cos(y)": lambda x, y: mpmath.sin(x) * mpmath.cos(y),
    "tan(x/4) + tanh(y)": lambda x, y: mpmath.tan(x / 4) + mpmath.tanh(y),
    "atan2(x, y + 3)": lambda x, y: mpmath.atan2(x, y + 3),
    "asin(x/3)*acos(y/3) + atan(x*y)": lambda x, y: mpmath.asin(x / 3) * mpmath.acos(y / 3) + mpmath.atan(x * y),
    "sinh(x)*cosh(y)": lambda x, y: mpmath.sinh(x) * mpmath.cosh(y),
    "sign(x)*y": lambda x, y: mpmath.sign(x) * y,
    "floor(x)*y + mod(y, 0.7)": lambda x, y: (
        mpmath.floor(x) * y + y - mpmath.mpf(0.7) * mpmath.floor(y / mpmath.mpf(0.7))
    ),
    "hypot(x, y + 3)": lambda x, y: mpmath.hypot(x, y + 3),
    "pow(x + 3, y)": lambda x, y: (x + 3) ** y,
    # What is nowhere negative is raised, and its root taken, on balls that reach below 0
    "sqrt(abs(x)) + sqrt(x^2 + y^2)": lambda x, y: mpmath.sqrt(abs(x)) + mpmath.sqrt(x**2 + y**2),
    "pow(abs(x), 2.5) + pow(abs(y), 1.5)": lambda x, y: abs(x) ** mpmath.mpf(2.5) + abs(y) ** mpmath.mpf(1.5),
    "pow(min(abs(x), abs(y))/(x^2 + 1), 2.5)": lambda x, y: (min(abs(x), abs(y)) / (x**2 + 1)) ** mpmath.mpf(2.5),
    "pow(max(abs(x), y), 2.5)": lambda x, y: max(abs(x), y) ** mpmath.mpf(2.5),
    "pow(abs(x)*abs(y), 0.25)": lambda x, y: abs(x * y) ** mpmath.mpf(0.25),
}
NO_SLOPE = ("cbrt", "sqrt(abs", "0.25")  # on a ball that holds a 0 of what the root is taken of
JUMPING = ("sign", "floor")  # no slope on a ball that holds a jump
WHOLE = st.integers(-2000, 2000).map(lambda k: k / 1000)


def test_every_operation_has_a_form_here() -> None:
    nodes = {each.op for text in FORMS for each in _walked(text)}
    assert set(OPERATIONS) - nodes == {"where", "norm", "norm_slope"}  # which no user writes: below


@pytest.mark.parametrize("text", FORMS)
@given(x=WHOLE, y=WHOLE, radius=st.sampled_from([0.0, 2.0**-40, 2.0**-8, 0.25]), share=st.floats(-1, 1))
def test_a_jet_encloses_value_and_slope_at_every_point_of_its_ball(
    text: str, x: float, y: float, radius: float, share: float
) -> None:
    expression, meaning = parse(text, ["x", "y"]), FORMS[text]
    with ctx.workprec(160), mpmath.workprec(160):
        given_ = {
            "x": Jet(arb(x, radius), (arb(1), arb(0))),
            "y": Jet(arb(y, radius), (arb(0), arb(1))),
        }
        enclosed = jet(expression, given_)
        here = mpmath.mpf(x) + mpmath.mpf(radius) * mpmath.mpf(share), mpmath.mpf(y)
        assert enclosed.value.is_finite()
        assert _holds(enclosed.value, meaning(*here))
        step = mpmath.mpf(2) ** -50
        for axis, slope in enumerate(enclosed.slopes):
            ahead, behind = list(here), list(here)
            ahead[axis] += step
            behind[axis] -= step
            difference = (meaning(*ahead) - meaning(*behind)) / (2 * step)
            if not slope.is_finite():
                event("no slope")
                if any(each in text for each in JUMPING):
                    assert min(abs(u - round(u)) for u in (x, y, y / 0.7)) <= 2 * radius + 1e-15
                    continue
                assert any(each in text for each in NO_SLOPE), "only at a root's zero"
                assert min(abs(x), abs(y)) <= 4 * radius  # balls of products are wider than need be
            elif abs(difference) < 2**20:
                event("a slope")
                slack = arb(0, float(2.0**-30 * (1 + abs(difference) ** 3)))  # of the difference, not of the jet
                assert _holds(slope + slack, difference) or _beside_a_crease(text, here, step)


def test_where_takes_the_branch_that_is_certain_and_encloses_both_that_are_not() -> None:
    choice = build("where", symbol("x"), symbol("y"), number(1.0), symbol("x"))
    at = [
        jet(choice, {"x": Jet(arb(a, r), (arb(1),)), "y": Jet(arb(0), (arb(0),))}) for a, r in ((-1, 0), (1, 0), (0, 1))
    ]
    assert [float(each.value.mid()) for each in at[:2]] == [1.0, 1.0]
    assert [float(each.slopes[0].mid()) for each in at[:2]] == [0.0, 1.0]
    assert at[2].value.contains(arb(-1))
    assert at[2].slopes[0].contains(arb(0))
    assert at[2].slopes[0].contains(arb(1))


@pytest.mark.parametrize("p", [1.0, 1.25, 2.0, 4.0, 10.0])
@given(x=WHOLE, y=WHOLE, radius=st.sampled_from([0.0, 2.0**-40, 0.25]), share=st.tuples(*[st.floats(-1, 1)] * 2))
def test_a_norm_is_enclosed_with_its_slopes(
    p: float, x: float, y: float, radius: float, share: tuple[float, float]
) -> None:
    norm = build("norm", symbol("x"), symbol("y"), number(p))
    with ctx.workprec(160), mpmath.workprec(160):
        enclosed = jet(norm, {"x": Jet(arb(x, radius), (arb(1), arb(0))), "y": Jet(arb(y, radius), (arb(0), arb(1)))})
        a, b = (mpmath.mpf(at) + mpmath.mpf(radius) * mpmath.mpf(by) for at, by in zip((x, y), share, strict=True))
        value = (abs(a) ** p + abs(b) ** p) ** (1 / mpmath.mpf(p))
        assert _holds(enclosed.value, value)
        assert enclosed.value.is_finite()
        for u, slope in zip((a, b), enclosed.slopes, strict=True):
            assert slope.is_finite()
            assert abs(slope) <= 1.01
            if value:
                assert _holds(slope, mpmath.sign(u) * (abs(u) / value) ** (p - 1) if u else mpmath.mpf(0))
                told = min(abs(x), abs(y)) > 2.0**-8 and radius < 2.0**-30
                event("told" if told else "near an axis")
                assert not told or float(slope.rad()) < 1e-6


def test_what_is_undefined_somewhere_on_a_ball_is_not_finite() -> None:
    wide = {"x": Jet(arb(0, 1), (arb(1),))}
    for text in ("1/x", "log(x)", "sqrt(x)", "pow(x, 0.5)", "asin(3*x)", "acos(3*x)", "mod(1, x)"):
        assert not jet(parse(text, ["x"]), wide).value.is_finite(), text


def test_no_slope_is_told_across_a_jump_and_no_value_between_its_sides_is_left_out() -> None:
    wide, level = Jet(arb(0, 0.25), (arb(1),)), Jet(arb(0.5, 0.25), (arb(1),))
    for text, low, high in (("sign(x)", -1, 1), ("floor(x)", -1, 0)):
        across, beside = (jet(parse(text, ["x"]), {"x": at}) for at in (wide, level))
        assert across.value.contains(arb(low))
        assert across.value.contains(arb(high))
        assert not across.slopes[0].is_finite()
        assert beside.value == high
        assert beside.slopes[0].is_zero()
    assert not jet(parse("sign(x)", ["x"]), {"x": Jet(arb(0), (arb(1),))}).slopes[0].is_finite()
    number_of_a_user = {"x": Jet(arb(0), (arb(0),))}  # in which nothing moves
    assert jet(parse("sign(x)", ["x"]), number_of_a_user).slopes[0].is_zero()


def _walked(text: str) -> Any:
    from lenscl.expr.graph import walk

    return (each for each in walk([parse(text, ["x", "y"])]) if each.args)


def _holds(ball: arb, exact: Any) -> bool:
    if not ball.is_finite():
        return True
    low, high = (mpmath.mpf(str(end.mid().str(60, radius=False))) for end in (ball.lower(), ball.upper()))
    slack = mpmath.mpf(2) ** -120 * (1 + abs(exact))
    return bool(low - slack <= exact <= high + slack)


def _beside_a_crease(text: str, here: tuple[Any, Any], step: Any) -> bool:
    x, y = here
    gaps = {"abs(x)*y": x, "min(x, y)": x - y, "max(x*y, x - y)": x * y - (x - y)}
    return text in gaps and abs(gaps[text]) <= 8 * step


def test_a_broken_rule_would_be_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    from lenscl.reference import jets

    monkeypatch.setitem(jets._RULES, "sin", lambda u: u.by(u.value.sin(), u.value.sin()))
    enclosed = jet(parse("sin(x)", ["x"]), {"x": Jet(arb(0.5), (arb(1),))})
    assert not _holds(enclosed.slopes[0], mpmath.cos(mpmath.mpf(0.5)))
    assert np.isfinite(float(enclosed.value.mid()))
