"""Commands on a study of several wavelengths."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lenscl.imaging import draw, read_picture, write_image

GLASS = ("--set", "lens.n=SF10", "--set", "effects.dispersion=3")


def test_a_map_of_several_wavelengths_is_written_for_numpy_alone(lenscl, small_starter: Path, tmp_path: Path) -> None:
    result = lenscl("map", small_starter, *GLASS, "-o", tmp_path / "map.npz")
    assert result.exit_code == 0
    with np.load(tmp_path / "map.npz") as stored:
        assert stored["wavelengths"].tolist() == [475.0, 545.0, 615.0]
        assert stored["st"].shape == (3, 20, 32, 2)
        assert stored["direction"].shape == (3, 20, 32, 3)
        assert "dispersion = 3" in str(stored["scene_toml"])
        assert (stored["st"][0] != stored["st"][2]).any()
    counted = sum(int(part.split()[0]) for part in result.stderr.splitlines()[0].rpartition(": ")[2].split(", "))
    assert counted == 3 * 20 * 32
    refused = lenscl("map", small_starter, *GLASS, "-o", tmp_path / "map.exr")
    assert refused.exit_code == 1
    assert "holds one wavelength" in refused.stderr
    assert "map.npz" not in refused.stderr
    assert "write the map as .npz" in refused.stderr
    assert not (tmp_path / "map.exr").exists()
    assert lenscl("map", small_starter, "--set", "lens.n=SF10", "-o", tmp_path / "map.exr").exit_code == 0


def test_a_grey_picture_gets_its_fringes(lenscl, small_starter: Path, tmp_path: Path) -> None:
    grey = draw("chart", 64)[..., :1]
    for name, pixels in (("grey", grey), ("colour", np.repeat(grey, 3, axis=2))):
        write_image(tmp_path / f"{name}.png", pixels, metadata={})
        out = tmp_path / f"{name}-seen.png"
        assert lenscl("render", small_starter, *GLASS, "-i", tmp_path / f"{name}.png", "-o", out).exit_code == 0
    seen, wanted = (read_picture(tmp_path / f"{name}-seen.png").pixels for name in ("grey", "colour"))
    np.testing.assert_array_equal(seen, wanted)
    assert (np.ptp(seen.astype(int), axis=2) > 5).sum() > 5


def test_explain_says_which_wavelengths_and_of_which_a_path_is(lenscl, small_starter: Path) -> None:
    result = lenscl("explain", small_starter, *GLASS)
    (line,) = [line for line in result.stdout.splitlines() if line.startswith("dispersion")]
    assert line.split()[1:4] == ["in", "asked", "dispersion"]
    assert line.endswith("asked for: 3 wavelengths from 475 to 615 nm, each traced")
    result = lenscl("explain", small_starter, *GLASS, "--pixel", "10,8")
    assert "the path is of the d line, 587.562 nm" in result.stderr
    plain = lenscl("explain", small_starter, "--set", "lens.n=SF10", "--pixel", "10,8")
    assert plain.stdout == result.stdout
    assert "wavelength" not in plain.stderr


def test_a_sweep_may_vary_the_wavelengths(lenscl, study_path: Path) -> None:
    text = study_path.read_text()
    head, _, _ = text.partition('"lens.r" =')
    study_path.write_text(f'{head}"effects.dispersion" = [false, 3, "rgb"]\n')
    result = lenscl("sweep", study_path, "--set", "lens.n=SF10", "-o", study_path.parent / "out")
    assert result.exit_code == 0
    rows = [line.split(",") for line in result.stdout.splitlines()[1:]]
    assert [row[1] for row in rows[::2]] == ["false", "3", "rgb"]
    assert [sum(map(int, row[3:10])) for row in rows[::2]] == [640, 1920, 1920]


def test_a_glass_without_data_there_is_refused_before_anything_is_traced(lenscl, small_starter: Path) -> None:
    result = lenscl(
        "check", small_starter, "--set", "lens.n={ table = [[500, 1.6], [600, 1.5]] }", "--set", "effects.dispersion=3"
    )
    assert result.exit_code == 2
    assert "lens.n: refractive index: known from 500 to 600 nm, not at 475 nm" in result.stderr
