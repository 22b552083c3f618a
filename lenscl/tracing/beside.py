"""What a scene asks for beside the ray of each film pixel: more rays a pixel, and the light on its picture."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from lenscl.tracing.caustics import with_caustic
from lenscl.tracing.raymap import RayMap
from lenscl.tracing.samples import with_samples

# By the effect's key, what adds to a traced map all that its scene asks for of that
BESIDE: Mapping[str, Callable[[RayMap], RayMap]] = MappingProxyType(
    {"antialias": with_samples, "caustics": with_caustic}
)


def complete(raymap: RayMap) -> RayMap:
    """Return a traced map with all that its scene asks for: `samples` for antialias, `caustic` for caustics.

    Only what is handed on needs it; a map that is traced to plan, to time or to compare is complete as it is.

    Raises
    ------
    StudyError, TraceError
        As `with_samples` and `with_caustic`.
    """
    for added_to in BESIDE.values():
        raymap = added_to(raymap)
    return raymap
