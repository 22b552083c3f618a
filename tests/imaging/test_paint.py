from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import event, given, settings
from hypothesis import strategies as st
from imaging.devices import faulty
from imaging.maps import HandMadeMap, every_pixel, landing, random_pixels
from thinned import thinned

from lenscl import device
from lenscl.errors import StudyError
from lenscl.imaging import paint, painter_of
from lenscl.imaging.encoding import DTYPES
from lenscl.reference.paint import paint as twin
from lenscl.status import RayStatus

FILTERS = ("nearest", "bilinear", "bicubic")
INTEGERS = ("uint8", "uint16")
# How far the kernel may be from the twin before rounding, in shares of full scale (integers) or of the picture's
# largest value (floats): the arithmetic of its type, with margin for the mixes of 16 samples
SLACK = {"uint8": 2e-6, "uint16": 2e-6, "float16": 6e-4, "float32": 2e-6, "float64": 4e-15}


def kernel_against_twin(
    seed, dtype, channels, filter_name, encoding, picture_size, film_size, precision, painted_on=None
):
    """Paint both ways; return the share of channels that agree, having asserted that none is out of bounds."""
    rng = np.random.default_rng(seed)
    pixels = random_pixels(rng, (picture_size[1], picture_size[0], channels), dtype)
    if encoding == "srgb" and dtype.startswith("float"):  # the curve of a negative overshoot is 13 times steeper
        pixels = np.abs(pixels)
    places = rng.uniform(-0.1, 1.1, (film_size[1], film_size[0], 2))
    raymap = landing(places, painted_on or device.choose(), precision)
    painted = paint(raymap, pixels, filter=filter_name, encoding=encoding)
    assert painted.dtype == pixels.dtype
    assert painted.shape == (film_size[1], film_size[0], channels)
    exact = twin(raymap.st, raymap.status, pixels, filter=filter_name, encoding=encoding)
    # s W is rounded, and the picture may be as steep as it likes
    place_error = float(np.finfo(precision).eps) * max(picture_size)
    return compare(painted, exact, dtype, channels, place_error if filter_name != "nearest" else 0.0)


def compare(painted, exact, dtype, channels, place_error):
    if dtype in INTEGERS:
        most = np.iinfo(dtype).max
        # The curve is 13 times steeper at black; dividing by a small alpha magnifies an error likewise
        slack = np.full(exact.shape, (SLACK[dtype] + 40 * place_error) * most)
        if channels in (2, 4):
            slack[..., :-1] /= np.maximum(exact[..., -1:] / most, 1 / most)
        wrong = np.abs(painted - exact) > 0.5 + slack
        off_grid = np.abs(exact - np.rint(exact))
        decided = off_grid < 0.5 - slack
        assert not wrong.any(), (painted[wrong][:5], exact[wrong][:5])
        assert np.array_equal(painted[decided], np.rint(exact[decided]))
        return int(decided.sum()), exact.size
    scale = max(1.0, float(np.abs(exact).max()))
    np.testing.assert_allclose(
        painted.astype(np.float64), exact, rtol=0, atol=(SLACK[dtype] + 200 * place_error) * scale
    )
    return exact.size, exact.size


# Every two of a type, a number of channels and a filter
DEALT = [
    (dtype, channels, FILTERS[(number + channels) % len(FILTERS)])
    for number, dtype in enumerate(DTYPES)
    for channels in (1, 2, 3, 4)
]


@pytest.mark.parametrize(("dtype", "channels", "filter_name"), thinned(product(DTYPES, (1, 2, 3, 4), FILTERS), DEALT))
def test_the_kernel_paints_what_the_twin_paints(dtype, channels, filter_name):
    for encoding in ("srgb", "linear"):
        decided, total = kernel_against_twin(1, dtype, channels, filter_name, encoding, (37, 23), (61, 17), "float64")
        assert decided > 0.6 * total  # 16 bits beside a small alpha leave the most open


@pytest.mark.parametrize("filter_name", FILTERS)
@pytest.mark.parametrize("dtype", ["uint8", "float32"])
def test_places_in_single_precision_are_painted_likewise(dtype, filter_name):
    decided, total = kernel_against_twin(2, dtype, 3, filter_name, None, (37, 23), (61, 17), "float32")
    assert decided > 0.85 * total


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    dtype=st.sampled_from(DTYPES),
    channels=st.integers(1, 4),
    filter_name=st.sampled_from(FILTERS),
    picture_size=st.tuples(st.integers(1, 9), st.integers(1, 9)),
    film_size=st.tuples(st.integers(1, 40), st.integers(1, 40)),
)
def test_every_shape_of_picture_and_film_is_painted_as_by_the_twin(
    seed, dtype, channels, filter_name, picture_size, film_size
):
    event("picture of one pixel" if picture_size == (1, 1) else "picture of more")
    kernel_against_twin(seed, dtype, channels, filter_name, "linear", picture_size, film_size, "float64")


@pytest.mark.parametrize("filter_name", FILTERS)
@pytest.mark.parametrize("dtype", DTYPES)
def test_a_film_that_sees_the_picture_as_it_is_returns_it(dtype, filter_name, opencl_device):
    rng = np.random.default_rng(3)
    for width, height in [(1, 1), (1, 7), (7, 1), (64, 32)]:
        pixels = random_pixels(rng, (height, width, 3), dtype)
        painted = paint(landing(every_pixel(width, height), opencl_device), pixels, filter=filter_name)
        if filter_name == "nearest" or dtype in INTEGERS or 7 not in (width, height):
            # Powers of two leave no rounding in the place: the samples themselves come back
            np.testing.assert_array_equal(painted, pixels)
        else:
            np.testing.assert_allclose(painted.astype(float), pixels.astype(float), atol=2e-3)


@pytest.mark.parametrize("filter_name", FILTERS)
@pytest.mark.parametrize("dtype", DTYPES)
def test_a_picture_of_one_colour_stays_that_colour(dtype, filter_name, opencl_device):
    rng = np.random.default_rng(4)
    raymap = landing(rng.uniform(0, 1, (40, 40, 2)), opencl_device, "float32")
    painter = painter_of(raymap)
    tried = 0
    for channels in (1, 2, 3, 4):
        for _ in range(10):
            colour = random_pixels(rng, (channels,), dtype)
            painted = painter.paint(np.broadcast_to(colour, (5, 6, channels)), filter=filter_name)
            np.testing.assert_array_equal(painted, np.broadcast_to(colour, painted.shape))
            tried += 1
    assert tried == 40


@pytest.mark.parametrize("encoding", ["srgb", "linear"])
@pytest.mark.parametrize("dtype", INTEGERS)
def test_every_code_survives_decoding_and_encoding(dtype, encoding, opencl_device):
    """One picture a code would take long: a row of codes, each seen exactly at its sample, is the same question."""
    codes = np.arange(np.iinfo(dtype).max + 1, dtype=dtype)
    places = np.stack([(codes.astype(float) + 0.5) / codes.size, np.full(codes.size, 0.5)], axis=-1)[np.newaxis]
    painted = paint(landing(places, opencl_device), codes[np.newaxis, :, np.newaxis], encoding=encoding)
    np.testing.assert_array_equal(painted[0, :, 0], codes)


def test_half_way_between_black_and_white_is_half_the_light(opencl_device):
    raymap = landing(np.array([[[0.5, 0.5]]]), opencl_device)
    pixels = np.array([[[0], [255]]], np.uint8)
    assert paint(raymap, pixels)[0, 0, 0] == 188  # the code whose light is nearest 1/2
    assert paint(raymap, pixels, encoding="linear")[0, 0, 0] == 128
    assert paint(raymap, np.array([[[0.0], [1.0]]], np.float32))[0, 0, 0] == 0.5


def test_the_edges_go_on_outwards(opencl_device):
    raymap = landing(np.array([[[0.0, 0.0], [0.999999, 0.0], [0.0, 0.999999]]]), opencl_device)
    pixels = np.array([[[1.0], [2.0]], [[3.0], [4.0]]])
    np.testing.assert_array_equal(paint(raymap, pixels)[0, :, 0], [1.0, 2.0, 3.0])


def test_what_a_transparent_pixel_hides_does_not_show(opencl_device):
    """Opaque white beside transparent green: every mix is white, more or less transparent."""
    pixels = np.array([[[255, 255, 255, 255], [0, 255, 0, 0]]], np.uint8)
    s = np.linspace(0, 0.999, 101)
    raymap = landing(np.stack([s, np.full_like(s, 0.5)], axis=-1)[np.newaxis], opencl_device)
    for filter_name in ("bilinear", "bicubic"):
        painted = paint(raymap, pixels, filter=filter_name)[0]
        seen = painted[:, 3] > 0
        assert seen.sum() > 60
        assert (painted[seen, :3] == 255).all()
        assert len(set(painted[:, 3])) > 30
        assert (painted[~seen, :3] == [0, 255, 0]).all()
    # The broken way, straight colour mixed as it is, shows green in most of the same places
    straight = paint(raymap, np.ascontiguousarray(pixels[..., :3]), filter=filter_name)[0]
    assert (straight[seen, 0] < 250).sum() > 30


@pytest.mark.parametrize("status", [status for status in RayStatus if status != RayStatus.PICTURE])
def test_a_ray_that_did_not_land_takes_the_colour_outside(status, opencl_device):
    raymap = HandMadeMap(np.full((3, 2, 2), 0.5, np.float32), np.full((3, 2), status, np.uint8), opencl_device)
    for dtype, most in (("uint8", 255), ("uint16", 65535), ("float16", 1), ("float32", 1), ("float64", 1)):
        white = np.full((2, 2, 4), most, dtype)
        for filter_name in FILTERS:
            painted = paint(raymap, white, filter=filter_name, outside=(0, most, 0))
            assert painted.tolist() == np.full((3, 2, 4), (0, most, 0, most)).tolist()
    assert paint(raymap, np.zeros((2, 2, 2), np.uint8), outside=9)[0, 0].tolist() == [9, 255]
    assert paint(raymap, np.zeros((2, 2, 4), np.uint8), outside=(1, 2, 3, 4))[0, 0].tolist() == [1, 2, 3, 4]
    assert paint(raymap, np.zeros((2, 2), np.uint8), outside=(7, 7, 7))[0, 0] == 7


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("dtype", ["float16", "float32", "float64"])
def test_a_pixel_that_is_no_number_spoils_only_what_its_samples_reach(dtype, bad, opencl_device):
    pixels = np.ones((32, 32, 3), dtype)
    pixels[16, 16, 1] = bad
    raymap = landing(every_pixel(128, 128), opencl_device)
    for filter_name, reach in (("nearest", 0.5), ("bilinear", 1), ("bicubic", 2)):
        painted = paint(raymap, pixels, filter=filter_name)
        distance = np.abs(raymap.st * 32 - 16.5).max(axis=-1)
        spoilt = ~np.isfinite(painted[..., 1])
        assert spoilt.sum() >= 16
        assert distance[spoilt].max() < reach
        assert (painted[~spoilt] == 1).all()
        assert np.isfinite(painted[..., [0, 2]]).all()
    seen_exactly = paint(landing(every_pixel(32, 32), opencl_device), pixels)
    assert (~np.isfinite(seen_exactly)).sum() == 1


def test_nearest_copies_the_bits_of_a_pixel(opencl_device):
    bits = np.arange(2**16, dtype=np.uint16).reshape(256, 256, 1)
    painted = paint(landing(every_pixel(256, 256), opencl_device), bits.view(np.float16), filter="nearest")
    np.testing.assert_array_equal(painted.view(np.uint16), bits)


def test_nearest_takes_the_pixel_that_holds_the_place(opencl_device):
    """Half open: s W an exact integer belongs to the pixel on its right, and nothing below 1 falls off."""
    below_1 = np.nextafter(np.float32(1), np.float32(0))
    tried = 0
    for width in (1, 2, 3, 5, 7, 1000, 4096, 16383):
        pixels = np.arange(width, dtype=np.uint16)[np.newaxis, :, np.newaxis]
        for precision in ("float32", "float64"):
            s = np.array([i / width for i in range(min(width, 64))] + [below_1]).astype(precision)
            raymap = landing(np.stack([s, np.zeros_like(s)], axis=-1)[np.newaxis], opencl_device, precision)
            expected = np.floor(s * np.array(width, precision)).clip(0, width - 1)
            np.testing.assert_array_equal(paint(raymap, pixels, filter="nearest")[0, :, 0], expected)
            tried += s.size
    assert tried > 300


def test_bicubic_reproduces_a_straight_ramp_inside(opencl_device):
    """Catmull-Rom weights sum to 1 and have the right first moment; a Mitchell filter or a wrong tap would not pass."""
    ramp = np.arange(32, dtype=np.float64)[np.newaxis, :, np.newaxis] * np.ones((8, 1, 1))
    s = np.linspace(2.5 / 32, 29.5 / 32, 200)
    raymap = landing(np.stack([s, np.full_like(s, 0.5)], axis=-1)[np.newaxis], opencl_device)
    np.testing.assert_allclose(paint(raymap, ramp, filter="bicubic")[0, :, 0], s * 32 - 0.5, atol=1e-12)


def test_one_map_paints_many_pictures(opencl_device):
    rng = np.random.default_rng(5)
    raymap = landing(rng.uniform(0, 1, (9, 13, 2)), opencl_device)
    painter = painter_of(raymap)
    for dtype in DTYPES:
        pixels = random_pixels(rng, (4, 6, 3), dtype)
        for filter_name in FILTERS:
            np.testing.assert_array_equal(
                painter.paint(pixels, filter=filter_name), paint(raymap, pixels, filter=filter_name)
            )


def test_memory_order_and_byte_order_of_the_pixels_do_not_matter(opencl_device):
    rng = np.random.default_rng(6)
    raymap = landing(rng.uniform(0, 1, (9, 13, 2)), opencl_device)
    pixels = random_pixels(rng, (8, 6, 3), "uint16")
    expected = paint(raymap, pixels)
    np.testing.assert_array_equal(paint(raymap, np.asfortranarray(pixels)), expected)
    np.testing.assert_array_equal(paint(raymap, pixels.astype(">u2")), expected)
    np.testing.assert_array_equal(paint(raymap, np.repeat(pixels, 2, axis=0)[::2]), expected)
    np.testing.assert_array_equal(paint(raymap, pixels[..., 0]), paint(raymap, pixels[..., :1])[..., 0])


@pytest.mark.parametrize(
    ("pixels", "arguments", "says"),
    [
        (np.zeros((2, 2, 3), np.int32), {}, "int32"),
        (np.zeros((2, 2, 5), np.uint8), {}, "(2, 2, 5)"),
        (np.zeros((0, 2, 3), np.uint8), {}, "(0, 2, 3)"),
        (np.zeros((2, 2, 3), np.uint8), {"filter": "cubic"}, "bicubic"),
        (np.zeros((2, 2, 3), np.uint8), {"encoding": "rec709"}, "linear"),
        (np.zeros((2, 2, 3), np.uint8), {"outside": 0.5}, "255"),
        (np.zeros((2, 2, 3), np.uint8), {"outside": 256}, "255"),
        (np.zeros((2, 2, 3), np.uint8), {"outside": (1, 2)}, "3 channels"),
        (np.zeros((2, 2), np.uint8), {"outside": (1, 2, 3)}, "1 channels"),
        (np.zeros((2, 2, 3), np.uint8), {"outside": float("nan")}, "nan"),
    ],
)
def test_a_request_that_cannot_be_painted_says_what_can(pixels, arguments, says, opencl_device):
    raymap = landing(every_pixel(2, 2), opencl_device)
    with pytest.raises(StudyError, match=r"^(pixels|filter|encoding|outside): ") as error:
        paint(raymap, pixels, **arguments)
    assert says in str(error.value)


@pytest.mark.parametrize(
    ("fault", "instead", "channels"),
    [
        ("= right - (PLACE)0.5f", "= right", 3),  # samples at i / W
        ("held_within(column, picture->width)", "(column & 31)", 3),  # edges that wrap around
        ("column + tap - BASE", "column + tap - BASE + 1", 3),  # a tap off by one
        ("light_of[*code]", "(*code / (float)FULL_SCALE)", 3),  # encoded numbers taken for light
        ("(pixel + c, light_of) * alpha", "(pixel + c, light_of)", 4),  # straight colour mixed as it is
    ],
)
def test_a_broken_kernel_is_seen(fault, instead, channels, opencl_device):
    broken = faulty(opencl_device, fault, instead)
    with pytest.raises(AssertionError):
        kernel_against_twin(1, "uint8", channels, "bilinear", "srgb", (37, 23), (61, 17), "float64", broken)
    assert broken.built
