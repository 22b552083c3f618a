"""What a scene asks for beside the ray of each film pixel: more rays a pixel, and the light on its picture."""

from __future__ import annotations

from lenscl.tracing.caustics import with_caustic
from lenscl.tracing.raymap import RayMap
from lenscl.tracing.samples import with_samples


def complete(raymap: RayMap) -> RayMap:
    """Return a traced map with all that its scene asks for: `samples` for antialias, `caustic` for caustics.

    Only what is handed on needs it; a map that is traced to plan, to time or to compare is complete as it is.

    Raises
    ------
    StudyError, TraceError
        As `with_samples` and `with_caustic`.
    """
    return with_caustic(with_samples(raymap))
