"""Effects where solids touch or lie in one another: plane layers, whose closed form is Snell's and Fresnel's laws.

The layers are written twice, as slabs that touch, and as a slab that holds one and shares a face with another. The
picture lies behind them all, on a common face of two, or within one.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from probe import plain_device
from scenes import make_scene

from lenscl import RayStatus, refractive_index, trace
from lenscl.config import Scene
from lenscl.tracing import RayMap

Array = NDArray[np.float64]
FACES = (0.6, 0.2, -0.3, -0.6)
GLASSES = ("BK7", "SF11", "water")
ABSORBED = ((0.2, 0.4, 0.1), (0.5, 0.1, 0.9), (0.3, 0.3, 0.0))
SOURCE = np.array([0.1, -0.2, 3.0])
LINES = [450.0, 550.0, 650.0]
BOX = {"surface": "max(abs(x) - w, abs(y) - w, abs(z) - h)", "bounds": [[-2.5] * 3, [2.5] * 3]}
PICTURES = {"behind all": -1.0, "on a common face": -0.3, "within a layer": 0.05}
WRITTEN = pytest.mark.parametrize("written", ["touching", "nested"])
WHERE = pytest.mark.parametrize("where", PICTURES)


def layers(written: str) -> list[dict[str, Any]]:
    """Return three solids that make three layers; nested, the first is everywhere and the others take their parts."""
    spans = list(pairwise(FACES))
    if written == "nested":
        spans[0] = (FACES[0], FACES[-1])
    return [
        BOX | {"name": f"l{i}", "n": GLASSES[i], "absorption": list(ABSORBED[i]), "w": 2.0 - 0.1 * i,
               "h": (high - low) / 2, "centre": [0.0, 0.0, (high + low) / 2]}
        for i, (high, low) in enumerate(spans)
    ]  # fmt: skip


def scene_of(written: str, z: float, size: int = 7, **more: Any) -> Scene:
    """Return a scene of the layers and a picture at a height; `absorbs = False` leaves absorption out."""
    effects, tables = more.pop("effects"), layers(written)
    if not more.pop("absorbs", True):
        tables = [{key: value for key, value in table.items() if key != "absorption"} for table in tables]
    return make_scene(
        *tables,
        source=more.pop("source", {"kind": "point", "at": SOURCE.tolist()}),
        film={"centre": [0.0, 0.0, 2.0], "right": [0.8, 0.0, 0.0], "down": [0.0, -0.8, 0.0], "size": [size, size]},
        picture={"centre": [0.0, 0.0, z], "right": [4.0, 0, 0], "down": [0, -4.0, 0], **more.pop("picture", {})},
        effects=effects, **more,
    )  # fmt: skip


@dataclass(frozen=True)
class Known:
    """What the laws say of rays, by film pixel: shapes (rows, columns, ...)."""

    st: Array
    path: Array
    transmission: Array
    s: Array  # power of s-polarised light that every face lets through
    p: Array
    unpolarised: Array
    events: int


def known(z: float, rows: Array, columns: Array, size: int, n: tuple[float, float, float]) -> Known:
    """Return it for film pixels with fractional coordinates."""
    x, y = 0.8 * ((columns + 0.5) / size - 0.5), -0.8 * ((rows + 0.5) / size - 0.5)
    ahead = np.stack([x - SOURCE[0], y - SOURCE[1], np.full_like(x, 2.0 - SOURCE[2])], axis=-1)
    across, down = ahead[..., :2], -ahead[..., 2]
    rho = np.linalg.norm(across, axis=-1)
    sine = rho / np.hypot(rho, down)
    heights = [SOURCE[2], *FACES, -np.inf]
    indices = [1.0, *n, 1.0]
    aside, path, depth = np.zeros_like(sine), np.zeros_like(sine), np.zeros((*sine.shape, 3))
    s, p, unpolarised, events = np.ones_like(sine), np.ones_like(sine), np.ones_like(sine), 0
    for i, (high, low) in enumerate(pairwise(heights)):
        cosine = np.sqrt(1.0 - (sine / indices[i]) ** 2)
        thick = high - max(low, z)
        aside += thick * (sine / indices[i]) / cosine
        path += indices[i] * thick / cosine
        if 1 <= i <= 3:
            depth += np.asarray(ABSORBED[i - 1]) * (thick / cosine)[..., None]
        if z >= low:
            break
        behind = np.sqrt(1.0 - (sine / indices[i + 1]) ** 2)
        a, b = indices[i], indices[i + 1]
        rs = ((a * cosine - b * behind) / (a * cosine + b * behind)) ** 2
        rp = ((b * cosine - a * behind) / (b * cosine + a * behind)) ** 2
        s, p, unpolarised, events = s * (1 - rs), p * (1 - rp), unpolarised * (1 - (rs + rp) / 2), events + 1
    place = SOURCE[:2] + across * (aside / np.where(rho > 0, rho, 1.0))[..., None]
    st = np.stack([place[..., 0] / 4.0 + 0.5, 0.5 - place[..., 1] / 4.0], axis=-1)
    return Known(st, path, np.exp(-depth), s, p, unpolarised, events)


def at_pixels(z: float, n: tuple[float, float, float], size: int = 7) -> Known:
    rows, columns = (each.astype(float) for each in np.indices((size, size)))
    return known(z, rows, columns, size, n)


def of(line: float) -> tuple[float, float, float]:
    a, b, c = (float(refractive_index(glass, line)) for glass in GLASSES)
    return a, b, c


D_LINE = of(587.5618)


def followed(scene: Scene, precision: str = "double") -> RayMap:
    raymap = trace(scene, precision=precision, device=plain_device(1))
    assert raymap.kernel.structure.nests
    assert (raymap.status == RayStatus.PICTURE).all()
    return raymap


@WRITTEN
@WHERE
def test_each_wavelength_is_bent_let_through_and_absorbed_layer_by_layer(written: str, where: str) -> None:
    z = PICTURES[where]
    raymap = followed(scene_of(written, z, effects={"dispersion": LINES, "fresnel": True, "path_length": True}))
    for number, line in enumerate(LINES):
        laws = at_pixels(z, of(line))
        assert set(raymap.events[number].ravel().tolist()) == {laws.events}
        np.testing.assert_allclose(raymap.st[number], laws.st, rtol=0, atol=1e-14)
        np.testing.assert_allclose(raymap.path_length[number], laws.path, rtol=1e-14)
        np.testing.assert_allclose(raymap.transmission[number], laws.transmission, rtol=1e-13)
        np.testing.assert_allclose(raymap.transmittance[number], laws.unpolarised, rtol=1e-13)
    assert np.abs(raymap.st[0] - raymap.st[2]).max() > 1e-4, "wavelengths part"


@WRITTEN
@WHERE
def test_polarised_light_is_carried_from_face_to_face_and_footprints_too(written: str, where: str) -> None:
    z = PICTURES[where]
    raymap = followed(scene_of(written, z, effects={"fresnel": "polarised", "footprint": True}))
    laws = at_pixels(z, D_LINE)
    np.testing.assert_allclose(raymap.transmittance, (laws.s + laws.p) / 2, rtol=1e-13)
    assert laws.events < 2 or np.abs((laws.s + laws.p) / 2 - laws.unpolarised).max() > 1e-6
    rows, columns = (each.astype(float) for each in np.indices((7, 7)))
    step = 1e-4
    for axis, (down, along) in enumerate(((step, 0.0), (0.0, step))):
        ahead, back = (known(z, rows + k * down, columns + k * along, 7, D_LINE).st for k in (1, -1))
        np.testing.assert_allclose(raymap.jacobian[..., axis], (ahead - back) / (2 * step), atol=1e-10)


@WRITTEN
@WHERE
def test_the_front_reflects_by_the_pair_of_media_that_it_parts(written: str, where: str) -> None:
    z = PICTURES[where]
    raymap = followed(scene_of(written, z, effects={"fresnel": "split", "environment": "panorama.png"}))
    laws, front = at_pixels(z, D_LINE), at_pixels(0.4, D_LINE)  # of the first face alone
    np.testing.assert_allclose(raymap.transmittance, laws.unpolarised, rtol=1e-13)
    np.testing.assert_allclose(raymap.reflectance, 1.0 - front.unpolarised, atol=1e-14)
    assert (raymap.reflected[..., 2] > 0.8).all(), "it goes back up"


@WRITTEN
@WHERE
def test_samples_of_a_pixel_are_rays_through_the_layers(written: str, where: str) -> None:
    z = PICTURES[where]
    raymap = followed(scene_of(written, z, effects={"antialias": 2, "fresnel": True, "footprint": True}))
    assert raymap.samples is not None
    rows, columns = (each.astype(float) for each in np.indices((14, 14)))
    laws = known(z, rows, columns, 14, D_LINE)
    found = np.asarray(raymap.samples.st).reshape(-1, 2)
    assert found.shape == (196, 2)
    wanted = laws.st.reshape(7, 2, 7, 2, 2).swapaxes(1, 2).reshape(-1, 2)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("written", "where"), [("nested", "behind all"), ("touching", "on a common face"), ("nested", "within a layer")]
)
def test_light_from_a_point_is_spread_by_the_layers_above_the_picture(written: str, where: str) -> None:
    """The flux through a part of the picture, over that which reached it without lenses."""
    z = PICTURES[where]
    scene = scene_of(
        written, z, 24, absorbs=False, effects={"caustics": True, "fresnel": True}, source=None,
        picture={"size": [60, 60], "right": [2.4, 0.0, 0.0], "down": [0.0, -2.4, 0.0]},
    )  # fmt: skip
    raymap = trace(scene, device=plain_device(1))
    centre = 2.4 * ((np.arange(60) + 0.5) / 60 - 0.5)
    r = np.hypot(*np.meshgrid(centre, centre))
    tangents = np.linspace(0.0, 0.6, 4001)
    sine = tangents / np.sqrt(1 + tangents**2)
    aside, let = _layered(sine, 4.0, z)
    flux = 1.0 - np.sqrt(1.0 - sine**2)  # of the cone, over 2 pi
    density = np.gradient(flux, aside**2 / 2, edge_order=2) * let  # by the area of rings
    free = (4.0 - z) / np.hypot(4.0 - z, aside) ** 3
    wanted = np.interp(r, aside, density / free)
    lit = r < 0.9 * np.interp(0.4 / 2.0, tangents, aside)
    assert lit.sum() > 300
    np.testing.assert_allclose(raymap.irradiance[lit], wanted[lit], rtol=2e-3)


def _layered(sine: Array, top: float, z: float) -> tuple[Array, Array]:
    """Return how far aside rays from the axis land, and what the faces let through, by the sine in air."""
    aside, let = np.zeros_like(sine), np.ones_like(sine)
    indices, heights = [1.0, *D_LINE, 1.0], [top, *FACES, -np.inf]
    for i, (high, low) in enumerate(pairwise(heights)):
        a, cosine = indices[i], np.sqrt(1.0 - (sine / indices[i]) ** 2)
        aside += (high - max(low, z)) * (sine / a) / cosine
        if z >= low:
            break
        b, behind = indices[i + 1], np.sqrt(1.0 - (sine / indices[i + 1]) ** 2)
        rs = ((a * cosine - b * behind) / (a * cosine + b * behind)) ** 2
        rp = ((b * cosine - a * behind) / (b * cosine + a * behind)) ** 2
        let *= 1 - (rs + rp) / 2
    return aside, let


@pytest.mark.parametrize("precision", ["single", "mixed"])
def test_single_and_mixed_precision_count_the_same(precision: str) -> None:
    asked = {"fresnel": True, "path_length": True}
    close = 3e-6 if precision == "single" else 1e-13
    for written, where in (("touching", "on a common face"), ("nested", "within a layer"), ("nested", "behind all")):
        z = PICTURES[where]
        raymap, laws = followed(scene_of(written, z, effects=asked), precision), at_pixels(z, D_LINE)
        np.testing.assert_allclose(raymap.st, laws.st, rtol=0, atol=close)
        np.testing.assert_allclose(raymap.path_length, laws.path, rtol=close)
        np.testing.assert_allclose(raymap.transmission, laws.transmission, rtol=close)
        np.testing.assert_allclose(raymap.transmittance, laws.unpolarised, rtol=close)
