"""Films and pictures that stretch what they show: told where they do, and not where whole pixels fit as they can."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import CONFIGS, make_scene

from lenscl import load_study
from lenscl.config import study_from_toml
from lenscl.imaging import write_image
from lenscl.sweep import shown_scenes, stretch_notes

LENS = {"surface": "sphere", "r": 0.3}
HEAD = """
source = {{ at = [0, 0, 4] }}
film = {{ centre = [0, 0, 2.5], right = [2, 0, 0], down = [0, -2, 0], size = {size} }}
picture = {{ centre = [0, 0, -2.5], right = [6, 0, 0], down = [0, -3, 0], images = "*.png" }}
[[lens]]
surface = "sphere"
n = 1.5
"""


def film(size: list[int], right: list[float], down: list[float], **more: Any) -> list[str]:
    return stretch_notes([make_scene(LENS, film={"size": size, "right": right, "down": down, **more})], ())


def test_a_wide_film_on_a_square_is_told_with_spans_and_a_size_that_keep_shapes() -> None:
    (note,) = film([1920, 1080], [2.0, 0.0, 0.0], [0.0, -2.0, 0.0], scale=0.5)
    assert note.startswith("film: its pixels are 1.78 times as high as wide")
    down = [float(part) for part in re.search(r"film.down = \[(.*?)\]", note)[1].split(",")]
    size = [int(part) for part in re.search(r"film.size = \[(.*?)\]", note)[1].split(",")]
    assert down == [0.0, -1.125, 0.0]
    assert film([1920, 1080], [2.0, 0.0, 0.0], down, scale=0.5) == []
    assert film(size, [2.0, 0.0, 0.0], [0.0, -2.0, 0.0], scale=0.5) == []


@pytest.mark.parametrize(
    ("size", "right", "down", "is_told"),
    [
        ([192, 108], [1.6, 0.0, 0.0], [0.0, -0.9, 0.0], False),
        ([192, 108], [0.0, 1.6, 0.0], [0.0, 0.0, -0.9], False),
        ([192, 108], [0.0, 1.2, 1.6], [-2.0, 0.0, 0.0], True),
        ([100, 67], [3.0, 0.0, 0.0], [0.0, -2.0, 0.0], False),  # as near as whole numbers come
        ([3, 2], [1.0, 0.0, 0.0], [0.0, -0.6, 0.0], False),  # likewise
        ([300, 200], [1.0, 0.0, 0.0], [0.0, -0.6, 0.0], True),
        ([500, 503], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], False),  # not to be seen
        ([500, 510], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], True),
        ([64, 1], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], False),  # a line shows no shapes
    ],
)
def test_pixels_are_told_to_be_stretched_where_they_are(
    size: list[int], right: list[float], down: list[float], is_told: bool
) -> None:
    assert bool(film(size, right, down)) == is_told


def test_square_pixels_are_never_told_of_and_others_always_by_their_ratio() -> None:
    told = 0

    @given(st.integers(40, 4000), st.integers(40, 4000), st.floats(0.2, 5.0), st.floats(0.1, 10.0))
    def check(columns: int, rows: int, ratio: float, wide: float) -> None:
        nonlocal told
        square = film([columns, rows], [wide, 0.0, 0.0], [0.0, -wide * rows / columns, 0.0])
        assert square == []
        notes = film([columns, rows], [wide, 0.0, 0.0], [0.0, -wide * rows / columns * ratio, 0.0])
        if not 0.97 < ratio < 1.03:
            (note,) = notes
            shown, how = re.search(r"pixels are (\S+) times as (high|wide) as", note).groups()
            assert float(shown) == pytest.approx(ratio if how == "high" else 1.0 / ratio, rel=0.01)
            told += 1

    check()
    assert told > 50


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, size in (("square.png", (20, 20)), ("wide.png", (40, 20)), ("wider.png", (60, 20))):
        write_image(tmp_path / name, np.zeros((size[1], size[0], 3), np.uint8), metadata={})
    (tmp_path / "zz.png").write_text("no picture")
    return tmp_path


def test_images_on_spans_of_another_shape_are_counted_and_the_first_is_named(folder: Path) -> None:
    study = study_from_toml(HEAD.format(size=[40, 40]), folder=folder)
    (note,) = stretch_notes(shown_scenes(study), study.images)
    assert note.startswith("picture: 2 of 3 images are stretched by picture.right and picture.down, 6 and 3 long: ")
    assert "square.png, 20 x 20, are 2 times as wide as high; picture.down = [0, -6, 0] keeps its shape" in note


def test_of_a_study_that_varies_its_film_each_note_is_made_once(folder: Path) -> None:
    text = HEAD.format(size=[40, 40]) + "[sweep.axes]\n'film.size' = [[40, 40], [80, 40], [120, 40]]\n"
    study = study_from_toml(text, folder=folder)
    notes = stretch_notes(shown_scenes(study), study.images)
    assert [note.split(": ")[0] for note in notes] == ["picture", "film"]
    assert "over 80 columns" in notes[1]


def test_light_on_cells_that_are_not_square_is_told_of() -> None:
    lit = make_scene(LENS, effects={"caustics": True}, picture={"size": [100, 50]})
    (note,) = stretch_notes([lit], ())
    assert "picture.size = [100, 100] keeps shapes" in note
    assert stretch_notes([lit.replace({"effects.caustics": False})], ()) == []


@pytest.mark.parametrize("path", sorted(CONFIGS.rglob("*.toml")), ids=lambda path: path.stem)
def test_the_shipped_studies_stretch_nothing(path: Path) -> None:
    study = load_study(path)
    assert stretch_notes(shown_scenes(study), study.images) == []
