"""An index stated as nd and vd: what is refused, what is written back, and its two numbers as keys."""

from __future__ import annotations

import tomllib
from collections.abc import Callable

import jsonschema
import pytest

from lenscl import StudyError, scene_from_toml
from lenscl.config import study_from_toml, study_schema
from lenscl.materials import D_LINE, Abbe

N = "n = 1.5"
STATED = "n = { nd = 1.5168, vd = 64.17 }"


@pytest.mark.parametrize(
    ("written", "wanted"),
    [
        ("{ nd = 1.5168 }", ["lens.n.vd: is required"]),
        ("{ vd = 64.17 }", ["lens.n.nd: is required"]),
        ("{ nd = 0.99, vd = 64.17 }", ["lens.n.nd: must lie from 1 to 1000, got 0.99"]),
        ("{ nd = 1001, vd = 64.17 }", ["lens.n.nd: must lie from 1 to 1000, got 1001"]),
        ("{ nd = 1.5168, vd = 0 }", ["lens.n.vd: must be greater than 0, got 0"]),
        ("{ nd = 1.5168, vd = -64.17 }", ["lens.n.vd: must be greater than 0, got -64.17"]),
        ("{ nd = 1.5168, vd = inf }", ["lens.n.vd: must be an Abbe number, positive, got inf"]),
        ("{ nd = nan, vd = 64 }", ["lens.n.nd: must be a refractive index at the d line, a number from 1, got nan"]),
        ("{ nd = true, vd = 64 }", ["lens.n.nd: must be a refractive index at the d line, a number from 1, got true"]),
        ("{ nd = '1,5', vd = 64 }", ["lens.n.nd: must be a refractive index at the d line, a number from 1, got"]),
        ("{ nd = 0.5, vd = -1 }", ["lens.n.nd: must lie", "lens.n.vd: must be greater"]),
        ("{ nd = 1.5, vd = 64, pgf = 0.53 }", ["lens.n.pgf: unknown key; known are nd, vd"]),
        ("{ nd = 1.5, Vd = 64 }", ['lens.n.Vd: unknown key; did you mean "vd"?', "lens.n.vd: is required"]),
        ("{ nd = 1.5, vd = 64, cauchy = [1.5] }", ["lens.n: must be a number, a material's name, { nd = ..., vd ="]),
        ("{ abbe = 64 }", ["lens.n: must be a number, a material's name, { nd = ..., vd = ... }"]),
    ],
)
@pytest.mark.parametrize("at", ["lens", "medium"])
def test_what_is_wrong_is_named_by_its_own_key(
    base: str, problems: Callable[[str], tuple[str, ...]], at: str, written: str, wanted: list[str]
) -> None:
    text = base.replace(N, f"n = {written}") if at == "lens" else f"{base}[medium]\nn = {written}\n"
    found = problems(text)
    assert len(found) == len(wanted)
    for problem, beginning in zip(found, wanted, strict=True):
        assert problem.startswith(beginning.replace("lens.n", f"{at}.n"))
    if not any(word in written for word in ("inf", "nan")):  # of which JSON has none
        assert not jsonschema.Draft202012Validator(study_schema()).is_valid(tomllib.loads(text))


def test_it_is_written_back_as_it_stands_and_valid_for_editors(base: str) -> None:
    text = base.replace(N, STATED) + "[medium]\nn = { nd = 1, vd = 1e3 }\n"
    jsonschema.validate(tomllib.loads(text), study_schema())
    scene = scene_from_toml(text)
    assert scene.lenses[0].material.index == Abbe(1.5168, 64.17)
    assert (scene.lenses[0].n, scene.n_medium) == (1.5168, 1.0)
    assert scene_from_toml(scene.to_toml()) == scene
    again = tomllib.loads(scene.to_toml())
    assert again["lens"][0]["n"] == {"nd": 1.5168, "vd": 64.17}
    assert again["medium"]["n"] == {"nd": 1.0, "vd": 1000.0}
    assert scene.at_wavelength(D_LINE).lenses[0].n == 1.5168


def test_its_numbers_are_keys_of_their_own(base: str) -> None:
    scene = scene_from_toml(base.replace(N, STATED) + f"[medium]\n{STATED}\n")
    found = scene.replace({"lens.n.nd": 1.7, "medium.n.vd": 30})
    assert found.lenses[0].material.index == Abbe(1.7, 64.17)
    assert found.medium.index == Abbe(1.5168, 30.0)
    assert scene.lenses[0].material.index == Abbe(1.5168, 64.17)  # as it was
    with pytest.raises(StudyError, match=r"^lens\.n\.nd: must lie from 1 to 1000, got 0\.5$"):
        scene.replace({"lens.n.nd": 0.5})
    with pytest.raises(StudyError, match=r"^lens\.n\.vd: is set already, as a part of lens\.n"):
        scene.replace({"lens.n": 1.5, "lens.n.vd": 30})
    assert scene.replace({"lens.n": {"nd": 2, "vd": 20}}).lenses[0].material.index == Abbe(2.0, 20.0)


def test_an_index_that_is_a_number_has_no_such_key(base: str) -> None:
    with pytest.raises(StudyError, match=r"^lens\.n\.nd: lens\.n has no such part; write lens\.n = \{ nd = \.\.\., vd"):
        scene_from_toml(base).replace({"lens.n.nd": 1.5})
    with pytest.raises(StudyError, match=r"^sweep\.axes\.lens\.n\.vd: lens\.n has no such part"):
        study_from_toml(base + "[sweep.axes]\n'lens.n.vd' = [30, 60]\n")


def test_sweeps_take_both_numbers_alone_or_together(base: str) -> None:
    text = base.replace(N, f"{STATED}\nname = 'crown'") + f"[medium]\n{STATED}\n"
    study = study_from_toml(
        text + "[sweep.axes]\n'lens.n.nd' = { linspace = [1.5, 1.9, 3] }\n'medium.n.vd' = [20, 60]\n"
        "[[sweep.include]]\n'lens.crown.n.vd' = 33\n"
    )
    found = [(point.scene.lenses[0].material.index, point.scene.medium.index) for point in study.points()]
    assert found[:2] == [(Abbe(1.5, 64.17), Abbe(1.5168, 20.0)), (Abbe(1.5, 64.17), Abbe(1.5168, 60.0))]
    assert found[5] == (Abbe(1.9, 64.17), Abbe(1.5168, 60.0))
    assert found[6] == (Abbe(1.5168, 33.0), Abbe(1.5168, 64.17))
    held = study.with_overrides({"lens.n.nd": 1.25})
    assert {point.scene.lenses[0].n for point in held.points()} == {1.25}
    glasses = study_from_toml(text + "[[sweep.zip]]\n'lens.n.nd' = [1.5, 1.7]\n'lens.n.vd' = [64, 30]\n")
    assert [point.scene.lenses[0].material.index for point in glasses.points()] == [Abbe(1.5, 64.0), Abbe(1.7, 30.0)]
    whole = study_from_toml(base + "[sweep.axes]\n'lens.n' = ['N-BK7', { nd = 1.6, vd = 40 }, 1.5]\n")
    assert [round(point.scene.lenses[0].n, 4) for point in whole.points()] == [1.5168, 1.6, 1.5]


def test_a_sweep_of_the_whole_and_of_a_part_clash(base: str, problems: Callable[[str], tuple[str, ...]]) -> None:
    text = base.replace(N, STATED) + "[sweep.axes]\n'lens.n' = [1.5]\n'lens.n.nd' = [1.6]\n"
    (found,) = problems(text)
    assert found.startswith("sweep.axes.lens.n.nd: varies already, by sweep.axes.lens.n")


def test_what_is_wrong_in_a_file_may_be_set(base: str) -> None:
    text = base.replace(N, "n = { nd = 0.5, vd = 64 }")
    assert study_from_toml(text, overrides={"lens.n.nd": 1.7}).scene.lenses[0].material.index == Abbe(1.7, 64.0)


def test_data_must_reach_the_wavelengths_asked_for(base: str, problems: Callable[[str], tuple[str, ...]]) -> None:
    """A strong dispersion makes the formula negative far in the infrared; there it is no index."""
    text = base.replace(N, "n = { nd = 3, vd = 0.5 }") + "[effects]\ndispersion = [587.6, 2000]\n"
    (found,) = problems(text)
    assert found.startswith("lens.n: refractive index: the formula gives no positive index at 2000 nm")
