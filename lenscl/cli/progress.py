"""How far a sweep is: a bar on standard error, and where its time went."""

from __future__ import annotations

import sys
from types import TracebackType
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from lenscl.sweep import Row


class Progress:
    """Counts rows; draws a bar if standard error is a terminal and the rows do not run through that terminal too."""

    def __init__(self, total: int) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
        from rich.progress import Progress as Bar

        is_drawn = sys.stderr.isatty() and not sys.stdout.isatty()
        self._bar = Bar(
            TextColumn("images"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(),
            TextColumn("{task.description}"), console=Console(stderr=True), disable=not is_drawn,
        )  # fmt: skip
        self._task = self._bar.add_task("", total=total)
        self._traced: set[int] = set()
        self._trace = self._paint = self._write = 0.0

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()

    def advance(self, row: Row) -> None:
        """Count one row, and its time if it was made just now."""
        self._bar.update(self._task, advance=1, description="" if row.error is None else f"failed: {row.picture}")
        if row.kept or row.state != "done":
            return
        if row.index not in self._traced:  # the pictures of a point share its trace
            self._traced = {row.index}
            self._trace += row.trace_seconds or 0.0
        self._paint += row.paint_seconds or 0.0
        self._write += row.write_seconds or 0.0

    def summary(self) -> str:
        """Return where the time went; encoding runs in several threads beside the rest."""
        return f"tracing {self._trace:.1f} s, painting {self._paint:.1f} s, encoding {self._write:.1f} s in threads"
