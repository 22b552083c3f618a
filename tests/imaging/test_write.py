from __future__ import annotations

import hashlib
import time
from collections import namedtuple

import numpy as np
import OpenImageIO
import pytest
from imaging.maps import random_pixels

from lenscl.errors import ImageError
from lenscl.imaging import atomic, formats_of, light_of, read_metadata, read_picture, write, write_image
from lenscl.imaging.encoding import encode

PARAMETERS = {
    "lens.r": 0.1,
    "lens.n": 1.458,
    "index": 7,
    "title": 'é "quoted"\nline',
    "at": [0.0, 1.5, -2.0],
    "on": True,
}
HELD = [
    ("png", "uint8"),
    ("png", "uint16"),
    ("jpg", "uint8"),
    ("tif", "uint8"),
    ("tif", "uint16"),
    ("tif", "float32"),
    ("exr", "float16"),
    ("exr", "float32"),
]


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize(("suffix", "dtype"), HELD)
def test_what_is_written_reads_back_the_same_with_its_parameters(tmp_path, suffix, dtype, channels):
    rng = np.random.default_rng(channels)
    for width, height in [(1, 1), (1, 9), (33, 17)]:
        pixels = random_pixels(rng, (height, width, channels), dtype)
        path = tmp_path / f"p.{suffix}"
        write_image(path, pixels, metadata=PARAMETERS)
        assert read_metadata(path) == PARAMETERS
        picture = read_picture(path)
        if suffix == "jpg":
            assert picture.pixels.shape == (height, width, channels - (channels % 2 == 0))
        else:
            np.testing.assert_array_equal(picture.pixels, pixels)
            assert picture.pixels.dtype == dtype
        assert picture.encoding == ("srgb" if dtype.startswith("u") else "linear")
        assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_a_picture_without_parameters_or_channel_axis_is_written(tmp_path):
    write_image(tmp_path / "p.png", np.arange(12, dtype=np.uint8).reshape(3, 4))
    assert read_metadata(tmp_path / "p.png") == {}
    assert read_picture(tmp_path / "p.png").pixels[..., 0].tolist() == np.arange(12).reshape(3, 4).tolist()


@pytest.mark.parametrize(("suffix", "dtype"), [("tif", "float16"), ("tif", "float64"), ("exr", "float64")])
def test_floats_that_a_format_lacks_are_kept_as_single_precision(tmp_path, suffix, dtype):
    pixels = random_pixels(np.random.default_rng(0), (5, 4, 3), dtype)
    write_image(tmp_path / f"p.{suffix}", pixels)
    np.testing.assert_array_equal(read_picture(tmp_path / f"p.{suffix}").pixels, pixels.astype(np.float32))


def test_linear_integers_say_so_where_the_format_can(tmp_path):
    pixels = random_pixels(np.random.default_rng(0), (4, 4, 3), "uint16")
    write_image(tmp_path / "p.png", pixels, encoding="linear")
    assert read_picture(tmp_path / "p.png").encoding == "linear"
    np.testing.assert_array_equal(read_picture(tmp_path / "p.png").pixels, pixels)


def test_equal_runs_give_equal_bytes_and_no_clock(tmp_path):
    rng = np.random.default_rng(1)
    pictures = {(suffix, dtype): random_pixels(rng, (64, 48, 3), dtype) for suffix, dtype in HELD}

    def run(folder):
        folder.mkdir()
        for (suffix, dtype), pixels in pictures.items():
            write_image(folder / f"{dtype}.{suffix}", pixels, metadata=PARAMETERS)
        return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in folder.iterdir()}

    first = run(tmp_path / "a")
    time.sleep(1.1)  # the clock of EXR and TIFF counts whole seconds
    assert run(tmp_path / "b") == first
    assert len(first) == len(HELD)
    year = time.strftime("%Y").encode()
    for path in (tmp_path / "a").iterdir():
        assert b"DateTime" not in path.read_bytes()
        assert b"capDate" not in path.read_bytes()
        assert year + b":" not in path.read_bytes()


def test_an_exr_carries_typed_parameters(tmp_path):
    write_image(tmp_path / "p.exr", np.zeros((2, 2, 3), np.float32), metadata=PARAMETERS | {"compression": "not mine"})
    source = OpenImageIO.ImageInput.open(str(tmp_path / "p.exr"))
    spec = source.spec()
    assert spec.getattribute("lenscl:index") == 7
    assert spec.getattribute("lenscl:lens.n") == pytest.approx(1.458, rel=1e-7)
    assert spec.getattribute("lenscl:at") == (0.0, 1.5, -2.0)
    assert spec.getattribute("lenscl:title") == PARAMETERS["title"]
    assert spec.getattribute("compression") == "zip"
    source.close()


def test_a_jpeg_lays_alpha_over_black_in_linear_light(tmp_path):
    pixels = np.zeros((16, 16, 4), np.uint8)
    pixels[..., :3] = 255
    pixels[..., 3] = 128
    write_image(tmp_path / "p.jpg", pixels)
    assert np.abs(read_picture(tmp_path / "p.jpg").pixels.astype(int) - 188).max() <= 2  # half the light is code 188


@pytest.mark.parametrize(
    ("name", "dtype", "says"),
    [
        ("p.png", "float32", "write it as .tif or .tiff or .exr"),
        ("p.jpg", "uint16", ".png"),
        ("p.exr", "uint8", ".png"),
        ("p.gif", "uint8", ".png, .jpg"),
        ("p", "uint8", ".png, .jpg"),
        ("p.png", "int32", "convert it"),
    ],
)
def test_a_format_that_cannot_hold_the_pixels_is_refused_with_one_that_can(tmp_path, name, dtype, says):
    with pytest.raises(ImageError) as error:
        write_image(tmp_path / name, np.zeros((2, 2, 3), dtype))
    assert str(error.value).startswith(f"{tmp_path / name}: ")
    assert says in str(error.value)
    assert list(tmp_path.iterdir()) == []


def test_metadata_that_would_end_the_process_or_is_no_json_is_refused(tmp_path):
    pixels = np.zeros((8, 8, 3), np.uint8)
    long = {"k": "x" * 70_000}  # libjpeg exits on a marker longer than 64 KiB
    with pytest.raises(ImageError, match=r"\.png, \.tif or \.exr"):
        write_image(tmp_path / "p.jpg", pixels, metadata=long)
    write_image(tmp_path / "p.png", pixels, metadata=long)
    assert read_metadata(tmp_path / "p.png") == long
    for bad in ({"k": float("nan")}, {"k": object()}):
        with pytest.raises(ImageError, match="JSON"):
            write_image(tmp_path / "q.png", pixels, metadata=bad)
    assert [p.name for p in tmp_path.iterdir()] == ["p.png"]


def test_numpy_values_are_written_as_plain_ones(tmp_path):
    metadata = {"a": np.float64(0.1), "b": np.int32(3), "c": np.arange(3.0), "d": np.bool_(True)}
    for suffix, dtype in (("png", "uint8"), ("exr", "float32")):
        write_image(tmp_path / f"p.{suffix}", np.zeros((2, 2, 3), dtype), metadata=metadata)
        assert read_metadata(tmp_path / f"p.{suffix}") == {"a": 0.1, "b": 3, "c": [0.0, 1.0, 2.0], "d": True}


def fail_with(error):
    def failing(*_args, **_kwargs):
        raise error

    return failing


@pytest.mark.parametrize("step", ["_write", "_verify"])
@pytest.mark.parametrize(
    "error", [ImageError("p: broken"), KeyboardInterrupt(), OSError(28, "No space left on device")]
)
def test_whatever_goes_wrong_nothing_half_written_is_left(tmp_path, monkeypatch, step, error):
    path = tmp_path / "p.png"
    old = np.full((4, 4, 3), 9, np.uint8)
    write_image(path, old)
    real = getattr(write, step)

    def half_way(*arguments):
        real(*arguments)
        raise error

    monkeypatch.setattr(write, step, half_way)
    with pytest.raises((ImageError, KeyboardInterrupt)):
        write_image(path, np.zeros((4, 4, 3), np.uint8))
    assert [p.name for p in tmp_path.iterdir()] == ["p.png"]
    assert (read_picture(path).pixels == old).all()


@pytest.mark.parametrize(("suffix", "dtype"), HELD)
def test_a_file_that_lost_its_end_is_noticed_before_it_gets_its_name(tmp_path, monkeypatch, suffix, dtype):
    real = write._write

    def lossy(file, temporary, spec, image):
        real(file, temporary, spec, image)
        whole = temporary.read_bytes()
        temporary.write_bytes(whole[: int(len(whole) * 0.7)])

    monkeypatch.setattr(write, "_write", lossy)
    pixels = random_pixels(np.random.default_rng(2), (64, 64, 3), dtype)
    with pytest.raises(ImageError, match="does not read back"):
        write_image(tmp_path / f"p.{suffix}", pixels)
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_seen_before_writing(tmp_path, monkeypatch):
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(atomic.shutil, "disk_usage", lambda _: usage(10**9, 10**9, 5 * 10**6))
    monkeypatch.setattr(write, "_write", fail_with(AssertionError("must not be reached")))
    with pytest.raises(ImageError, match="make room"):
        write_image(tmp_path / "p.jpg", np.zeros((1000, 1000, 3), np.uint8))


def test_a_missing_folder_or_a_folder_in_the_way_is_named(tmp_path):
    (tmp_path / "p.png").mkdir()
    pixels = np.zeros((2, 2, 3), np.uint8)
    with pytest.raises(ImageError, match="is a folder"):
        write_image(tmp_path / "p.png", pixels)
    with pytest.raises(ImageError, match="there is no folder"):
        write_image(tmp_path / "nowhere" / "p.png", pixels)


def test_integers_become_linear_light_that_keeps_every_code_apart():
    codes = np.arange(256, dtype=np.uint8).reshape(1, 256, 1)
    for encoding in ("srgb", "linear"):
        light = light_of(codes, encoding)
        assert light.dtype == np.float16
        assert len(np.unique(light)) == 256
        np.testing.assert_array_equal(encode(light.astype(np.float64), np.uint8, encoding), codes)
    every = np.arange(65536, dtype=np.uint16).reshape(256, 256, 1)
    light = light_of(every, "srgb")
    assert light.dtype == np.float32
    np.testing.assert_array_equal(encode(light.astype(np.float64), np.uint16, "srgb"), every)


def test_light_of_integers_is_multiplied_by_its_alpha():
    light = light_of(np.array([[[255, 0, 255, 51], [255, 255, 255, 0]]], np.uint8), "srgb")
    np.testing.assert_allclose(light, [[[0.2, 0, 0.2, 0.2], [0, 0, 0, 0]]], rtol=1e-3)


def test_the_formats_that_hold_a_type_are_named():
    assert formats_of(np.uint8) == ("png", "jpg", "tif")
    assert formats_of(np.uint16) == ("png", "tif")
    assert formats_of(np.float32) == ("tif", "exr")
