"""Scenes that people reported, with their own numbers: how each ray must end, by closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from physics.arranged import here
from physics.test_arrangements import _spheres
from physics.test_picture_in_glass import paperweight
from scenes import make_scene

from lenscl import RayStatus, trace
from lenscl.accuracy import check_map
from lenscl.tracing import count_steps, film_rays


@pytest.mark.parametrize("precision", ["double", "single", "mixed"])
@pytest.mark.parametrize("z", [-0.5, -0.3, -0.1, 0.1, 0.3])
def test_a_picture_moved_into_the_glass_or_behind_it_is_seen_by_every_pixel(z: float, precision: str) -> None:
    """The half ball reaches from its pole at z = -1 to its flat face at 0: behind that rays are bent twice."""
    raymap = trace(paperweight(z), precision=precision, device=here())
    assert (raymap.status == RayStatus.PICTURE).sum() == 4225
    assert (raymap.events == (1 if z < 0 else 2)).all()
    origins, ahead = film_rays(raymap.scene, np.arange(4225))
    ahead = ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
    through = (origins * ahead).sum(1)
    start = origins - (through + np.sqrt(through**2 - (origins**2).sum(1) + 1.0))[:, None] * ahead
    behind = _spheres(origins, ahead, [(-1.0, 1.0)], [1.0, 1.5])
    if z > 0.0:
        start = start - (start[:, 2] / behind[:, 2])[:, None] * behind
        across = 1.5 * behind[:, :2]
        behind = np.column_stack([across, np.sqrt(1.0 - (across**2).sum(1))])
    place = start + ((z - start[:, 2]) / behind[:, 2])[:, None] * behind
    st = np.column_stack([(place[:, 0] + 1.0) / 2.0, (1.0 - place[:, 1]) / 2.0])
    close = 2e-6 if precision == "single" else 1e-14
    np.testing.assert_allclose(raymap.st.reshape(-1, 2), st, rtol=0, atol=close)


def test_the_paperweight_raises_no_alarm_on_its_face_and_in_the_glass() -> None:
    for z in (0.0, -0.3, 0.3):
        check = check_map(trace(paperweight(z), device=here()))
        assert check.failures == (), [str(failure) for failure in check.failures]
        assert check.checked >= 32


# Faces by max(): one closed form a search, however many there are

_CUBE = "max(abs(x), abs(y), abs(z)) - 0.5"
_EIGHT = "abs(x) + abs(y) + abs(z) - 0.6"


def _faces(count: int) -> str:
    """Return the max of so many planes at 0.5 from the origin, spread evenly over a ball."""
    turn = math.pi * (3.0 - math.sqrt(5.0))
    rows = []
    for i in range(count):
        z = 1.0 - (2.0 * i + 1.0) / count
        x, y = (math.sqrt(1.0 - z * z) * f(turn * i) for f in (math.cos, math.sin))
        rows.append(f"{x:.9f}*x + {y:.9f}*y + {z:.9f}*z")
    return f"max({', '.join(rows)}) - 0.5"


def _balls(faces: str) -> dict[str, object]:
    return {"surface": faces, "bounds": [[-1.2] * 3, [1.2] * 3]}


@pytest.mark.parametrize("count", [6, 8, 14, 26, 73])
def test_polyhedra_by_max_take_one_step_a_search_however_many_faces_they_have(count: int) -> None:
    text = {6: _CUBE, 8: _EIGHT}.get(count) or _faces(count)
    scene = make_scene(_balls(text), film={"size": [24, 24]})
    counted = count_steps(scene)
    assert counted.searches > 100
    assert counted.steps == counted.searches
    if count == 14:
        assert count_steps(scene, method="interval").mean > 3.0, "as it would be if the planes were not recognised"
