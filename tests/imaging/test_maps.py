from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

import numpy as np
import OpenImageIO
import pytest
from imaging.maps import every_pixel, landing

from lenscl.effects import EFFECTS
from lenscl.errors import ImageError
from lenscl.imaging import draw, paint, read_metadata, read_picture, write_image, write_map
from lenscl.status import RayStatus


@dataclass(frozen=True)
class Scene:
    text: str

    def to_toml(self) -> str:
        return self.text


@dataclass(frozen=True)
class WholeMap:
    st: Any
    status: Any
    events: Any
    origin: Any
    direction: Any
    scene: Scene
    trace_seconds: float
    added: dict[str, Any] = field(default_factory=dict)

    @property
    def jacobian(self) -> Any:
        return self.added["jacobian"]

    @property
    def magnification(self) -> Any:
        return np.abs(np.linalg.det(self.jacobian))

    @property
    def fold(self) -> Any:
        return np.sign(np.linalg.det(self.jacobian)).astype(np.int8)


def some_map(precision: str, seconds: float = 0.1) -> WholeMap:
    rng = np.random.default_rng(0)
    status = np.arange(35, dtype=np.uint8).reshape(5, 7) % len(RayStatus)
    st = rng.uniform(0, 1, (5, 7, 2))
    st[status == RayStatus.OFF_PICTURE] += 3
    st[~np.isin(status, (RayStatus.PICTURE, RayStatus.OFF_PICTURE))] = -1
    origin, direction = rng.normal(size=(2, 5, 7, 3)).astype(precision)
    scene = Scene('n = 1.5\ntitle = "é"\n')
    return WholeMap(st.astype(precision), status, status // 2, origin, direction, scene, seconds)


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_an_st_map_keeps_the_convention(tmp_path, precision):
    raymap = some_map(precision)
    write_map(tmp_path / "m.exr", raymap)
    image = read_picture(tmp_path / "m.exr").pixels
    assert image.dtype == np.float32
    for status in RayStatus:
        here = raymap.status == status
        assert here.sum() == 5
        assert (image[here, 3] == (status == RayStatus.PICTURE)).all()
        if status.lands:
            np.testing.assert_array_equal(image[here, 0], raymap.st[here, 0].astype(np.float32))
            np.testing.assert_allclose(image[here, 1], 1 - raymap.st[here, 1].astype(float), atol=2e-7)
        else:
            assert (image[here, :2] == -1).all()
    assert (image[..., 2] == 0).all()
    assert read_metadata(tmp_path / "m.exr") == {"scene_toml": raymap.scene.to_toml()}


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_an_npz_has_the_attributes_under_their_names(tmp_path, precision):
    raymap = some_map(precision)
    write_map(tmp_path / "m.npz", raymap)
    with np.load(tmp_path / "m.npz", allow_pickle=False) as stored:
        assert set(stored.files) == {"st", "status", "events", "origin", "direction", "scene_toml"}
        for name in ("st", "status", "events", "origin", "direction"):
            np.testing.assert_array_equal(stored[name], getattr(raymap, name))
            assert stored[name].dtype == getattr(raymap, name).dtype
        assert str(stored["scene_toml"]) == raymap.scene.to_toml()


@pytest.mark.parametrize("suffix", ["exr", "npz"])
def test_equal_maps_give_equal_bytes_whatever_they_took(tmp_path, suffix):
    write_map(tmp_path / f"a.{suffix}", some_map("float64", 0.1))
    time.sleep(2.1)  # a zip's clock counts in twos
    write_map(tmp_path / f"b.{suffix}", some_map("float64", 0.2))
    assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()


def test_another_suffix_is_refused_with_the_two_that_are_written(tmp_path):
    with pytest.raises(ImageError, match=r"\.exr .* \.npz"):
        write_map(tmp_path / "m.png", some_map("float32"))
    assert list(tmp_path.iterdir()) == []


def test_another_program_paints_the_st_map_as_we_do(tmp_path, opencl_device):
    """OpenImageIO's st_warp with the written file, flipped in t; away from the border, where its filter differs."""
    width, height = 96, 64
    centre = every_pixel(width, height) - 0.5
    turned = np.stack(
        [centre[..., 0] * 0.8 + centre[..., 1] * 0.2, centre[..., 1] * 0.7 - centre[..., 0] * 0.1], axis=-1
    )
    turned += 0.5 + 0.02 * np.sin(9 * turned[..., ::-1])
    raymap = landing(turned, opencl_device)
    nothing = np.zeros((height, width, 3))
    write_map(tmp_path / "m.exr", WholeMap(raymap.st, raymap.status, raymap.status, nothing, nothing, Scene(""), 0.0))
    pixels = (draw("cat", (160, 120)) / 255).astype(np.float32)
    ours = paint(raymap, pixels)

    source = OpenImageIO.ImageBuf(pixels)
    by_them = {}
    st_map, film = OpenImageIO.ImageBuf(str(tmp_path / "m.exr")), OpenImageIO.ROI(0, width, 0, height)
    for flip_t in (True, False):
        warped = OpenImageIO.ImageBufAlgo.st_warp(source, st_map, "triangle", 2.0, flip_t=flip_t, roi=film)
        assert not warped.has_error, warped.geterror()
        by_them[flip_t] = warped.get_pixels(OpenImageIO.FLOAT)[..., :3]
    inner = (turned > 0.05).all(axis=-1) & (turned < 0.95).all(axis=-1)
    assert inner.sum() > 4000
    difference = np.abs(by_them[True] - ours)[inner]
    assert np.quantile(difference, 0.95) < 0.02, np.quantile(difference, [0.5, 0.9, 0.95, 0.99, 1])
    # The other way up is another picture: the comparison can fail
    assert np.quantile(np.abs(by_them[False] - ours)[inner], 0.5) > 0.05


def some_error(seed: int = 1) -> Any:
    """Bounds from 1e-18 to 1e9, a third of them missing."""
    rng = np.random.default_rng(seed)
    return np.where(rng.random((5, 7)) < 1 / 3, -1.0, 10.0 ** rng.uniform(-18, 9, (5, 7)))


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_a_fifth_channel_bounds_the_error_of_what_an_st_map_stores(tmp_path, precision):
    raymap, error = some_map(precision), some_error()
    write_map(tmp_path / "m.exr", raymap, error)
    write_map(tmp_path / "plain.exr", raymap)
    written = OpenImageIO.ImageBuf(str(tmp_path / "m.exr"))
    assert written.spec().channelnames == ("R", "G", "B", "A", "error")
    assert written.spec().alpha_channel == 3
    image = written.get_pixels(OpenImageIO.FLOAT)
    assert image.dtype == np.float32
    np.testing.assert_array_equal(image[..., :4], read_picture(tmp_path / "plain.exr").pixels)
    stored, has = image[..., 4].astype(np.float64), error >= 0
    np.testing.assert_array_equal(stored[~has], -1.0)
    assert has.sum() > 15
    for row, column in np.argwhere(has & np.isin(raymap.status, (RayStatus.PICTURE, RayStatus.OFF_PICTURE))):
        s, t = (Fraction(float(x)) for x in raymap.st[row, column])
        r, g = (Fraction(float(x)) for x in image[row, column, :2])
        least = Fraction(float(error[row, column])) + max(abs(r - s), abs(g - (1 - t)))
        assert least <= Fraction(float(stored[row, column])) <= least * Fraction(1 + 2**-22) + Fraction(2**-46)
    assert read_metadata(tmp_path / "m.exr") == {"scene_toml": raymap.scene.to_toml()}


def test_an_npz_holds_the_bounds_as_they_are(tmp_path):
    error = some_error()
    write_map(tmp_path / "m.npz", some_map("float32"), error)
    with np.load(tmp_path / "m.npz", allow_pickle=False) as stored:
        assert set(stored.files) == {"st", "status", "events", "origin", "direction", "error", "scene_toml"}
        assert stored["error"].dtype == np.float64
        np.testing.assert_array_equal(stored["error"], error)


@pytest.mark.parametrize("suffix", ["exr", "npz"])
def test_equal_bounds_give_equal_bytes_and_others_do_not(tmp_path, suffix):
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        write_map(tmp_path / f"{name}.{suffix}", some_map("float64"), some_error(seed))
    one, same, other = ((tmp_path / f"{name}.{suffix}").read_bytes() for name in "abc")
    assert one == same != other


def test_a_program_that_warps_by_an_st_map_does_not_mind_the_fifth_channel(tmp_path):
    raymap = some_map("float32")
    for name, error in (("plain", None), ("error", some_error())):
        write_map(tmp_path / f"{name}.exr", raymap, error)
    source = OpenImageIO.ImageBuf((draw("cat", (160, 120)) / 255).astype(np.float32))
    film = OpenImageIO.ROI(0, 7, 0, 5)
    painted = []
    for name in ("plain", "error"):
        st_map = OpenImageIO.ImageBuf(str(tmp_path / f"{name}.exr"))
        warped = OpenImageIO.ImageBufAlgo.st_warp(source, st_map, "triangle", 2.0, flip_t=True, roi=film)
        assert not warped.has_error, warped.geterror()
        painted.append(warped.get_pixels(OpenImageIO.FLOAT))
    np.testing.assert_array_equal(*painted)
    assert painted[0].any()


def test_only_exr_holds_further_channels(tmp_path):
    with pytest.raises(ImageError, match=r"TIFF holds no channel called 'error'; write it as \.exr"):
        write_image(tmp_path / "m.tif", np.zeros((2, 2, 5), np.float32), further=("error",))
    assert list(tmp_path.iterdir()) == []


def test_what_effects_add_is_written_under_its_name(tmp_path):
    rng = np.random.default_rng(8)
    added = {"path_length": rng.random((5, 7)), "transmission": rng.random((5, 7, 3))}
    raymap = replace(some_map("float64"), added=added)
    write_map(tmp_path / "map.npz", raymap)
    with np.load(tmp_path / "map.npz") as stored:
        for name, array in added.items():
            np.testing.assert_array_equal(stored[name], array)
    write_map(tmp_path / "map.exr", raymap, error=np.full((5, 7), 0.5))
    image = OpenImageIO.ImageBuf(str(tmp_path / "map.exr"))
    channels = {name: image.get_pixels(OpenImageIO.FLOAT)[..., i] for i, name in enumerate(image.spec().channelnames)}
    np.testing.assert_array_equal(channels["path_length"], added["path_length"].astype(np.float32))
    for i, part in enumerate("RGB"):
        np.testing.assert_array_equal(
            channels[f"transmission.{part}"], added["transmission"][..., i].astype(np.float32)
        )
    assert (channels["error"] >= 0.5).any()


def test_a_footprint_is_written_with_what_the_map_makes_of_it(tmp_path):
    jacobian = np.random.default_rng(9).normal(size=(5, 7, 2, 2))
    jacobian[0, 0] = 1e30
    raymap = replace(some_map("float64"), added={"jacobian": jacobian})
    write_map(tmp_path / "map.npz", raymap)
    with np.load(tmp_path / "map.npz") as stored:
        for name in ("jacobian", "magnification", "fold"):
            np.testing.assert_array_equal(stored[name], getattr(raymap, name))
            assert stored[name].dtype == getattr(raymap, name).dtype
    write_map(tmp_path / "map.exr", raymap)
    image = OpenImageIO.ImageBuf(str(tmp_path / "map.exr"))
    channels = {name: image.get_pixels(OpenImageIO.FLOAT)[..., i] for i, name in enumerate(image.spec().channelnames)}
    for i, place in enumerate("st"):
        for j, by in enumerate(("row", "column")):
            written = channels[f"jacobian.d{place}_d{by}"]
            np.testing.assert_array_equal(written, jacobian[..., i, j].astype(np.float32))
    np.testing.assert_array_equal(channels["fold"], raymap.fold)
    assert channels["magnification"][0, 0] == np.finfo(np.float32).max
    np.testing.assert_allclose(channels["magnification"].ravel()[1:], raymap.magnification.ravel()[1:], rtol=1e-6)


OUTPUTS = [
    output
    for effect in EFFECTS.values()
    for variants in (*effect.variants.values(), effect.counted)
    for variant in variants
    for output in variant.adds
]


@pytest.mark.parametrize("output", OUTPUTS, ids=lambda output: output.name)
def test_an_st_map_has_a_channel_for_every_number_of_every_effect(output, tmp_path):
    numbers = np.random.default_rng(3).normal(size=(5, 7, *output.pixel_shape))
    raymap = replace(some_map("float64"), added={output.name: numbers})
    write_map(tmp_path / "z.exr", raymap)
    image = OpenImageIO.ImageBuf(str(tmp_path / "z.exr"))
    names, pixels = image.spec().channelnames, image.get_pixels(OpenImageIO.FLOAT)
    own = [place for place, name in enumerate(names) if name.split(".")[0] == output.name]
    assert len(own) == len(output.members)
    found = sorted(pixels[..., place].tobytes() for place in own)
    wanted = np.moveaxis(numbers.reshape(5, 7, -1), 2, 0).astype(np.float32)
    assert found == sorted(part.tobytes() for part in wanted)
