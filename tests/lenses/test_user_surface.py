from __future__ import annotations

import pickle

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
