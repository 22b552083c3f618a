"""What one process needs to make points: a device, what was learned of scenes, decoded pictures, and a writer.

A process has one `Tools` and makes point after point with it; `make_point` takes it beside the work. Nothing in it
crosses to another process.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from threading import BoundedSemaphore
from types import TracebackType
from typing import Any, Self, TypeVar

from numpy.typing import NDArray

from lenscl.accuracy import Achieved, Planner, SelfCheck, check_map
from lenscl.device import Device, answers, choose
from lenscl.imaging import Encoding, PictureCache, write_image
from lenscl.sweep.painting import paint_as_told
from lenscl.sweep.pictures import PictureReader
from lenscl.sweep.spans import Clock
from lenscl.tracing import RayMap

_Result = TypeVar("_Result")

ENCODERS = max(1, min(4, os.cpu_count() or 1))  # threads of a writer


@dataclass(frozen=True, slots=True, kw_only=True)
class Steps:
    """The functions that make a point, one after the other; tests put others in their places.

    Attributes
    ----------
    trace : callable
        As `Planner.trace`, the planner first.
    check : callable
        As `check_map`.
    paint : callable
        As `paint_as_told`.
    write : callable
        As `write_image`. It is called in a writer's thread.
    """

    trace: Callable[..., tuple[RayMap, Achieved | None]] = Planner.trace
    check: Callable[[RayMap], SelfCheck] = check_map
    paint: Callable[..., tuple[NDArray[Any], Encoding]] = paint_as_told
    write: Callable[..., None] = write_image


class Writer:
    """Runs jobs in threads; whoever submits waits while twice as many jobs as threads are on their way."""

    def __init__(self, threads: int = ENCODERS) -> None:
        self.most = 2 * threads  # jobs on their way
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="lenscl-encode")
        self._room = BoundedSemaphore(self.most)

    def submit(self, job: Callable[[], _Result], clock: Clock) -> Future[_Result]:
        """Have a job run as soon as a thread is free; the clock gets the time waited for room."""
        with clock.span("wait"):
            self._room.acquire()
        try:
            coming = self._pool.submit(job)
        except BaseException:
            self._room.release()
            raise
        coming.add_done_callback(lambda _: self._room.release())
        return coming

    def close(self) -> None:
        """Wait for all jobs to end."""
        self._pool.shutdown(wait=True)


class Tools:
    """What makes points in one process; use it from one thread, as a context manager.

    Parameters
    ----------
    device : Device, optional
        Where to trace and paint; default: the best one.
    steps : Steps
        The functions that make a point.
    encoders : int
        Threads that encode and write images.

    Attributes
    ----------
    planner : Planner
        Of the device.
    pictures : PictureReader
        Decoded pictures.
    device_pictures : PictureCache
        Pictures on the device.
    writer : Writer
    """

    def __init__(self, device: Device | None = None, *, steps: Steps | None = None, encoders: int = ENCODERS) -> None:
        self.device, self.steps = device or choose(), steps or Steps()
        self.planner, self.device_pictures = Planner(self.device), PictureCache(self.device)
        self.pictures, self.writer = PictureReader(), Writer(encoders)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.writer.close()
        self.pictures.close()

    def reopen_device(self) -> bool:
        """Take a new context of a device that was lost; return whether it answers.

        What was learned of scenes is learned anew, for the planner traces on the device.
        """
        self.device = replace(self.device)  # a copy has no context yet, and makes one when first used
        self.planner, self.device_pictures = Planner(self.device), PictureCache(self.device)
        return answers(self.device)
