from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from arrangements import bubble, doublet, stack
from scenes import make_scene

from lenscl.config import Scene, scene_from_toml, study_from_toml
from lenscl.sweep import HardSpot, hard_spots, hardspots, study_hard_spots
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


def spot(scene: Scene, kind: str) -> HardSpot:
    """Return the one hard spot of a kind, or of kinds that begin so."""
    (found,) = (each for each in hard_spots(scene) if each.kind.startswith(kind))
    return found


ARRANGED = ("within-", "hidden-", "overlap-", "touch-", "near-")


@pytest.mark.parametrize(
    ("centre", "expected"),
    [
        ("[0.0, 0.0, 0.8]", "overlap-"),
        ("[0.0, 0.0, 1.0]", None),
        ("[1.2, 1.0, 0.0]", None),  # only the boxes overlap: proved apart
        ("[1.4, 0.0, 0.0]", None),
        ("[1.3, 0.0, 0.0]", "touch-"),  # at a point
        ("[1.30000001, 0.0, 0.0]", "near-"),  # too near for a proof
        ("[0.2, 0.1, 0.0]", "within-"),
    ],
)
def test_lenses_that_are_not_proved_apart_are_named_by_how_they_lie(centre: str, expected: str | None) -> None:
    found = [each.kind for each in hard_spots(scene_from_toml(HARMLESS + OTHER + centre))]
    assert [kind.partition("-")[0] + "-" for kind in found if kind.startswith(ARRANGED)] == (
        [expected] * bool(expected)
    )


def test_where_solids_overlap_it_is_said_whose_medium_it_is_and_how_to_change_that() -> None:
    scene = scene_from_toml(HARMLESS + OTHER + "[0.9, 0.0, 0.0]")
    later = spot(scene, "overlap-lens.other")
    assert "the medium is that of lens.other: of equal priority, lens.other stands later in the file" in later.message
    assert "lens.one.priority above 0 makes it that of lens.one" in later.message
    x, y, z = (float(part) for part in re.findall(r"as at \((.*?)\)", later.message)[0].split(","))
    assert np.hypot(np.hypot(x - 0.9, y), z) <= 0.3
    assert x**2 + (y / 0.8) ** 2 + (z / 0.6) ** 2 <= 1.0
    higher = spot(scene.replace({"lens.one.priority": 2.5}), "overlap-lens.other")
    assert "the medium is that of lens.one: lens.one.priority is 2.5, and lens.other.priority 0" in higher.message
    assert "lens.other.priority above 2.5" in higher.message


def test_a_solid_in_another_is_seen_or_gives_way() -> None:
    scene = scene_from_toml(HARMLESS + OTHER + "[0.2, 0.1, 0.0]")
    seen = spot(scene, "within-lens.one")
    assert (seen.key, seen.message.startswith("lies in lens.one, whose medium gives way there")) == ("lens.other", True)
    hidden = spot(scene.replace({"lens.one.priority": 1.0}), "hidden-lens.one")
    assert hidden.key == "lens.other"
    assert "it bends no light and is not seen. lens.other.priority above 1 makes it seen" in hidden.message
    swapped = scene.replace({"lens.one.stretch": [0.2, 0.2, 0.2], "lens.one.centre": [0.2, 0.1, 0.0]})
    inner = spot(swapped, "hidden-lens.other")
    assert (inner.key, "bends no light" in inner.message) == ("lens.one", True)


@pytest.mark.parametrize(
    ("lenses", "kind"),
    [
        (doublet(), "touch-"),
        (stack(), "touch-"),
        (stack(1e-12), "near-"),
        (stack(1e-2), None),
        (bubble(centre=[0.0, 0.0, 0.3]), "within-"),  # and touches from within, at a pole
    ],
    ids=["doublet", "stack", "tiny gap", "gap", "from within"],
)
def test_contact_is_told_from_a_gap(lenses: Any, kind: str | None) -> None:
    found = [each for each in hard_spots(make_scene(*lenses)) if each.kind.startswith(ARRANGED)]
    assert len(found) == bool(kind)
    for each in found:
        assert each.kind.startswith(str(kind))
        assert ("one event between the two media" in each.message) is (kind != "near-")
        assert ("they only take longer" in each.message) is (kind == "near-")


def test_how_solids_lie_is_told_for_each_point_of_a_sweep() -> None:
    axis = '[sweep.axes]\n"lens.other.priority" = [-1, 0, 1]\n'
    spots, _ = study_hard_spots(study_from_toml(HARMLESS + OTHER + "[0.2, 0.1, 0.0]\n" + axis))
    assert {each.kind: each.points for each in spots} == {"hidden-lens.one": (0,), "within-lens.one": (1, 2)}


def test_solids_without_an_inside_or_a_value_are_looked_at_all_the_same() -> None:
    bounds = {"bounds": [[-0.5] * 3, [0.5] * 3]}
    for odd in ("x^2 + y^2 + z^2", "sqrt(x - 2) + y", "log(x - 1) + y"):
        lenses = {"surface": odd, "name": "odd"} | bounds, {"surface": "sphere", "r": 0.4, "name": "ball"}
        found = [each.kind for each in hard_spots(make_scene(*lenses)) if each.kind.startswith(ARRANGED)]
        assert found in ([], ["near-lens.ball"]), odd


def test_a_thin_overlap_is_no_contact() -> None:
    """Deeper than rounding, and far thinner than the grid."""
    found = spot(make_scene(*stack(-1e-9)), "overlap-")
    assert "one event" not in found.message


def test_a_source_in_several_solids_names_them_and_its_medium() -> None:
    scene = scene_from_toml(HARMLESS + OTHER + "[0.2, 0.1, 0.0]")
    inside = spot(scene.replace({"source.at": [0.2, 0.1, 0.05]}), "source-inside")
    assert inside.message == "lies inside lens.one and lens.other; its rays start in lens.other, the medium there"
    lower = scene.replace({"source.at": [0.2, 0.1, 0.05], "lens.other.priority": -1.0})
    assert "start in lens.one, the medium" in spot(lower, "source-inside").message
    alone = spot(scene.replace({"source.at": [-0.5, 0.1, 0.05]}), "source-inside")
    assert alone.message == "lies inside lens.one; its rays start in its medium"
    both = scene.replace({"lens.other.centre": [0.7, 0.0, 0.0], "source.at": [1.0, 0.0, 0.0]})
    assert "on the surface of lens.one and lens.other" in spot(both, "source-on").message


def boxes_overlap(one: Placement, other: Placement) -> bool:
    crossed = hardspots._crossed(one.to_world.T, other.to_world.T)
    axes = np.array([*hardspots._normals(one), *hardspots._normals(other), *crossed])
    return bool(hardspots._overlap(one.corners(), other.corners(), np.zeros((1, 3)), axes)[0])


def test_boxes_that_only_their_turned_faces_part_do_not_overlap() -> None:
    scene = scene_from_toml(HARMLESS + OTHER + "[1.25, 1.05, 0.0]\nrotate = [0.0, 0.0, 45.0]")
    one, other = (Placement.of(lens) for lens in scene.lenses)
    assert not boxes_overlap(one, other)
    turned = scene.replace({"lens.other.rotate": [0.0, 0.0, 0.0], "lens.other.r": 0.4})
    assert boxes_overlap(*(Placement.of(lens) for lens in turned.lenses))


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
        overlap = boxes_overlap(one, other)
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
