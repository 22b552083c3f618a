"""Effects of one scene that is written in two ways: as solids in solids, or as one solid in the usual kernel.

A bubble in a ball is a shell that max() writes; a picture in a ball is a picture in a medium of glass, in which the
source stands in a solid of air that the ball is cut out of.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from physics.arranged import user
from probe import plain_device
from scenes import make_scene

from lenscl import RayStatus, trace
from lenscl.config import Scene
from lenscl.tracing import RayMap

LINES = [450.0, 550.0, 650.0]
EFFECTS: dict[str, dict[str, Any]] = {
    "dispersion": {"dispersion": LINES, "fresnel": True, "path_length": True},
    "samples": {"fresnel": "polarised", "footprint": True, "antialias": 2},
    "split": {"fresnel": "split", "environment": "panorama.png"},
    "edges": {"antialias": "edges"},
    "caustics": {"caustics": True, "fresnel": True},
}
GLASS = "BK7"
FILM = {"size": [14, 14], "right": [0.5, 0.0, 0.0], "down": [0.0, -0.5, 0.0]}
SMALL = {"size": [20, 20]}


def bubble(name: str) -> tuple[Scene, Scene]:
    """Return a bubble in a ball, and the shell."""
    ball = {"surface": "sphere", "r": 0.5, "n": GLASS, "name": "ball", "absorption": [0.5, 1.0, 2.0]}
    air = {"surface": "sphere", "r": 0.25, "n": 1.0, "name": "air", "centre": [0.05, 0.1, 0.0]}
    shell = "max(x^2 + y^2 + z^2 - 0.25, 0.0625 - (x - 0.05)^2 - (y - 0.1)^2 - z^2)"
    one = user(shell, 0.55, n=GLASS, absorption=[0.5, 1.0, 2.0])
    more = {"film": FILM, "effects": EFFECTS[name], "picture": SMALL}
    return make_scene(ball, air, **more), make_scene(one, **more)


def within(name: str) -> tuple[Scene, Scene]:
    """Return a picture in a ball of glass, and in a medium of glass below a solid of air."""
    picture = {"centre": [0.0, 0.0, -0.2], "right": [1.2, 0.0, 0.0], "down": [0.0, -1.2, 0.0], "size": [20, 20]}
    film = FILM | {"right": [0.35, 0.0, 0.0], "down": [0.0, -0.35, 0.0]}  # which lights no more than the picture
    more = {"film": film, "effects": EFFECTS[name], "picture": picture}
    air = user("max(abs(x) - 3, abs(y) - 3, abs(z - 3) - 3, 1 - x^2 - y^2 - z^2)", n=1.0)
    air["bounds"] = [[-3.1, -3.1, -0.1], [3.1, 3.1, 6.1]]
    return make_scene({"surface": "sphere", "n": GLASS}, **more), make_scene(air, medium=GLASS, **more)


def _same(one: RayMap, other: RayMap, close: float) -> int:
    """Hold that what two maps of one scene tell is alike; return how many rays are compared."""
    np.testing.assert_array_equal(one.status, other.status)
    np.testing.assert_array_equal(one.events, other.events)
    few = (one.events <= 4) & (one.status <= RayStatus.OFF_PICTURE)  # many events magnify rounding
    np.testing.assert_allclose(one.st[few], other.st[few], atol=close)
    assert one.added.keys() == other.added.keys()
    for name, array in one.added.items():
        if array.shape[: few.ndim] == few.shape:
            np.testing.assert_allclose(array[few], other.added[name][few], atol=close, rtol=close, err_msg=name)
    if one.samples is not None:
        assert other.samples is not None
        np.testing.assert_array_equal(one.samples.status, other.samples.status)
        np.testing.assert_allclose(one.samples.st, other.samples.st, atol=1e4 * close)
    if one.caustic is not None:
        assert other.caustic is not None
        np.testing.assert_allclose(one.irradiance, other.irradiance, atol=1e-9, rtol=1e-6)
    return int(few.sum())


# There is no front where the source stands in a solid; folds of caustics, of which a bubble has many, hang on rounding
@pytest.mark.parametrize(
    ("written", "name"),
    [
        *((bubble, name) for name in ("dispersion", "samples", "split", "edges")),
        *((within, name) for name in ("dispersion", "samples", "caustics")),
    ],
)
def test_both_writings_of_a_scene_tell_the_same(written: Any, name: str) -> None:
    nested, usual = written(name)
    one, other = (trace(scene, device=plain_device(1)) for scene in (nested, usual))
    assert one.kernel.structure.nests
    assert not other.kernel.structure.nests
    assert _same(one, other, 1e-9) > 120
