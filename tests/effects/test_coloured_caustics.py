"""Light that coloured glass leaves on the picture: each channel as if it were alone, and painted as such."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import make_scene

from lenscl import trace
from lenscl.effects.colours import LUMINANCE, basis
from lenscl.imaging import light, write_map
from lenscl.imaging.spectrum import spectral_matrices
from lenscl.tracing import RayMap

ABSORBS = (0.2, 0.8, 2.5)
CELLS = (22, 18)


def lit(*absorption: float, columns: int = 24, effects: dict[str, Any] | None = None, **lens: Any) -> RayMap:
    glass = {"surface": "torus", "rotate": [30, 20, 0], "absorption": list(absorption), **lens}
    more = {"caustics": True, "fresnel": True, **(effects or {})}
    return trace(make_scene(glass, film={"size": [columns, columns]}, picture={"size": list(CELLS)}, effects=more))


@pytest.fixture(scope="module")
def amber() -> RayMap:
    return lit(*ABSORBS)


def rgb_of(raymap: RayMap) -> NDArray[np.float64]:
    assert raymap.caustic is not None
    assert raymap.caustic.rgb is not None
    return raymap.caustic.rgb


def test_each_channel_is_what_glass_leaves_that_absorbs_all_alike(amber: RayMap) -> None:
    for channel, absorbs in enumerate(ABSORBS):
        grey = lit(absorbs, absorbs, absorbs)
        np.testing.assert_allclose(rgb_of(amber)[..., channel], grey.irradiance, rtol=1e-9, atol=1e-9)
    red, _, blue = np.moveaxis(rgb_of(amber), -1, 0)
    assert (red - blue).max() > 0.1
    np.testing.assert_allclose(amber.irradiance, rgb_of(amber) @ [0.2126, 0.7152, 0.0722], rtol=1e-12)


def test_shares_count_by_luminance_and_sum_to_1(amber: RayMap) -> None:
    assert amber.caustic is not None
    shares = amber.caustic.shares
    assert sum(shares.values()) == pytest.approx(1.0, abs=1e-12)
    greys = [lit(absorbs, absorbs, absorbs).caustic for absorbs in ABSORBS]
    for end, share in shares.items():
        alone = [grey.shares[end] for grey in greys if grey is not None]
        assert share == pytest.approx(float(LUMINANCE @ alone), abs=1e-9), end
    assert shares["absorbed"] > 0.01


def test_light_that_nothing_colours_has_no_colour_of_its_own() -> None:
    for found in (lit(0, 0, 0), lit(*ABSORBS, effects={"absorption": False})):
        assert found.caustic is not None
        assert found.caustic.rgb is None


def decoded(codes: Any) -> Any:
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float16", "float32", "float64"])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_a_picture_is_lit_colour_by_colour(amber: RayMap, dtype: str, channels: int) -> None:
    is_whole = dtype.startswith("u")
    full = np.iinfo(dtype).max if is_whole else 1.0
    colour = np.array([0.3, 0.2, 0.25] if channels > 2 else [0.25])
    pixel = np.concatenate([colour, np.ones(1 - channels % 2)])
    picture = np.full((4, 5, channels), (pixel * full).astype(dtype))
    painted = light(amber, picture)
    assert painted.dtype == picture.dtype
    assert painted.shape == (*CELLS[::-1], channels)
    shown, stored = painted / full, picture[0, 0] / full
    if channels % 2 == 0:
        np.testing.assert_array_equal(shown[..., -1], 1.0)
    shown, stored = shown[..., : len(colour)], stored[: len(colour)].astype(float)
    gets = rgb_of(amber) if channels > 2 else amber.irradiance[..., None]
    expected = gets * (decoded(stored) if is_whole else stored)
    found = decoded(shown) if is_whole else shown
    is_within = expected < 0.9
    assert is_within.mean() > 0.8
    close = {"uint8": 6e-3, "uint16": 3e-5, "float16": 2e-3, "float32": 1e-6, "float64": 1e-12}[dtype]
    np.testing.assert_allclose(found[is_within], expected[is_within], atol=close, rtol=close)


@pytest.mark.parametrize("asked", ["rgb", 4])
def test_each_wavelength_is_weighed_by_what_the_glass_does_to_it(asked: Any) -> None:
    found = lit(*ABSORBS, columns=8, effects={"dispersion": asked}, surface="sphere", n="SF11")
    rgb = rgb_of(found)
    assert rgb.shape == (3 if asked == "rgb" else 4, *CELLS[::-1], 3)
    weights = np.eye(3) if asked == "rgb" else basis(found.wavelengths)
    np.testing.assert_allclose(found.irradiance, np.einsum("kc,kijc->kij", weights, rgb), rtol=1e-12, atol=1e-14)
    for number, scene in enumerate(found.scene.layers()):
        np.testing.assert_array_equal(rgb_of(trace(scene)), rgb[number])
    picture = np.full((4, 4, 3), [0.1, 0.4, 0.2], np.float32)
    expected = np.einsum("kce,kije->ijc", spectral_matrices(found.wavelengths), rgb * [0.1, 0.4, 0.2])
    np.testing.assert_allclose(light(found, picture), expected, atol=2e-5)


def test_wavelengths_that_go_the_same_way_paint_what_one_does() -> None:
    """Glass of the index around it bends nothing: what it absorbs is of one colour, of however many wavelengths."""
    one, many = (lit(*ABSORBS, columns=12, n=1.0, effects={"dispersion": asked}) for asked in (False, 4))
    picture = np.full((4, 4, 3), [0.3, 0.4, 0.2], np.float32)
    np.testing.assert_allclose(light(many, picture), light(one, picture), atol=1e-5)
    assert np.ptp(light(one, picture) / [0.3, 0.4, 0.2], axis=-1).max() > 0.1


def test_a_file_has_the_light_of_each_channel(amber: RayMap, tmp_path: Any) -> None:
    write_map(tmp_path / "map.npz", amber)
    with np.load(tmp_path / "map.npz") as stored:
        np.testing.assert_array_equal(stored["caustic.rgb"], rgb_of(amber))
        np.testing.assert_array_equal(stored["irradiance"], amber.irradiance)
    write_map(tmp_path / "plain.npz", lit(0, 0, 0))
    with np.load(tmp_path / "plain.npz") as stored:
        assert "caustic.rgb" not in stored
