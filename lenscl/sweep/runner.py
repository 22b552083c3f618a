"""Carry a plan out: decoding, tracing with painting, and encoding run side by side.

    reader thread      this thread                        encoder threads
    next picture  ->   trace a point, paint a picture  -> encode, write, hash
                       note results in the table, in work order

Memory is bounded: one ray map, the pictures kept by the reader and on the device, and as many painted images as may be
on their way to disk. This thread alone writes the table. A run whose image is on disk but not yet noted is simply made
again.
"""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from lenscl.accuracy import Achieved, Planner, SelfCheck, check_map, largest_size
from lenscl.config import Point, Scene
from lenscl.device import Device, choose
from lenscl.errors import LensclError, NoDeviceError, StudyError
from lenscl.imaging import Encoding, Painter, PictureCache, painter_of, write_image
from lenscl.sweep.cleaning import clear_folder, remove_leftovers
from lenscl.sweep.errors import SweepError
from lenscl.sweep.lock import folder_lock
from lenscl.sweep.painting import paint_as_told, refused_format
from lenscl.sweep.pictures import PictureReader
from lenscl.sweep.plan import SweepPlan, structure_text
from lenscl.sweep.rows import Row
from lenscl.sweep.store import Planned, Stamp, Store
from lenscl.tracing import RayMap

_ENCODERS = max(1, min(4, os.cpu_count() or 1))
_LONGEST_REASON = 1000  # characters of an error that a row keeps
_IN_FLIGHT = 2 * _ENCODERS  # painted images on their way to disk, at most


def run_sweep(
    plan: SweepPlan, *, fresh: bool = False, device: Device | None = None, stop: Callable[[], bool] | None = None
) -> Generator[Row, None, None]:
    """Do what a plan lists and is not done yet; yield every row in work order as soon as it is settled.

    Parameters
    ----------
    plan : SweepPlan
        The work.
    fresh : bool
        Remove what earlier runs made in the plan's folder, and start over.
    device : Device, optional
        Where to trace and paint; default: the best one.
    stop : callable, optional
        Asked before every line of the work list and every image. Once it says True no more work is begun, what is on
        its way is finished and noted, and the rows end; a work list not yet written to its end leaves no trace. What
        is on its way is noted, too, when the iteration is given up.

    Raises
    ------
    SweepError
        If the folder or its table cannot be used, another sweep is at work in it, or another study's images in it
        would be replaced.
    NoDeviceError
        If no OpenCL device works. Any other failure is the row's: its `state` is "failed" and its `error` says why.
    """
    device, stop = device or choose(), stop or (lambda: False)
    with ExitStack() as stack:
        stack.enter_context(folder_lock(plan.out))
        remove_leftovers(plan.out)
        if fresh:
            clear_folder(plan.out)
        store = stack.enter_context(Store.writing(plan.out))
        about = {
            "title": plan.study.title,
            "axes": list(plan.study.axes),
            "accuracy": plan.asks_accuracy,
            "program": plan.program,
        }
        if plan.study.path is not None:
            about["study"] = plan.study_mark
        try:
            _check_study(plan, store, _unless_stopped(plan.runs(), stop))
            store.plan(_unless_stopped(plan.runs(), stop), about)
        except _StoppedError:
            return
        reader = stack.enter_context(PictureReader(plan.pictures))
        encoders = stack.enter_context(ThreadPoolExecutor(_ENCODERS, thread_name_prefix="lenscl-encode"))
        yield from _Runner(plan, store, reader, encoders, device, stop).rows()


@dataclass(frozen=True, slots=True)
class _Task:
    """One row of the table with what it takes to make it."""

    point: Point
    picture: int
    row: Row


@dataclass(frozen=True, slots=True)
class _Traced:
    """A point's map, with what is known of it."""

    raymap: RayMap
    painter: Painter
    checks: SelfCheck
    achieved: Achieved | None


@dataclass(frozen=True, slots=True)
class _Painted:
    """An image on its way to disk."""

    traced: _Traced
    paint_seconds: float
    written: Future[tuple[float, Stamp]]


@dataclass
class _Runner:
    plan: SweepPlan
    store: Store
    reader: PictureReader
    encoders: ThreadPoolExecutor
    device: Device
    stop: Callable[[], bool]

    def __post_init__(self) -> None:
        # What is settled or on its way, in work order: kept from before, painted, or the text of a failure
        self._line: deque[tuple[Row, _Painted | str | None]] = deque()
        self._point: int | None = None  # the one at hand, and what its trace yielded or why it failed
        self._traced: _Traced | str = ""
        self._planner = Planner(self.device)
        self._pictures = PictureCache(self.device)
        self._size = largest_size(self.plan.study.scene, self.plan.study.images)
        self._first: dict[str, Scene | None] = {}  # of the points of one structure, the scene of the first

    def rows(self) -> Iterator[Row]:
        """Work through the list; see `run_sweep`."""
        try:
            for task, following in _with_next(self._tasks()):
                if self.stop():
                    break
                if following is not None and following.row.state != "done":
                    self.reader.prefetch(following.picture)
                self._line.append((task.row, None if task.row.state == "done" else self._begin(task)))
                yield from self._settled(room_for=_IN_FLIGHT)
            yield from self._settled(room_for=0)
        finally:
            for _ in self._settled(room_for=0):  # given up by the caller, or by an error: note what is on its way
                pass

    def _tasks(self) -> Iterator[_Task]:
        for point in self.plan.study.points():
            for number, row in enumerate(list(self.store.rows(point.index))):
                yield _Task(point, number, row)

    def _begin(self, task: _Task) -> _Painted | str:
        """Decode, trace (once a point) and paint; hand the image to the encoders. A text says why it failed."""
        try:
            picture, image_format = self.reader.take(task.picture), self.plan.study.output.format
            if (refused := refused_format(picture, image_format)) is not None:
                return f"{task.row.picture}: {refused}"
            traced = self._trace(task.point)
            if isinstance(traced, str):
                return traced
            start = time.perf_counter()
            painted, encoding = paint_as_told(traced.painter, picture, task.point.scene, image_format, self._pictures)
            seconds = time.perf_counter() - start
        except NoDeviceError:
            raise
        except Exception as error:  # one bad picture fails alone, whatever is wrong with it
            return _reason(error)
        path = self.plan.out / task.row.output
        metadata = self.plan.metadata(task.point, self.plan.pictures[task.picture])
        return _Painted(traced, seconds, self.encoders.submit(_write, path, painted, metadata, encoding))

    def _trace(self, point: Point) -> _Traced | str:
        if self._point != point.index:
            self._point, self._traced = point.index, ""  # let go of the last map before the next one is made
            try:
                scene, like = self.plan.scene_of(point), self._like(point)
                raymap, achieved = self._planner.trace(scene, size=self._size, like=like)
                self._traced = _Traced(raymap, painter_of(raymap), _checked(raymap), achieved)
            except NoDeviceError:
                raise
            except Exception as error:  # one bad point fails alone
                self._traced = _reason(error)
        return self._traced

    def _like(self, point: Point) -> Scene | None:
        """Return the scene whose plan serves all points of this one's structure: the first in the study's order.

        It is the same one whatever an earlier run has done already, so that a sweep that goes on makes what it would
        have made in one go.
        """
        if point.scene.numerics.accuracy is None:
            return None
        text = structure_text(point)
        if text not in self._first:
            first = next(other for other, structure in self.plan.structures() if structure == text)
            try:
                self._first[text] = self.plan.scene_of(first)
            except StudyError:  # it fails alone, and the others plan for themselves
                self._first[text] = None
        return self._first[text]

    def _settled(self, *, room_for: int) -> Iterator[Row]:
        """Note and yield, in order, what is ready; wait while more than `room_for` are on their way."""
        while self._line:
            row, outcome = self._line[0]
            if isinstance(outcome, _Painted) and not outcome.written.done() and len(self._line) <= room_for:
                return
            self._line.popleft()
            if outcome is None:
                yield replace(row, kept=True)
                continue
            self._note(row, outcome)
            yield self.store.row(row.output)

    def _note(self, row: Row, outcome: _Painted | str) -> None:
        if isinstance(outcome, str):
            self.store.fail(row.output, outcome)
            return
        try:
            write_seconds, stamp = outcome.written.result()
        except Exception as error:  # an image that cannot be written fails alone
            self.store.fail(row.output, _reason(error))
            return
        raymap, achieved = outcome.traced.raymap, outcome.traced.achieved
        self.store.finish(
            row.output,
            counts=raymap.counts(),
            seconds=(raymap.trace_seconds, outcome.paint_seconds, write_seconds),
            stamp=stamp,
            device=raymap.device.label,
            kernel=raymap.kernel.key,
            checks=outcome.traced.checks.as_json(),
            achieved=None if achieved is None else achieved.as_json(),
        )


def _checked(raymap: RayMap) -> SelfCheck:
    """Check a map by itself; whatever comes of it, the map is painted."""
    try:
        return check_map(raymap)
    except Exception as error:
        return SelfCheck(error=_reason(error))


def _write(path: Path, pixels: NDArray[Any], metadata: dict[str, Any], encoding: Encoding) -> tuple[float, Stamp]:
    start = time.perf_counter()
    write_image(path, pixels, metadata=metadata, encoding=encoding)
    return time.perf_counter() - start, Stamp.of(path)


def _check_study(plan: SweepPlan, store: Store, runs: Iterable[Planned]) -> None:
    """Refuse to replace what another study made; one that was moved meets its own images, and goes on."""
    if plan.study.path is None or store.about("study") in (None, plan.study_mark):
        return
    if (output := store.first_replaced(runs)) is not None:
        raise SweepError(
            f"{plan.out}: holds images of another study ({store.about('title')!r}), and {output} would be replaced; "
            "choose another folder with -o, or remove those images with --fresh"
        )


class _StoppedError(Exception):
    """The work list was not written down to its end."""


def _unless_stopped(runs: Iterable[Planned], stop: Callable[[], bool]) -> Iterator[Planned]:
    for run in runs:
        if stop():
            raise _StoppedError
        yield run


def _reason(error: Exception) -> str:
    """Return an error as one line, of a driver's log the start; one that is not ours carries its kind."""
    text = " ".join(str(error).encode("utf-8", "backslashreplace").decode().split())
    if len(text) > _LONGEST_REASON:
        text = text[: _LONGEST_REASON - 3] + "..."
    return text if isinstance(error, LensclError) else f"{type(error).__name__}: {text}"


def _with_next(tasks: Iterable[_Task]) -> Iterator[tuple[_Task, _Task | None]]:
    """Yield each task with the one after it; None after the last."""
    previous = None
    for task in chain(tasks, [None]):
        if previous is not None:
            yield previous, task
        previous = task
