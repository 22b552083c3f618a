from __future__ import annotations

import pytest
from scenes import CONFIGS

from lenscl import RayStatus, load_study, trace

CLOSE = ("ellipsoid", "torus", "heart", "bifolia")


@pytest.mark.parametrize("precision", ["single", "mixed", "double"])
@pytest.mark.parametrize("name", CLOSE)
def test_ordinary_films_leave_no_ray_undecided(name: str, precision: str) -> None:
    scene = load_study(CONFIGS / "bench" / f"{name}-close.toml").scene.replace({"film.size": [400, 300]})
    raymap = trace(scene, precision=precision)
    assert (raymap.events > 0).mean() > 0.25
    assert raymap.counts()[RayStatus.UNDECIDED] == 0  # of 120,000 rays, 1e-5 are one
