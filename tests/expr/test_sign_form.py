"""Sign forms: every rule keeps sign and domain, what is proved is true, and F comes out of what was put round it."""

from __future__ import annotations

import itertools
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from lenscl.expr import (
    OPERATIONS,
    Facts,
    degree,
    evaluate,
    never_negative,
    number,
    parse,
    root_polynomial,
    sign_form,
    symbol,
)
from lenscl.expr.graph import Expr, node
from lenscl.expr.identities import IDENTITIES, Identity
from lenscl.expr.sign_rules import OUTER, Outer

NAMES = ["x", "y", "z", "R", "r", "k"]
BOX = ((-1.1, -1.1, -1.1), (1.1, 1.1, 1.1))
FACTS = Facts(BOX)
x, y, z, k = (symbol(name) for name in "xyzk")
SIDE = np.array([-1.1, -0.73, -0.5, -0.21, -1e-3, 0.0, 1e-9, 0.3, 0.5, 0.87, 1.1])
PLACES = {name: part.ravel() for name, part in zip("xyz", np.meshgrid(*[SIDE] * 3), strict=True)}
POOL = [
    *(
        parse(text, NAMES)
        for text in ("x", "y - 0.3", "x^2", "x^2 + y^2", "x^2 + y^2 - 0.4", "x^2 + 0.5", "-x^2 - 0.1")
    ),
    *(parse(text, NAMES) for text in ("exp(x*y)", "cbrt(z)", "sqrt(x)", "tanh(x)", "exp(y)", "1/x", "abs(x - z)", "k")),
    *(
        parse(text, NAMES)
        for text in ("hypot(x, y)", "sqrt(x^2 + z^2)", "log(x^2 + 1.5)", "log(x + 1.2)", "x^3", "y^4")
    ),
    *(number(value) for value in (2.0, -0.5, 0.3)),
]
SHARE = parse("z/sqrt(x^2 + y^2 + z^2)", NAMES)  # between -1 and 1, where there is one
LEVELS: list[Any] = [*(Fraction(c) for c in (0, 0.3, -0.3, 0.7, 1.5, -2)), k, parse("0.5*k", NAMES)]


def signs(expr: Expr, **values: float) -> Any:
    """Return the signs of an expression, 0 where rounding decides, NaN where it has no value."""
    found = evaluate(expr, PLACES | dict.fromkeys(NAMES[3:], 0.6) | values)
    return np.where(np.isnan(found), np.nan, np.where(np.abs(found) < 1e-9, 0.0, np.sign(found)))


def assert_same_sign(of: Expr, form: Expr, **values: float) -> int:
    """Compare signs where rounding decides of neither; and a form without a value for what has none."""
    was, now = signs(of, **values), signs(form, **values)
    assert np.isnan(now[np.isnan(was)]).all(), "a value where there was none"
    told = ~np.isnan(was) & (was != 0) & (now != 0)
    np.testing.assert_array_equal(was[told], now[told])
    return int(told.sum())


def _operations(op: str) -> Any:
    if op == "power":
        return ([u, number(n)] for u in POOL for n in (2.0, 3.0, 4.0, 5.0, 6.0))
    if op == "pow":
        return ([u, number(p)] for u in [*POOL, node("power", x, number(4.0))] for p in (0.5, 0.75, 1.5, -0.25))
    if OPERATIONS[op].arity == 1:
        return ([u] for u in (*POOL, SHARE))
    if op == "*":
        sizes = ([u, node("sqrt", node("abs", u))] for u in POOL)
        return itertools.chain(itertools.product(POOL[::2], POOL[::3]), ([node("abs", u), u] for u in POOL), sizes)
    return itertools.product(POOL[::2], POOL[::3]) if op in ("/", "atan2") else itertools.product(POOL, POOL)


@pytest.mark.parametrize("rule", OUTER, ids=lambda rule: rule.identity)
def test_every_outer_rule_keeps_the_sign_and_the_domain(rule: Outer) -> None:
    fired = told = 0
    for args in _operations(rule.op):
        t = node(rule.op, *args)
        if not t.depends_on("xyz"):
            continue
        for c in LEVELS:
            step = rule.apply(FACTS, t, c)
            if step is None:
                continue
            fired += 1
            level, other = (number(float(each)) if isinstance(each, Fraction) else each for each in (c, step.d))
            form = node("-", step.u, other) if step.sign > 0 else node("-", other, step.u)
            for value in (0.6, -0.4, 0.0) if level.depends_on("k") or t.depends_on("k") else (0.6,):
                told += assert_same_sign(node("-", t, level), form, k=value)
    assert fired > 1
    assert told > 500


@pytest.mark.parametrize("rule", IDENTITIES, ids=lambda rule: rule.identity)
def test_every_identity_keeps_the_value_and_the_domain(rule: Identity) -> None:
    fired = 0
    for args in _operations(rule.op):
        w = node(rule.op, *args)
        result = rule.apply(FACTS, w)
        if result is None:
            continue
        fired += 1
        was, now = (evaluate(each, PLACES | {"k": 0.6}) for each in (w, result))
        np.testing.assert_array_equal(np.isnan(was), np.isnan(now))
        np.testing.assert_allclose(now, was, rtol=1e-12, atol=1e-15)
    assert fired > 0


F = "(x^4 + y^4 + z^4 - 0.5)"
FORMS = {
    f"tanh(5*{F})": F,
    f"exp({F}) - 1": F,
    f"{F}**3": F,
    f"cbrt({F})": F,
    f"log({F} + 1)": F,
    f"exp(cbrt({F})) - 1": F,
    f"{F}/(1 + x^2)": F,
    f"{F}*exp(-z^2)": F,
    f"-tanh(-{F}/3)": F,
    f"{F}**5/2 + 0": F,
    f"max(cbrt({F}), (z - 0.2)**3)": f"max({F}, z - 0.2)",
    f"min(tanh({F}), x)": f"min({F}, x)",
    f"exp({F}) - exp(z - 0.3)": f"{F} - (z - 0.3)",
    "(x^2 + y^2 + z^2 - 0.5)**3": "x^2 + y^2 + z^2 - 0.5",
    f"sqrt({F} + 1)- 1.25": "x^4 + y^4 + z^4 - 1.0625",
    "sqrt(x^2 + y^2 + z^2) - 0.5": "x^2 + y^2 + z^2 - 0.25",
    "sqrt(x^2 + y^2 + z^2) - r": "x^2 + y^2 + z^2 - r*abs(r)",
    "hypot(hypot(x, y), z) - r": "x^2 + y^2 + z^2 - r*abs(r)",
    "(x^2 + y^2 + z^2)^0.5 - 0.5": "x^2 + y^2 + z^2 - 0.25",
    "hypot(hypot(x, y) - 0.75, z) - 0.25": "((x^2 + y^2 - 0.5625) + (z^2 - 0.0625))^2 + 2.25*(z^2 - 0.0625)",
    "sqrt((sqrt(x^2 + y^2) - 0.75)^2 + z^2) - 0.25": "((x^2+y^2 - 0.5625) + (z^2 - 0.0625))^2 + 2.25*(z^2-0.0625)",
    "sqrt(x^2 + y^2 + 0.25) - (0.5 - z)": "max((x^2 + y^2 + 0.25) - (z - 0.5)^2, z - 0.5)",
    # min of it and x^2 + y^2 + z^2 - 0.125, which is small enough where it is negative
    "x^2 + y^2 + z^2 - sqrt(x^2 + 0.25) - 0.125": "(x^2 + y^2 + z^2 - 0.125)^2 - (x^2 + 0.25)",
    "z - sqrt(x^2 + 0.25)": "min(z^2 - (x^2 + 0.25), z)",
    "sqrt(x^2 + y^2) - 0.25*z^2 - 0.5": "-((-0.25*z^2 - 0.5)^2 - (x^2 + y^2))",
    "sqrt((x - y)^2) + abs(z) - 0.5": "abs(x - y) + abs(z) - 0.5",
    "abs(x)^2 + abs(y)^4 + z^2 - 0.5": "x^2 + y^4 + z^2 - 0.5",
    "cbrt(x)**3 + y^2 + z^2 - 0.5": "x + y^2 + z^2 - 0.5",
    "4 - 1/(x^2 + y^2 + z^2)": "x^2 + y^2 + z^2 - 0.25",
    "abs(sqrt(x^2 + y^2 + z^2) - 0.75) - 0.25": "max(x^2 + y^2 + z^2 - 1, 0.25 - (x^2 + y^2 + z^2))",
    f"atan2({F}, 1 + z^2)": F,
    f"{F}*abs({F})": F,
    f"-3*{F}^3*sqrt(abs(2*{F}))/(1 + x^2)": f"-{F}",
    f"tanh({F})*(abs({F})^0.3*{F}^2)": F,
    "1 + 4*(log(abs(x))*abs(log(abs(x))))": "abs(x) - 0.6065306597126334",
    f"{F}*(abs({F})*exp(x))": F,
    "sqrt(cbrt(x^2 + y^2 + z^2)) - 0.5": "x^2 + y^2 + z^2 - 0.015625",
    "(x^2)^0.75 + (y^4)^k + (z^2)^-0.3 - 1": "abs(x)^1.5 + abs(y)^(4*k) + abs(z)^-0.6 - 1",
    # A ball in which the solid lies, and which it decides nothing of
    f"max({F}, x^2 + y^2 + z^2 - 1.4)": F,
    f"max(x^2 + y^2 + z^2 - 1.4, tanh({F}), z - 0.3)": f"max({F}, z - 0.3)",
    "min(x^2 + y^2 + z^2 - 0.5, x^2 + y^2 + (z - 0.1)^2 - 0.2)": "x^2 + y^2 + z^2 - 0.5",
    # The words that have an inverse
    f"atan(2*{F})": F,
    f"sinh({F}) + sinh(z - 0.3)": f"{F} + (z - 0.3)",
    f"atan({F}) - atan(y)": f"{F} - y",
    f"sinh({F})*abs(atan({F}))": F,
    f"sign({F})": F,
    f"0.5 - sign({F})": f"-{F}",
    "floor(x^2 + y^2 + z^2) - 0.5": "x^2 + y^2 + z^2 - 1",
    "floor(4*x^2 + 4*y^2 + 4*z^2) - 2.5": "4*x^2 + 4*y^2 + 4*z^2 - 3",
    "cosh(x^2 + y^2) - 1.5": "x^2 + y^2 - 0.9624236501192069",
    "cosh(2*x) - 1.5": "abs(2*x) - 0.9624236501192069",
    "asin(0.5*x) - 0.25": "0.5*x - 0.24740395925452294",
    "acos(z/sqrt(x^2 + y^2 + z^2)) - 0.5": "-(z/sqrt(x^2 + y^2 + z^2) - 0.8775825618903728)",
    "acos(z/hypot(hypot(x, y), z)) - 0.5": "-(z/hypot(hypot(x, y), z) - 0.8775825618903728)",
    "asin(-x/hypot(x, y)) + 0.5": "-(x/hypot(x, y)) + 0.479425538604203",
    "sqrt(x + 1.5) - 1": "x + 0.5",  # x + 1.5 is positive in the box
    "log(x + 1.5)": "x + 0.5",
}
KEPT = [
    *(
        F,
        f"3*{F}",
        f"k*{F}",
        f"{F}^2",
        f"{F}^2 - 0.01",
        f"abs({F})",
        f"sqrt({F}^4 + x^4)",
        f"exp({F})",
        f"exp({F}) + 1",
    ),
    *(f"exp({F}) - k", f"tanh({F}) - k", f"tanh({F}) - 1", "2*x^2 + 3*y^2 - 1", f"sin({F})", f"x*{F}", f"{F}/x"),
    *(f"max({F}, x^2 + y^2 + z^2 - 1.1)", f"max({F}, x^2 + y^2 + z^2 - k)", f"min({F}, x^2 + y^2 + z^2 - 0.9)"),
    # A spindle, and a cone, whose tips the root keeps apart and a square does not
    *("(sqrt(x^2 + y^2) - 0.25)^2 + z^2 - 0.25", "sqrt(x^2 + y^2) - (0.5 - z)", "max(sqrt(x^2 + y^2) + z - 0.7, -z)"),
    # Of which the domain ends in the box, or may
    *("sqrt(x) - 0.3", "log(x) - 0.3", "sqrt(x^2 - 0.5) - 0.2", f"sqrt({F}) - 0.1", f"sqrt({F} + k) - 0.1"),
    *(f"log({F})", f"sqrt({F} + 0.4) - 0.7", "pow(x, 0.75) - 0.2", "sqrt(x)^2 - 0.5", f"{F}/(0.5 + x)", "1/x - 2"),
    *(
        f"{F}*sqrt(x)",
        f"{F}*abs({F} + 0.1)",
        f"{F}*abs({F})*x",
        f"{F}*abs(x)",
        "x*sqrt(x)",
        # The ball decides where the root has no value, and where the exponential is beyond the largest number
        "max(1.1 - tanh(exp(9/(x^2 + 0.01))), x^2 + y^2 + z^2 - 1)",
        "max(sqrt(x + 0.3) + 0.5, x^2 + y^2 + z^2 - 0.5)",
        f"{F}*(1/x^2)",
        f"{F}/(1 + sqrt(x))",
        "sqrt(x)*sqrt(x) - 0.2",
        "x^2 - sqrt(y)",
        # An arc sine that may end in the box, a floor on a whole level, a sign of which 1 is no jump
        "asin(x) - 0.3",
        "acos(z/sqrt(x^2 + y^2 + 0.5*z^2)) - 0.5",
        "floor(x + y) - 1",
        # At 0 in a whole region, where the sign less a half is negative
        "sign(max(x, 0)) - 0.5",
        "floor(min(x + y, 1)) - 0.5",
        f"sign({F}) - 1",
        "cosh(x) - 1",
        "mod(x, 0.3) - 0.1",
        "sqrt(k*x^2) - 1",
    ),
]


@pytest.mark.parametrize(("text", "form"), FORMS.items())
def test_what_is_put_round_f_comes_off(text: str, form: str) -> None:
    written = parse(text, NAMES)
    found = sign_form(written, FACTS)
    assert str(found) == str(parse(form, NAMES))
    told = sum(assert_same_sign(written, found, r=r, k=0.4) for r in (0.5, -0.5, 0.0))
    assert told > 500


@pytest.mark.parametrize("text", KEPT)
def test_what_cannot_be_taken_off_stays_as_written(text: str) -> None:
    written = parse(text, NAMES)
    assert sign_form(written, FACTS) is written


def test_what_the_box_proves_is_not_taken_as_proved_without_it() -> None:
    for text in ("sqrt(x + 1.5) - 1", "log(x + 1.5)"):
        written = parse(text, NAMES)
        assert sign_form(written, FACTS) is not written
        assert sign_form(written, Facts()) is written
        assert sign_form(written, Facts(((-1.6, -1, -1), (1, 1, 1)))) is written
    assert sign_form(parse("sqrt(x + k) - 1", NAMES), FACTS) is parse("sqrt(x + k) - 1", NAMES)


@pytest.mark.parametrize(
    "text",
    [
        "x" + " + 1" * 2000,
        "max(" + ", ".join(f"x + {i}*y/500 - 1" for i in range(500)) + ")",
        " + ".join(f"abs(x - {i})" for i in range(500)),
        "*".join(f"exp(x/1000 - {i}/100000)" for i in range(500)) + "*y",
        "cbrt(" * 150 + "x" + ")" * 150,
        "-(" * 150 + "tanh(x)" + ")" * 150,
    ],
    ids=lambda text: text[:12],
)
def test_long_and_deep_expressions_are_no_trouble(text: str) -> None:
    written = parse(text, NAMES)
    assert assert_same_sign(written, sign_form(written, FACTS)) > 500


INNER = st.sampled_from(
    ["x^2 + y^2 + z^2 - 0.5", "x^4 + y^4 + z^4 - 0.3", "(x^2 + y^2 + z^2)^2 - x*y*z - 0.2", "z - x*y + 0.1", "x + y"]
)
ROUND = st.sampled_from(
    [
        *("tanh({k}*({u}))", "exp({u}) - 1", "({u})**3", "cbrt({u})", "{k}*({u})", "({u})/{k}", "-(-({u}))"),
        *("({u})/(1 + x^2)", "({u})*exp(y)", "log(1 + ({u})^2) - log(1 + ({u})^2) + ({u})", "-tanh(-({u}))"),
        *(
            "sinh({u})",
            "atan({u})",
            "sign({u})",
            "tanh({u}) + 0*x",
            "({u})/sqrt(1.5 + x*y)",
            "max({u}, ({u}) - {k})",
            "min(cbrt({u}), ({u}) + {k})",
        ),
    ]
)


@given(text=INNER, layers=st.lists(st.tuples(ROUND, st.sampled_from([0.5, 1.0, 3.0, 0.7])), min_size=1, max_size=4))
def test_what_is_wrapped_again_and_again_has_the_sign_of_f(text: str, layers: list[tuple[str, float]]) -> None:
    wrapped = text
    for layer, number_ in layers:
        wrapped = layer.format(u=wrapped, k=number_)
    written, inner = parse(wrapped, NAMES), parse(text, NAMES)
    found = sign_form(written, FACTS)
    assert assert_same_sign(inner, found) > 500
    if not any(op in wrapped for op in ("max", "min", "log")):
        event("bare")
        assert degree(found, "xyz") == degree(inner, "xyz")


SEEDS = st.sampled_from(["x", "y", "z", "k", "0.5", "2", "x^2", "y^2 + z^2", "x^2 + y^2 + z^2 - 0.5", "0.3"])
SHAPES = [
    *("tanh({u})", "exp({u})", "sqrt({u})", "cbrt({u})", "log({u})", "({u})**3", "({u})**2", "abs({u})", "-({u})"),
    *("({u}) + ({v})", "({u}) - ({v})", "({u})*({v})", "({u})/({v})", "max({u}, {v})", "min({u}, {v})"),
    *("asin({u})", "acos({u})", "atan({u})", "sinh({u})", "cosh({u})", "sign({u})", "floor({u})", "mod({u}, 0.7)"),
    *("hypot({u}, {v})", "pow({u}, 0.5)", "pow({u}, 1.5)", "sqrt({u}) - ({v})", "log({u}) - 0.3", "exp({u}) - 1"),
]
TREES = st.recursive(
    SEEDS,
    lambda inner: st.builds(lambda form, u, v: form.format(u=u, v=v), st.sampled_from(SHAPES), inner, inner),
    max_leaves=6,
)


@given(text=TREES, value=st.sampled_from([0.4, -0.7, 0.0]))
def test_any_expression_keeps_its_sign_and_its_domain(text: str, value: float) -> None:
    try:
        written = parse(text, NAMES)
    except ValueError:
        event("refused")
        return
    if not written.depends_on("xyz"):
        return
    found = sign_form(written, FACTS)
    event("changed" if found is not written else "kept")
    was = evaluate(written, PLACES | {"k": value})
    fine = np.isfinite(was) & (np.abs(was) < 1e6)  # the sign of a difference of large numbers is rounding's
    now = evaluate(found, PLACES | {"k": value})
    assert np.isnan(now[np.isnan(was)]).all()
    told = fine & (np.abs(was) > 1e-7) & (np.abs(now) > 1e-9)
    np.testing.assert_array_equal(np.sign(was[told]), np.sign(now[told]))
    if found is not written and told.sum() > 300:
        event("told")


@given(text=TREES)
def test_what_is_proved_of_an_expression_is_true(text: str) -> None:
    try:
        written = parse(text, NAMES)
    except ValueError:
        return
    for facts in (FACTS, Facts()):
        values = np.concatenate([evaluate(written, PLACES | {"k": value}).ravel() for value in (0.4, -0.7, 0.0, 2.0)])
        known = values[~np.isnan(values)]
        slack = 1e-12 * (1.0 + np.abs(known))
        if facts.is_nonnegative(written):
            event("not negative")
            assert (known >= -slack).all()
        if facts.is_positive(written):
            assert (known >= -slack).all()
        if facts.is_negative(written):
            assert (known <= slack).all()
        if facts.is_total(written):
            event("total")
            assert not np.isnan(values[np.isfinite(values) | np.isnan(values)]).any() or np.isinf(values).any()
        low, high = facts.low(written), facts.high(written)
        assert low is None or (known >= float(low) - slack).all()
        assert high is None or (known <= float(high) + slack).all()


def test_a_torus_of_parameters_is_its_quartic_where_it_is_a_ring() -> None:
    for text in ("hypot(hypot(x, y) - R, z) - r", "(R - sqrt(x^2 + y^2))^2 + z^2 - r^2"):
        written = parse(text, NAMES)
        form = sign_form(written, FACTS)
        found = root_polynomial(form)
        assert found is not None
        polynomial, conditions = found
        told = 0
        for R, r in ((0.7, 0.25), (0.5, 0.5), (0.25, 0.7), (-0.7, 0.25), (0.0, 0.4), (0.6, -0.2)):
            told += assert_same_sign(written, form, R=R, r=r)
            holds = all(never_negative(each, {"R": R, "r": r}) for each in conditions)
            assert holds == (R >= 0.0 and abs(r) <= R), (R, r)
            if holds:
                told += assert_same_sign(written, polynomial, R=R, r=r)
        assert told > 8000


BROKEN = {
    "a domain forgotten": ("sqrt", "sqrt(x) - 0.3", "x - 0.09"),
    "a sign forgotten": ("cbrt", "-cbrt(x - 0.3)", "x - 0.3"),
    "an even power taken for an odd one": ("power", "(x - 0.3)^2", "x - 0.3"),
}


@pytest.mark.parametrize("fault", BROKEN)
def test_a_wrong_form_is_seen(fault: str) -> None:
    _, text, form = BROKEN[fault]
    with pytest.raises(AssertionError):
        assert_same_sign(parse(text, NAMES), parse(form, NAMES))
