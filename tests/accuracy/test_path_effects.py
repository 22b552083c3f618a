"""What effects make of a ray, surface by surface: by closed forms along the path, and at its end as in the map."""

from __future__ import annotations

from math import cos, exp, radians
from typing import Any

import numpy as np
import pytest
from scenes import make_scene

from lenscl import trace
from lenscl.accuracy.path import Event, explain_pixel
from lenscl.config import Scene

TORUS: dict[str, Any] = {"surface": "torus", "rotate": [70.0, 0.0, 0.0], "absorption": [0.5, 1.0, 0.0]}
N, MEDIUM = 1.5, 1.1


def scene_with(**effects: Any) -> Scene:
    return make_scene(TORUS | {"n": N}, medium=MEDIUM, effects=effects)


def longest_path(scene: Scene) -> tuple[int, int]:
    """Return the film pixel whose ray meets most surfaces and lands."""
    raymap = trace(scene)
    row, column = np.unravel_index(np.where(raymap.st[..., 0] != -1.0, raymap.events, 0).argmax(), raymap.events.shape)
    assert raymap.events[row, column] >= 4
    return int(row), int(column)


def refracted(event: Event) -> float:
    """Return the share of unpolarised light that is refracted, by Fresnel's amplitudes."""
    if event.kind == "total reflection":
        return 1.0
    before, after = (MEDIUM, N) if event.kind == "entry" else (N, MEDIUM)
    assert event.incidence is not None
    assert event.behind is not None
    here, behind = cos(radians(event.incidence)), cos(radians(event.behind))
    s = (before * here - after * behind) / (before * here + after * behind)
    p = (after * here - before * behind) / (after * here + before * behind)
    return 1.0 - (s * s + p * p) / 2.0


def test_effects_are_told_behind_every_surface() -> None:
    scene = scene_with(fresnel=True, path_length=True)
    path = explain_pixel(scene, *longest_path(scene))
    transmittance, length, inside = 1.0, 0.0, 0.0
    for event in path.events:
        within = event.kind != "entry"
        transmittance *= refracted(event)
        length += (N if within else MEDIUM) * event.leg
        inside += event.leg if within else 0.0
        made = event.effects
        assert made["transmittance"] == pytest.approx(transmittance, rel=1e-9)
        assert made["path_length"] == pytest.approx(length, rel=1e-12)
        assert made["transmission"] == pytest.approx([exp(-a * inside) for a in TORUS["absorption"]], rel=1e-12)
    assert transmittance < 0.95
    assert inside > 0.1


@pytest.mark.parametrize("precision", ["single", "double"])
def test_in_the_end_they_are_what_the_map_has(precision: str) -> None:
    scene = scene_with(fresnel="polarised", path_length=True, footprint=True)
    scene = scene.replace({"numerics.precision": precision})
    row, column = longest_path(scene)
    raymap, path = trace(scene), explain_pixel(scene, row, column)
    assert set(path.effects) == {"transmission", "transmittance", "path_length", "jacobian"}
    for name, value in path.effects.items():
        np.testing.assert_array_equal(value, raymap.added[name][row, column].astype(np.float64))
    assert all("jacobian" not in event.effects for event in path.events)  # a place's on the picture


def test_without_effects_nothing_is_told_nor_compiled() -> None:
    from lenscl.device import compile_count

    scene = make_scene({"surface": "torus"})
    before = compile_count("explain")
    path = explain_pixel(scene, 20, 24)
    built = compile_count("explain") - before
    assert path.effects == {}
    assert all(event.effects == {} for event in path.events)
    assert built <= 1  # what follows the ray
