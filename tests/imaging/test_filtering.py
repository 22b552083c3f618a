"""Pictures that are filtered by footprints: against the same probes made by hand, and against many rays a pixel."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from imaging.devices import faulty
from imaging.maps import HandMadeMap, every_pixel, landing, random_pixels
from numpy.typing import NDArray
from scenes import make_scene
from thinned import thinned

from lenscl import RayStatus, paint, trace
from lenscl.device import Device, choose
from lenscl.reference.paint import paint as twin

FILTERS = ("nearest", "bilinear", "bicubic")
FILM = (12, 9)
Array = NDArray[Any]


def seen(jacobian: Array, precision: str = "float64", device: Device | None = None) -> HandMadeMap:
    """A map of places all over the picture, with the footprints given."""
    places = np.random.default_rng(3).uniform(0, 1, (FILM[1], FILM[0], 2))
    return replace(landing(places, device or choose(), precision), added={"jacobian": jacobian.astype(precision)})


def random_footprints(rng: np.random.Generator, size: tuple[int, int], longest: float) -> Array:
    """Footprints of steps up to so many picture pixels long, of all sizes, slants and flatnesses."""
    lengths = np.exp(rng.uniform(np.log(0.05), np.log(longest), (FILM[1], FILM[0], 1, 2)))
    turns = rng.uniform(0, 2 * np.pi, (FILM[1], FILM[0], 2))
    steps = lengths * np.stack([np.cos(turns), np.sin(turns)], axis=-2)
    found: Array = steps / np.array(size)[:, np.newaxis]
    return found


def by_hand(raymap: HandMadeMap, pixels: Array, filter_name: str) -> tuple[Array, Array]:
    """Return the mean of a footprint's probes, each painted by the twin on its level, and the levels taken.

    The narrow side comes from numpy's singular values, the levels from means of blocks.
    """
    height, width, channels = pixels.shape
    painted = np.zeros((*raymap.status.shape, channels))
    levels = np.zeros(raymap.status.shape, int)
    for at in np.ndindex(raymap.status.shape):
        steps = np.array([[width], [height]]) * raymap.added["jacobian"][at]
        narrow, longest = np.linalg.svd(steps)[1][1], np.linalg.norm(steps, axis=0).max()
        deepest = int(np.ceil(np.log2(max(width, height))))
        level = next(k for k in range(deepest + 1) if k == deepest or (narrow < 8 * 2**k and longest <= 16 * 2**k))
        levels[at] = level
        rows, columns = (probes(length / 2**level) for length in np.linalg.norm(steps, axis=0))
        u, v = np.meshgrid((np.arange(rows) + 0.5) / rows - 0.5, (np.arange(columns) + 0.5) / columns - 0.5)
        place = raymap.st[at] * (width, height) + u.reshape(-1, 1) * steps[:, 0] + v.reshape(-1, 1) * steps[:, 1]
        coarse = block_means(pixels, 2**level)
        # A place on the far edge itself is on the last pixel
        st = np.clip(place, 0, (width, height)) / 2**level / (coarse.shape[1], coarse.shape[0])
        light = twin(np.minimum(st, 1 - 1e-12), np.zeros(len(st), np.uint8), coarse, filter=filter_name)
        painted[at] = light.mean(axis=0)
    return painted, levels


def probes(length: float) -> int:
    return int(np.clip(max(min(np.ceil(2 * length), 8), np.ceil(length)), 1, 16))


def block_means(pixels: Array, side: int) -> Array:
    """Return the means of blocks of a picture, its edges repeated outwards at every halving."""
    while side > 1:
        pixels = np.pad(pixels, [(0, pixels.shape[0] % 2), (0, pixels.shape[1] % 2), (0, 0)], mode="edge")
        pixels = (pixels[::2, ::2] + pixels[1::2, ::2] + pixels[::2, 1::2] + pixels[1::2, 1::2]) / 4
        side //= 2
    return pixels


@pytest.mark.parametrize(
    ("filter_name", "precision"), [(each, "float64") for each in FILTERS] + [("bilinear", "float32")]
)
def test_a_colour_is_the_mean_of_the_footprints_probes(filter_name: str, precision: str) -> None:
    compare_with_probes(filter_name, precision, choose())


def compare_with_probes(filter_name: str, precision: str, device: Device) -> None:
    rng = np.random.default_rng(11)
    levels_seen = set()
    for size, longest in (((37, 23), 60.0), ((64, 64), 250.0), ((1, 9), 5.0), ((100, 3), 200.0)):
        pixels = rng.random((size[1], size[0], 3)).astype(precision)
        raymap = seen(random_footprints(rng, size, longest), precision, device)
        expected, levels = by_hand(raymap, pixels.astype(np.float64), filter_name)
        levels_seen |= set(levels.ravel().tolist())
        off = np.abs(paint(raymap, pixels, filter=filter_name) - expected).max(axis=-1)
        if precision == "float64" and filter_name != "nearest":
            assert off.max() < 1e-11
        else:  # a probe on a boundary of pixels may round to either side
            assert np.median(off) < 1e-6
            assert (off < 1e-4).mean() > 0.95
    assert set(range(5)) <= levels_seen


@pytest.mark.parametrize("filter_name", FILTERS)
def test_a_footprint_of_half_a_pixel_is_a_point(filter_name: str) -> None:
    rng = np.random.default_rng(12)
    for dtype, channels in (("uint8", 3), ("float32", 4)):
        pixels = random_pixels(rng, (23, 37, channels), dtype)
        small = random_footprints(rng, (37, 23), 0.5)
        assert np.linalg.norm(small * [[37], [23]], axis=2).max() > 0.4
        for jacobian in (small, 0 * small):
            raymap = seen(jacobian)
            plain = paint(replace(raymap, added={}), pixels, filter=filter_name)
            np.testing.assert_array_equal(paint(raymap, pixels, filter=filter_name), plain)


@pytest.mark.parametrize(("dtype", "filter_name"), thinned(
    [(dtype, name) for dtype in ("uint8", "uint16", "float16", "float32", "float64") for name in FILTERS],
    [("uint8", "bilinear"), ("uint16", "nearest"), ("float16", "bicubic"), ("float64", "bilinear")],
))  # fmt: skip
def test_a_picture_of_one_colour_stays_that_colour(dtype: str, filter_name: str) -> None:
    rng = np.random.default_rng(13)
    raymap = seen(random_footprints(rng, (37, 23), 200.0))
    for channels in (1, 4):
        colour = random_pixels(rng, (channels,), dtype)
        if channels == 4 and dtype.startswith("uint"):
            colour[3] = np.iinfo(dtype).max
        painted = paint(raymap, np.broadcast_to(colour, (23, 37, channels)), filter=filter_name)
        np.testing.assert_array_equal(painted, np.broadcast_to(colour, painted.shape))


def test_codes_are_averaged_as_the_light_they_stand_for_and_by_their_alpha() -> None:
    """Half black, half white is sRGB 188; a hidden colour does not show; footprints over all of the picture."""
    jacobian = np.broadcast_to(np.eye(2)[::-1], (FILM[1], FILM[0], 2, 2)).copy()
    raymap = seen(jacobian)
    raymap.st[...] = 0.5
    stripes = np.zeros((64, 64, 4), np.uint8)
    stripes[:, ::2] = [255, 255, 255, 255]
    stripes[:, 1::2, 3] = 255
    assert (paint(raymap, stripes) == [188, 188, 188, 255]).all()
    stripes[:, 1::2] = [255, 0, 0, 0]
    painted = paint(raymap, stripes)
    assert (painted[..., :3] == 255).all()
    assert (np.abs(painted[..., 3].astype(int) - 128) <= 1).all()


def test_footprints_that_reach_beyond_see_the_edge_go_on_and_misses_see_the_outside() -> None:
    jacobian = np.broadcast_to(np.array([[0.0, 1e30], [1e30, 0.0]]), (FILM[1], FILM[0], 2, 2)).copy()
    raymap = seen(jacobian)
    raymap.status[0, 0] = RayStatus.OFF_PICTURE
    ramp = np.broadcast_to(np.linspace(0, 1, 32)[:, np.newaxis], (32, 32, 1)).copy()
    painted = paint(raymap, ramp, outside=7.0)
    assert painted[0, 0, 0] == 7.0
    assert np.isfinite(painted).all()
    rest = painted.ravel()[1:]
    assert (np.abs(rest - 0.5) < 0.3).all()  # half and half of either end, more or less


def test_what_gets_through_dims_the_mean() -> None:
    rng = np.random.default_rng(14)
    raymap = seen(random_footprints(rng, (37, 23), 60.0))
    share, pixels = rng.random((FILM[1], FILM[0])), rng.random((23, 37, 3))
    dimmed = paint(replace(raymap, added={**raymap.added, "transmittance": share}), pixels)
    np.testing.assert_allclose(dimmed, share[..., None] * paint(raymap, pixels), rtol=1e-12)


def test_a_map_without_footprints_is_painted_by_a_text_without_them() -> None:
    texts = []
    for has_footprints in (False, True):
        device = faulty(choose(), "kernel void paint", "kernel void paint")
        raymap = seen(random_footprints(np.random.default_rng(1), (5, 4), 9.0), device=device)
        paint(raymap if has_footprints else bare(raymap), np.zeros((4, 5, 3), np.uint8))
        texts += device.built
    without, filtered = texts
    for word in ("jacobian", "level_of", "MOST_PROBES"):
        assert word in filtered
        assert word not in without


@pytest.mark.parametrize(
    ("fault", "instead"),
    [
        ("jacobian[2] * height", "jacobian[1] * height"),  # rows and columns mixed up
        ("(PLACE)0.5f) / rows - (PLACE)0.5f", "(PLACE)0.5f) / rows"),  # a footprint beside its place
        ("x_held / size", "x_held"),  # a place of the picture taken for one of its level
        ("* (WORK)0.25f", "* (WORK)0.5f"),  # a mean of four that is none
        ("level.width * level.height * CHANNELS", "level.width * level.height"),  # levels within each other
        ("MOST_ACROSS * size", "4 * size"),  # a coarser level than need be
    ],
)
def test_a_broken_filter_is_seen(fault: str, instead: str) -> None:
    broken = faulty(choose(), fault, instead)
    with pytest.raises(AssertionError):
        compare_with_probes("bilinear", "float64", broken)
    assert broken.built


SIDE, RAYS = 48, 16  # of the film in pixels; of rays a pixel in either direction
LENSES: dict[str, dict[str, Any]] = {
    "torus": {"surface": "torus", "rotate": [20, 30, 0]},
    "sphere": {"surface": "sphere", "r": 0.7},
    "lens": {"surface": "ellipsoid", "a": 0.6, "b": 0.5, "c": 0.3},
}


def patterns(size: int) -> dict[str, Array]:
    """Return pictures with more in them than a film pixel can show: the waves of the zone plate get ever shorter."""
    i, j = np.indices((size, size))
    x, y = (j + 0.5) / size - 0.5, (i + 0.5) / size - 0.5
    found = {f"checkers {side}": ((i // side + j // side) % 2).astype(np.float32) for side in (2, 8, 32)}
    return found | {"zone plate": (0.5 + 0.5 * np.cos(np.pi * size * (x * x + y * y))).astype(np.float32)}


@pytest.mark.parametrize(("lens", "precision"), thinned(
    [(lens, precision) for lens in LENSES for precision in ("double", "single")],
    [("torus", "double"), ("lens", "single")],
))  # fmt: skip
def test_a_filtered_pixel_is_what_256_rays_see(lens: str, precision: str) -> None:
    """Root mean squares over the pixels within the lens whose rays all take one path.

    The largest is 0.05 of white, and at least six times less than that of a single place a pixel.
    """
    scene = make_scene(LENSES[lens], effects={"footprint": True}, film={"size": [SIDE, SIDE]},
                       numerics={"precision": precision})  # fmt: skip
    raymap = trace(scene)
    fine = trace(scene.replace({"film.size": [SIDE * RAYS, SIDE * RAYS], "effects.footprint": False}))
    events, status = (blocks(each) for each in (fine.events, fine.status))
    alike = (events == events[..., :1]).all(axis=-1) & (status == RayStatus.PICTURE).all(axis=-1)
    alike &= (raymap.events > 0) & (raymap.status == RayStatus.PICTURE)
    assert alike.sum() > 100
    for name, picture in patterns(512).items():
        true = blocks(paint(fine, picture)).mean(axis=-1)[alike]
        filtered, point = (rms(paint(each, picture)[alike] - true) for each in (raymap, bare(raymap)))
        assert filtered < 0.05, name
        assert filtered < point / 6, name


def bare(raymap: Any) -> HandMadeMap:
    return HandMadeMap(raymap.st, raymap.status, raymap.device)


def blocks(fine: Array) -> Array:
    """Return the values of each film pixel's rays along the last axis."""
    return fine.reshape(SIDE, RAYS, SIDE, RAYS).swapaxes(1, 2).reshape(SIDE, SIDE, RAYS * RAYS)


def rms(errors: Array) -> float:
    return float(np.sqrt((errors.astype(np.float64) ** 2).mean()))


def test_a_film_that_sees_the_picture_as_it_is_is_hardly_softened() -> None:
    """A footprint of exactly one picture pixel: four probes a quarter of a pixel off, so no more than that is mixed."""
    size = (16, 12)
    pixels = np.random.default_rng(15).random((12, 16, 1))
    jacobian = np.broadcast_to(np.array([[0.0, 1 / 16], [1 / 12, 0.0]]), (12, 16, 2, 2))
    raymap = replace(landing(every_pixel(*size), choose()), added={"jacobian": jacobian})
    near = np.pad(pixels, [(1, 1), (1, 1), (0, 0)], mode="edge")
    rows = 0.75 * near[1:-1] + 0.125 * (near[:-2] + near[2:])
    expected = 0.75 * rows[:, 1:-1] + 0.125 * (rows[:, :-2] + rows[:, 2:])
    np.testing.assert_allclose(paint(raymap, pixels), expected, atol=1e-14)
