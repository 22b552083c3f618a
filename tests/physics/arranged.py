"""Scenes of solids that touch, overlap or lie in one another, with what is known of them in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from probe import plain_device
from scenes import make_scene

from lenscl import trace_rays
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.tracing import RayPaths

Array = NDArray[np.float64]
Lens = dict[str, Any]

PICTURE = {"corner": [-4.0, 4.0, -3.0], "right": [8.0, 0.0, 0.0], "down": [0.0, -8.0, 0.0]}
# A cemented doublet in millimetres: crown before flint, with the common face's curvature; film and picture on the axis
CROWN = {"surface": "conic_singlet", "n": 1.5168, "c1": 0.0159362549800797, "c2": -0.0218770509735288, "thickness": 4.0,
         "diameter": 25.4, "centre": [0.0, 0.0, 2.0], "name": "crown"}  # fmt: skip
FLINT = {"surface": "conic_singlet", "n": 1.6727, "c1": -0.0218770509735288, "c2": -0.0077984870935039,
         "thickness": 2.5, "diameter": 25.4, "centre": [0.0, 0.0, 5.25], "name": "flint"}  # fmt: skip


def here() -> Device:
    """Return the device of these tests: quick to compile for."""
    return plain_device(4)


def user(formula: str, half: float = 0.8, **more: Any) -> Lens:
    """Return the table of a lens that is an expression, within so much of its own origin."""
    return {"surface": formula, "bounds": [[-half] * 3, [half] * 3]} | more


def scene_of(*lenses: Lens, **more: Any) -> Scene:
    """Return a scene with all its lenses named."""
    named = [{"name": f"l{number}"} | lens for number, lens in enumerate(lenses)]
    return make_scene(*named, **({"picture": PICTURE} | more))


def followed(scene: Scene, rays: tuple[Array, Array], precision: str = "double") -> RayPaths:
    """Trace given rays."""
    return trace_rays(scene, *rays, precision=precision, device=here())


def rays_through(
    random: np.random.Generator, count: int, width: float = 0.45, distance: float = 2.0
) -> tuple[Array, Array]:
    """Return rays from all sides through a cube about the origin, starting so far before it."""
    ahead = random.normal(size=(count, 3))
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    return random.uniform(-width, width, (count, 3)) - distance * ahead, ahead


def down_axis(heights: Sequence[float]) -> tuple[Array, Array]:
    """Return rays along -z from z = 2, one at each x."""
    count = len(heights)
    origins = np.column_stack([heights, np.zeros(count), np.full(count, 2.0)])
    return origins, np.tile([0.0, 0.0, -1.0], (count, 1))


def alike(one: RayPaths, other: RayPaths, within: float) -> int:
    """Hold that rays end alike, and their places and directions within so much; return how many of them land."""
    assert np.array_equal(one.status, other.status)
    assert np.array_equal(one.events, other.events)
    assert np.abs(one.direction - other.direction).max() <= within
    landed = one.st[:, 0] != -1.0
    assert np.abs(one.st - other.st).max() <= within
    return int(landed.sum())
