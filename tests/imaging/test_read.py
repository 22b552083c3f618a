from __future__ import annotations

import os
import struct
import zlib

import numpy as np
import OpenImageIO
import pytest
from imaging.maps import random_pixels

from lenscl.errors import ImageError
from lenscl.imaging import Picture, read_metadata, read_picture, read_size, write_image

TYPES = {"uint8": "uint8", "uint16": "uint16", "float16": "half", "float32": "float", "float64": "double"}


def save(path, pixels, names=None, config=(), window=None):
    """Write with OpenImageIO itself, by none of our rules."""
    height, width, channels = pixels.shape
    spec = OpenImageIO.ImageSpec(
        width, height, channels, OpenImageIO.TypeDesc(TYPES.get(pixels.dtype.name, pixels.dtype.name))
    )
    if names:
        spec.channelnames = names
        spec.alpha_channel = names.index("A") if "A" in names else -1
    if window:
        spec.x, spec.y, spec.full_x, spec.full_y, spec.full_width, spec.full_height = window
    for name, value in config:
        spec.attribute(name, value)
    output = OpenImageIO.ImageOutput.create(str(path))
    assert output.open(str(path), spec), output.geterror()
    assert output.write_image(pixels)
    assert output.close()
    return path


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize(
    ("suffix", "dtype"),
    [
        ("png", "uint8"),
        ("png", "uint16"),
        ("tif", "uint8"),
        ("tif", "uint16"),
        ("tif", "float32"),
        ("exr", "float16"),
        ("exr", "float32"),
    ],
)
def test_pixels_come_in_as_they_were_stored(tmp_path, suffix, dtype, channels):
    rng = np.random.default_rng(channels)
    names = {1: ("Y",), 2: ("Y", "A"), 3: ("R", "G", "B"), 4: ("R", "G", "B", "A")}[channels]
    config = [("oiio:UnassociatedAlpha", 1)] if dtype.startswith("u") else []
    for width, height in [(1, 1), (1, 9), (9, 1), (13, 7)]:
        pixels = random_pixels(rng, (height, width, channels), dtype)
        picture = read_picture(save(tmp_path / f"p.{suffix}", pixels, names, config))
        np.testing.assert_array_equal(picture.pixels, pixels)
        assert picture.pixels.dtype == dtype
        assert picture.size == (width, height)
        assert picture.encoding == ("srgb" if dtype.startswith("u") else "linear")
        straight = "straight" if dtype.startswith("u") else "associated"
        assert picture.alpha == (straight if channels in (2, 4) else "none")


def test_a_jpeg_comes_in_near_what_went_out(tmp_path):
    smooth = np.broadcast_to(np.linspace(0, 255, 64)[:, None, None], (64, 48, 3)).astype(np.uint8)
    picture = read_picture(save(tmp_path / "p.jpg", smooth))
    assert np.abs(picture.pixels.astype(int) - smooth).max() <= 4


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("suffix", ["tif", "jpg"])
def test_a_stated_orientation_is_carried_out(tmp_path, suffix, orientation):
    pixels = np.zeros((16, 32, 3), np.uint8)
    pixels[:8, :8] = 255
    pixels[8:, 24:] = 128
    path = save(tmp_path / f"p.{suffix}", pixels, config=[("Orientation", orientation), ("CompressionQuality", 100)])
    expected = OpenImageIO.ImageBufAlgo.reorient(OpenImageIO.ImageBuf(str(path))).get_pixels(OpenImageIO.UINT8)
    np.testing.assert_array_equal(read_picture(path).pixels, expected)
    assert (read_picture(path).size == (16, 32)) == (orientation >= 5)
    assert read_size(path) == read_picture(path).size


def test_numbers_that_are_none_stay_in_floats(tmp_path):
    pixels = np.array([[[np.nan], [np.inf], [-np.inf], [1.5]]], np.float32)
    np.testing.assert_array_equal(read_picture(save(tmp_path / "p.exr", pixels, ("Y",))).pixels, pixels)


def test_straight_floats_and_associated_integers_come_to_the_usual_alpha(tmp_path):
    floats = np.array([[[1.0, 0.5, 0.25, 0.5]]], np.float32)
    written = save(tmp_path / "f.tif", floats, config=[("oiio:UnassociatedAlpha", 1)])
    np.testing.assert_array_equal(read_picture(written).pixels, [[[0.5, 0.25, 0.125, 0.5]]])
    codes = np.array([[[100, 50, 0, 128], [0, 0, 0, 0], [255, 9, 0, 255]]], np.uint8)
    written = save(tmp_path / "i.tif", codes)
    np.testing.assert_array_equal(read_picture(written).pixels, [[[199, 100, 0, 128], [0, 0, 0, 0], [255, 9, 0, 255]]])


def test_a_palette_is_spread_out(tmp_path):
    """A PNG of two pixels, written by hand: red and blue out of a palette of two."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", 2, 1, 8, 3, 0, 0, 0))
    body = chunk(b"PLTE", bytes([255, 0, 0, 0, 0, 255])) + chunk(b"IDAT", zlib.compress(bytes([0, 0, 1])))
    (tmp_path / "p.png").write_bytes(b"\x89PNG\r\n\x1a\n" + header + body + chunk(b"IEND", b""))
    assert read_picture(tmp_path / "p.png").pixels.tolist() == [[[255, 0, 0], [0, 0, 255]]]


def test_an_exr_is_placed_in_its_display_window(tmp_path):
    pixels = np.arange(1, 13, dtype=np.float32).reshape(3, 4, 1)
    inside = read_picture(save(tmp_path / "a.exr", pixels, ("Y",), window=(1, 2, 0, 0, 6, 8))).pixels[..., 0]
    assert inside.shape == (8, 6)
    np.testing.assert_array_equal(inside[2:5, 1:5], pixels[..., 0])
    assert np.count_nonzero(inside) == 12
    overscan = read_picture(save(tmp_path / "b.exr", pixels, ("Y",), window=(-1, -1, 0, 0, 2, 2))).pixels[..., 0]
    np.testing.assert_array_equal(overscan, pixels[1:3, 1:3, 0])
    apart = read_picture(save(tmp_path / "c.exr", pixels, ("Y",), window=(50, 50, 0, 0, 5, 5))).pixels
    assert apart.shape == (5, 5, 1)
    assert not apart.any()


def test_of_several_pictures_the_first_is_read(tmp_path):
    path = str(tmp_path / "p.tif")
    specs = tuple(OpenImageIO.ImageSpec(4, 4, 3, "uint8") for _ in range(2))
    output = OpenImageIO.ImageOutput.create(path)
    assert output.open(path, specs)
    assert output.write_image(np.full((4, 4, 3), 7, np.uint8))
    assert output.open(path, specs[1], "AppendSubimage")
    assert output.write_image(np.full((4, 4, 3), 9, np.uint8))
    assert output.close()
    assert (read_picture(path).pixels == 7).all()


@pytest.mark.parametrize("suffix", ["jpg", "png", "tif", "exr"])
def test_a_file_cut_short_is_named_and_never_taken_for_whole(tmp_path, suffix):
    rng = np.random.default_rng(0)
    dtype = "float16" if suffix == "exr" else "uint8"
    whole = save(tmp_path / f"whole.{suffix}", random_pixels(rng, (80, 60, 3), dtype)).read_bytes()
    refused = 0
    for share in (0.02, 0.3, 0.6, 0.9, 0.97):
        cut = tmp_path / f"cut.{suffix}"
        cut.write_bytes(whole[: int(len(whole) * share)])
        with pytest.raises(ImageError) as error:
            read_picture(cut)
        assert str(error.value).startswith(f"{cut}: ")
        refused += 1
    assert refused == 5


def test_what_is_no_picture_is_said_in_plain_words(tmp_path):
    (tmp_path / "text.png").write_text("not a picture")
    (tmp_path / "empty.jpg").touch()
    (tmp_path / "folder.png").mkdir()
    for name, says in {
        "text.png": "is not a picture",
        "empty.jpg": "is an empty file",
        "folder.png": "is a folder",
        "nowhere.png": "cannot be opened",
    }.items():
        with pytest.raises(ImageError, match=says) as error:
            read_picture(tmp_path / name)
        assert str(error.value).startswith(f"{tmp_path / name}: ")
        assert "\n" not in str(error.value)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_without_permission_is_named(tmp_path):
    path = save(tmp_path / "p.png", np.zeros((2, 2, 3), np.uint8))
    path.chmod(0)
    with pytest.raises(ImageError, match="permission"):
        read_picture(path)


def test_channels_and_types_that_are_no_picture_are_refused_by_name(tmp_path):
    zeros = np.zeros((2, 2, 5), np.float32)
    for channels, names in (
        (5, ("R", "G", "B", "A", "Z")),
        (4, ("R", "G", "B", "Z")),
        (3, ("X", "Y", "Z")),
        (2, ("U", "V")),
    ):
        with pytest.raises(ImageError, match=f"{names[-1]}, which are not grey or RGB"):
            read_picture(save(tmp_path / "p.exr", np.ascontiguousarray(zeros[..., :channels]), names))
    for dtype in ("float64", "int16"):
        with pytest.raises(ImageError, match=f"{TYPES.get(dtype, dtype)} numbers; convert it to uint8"):
            read_picture(save(tmp_path / "p.tif", np.zeros((2, 2, 1), dtype)))


def test_a_header_that_promises_too_much_is_refused_before_memory_is_taken(tmp_path):
    """A PNG of 60,000 x 60,000 in a few bytes, and an EXR whose display window is as large."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", 60000, 60000, 8, 2, 0, 0, 0))
    bomb = b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", zlib.compress(bytes(100))) + chunk(b"IEND", b"")
    (tmp_path / "bomb.png").write_bytes(bomb)
    with pytest.raises(ImageError, match=r"bomb\.png: "):
        read_picture(tmp_path / "bomb.png")
    wide = save(tmp_path / "wide.exr", np.zeros((2, 2, 3), np.float32), window=(0, 0, 0, 0, 60000, 60000))
    with pytest.raises(ImageError, match="display window"):
        read_picture(wide)


def test_what_is_no_regular_file_is_refused_without_waiting_for_it(tmp_path):
    os.mkfifo(tmp_path / "pipe.png")  # nobody writes into it: opening it would wait for ever
    for path in (tmp_path / "pipe.png", "/dev/zero"):
        with pytest.raises(ImageError, match="is no regular file"):
            read_picture(path)


@pytest.mark.parametrize(
    "use", [read_picture, read_metadata, lambda path: write_image(path, np.zeros((2, 2, 3), "u1"))]
)
@pytest.mark.parametrize("is_folder", [False, True])
def test_a_name_that_is_not_utf_8_is_refused_in_utf_8(tmp_path, use, is_folder):
    odd = tmp_path / os.fsdecode(b"caf\xe9")
    if is_folder:
        odd.mkdir()
    path = odd / "p.png" if is_folder else odd.with_suffix(".png")
    path.write_bytes(b"x")
    with pytest.raises(ImageError, match="its name is not UTF-8; rename it or its folder") as error:
        use(path)
    assert "caf\\xe9" in str(error.value)
    str(error.value).encode()


@pytest.mark.parametrize("name", ["x" * 300, "a\0b"])
def test_a_name_that_no_file_can_have_is_refused(tmp_path, name):
    for use in (read_picture, lambda path: write_image(path, np.zeros((2, 2, 3), "u1"))):
        with pytest.raises(ImageError, match=r"File name too long|zero byte"):
            use(tmp_path / name / "p.png")
        with pytest.raises(ImageError, match=r"File name too long|zero byte"):
            use(tmp_path / f"{name}.png")


def test_a_digest_tells_pixels_types_and_shapes_apart():
    codes = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    halves = np.arange(24, dtype=np.uint16).reshape(2, 4, 3)
    different = [
        codes, codes + 1, codes.reshape(4, 2, 3), codes.reshape(2, 6, 2), halves, halves.view(np.float16),
        np.zeros((2, 4, 3), np.uint8), np.zeros((2, 3, 4), np.uint8),
    ]  # fmt: skip
    digests = [Picture(pixels, "srgb").digest for pixels in different]
    assert len(set(digests)) == len(different)
    assert Picture(np.asfortranarray(codes), "linear").digest == Picture(codes.copy(), "srgb").digest == digests[0]
