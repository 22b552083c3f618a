"""Seconds of work by stage, as a sweep's table keeps them.

>>> clock = Clock()
>>> with clock.span("paint"):
...     pass
>>> clock.add("encode", 0.25)
>>> list(clock.seconds), clock.seconds["encode"]
(['paint', 'encode'], 0.25)
>>> total_spans([{"paint": 1.0}, {"paint": 0.5, "encode": 0.25}])
{'paint': 1.5, 'encode': 0.25}
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Literal, TypeAlias

Stage: TypeAlias = Literal["decode", "plan", "trace", "check", "upload", "paint", "encode", "digest", "wait", "commit"]
# decode   a picture file is read and decoded, in the reader's thread
# plan     numerics.accuracy chooses method and precision
# trace    the point's rays are traced, with the host's part of it
# check    the self-checks of the point
# upload   the map is put on the device to paint with
# paint    the picture is uploaded, painted and downloaded
# encode   the image is encoded, written and read back, in a writer's thread
# digest   the written file is digested, in a writer's thread
# wait     the sweep's own thread waits for a picture, for room among the images on their way, or for an image
# commit   the table is written


class Clock:
    """Adds up wall seconds by stage; use it from one thread at a time."""

    def __init__(self) -> None:
        self.seconds: dict[Stage, float] = {}

    def add(self, stage: Stage, seconds: float) -> None:
        """Add seconds to a stage."""
        self.seconds[stage] = self.seconds.get(stage, 0.0) + seconds

    @contextmanager
    def span(self, stage: Stage) -> Iterator[None]:
        """Add the time of a `with` block to a stage, however the block ends."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.add(stage, time.perf_counter() - start)


def total_spans(some: Iterable[Mapping[Stage, float]]) -> dict[Stage, float]:
    """Return the sum of several spans, stage by stage."""
    clock = Clock()
    for spans in some:
        for stage, seconds in spans.items():
            clock.add(stage, seconds)
    return clock.seconds
