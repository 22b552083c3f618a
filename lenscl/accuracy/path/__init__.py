"""One ray's path, event by event, with what makes it hard: what `lenscl explain` prints.

Input: a scene and a film pixel. Output: a `RayPath`, by `explain_pixel`. The points are those of the device's own
kernels, in the scene's method and precision. `values` are plain data, `follow` puts them together, `media` says between
which media a surface lies, `bracket` proves in float64 where the surface lies beside a traced point, `growth`
differentiates the path, and `proved` asks the oracle.
"""

from __future__ import annotations

from lenscl.accuracy.path.follow import explain_pixel
from lenscl.accuracy.path.values import Event, Proved, RayPath

__all__ = ["Event", "Proved", "RayPath", "explain_pixel"]
