"""Compile kernels on one OpenCL device and compare them with the plain float64 twin; a process of its own.

Run by `lenscl doctor` as `python -m lenscl.cli.probe [LABEL]`, because a driver in trouble may end its process. Without
a label it lists the devices. Prints one JSON value.
"""

from __future__ import annotations

import json
import sys
from typing import Any

_SCENE = """
[source]
kind = "point"
at = [0.0, 0.0, 4.0]
[film]
centre = [0.0, 0.0, 2.5]
right = [2.0, 0.0, 0.0]
down = [0.0, -2.0, 0.0]
size = [24, 17]
[picture]
centre = [0.0, 0.0, -2.5]
right = [6.0, 0.0, 0.0]
down = [0.0, -6.0, 0.0]
[[lens]]
surface = "ellipsoid"
a = 1.0
b = 0.8
c = 0.6
centre = [0.1, 0.05, 0.0]
n = 1.5
[effects]
total_reflection = "follow"
[numerics]
max_events = 16
"""

# Picture widths by which a ray may land beside its twin. The twin marches, the kernel proves; both end on the root, and
# what is left is rounding, grown at most a few hundredfold through the two surfaces for rays that graze neither
_TOLERANCES = {"single": 1e-3, "double": 1e-9}
_LEAST_SHARE = 0.99  # of the rays must agree in status and events: at the rim rounding alone decides what is hit


def main(arguments: list[str]) -> None:
    """Print the devices, or what one of them made of the scene."""
    found: Any = _compare(arguments[0]) if arguments else _listed()
    print(json.dumps(found))


def _listed() -> dict[str, Any]:
    """Return {"labels": [...], "chosen": one of them or None, "trouble": why none is chosen}."""
    from lenscl.device import choose, devices
    from lenscl.errors import NoDeviceError

    labels = [one.label for one in devices()]
    try:
        return {"labels": labels, "chosen": choose().label, "trouble": None}
    except NoDeviceError as error:
        return {"labels": labels, "chosen": None, "trouble": str(error).splitlines()[0]}


def _compare(label: str) -> dict[str, Any]:
    """Return {"driver", "precisions": [...], "problems": [...]}."""
    import numpy as np

    from lenscl import reference
    from lenscl.config import scene_from_toml
    from lenscl.device import choose
    from lenscl.tracing import trace

    chosen = choose(label)
    scene = scene_from_toml(_SCENE)
    twin = reference.trace(scene)
    precisions = ["single", "double"] if chosen.has_double else ["single"]
    problems = []
    for precision in precisions:
        raymap = trace(scene, precision=precision, device=chosen)
        agree = (raymap.status.ravel() == twin.status) & (raymap.events.ravel() == twin.events)
        error = np.abs(raymap.st.reshape(-1, 2) - twin.st).max(axis=1)
        share = float((agree & (error <= _TOLERANCES[precision])).mean())
        if share < _LEAST_SHARE:
            problems.append(f"in {precision} only {100 * share:.1f} % of the rays land where they should")
    return {"driver": chosen.driver, "precisions": precisions, "problems": problems}


if __name__ == "__main__":
    main(sys.argv[1:])
