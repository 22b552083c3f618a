from __future__ import annotations

import ast
import math
import pickle
import re

import pytest

from lenscl.errors import ExpressionError
from lenscl.lenses import user_surface

CUBE = ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))


def test_an_expression_becomes_a_surface_with_its_own_parameters():
    made = user_surface("x**4 + y**4 + z**4 - k", ["k"], CUBE)
    assert made.name == "expression"
    assert made.formula == "x**4 + y**4 + z**4 - k"
    assert [parameter.name for parameter in made.parameters] == ["k"]
    assert made.box({"k": 0.5}) == CUBE
    assert list(made.problems({"k": 0.5})) == []
    assert pickle.loads(pickle.dumps(made)) == made


def test_keys_are_equal_for_the_same_structure_only():
    one = user_surface("x^2 + y^2 + z^2 - k", ["k"], CUBE)
    assert one.key == user_surface("x*x + y**2 + z^2 - k", ["k"], ((-2, -2, -2), (2, 2, 2))).key
    others = [
        user_surface("x^2 + y^2 + z^2 - 2*k", ["k"], CUBE),
        user_surface("x^2 + y^2 + z^2 - q", ["q"], CUBE),
        user_surface("x^2 + y^2 + z^2 - k", ["k", "q"], CUBE),
        user_surface("x^2 + y^2 + z^4 - k", ["k"], CUBE),
    ]
    assert len({one.key, *(each.key for each in others)}) == 5
    assert all(each.key.isidentifier() for each in others)


@pytest.mark.parametrize(
    ("text", "values", "face"),
    [
        ("x^2 + y^2 + z^2 - k", {"k": 1.0}, "face x = -1"),  # touches
        ("x^2 + y^2 + z^2 - k", {"k": 1.2}, "face x = -1"),
        ("x^2 + y^2 - k", {"k": 0.5}, "face z = -1"),  # unbounded along z
        ("k*(x - 0.9)", {"k": 1.0}, "face x = -1"),
        ("(x - 0.9)^2 + y^2 + z^2 - k", {"k": 0.04}, "face x = 1"),
        ("-sqrt(x - 0.5)*k", {"k": 1.0}, "face x = 1"),  # NaN elsewhere, which is outside
    ],
)
def test_a_solid_that_reaches_a_face_is_an_error_of_the_bounds(text, values, face):
    found = list(user_surface(text, ["k"], CUBE).problems(values))
    assert [key for key, _ in found] == ["bounds"]
    assert face in found[0][1]
    assert "a ball, max(F" in found[0][1]


def test_max_with_a_ball_mends_it():
    assert list(user_surface("max(x^2 + y^2 - k, x^2 + y^2 + z^2 - 0.9)", ["k"], CUBE).problems({"k": 0.5})) == []


@pytest.mark.parametrize("box", [((0, 0, 0), (1, 0, 1)), ((0, 0, 0), (1, float("nan"), 1)), ((1, 1, 1), (0, 0, 0))])
def test_bounds_must_be_a_box(box):
    found = list(user_surface("x^2 + y^2 + z^2 - 1", [], box).problems({}))
    assert [key for key, _ in found] == ["bounds"]
    assert "low below its high" in found[0][1]


def test_words_of_c_may_be_parameters():
    made = user_surface("x^2 + y^2 + z^2 - half*double*VW", ["half", "double", "VW"], CUBE)
    assert list(made.problems({"half": 0.5, "double": 0.5, "VW": 1.0})) == []


def test_a_number_of_the_users_own_called_pi_takes_the_place_of_the_constant():
    own = user_surface("x^2 + y^2 + z^2 - pi", ["pi"], CUBE)
    assert [each.name for each in own.parameters] == ["pi"]
    assert own.expression.depends_on(["pi"])
    constant = user_surface("x^2 + y^2 + z^2 - pi/8", [], CUBE)
    assert not constant.parameters
    assert str(constant.expression).endswith(f"- {math.pi / 8!r}")


def test_a_parameter_that_is_not_finite_is_named():
    made = user_surface("x^2 + y^2 + z^2 - k", ["k"], CUBE)
    assert [key for key, _ in made.problems({"k": float("nan")})] == ["k"]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        *((key, "key of the lens table") for key in ("surface", "name", "centre", "stretch", "rotate", "n", "bounds")),
        *((key, "key of the lens table") for key in ("absorption", "absorbs")),
        ("x", "coordinates"),
        ("sqrt", "function"),
        ("pow", "function"),
        ("mod", "function"),
        ("floor", "function"),
        ("lambda", "cannot be read"),
        ("if", "cannot be read"),
        ("_k", "letter"),
        ("k-1", "letter"),
        ("é", "letter"),
        ("k" * 41, "at most 39"),
    ],
)
def test_names_that_cannot_be_parameters_are_refused(name, message):
    with pytest.raises(ExpressionError, match=message) as caught:
        user_surface(f"x^2 + y^2 + z^2 - {name}", [name], CUBE)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("k - 1", "must depend on x, y or z"),
        ("x - x", "must depend on x, y or z"),
        ("__import__('os')", "unexpected"),
        ("x^2 + q", "unknown name 'q'"),
        ("", "empty"),
    ],
)
def test_what_is_no_surface_is_refused_with_its_column(text, message):
    with pytest.raises(ExpressionError, match=message) as caught:
        user_surface(text, ["k"], CUBE)
    assert 0 <= caught.value.column <= len(text)


def advised(text: str, side: float = 2.0) -> str:
    """What is said of an expression in a cube; `problems` of the bounds, one of them."""
    ((key, message),) = user_surface(text, [], ((-side,) * 3, (side,) * 3)).problems({})
    assert key == "bounds"
    return message


REVERSED = [  # expressions that are positive inside, and the cube's half side
    ("1 - x**2 - y**2 - z**2", 2.0),
    ("1 - x**2 - y**2 - z**2", 0.9),  # bounds too tight as well: the faces cut the ball
    ("1 - x**2 - y**2 - z**2", 0.6),  # likewise, F is negative at the corners alone
    ("1 - x^4 - y^4 - z^4", 1.0),  # touches
    ("0.06 - (sqrt(x^2 + y^2) - 0.7)^2 - z^2", 1.5),
    ("min(1 - x^2 - y^2 - z^2, z)", 2.0),
    ("exp(1 - x^2 - y^2 - 2*z^2) - 1", 2.0),
    ("-(max(abs(x), abs(y), abs(z)) - 0.8)", 1.0),
    ("0.3 - (x - 1)^2 - y^2 - z^2", 2.0),
    ("0.01 - (x - 0.31)^2 - (y + 0.42)^2 - (z - 0.33)^2", 2.0),  # smaller than places are apart
    ("0.5*sqrt(9 - x^2 - y^2 - z^2) - 1", 2.0),  # has no value, and so no sign, where bounds are wider
    ("1 - x^2 - y^2", 2.0),  # without end, too
]
NOT_REVERSED = [
    "x^2 + y^2 - 1",
    "x^2 + y^2 + z^2 - 5",
    "x^2 + y^2 + z^2 - 10.3",  # fills the bounds but for their corners
    "x^2 + y^2 + z^2 - 30",
    "abs(z) - 1.9",
    "z - 0.5",
    "x - 10",
    "x^2 + y^2 - z^2 - 1",
    "sin(3*x)*cos(3*y) + sin(3*y)*cos(3*z) + sin(3*z)*cos(3*x)",
    "max(sqrt(x^2 + y^2 + z^2) - 2.1, 1 - sqrt(x^2 + y^2 + z^2))",  # a shell
    "-1 - x^2",
    "x*y*z",
]


@pytest.mark.parametrize(("text", "side"), REVERSED)
def test_a_reversed_sign_is_told_and_turning_it_round_mends_it(text, side):
    message = advised(text, side)
    assert "its sign seems to be reversed" in message
    turned = re.search(r"; try (.*)\. If the solid", message)[1]
    assert turned == f"-({text})"
    left = [what for _, what in user_surface(turned, [], ((-4.0,) * 3, (4.0,) * 3)).problems({})]
    assert left == [] if text != "1 - x^2 - y^2" else "along z it goes on" in left[0]


@pytest.mark.parametrize("text", NOT_REVERSED)
def test_a_sign_that_is_right_is_not_called_reversed(text):
    message = advised(text)
    assert "reversed" not in message
    assert "a ball, max(F" in message


@pytest.mark.parametrize(
    ("text", "reach"),
    [
        ("x^2 + y^2 + z^2 - 5", 5**0.5),
        ("x^2 + y^2 + z^2 - 30", 30**0.5),
        ("(x - 3)^2 + y^2 + z^2 - 1.5", 3 + 1.5**0.5),
        ("x^2 + y^2/4 + z^2/9 - 1", 3.0),
    ],
)
def test_bounds_that_are_too_tight_are_answered_by_bounds_that_hold_the_solid(text, reach):
    wide = ast.literal_eval(re.search(r"widen the bounds: (\[\[.*?\]\]) would hold it", advised(text))[1])
    assert list(user_surface(text, [], (tuple(wide[0]), tuple(wide[1]))).problems({})) == []
    assert reach < max(wide[1]) < 1.6 * reach


@pytest.mark.parametrize(
    ("text", "axes"),
    [
        ("x^2 + y^2 - 1", "z"),
        ("y^2 + z^2 - 1", "x"),
        ("(x - 0.3*y)^2 + (z + 0.7*y)^2 - 0.5", "y"),
        ("abs(z) - 1.5", "x and y"),
        ("z - 0.5", "x, y and z"),
        ("x^2 + y^2 - z", "z"),
    ],
)
def test_a_solid_without_end_is_told_with_the_axes_along_which_it_goes_on(text, axes):
    assert f"along {axes} it goes on beyond bounds 32 times as wide" in advised(text)


def test_a_solid_that_fills_its_bounds_is_told_as_such():
    assert "the solid fills the bounds" in advised("x^2 + y^2 + z^2 - 30")
    assert "the solid fills the bounds" in advised("-1 - x^2")
    assert "the solid fills the bounds" not in advised("x^2 + y^2 - 1")


def test_a_pole_on_a_face_is_told_with_its_operand():
    assert "there F holds the logarithm of x = 0" in advised("log(x) + y^2")
