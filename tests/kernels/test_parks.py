"""Rays that are put aside and carried on in other packets end as they would have in their own, bit for bit."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from faults_in_kernels import Fault, broken
from probe import plain_device
from scenes import make_scene
from thinned import thinned

import lenscl
from lenscl.tracing import film_rays, job, parking

SCENES = {
    "ellipsoid": {"surface": "ellipsoid", "a": 1.0, "b": 0.8, "c": 0.6},  # 1 % of its rays are trapped at the rim
    "bifolia": {"surface": "bifolia", "n": 2.4},
}
PRECISIONS = ("single", "double", "mixed")
WIDTHS = [(32, 16), (4, 4)]
EVERY_TWO = [(name, each, WIDTHS[(i + k) % 2]) for i, name in enumerate(SCENES) for k, each in enumerate(PRECISIONS)]


@pytest.fixture
def aside(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return a list that receives how many rays each launch puts aside, layer by layer."""
    counts: list[int] = []
    places = parking.Parking.places

    def counted(self: parking.Parking) -> list[np.ndarray]:
        found = places(self)
        counts.extend(map(len, found))
        assert all(len(set(layer.tolist())) == len(layer) for layer in found)
        return found

    monkeypatch.setattr(parking.Parking, "places", counted)
    return counts


def scene_of(name: str) -> lenscl.Scene:
    return make_scene(SCENES[name], film={"size": [203, 131]}).replace({"numerics.max_events": 40})


@pytest.mark.parametrize(("name", "precision", "widths"), thinned(product(SCENES, PRECISIONS, WIDTHS), EVERY_TWO))
def test_a_map_is_the_same_whether_rays_are_put_aside_or_not(
    name: str, precision: str, widths: tuple[int, int], aside: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, device = scene_of(name), plain_device(*widths)
    parked = lenscl.trace(scene, precision=precision, device=device)
    assert parked.kernel.structure.parks
    assert sum(aside) > 50
    monkeypatch.setattr(parking, "_ALMOST_ALONE", 99)
    alone = lenscl.trace(scene, precision=precision, device=device)
    assert not alone.kernel.structure.parks
    assert parked.events.max() > 8
    for array in ("st", "status", "events", "origin", "direction"):
        np.testing.assert_array_equal(getattr(parked, array), getattr(alone, array))


@pytest.mark.users_kernels  # packets of few lanes put none aside
def test_given_rays_are_put_aside_too(aside: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)
    o = np.tile([0.0, 0.0, 4.0], (5000, 1))
    d = np.stack([*rng.uniform(-0.27, 0.27, (2, 5000)), np.full(5000, -1.0)], 1)
    parked = lenscl.trace_rays(scene_of("ellipsoid"), o, d)
    assert sum(aside) > 20
    monkeypatch.setattr(parking, "_ALMOST_ALONE", 99)
    alone = lenscl.trace_rays(scene_of("ellipsoid"), o, d)
    for array in ("st", "status", "events", "origin", "direction"):
        np.testing.assert_array_equal(getattr(parked, array), getattr(alone, array))


def spread() -> lenscl.Scene:
    """Return a scene of three wavelengths, of each of which other rays are put aside."""
    lens = SCENES["ellipsoid"] | {"n": "SF11"}
    scene = make_scene(lens, film={"size": [203, 131]}, effects={"dispersion": 3, "path_length": True})
    return scene.replace({"numerics.max_events": 40})


def assert_each_as_if_alone(found: lenscl.RayMap) -> None:
    """Hold each wavelength's layer against the map of a scene that has this wavelength only."""
    for number, layer in enumerate(found.scene.layers()):
        alone = lenscl.trace(layer, precision=found.kernel.structure.precision, device=found.device)
        for name in ("st", "status", "events", "path_length"):
            np.testing.assert_array_equal(
                getattr(found, name)[number], getattr(alone, name), err_msg=f"{number} {name}"
            )


@pytest.mark.parametrize(("precision", "widths"), [("single", (16, 8)), ("mixed", (4, 4)), ("double", (32, 8))])
def test_rays_of_every_wavelength_are_put_aside_and_end_as_if_it_were_alone(
    precision: str, widths: tuple[int, int], aside: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    found = lenscl.trace(spread(), precision=precision, device=plain_device(*widths))
    assert found.kernel.structure.parks
    assert len(aside) == 3
    assert min(aside) > 50
    assert len(set(aside)) > 1  # so that packets of some layers are empty, or full in part
    monkeypatch.setattr(parking, "_ALMOST_ALONE", 99)  # the others put none aside
    assert_each_as_if_alone(found)


def test_tiles_of_several_wavelengths_put_rays_aside_each_for_itself(
    aside: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, device = spread(), plain_device(8)
    whole = lenscl.trace(scene, device=device)
    monkeypatch.setattr(job, "_TILE_PIXELS", 3 * 203 * 9)
    tiled = lenscl.trace(scene, device=device)
    assert len(aside) == 3 + 3 * 15
    assert sum(aside[:3]) > 150
    assert sum(aside[3:]) > 150
    for name in ("st", "status", "events", "path_length"):
        np.testing.assert_array_equal(getattr(tiled, name), getattr(whole, name))


def test_given_rays_of_several_wavelengths_are_put_aside_too(aside: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    scene, device = spread(), plain_device(8)
    raymap = lenscl.trace(scene, device=device)
    rows = slice(40, 60)  # whose last legs' ends are those of the whole film's
    origins, directions = film_rays(scene, np.arange(rows.start * 203, rows.stop * 203))
    paths = lenscl.trace_rays(scene, origins, directions, device=device)
    assert min(aside[-3:]) > 5
    np.testing.assert_array_equal(paths.events.reshape(3, 20, 203), raymap.events[:, rows])
    monkeypatch.setattr(parking, "_ALMOST_ALONE", 99)
    for number, layer in enumerate(scene.layers()):
        alone = lenscl.trace_rays(layer, origins, directions, device=device)
        for name in ("st", "status", "events", "origin", "direction"):
            np.testing.assert_array_equal(getattr(paths, name)[number], getattr(alone, name))


# Neither reads a place where no ray was put: of the first wavelength fewest are, of the last one most
FAULTS = (
    Fault("carried on as the last wavelength's", "parks.cl", "begin = layer.number * room", "begin = 2 * room"),
    Fault("as many as of the first wavelength", "parks.cl", "(parked[layer.number] - first)", "(parked[0] - first)"),
)


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_rays_put_aside_among_those_of_another_wavelength_are_noticed(
    fault: Fault, aside: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    with broken(fault):
        found = lenscl.trace(spread(), device=plain_device(8))
    assert aside[:3] == sorted(aside[:3])
    assert aside[0] < aside[1]  # what is left undecided is traced once more
    monkeypatch.setattr(parking, "_ALMOST_ALONE", 99)
    with pytest.raises(AssertionError):
        assert_each_as_if_alone(found)


def test_one_ray_to_a_packet_is_never_put_aside(aside: list[int]) -> None:
    raymap = lenscl.trace(scene_of("ellipsoid"), device=plain_device(1, 1))
    assert "parks_never.cl" in raymap.kernel.text
    assert not aside
