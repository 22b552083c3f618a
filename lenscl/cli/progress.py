"""How far a long command is, on standard error: a bar; for a sweep also where its time went."""

from __future__ import annotations

import sys
from types import TracebackType
from typing import TYPE_CHECKING, Self

import click

from lenscl.cli.group import plain

if TYPE_CHECKING:
    from lenscl.hardcases import Case
    from lenscl.sweep import Row


class _Bar:
    """A bar that counts up to a total, or nothing where it is not drawn."""

    def __init__(self, noun: str, total: int, *, is_drawn: bool) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        self._bar = Progress(
            TextColumn(noun), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(),
            TextColumn("{task.description}", markup=False),  # a picture's name may hold what rich takes for markup
            console=Console(stderr=True), disable=not is_drawn,
        )  # fmt: skip
        self._task = self._bar.add_task("", total=total)

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()

    def _show(self, description: str, *, advance: int = 0) -> None:
        self._bar.update(self._task, advance=advance, description=plain(description))


class Progress(_Bar):
    """Counts rows; draws a bar if standard error is a terminal and the rows do not run through that terminal too."""

    def __init__(self, total: int) -> None:
        super().__init__("images", total, is_drawn=sys.stderr.isatty() and not sys.stdout.isatty())
        self._traced: set[int] = set()
        self._trace = self._paint = self._write = 0.0

    def advance(self, row: Row) -> None:
        """Count one row, and its time if it was made just now."""
        self._show("" if row.error is None else f"failed: {row.picture}", advance=1)
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


class CaseProgress(_Bar):
    """Tells which case is run: by a bar if standard error is a terminal, elsewhere by a line for each family."""

    def __init__(self, total: int) -> None:
        self._is_drawn = sys.stderr.isatty()
        super().__init__("cases", total, is_drawn=self._is_drawn)
        self._total, self._begun = total, 0
        self._family = ""

    def begin(self, case: Case) -> None:
        """Tell of a case before it is run; the one before is done."""
        self._show(case.name, advance=1 if self._begun else 0)
        self._begun += 1
        if not self._is_drawn and case.family != self._family:
            self._family = case.family
            click.echo(plain(f"{self._begun} of {self._total} cases: {case.family}"), err=True)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:  # so that the last one is done, too
            self._show("", advance=1)
        super().__exit__(kind, error, trace)
