"""Which points a sweep has, and in what order; the arithmetic of its axes."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import assume, event, given
from hypothesis import strategies as st

from lenscl.config import parse_override, study_from_toml
from lenscl.config.axes import Linspace, Logspace, Range, Span, read_axis
from lenscl.errors import StudyError

numbers = st.floats(-1e6, 1e6, allow_nan=False)


def values_of(study):
    return [dict(point.values) for point in study.points()]


@given(start=numbers, stop=numbers, count=st.integers(1, 200))
def test_linspace_is_numpys_to_the_last_bit(start, stop, count):
    # NumPy computes another way where the step underflows to 0
    assume(count < 2 or start == stop or (stop - start) / (count - 1) != 0.0)
    assert list(Linspace(start, stop, count).make()) == np.linspace(start, stop, count).tolist()


@given(start=st.floats(1e-9, 1e9), stop=st.floats(1e-9, 1e9), count=st.integers(2, 100))
def test_logspace_has_both_ends_and_a_constant_ratio(start, stop, count):
    made = Logspace(start, stop, count).make()
    assert len(made) == count
    assert (made[0], made[-1]) == (start, stop)
    np.testing.assert_allclose(made, np.geomspace(start, stop, count), rtol=1e-13)


def test_logspace_over_powers_of_ten_meets_them():
    assert Logspace(1e-3, 1e-9, 7).make() == (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)


@given(
    start=st.floats(-1e3, 1e3),
    step=st.floats(1e-3, 1e2) | st.floats(-1e2, -1e-3),
    count=st.integers(1, 300),
    off=st.sampled_from([0.0, 1e-10, -1e-10, 1e-3, -1e-3, 0.5]),
)
def test_a_range_takes_its_stop_exactly_when_a_step_hits_it(start, step, count, off):
    # The stop lies `off` steps beyond the last of `count` values; rounding of start + count * step stays below 1e-9
    assume(abs(start) / abs(step) < 1e5)
    stop = start + (count - 1 + off) * step
    assume(count > 1 or off > -1e-6)
    made = Range(start, stop, step).make()
    expected = count - 1 if off == -1e-3 else count
    event(f"off {off}")
    assert len(made) == Range(start, stop, step).count == expected
    assert made[0] == pytest.approx(start, abs=1e-9 * abs(step))
    assert (made[-1] == stop) is (abs(off) <= 1e-9)
    np.testing.assert_allclose(np.diff(made), step, rtol=1e-5)


def test_a_range_of_whole_numbers_stays_whole():
    made = read_axis({"range": [64, 256, 64]}).make()
    assert made == (64, 128, 192, 256)
    assert all(type(value) is int for value in made)


def test_a_naive_range_would_lose_its_stop():
    """The broken twin: counting by floor alone drops 0.8 from 0.2, 0.4, 0.6, 0.8."""
    assert math.floor((0.7 - 0.1) / 0.1) + 1 == 6  # not 7
    assert len(Range(0.1, 0.7, 0.1).make()) == 7


@given(
    low=st.floats(1e-6, 1e6), high=st.floats(1e-6, 1e6), share=st.floats(0, 1), scale=st.sampled_from(["linear", "log"])
)
def test_a_sample_lies_within_its_span(low, high, share, scale):
    assume(low <= high)
    value = Span(low, high, scale).at(share)
    assert low <= value <= high


def test_the_last_axis_varies_fastest_and_zip_groups_come_after_the_axes(base):
    study = study_from_toml(
        base
        + """
[sweep.axes]
"lens.r" = [0.1, 0.2]
"lens.n" = [1.4, "diamond"]
[[sweep.zip]]
"lens.R" = [0.6, 0.7]
"lens.stretch.x" = [1, 2]
"""
    )
    assert study.axes == ("lens.r", "lens.n", "lens.R", "lens.stretch.x")
    rows = [tuple(values.values()) for values in values_of(study)]
    assert rows == [
        (0.1, 1.4, 0.6, 1),
        (0.1, 1.4, 0.7, 2),
        (0.1, "diamond", 0.6, 1),
        (0.1, "diamond", 0.7, 2),
        (0.2, 1.4, 0.6, 1),
        (0.2, 1.4, 0.7, 2),
        (0.2, "diamond", 0.6, 1),
        (0.2, "diamond", 0.7, 2),
    ]
    last = list(study.points())[-1]
    lens = last.scene.lenses[0]
    assert (last.index, lens.values["r"], lens.values["R"], lens.stretch) == (7, 0.2, 0.7, (2.0, 1.0, 1.0))
    assert lens.n == pytest.approx(2.4175, abs=1e-4)


def test_without_axes_there_is_the_one_point_of_the_scene(base):
    study = study_from_toml(base)
    (point,) = study.points()
    assert (study.axes, study.point_count(), dict(point.values)) == ((), 1, {})
    assert point.scene == study.scene


def test_exclude_matches_every_key_given_and_what_an_axis_computed(base):
    study = study_from_toml(
        base
        + """
[sweep.axes]
"lens.r" = { linspace = [0.1, 0.4, 4] }
"lens.n" = [1.33, 1.458]
[[sweep.exclude]]
"lens.r" = 0.3
"lens.n" = 1.458
[[sweep.exclude]]
"lens.r" = 0.4
"""
    )
    assert 0.3 not in Linspace(0.1, 0.4, 4).make()  # it is 0.30000000000000004: equality alone would miss it
    rows = [(round(values["lens.r"], 9), values["lens.n"]) for values in values_of(study)]
    assert rows == [(0.1, 1.33), (0.1, 1.458), (0.2, 1.33), (0.2, 1.458), (0.3, 1.33)]
    assert study.point_count() == 5


def test_an_exclude_may_hold_a_number_beyond_all_floats(base):
    axes = "[sweep.axes]\n'lens.r' = [0.1, 0.2]\n'film.size' = [[3, 4]]\n[[sweep.exclude]]\n"
    for pattern in (f"'lens.r' = 1{'0' * 400}", f"'film.size' = [3, 1{'0' * 400}]", f"'lens.r' = -1{'0' * 400}"):
        assert study_from_toml(base + axes + pattern).point_count() == 2


def test_include_adds_points_that_exclude_does_not_touch_and_other_keys_keep_their_defaults(base):
    study = study_from_toml(
        base
        + """
[sweep.axes]
"lens.r" = [0.1, 0.2]
[[sweep.exclude]]
"lens.r" = 0.2
[[sweep.include]]
"lens.r" = 0.2
"numerics.tolerance" = 1e-5
[[sweep.include]]
"lens.n" = 2.0
"""
    )
    assert study.axes == ("lens.r", "numerics.tolerance", "lens.n")
    assert [tuple(values.values()) for values in values_of(study)] == [
        (0.1, None, 1.5),
        (0.2, 1e-5, 1.5),
        (0.25, None, 2.0),
    ]
    scenes = [point.scene for point in study.points()]
    assert [scene.numerics.tolerance for scene in scenes] == [None, 1e-5, None]


def test_an_included_point_may_set_the_whole_where_an_axis_varies_a_part(base):
    study = study_from_toml(
        base
        + """
[sweep.axes]
"film.size.rows" = [2, 3]
"film.centre" = [[0, 0, 2.0], [0, 0, 3.0]]
[[sweep.include]]
"film.size" = [4, 5]
"film.corner" = [0, 0, 2.25]
"""
    )
    assert study.axes == ("film.size.rows", "film.centre", "film.size", "film.corner")
    films = [point.scene.film for point in study.points()]
    assert [(film.size, film.keeps, film.anchor[2]) for film in films] == [
        ((8, 2), "centre", 2.0),
        ((8, 2), "centre", 3.0),
        ((8, 3), "centre", 2.0),
        ((8, 3), "centre", 3.0),
        ((4, 5), "corner", 2.25),
    ]
    assert values_of(study)[-1] == {
        "film.size.rows": None,
        "film.centre": None,
        "film.size": [4, 5],
        "film.corner": [0, 0, 2.25],
    }


def test_an_included_point_may_set_a_part_where_an_axis_varies_the_whole(base):
    study = study_from_toml(
        base + "[sweep.axes]\n'film.size' = [[2, 2], [3, 3]]\n[[sweep.include]]\n'film.size.rows' = 5\n"
    )
    assert [point.scene.film.size for point in study.points()] == [(2, 2), (3, 3), (8, 5)]


def test_included_points_may_set_the_whole_and_a_part_each_in_its_own(base):
    tables = ["'film.size' = [4, 5]", "'film.size.rows' = 7", "'film.size.columns' = 1", "'lens.r' = 0.1"]
    study = study_from_toml(base + "".join(f"[[sweep.include]]\n{table}\n" for table in tables))
    assert [point.scene.film.size for point in study.points()] == [(8, 6), (4, 5), (8, 7), (1, 6), (8, 6)]


@pytest.mark.parametrize(
    ("sweep", "key", "problem"),
    [
        (
            "[[sweep.include]]\n'film.size' = 3\n'film.size.columns' = 4\n",
            "film.size.columns",
            "is set already, as a part of film.size; keep one of the two (point 1: ",
        ),
        (
            "[[sweep.include]]\n'film.corner' = [0, 0, 1]\n'film.centre' = [0, 0, 1]\n",
            "film.corner",
            "only one of the two may be given, film.corner or film.centre (point 1: ",
        ),
        (
            "[sweep.axes]\n'film.centre.x' = [0]\n'film.corner' = [[0, 0, 1]]\n",
            "sweep.axes.film.corner",
            "varies with film.centre in its place; keep one of the two",
        ),
        (
            "[sweep.axes]\n'film.corner' = [[0, 0, 1]]\n'film.centre' = [[0, 0, 1]]\n",
            "sweep.axes.film.centre",
            "varies with film.corner in its place; keep one of the two",
        ),
    ],
)
def test_a_sweep_that_sets_one_value_twice_is_refused(base, problems, sweep, key, problem):
    (found,) = problems(base + sweep)
    assert found.startswith(f"{key}: {problem}")


def test_overrides_that_set_one_value_twice_are_refused(base):
    study = study_from_toml(base)
    with pytest.raises(StudyError) as caught:
        study.with_overrides(dict([parse_override("film.size=[3]"), parse_override("film.size.rows=4")]))
    assert caught.value.problems == ("film.size.rows: is set already, as a part of film.size; keep one of the two",)
    swept = study_from_toml(base + "[sweep.axes]\n'film.centre.z' = [2, 3]\n")
    with pytest.raises(StudyError) as caught:
        swept.with_overrides({"film.corner": [0, 0, 1]})
    (problem,) = caught.value.problems
    assert problem == "film.corner: cannot be set, because the axis film.centre.z stands in its place"


@pytest.mark.parametrize("mode", ["latin", "halton", "sobol", "random"])
def test_samples_fill_their_spans_and_repeat_for_a_seed(base, mode):
    def read(seed: int):
        return values_of(
            study_from_toml(
                base
                + f"""
[sweep]
mode = "{mode}"
samples = 50
seed = {seed}
[sweep.axes]
"lens.r" = {{ min = 0.001, max = 0.1, scale = "log" }}
"lens.n" = {{ min = 1.1, max = 2.1 }}
"""
            )
        )

    rows = read(1)
    assert len(rows) == 50
    assert rows == read(1)
    assert rows != read(2)
    r = np.array([row["lens.r"] for row in rows])
    n = np.array([row["lens.n"] for row in rows])
    assert r.min() >= 0.001
    assert r.max() <= 0.1
    # Half of the samples lie below the geometric mean of a log span, not below its middle
    assert 15 <= np.sum(r < 0.01) <= 35
    assert 15 <= np.sum(n < 1.6) <= 35
    if mode == "latin":  # one sample in each fiftieth
        assert sorted(np.floor((n - 1.1) * 50).astype(int)) == list(range(50))


def test_a_hundred_thousand_points_are_counted_and_listed_without_building_scenes(base):
    study = study_from_toml(
        base + '[sweep.axes]\n"lens.r" = { linspace = [0.1, 0.2, 1000] }\n"lens.n" = { range = [1.1, 2.09, 0.01] }\n'
    )
    assert study.point_count() == 100_000
    indices = [point.index for point in study.points()]
    assert indices == list(range(100_000))


def test_a_point_that_cannot_be_built_fails_alone_and_names_its_values(base):
    text = base + '[sweep.axes]\n"film.right.x" = [2, 0]\n"film.right.y" = [0, 1]\n'
    with pytest.raises(StudyError) as caught:
        study_from_toml(text)
    assert caught.value.problems == (
        "film.right: must not be shorter than 1e-12, got [0, 0, 0.0] (point 2: film.right.x = 0, film.right.y = 0)",
    )


def test_an_override_holds_an_axis_and_leaves_the_others(base):
    study = study_from_toml(base + '[sweep.axes]\n"lens.r" = [0.1, 0.2]\n"lens.n" = [1.4, 1.6]\n')
    held = study.with_overrides({"lens.r": 0.15, "output.format": "exr", "title": "held"})
    assert [tuple(values.values()) for values in values_of(held)] == [(0.15, 1.4), (0.15, 1.6)]
    assert held.scene.lenses[0].values["r"] == 0.15
    assert (held.output.format, held.title, dict(held.overrides)["lens.r"]) == ("exr", "held", 0.15)
    assert study.point_count() == 4  # the study itself does not change
    with pytest.raises(StudyError, match=r"lens\.q: unknown key"):
        study.with_overrides({"lens.q": 1})
    with pytest.raises(StudyError, match=r"sweep\.axes: cannot be set; sweep\.mode, "):
        study.with_overrides({"sweep.axes": {}})


def test_an_override_of_a_part_is_refused_where_an_axis_varies_the_whole(base):
    study = study_from_toml(base + '[sweep.axes]\n"lens.stretch" = [[1, 1, 1], [2, 1, 1]]\n')
    with pytest.raises(StudyError, match=r"lens\.stretch\.x: cannot be set, because the axis lens\.stretch varies"):
        study.with_overrides({"lens.stretch.x": 3})


def test_a_surface_can_be_swept_with_the_parameters_that_only_some_have(base):
    study = study_from_toml(
        base.replace("R = 0.7\nr = 0.25\n", "")
        + """
[[sweep.zip]]
"lens.surface" = ["torus", "torus"]
"lens.R" = [0.5, 0.6]
[[sweep.include]]
"lens.surface" = "sphere"
[[sweep.include]]
"lens.surface" = "ellipsoid"
"lens.a" = 2
"""
    )
    lenses = [point.scene.lenses[0] for point in study.points()]
    assert [(lens.formula, dict(lens.values)) for lens in lenses] == [
        ("torus", {"R": 0.5, "r": 0.25}),
        ("torus", {"R": 0.6, "r": 0.25}),
        ("sphere", {"r": 1.0}),
        ("ellipsoid", {"a": 2.0, "b": 1.0, "c": 1.0, "r": 1.0}),
    ]
    assert dict(list(study.points())[2].values) == {"lens.surface": "sphere", "lens.R": None, "lens.a": None}


def test_the_sampled_modes_name_the_fix_where_scipy_is_missing(base):
    text = base + '[sweep]\nmode = "latin"\nsamples = 3\n[sweep.axes]\n"lens.r" = { min = 0.1, max = 0.2 }\n'
    code = (
        "import sys; sys.modules['scipy'] = None\n"
        "from lenscl.config import parse_override, study_from_toml\n"
        "from lenscl.errors import StudyError\n"
        f"try: study_from_toml({text!r})\n"
        "except StudyError as error: print(error)\n"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == (
        "sweep.mode: \"latin\" needs SciPy, which is not installed; install it with: pip install 'lenscl[sampling]'"
    )
