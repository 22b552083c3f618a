from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from lenscl.config import Scene, scene_from_toml, study_from_toml
from lenscl.sweep import hard_spots, hardspots, study_hard_spots
from lenscl.tracing import Placement

HARMLESS = """
source = { kind = "point", at = [0.0, 0.0, 4.0] }
film = { centre = [0.0, 0.0, 2.5], right = [2.0, 0.0, 0.0], down = [0.0, -2.0, 0.0], size = [40, 30] }
picture = { centre = [0.0, 0.0, -2.5], right = [6.0, 0.0, 0.0], down = [0.0, -6.0, 0.0] }
[[lens]]
name = "one"
surface = "ellipsoid"
a = 1.0
b = 0.8
c = 0.6
n = 1.5
"""
OTHER = '[[lens]]\nname = "other"\nsurface = "sphere"\nr = 0.3\nn = 1.5\ncentre = '


def kinds(scene: Scene) -> set[str]:
    return {f"{spot.key} {spot.kind}" for spot in hard_spots(scene)} - {"lens.one march-step", "lens.other march-step"}


def test_a_harmless_scene_has_only_the_step_of_its_method_to_tell_of() -> None:
    assert kinds(scene_from_toml(HARMLESS)) == set()


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"source.at": [0.1, 0.1, 0.1], "film.centre": [0.0, 0.0, -1.5]}, {"source source-inside"}),
        ({"source.at": [0.0, 0.0, 0.6], "film.centre": [0.0, 0.0, -1.5]}, {"source source-on"}),
        ({"film.centre": [0.0, 0.0, 0.3]}, {"lens.one cut-by-film"}),
        ({"picture.centre": [0.0, 0.0, -0.5]}, {"lens.one cut-by-picture"}),
        ({"picture.centre": [0.0, 0.0, 9.0]}, {"picture behind"}),
        ({"picture.centre": [0.0, 0.0, 3.0]}, {"picture before-film"}),
        ({"lens.one.centre": [9.0, 0.0, 0.0]}, {"lens.one not-aimed-at"}),
        ({"lens.one.centre": [0.0, 0.0, 9.0]}, {"lens.one not-aimed-at"}),  # behind the source
        ({"effects.antialias": "edges", "effects.caustics": True}, {"effects.antialias not-painted"}),
        ({"effects.antialias": 2, "effects.caustics": True}, {"effects.antialias not-painted"}),
        ({"effects.antialias": 2}, set()),
        ({"effects.caustics": True}, set()),
        ({"lens.one.rotate": [0.0, 30.0, 20.0], "lens.one.centre": [0.0, 0.0, 0.4]}, set()),
    ],
)
def test_each_hard_spot_is_found_and_nothing_else(changes: Mapping[str, Any], expected: set[str]) -> None:
    assert kinds(scene_from_toml(HARMLESS).replace(changes)) == expected


def test_a_source_in_the_films_plane_is_told_from_one_beside_it() -> None:
    scene = scene_from_toml(HARMLESS)
    x, y, z = scene.film.corner
    for aside, is_on in ((0.0, True), (1e-6, False)):
        moved = scene.replace({"source.at": [x + 0.3, y - 0.1, z + aside]})
        assert ("source source-on-film" in kinds(moved)) == is_on


def test_rays_that_all_but_run_along_the_picture_never_meet_it() -> None:
    aside = {"source.at": [0.0, 0.0, 0.0], "film.centre": [0.0, 0.0, -5e-324], "lens.one.centre": [0.0, 9.0, 0.0]}
    assert "picture behind" in kinds(scene_from_toml(HARMLESS).replace(aside))


@pytest.mark.parametrize(
    ("centre", "overlaps"),
    [("[0.0, 0.0, 0.8]", True), ("[0.0, 0.0, 1.0]", False), ("[1.2, 1.0, 0.0]", True), ("[1.4, 0.0, 0.0]", False)],
)
def test_lenses_whose_boxes_overlap_are_named(centre: str, overlaps: bool) -> None:
    found = kinds(scene_from_toml(HARMLESS + OTHER + centre))
    assert ("lens.one overlap-lens.other" in found) is overlaps


def test_solids_that_overlap_are_told_from_boxes_that_do() -> None:
    apart, together = (scene_from_toml(HARMLESS + OTHER + f"[{x}, {y}, 0.0]") for x, y in ((1.0, 0.9), (0.4, 0.0)))
    for scene, says in ((apart, "its box overlaps"), (together, "overlaps lens.other, as at (")):
        (spot,) = (spot for spot in hard_spots(scene) if spot.kind == "overlap-lens.other")
        assert spot.message.startswith(says)
    x, y, z = (float(part) for part in re.findall(r"at \((.*?)\)", spot.message)[0].split(","))
    assert np.hypot(np.hypot(x - 0.4, y), z) < 0.3
    assert x**2 + (y / 0.8) ** 2 + (z / 0.6) ** 2 < 1.0


def test_boxes_that_only_their_turned_faces_part_do_not_overlap() -> None:
    turned = scene_from_toml(HARMLESS + OTHER + "[1.25, 1.05, 0.0]\nrotate = [0.0, 0.0, 45.0]")
    assert "lens.one overlap-lens.other" not in kinds(turned)
    assert "lens.one overlap-lens.other" in kinds(
        turned.replace({"lens.other.rotate": [0.0, 0.0, 0.0], "lens.other.r": 0.4})
    )


def test_the_separating_axes_agree_with_points_in_both_boxes() -> None:
    rng = np.random.default_rng(5)
    scene = scene_from_toml(HARMLESS + OTHER + "[1.0, 0.0, 0.0]")
    apart = together = 0
    for _ in range(200):
        scene = scene.replace(
            {
                "lens.other.centre": list(rng.uniform(-1.6, 1.6, 3)),
                "lens.other.rotate": list(rng.uniform(-180, 180, 3)),
                "lens.other.stretch": list(rng.uniform(0.3, 3, 3)),
            }
        )
        one, other = (Placement.of(lens) for lens in scene.lenses)
        cells = (np.stack(np.meshgrid(*[np.linspace(0, 1, 25)] * 3), axis=-1)).reshape(-1, 3)
        points = other.centre + (other.box[0] + cells * (other.box[1] - other.box[0])) @ other.to_world.T
        local = one.local(points)
        has_common_point = bool(((local >= one.box[0]) & (local <= one.box[1])).all(axis=1).any())
        overlap = hardspots._boxes_overlap(one, other)
        assert overlap or not has_common_point  # a grid may miss a common point, never invent one
        together += has_common_point
        apart += not overlap
    assert together > 40
    assert apart > 40


def test_a_lens_between_the_coarse_rays_is_still_found_to_be_aimed_at() -> None:
    changes = {
        "film.size": [1500, 1500],
        "lens.one.centre": [0.0013, 0.0013, 0.0],
        "lens.one.stretch": [0.002, 0.002, 0.002],
    }
    assert kinds(scene_from_toml(HARMLESS).replace(changes)) == {"lens.one thin"}


def test_parallel_light_is_followed_backwards_from_the_film_too() -> None:
    text = HARMLESS.replace('kind = "point", at = [0.0, 0.0, 4.0]', 'kind = "parallel", direction = [0.0, 0.0, -1.0]')
    scene = scene_from_toml(text)
    assert kinds(scene) == set()
    assert kinds(scene.replace({"lens.one.centre": [0.0, 0.0, 4.0]})) == set()
    assert kinds(scene.replace({"picture.centre": [0.0, 0.0, 5.0]})) == {"picture before-film"}
    assert kinds(scene.replace({"source.direction": [0.0, 1.0, 0.0]})) == {"picture behind", "lens.one not-aimed-at"}


def test_march_says_what_its_step_may_lose() -> None:
    scene = scene_from_toml(HARMLESS).replace({"lens.one.stretch": [1.0, 1.0, 0.05], "numerics.method": "march"})
    (spot,) = hard_spots(scene)
    assert spot.kind == "march-step"
    assert "shorter than its step of 0.01" in spot.message
    assert "0.06, 6 steps" in spot.message


def test_spots_of_a_study_say_at_which_points_they_are() -> None:
    study = study_from_toml(HARMLESS + '[sweep.axes]\n"lens.one.centre.x" = [0.0, 9.0, 0.1, 9.5]')
    spots, looked_at = study_hard_spots(study)
    (away,) = [spot for spot in spots if spot.kind == "not-aimed-at"]
    assert away.points == (1, 3)
    assert looked_at == 4
    assert study_hard_spots(study, most_points=2)[1] == 2


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("x*x + y*y + z*z - 1", set()),
        ("(x*x + y*y + z*z - 1)**2", {"lens no-inside"}),
        ("x*x + y*y + z*z + 1", {"lens no-inside"}),
        ("x*x + y*y + z*z - 1 + 0.01 * sqrt(x + 1.5)", {"lens no-value"}),
        ("1 + x*x + sqrt(x + 1)", {"lens no-inside", "lens no-value"}),
    ],
)
def test_an_expression_without_inside_or_value_is_told_of(expression: str, expected: set[str]) -> None:
    head = HARMLESS.partition("[[lens]]")[0]
    bounds = "bounds = [[-2, -2, -2], [2, 2, 2]]"
    scene = scene_from_toml(f'{head}[[lens]]\nsurface = "{expression}"\n{bounds}\nn = 1.5\n')
    assert {kind for kind in kinds(scene) if "no-" in kind} == expected
