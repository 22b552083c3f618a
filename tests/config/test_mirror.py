"""The key mirror of a lens: what it takes, what is refused with which words, and how scenes keep it."""

from __future__ import annotations

import re
from typing import Any

import pytest
from scenes import make_scene

from lenscl import scene_from_toml
from lenscl.config import Scene, study_from_toml, study_schema
from lenscl.errors import StudyError

HEAD = """
[source]
at = [0, 0, 9]
[film]
corner = [0, 0, 2]
right = [1, 0, 0]
down = [0, 1, 0]
size = [4, 4]
[picture]
corner = [0, 0, 5]
right = [1, 0, 0]
down = [0, 1, 0]
[medium]
n = 1.33
"""


def read(lens: str) -> Scene:
    return scene_from_toml(f"{HEAD}[[lens]]\n{lens}")


def problems(lens: str) -> str:
    with pytest.raises(StudyError) as refused:
        read(lens)
    return str(refused.value)


def test_a_mirror_needs_no_index_and_has_that_of_the_medium() -> None:
    scene = read('surface = "sphere"\nmirror = true')
    lens = scene.lenses[0]
    assert lens.mirror is True
    assert lens.is_mirror
    assert lens.coated == ("surface",)
    assert lens.n == 1.33
    assert "n = " not in scene.to_toml().split("[[lens]]")[1].split("[effects]")[0]
    assert scene.replace({"medium.n": 1.4}).lenses[0].n == 1.4
    assert scene_from_toml(scene.to_toml()) == scene


@pytest.mark.parametrize("mirror", ["true", '["back"]', '["rim", "front"]', '["front", "back", "rim"]'])
def test_scenes_keep_mirrors(mirror: str) -> None:
    scene = read(f'surface = "plano_convex"\nn = 1.5\nmirror = {mirror}')
    assert scene_from_toml(scene.to_toml()) == scene
    assert f"mirror = {mirror}" in scene.to_toml()
    assert scene.lenses[0].is_mirror == (mirror == "true" or mirror.count(",") == 2)


@pytest.mark.parametrize(
    ("lens", "words"),
    [
        ('surface = "sphere"', "lens.n: is required"),
        ('surface = "plano_convex"\nmirror = ["back"]', "lens.n: is required; only mirror = true may leave it out"),
        ('surface = "sphere"\nn = 1.5\nmirror = "true"', 'got "true"; write true, without quotation marks'),
        ('surface = "plano_convex"\nn = 1.5\nmirror = "back"', 'got "back"; write ["back"]'),
        ('surface = "plano_convex"\nn = 1.5\nmirror = []', "got an empty list; where no face is a mirror write false"),
        ('surface = "x^2 + y^2 + z^2 - 1"\nbounds = [[-2,-2,-2],[2,2,2]]\nn = 1.5\nmirror = [1]', 'write ["1"]'),
        ('surface = "plano_convex"\nn = 1.5\nmirror = ["back", "back"]', '"back" is named twice'),
        ('surface = "plano_convex"\nn = 1.5\nmirror = 2', "lens.mirror: must be true, false, or a list of names"),
        (
            'surface = "plano_convex"\nn = 1.5\nmirror = ["bakc"]',
            'lens.mirror: "bakc" is no face of "plano_convex"; its faces are "front", "back", "rim"; '
            'did you mean "back"?',
        ),
        ('surface = "sphere"\nmirror = true\nabsorbs = true', "lens.mirror: is true, so that no light gets to what"),
    ],
)
def test_what_a_mirror_may_be(lens: str, words: str) -> None:
    assert words in problems(lens)


def test_all_that_is_wrong_is_told_at_once() -> None:
    found = problems('surface = "box"\nmirror = ["+q", "-x", "top"]\nabsorption = [1, 2]\ncentre = 3')
    assert re.search(r"lens\.n: is required", found)
    assert re.search(r"lens\.centre: must be three numbers", found)
    assert re.search(r"lens\.absorption: must be three numbers", found)
    for surface in ('"box"', '"max(abs(x) - k, abs(y) - 1, abs(z) - 1)"\nk = 1.0'):
        many = problems(f'surface = {surface}\nmirror = ["+q", "4"]\ncentre = 3')
        assert many.count("is no face of") == 2
        assert "lens.centre: must be three numbers" in many
    named = problems('surface = "box"\nn = 1.5\na = -1.0\nmirror = ["+q", "-x", "top"]')
    assert named.count("is no face of") == 2
    assert "lens.a: must be more than 0" in named


def test_coated_faces_may_be_those_of_an_opaque_solid() -> None:
    assert read('surface = "plano_convex"\nn = 1.5\nmirror = ["back"]\nabsorbs = true').lenses[0].absorbs


def test_mirrors_are_swept() -> None:
    axes: Any = '[sweep.axes]\n"lens.mirror" = [true, false, ["back"], ["front", "rim"]]'
    text = f'{HEAD}[[lens]]\nsurface = "plano_convex"\nn = 1.5\n{axes}'
    mirrors = [point.scene.lenses[0].mirror for point in study_from_toml(text).points()]
    assert mirrors == [True, False, ("back",), ("front", "rim")]
    assert make_scene({"surface": "plano_convex"}).replace({"lens.mirror": ["back"]}).lenses[0].mirror == ("back",)


def test_the_schema_knows_mirrors() -> None:
    lens = study_schema()["properties"]["lens"]["items"]
    assert lens["properties"]["mirror"]["anyOf"][0] == {"type": "boolean"}
    assert {"required": ["n"]} in lens["anyOf"]
