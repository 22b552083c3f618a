"""Light brighter than white in pictures of whole numbers: its edges have no steps."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import make_scene

from lenscl import trace
from lenscl.imaging import light, painter_of
from lenscl.imaging.encoding import decode, encode
from lenscl.tracing import RayMap, tubes

CELLS, FINER = 64, 6
BALL = {"surface": "sphere", "r": 0.5, "n": 1.5, "centre": [0.1, 0.05, 0.0]}
RING = {"surface": "torus", "R": 0.6, "r": 0.25, "rotate": [60.0, 0.0, 35.0], "n": "water"}


def lit(lens: dict[str, Any], cells: int = CELLS, **effects: Any) -> RayMap:
    picture = {"corner": [-1.2, 1.2, -1.1], "right": [2.4, 0, 0], "down": [0, -2.4, 0], "size": [cells, cells]}
    return trace(make_scene(lens, film={"size": [96, 96]}, picture=picture, effects={"caustics": True, **effects}))


def shown(irradiance: NDArray[np.float64], colour: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return the codes of a picture of one colour in the light of cells, each up to white before the mean is taken."""
    each = np.minimum(irradiance[..., np.newaxis] * decode(colour, "srgb"), 1.0)
    mean = each.reshape(CELLS, FINER, CELLS, FINER, 3).mean(axis=(1, 3))
    return encode(mean, np.dtype(np.uint8), "srgb").astype(float)


def clipped_whole(raymap: RayMap) -> RayMap:
    """Return a map none of whose cells have parts."""
    assert raymap.caustic is not None
    bright = raymap.caustic.bright
    none = replace(bright, cells=bright.cells[:0])
    return replace(raymap, caustic=replace(raymap.caustic, bright=none))


def test_edges_of_white_are_those_of_a_much_finer_picture() -> None:
    colour = np.array([[[244, 120, 30]]], np.uint8)
    found, fine = lit(RING), lit(RING, CELLS * FINER)
    expected = shown(fine.irradiance, colour)
    off, steps = (np.abs(light(each, colour) - expected).max(axis=-1) for each in (found, clipped_whole(found)))
    edge = steps > 24
    assert edge.sum() > 20
    assert off.max() <= 24
    assert off[edge].mean() < 0.25 * steps[edge].mean()


@pytest.mark.parametrize("effects", [{}, {"dispersion": "rgb", "fresnel": True}, {"footprint": True}])
def test_parts_of_bright_cells_have_the_mean_of_the_cell(effects: dict[str, Any]) -> None:
    found = lit({**RING, "n": "SF11"}, **effects)
    assert found.caustic is not None
    bright = found.caustic.bright
    assert len(bright.cells) > 200
    assert (np.diff(bright.cells) > 0).all()
    cells = found.irradiance.reshape(-1, CELLS * CELLS)[:, bright.cells]
    parts = bright.irradiance[..., 0].reshape(len(cells), len(bright.cells), -1)
    np.testing.assert_allclose(parts.mean(axis=-1), cells, rtol=1e-5)
    assert (parts.max(axis=(0, 2)) > 1.0).all()


@pytest.mark.parametrize("effects", [{}, {"dispersion": "rgb"}, {"absorption": True}, {"footprint": True}])
def test_what_stays_below_white_is_the_mean_of_its_light(effects: dict[str, Any]) -> None:
    """A picture so dark that nothing clips: parts change nothing."""
    found = lit({**RING, "n": "BK7", "absorption": [0.3, 0.1, 0.5]}, **effects)
    assert found.caustic is not None
    assert len(found.caustic.bright.cells) > 100
    brightest = max(float(each.max()) for each in (found.irradiance, found.caustic.bright.irradiance))
    assert brightest > 3.0
    painters = [painter_of(each) for each in (found, clipped_whole(found))]
    for channels in (1, 2, 3, 4):
        codes = np.full((2, 3, channels), int(40000 / brightest), np.uint16)
        if channels % 2 == 0:
            codes[..., -1] = [[65535, 30000, 9], [50000, 0, 65535]]
        got, expected = (each.paint(codes, filter="nearest", encoding="linear").astype(int) for each in painters)
        assert expected[..., 0].max() > 5000
        assert np.abs(got - expected).max() <= 1


def test_cells_of_a_very_large_picture_are_told_as_a_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    parted = lit(BALL)
    monkeypatch.setattr(tubes, "_MOST_CELLS", CELLS**2 - 1)
    whole = lit(BALL)
    assert parted.caustic is not None
    assert whole.caustic is not None
    assert len(parted.caustic.bright.cells) > 0
    assert len(whole.caustic.bright.cells) == 0
    np.testing.assert_allclose(whole.irradiance, parted.irradiance, rtol=1e-9, atol=1e-9)
