"""`[[lens]] at`: an array is its lens at every place, in a study file, in its keys and in what is written of it."""

from __future__ import annotations

import pickle
import re
import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lenscl.config import Lenses, Places, load_study, scene_from_toml, study_from_toml, study_schema
from lenscl.errors import StudyError

PLACES = [[0.0, 0.0, 0.0], [1.5, 0.0, 0.25], [-1.5, 0.5, 0.0]]
BALL = "[[lens]]\nname = 'ball'\nsurface = 'sphere'\nr = 0.1\ncentre = [0, 2, 0]\nn = 1.6\npriority = 2\n"


def in_array(base: str, at: object = PLACES, more: str = "") -> str:
    return base.replace("n = 1.5", f"n = 1.5\nname = 'rings'\nat = {at!r}\n{more}")


@pytest.fixture
def scene(base):
    return scene_from_toml(in_array(base) + BALL)


def test_an_array_is_its_lens_at_every_place(base, scene):
    written = [
        base[base.index("[[lens]]") :].replace("n = 1.5", f"n = 1.5\nname = 'ring{i}'\ncentre = {place}")
        for i, place in enumerate(PLACES)
    ]
    alone = scene_from_toml(base[: base.index("[[lens]]")] + "".join(written) + BALL)
    assert len(scene.lenses) == len(alone.lenses) == 4
    for number, (one, other) in enumerate(zip(scene.lenses, alone.lenses, strict=True)):
        assert scene.lenses[number] == scene.lenses[number - 4] == one
        assert (one.centre, one.values, one.stretch, one.n) == (other.centre, other.values, other.stretch, other.n)
        assert one.surface is other.surface
    assert scene.by_priority() == alone.by_priority() == (0, 1, 2, 3)
    assert scene.lenses[1:3] == (scene.lenses[1], scene.lenses[2])
    with pytest.raises(IndexError):
        scene.lenses[4]
    assert [scene.lens_key(number) for number in range(4)] == [
        "lens.rings.at[0]", "lens.rings.at[1]", "lens.rings.at[2]", "lens.ball"
    ]  # fmt: skip


def test_an_array_of_higher_priority_is_above_all_others(base):
    scene = scene_from_toml(in_array(base, more="priority = 3") + BALL)
    assert scene.by_priority() == (3, 0, 1, 2)


@given(
    places=st.lists(st.tuples(*[st.floats(-1e12, 1e12) | st.just(-0.0)] * 3), min_size=1, max_size=5),
    others=st.lists(st.tuples(*[st.floats(-1.0, 1.0)] * 3), min_size=1, max_size=5),
)
def test_a_scene_with_an_array_goes_to_text_and_back_unchanged(base, places, others):
    scene = scene_from_toml(in_array(base, [list(place) for place in places]) + BALL)
    text = scene.to_toml()
    assert scene_from_toml(text) == scene
    assert hash(scene_from_toml(text)) == hash(scene)
    assert scene_from_toml(text).to_toml() == text
    assert tomllib.loads(text) == scene.document()
    assert pickle.loads(pickle.dumps(scene)) == scene
    assert not re.search(r"-0\.0[],]", text)
    other = scene.replace({"lens.rings.at": others})
    assert (other == scene) is (Places.of(others) == Places.of(places))
    assert other.replace({"lens.rings.at": places}) == scene
    assert np.array_equal(scene.lenses.groups[0].centres, np.array(places))


def test_keys_of_an_array_reach_all_of_its_copies(scene):
    for key, value, read in (
        ("lens.rings.r", 0.2, lambda lens: lens.values["r"]),
        ("lens.rings.n", 1.7, lambda lens: lens.n),
        ("lens.rings.stretch.y", 0.5, lambda lens: lens.stretch[1]),
        ("lens.rings.rotate.x", 30.0, lambda lens: lens.rotate[0]),
        ("lens.rings.priority", 4.0, lambda lens: lens.priority),
        ("lens.rings.absorbs", True, lambda lens: lens.absorbs),
    ):
        changed = scene.replace({key: value}).lenses
        assert [read(lens) for lens in changed[:3]] == [value] * 3, key
        assert [lens.centre for lens in changed] == [lens.centre for lens in scene.lenses]
        assert changed[3] == scene.lenses[3]
    lit = scene.replace({"lens.rings.n": "BK7", "effects.dispersion": "rgb"})
    for layer in lit.layers():
        assert len({lens.n for lens in layer.lenses[:3]}) == 1
        assert layer.lenses.groups[0].at == scene.lenses.groups[0].at


def test_all_places_of_an_array_are_set_as_a_whole(base, scene):
    moved = scene.replace({"lens.rings.at": [(0, 0, 1)]})
    assert [lens.centre for lens in moved.lenses] == [(0.0, 0.0, 1.0), (0.0, 2.0, 0.0)]
    assert scene.replace({"lens.rings.at": np.array(PLACES)}) == scene
    # A lens that has a centre becomes an array
    made = scene.replace({"lens.ball.at": PLACES})
    assert len(made.lenses) == 6
    assert made.lenses[4].centre == (1.5, 0.0, 0.25)
    study = study_from_toml(in_array(base) + f"[sweep.axes]\n'lens.at' = [{PLACES[:1]}, {PLACES[:2]}]\n")
    assert [len(point.scene.lenses) for point in study.points()] == [1, 2]
    assert len(study_from_toml(base, overrides={"lens.at": PLACES}).scene.lenses) == 3


@pytest.mark.parametrize(
    ("key", "says"),
    [
        ("lens.rings.centre", "is an array, which has no centre; set lens.rings.at"),
        ("lens.rings.centre.x", "is an array, which has no centre; set lens.rings.at"),
        ("lens.rings.at.x", "lens.rings.at is set as a whole"),
    ],
)
def test_one_place_of_an_array_has_no_key(base, scene, key, says):
    with pytest.raises(StudyError) as caught:
        scene.replace({key: 0.5})
    (problem,) = caught.value.problems
    assert problem.startswith(f"{key}: ")
    assert says in problem
    with pytest.raises(StudyError) as caught:
        study_from_toml(in_array(base) + BALL + f"[sweep.axes]\n'{key}' = [0.5]\n")
    assert [problem.startswith(f"sweep.axes.{key}: ") for problem in caught.value.problems] == [True]


@pytest.mark.parametrize(
    ("at", "says"),
    [
        ("[]", "got an empty list"),
        ("[0, 0, 0]", "place 1 must be three numbers [x, y, z], got 0; a single place is written [[0, 0, 0]]"),
        ("[[0, 0, 0], [1, 2]]", "place 2 must be three numbers [x, y, z], got [1, 2]"),
        ("[[0, 0, 0], [1, 2, inf]]", "place 2 must be three numbers [x, y, z]; the value at place 3 must be a finite"),
        ("[[0, 0, nan]]", "place 1 must be three numbers [x, y, z]; the value at place 3 must be a finite number"),
        ("[[0, 0, 1e13]]", "place 1 must be three numbers [x, y, z]; the value at place 3 must lie from"),
        ("[[0, 0, true]]", "place 1 must be three numbers [x, y, z]; the value at place 3 must be a finite number"),
        ("[['1', 0, 0]]", "a number is written without quotation marks"),
        ("3", "got 3"),
        ("''", "got \"\""),
        ("'no.csv'", "no.csv: there is no such file"),
        ("'.'", ".: is not a plain file"),
        ('"a\\u0000b"', "must be a list of places"),
    ],
)  # fmt: skip
def test_what_is_no_list_of_places_is_refused_by_its_key(base, problems, at, says):
    (found,) = problems(base.replace("n = 1.5", f"n = 1.5\nat = {at}"))
    assert found.startswith("lens.at: "), found
    assert says in found
    (found,) = problems(base.replace("n = 1.5", f"n = 1.5\nname = 'a'\nat = {at}") + BALL)
    assert found.startswith("lens.a.at: "), found


def test_a_lens_has_places_or_a_centre(base, problems):
    (found,) = problems(in_array(base, more="centre = [0, 0, 0]"))
    assert found == "lens.at: only one of the two may be given, lens.at for an array or lens.centre for one lens"


@pytest.mark.parametrize(
    "text",
    [
        "0,0,0\n1.5, 0, 0.25\n-1.5,0.5,0\n",
        "x,y,z\n0,0,0\n1.5,0,0.25\n-1.5,0.5,0",
        '"X", "Y", "Z"\n"0","0","0"\n\'1.5\',0,"0.25"\n-1.5,0.5,0\n',
        "0  0 0\n 1.5 0 0.25 \n-1.5\t 0.5\t0\t# the last\n",
        "\ufeff# a lattice\n\nx\ty\tz\r\n0\t0\t0\r\n1.5\t0\t0.25  # the second\r\n-1.5\t5e-1\t-0\r\n",
    ],
)
def test_places_are_read_from_a_file_beside_the_study(base, tmp_path, monkeypatch, scene, text):
    (tmp_path / "places.csv").write_text(text, encoding="utf-8", newline="")
    (tmp_path / "study.toml").write_text(in_array(base, "places.csv") + BALL)
    assert load_study(tmp_path / "study.toml").scene == scene
    monkeypatch.chdir(tmp_path.parent)  # not from where the program is started
    assert load_study(tmp_path / "study.toml").scene == scene
    study = load_study(tmp_path / "study.toml", {"lens.rings.at": PLACES[:1]})
    assert len(study.scene.lenses) == 2
    assert study.with_overrides({"lens.rings.at": "places.csv"}).scene == scene
    listed = in_array(base) + BALL + "[sweep.axes]\n'lens.rings.at' = ['places.csv']\n'lens.ball.r' = [0.1]\n"
    (tmp_path / "swept.toml").write_text(listed)
    (point,) = load_study(tmp_path / "swept.toml").points()
    assert point.scene == scene
    assert point.values["lens.rings.at"] == "places.csv"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("0,0,0\n1,2\n", "places.csv, line 2: must be three finite numbers x, y, z; got \"1,2\""),
        ("x,y,z\na,b,c\n", "line 2: must be three finite numbers x, y, z; got \"a,b,c\""),
        ("0,0,nan\n", "line 1: must be three finite numbers x, y, z; must be a finite number, got nan"),
        ("x,y,z\n0,0,1e999\n", "line 2: must be three finite numbers x, y, z; must be a finite number, got inf"),
        ("0,0,1_0\n", "line 1: must be three finite numbers"),
        ("0;0;0\n1;0;0\n", "line 1: must be three finite numbers x, y, z; got \"0;0;0\"; the separator \";\" is not"),
        ("0,0,0\n1,5;2,5;3,5\n", "line 2: must be three finite numbers x, y, z; got \"1,5;2,5;3,5\"; the separator"),
        ("1;2;3", "line 1: must be three finite numbers x, y, z; got \"1;2;3\"; the separator \";\" is not read"),
        ("x;y;z\n0,0,0\n", "line 1: must be three finite numbers x, y, z; got \"x;y;z\"; the separator \";\" is not"),
        ("\"1,5\",\"2\"\n0,0,0\n", "line 1: must be three finite numbers"),
        ("\"1;2;3\"\n0,0,0\n", "line 1: must be three finite numbers"),
        ("\"1 2 3\"\n0,0,0\n", "line 1: must be three finite numbers"),
        ("z,y,x\n1,2,3\n", "line 1: must be three finite numbers x, y, z; got \"z,y,x\"; column names, if the first"),
        ("x,y\n1,2,3\n", "line 1: must be three finite numbers x, y, z; got \"x,y\"; column names, if the first"),
        ("x,y,z\nx,y,z\n1,2,3\n", "line 2: must be three finite numbers"),
        ("1,2,3\nx,y,z\n", "line 2: must be three finite numbers"),
        ("O,O,O\n1,2,3\n", "line 1: must be three finite numbers"),
        ("1,,2,3\n", "line 1: must be three finite numbers x, y, z; got \"1,,2,3\"; a field is empty"),
        ("1,2,3,\n", "line 1: must be three finite numbers x, y, z; got \"1,2,3,\"; a field is empty"),
        (",1,2,3\n", "line 1: must be three finite numbers x, y, z; got \",1,2,3\"; a field is empty"),
        ("1\t\t2\t3\n", "a field is empty"),
        ("1,5 2\n", "line 1: must be three finite numbers x, y, z; got \"1,5 2\""),
        ("x,y,z\n", "places.csv: has no places"),
        ("\xff\n", "places.csv: is not UTF-8 text"),
    ],
)  # fmt: skip
def test_a_file_that_is_not_of_places_is_refused_by_key_file_and_line(base, tmp_path, text, says):
    (tmp_path / "places.csv").write_text(text, encoding="latin-1")
    (tmp_path / "study.toml").write_text(in_array(base, "places.csv"))
    with pytest.raises(StudyError) as caught:
        load_study(tmp_path / "study.toml")
    (problem,) = caught.value.problems
    assert problem.startswith("lens.at: ")
    assert says in problem


def test_many_copies_are_one_table(base):
    """What a scene of 100,000 lenses is asked for at every turn is looked up by table."""
    many = np.random.default_rng(1).uniform(-9.0, 9.0, (99_999, 3))
    scene = scene_from_toml(in_array(base) + BALL).replace({"lens.rings.at": many})
    assert len(scene.lenses.groups) == 2
    made = []

    def seen(lens):
        made.append(lens)
        return lens

    changed = scene.lenses.with_each(seen)
    assert len(made) == 2
    assert changed == scene.lenses
    assert len(pickle.dumps(scene)) < 100_000 * 3 * 8 + 10_000
    assert scene.lenses[99_998].centre == tuple(many[-1])
    assert scene.lenses.group_of(99_999).lens.name == "ball"
    hashed = Lenses.of(scene.lenses)
    assert hashed is scene.lenses


def test_editors_know_the_places_of_an_array():
    at = study_schema()["properties"]["lens"]["items"]["properties"]["at"]
    assert at["anyOf"][0]["items"]["minItems"] == at["anyOf"][0]["items"]["maxItems"] == 3
    assert at["anyOf"][0]["maxItems"] == 100_000
    assert at["anyOf"][1]["type"] == "string"
    assert "array" in at["description"]
