"""What a sweep says of its points at its end: how accurate they are, and what their self-checks found."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import click

from lenscl.accuracy import SelfCheck
from lenscl.cli.group import many, plain

if TYPE_CHECKING:
    from lenscl.sweep import Row

_MOST_NAMED = 10  # warnings printed one by one
_MOST_POINTS = 20  # numbers of points in one line


class PointFindings:
    """Taken from the rows of a sweep as they come, point by point."""

    def __init__(self) -> None:
        self._total = SelfCheck()
        self._point: int | None = None  # whose findings were taken last
        self._warnings: list[str] = []
        self._further = 0
        self._failed: list[int] = []  # points
        self._ways: Counter[str] = Counter()
        self._errors: dict[str, float] = {}  # the largest, by its unit

    @property
    def failed(self) -> bool:
        """Whether self-checks of some point failed, now or when it was made."""
        return bool(self._failed)

    def add(self, row: Row) -> None:
        """Take those of a row, unless another picture of its point had them."""
        if row.mark is not None and row.index not in self._failed[-1:]:
            self._failed.append(row.index)
        if row.checks is None or row.index == self._point:
            return
        self._point, found = row.index, SelfCheck.from_json(row.checks)
        self._total += found
        for text in found.warnings():
            if len(self._warnings) < _MOST_NAMED:
                self._warnings.append(f"warning: point {row.index}, {text}")
            else:
                self._further += 1
        if row.achieved is not None:
            self._ways[", ".join(str(value) for value in row.achieved["numerics"].values())] += 1
            unit = row.achieved["unit"]
            self._errors[unit] = max(self._errors.get(unit, 0.0), row.achieved["error"])

    def print(self) -> None:
        """Print one line of each kind for all points, and the first warnings."""
        if self._point is None:
            return
        if self._ways:
            ways = "; ".join(f"{many(count, 'point')} by {way}" for way, count in self._ways.most_common())
            errors = ", ".join(f"{error:.2g} {unit}" for unit, error in self._errors.items())
            click.echo(plain(f"accuracy: {ways}; 99 % within at most {errors}"), err=True)
        click.echo(plain(self._total.summary()), err=True)
        if self._failed:
            some = ", ".join(map(str, self._failed[:_MOST_POINTS]))
            rest = ", ..." if len(self._failed) > _MOST_POINTS else ""
            click.echo(f"self-checks failed at {many(len(self._failed), 'point')}: {some}{rest}", err=True)
        for text in self._warnings:
            click.echo(plain(text), err=True)
        if self._further:
            click.echo(f"... and {many(self._further, 'more warning')} of self-checks", err=True)
