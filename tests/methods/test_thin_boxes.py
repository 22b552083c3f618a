"""A lens whose box is thinner than the rounding of the distance to it is met all the same."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scenes import make_scene

from lenscl import trace_rays
from lenscl.errors import StudyError

SLAB = {"surface": "max(abs(z) - 0.25, x^2 + y^2 - 4)", "bounds": [[-2.1] * 3, [2.1] * 3]}


@pytest.mark.parametrize(
    ("precision", "thickness", "distance"),
    [("single", 3e-8, 2.0), ("single", 1e-8, 2.0), ("single", 2e-12, 2.0), ("mixed", 2e-12, 1e3),
     ("double", 1e-12, 1e5), ("double", 1e-12, 3e3)],
)  # fmt: skip
@pytest.mark.parametrize("method", ["polynomial", "guarded", "interval"])
@pytest.mark.parametrize("lens", [SLAB, {"surface": "sphere"}], ids=["slab", "ball"])
def test_no_ray_passes_through_a_sheet_unseen(
    lens: dict[str, Any], method: str, precision: str, thickness: float, distance: float
) -> None:
    scene = make_scene({**lens, "stretch": [1.0, 1.0, thickness]})
    at = np.random.default_rng(1).uniform(-0.5, 0.5, (40, 2))
    origins = np.column_stack([at, np.full(40, distance)])
    try:
        paths = trace_rays(scene, origins, np.tile([0.01, 0.0, -1.0], (40, 1)) * [distance**-1, 1, 1],
                           method=method, precision=precision)  # fmt: skip
    except StudyError:
        pytest.skip(f"{method} does not serve it")
    assert (paths.events == 2).all()
