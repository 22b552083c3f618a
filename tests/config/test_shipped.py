"""The studies that come with the program, their schema, images, and what importing them costs."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import tomllib
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from lenscl.config import load_study, study_from_toml, study_schema
from lenscl.effects import EFFECTS
from lenscl.errors import StudyError

CONFIGS = Path(__file__).parents[2] / "configs"
STUDIES = [CONFIGS / f"{name}.toml" for name in ("bifolia", "ellipsoid", "heart", "torus")]
BENCHES = sorted((CONFIGS / "bench").glob("*.toml"))


def to_world(lens, local):
    """Place local points, (N, 3), as world = centre + R_z R_y R_x diag(stretch) local."""
    a, b, c = np.radians(lens.rotate)
    x = np.array([[1, 0, 0], [0, math.cos(a), -math.sin(a)], [0, math.sin(a), math.cos(a)]])
    y = np.array([[math.cos(b), 0, math.sin(b)], [0, 1, 0], [-math.sin(b), 0, math.cos(b)]])
    z = np.array([[math.cos(c), -math.sin(c), 0], [math.sin(c), math.cos(c), 0], [0, 0, 1]])
    return np.asarray(local) @ (z @ y @ x @ np.diag(lens.stretch)).T + lens.centre


def test_the_benchmark_scenes_are_all_there():
    assert [path.stem for path in BENCHES] == [
        f"{name}-{view}" for name in ("bifolia", "ellipsoid", "heart", "torus") for view in ("close", "wide")
    ]


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_a_shipped_study_has_a_few_points_that_can_all_be_built(path):
    study = load_study(path)
    scenes = [point.scene for point in study.points()]
    assert 8 <= len(scenes) == study.point_count() <= 14
    assert len({scene.to_toml() for scene in scenes}) == len(scenes)
    assert study.scene.picture.images == "pictures/*"
    # The lens stays between the film, at x = 1, and the picture, at x = 3.9
    for scene in scenes:
        for lens in scene.lenses:
            low, high = lens.surface.box(lens.values)
            corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
            xs = to_world(lens, corners)[:, 0]
            assert xs.min() > 1.0
            assert xs.max() < 3.9


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_a_shipped_study_starts_from_the_forerunners_scene(path):
    scene = load_study(path).scene
    assert scene.source.at == (0.0, 0.0, 0.0)
    assert (scene.film.corner, scene.film.right, scene.film.down) == ((1, -0.5, 1), (0, 1, 0), (0, 0, -1))
    assert (scene.picture.corner, scene.picture.right, scene.picture.down) == ((3.9, -2, 4), (0, 4, 0), (0, 0, -4))
    assert (scene.film.size, scene.n_medium, scene.lenses[0].n) == ((512, 512), 1.000277, 1.458)
    assert (scene.lenses[0].centre, scene.numerics.max_events) == ((2.5, 0.0, 1.0), 64)


@pytest.mark.parametrize("path", BENCHES, ids=lambda path: path.stem)
def test_a_benchmark_scene_is_the_one_of_the_design(path):
    scene = load_study(path).scene
    name, view = path.stem.split("-")
    side = {"close": 0.8, "wide": 2.0}[view]
    assert scene.source.at == (0, 0, 4)
    assert (scene.film.centre, scene.film.right, scene.film.down) == ((0, 0, 2.5), (side, 0, 0), (0, -side, 0))
    assert (scene.picture.centre, scene.picture.right, scene.picture.down) == ((0, 0, -2.5), (6, 0, 0), (0, -6, 0))
    assert (scene.film.size, scene.n_medium, scene.numerics.max_events) == ((1024, 1024), 1.0, 16)
    assert scene.effects.total_reflection == "follow"
    (lens,) = scene.lenses
    assert (lens.formula, lens.n) == (name, 1.5)
    local = np.random.default_rng(1).normal(size=(20, 3))
    world = to_world(lens, local)
    x, y, z = world.T
    s = {"close": 1.0, "wide": 0.5}[view]
    expected = {
        "ellipsoid": (x, y, z),
        "torus": (x, y, z),
        "heart": (z, x, y),
        "bifolia": (x / s, y / s + 0.375, z / s),
    }[name]
    np.testing.assert_allclose(local, np.stack(expected, axis=1), atol=1e-14)
    if name == "ellipsoid":
        np.testing.assert_allclose(lens.surface.box(lens.values)[1], (1.0, 0.8, 0.6), rtol=1e-5)
    if name == "torus":
        assert dict(lens.values) == {"R": 0.7, "r": 0.25}


@pytest.mark.parametrize("path", sorted(CONFIGS.rglob("*.toml")), ids=lambda path: path.stem)
def test_the_program_and_the_schema_accept_a_shipped_study(path):
    jsonschema.Draft202012Validator.check_schema(study_schema())
    jsonschema.validate(tomllib.loads(path.read_text()), study_schema())
    assert load_study(path).point_count() >= 1


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("[film]", "[flim]"),
        ("size = [8, 6]", "size = [8.5, 6]"),
        ("at = [0, 0, 4]", "at = [0, 0]"),
        ("n = 1.5", "n = 0"),
        ("n = 1.5", "n = { cauchi = [1.5] }"),
        ('surface = "torus"', ""),
        ("n = 1.5", "n = 1.5\n[numerics]\nprecision = 'half'"),
        ("n = 1.5", "n = 1.5\n[effects]\nfootprint = 'wide'"),
        ("n = 1.5", "n = 1.5\n[sweep.axes]\n'lens.r' = { linspce = [1, 2, 3] }"),
    ],
)
def test_the_schema_refuses_what_the_program_refuses(base, problems, old, new):
    text = base.replace(old, new, 1)
    assert problems(text)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(tomllib.loads(text), study_schema())
    jsonschema.validate(tomllib.loads(base), study_schema())


@pytest.mark.parametrize("key", [*EFFECTS])
def test_the_schema_and_the_program_agree_about_an_effect(base, problems, key):
    choices = EFFECTS[key].choices
    accepted = 0
    for value in [True, False, "auto", *choices, "nonsense"]:
        text = base + f"[effects]\n{key} = {json.dumps(value)}\n"
        found = problems(text)
        assert jsonschema.Draft202012Validator(study_schema()).is_valid(tomllib.loads(text)) == (not found), value
        assert all(problem.startswith(f"effects.{key}: ") for problem in found)
        accepted += not found
    assert accepted >= len(choices)
    assert problems(base + f'[effects]\n{key} = "nonsense"\n')


def test_images_are_found_beside_the_study_sorted_and_once(base, tmp_path):
    (tmp_path / "pictures").mkdir()
    for name in ("b.png", "a.jpg", "c.png", ".hidden.png"):
        (tmp_path / "pictures" / name).write_bytes(b"")
    (tmp_path / "pictures" / "folder.png").mkdir()
    path = tmp_path / "study.toml"

    def images(pattern: str):
        path.write_text(base.replace("[picture]", f"[picture]\nimages = {pattern}"))
        return [image.name for image in load_study(path).require_images()]

    assert images('"pictures/*"') == ["a.jpg", "b.png", "c.png", "folder.png"]
    assert images('["pictures/c.png", "pictures/*.png"]') == ["b.png", "c.png", "folder.png"]
    assert images('["pictures/a.jpg", "pictures/missing.png"]') == ["a.jpg", "missing.png"]
    with pytest.raises(StudyError, match=r'^picture\.images: no file matches "pictures/\*\.gif" in '):
        images('"pictures/*.gif"')
    with pytest.raises(StudyError, match=r"^picture\.images: is required to paint"):
        study_from_toml(base).require_images()


def test_importing_the_package_does_not_import_pydantic():
    code = "import sys, lenscl; assert not {'pydantic', 'numpy', 'lenscl.config'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_reading_a_study_needs_no_device_and_no_sampler():
    code = (
        "import sys\nfrom lenscl.config import load_study\n"
        f"load_study({str(STUDIES[0])!r})\n"
        "assert not {'pyopencl', 'scipy', 'lenscl.device', 'lenscl.tracing'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
