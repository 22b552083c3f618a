from __future__ import annotations

import re
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from lenscl.errors import ExpressionError
from lenscl.expr import FUNCTIONS, advice, evaluate, parse
from lenscl.expr.words import CONSTANTS, operands_of

NAMES = ["x", "y", "z", "k"]

REFUSED = {  # text: column, part of the message
    "__import__('os').system('x')": (11, "unexpected"),
    "__import__(x)": (0, "unknown function"),
    "x.real": (1, "attributes"),
    "x..y": (1, "attributes"),
    "foo(x) + 1": (0, "unknown function"),
    "1 + sqr(x)": (4, "did you mean 'sqrt'"),
    "y + xx": (4, "unknown name 'xx'; did you mean 'x'"),
    "x + sqrt": (4, "write sqrt(...)"),
    "k(2)": (0, "a value, not a function"),
    "(x)(y)": (3, "write products as *"),
    "2x": (1, "write products as *"),
    "2 x": (2, "write products as *"),
    "x y": (2, "write products as *"),
    "(" * 49_999 + "x" + ")" * 49_999: (200, "200 deep"),
    "(" * 10**6: (100_000, "100000 characters"),
    "-" * 90_000 + "x": (200, "200 deep"),
    "x**" * 5_000 + "x": (601, "200 deep"),
    "x^-" * 250 + "y": (601, "200 deep"),
    "x*-" * 3_000 + "y": (0, "split the solid"),
    "+".join(["x"] * 6_000): (10_000, "5000 parts"),
    "+".join(f"sin(x+{n})" for n in range(2_000)): (8_144, "parts"),
    "9**9**9**9": (6, "whole exponents"),
    "9^9^9^9": (4, "whole exponents"),
    "x^65": (2, "from -64 to 64"),
    "x^-65": (2, "from -64 to 64"),
    "x\0y": (1, "unexpected '\\x00'"),
    "lambda: 1": (6, "unexpected ':'"),
    "(lambda x)": (1, "'lambda' is not allowed"),
    "[x for x in y]": (0, "unexpected '['"),
    "(x for x in y)": (3, "'for' is not allowed"),
    "x if y else z": (2, "'if' is not allowed"),
    "x if " * 3_000: (2, "'if' is not allowed"),
    "x and y": (2, "'and' is not allowed"),
    "not x": (0, "'not' is not allowed"),
    "True": (0, "'True' is not allowed"),
    "None": (0, "'None' is not allowed"),
    "await x": (0, "'await' is not allowed"),
    "(x := 3)": (3, "unexpected ':'"),
    "'x'": (0, "unexpected"),
    "f'x'": (1, "unexpected"),
    "1j*x": (1, "write products as *"),
    "0x10": (1, "write products as *"),
    "1_000": (1, "write products as *"),
    "0777": (0, "does not read"),
    "...": (0, "attributes"),
    "1" * 5_000: (0, "too large"),
    "x + 1e999": (4, "too large"),
    "x = 0": (2, "without ="),
    "x < 0": (2, "min, max and abs"),
    "x²": (1, "write powers as ^2"),
    "x − 1": (2, "minus sign as -"),
    "ｘ": (0, "unexpected"),
    "x # note": (2, "unexpected"),
    "x \\\n y": (2, "unexpected"),
    "x % 2": (2, "unexpected"),
    "x // 2": (5, "operator is not allowed"),
    "~x": (0, "unexpected"),
    "x, y": (0, "a comma may only stand"),
    "min(x, (y, z))": (7, "a comma may only stand"),
    "()": (0, "a comma may only stand"),
    "sqrt(*x)": (0, "plain operands"),
    "sqrt(x, y)": (0, "takes 1 operand, got 2"),
    "min(x)": (0, "takes 2 or more operands, got 1"),
    "x + (y": (4, "never closed"),
    "x + y)": (5, "never opened"),
    "x + ": (4, "does not read"),
    "x * / y": (4, "does not read"),
    "": (0, "empty"),
    " \n ": (0, "empty"),
    "x/0": (2, "division by zero"),
    "x + 1/(1 - 1)": (7, "division by zero"),
    "0^-1": (2, "division by zero"),
    "1e300*1e300": (6, "no finite value"),
    "10^64*10^64*10^64*10^64*10^64": (24, "no finite value"),
}


@pytest.mark.parametrize(("text", "column", "message"), [(t, *rest) for t, rest in REFUSED.items()], ids=lambda v: "")
def test_what_is_no_expression_is_refused_at_its_column(text, column, message):
    with pytest.raises(ExpressionError) as caught:
        parse(text, NAMES)
    assert message in caught.value.message
    assert caught.value.column == column
    assert len(str(caught.value)) < 600  # a message, not the text again


OTHERWISE = {  # text: column, what the message names, and what it says to write
    "x² + y²": (1, "'²' (superscript two, U+00B2)", "x^2"),
    "x - ٠": (4, "arabic-indic digit zero", "write 0"),
    "-1 < x < 1": (3, "'<'", "max(F, G) where both conditions hold"),
    "x > 0 and y > 0": (2, "'>'", "max(F, G) where both conditions hold"),
    "x if x > 0 else -x": (7, "'>'", "min(F, G) where either does"),
    "x³": (1, "superscript three", "^3 or **3"),
    "k⁻¹²": (1, "superscript minus", "k^-12"),
    "(x + y)²": (7, "superscript two", "(...)^2"),
    "xⁿ": (1, "superscript latin small letter n", "x^n"),
    "2×x": (1, "multiplication sign", "products as *"),
    "2·x": (1, "middle dot", "products as *"),
    "x∗y": (1, "asterisk operator", "products as *"),
    "x÷2": (1, "division sign", "quotients as /"),
    "x − 1": (2, "minus sign, U+2212", "minus sign as -"),
    "x – 1": (2, "en dash", "minus sign as -"),
    "√x": (0, "square root", "sqrt(x)"),
    "∛(x + y)": (0, "cube root", "cbrt(x + y)"),
    "π*x": (0, "greek small letter pi", "write pi"),
    "½*x": (0, "one half", "0.5"),
    "|x| - 1": (0, "'|'", "abs(x)"),
    "x^2 ≤ 0": (4, "less-than or equal to", "leave out what stands from there on"),
    "x^2 + y^2 = 1": (10, "'='", "x^2 + y^2 - (1)"),
    "x^2 <= 1": (4, "'<'", "x^2 - (1)"),
    "x^2 >= 1": (4, "'>'", "1 - (x^2)"),
    "x^2 > 0": (4, "'>'", "-(x^2)"),
    "F(x, y, z) = x^2": (11, "'='", "only what stands right of it"),
    "x\u00a0+ y": (1, "no-break space", "ordinary space"),
    "x\u2009+ y": (1, "thin space", "ordinary space"),
    "x +\u200b y": (3, "zero width space", "ordinary space"),
    "“x”": (0, "left double quotation mark", "quotation marks"),
    "ｘ": (0, "fullwidth latin small letter x", "write x"),
    "х": (0, "cyrillic small letter ha", "letters a to z"),
    "α*x": (0, "greek small letter alpha", "letters a to z"),
    "0,5*x": (1, "a comma", "like 0.5"),
    "y + 1,25*x": (5, "a comma", "like 0.5"),
    "sqrt(0,5)": (0, "got 2", "like 0.5"),
    "X^2": (0, "'X'", "did you mean 'x'?"),
    "Pi*x": (0, "'Pi'", "write pi"),
    "tau*x": (0, "'tau'", "2*pi"),
    "x % 2": (2, "'%'", "mod(u, v)"),
    "E*x": (0, "'E'", "2.718281828459045"),
    "xy": (0, "'xy'", "x*y"),
    "x2 + 1": (0, "'x2'", "x^2"),
    "2x": (1, "operator is missing", "2*x"),
    "2(x + 1)": (1, "operator is missing", "2*(...)"),
    "sin x": (4, "operator is missing", "sin(x)"),
    "sin^2(x)": (5, "operator is missing", "sin(...)^2"),
    "math.sqrt(x)": (4, "attributes", "sqrt(...) without math"),
    "np.pi*x": (2, "attributes", "write pi for np.pi"),
    "np.arcsin(x)": (2, "attributes", "asin(u)"),
    "ln(x)": (0, "'ln'", "log(u)"),
    "arctan(x)": (0, "'arctan'", "atan(u)"),
    "SQRT(x)": (0, "'SQRT'", "did you mean 'sqrt'?"),
    "ceil(x)": (0, "'ceil'", "-floor(-u)"),
    "fract(x)": (0, "'fract'", "mod(u, 1)"),
}


@pytest.mark.parametrize("text", OTHERWISE)
def test_what_is_written_otherwise_is_named_and_how_it_is_written(text):
    column, named, instead = OTHERWISE[text]
    with pytest.raises(ExpressionError) as caught:
        parse(text, NAMES)
    assert caught.value.column == column
    assert named in caught.value.message
    assert instead in caught.value.message
    assert "\\x" not in caught.value.message or not text.isprintable()


def test_an_unknown_function_comes_with_those_that_there_are():
    for name in ("foo", "sqr", "ln", "asinh", "ceil"):
        with pytest.raises(ExpressionError) as caught:
            parse(f"{name}(x)", NAMES)
        assert all(f"{known}" in caught.value.message.split("functions are")[1] for known in FUNCTIONS)


def test_the_documentation_names_every_function_and_constant():
    text = (Path(__file__).parents[2] / "docs" / "lenses.md").read_text(encoding="utf-8")
    (listed,) = re.findall(r"An expression is made of .*?\n\n", text, re.DOTALL)
    named = set(re.findall(r"`(\w+)(?:\([\w, ]*\))?`", listed))
    assert named - {"v", "F"} == {*FUNCTIONS, *CONSTANTS}


def test_what_stands_for_a_function_of_another_notation_can_be_read_and_has_its_value():
    other = {"ln": np.log, "fract": lambda u: u % 1, "heaviside": lambda u: np.heaviside(u, 0.5)}
    u, checked = np.array([0.2, 0.7]), 0
    for name, instead in advice._OTHERWISE.items():
        made = parse(instead, ["u", "v", "p", "n", "x", "y", "z", "low", "high", "F", "G"])
        exact = other.get(name) or getattr(np, name, None)
        named = set(re.findall(r"[a-z]\w*", instead))  # by the text: a wrong one may have lost u
        if exact is not None and "u" in named and not named & {"v", "p", "n", "low"}:
            at = 1 + u if ("cosh" in name and "arc" in name) or name == "acosh" else u
            np.testing.assert_allclose(evaluate(made, {"u": at}), exact(at), rtol=1e-14)
            checked += 1
    assert checked >= 15


def test_nothing_in_an_expression_is_executed(tmp_path):
    mark = tmp_path / "ran"
    for text in [f"__import__('os').system('touch {mark}')", f"open('{mark}', 'w')", "exit()", "print(x)"]:
        with pytest.raises(ExpressionError):
            parse(text, NAMES)
    assert not mark.exists()


@given(st.text(alphabet="xyzk0129.()+-*/^, esqrtmina\n", max_size=40) | st.text(max_size=20))
def test_any_text_is_read_or_refused_inside_it(text):
    column = 0
    try:
        parse(text, NAMES)
    except ExpressionError as error:
        column = error.column
    assert 0 <= column <= len(text)


@pytest.mark.parametrize(
    ("text", "value"),
    {
        "-x^2": -9.0,
        "2^3^2": 512.0,
        "2**-1": 0.5,
        "-2^2": -4.0,
        "6/2*3": 9.0,
        "6 - 2 - 3": 1.0,
        "x^y^z": 3.0,
        "(-x)^3": -27.0,
        "8 ^ (1/3)": 2.0,
        "1.5e1 + .5 + 2.": 17.5,
        "min(x, 2, 1, 4)": 1.0,
        "max(1, x, y)": 3.0,
        "pow(x, 2)": 9.0,
        "+x - -x": 6.0,
        "x\n + y\t- 1": 4.0,
        "hypot(x, 4)": 5.0,
        "x^-2": 1 / 9,
        "x - (y - (z - 1))": 0.0,
    }.items(),
)
def test_text_means_what_it_means_on_paper(text, value):
    expr = parse(text, NAMES)
    assert evaluate(expr, {"x": 3.0, "y": 2.0, "z": 0.0}) == pytest.approx(value, rel=1e-15)


def _texts():
    leaves = st.sampled_from(["x", "y", "z", "k", "2", "0.5", "1e-3", "7"])

    def grow(inner):
        two = st.tuples(inner, st.sampled_from("+-*/"), inner).map(lambda t: f"({t[0]} {t[1]} {t[2]})")
        call = st.tuples(st.sampled_from(sorted(FUNCTIONS)), inner, inner).map(
            lambda t: f"{t[0]}({t[1]}, {t[2]})" if operands_of(t[0]) == 2 else f"{t[0]}({t[1]})"
        )
        power = st.tuples(inner, st.integers(2, 5)).map(lambda t: f"({t[0]})^{t[1]}")
        return two | call | power | inner.map(lambda t: f"(-{t})")

    return st.recursive(leaves, grow, max_leaves=12)


def test_what_is_printed_reads_back_as_the_same_expression():
    count = 0

    @given(_texts())
    @example("(-(x + y)) + (-(x + y))")
    def again(text):
        nonlocal count
        try:
            expr = parse(text, NAMES)
        except ExpressionError:
            return  # a constant without a value, such as 1/(2 - 2)
        assert parse(str(expr), NAMES) is expr
        count += 1

    again()
    assert count > 50


def test_an_expression_of_500_terms_is_read():
    expr = parse(" + ".join(f"{n}*x^{n % 7 + 1}*y" for n in range(1, 501)), NAMES)
    want = sum(n * 0.5 ** (n % 7 + 1) * 2.0 for n in range(1, 501))
    assert evaluate(expr, {"x": 0.5, "y": 2.0}) == pytest.approx(want, rel=1e-13)


def test_depth_does_not_depend_on_the_callers_stack():
    deepest = "min(x, -" * 199 + "y" + ")" * 199
    assert parse(deepest, NAMES) is parse(deepest, NAMES)

    def below(levels):
        return parse(deepest, NAMES) if levels == 0 else below(levels - 1)

    assert below(700) is parse(deepest, NAMES)


def test_reading_and_spelling_import_neither_numpy_nor_sympy():
    program = """
        import sys
        from lenscl.expr import c_text, gradient, parse, polynomial
        F = parse("sqrt(x^2 + y^2) - 1", "xyz")
        c_text({"f": F, "x": gradient(F)[0]}, symbols={"x": "p.x", "y": "p.y"}, lanes="xyz", precision="single")
        print(sorted({"numpy", "sympy", "pyopencl"} & set(sys.modules)))
        from lenscl.expr import evaluate
        evaluate(F, {"x": 1.0, "y": 2.0})
        print("sympy" in sys.modules)
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(program)], capture_output=True, text=True, check=True)
    assert done.stdout.split("\n")[:2] == ["[]", "False"]


@pytest.mark.parametrize(
    "text",
    [
        "(x - y) * -(k * z)",
        "-((x - y - z) / k)",
        "cbrt(-((z - 1)^-1))",
        "(x - y) * -(k^0)",
        "-(2 * (x - y))",
        "-(k * (x - y))",
    ],
)
def test_a_sign_before_a_product_is_printed_so_that_it_stays_there(text):
    expr = parse(text, NAMES)
    assert parse(str(expr), NAMES) is expr
