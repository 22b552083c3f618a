"""A picture on a device: what goes up, when, how often, and what a cache of such pictures holds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from imaging.devices import counting
from imaging.maps import landing, random_pixels

from lenscl.device import Device
from lenscl.imaging import DevicePicture, PictureCache, film_of, paint, paint_film
from lenscl.imaging.encoding import Encoding, light_dtype, linear_light

SHAPE = (9, 14, 4)


def places(seed: int = 1) -> Any:
    return np.random.default_rng(seed).uniform(-0.1, 1.1, (7, 8, 2))


def pixels_of(dtype: str = "uint8", seed: int = 0) -> Any:
    return random_pixels(np.random.default_rng(seed), SHAPE, dtype)


def on_host(device: Device, picture: DevicePicture, *, has_levels: bool) -> Any:
    light = np.empty(SHAPE, light_dtype(picture.pixels.dtype))
    device.download(picture.light(has_levels=has_levels), light)
    return light


def test_a_picture_goes_up_once_for_many_films(opencl_device: Device) -> None:
    device = counting(opencl_device)
    picture = DevicePicture.of(device, pixels_of())
    films = [film_of(landing(places(seed), device)) for seed in range(3)]
    for film in films:
        for filter_name in ("nearest", "bilinear", "bicubic"):
            expected = paint(landing(film.layers[0].samples.st, opencl_device), picture.pixels, filter=filter_name)
            np.testing.assert_array_equal(paint_film(film, picture, filter=filter_name), expected)
    ups = [shape for shape, _ in device.uploads]
    assert ups.count(SHAPE) == 1
    assert ups.count((7, 8, 2)) == ups.count((7, 8)) == 3
    assert ups.count((1, 1, 4)) == 9  # the colour outside, once a painting
    # Beside those only the tables of the curve, once a device
    assert len(ups) == 1 + 2 * 3 + 9 + 2


@pytest.mark.parametrize("encoding", ["srgb", "linear"])
@pytest.mark.parametrize("dtype", ["uint8", "uint16"])
def test_light_on_the_device_is_that_of_the_host_bit_for_bit(
    dtype: str, encoding: Encoding, opencl_device: Device
) -> None:
    picture = DevicePicture.of(opencl_device, pixels_of(dtype), encoding)
    expected = linear_light(picture.pixels, encoding)
    assert expected.dtype == np.float32
    for has_levels in (False, True):
        np.testing.assert_array_equal(on_host(opencl_device, picture, has_levels=has_levels), expected)
    assert np.unique(expected[..., :3]).size > 50


def test_linear_floats_are_their_own_light(opencl_device: Device) -> None:
    for dtype in ("float32", "float64"):
        picture = DevicePicture.of(opencl_device, pixels_of(dtype))
        assert picture.linear is picture
        assert picture.light(has_levels=False) is picture.stored
        np.testing.assert_array_equal(on_host(opencl_device, picture, has_levels=True), picture.pixels)
    half = DevicePicture.of(opencl_device, pixels_of("float16"))
    assert half.linear is not half
    assert half.linear is half.linear
    np.testing.assert_array_equal(on_host(opencl_device, half, has_levels=False), half.pixels.astype(np.float32))


def test_a_pyramid_takes_the_place_of_the_light_without_levels(opencl_device: Device) -> None:
    picture = DevicePicture.of(opencl_device, pixels_of())
    pixels = picture.pixels.nbytes
    assert picture.nbytes == pixels  # nothing is on the device yet
    flat = picture.light(has_levels=False)
    assert picture.light(has_levels=False) is flat
    assert picture.nbytes == 2 * pixels + 4 * pixels
    pyramid = picture.light(has_levels=True)
    assert pyramid is not flat
    assert picture.light(has_levels=False) is picture.light(has_levels=True) is pyramid
    levels = [9 * 14, 5 * 7, 3 * 4, 2 * 2, 1]
    assert picture.nbytes == 2 * pixels + sum(levels) * 4 * 4


def test_a_cache_gives_the_same_picture_for_the_same_content(opencl_device: Device) -> None:
    cache = PictureCache(opencl_device)
    made = []

    def get(content: str, encoding: str | None = None) -> DevicePicture:
        return cache.get(content, lambda: made.append(content) or pixels_of(), encoding)  # type: ignore[func-returns-value]

    first = get("a")
    assert get("a") is first
    assert get("b") is not first
    assert get("a", "linear") is not first
    assert get("a") is first
    assert made == ["a", "b", "a"]
    assert len(cache) == 3


def test_a_cache_lets_go_what_was_used_longest_ago(opencl_device: Device) -> None:
    each = 6 * pixels_of().nbytes  # on the host, and as pixels and light on the device
    cache = PictureCache(opencl_device, most_bytes=3 * each)
    film = film_of(landing(places(), opencl_device))
    made: list[int] = []

    def painted(number: int) -> Any:
        def pixels() -> Any:
            made.append(number)
            return pixels_of(seed=number)

        return paint_film(film, cache.get(number, pixels))

    wanted = {number: painted(number) for number in (1, 2, 3)}
    assert cache.nbytes == 3 * each
    painted(1)  # so 2 is the one used longest ago
    painted(4)
    for number in (1, 3, 4):
        painted(number)
    assert made == [1, 2, 3, 4]
    np.testing.assert_array_equal(painted(2), wanted[2])
    assert made == [1, 2, 3, 4, 2]
    assert cache.nbytes <= 4 * each  # the one in use comes on top


def test_a_picture_larger_than_the_cache_is_painted_and_let_go_for_the_next(opencl_device: Device) -> None:
    cache = PictureCache(opencl_device, most_bytes=1)
    film = film_of(landing(places(), opencl_device))
    for number in (1, 2):
        picture = cache.get(number, lambda number=number: pixels_of(seed=number))  # type: ignore[misc]
        np.testing.assert_array_equal(
            paint_film(film, picture), paint(landing(places(), opencl_device), pixels_of(seed=number))
        )
        assert len(cache) == 1


def test_a_constant_goes_up_once_and_has_to_be_read_only(opencl_device: Device) -> None:
    device = counting(opencl_device)
    table = np.arange(5.0)
    with pytest.raises(ValueError, match="read-only"):
        device.constant(table)
    table.setflags(write=False)
    assert device.constant(table) is device.constant(table)
    assert device.uploads == [((5,), "float64")]
