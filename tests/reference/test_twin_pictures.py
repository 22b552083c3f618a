"""The float64 twin where the picture is a screen: on, in and before solids, against the oracle and closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from arrangements import bubble
from reference.test_nested_twin import FINE, held
from scenes import make_scene

from lenscl import RayStatus, reference
from lenscl.config import Scene
from lenscl.reference import Steps, screen

DOME = {"surface": "plano_convex", "R": 1.0, "thickness": 1.0, "diameter": 2.0, "n": 1.5, "centre": [0, 0, -0.5]}
SLAB = {"surface": "max(abs(x) - 2, abs(y) - 2, abs(z) - 0.5)", "bounds": [[-2.1, -2.1, -0.6], [2.1, 2.1, 0.6]]}
RING = {"name": "ring", "surface": "torus", "R": 0.6, "r": 0.2, "n": 1.7, "rotate": [60.0, 10.0, 0.0]}
NARROW = {"right": [0.4, 0.0, 0.0], "down": [0.0, -0.4, 0.0], "size": [7, 7]}


def dome(z: float, **picture: Any) -> Scene:
    """A half ball whose flat face lies at z = 0, and a picture at a height."""
    return make_scene(
        DOME,
        source={"kind": "point", "at": [0.0, 0.0, -8.0]},
        film={"corner": [-0.5, 0.5, -4.0], "right": [1.0, 0, 0], "down": [0, -1.0, 0], "size": [7, 7]},
        picture={"corner": [-0.7, 0.7, z], "right": [1.4, 0, 0], "down": [0, -1.4, 0], **picture},
        numerics=FINE,
    )


def ball(**picture: Any) -> Scene:
    sphere = {"surface": "sphere", "r": 0.5, "n": 1.5, "name": "ball"}
    return make_scene(
        sphere, RING, film=NARROW, numerics=FINE, picture={"right": [0.9, 0, 0], "down": [0, -0.7, 0], **picture}
    )


CLOSE = {"right": [0.15, 0.0, 0.0], "down": [0.0, -0.15, 0.0]}
INNER = {"centre": [0.1, 0.05, 0.1], "right": [0.3, 0, 0], "down": [0, -0.3, 0]}
SCENES = {
    "on a face": (dome(0.0), RayStatus.PICTURE, 1),
    "a little behind a face": (dome(1e-9), RayStatus.PICTURE, 2),
    "a little before a face": (dome(-1e-9), RayStatus.PICTURE, 1),
    "in a solid": (dome(-0.3), RayStatus.PICTURE, 1),
    "cutting solids": (ball(centre=[0.0, 0.0, 0.1]), RayStatus.PICTURE, 1),
    "tilted": (ball(centre=[0.0, 0.0, 0.1], right=[0.9, 0.0, 0.36]), RayStatus.PICTURE, 1),
    "before a solid": (ball(centre=[0.0, 0.0, 1.2], right=[0.4, 0.0, 0.0], stops=True), RayStatus.PICTURE, 0),
    "in a bubble": (
        make_scene(*bubble(), film=NARROW | CLOSE, numerics=FINE, picture=INNER),
        RayStatus.PICTURE, 2,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_rays_end_on_the_picture_as_is_proved(name: str) -> None:
    scene, status, events = SCENES[name]
    rays = reference.film_rays(scene)
    paths = reference.trace_rays(scene, *rays)
    found = held(scene, paths, *rays)
    assert found["wrong"] == 0
    assert found["right"] >= 47
    assert np.count_nonzero((paths.status == status) & (paths.events == events)) >= 4


def test_a_picture_in_a_slab_is_seen_where_snells_law_says() -> None:
    for z in (0.5, 0.1, -0.5):
        scene = make_scene(SLAB | {"n": 1.5}, picture={"centre": [0, 0, z], "right": [3, 0, 0], "down": [0, -3, 0]})
        sine = np.array([0.0, 0.2, 0.45])
        directions = np.column_stack([sine, 0 * sine, -np.sqrt(1 - sine**2)])
        paths = reference.trace_rays(scene, np.tile([0.0, 0.0, 1.0], (3, 1)), directions)
        tangent = [each / np.sqrt(1 - each**2) for each in (sine, sine / 1.5)]
        x = 0.5 * tangent[0] + (0.5 - z) * tangent[1]
        assert (paths.status == RayStatus.PICTURE).all()
        assert (paths.events == (z < 0.5)).all()
        np.testing.assert_allclose(paths.st, np.column_stack([0.5 + x / 3, 0 * x + 0.5]), atol=1e-14)


def test_a_picture_that_is_to_stop_nothing_or_lies_beside_every_solid_is_passed() -> None:
    """It is met by the last leg alone, as a plane; and where it is to stop rays, they end on it."""
    for stops, ends in (("auto", False), (True, True), (False, False)):
        paths = reference.trace(ball(centre=[0.0, 0.0, 1.5], stops=stops))
        on = np.count_nonzero((paths.status == RayStatus.PICTURE) & (paths.events == 0))
        behind = np.count_nonzero((paths.status == RayStatus.BEHIND) & (paths.events > 0))
        assert (on == 49) == ends
        assert (behind > 20) != ends


def test_what_rounding_hides_is_undecided() -> None:
    """On the picture's edge, where it crosses a face, and on the picture itself; the ray beside each is not."""
    half = make_scene(SLAB | {"n": 1.5}, picture={"corner": [0, 1, 0.2], "right": [1, 0, 0], "down": [0, -2, 0]})
    upright = make_scene(SLAB | {"n": 1.5}, picture={"corner": [0, 1, 1.0], "right": [0, -2, 0], "down": [0, 0, -2]})
    down, slant = np.tile([0.0, 0.0, -1.0], (2, 1)), np.tile([-0.6, 0.0, -0.8], (2, 1))
    for scene, origins, directions in (
        (half, [[0.0, 0.0, 2.0], [1e-6, 0.0, 2.0]], down),
        (half, [[0.5, 0.0, 0.2], [0.5, 0.0, 0.2 + 1e-6]], down),
        (upright, [[0.375, 0.0, 1.0], [0.376, 0.0, 1.0]], slant),
    ):
        paths = reference.trace_rays(scene, np.array(origins), directions)
        assert (paths.status == RayStatus.UNDECIDED).tolist() == [True, False], origins
        assert paths.status[1] == RayStatus.PICTURE


def _late(origin: Any, direction: Any, picture: Any, nearest: Any, spread: Any, normal: Any) -> Any:
    return screen.stops(origin, direction, picture, np.zeros_like(nearest), 0.0 * spread, normal)


def _early(origin: Any, direction: Any, picture: Any, nearest: Any, spread: Any, normal: Any) -> Any:
    return screen.stops(origin, direction, picture, np.full_like(nearest, np.inf), spread, normal)


@pytest.mark.parametrize("faulty", [_late, _early], ids=["picture never met", "picture met before all"])
def test_a_twin_with_a_fault_ends_otherwise(faulty: Any) -> None:
    scene = ball(centre=[0.0, 0.0, 0.1])
    rays = reference.film_rays(scene)
    broken = held(scene, reference.trace_rays(scene, *rays, steps=Steps(stops=faulty)), *rays)
    assert broken["wrong"] > 5
