"""What is set is set before a study is judged: the file's own value may be wrong, missing, or need what is not here."""

from __future__ import annotations

import itertools
import sys

import pytest

from lenscl.config import load_study, parse_override, study_from_toml
from lenscl.errors import StudyError

LATIN = "[sweep]\nmode = 'latin'\nsamples = 3\n[sweep.axes]\n'lens.r' = { min = 0.1, max = 0.2 }\n"
MENDED = [  # what the valid study is made wrong by, and what is set
    (("size = [8, 6]", "size = [8, 0]"), ["film.size=[4, 4]"]),
    (("size = [8, 6]", "size = [8, 0]"), ["film.size.rows=4"]),
    (("size = [8, 6]", ""), ["film.size=[4, 4]"]),
    (("at = [0, 0, 4]", ""), ["source.at=[0, 0, 5]"]),
    (("at = [0, 0, 4]", 'kind = "parallel"'), ["source.direction=[0, 0, -1]"]),
    (("centre = [0, 0, 2.5]", ""), ["film.corner=[-1, 1, 2.5]"]),
    (("n = 1.5", ""), ["lens.n=1.5"]),
    (("n = 1.5", 'n = "plexi"'), ["lens.n=acrylic"]),
    (("r = 0.25", "r = -1"), ["lens.r=0.2"]),
    (("r = 0.25", "r = 0.25\nabsorbs = 3"), ["lens.absorbs=true", "lens.n=1.4"]),
    (('surface = "torus"\nR = 0.7\nr = 0.25', 'surface = "bunny.stl"\nscale = 2.0'), ["lens.surface=sphere"]),
    (('surface = "torus"\nR = 0.7\nr = 0.25', 'surface = ""'), ["lens.surface=torus", "lens.r=0.1"]),
    (("n = 1.5", "n = 1.5\n[numerics]\nmethod = 'fast'"), ["numerics.accuracy=1e-3"]),
    (("n = 1.5", "n = 1.5\n[effects]\nfresnel = 'yes'"), ["effects.fresnel=split"]),
    (("n = 1.5", "n = 1.5\n[effects]\nenvironment = -1"), ["effects.environment=around.png"]),
    (("n = 1.5", "n = 1.5\n[output]\nformat = 'gif'"), ["output.format=png"]),
    (("n = 1.5", "n = 1.5\n[sweep]\nmode = 'gird'\n[sweep.axes]\n'lens.r' = [0.1]"), ["sweep.mode=grid"]),
    (("n = 1.5", "n = 1.5\n[sweep.axes]\n'lens.r' = []"), ["lens.r=0.2"]),
    (("n = 1.5", "n = 1.5\n[sweep.axes]\n'lens.r' = [0.1, -1]"), ["lens.r=0.2"]),
    (("n = 1.5", "n = 1.5\n[sweep.axes]\n'lens.r' = { linspace = [0.1, 0.2, 1000000] }"), ["sweep.max_points=1000000"]),
    (("n = 1.5", "n = 1.5\n[sweep.axes]\n'lens.r' = { linspace = [0.1, 0.2, 1000000] }"), ["lens.r=0.2"]),
    (("[source]", "title = 3\n[source]"), ["title=name"]),
]


@pytest.mark.parametrize(("change", "sets"), MENDED)
def test_what_is_wrong_in_the_file_and_set_is_no_problem(base, tmp_path, change, sets):
    assert change[0] in base
    (tmp_path / "study.toml").write_text(base.replace(*change, 1))
    changes = dict(parse_override(text) for text in sets)
    with pytest.raises(StudyError):
        load_study(tmp_path / "study.toml")
    study = load_study(tmp_path / "study.toml", changes)
    assert dict(study.overrides) == changes
    inner = {key: value for key, value in changes.items() if key.split(".")[0] not in ("title", "output", "sweep")}
    inner.pop("effects.environment", None)  # a path from the study's folder
    assert study.scene.replace(inner) == study.scene
    points = list(itertools.islice(study.points(), 3))
    assert points
    for point in points:
        assert point.scene.replace(inner) == point.scene


def test_what_is_left_is_reported_and_what_is_mended_is_not(base):
    text = base.replace("size = [8, 6]", "size = [8, 0]").replace("n = 1.5", 'n = "aer"')
    with pytest.raises(StudyError) as caught:
        study_from_toml(text, overrides={"film.size": [4, 4]})
    (left,) = caught.value.problems
    assert left.startswith("lens.n: ")
    with pytest.raises(StudyError) as caught:
        study_from_toml(text, overrides={"film.size": [4, 0], "lens.q": 3})
    assert caught.value.problems[0].startswith("film.size: ")
    assert len(caught.value.problems) >= 2


def test_setting_a_key_of_a_right_file_is_as_changing_the_study(base):
    changes = {"lens.r": 0.2, "film.size.rows": 3, "sweep.max_points": 7}
    text = base + "[sweep.axes]\n'lens.r' = [0.1, 0.15]\n'lens.n' = [1.4, 1.5]\n"
    assert study_from_toml(text, overrides=changes) == study_from_toml(text).with_overrides(changes)


def test_a_mode_that_needs_scipy_may_be_replaced_where_there_is_none(base, monkeypatch):
    monkeypatch.setitem(sys.modules, "scipy", None)
    monkeypatch.setitem(sys.modules, "scipy.stats", None)
    with pytest.raises(StudyError, match="needs SciPy"):
        study_from_toml(base + LATIN)
    study = study_from_toml(base + LATIN, overrides={"sweep.mode": "random"})
    assert study.point_count() == 3
    assert study.sweep.mode == "random"
    with pytest.raises(StudyError, match=r"halton.*needs SciPy"):
        study_from_toml(base + LATIN, overrides={"sweep.mode": "halton"})
