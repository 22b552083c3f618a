"""Commands on a study of several wavelengths."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import OpenImageIO

from lenscl.imaging import draw, read_picture, write_image

FLINT = ("--set", "lens.n={ nd = 1.728, vd = 28.5 }")
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


def channels(path: Path) -> np.ndarray:
    """Return all channels of an EXR file, shape (rows, columns, N)."""
    image = OpenImageIO.ImageBuf(str(path))
    return image.get_pixels(OpenImageIO.FLOAT)


def asks(text: str) -> tuple[str, str]:
    return "--set", f"effects.dispersion={text}"


def test_commands_take_a_list(lenscl, small_starter: Path, tmp_path: Path) -> None:
    result = lenscl("map", small_starter, *FLINT, *asks("[486.1, 587.6, 656.3]"), "-o", tmp_path / "map.npz")
    assert result.exit_code == 0
    with np.load(tmp_path / "map.npz") as stored:
        assert stored["wavelengths"].tolist() == [486.1, 587.6, 656.3]
        assert stored["st"].shape == (3, 20, 32, 2)
        assert "dispersion = [486.1, 587.6, 656.3]" in str(stored["scene_toml"])
        assert "nd = 1.728" in str(stored["scene_toml"])
    result = lenscl("explain", small_starter, *FLINT, *asks("[486.1, 656.3]"))
    assert "asked for: 2 wavelengths from 486.1 to 656.3 nm, each traced" in result.stdout
    result = lenscl("explain", small_starter, *FLINT, *asks("[532]"), "--json")
    assert "asked for: one wavelength, 532 nm" in result.stdout
    result = lenscl("check", small_starter, *FLINT, *asks("[486.1, 587.6, 656.3]"))
    assert result.exit_code == 0
    refused = lenscl("check", small_starter, *asks("[587.6, 486.1]"))
    assert refused.exit_code == 2
    assert "effects.dispersion: must be a rising list" in refused.stderr


def test_one_wavelength_is_an_st_map_as_any_other(lenscl, small_starter: Path, tmp_path: Path) -> None:
    """That of the glass whose index is what the formula has at the wavelength, written out by hand."""
    b = (1.728 - 1) / 28.5 / (0.4861327**-2 - 0.6562725**-2)
    n = 1.728 + b * (0.6328**-2 - 0.5875618**-2)
    alone = (*FLINT, *asks("[632.8]"), "--set", "effects.footprint=true", "--error")
    plain = ("--set", f"lens.n={n!r}", "--set", "effects.footprint=true", "--error")
    for name, more in (("alone", alone), ("plain", plain), ("d", FLINT)):
        assert lenscl("map", small_starter, *more, "-o", tmp_path / f"{name}.exr").exit_code == 0
    found, wanted, d_line = (channels(tmp_path / f"{name}.exr") for name in ("alone", "plain", "d"))
    assert found.shape == wanted.shape == (20, 32, 11)  # R, G, B, A, error, fold, magnification and the jacobian
    np.testing.assert_allclose(found, wanted, rtol=1e-5, atol=1e-6)
    assert (found[..., 3] == 1).sum() > 250
    assert np.abs(d_line[..., :2] - wanted[..., :2]).max() > 1e-3


def test_light_that_is_not_seen_is_refused_before_anything_is_traced(
    lenscl, small_starter: Path, tmp_path: Path
) -> None:
    infrared = (*FLINT, *asks("[850, 1064]"))
    for command in (("render", small_starter, *infrared, "-o", tmp_path / "a.png"),
                    ("sweep", small_starter, *infrared, "-o", tmp_path / "out")):  # fmt: skip
        refused = lenscl(*command)
        assert refused.exit_code == 2
        assert "effects.dispersion: no wavelength of the list is seen" in refused.stderr
    assert not (tmp_path / "a.png").exists()
    assert "effects.dispersion: no wavelength of the list is seen" in lenscl("check", small_starter, *infrared).stdout
    assert lenscl("map", small_starter, *infrared, "-o", tmp_path / "map.npz").exit_code == 0


def test_a_sweep_over_lists_writes_their_cells_and_fails_alone_where_nothing_is_seen(lenscl, study_path: Path) -> None:
    head, _, _ = study_path.read_text().partition('"lens.r" =')
    study_path.write_text(f'{head}"effects.dispersion" = [[486.1, 587.6, 656.3], [1064], [550]]\n')
    result = lenscl("sweep", study_path, *FLINT, "-o", study_path.parent / "out")
    assert result.exit_code == 3
    rows = list(csv.reader(result.stdout.splitlines()))[1::2]
    assert [row[1] for row in rows] == ["[486.1, 587.6, 656.3]", "[1064]", "[550]"]
    assert ["no wavelength of the list is seen" in " ".join(row) for row in rows] == [False, True, False]
