"""A list of wavelengths of one's own: what is refused, what is traced, what is seen of it."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from itertools import pairwise
from typing import Any

import jsonschema
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from imaging.maps import every_pixel, landing, random_pixels
from scenes import make_scene

from lenscl import RayStatus, StudyError, paint, scene_from_toml, trace
from lenscl.config import study_from_toml, study_schema
from lenscl.device import choose
from lenscl.effects import BAND, RGB_LINES, VISIBLE, wavelengths_of
from lenscl.effects.colours import basis
from lenscl.effects.wavelengths import bands_of
from lenscl.imaging import light
from lenscl.imaging.spectrum import matching, shares_of, spectral_matrices

FDC = (486.1, 587.6, 656.3)
PRISM: dict[str, Any] = {"surface": "prism", "apex": 40.0, "n": {"nd": 1.7, "vd": 25.0}}
TO_SRGB = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
SIZE = (11, 7)
lists = st.lists(st.floats(360.0, 900.0), min_size=1, max_size=12, unique=True).map(sorted)


def dispersive(asked: Any, lens: dict[str, Any] = PRISM, **parts: Any) -> Any:
    effects = {"dispersion": asked} | parts.pop("effects", {})
    return make_scene(lens, effects=effects, film={"size": [37, 29]}, **parts)


# ---- What is refused


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        ([], "must be a rising list of 1 to 64 wavelengths in nm, got []"),
        (list(range(400, 465)), "must be a rising list of 1 to 64 wavelengths in nm, got a list of 65 values"),
        (
            [656.3, 587.6],
            "must be a rising list of 1 to 64 wavelengths in nm; the value at place 2 does not rise, 587.6",
        ),
        ([500, 500.0], "must be a rising list of 1 to 64 wavelengths in nm; the value at place 2 does not rise, 500 "),
        (
            [0.4861, 0.5876],
            "must be a rising list of 1 to 64 wavelengths in nm; the value at place 1 must lie from 100",
        ),
        ([500, 2e5], "must be a rising list of 1 to 64 wavelengths in nm; the value at place 2 must lie from 100 to"),
        ([500, "600"], "must be a rising list of 1 to 64 wavelengths in nm; the value at place 2 must be a finite"),
        ([True], "must be a rising list of 1 to 64 wavelengths in nm; the value at place 1 must be a finite"),
        ([[500]], "must be a rising list of 1 to 64 wavelengths in nm; the value at place 1 must be a finite"),
    ],
)
def test_what_is_no_such_list_is_refused(asked: Any, says: str) -> None:
    with pytest.raises(StudyError) as error:
        dispersive(asked)
    (problem,) = error.value.problems
    assert problem.startswith(f"effects.dispersion: {says}")


def test_other_effects_take_no_list() -> None:
    with pytest.raises(StudyError, match=r"^effects\.antialias: must be \"edges\" or a whole number from 1 to 16, got"):
        make_scene({"surface": "sphere"}, effects={"antialias": [486.1, 587.6]})


def test_a_glass_without_data_at_a_wavelength_of_the_list_is_refused_by_its_key() -> None:
    with pytest.raises(StudyError) as error:
        dispersive([587.6, 3000], {"surface": "sphere", "n": "N-BK7"})
    says = "lens.n: refractive index: known from 300 to 2500 nm, not at 3000 nm; effects.dispersion = [587.6, 3000.0] "
    assert error.value.problems[0].startswith(says)


def test_a_list_is_written_back_and_valid_for_editors() -> None:
    scene = dispersive(list(FDC))
    assert scene.effects.dispersion == FDC == scene.wavelengths
    assert hash(scene.effects) == hash(dispersive(np.array(FDC).tolist()).effects)
    assert scene_from_toml(scene.to_toml()) == scene
    text = scene.to_toml()
    assert "dispersion = [486.1, 587.6, 656.3]" in text
    jsonschema.validate(tomllib.loads(text), study_schema())
    for wrong in ("[]", "[50.0]", '["red"]', f"[{', '.join(['500'] * 65)}]"):
        other = text.replace("[486.1, 587.6, 656.3]", wrong)
        assert not jsonschema.Draft202012Validator(study_schema()).is_valid(tomllib.loads(other))
    assert scene.replace({"effects.dispersion": [500]}).wavelengths == (500.0,)
    assert scene.replace({"effects.dispersion": "rgb"}).wavelengths == RGB_LINES


def test_a_sweep_may_list_lists() -> None:
    text = dispersive(False).to_toml() + '[sweep.axes]\n"effects.dispersion" = [[486.1, 587.6], 3, false, [1064]]\n'
    found = [point.scene.wavelengths for point in study_from_toml(text).points()]
    assert found == [(486.1, 587.6), wavelengths_of(3), (), (1064.0,)]
    with pytest.raises(StudyError) as error:
        study_from_toml(text.replace("[[486.1, 587.6], 3, false, [1064]]", "[486.1, 587.6]"))
    assert error.value.problems[0].partition(" (point 0")[0].endswith("a list, too, [486.1]")


# ---- What is traced


@pytest.mark.parametrize("asked", [FDC, (587.5618,), (404.7, 1064.0)])
def test_every_wavelength_of_a_list_is_traced_as_if_it_were_alone(asked: tuple[float, ...]) -> None:
    scene = dispersive(list(asked), effects={"path_length": True})
    found = trace(scene)
    assert found.wavelengths.tolist() == list(asked)
    assert found.st.shape == (len(asked), 29, 37, 2)
    for number, nm in enumerate(asked):
        n = scene.lenses[0].material.index.at(nm)
        alone = trace(make_scene(PRISM | {"n": n}, film={"size": [37, 29]}, effects={"path_length": True}))
        for name in ("st", "status", "events", "path_length"):
            np.testing.assert_array_equal(getattr(found, name)[number], getattr(alone, name))
    assert (found.events > 0).sum() > 100 * len(asked)


# ---- What is seen


def by_hand(nm: tuple[float, ...] | list[float]) -> tuple[Any, Any]:
    """Return the matrices and shares of a list: a wavelength at a time, each nm of the band given to the nearest."""
    grid = np.arange(BAND[0] + 0.005, BAND[1], 0.01)
    seen = [each for each in nm if VISIBLE[0] <= each <= VISIBLE[1]]
    nearest = np.abs(grid[:, None] - np.array(seen)).argmin(axis=1)
    parts = np.einsum("ki,kj->kij", matching(grid) @ TO_SRGB.T, basis(grid))
    total = np.linalg.inv(parts.sum(axis=0))
    chosen = [nearest == seen.index(each) if each in seen else np.zeros(len(grid), bool) for each in nm]
    return np.stack([parts[some].sum(axis=0) @ total for some in chosen]), np.array([some.mean() for some in chosen])


@pytest.mark.parametrize(
    "nm",
    [FDC, (587.6,), (450.0, 640.0), (400.0, 500.0, 600.0, 700.0), (486.1, 587.6, 656.3, 1064.0), (350.0, 700.0),
     (530.0, 531.0, 532.0), (656.3, 660.0)],
)  # fmt: skip
def test_each_wavelength_stands_for_what_is_nearest_to_it(nm: tuple[float, ...]) -> None:
    matrices, shares = by_hand(nm)
    np.testing.assert_allclose(spectral_matrices(nm), matrices, atol=2e-4)
    np.testing.assert_allclose(shares_of(nm), shares, atol=1e-4)


@given(lists)
@settings(max_examples=150, deadline=None)
def test_bands_lie_side_by_side_and_white_stays_white(nm: list[float]) -> None:
    bands, is_seen = bands_of(nm), [VISIBLE[0] <= each <= VISIBLE[1] for each in nm]
    assert len(bands) == len(nm)
    if not any(is_seen):
        assert all(low == high for low, high in bands)
        return
    own = [band for band, seen in zip(bands, is_seen, strict=True) if seen]
    assert (own[0][0], own[-1][1]) == BAND
    assert all(a[1] == b[0] and a[0] <= a[1] for a, b in pairwise([*own, (own[-1][1], own[-1][1])]))
    matrices, shares = spectral_matrices(nm), shares_of(nm)
    np.testing.assert_allclose(matrices.sum(axis=0), np.eye(3), atol=1e-13)
    assert shares.sum() == pytest.approx(1.0)
    assert not matrices[[not seen for seen in is_seen]].any()
    assert np.abs(matrices).max() < 1.1  # no matter how few or how near, nothing is blown up


def test_parting_a_band_parts_its_matrix() -> None:
    """A wavelength more that stands for a part of another's band takes its share from that one alone."""
    few, more = (450.0, 550.0, 610.0), (450.0, 540.0, 560.0, 610.0)
    a, b = spectral_matrices(few), spectral_matrices(more)
    assert bands_of(more)[1][1] == 550.0
    np.testing.assert_allclose(b.sum(axis=0), a.sum(axis=0), atol=1e-13)
    np.testing.assert_allclose(spectral_matrices([587.6])[0], np.eye(3), atol=1e-14)


def test_the_wavelengths_of_a_number_or_of_rgb_are_those_however_written() -> None:
    for count in (3, 5, 16, 64):
        nm = wavelengths_of(count)
        seen = matching(nm) @ TO_SRGB.T  # every sample alike, as a number has them
        raw = seen[:, :, None] * basis(nm)[:, None, :]
        np.testing.assert_allclose(spectral_matrices([round(each, 9) for each in nm]), raw @ np.linalg.inv(raw.sum(0)))
        np.testing.assert_allclose(shares_of(nm), 1.0 / count)
    lines = spectral_matrices(sorted(RGB_LINES))
    np.testing.assert_array_equal(lines, spectral_matrices(RGB_LINES)[::-1])
    np.testing.assert_array_equal(lines[0], np.diag([0.0, 0.0, 1.0]))  # blue has the shortest
    # A list that is nearly a number's is nearly painted as it: the finer the nearer
    for count, off in ((8, 0.03), (16, 6e-3), (64, 2e-4)):
        nm = np.array(wavelengths_of(count))
        assert 0 < np.abs(spectral_matrices(nm + 1e-4) - spectral_matrices(nm)).max() < off


def layered(nm: tuple[float, ...], places: list[Any] | None = None) -> Any:
    """A map of several wavelengths, each of which looks at its own places; all at the picture as it is, unless told."""
    maps = [landing(each, choose()) for each in places or [every_pixel(*SIZE)] * len(nm)]
    return replace(
        maps[0], st=np.stack([one.st for one in maps]), status=np.stack([one.status for one in maps]),
        added={"wavelengths": np.array(nm)},
    )  # fmt: skip


@pytest.mark.parametrize("nm", [FDC, (587.6,), (450.0, 640.0), (420.0, 600.0, 1064.0)])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_what_nothing_disperses_is_painted_as_it_is(nm: tuple[float, ...], channels: int) -> None:
    rng = np.random.default_rng(5)
    for dtype, close in (("uint8", 1), ("float64", 1e-13)):
        pixels = random_pixels(rng, (SIZE[1], SIZE[0], channels), dtype)
        if channels in (2, 4) and pixels.dtype.kind == "u":  # where nothing is seen the hidden colour may be any
            pixels[..., -1] = np.maximum(pixels[..., -1], 128)
        found = paint(layered(nm), pixels, filter="nearest").astype(np.float64)
        np.testing.assert_allclose(found, pixels.astype(np.float64), rtol=0, atol=close)


def test_each_wavelength_shows_its_share_at_its_own_place() -> None:
    rng = np.random.default_rng(6)
    nm = (420.0, 486.1, 587.6, 656.3, 1064.0)
    places = [rng.random((5, 9, 2)) for _ in nm]
    pixels = rng.random((6, 8, 4))
    found = paint(layered(nm, places), pixels, filter="nearest")
    matrices, shares = by_hand(nm)
    columns, rows = ([(each[..., axis] * count).astype(int) for each in places] for axis, count in ((0, 8), (1, 6)))
    seen = [pixels[row, column] for row, column in zip(rows, columns, strict=True)]
    np.testing.assert_allclose(
        found[..., :3], sum(s[..., :3] @ m.T for s, m in zip(seen, matrices, strict=True)), atol=5e-4
    )
    np.testing.assert_allclose(found[..., 3], sum(s[..., 3] * w for s, w in zip(seen, shares, strict=True)), atol=5e-4)
    seen[-1] = np.zeros_like(seen[-1])  # infrared shows nothing
    moved = paint(layered(nm, [*places[:-1], places[0]]), pixels, filter="nearest")
    np.testing.assert_array_equal(moved, found)
    assert np.abs(paint(layered(nm, places[::-1]), pixels, filter="nearest") - found).max() > 0.1


@pytest.mark.parametrize("nm", [(1064.0,), (200.0, 350.0), (800.0, 900.0, 1000.0)])
def test_light_that_is_not_seen_paints_nothing_but_is_traced(nm: tuple[float, ...]) -> None:
    scene = dispersive(list(nm), {"surface": "sphere", "n": {"cauchy": [1.5, 0.004]}})
    found = trace(scene)
    assert (found.status == RayStatus.PICTURE).sum() > 300
    with pytest.raises(StudyError, match=r"^effects\.dispersion: no wavelength of the list is seen, .* 380 to 780 nm"):
        paint(found, np.zeros((4, 4, 3)))


def test_caustics_are_lit_by_every_wavelength_of_a_list() -> None:
    scene = make_scene(
        {"surface": "sphere", "r": 0.5, "n": {"nd": 1.78, "vd": 25}, "absorption": [0.5, 0.1, 0.2]},
        effects={"caustics": True, "dispersion": [486.1, 656.3, 1064.0]},
        film={"size": [6, 6]},
        picture={"size": [8, 8]},
    )
    found = trace(scene)
    assert found.caustic is not None
    white = light(found, np.ones((4, 4, 3)))
    matrices, _ = by_hand(scene.wavelengths)
    np.testing.assert_allclose(white, np.einsum("kij,krcj->rci", matrices, found.caustic.rgb), atol=1e-3)
    assert np.abs(found.caustic.rgb[0] - found.caustic.rgb[1]).max() > 0.01
