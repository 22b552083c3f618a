"""What `lenscl explain` says of a study: its effects, and what they cost."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from lenscl.cli.explain_study import _always
from lenscl.config import scene_from_toml

SCREENS = """
source = { kind = "point", at = [0.0, 0.0, 4.0] }
film = { centre = [0.0, 0.0, 2.5], right = [1.0, 0.0, 0.0], down = [0.0, -1.0, 0.0], size = [16, 16] }
picture = { centre = [0.0, 0.0, -2.5], right = [6.0, 0.0, 0.0], down = [0.0, -6.0, 0.0] }
"""


def rows(text: str) -> dict[str, str]:
    """Return the table's lines by what they begin with, and their fragment where there are two of an effect."""
    lines = text.split("\n\n")[1].splitlines()[1:]
    return {" ".join(line.split()[:4]): line for line in lines}


def test_it_says_what_is_in_and_out_and_why(lenscl, study_path: Path) -> None:
    result = lenscl("explain", study_path, "--set", "effects.fresnel=true", "--set", "effects.antialias=edges")
    found = rows(result.stdout)
    assert "by the exact law" in found["refraction in always snell_exact"]
    assert "no lens has an absorption" in found["absorption out derived absorption"]
    assert "no lens has absorbs = true" in found["absorption out derived opaque"]
    assert "asked for" in found["fresnel in asked fresnel"]
    (antialias,) = (line for start, line in found.items() if start.startswith("antialias in asked +"))
    assert "asked for: more rays of the same kernel" in antialias
    assert "beside  antialias: beside the kernel" in result.stdout
    assert "ns a ray with all that is in" in result.stdout
    assert "precision" in result.stdout
    (path_length,) = (line for start, line in found.items() if start.startswith("path_length"))
    assert path_length.endswith("not asked for")


def test_json_has_the_costs_and_their_circumstances(lenscl, study_path: Path) -> None:
    document = json.loads(lenscl("explain", study_path, "--json", "--set", "effects.path_length=true").stdout)
    by_name = {(row["effect"], row["fragment"]): row for row in document["effects"]}
    cost = by_name["path_length", "path_length"]["cost"]
    assert cost["low"] <= cost["ns"] <= cost["high"]
    assert cost["changed"] == 0.0
    assert by_name["absorption", "opaque"]["cost"] is None
    assert by_name["absorption", "opaque"]["asked"] == "auto"
    assert document["rounds"] >= 9
    assert document["ns"] > 0
    assert {"device", "driver", "precision", "rays"} <= set(document)


def test_what_is_beside_the_kernel_has_a_cost_too(lenscl, study_path: Path) -> None:
    asked = ("--set", "effects.caustics=true", "--set", "picture.size=[32, 32]", "--set", "film.size=[16, 16]")
    document = json.loads(lenscl("explain", study_path, "--json", *asked).stdout)
    costs = {row["effect"]: row["cost"] for row in document["effects"]}
    assert 0.0 < costs["caustics"]["low"] <= costs["caustics"]["ns"] <= costs["caustics"]["high"]
    assert costs["antialias"] is None


def test_a_lens_out_of_reach_is_said(lenscl, tmp_path: Path) -> None:
    study = tmp_path / "study.toml"
    study.write_text(f"""{SCREENS}
[[lens]]
name = "near"
surface = "sphere"
n = 1.5
[[lens]]
name = "far"
surface = "sphere"
centre = [0.0, 0.0, 9.0]
n = 1.5
absorbs = true
""")
    found = rows(lenscl("explain", study).stdout)
    (near,) = (line for start, line in found.items() if start.startswith("lens.near in derived"))
    (far,) = (line for start, line in found.items() if start.startswith("lens.far out derived"))
    assert "rays of the film pass through its box" in near
    assert "nor any that lenses have bent get to it" in far
    assert "no ray gets to lens.far" in found["absorption out derived opaque"]


def test_it_says_whether_solids_are_proved_apart_or_which_are_not(lenscl, tmp_path: Path) -> None:
    balls = "".join(
        f'[[lens]]\nname = "{name}"\nsurface = "sphere"\nr = 0.3\nn = 1.5\ncentre = [{x}, 0.0, 0.0]\n'
        for name, x in (("a", 0.0), ("b", 0.4), ("c", 1.6))
    )
    study = tmp_path / "study.toml"
    study.write_text(SCREENS + balls)
    (line,) = (each for each in lenscl("explain", study).stdout.splitlines() if each.startswith("nested solids"))
    assert line.split()[2:5] == ["in", "derived", "ray_nested"]
    assert line.endswith("not proved apart: lens.a and lens.b")
    apart = ("--set", "lens.b.centre=[0.6001, 0, 0]", "--set", "lens.c.r=0.2")
    rows = json.loads(lenscl("explain", study, *apart, "--json").stdout)["effects"]
    (row,) = (each for each in rows if each["effect"] == "nested solids")
    assert (row["in"], row["fragment"], row["why"]) == (False, None, "all solids are proved apart")
    swept = study.with_name("swept.toml")
    moved = balls.replace("[0.4, 0.0", "[0.65, 0.0")
    swept.write_text(SCREENS + moved + '[sweep.axes]\n"lens.b.centre.x" = [0.65, 0.4]\n')
    found = lenscl("explain", swept).stdout
    (line,) = (each for each in found.splitlines() if each.startswith("nested solids"))
    assert line.split()[2:4] == ["in", "derived"]
    assert "another point of the study needs it" in line


@pytest.mark.parametrize(("surface", "is_in"), [("sphere", False), ("torus", True)])
def test_total_reflection_is_derived_for_the_whole_study(lenscl, tmp_path: Path, surface: str, is_in: bool) -> None:
    study = tmp_path / "study.toml"
    study.write_text(f"""{SCREENS}[[lens]]
surface = "{surface}"
n = 1.5
[sweep.axes]
"lens.n" = [1.2, 1.4]
""")
    text = lenscl("explain", study).stdout
    assert "decided once for all 2 points" in text
    (line,) = (line for line in text.splitlines() if line.startswith("total_reflection"))
    assert line.split()[1:3] == ["in" if is_in else "out", "derived"]
    assert ("at the angle at which they have entered it" in line) != is_in


def test_an_array_is_one_row_with_its_count() -> None:
    places = [[0.5 * x, 0.5 * y, 0.0] for x in range(-10, 10) for y in range(-10, 10)]
    lens = f"[[lens]]\nname = 'balls'\nsurface = 'ball'\ndiameter = 0.3\nn = 1.5\nat = {places}\n"
    scene = scene_from_toml(SCREENS + lens)
    found = {name: (is_in, why) for name, is_in, *_, why in _always(scene)}
    assert len([name for name in found if name.startswith("lens")]) == 1
    is_in, why = found["lens.balls"]
    assert is_in
    assert " of its 400 places are reached, the first because rays " in why
    behind = scene.replace({"lens.balls.at": [[0.0, 0.0, 100.0], [0.0, 0.0, 0.0]]})
    assert {name: why for name, *_, why in _always(behind)}["lens.balls"].startswith("1 of its 2 places are reached")


def test_an_array_has_one_search_and_one_box(lenscl, tmp_path: Path) -> None:
    study = tmp_path / "study.toml"
    study.write_text(f"""{SCREENS}[[lens]]
name = "balls"
surface = "x^2 + y^2 + z^2 - r^2"
r = 0.2
bounds = [[-2, -2, -2], [2, 2, 2]]
n = 1.5
at = [[-0.5, 0, 0], [0.5, 0, 0], [0, 0.5, 0]]
[[lens]]
name = "ring"
surface = "torus"
n = 1.5
centre = [0, 0, -1]
""")
    found = json.loads(lenscl("explain", study, "--json").stdout)
    assert found["searches"] == {"lens.balls": "polynomial", "lens.ring": "polynomial"}
    rows = [row for row in found["effects"] if row["effect"].endswith(".bounds")]
    assert [row["effect"] for row in rows] == ["lens.balls.bounds"]
    assert "far wider than the solid" in rows[0]["why"]
