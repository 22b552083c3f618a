"""Look at pictures through lenses of any shape, and trust what you see.

Rays start at a source, pass through each pixel of a film, are bent by Snell's law at every surface of a lens
`F(x, y, z) <= 0`, and land on a picture; the film pixel takes the colour found there.

A scene is data, written in TOML:

>>> import lenscl
>>> scene = lenscl.scene_from_toml('''
... source = { kind = "point", at = [0, 0, 4] }
... film = { centre = [0, 0, 2.5], right = [0.8, 0, 0], down = [0, -0.8, 0], size = [64, 48] }
... picture = { corner = [-3, 3, -2.5], right = [6, 0, 0], down = [0, -6, 0] }
... medium = { n = 1.0 }
... lens = [{ surface = "torus", R = 0.7, r = 0.25, n = 1.5 }]
... ''')

Tracing it tells where the ray of every film pixel lands on the picture, (s, t) in [0, 1), and how it ended. The map
does not depend on any image, so one trace serves a whole folder:

>>> raymap = lenscl.trace(scene)
>>> raymap.st.shape, raymap.status.shape
((48, 64, 2), (48, 64))
>>> sum(raymap.counts().values()) == 48 * 64
True
>>> seen = int((raymap.events > 0).sum())  # pixels that show the lens
>>> 0.3 < seen / (48 * 64) < 0.6
True

Painting takes the colours; rays that miss the picture get the colour `outside`:

>>> import numpy as np
>>> checkers = np.indices((8, 8)).sum(axis=0) % 2 * np.uint8(255)
>>> lenscl.paint(raymap, checkers[:, :, None].astype(np.uint8), filter="nearest", outside=128).shape
(48, 64, 1)

Numbers are arguments of the kernel, so another lens of the same form is traced at once:

>>> before = lenscl.compile_count()
>>> thin = lenscl.trace(scene.replace({"lens.r": 0.1, "lens.n": 2.417}))
>>> lenscl.compile_count() - before
0

Any rays can be followed. This one goes through the hole of the torus, and meets nothing:

>>> paths = lenscl.trace_rays(scene, [[0, 0, 4]], [[0, 0, -1]])
>>> lenscl.RayStatus(paths.status[0]).name, int(paths.events[0]), paths.st[0].tolist()
('PICTURE', 0, [0.5, 0.5])

The kernel that did it can be read:

>>> raymap.kernel.text.splitlines()[0]
'// lenses   torus'
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lenscl.accuracy import trace, trace_rays
    from lenscl.config import load_study, scene_from_toml
    from lenscl.device import compile_count
    from lenscl.errors import LensclError, StudyError
    from lenscl.imaging import paint
    from lenscl.materials import refractive_index
    from lenscl.status import RayStatus

__all__ = [
    "LensclError",
    "RayStatus",
    "StudyError",
    "compile_count",
    "load_study",
    "paint",
    "refractive_index",
    "scene_from_toml",
    "trace",
    "trace_rays",
]

_HOMES = {
    "LensclError": "errors",
    "RayStatus": "status",
    "StudyError": "errors",
    "compile_count": "device",
    "load_study": "config",
    "paint": "imaging",
    "refractive_index": "materials",
    "scene_from_toml": "config",
    "trace": "accuracy",
    "trace_rays": "accuracy",
}  # imported when first used: `lenscl --help` must not wait for numpy or OpenCL


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'lenscl' has no attribute {name!r}")
    return getattr(import_module(f"lenscl.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return list(__all__)
