"""What `lenscl explain` says of a study: its effects, and what they cost."""

from __future__ import annotations

import json
from pathlib import Path

import pytest


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
    assert "asked for: more rays of the same kernel" in found["antialias in asked asked"]
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


@pytest.mark.parametrize(("surface", "is_in"), [("sphere", False), ("torus", True)])
def test_total_reflection_is_derived_for_the_whole_study(lenscl, tmp_path: Path, surface: str, is_in: bool) -> None:
    study = tmp_path / "study.toml"
    study.write_text(f"""
source = {{ kind = "point", at = [0.0, 0.0, 4.0] }}
film = {{ centre = [0.0, 0.0, 2.5], right = [1.0, 0.0, 0.0], down = [0.0, -1.0, 0.0], size = [16, 16] }}
picture = {{ centre = [0.0, 0.0, -2.5], right = [6.0, 0.0, 0.0], down = [0.0, -6.0, 0.0] }}
[[lens]]
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
