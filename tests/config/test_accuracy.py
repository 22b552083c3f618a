"""A wanted accuracy in a study: how it is written, and what it cannot stand beside."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lenscl.config import Accuracy, scene_from_toml, study_from_toml
from lenscl.errors import StudyError

WANTED = "[numerics]\naccuracy = '0.05 px'\nmax_events = 9\n"


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("'0.05 px'", Accuracy(0.05, "px")),
        ("' 5e-2px '", Accuracy(0.05, "px")),
        ("'1e-9'", Accuracy(1e-9, "scene units")),
        ("1e-9", Accuracy(1e-9, "scene units")),
        ("2", Accuracy(2.0, "scene units")),
    ],
)
def test_an_accuracy_is_a_length_on_the_picture(base, written, meant):
    assert scene_from_toml(base + f"[numerics]\naccuracy = {written}\n").numerics.accuracy == meant


@pytest.mark.parametrize(
    "written", ["'px'", "'0 px'", "'-1 px'", "'1e-400'", "'nan'", "'1 pixel'", "''", "true", "[1]", "0", "'1e999 px'"]
)
def test_what_is_no_accuracy_is_refused_by_name(base, problems, written):
    (found,) = problems(base + f"[numerics]\naccuracy = {written}\n")
    assert found.startswith("numerics.accuracy: must be ")


@given(st.floats(1e-300, 1e300), st.sampled_from(["px", "scene units"]))
def test_an_accuracy_comes_back_from_its_text(value, unit):
    accuracy = Accuracy(value, unit)
    assert Accuracy.read(str(accuracy)) == accuracy


def test_a_scene_with_an_accuracy_comes_back_from_its_text(base):
    scene = scene_from_toml(base + WANTED)
    assert scene_from_toml(scene.to_toml()) == scene
    assert scene.document()["numerics"] == {"accuracy": "0.05 px", "max_events": 9}


def test_keys_set_by_hand_replace_an_accuracy_and_the_reverse(base):
    scene = scene_from_toml(base + WANTED)
    by_hand = scene.replace({"numerics.method": "march", "numerics.step": 0.1})
    assert by_hand.numerics.accuracy is None
    assert (by_hand.numerics.method, by_hand.numerics.step, by_hand.numerics.max_events) == ("march", 0.1, 9)
    again = by_hand.replace({"numerics.accuracy": "1e-9"})
    assert (again.numerics.method, again.numerics.step) == ("auto", 0.01)
    assert again.numerics.accuracy == Accuracy(1e-9, "scene units")


def test_both_at_once_are_an_error(base):
    with pytest.raises(StudyError, match=r"numerics\.accuracy: chooses method itself"):
        scene_from_toml(base + WANTED).replace({"numerics.method": "march", "numerics.accuracy": "1 px"})


def test_a_sweep_may_vary_the_accuracy_or_what_it_chooses_but_not_both(base, problems):
    axes = base + WANTED + "[sweep.axes]\n'numerics.accuracy' = ['1 px', '1e-3 px']\n"
    assert [str(point.scene.numerics.accuracy) for point in study_from_toml(axes).points()] == ["1.0 px", "0.001 px"]
    methods = base + WANTED + "[sweep.axes]\n'numerics.precision' = ['single', 'double']\n"
    assert [point.scene.numerics.accuracy for point in study_from_toml(methods).points()] == [None, None]
    (found,) = problems(axes + "'numerics.method' = ['auto']\n")
    assert found == ("sweep.axes.numerics.method: varies with numerics.accuracy in its place; keep one of the two")
