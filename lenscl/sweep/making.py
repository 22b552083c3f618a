"""Make a point: trace it, check it, paint its pictures, write the images.

    make_point(work, tools) -> PointResult        all of a point, from start to end
    images_of_point(work, tools) -> OnItsWay ...  the same image by image; each is being written while the next is made

There is one ray map at a time: it ends before the next point begins, whatever waits to be written.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from lenscl.accuracy import SelfCheck
from lenscl.device import means_lost
from lenscl.errors import NoDeviceError, StudyError
from lenscl.imaging import Encoding, Painter, painter_of
from lenscl.sweep.errors import RESUME, reason, stop_for
from lenscl.sweep.painting import refused_format
from lenscl.sweep.spans import Clock
from lenscl.sweep.store import Stamp
from lenscl.sweep.tools import Tools
from lenscl.sweep.work import ImageResult, ImageWork, MapSummary, PointResult, PointWork
from lenscl.tracing import RayMap


@dataclass(frozen=True, slots=True)
class OnItsWay:
    """An image that is being written, or that failed, with what is known of its point's map."""

    map: MapSummary | None
    written: Future[ImageResult]


def make_point(work: PointWork, tools: Tools) -> PointResult:
    """Trace a point, paint its pictures, write the images, and wait for them.

    Raises
    ------
    SweepError, NoDeviceError
        If no further work can be done either (see `lenscl.sweep.errors`). What fails for a reason of its own is in
        the result.
    """
    coming = list(images_of_point(work, tools))
    summaries = [each.map for each in coming if each.map is not None]
    return PointResult(
        index=work.index,
        map=summaries[-1] if summaries else None,
        images=tuple(each.written.result() for each in coming),
    )


def images_of_point(work: PointWork, tools: Tools) -> Iterator[OnItsWay]:
    """Yield the images of a point one by one, as soon as each is painted and on its way to disk.

    The point is traced when the first image needs it. Close the iterator, or take it to its end, before the next
    point is begun: until then it holds the map. Errors are as for `make_point`; those of writing are in the future.
    """
    making = _Making(work, tools)
    for image, following in zip(work.images, (*work.images[1:], None), strict=True):
        if following is not None:
            tools.pictures.prefetch(following.picture)
        yield making.begin(image)


def failed(output: Path, error: str) -> OnItsWay:
    """Return an image that cannot be made."""
    known: Future[ImageResult] = Future()
    known.set_result(ImageResult(output=output.name, state="failed", error=error))
    return OnItsWay(None, known)


@dataclass(frozen=True, slots=True)
class _Traced:
    """A point's map, ready to paint with, and what will stay of it."""

    painter: Painter
    summary: MapSummary


class _Making:
    """Makes the images of one point."""

    def __init__(self, work: PointWork, tools: Tools) -> None:
        self._work, self._tools = work, tools
        self._traced: _Traced | str | None = None  # a text: why it cannot be traced

    def begin(self, image: ImageWork) -> OnItsWay:
        """Decode, trace (once a point) and paint; hand the image to the writer. A lost device is tried once more."""
        clock = Clock()
        try:
            return self._begin(image, clock)
        except Exception as error:
            if not means_lost(error):
                return self._failed(image, error)
            self._reopen_device(error)
        try:
            return self._begin(image, clock)
        except Exception as error:
            if not means_lost(error):
                return self._failed(image, error)
            self._reopen_device(error)  # this point loses it, and the others may not
            self._traced = f"{reason(error)} (tried twice, the second time with the device opened anew)"
            return failed(image.output, self._traced)

    def _begin(self, image: ImageWork, clock: Clock) -> OnItsWay:
        tools, image_format = self._tools, self._work.format
        picture = tools.pictures.take(image.picture, clock)
        if (refused := refused_format(picture, image_format)) is not None:
            return failed(image.output, f"{image.picture.shown}: {refused}")
        if self._traced is None:
            self._traced = self._trace(clock)
        if isinstance(self._traced, str):
            return failed(image.output, self._traced)
        with clock.span("paint"):
            pixels, encoding = tools.steps.paint(
                self._traced.painter, picture, self._work.scene, image_format, tools.device_pictures
            )
        written = tools.writer.submit(lambda: _write(image, pixels, encoding, clock, tools), clock)
        return OnItsWay(self._traced.summary, written)

    def _trace(self, clock: Clock) -> _Traced | str:
        """Trace and check the point; a text says why that cannot be done."""
        work, tools = self._work, self._tools
        try:
            if work.scene.numerics.accuracy is not None:
                with clock.span("plan"), suppress(StudyError):  # which the trace meets again, and may get round
                    tools.planner.plan(work.like or work.scene, work.size)
            with clock.span("trace"):
                raymap, achieved = tools.steps.trace(tools.planner, work.scene, size=work.size, like=work.like)
            with clock.span("check"):
                checks = self._checked(raymap)
            summary = MapSummary(
                counts=raymap.counts(), trace_seconds=raymap.trace_seconds, device=raymap.device.label,
                kernel=raymap.kernel.key, checks=checks, achieved=achieved,
            )  # fmt: skip
            with clock.span("upload"):
                return _Traced(painter_of(raymap), summary)
        except Exception as error:
            if means_lost(error) or self._stops(error):
                raise
            return reason(error)  # one bad point fails alone

    def _checked(self, raymap: RayMap) -> SelfCheck:
        """Check a map by itself; whatever comes of it, the map is painted."""
        try:
            return self._tools.steps.check(raymap)
        except Exception as error:
            if means_lost(error) or self._stops(error):
                raise
            return SelfCheck(error=reason(error))

    def _stops(self, error: Exception) -> bool:
        return stop_for(error, self._work.images[0].output.parent) is not None

    def _failed(self, image: ImageWork, error: Exception) -> OnItsWay:
        """Return an image that failed, alone; or raise what ends the sweep."""
        if (stop := stop_for(error, image.output.parent)) is not None:
            raise stop from error
        return failed(image.output, reason(error))

    def _reopen_device(self, error: Exception) -> None:
        self._traced = None  # it lies on the device that was lost
        if not self._tools.reopen_device():
            label = self._tools.device.label
            raise NoDeviceError(f"{label}: is lost and does not come back ({reason(error)}); {RESUME}") from error


def _write(image: ImageWork, pixels: NDArray[Any], encoding: Encoding, clock: Clock, tools: Tools) -> ImageResult:
    """Encode and write an image; one that cannot be written fails alone, unless none can be."""
    output = image.output
    try:
        with clock.span("encode"):
            tools.steps.write(output, pixels, metadata=image.metadata, encoding=encoding)
        with clock.span("digest"):
            stamp = Stamp.of(output)
    except Exception as error:
        if (stop := stop_for(error, output.parent)) is not None:
            raise stop from error
        return ImageResult(output=output.name, state="failed", error=reason(error))
    seconds = clock.seconds
    return ImageResult(
        output=output.name, state="done", stamp=stamp, spans=dict(seconds),
        paint_seconds=seconds["paint"], write_seconds=seconds["encode"],
    )  # fmt: skip
