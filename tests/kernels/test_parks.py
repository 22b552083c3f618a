"""Rays that are put aside and carried on in other packets end as they would have in their own, bit for bit."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from probe import device_of_width
from scenes import make_scene
from thinned import thinned

import lenscl
from lenscl.tracing import parking

SCENES = {
    "ellipsoid": {"surface": "ellipsoid", "a": 1.0, "b": 0.8, "c": 0.6},  # 1 % of its rays are trapped at the rim
    "bifolia": {"surface": "bifolia", "n": 2.4},
}
PRECISIONS = ("single", "double", "mixed")
WIDTHS = [(32, 16), (4, 4)]
EVERY_TWO = [(name, each, WIDTHS[(i + k) % 2]) for i, name in enumerate(SCENES) for k, each in enumerate(PRECISIONS)]


@pytest.fixture
def aside(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return a list that receives how many rays each launch puts aside."""
    counts: list[int] = []
    places = parking.Parking.places

    def counted(self: parking.Parking) -> np.ndarray:
        found = places(self)
        counts.append(len(found))
        assert len(set(found.tolist())) == len(found)
        return found

    monkeypatch.setattr(parking.Parking, "places", counted)
    return counts


def scene_of(name: str) -> lenscl.Scene:
    return make_scene(SCENES[name], film={"size": [203, 131]}).replace({"numerics.max_events": 40})


@pytest.mark.parametrize(("name", "precision", "widths"), thinned(product(SCENES, PRECISIONS, WIDTHS), EVERY_TWO))
def test_a_map_is_the_same_whether_rays_are_put_aside_or_not(
    name: str, precision: str, widths: tuple[int, int], aside: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, device = scene_of(name), device_of_width(*widths)
    parked = lenscl.trace(scene, precision=precision, device=device)
    assert parked.kernel.structure.parks
    assert sum(aside) > 50
    monkeypatch.setattr(parking, "_ALMOST_ALONE", 99)
    alone = lenscl.trace(scene, precision=precision, device=device)
    assert not alone.kernel.structure.parks
    assert parked.events.max() > 8
    for array in ("st", "status", "events", "origin", "direction"):
        np.testing.assert_array_equal(getattr(parked, array), getattr(alone, array))


@pytest.mark.users_widths  # packets of few lanes put none aside
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


def test_one_ray_to_a_packet_is_never_put_aside(aside: list[int]) -> None:
    raymap = lenscl.trace(scene_of("ellipsoid"), device=device_of_width(1, 1))
    assert "parks_never.cl" in raymap.kernel.text
    assert not aside
