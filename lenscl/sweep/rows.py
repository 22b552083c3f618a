"""One row of results, and a table of them as CSV.

>>> row = Row(output="00003-cat.png", index=3, values={"lens.r": 0.25}, picture="cat.jpg", state="failed", error="gone")
>>> header(["lens.r"])[:5]
['index', 'lens.r', 'picture', 'on_picture', 'off_picture']
>>> cells(row, ["lens.r"])[:3], cells(row, ["lens.r"])[-1]
(['3', '0.25', 'cat.jpg'], 'gone')
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

from lenscl.accuracy import SelfCheck
from lenscl.status import RayStatus
from lenscl.sweep.spans import Stage

State: TypeAlias = Literal["pending", "done", "failed"]

# A column a status, in lower case; PICTURE alone is called otherwise, for `picture` is the column of the image's name
COUNT_COLUMNS: Mapping[RayStatus, str] = {
    status: "on_picture" if status is RayStatus.PICTURE else status.name.lower() for status in RayStatus
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """The result of one picture seen at one point of a study.

    Seconds are None where nothing was timed. `trace_seconds` is the device's time for the point's trace, which all
    pictures of the point share; `paint_seconds` and `write_seconds` (encoding included) are wall time of this one.
    """

    output: str  # file name in the sweep's folder
    index: int  # of the point
    values: Mapping[str, Any]  # axis key -> value
    picture: str
    state: State
    counts: Mapping[RayStatus, int] | None = None
    trace_seconds: float | None = None
    paint_seconds: float | None = None
    write_seconds: float | None = None
    error: str | None = None
    checks: Mapping[str, Any] | None = None  # what the self-checks of its point's trace found, as `SelfCheck.as_json`
    achieved: Mapping[str, Any] | None = None  # how accurate its point's trace is, as `Achieved.as_json`, where asked
    spans: Mapping[Stage, float] | None = None  # wall seconds by stage; the first image of a point has what they share
    kept: bool = False  # made by an earlier run

    @property
    def seconds(self) -> float | None:
        """What this image alone would have taken: trace, paint, encode and write; None if it was not made."""
        parts = (self.trace_seconds, self.paint_seconds, self.write_seconds)
        return sum(part for part in parts if part is not None) if self.state == "done" else None

    @property
    def mark(self) -> str | None:
        """What a row that was made says of self-checks that failed, the first of them in full; None where none did."""
        if self.state != "done" or self.checks is None:
            return None
        found = SelfCheck.from_json(self.checks)
        if not found.failed:
            return None
        first = next(found.warnings(), "")
        return f"self-checks: {found.failed} FAILED among {found.rays} rays{first and ': '}{first}"


def header(axes: Iterable[str], *, accuracy: bool = False) -> list[str]:
    """Return the names of the columns; with two more at the end where a study asks for an accuracy."""
    more = ["achieved", "traced_by"] if accuracy else []
    return ["index", *axes, "picture", *COUNT_COLUMNS.values(), "seconds", "output", "error", *more]


def cells(row: Row, axes: Iterable[str], folder: Path | None = None, *, accuracy: bool = False) -> list[str]:
    """Return a row's cells, in the order of `header`.

    Parameters
    ----------
    row : Row
        What to print.
    axes : iterable of str
        The study's axes in order.
    folder : Path, optional
        Put before the output's name, so that the cell can be opened from where one stands. A row whose output was made
        has an `error` as well where self-checks of its point failed.
    accuracy : bool
        As for `header`: the error that 99 % of the rays land within, in the unit asked for, and the method and
        precision that were chosen.
    """
    counts = row.counts or {}
    output = row.output if folder is None else str(folder / row.output)
    return [
        str(row.index),
        *(_cell(row.values.get(axis)) for axis in axes),
        row.picture,
        *(str(counts[status]) if status in counts else "" for status in COUNT_COLUMNS),
        "" if row.seconds is None else f"{row.seconds:.6f}",
        output if row.state == "done" else "",
        row.error or row.mark or "",
        *(_achieved(row) if accuracy else ()),
    ]


def csv_lines(
    rows: Iterable[Row], axes: Sequence[str], folder: Path | None = None, *, accuracy: bool = False
) -> Iterator[str]:
    """Yield the table as CSV (RFC 4180, lines ending in a newline), the header first, each row as it comes."""
    yield csv_line(header(axes, accuracy=accuracy))
    for row in rows:
        yield csv_line(cells(row, axes, folder, accuracy=accuracy))


def csv_line(values: Iterable[str]) -> str:
    """Return one line of CSV, without its newline."""
    line = io.StringIO()
    csv.writer(line, lineterminator="").writerow(values)
    return line.getvalue()


def _achieved(row: Row) -> tuple[str, str]:
    if row.achieved is None:
        return "", ""
    numerics = row.achieved["numerics"]
    return f"{row.achieved['error']:.3g}", ", ".join(str(value) for value in numerics.values())


def _cell(value: Any) -> str:
    """Return text as it is, and anything else as JSON: 0.25, true, [0.0, 1.0]; nothing for a value left out."""
    if value is None:
        return ""
    return value if isinstance(value, str) else json.dumps(value)
