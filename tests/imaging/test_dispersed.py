"""Light of several wavelengths as colours: the observer's curves, and pictures seen wavelength by wavelength."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from imaging.maps import every_pixel, landing, random_pixels
from numpy.typing import NDArray

from lenscl import paint, reference
from lenscl.device import choose
from lenscl.effects import BAND, RGB_LINES, wavelengths_of
from lenscl.effects.colours import basis
from lenscl.imaging.spectrum import matching, spectral_matrices
from lenscl.status import RayStatus

SIZE = (11, 7)
TO_SRGB = np.linalg.inv(  # from the primaries' and D65's chromaticities: IEC 61966-2-1:1999, table 1
    np.array([[0.64, 0.30, 0.15], [0.33, 0.60, 0.06], [0.03, 0.10, 0.79]])
    * np.linalg.solve(
        np.array([[0.64, 0.30, 0.15], [0.33, 0.60, 0.06], [0.03, 0.10, 0.79]]), [0.3127 / 0.3290, 1.0, 0.3583 / 0.3290]
    )
)


def test_the_observer_is_that_of_the_cie() -> None:
    """CIE 1931, 2 degrees, from the tables of CIE 015; the fit is good to some hundredths."""
    table = {
        450: (0.3362, 0.0380, 1.7721), 480: (0.0956, 0.1390, 0.8130), 500: (0.0049, 0.3230, 0.2720),
        520: (0.0633, 0.7100, 0.0782), 555: (0.5121, 1.0000, 0.0057), 580: (0.9163, 0.8700, 0.0017),
        600: (1.0622, 0.6310, 0.0008), 650: (0.2835, 0.1070, 0.0000),
    }  # fmt: skip
    np.testing.assert_allclose(matching(list(table)), list(table.values()), atol=0.04)


def test_most_of_what_is_seen_lies_in_the_band() -> None:
    nm = np.linspace(360.0, 830.0, 4701)
    luminous = matching(nm)[:, 1]
    share = luminous[(nm >= BAND[0]) & (nm <= BAND[1])].sum() / luminous.sum()
    assert 0.975 < share < 0.985


def test_the_three_lines_are_the_dominant_wavelengths_of_the_primaries() -> None:
    nm = np.linspace(*BAND, 21001)
    xyz = matching(nm)
    xy, white = xyz[:, :2] / xyz.sum(axis=1, keepdims=True), np.array([0.3127, 0.3290])
    for line, primary in zip(RGB_LINES, ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06)), strict=True):
        way, from_white = np.subtract(primary, white), xy - white
        off = np.where(from_white @ way > 0, np.abs(from_white[:, 0] * way[1] - from_white[:, 1] * way[0]), np.inf)
        assert nm[np.argmin(off)] == pytest.approx(line, abs=2.0)


@pytest.mark.parametrize("count", [3, 4, 5, 8, 16, 33, 64])
def test_matrices_sum_up_to_what_leaves_colours_alone(count: int) -> None:
    nm = wavelengths_of(count)
    matrices = spectral_matrices(nm)
    np.testing.assert_allclose(matrices.sum(axis=0), np.eye(3), atol=1e-14)
    for number, matrix in enumerate(matrices):  # each a colour of the spectrum, as the observer sees it
        seen = TO_SRGB @ matching(nm[number])
        left = matrix @ np.array([0.3, 0.7, 0.5])
        np.testing.assert_allclose(np.cross(seen, left), 0.0, atol=2e-3 * np.linalg.norm(seen))
    assert np.abs(matrices).max() < 1.1
    spectra = basis(np.linspace(400.0, 700.0, 301))
    np.testing.assert_allclose(spectra.sum(axis=1), 1.0, atol=1e-15)
    assert spectra.min() >= 0.0


def test_three_lines_carry_a_channel_each() -> None:
    for number, matrix in enumerate(spectral_matrices(RGB_LINES)):
        np.testing.assert_array_equal(matrix, np.diag(np.eye(3)[number]))


def layered(asked: Any, places: list[NDArray[np.float64]] | None = None, **added: Any) -> Any:
    """A map of several wavelengths, each of which looks at its own places; all at the picture as it is, unless told."""
    nm = wavelengths_of(asked)
    maps = [landing(st, choose()) for st in places or [every_pixel(*SIZE)] * len(nm)]
    return replace(
        maps[0], st=np.stack([one.st for one in maps]), status=np.stack([one.status for one in maps]),
        added={"wavelengths": np.array(nm), **added},
    )  # fmt: skip


@pytest.mark.parametrize("asked", ["rgb", 3, 8, 64])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_what_nothing_disperses_is_painted_as_it_is(asked: Any, channels: int) -> None:
    rng = np.random.default_rng(3)
    places = every_pixel(13, 9) * 0.8 + 0.33  # some between the pixels, some outside
    plain, spread = landing(places, choose()), layered(asked, [places] * len(wavelengths_of(asked)))
    for dtype, close in (("uint8", 1), ("uint16", 2), ("float32", 2e-5), ("float64", 1e-13)):
        pixels = random_pixels(rng, (SIZE[1], SIZE[0], channels), dtype)
        if channels in (2, 4) and pixels.dtype.kind == "u":  # where nothing is seen the hidden colour may be any
            pixels[..., -1] = np.maximum(pixels[..., -1], np.iinfo(dtype).max // 2)
        outside = 100 if pixels.dtype.kind == "u" else 0.3
        wanted = paint(plain, pixels, outside=outside).astype(np.float64)
        found = paint(spread, pixels, outside=outside)
        assert found.dtype == pixels.dtype
        np.testing.assert_allclose(found, wanted, rtol=0, atol=close)
        assert 10 < (plain.status == RayStatus.PICTURE).sum() < plain.status.size - 10


@pytest.mark.parametrize("asked", ["rgb", 3, 4, 7, 16, 64])
def test_greys_stay_grey(asked: Any) -> None:
    grey = np.repeat(np.arange(77, dtype=np.uint8).reshape(7, 11, 1) * 3, 3, axis=2)
    found = paint(layered(asked), grey).astype(int)
    assert np.ptp(found, axis=2).max() <= 1
    np.testing.assert_allclose(found, grey, atol=1)


@pytest.mark.parametrize("filter_name", ["nearest", "bilinear"])
@pytest.mark.parametrize("asked", ["rgb", 5])
def test_each_wavelength_is_seen_at_its_own_place(asked: Any, filter_name: str) -> None:
    """By the plain twin of painting, a matrix for each wavelength, and a sum."""
    rng = np.random.default_rng(8)
    pixels = rng.random((6, 8, 4)) * 2 - 0.3
    nm = wavelengths_of(asked)
    places = [rng.random((5, 9, 2)) * 1.2 - 0.1 for _ in nm]
    spread = layered(asked, places)
    wanted, alpha = np.zeros((5, 9, 3)), np.zeros((5, 9))
    for st, status, matrix in zip(places, spread.status, spectral_matrices(nm), strict=True):
        seen = reference.paint(st, status, pixels, filter=filter_name, outside=[0.4, 0.2, 0.1, 0.9])
        wanted += np.einsum("ij,...j", matrix, seen[..., :3])
        alpha += seen[..., 3] / len(nm)
    found = paint(spread, pixels, filter=filter_name, outside=[0.4, 0.2, 0.1, 0.9])
    np.testing.assert_allclose(found[..., :3], wanted, atol=1e-12)
    np.testing.assert_allclose(found[..., 3], alpha, atol=1e-12)
    landed = (spread.status == RayStatus.PICTURE).sum(axis=0)
    assert ((landed > 0) & (landed < len(nm))).sum() > 5  # some wavelengths of a pixel land, and others do not
    wrong = layered(asked, places[::-1])  # the wavelengths mixed up
    assert np.abs(paint(wrong, pixels, filter=filter_name)[..., :3] - wanted).max() > 0.1


def test_a_white_line_becomes_a_spectrum_from_red_to_blue() -> None:
    """Wavelengths that look one pixel further each, past a white line."""
    count = 21
    places = [every_pixel(61, 1) + (number - 10) / 61 * np.array([1.0, 0.0]) for number in range(count)]
    line = np.zeros((1, 61, 3))
    line[0, 30] = 1.0
    found = paint(layered(count, places), line, filter="nearest")[0]
    nm = wavelengths_of(count)
    order = [30 + 10 - number for number in range(count)]  # where each wavelength has the line
    np.testing.assert_allclose(found[order], spectral_matrices(nm).sum(axis=2), atol=1e-12)
    np.testing.assert_allclose(found.sum(axis=0), 1.0, atol=1e-12)  # white in all
    hue = np.argmax(found[order], axis=1)
    assert hue[0] == 2
    assert hue[-1] == 0
    assert set(hue) == {0, 1, 2}
    codes = paint(layered(count, places), (line * 255).astype(np.uint8), filter="nearest")[0]
    assert codes[order[0]].argmax() == 2  # colours beyond sRGB are cut off
    assert (codes[order] == 0).any()


@pytest.mark.parametrize("asked", ["rgb", 4])
def test_what_gets_through_dims_each_wavelength(asked: Any) -> None:
    rng = np.random.default_rng(9)
    nm = wavelengths_of(asked)
    pixels = rng.random((SIZE[1], SIZE[0], 3))
    shares = rng.random((len(nm), SIZE[1], SIZE[0]))
    parts = rng.random((*shares.shape, 3))
    found = paint(layered(asked, transmittance=shares, transmission=parts), pixels)
    dimmed = pixels * shares[..., None] * parts
    np.testing.assert_allclose(found, np.einsum("kij,krcj->rci", spectral_matrices(nm), dimmed), atol=1e-6)


def test_what_is_no_number_stays_in_its_channel_with_three_lines() -> None:
    pixels = np.ones((SIZE[1], SIZE[0], 3), np.float32)
    pixels[2, 3, 1] = np.nan
    found = paint(layered("rgb"), pixels, filter="nearest")
    assert np.argwhere(np.isnan(found)).tolist() == [[2, 3, 1]]


def test_colour_that_cannot_be_seen_is_black() -> None:
    pixels = np.full((SIZE[1], SIZE[0], 4), 200, np.uint8)
    pixels[:3, :, 3] = 0
    found = paint(layered(3), pixels, filter="nearest")
    assert not found[:3].any()
    np.testing.assert_allclose(found[3:].astype(int), 200, atol=1)
