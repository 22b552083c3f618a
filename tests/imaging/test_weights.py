"""What gets through a lens dims the picture: in linear light, colour by colour, and alpha not at all."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from imaging.maps import every_pixel, landing, random_pixels
from scenes import make_scene

from lenscl import RayStatus, paint, trace
from lenscl.device import choose

FILTERS = ("nearest", "bilinear", "bicubic")
DTYPES = ("uint8", "uint16", "float16", "float32", "float64")
SIZE = (9, 7)


def decoded(ratio: Any) -> Any:
    return np.where(ratio <= 0.04045, ratio / 12.92, ((ratio + 0.055) / 1.055) ** 2.4)


def encoded(light: Any) -> Any:
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055)


def seen(**added: Any) -> Any:
    """A map of a film that sees the picture as it is, and of what gets through."""
    return replace(landing(every_pixel(*SIZE), choose()), added=added)


@pytest.mark.parametrize(("dtype", "filter_name"), list(zip(DTYPES, (*FILTERS, *FILTERS), strict=False)))
def test_where_all_gets_through_nothing_changes(dtype: str, filter_name: str) -> None:
    rng = np.random.default_rng(4)
    for channels in (2, 3) if dtype == "uint8" else (1, 4):
        pixels = random_pixels(rng, (SIZE[1], SIZE[0], channels), dtype)
        full = np.ones((SIZE[1], SIZE[0]))
        dimmed = paint(seen(transmittance=full, transmission=np.ones((*full.shape, 3))), pixels, filter=filter_name)
        np.testing.assert_array_equal(dimmed, paint(seen(), pixels, filter=filter_name))


@pytest.mark.parametrize("filter_name", FILTERS)
def test_light_is_multiplied_colour_by_colour(filter_name: str) -> None:
    rng = np.random.default_rng(5)
    share, parts = rng.random((SIZE[1], SIZE[0])), rng.random((SIZE[1], SIZE[0], 3))
    for dtype, close in (("float32", 1e-6), ("float64", 1e-14)):
        pixels = random_pixels(rng, (SIZE[1], SIZE[0], 4), dtype)
        plain = paint(seen(), pixels, filter=filter_name)
        dimmed = paint(seen(transmittance=share, transmission=parts), pixels, filter=filter_name)
        np.testing.assert_allclose(dimmed[..., :3], plain[..., :3] * share[..., None] * parts, atol=close, rtol=close)
        np.testing.assert_array_equal(dimmed[..., 3], plain[..., 3])


@pytest.mark.parametrize("channels", [3, 4])
def test_codes_are_dimmed_as_the_light_they_stand_for(channels: int) -> None:
    rng = np.random.default_rng(6)
    parts = rng.random((SIZE[1], SIZE[0], 3))
    pixels = random_pixels(rng, (SIZE[1], SIZE[0], channels), "uint16")
    if channels == 4:
        pixels[..., 3] = np.maximum(pixels[..., 3], 40000)
    dimmed = paint(seen(transmission=parts), pixels, filter="nearest")
    expected = 65535 * encoded(decoded(pixels[..., :3] / 65535) * parts)
    np.testing.assert_allclose(dimmed[..., :3], expected, atol=1.5)
    np.testing.assert_array_equal(dimmed[..., 3:], pixels[..., 3:])
    assert np.abs(dimmed[..., :3] - pixels[..., :3].astype(float)).max() > 1000


def test_a_picture_without_colour_loses_luminance() -> None:
    parts = np.random.default_rng(7).random((SIZE[1], SIZE[0], 3))
    pixels = np.full((SIZE[1], SIZE[0]), 0.5, np.float32)
    dimmed = paint(seen(transmission=parts), pixels)
    np.testing.assert_allclose(dimmed, 0.5 * parts @ [0.2126, 0.7152, 0.0722], rtol=1e-6)


def test_the_colour_outside_is_not_dimmed() -> None:
    raymap = seen(transmittance=np.zeros((SIZE[1], SIZE[0])))
    raymap.status[0, 0] = RayStatus.BLOCKED
    painted = paint(raymap, np.full((SIZE[1], SIZE[0], 3), 200, np.uint8), outside=[7, 8, 9])
    assert painted[0, 0].tolist() == [7, 8, 9]
    assert painted[1, 1].tolist() == [0, 0, 0]


@pytest.mark.parametrize("precision", ["single", "double"])
def test_white_seen_through_coloured_glass_is_what_the_glass_lets_through(precision: str) -> None:
    scene = make_scene(
        {"surface": "torus", "absorption": [0.2, 1.0, 4.0]}, effects={"fresnel": True},
        numerics={"precision": precision},
    )  # fmt: skip
    raymap = trace(scene)
    painted = paint(raymap, np.ones((5, 5, 3), np.float32))
    lands = raymap.status == RayStatus.PICTURE
    expected = raymap.transmission * raymap.transmittance[..., None]
    np.testing.assert_allclose(painted[lands], expected[lands], rtol=1e-6)
    through = lands & (raymap.events > 0)
    assert through.sum() > 300
    assert (painted[through][:, 0] > painted[through][:, 2]).all()
