"""Carry a plan out: schedule its units of work, note what comes of them in the table, yield the rows in work order.

    reader thread      this thread                                 writer's threads
    next picture  ->   a point's images, one by one (making.py)  ->  encode, write, digest
                       note results in the table, in work order

Memory is bounded: one ray map, the pictures kept by the reader and on the device, and as many painted images as the
writer lets be on their way to disk. This thread alone writes the table. A run whose image is on disk but not yet noted
is simply made again.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import TypeVar

from lenscl.config import Point
from lenscl.device import Device, choose
from lenscl.errors import LensclError
from lenscl.sweep.cleaning import clear_folder, remove_leftovers
from lenscl.sweep.errors import SweepError, reason, stop_for
from lenscl.sweep.lock import folder_lock
from lenscl.sweep.making import OnItsWay, failed, images_of_point
from lenscl.sweep.plan import SweepPlan
from lenscl.sweep.rows import Row
from lenscl.sweep.spans import Clock, total_spans
from lenscl.sweep.store import Planned, Store
from lenscl.sweep.tools import ENCODERS, Steps, Tools

_Item = TypeVar("_Item")


def run_sweep(
    plan: SweepPlan,
    *,
    fresh: bool = False,
    device: Device | None = None,
    stop: Callable[[], bool] | None = None,
    steps: Steps | None = None,
    encoders: int = ENCODERS,
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
    steps : Steps, optional
        Other functions in the place of those that make a point.
    encoders : int
        Threads that encode and write images; twice as many images are on their way to disk at most.

    Raises
    ------
    SweepError
        If the folder or its table cannot be used, another sweep is at work in it, or another study's images in it
        would be replaced; or if the disk gets full, or the folder vanishes, while the sweep runs.
    NoDeviceError
        If no OpenCL device works, or the one at work is lost and does not come back.

    Notes
    -----
    What is raised once images were made ends the sweep; its message says how to resume, and what was made before is
    noted. Any other failure is the row's: its `state` is "failed" and its `error` says why.
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
        tools = stack.enter_context(Tools(device, steps=steps, encoders=encoders))
        yield from _Runner(plan, store, tools, stop).rows()


@dataclass
class _Runner:
    """The schedule of one run: which image comes next, and which rows are settled."""

    plan: SweepPlan
    store: Store
    tools: Tools
    stop: Callable[[], bool]
    _line: deque[tuple[Row, OnItsWay | None]] = field(default_factory=deque)  # in work order; None: kept from before
    _clock: Clock = field(default_factory=Clock)  # of this thread, since the last row was noted

    def rows(self) -> Iterator[Row]:
        """Work through the list; see `run_sweep`."""
        try:
            with closing(self._begun()) as begun:
                for row, image in begun:
                    self._line.append((row, image))
                    yield from self._settled(room_for=self.tools.writer.most)
            yield from self._settled(room_for=0)
        except GeneratorExit:  # given up by the caller
            for _ in self._settled(room_for=0):
                pass
            raise
        except BaseException:  # this is what is told, whatever else goes wrong with what is on its way
            self._note_what_is_whole()
            raise

    def _begun(self) -> Generator[tuple[Row, OnItsWay | None], None, None]:
        """Yield every row with its image on its way, None if it is kept; one ray map is alive at a time."""
        for (point, rows), following in _with_next(self._points()):
            pending = [number for number, row in enumerate(rows) if row.state != "done"]
            with closing(self._images(point, pending)) as images:
                for number, row in enumerate(rows):
                    if self.stop():
                        return
                    if pending and number == pending[-1] and following is not None:
                        self._prefetch(following[1])
                    yield row, None if row.state == "done" else next(images)

    def _points(self) -> Iterator[tuple[Point, list[Row]]]:
        for point in self.plan.study.points():
            yield point, list(self.store.rows(point.index))

    def _images(self, point: Point, numbers: list[int]) -> Generator[OnItsWay, None, None]:
        """Yield some images of a point, by the numbers of their pictures."""
        try:
            work = self.plan.work_at(point, numbers)
        except Exception as error:
            if (stop := stop_for(error, self.plan.out)) is not None:
                raise stop from error
            for number in numbers:  # one bad point fails alone
                output = self.plan.output_name(point.index, self.plan.pictures[number])
                yield failed(self.plan.out / output, reason(error))
            return
        yield from images_of_point(work, self.tools)

    def _prefetch(self, rows: list[Row]) -> None:
        """Start decoding the first picture that a point will need."""
        first = next((number for number, row in enumerate(rows) if row.state != "done"), None)
        if first is not None:
            self.tools.pictures.prefetch(self.plan.pictures[first])

    def _settled(self, *, room_for: int) -> Iterator[Row]:
        """Note and yield, in order, what is ready; wait while more than `room_for` are on their way."""
        while self._line:
            row, image = self._line[0]
            if image is not None and not image.written.done() and len(self._line) <= room_for:
                return
            self._line.popleft()
            if image is None:
                yield replace(row, kept=True)
                continue
            self._note(row, image)
            yield self.store.row(row.output)

    def _note(self, row: Row, image: OnItsWay) -> None:
        with self._clock.span("wait"):
            made = image.written.result()
        self.store.check_in_place()
        if made.state == "failed" or image.map is None or made.stamp is None:
            self.store.fail(row.output, made.error or "")
            return
        traced, spent = image.map, self._clock
        self._clock = Clock()
        with self._clock.span("commit"):  # which the next row tells
            self.store.finish(
                row.output,
                counts=traced.counts,
                seconds=(traced.trace_seconds, made.paint_seconds, made.write_seconds),
                stamp=made.stamp,
                device=traced.device,
                kernel=traced.kernel,
                checks=traced.checks.as_json(),
                achieved=None if traced.achieved is None else traced.achieved.as_json(),
                spans=total_spans([made.spans, spent.seconds]),
            )

    def _note_what_is_whole(self) -> None:
        """Note the images on their way that come to be written, as far as the table can still be used."""
        while self._line:
            row, image = self._line.popleft()
            if image is not None:
                with suppress(LensclError):
                    self._note(row, image)


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


def _with_next(items: Iterable[_Item]) -> Iterator[tuple[_Item, _Item | None]]:
    """Yield each item with the one after it; None after the last."""
    previous: list[_Item] = []
    for item in chain(items, [None]):
        if previous:
            yield previous.pop(), item
        if item is not None:
            previous.append(item)
