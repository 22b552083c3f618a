"""The table of a sweep: one SQLite file beside the images, one row a run, one writer.

Every run is written down as pending before the first one starts, so the table's states are the whole of resuming. A
run is known by the name of its output and by its key, which stands for everything that its bytes depend on. What was
done under the same key, and whose output is still what was written, is kept; all else is pending again.

An output is taken for unchanged if its size and its time of change are those noted when it was written. If only the
time differs (a copied folder) its content is compared. A change that keeps both size and time is not noticed.

Rows of an earlier form of the study, whose outputs the present form does not make, stay with position NULL.
"""

from __future__ import annotations

import hashlib
import json
import os
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Self

from lenscl.status import RayStatus
from lenscl.sweep.errors import SweepError, explained
from lenscl.sweep.rows import Row
from lenscl.sweep.schema import SCHEMA, STORE_NAME, check_schema, columns, is_empty, migration
from lenscl.sweep.spans import Stage

# A planned run keeps what is known of it if it was done under the same key; otherwise it is pending, and blank
_RESULTS = (
    "counts", "trace_seconds", "paint_seconds", "write_seconds", "size", "changed_ns", "digest", "device", "kernel",
    "checks", "achieved", "spans",
)  # fmt: skip
_IS_KEPT = "run.key = excluded.key AND run.state = 'done'"
_PLAN = f"""
INSERT INTO run (output, position, point, parameters, picture, key, state) VALUES (?, ?, ?, ?, ?, ?, 'pending')
ON CONFLICT (output) DO UPDATE SET
    position = excluded.position, point = excluded.point, parameters = excluded.parameters,
    picture = excluded.picture, key = excluded.key, error = NULL,
    state = CASE WHEN {_IS_KEPT} THEN 'done' ELSE 'pending' END,
    {", ".join(f"{name} = CASE WHEN {_IS_KEPT} THEN run.{name} END" for name in _RESULTS)}
"""
_RESET = f"UPDATE run SET {', '.join(f'{name} = NULL' for name in _RESULTS)}, state = ?, error = ? WHERE output = ?"
_ROW_COLUMNS = (
    "output", "point", "parameters", "picture", "state", "counts", "trace_seconds", "paint_seconds", "write_seconds",
    "error", "checks", "achieved", "spans",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Planned:
    """A run as the work list has it."""

    output: str
    position: int
    point: int
    values: Mapping[str, Any]
    picture: str
    key: str


@dataclass(frozen=True, slots=True)
class Stamp:
    """An output as it was written."""

    size: int
    changed_ns: int
    digest: str

    @classmethod
    def of(cls, path: Path) -> Self:
        """Read a file's size, time of change and content."""
        with path.open("rb") as file:
            about = os.fstat(file.fileno())
            return cls(about.st_size, about.st_mtime_ns, hashlib.file_digest(file, "sha256").hexdigest())

    def matches(self, path: Path) -> bool:
        """Whether a file is still what was written (see the module's docstring for what is compared)."""
        try:
            about = path.stat()
            if about.st_size != self.size:
                return False
            return about.st_mtime_ns == self.changed_ns or Stamp.of(path).digest == self.digest
        except OSError:
            return False


class Store:
    """An open table; use it from one thread.

    Attributes
    ----------
    path : Path
    plan_statement : str
        SQL that writes a line of the work list down, and decides what is kept of the run that stood there.
    """

    plan_statement: ClassVar[str] = _PLAN

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path, self.connection = path, connection
        self._identity = _identity(path)
        there = columns(connection)  # a table of an earlier schema that is only read has not got all of them
        self._row_columns = ", ".join(name if name in there else f"NULL AS {name}" for name in _ROW_COLUMNS)

    @classmethod
    @contextmanager
    def writing(cls, folder: Path) -> Iterator[Self]:
        """Open a folder's table for its one writer, making it if it is missing; one of an earlier schema is brought up.

        Raises
        ------
        SweepError
            If it cannot be used: no database, of a later schema, read-only, disk full.
        """
        path = folder / STORE_NAME
        with explained(path):
            connection = sqlite3.connect(path, timeout=5, isolation_level=None)
        try:
            with explained(path):
                is_new = is_empty(connection)
                if not is_new:
                    check_schema(path, connection)  # before anything in somebody else's file is changed
                connection.execute("PRAGMA journal_mode = WAL")
                connection.execute("PRAGMA synchronous = NORMAL")  # a killed process loses nothing committed
                connection.executescript(f"BEGIN; {SCHEMA if is_new else migration(connection)} COMMIT;")
                store = cls(path, connection)
            yield store
        finally:
            with suppress(sqlite3.Error):  # at rest it is one file again, which readers need nothing beside
                connection.execute("PRAGMA busy_timeout = 0")  # unless somebody is reading it just now
                connection.execute("PRAGMA journal_mode = DELETE")
            connection.close()

    @classmethod
    @contextmanager
    def reading(cls, folder: Path) -> Iterator[Self]:
        """Open a folder's table to read it, also while a sweep is writing it.

        Raises
        ------
        SweepError
            If there is none, or it cannot be read.
        """
        path = folder / STORE_NAME
        if not os.path.isfile(path):  # which is False, too, where the folder may not be looked into
            raise SweepError(f"{path}: no such file; expected the folder of a sweep, as `lenscl sweep -o` makes it")
        # A table in WAL mode needs a file beside it even to be read, unless it is declared to be at rest
        at_rest = "" if os.access(folder, os.W_OK) else "&immutable=1"
        with explained(path):
            connection = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro{at_rest}", uri=True, timeout=5)
        try:
            with explained(path):
                check_schema(path, connection)
                store = cls(path, connection)
            yield store
        finally:
            connection.close()

    def plan(self, runs: Iterable[Planned], about: Mapping[str, Any]) -> None:
        """Write the whole work list down, in one transaction: what is still valid stays done, all else is pending."""
        with self.transaction() as execute:
            execute.execute("UPDATE run SET position = NULL")
            execute.executemany(
                self.plan_statement, ((r.output, r.position, r.point, _json(r.values), r.picture, r.key) for r in runs)
            )
            execute.executemany(
                "INSERT OR REPLACE INTO about VALUES (?, ?)", ((name, _json(value)) for name, value in about.items())
            )
            claimed = execute.execute(
                "SELECT output, size, changed_ns, digest FROM run WHERE state = 'done' AND position IS NOT NULL"
            )
            folder = self.path.parent
            changed = [output for output, *stamp in claimed if not Stamp(*stamp).matches(folder / output)]
            execute.executemany(_RESET, (("pending", None, output) for output in changed))

    def first_replaced(self, runs: Iterable[Planned]) -> str | None:
        """Return the first output that is done, still there, and would be made anew under another key."""
        with explained(self.path):
            for run in runs:
                found = self.connection.execute(
                    "SELECT 1 FROM run WHERE output = ? AND key <> ? AND state = 'done'", (run.output, run.key)
                )
                if found.fetchone() is not None and (self.path.parent / run.output).exists():
                    return run.output
        return None

    def finish(self, output: str, *, counts: Mapping[RayStatus, int], seconds: tuple[float, float, float],
               stamp: Stamp, device: str, kernel: str, checks: Mapping[str, Any] | None = None,
               achieved: Mapping[str, Any] | None = None, spans: Mapping[Stage, float] | None = None,
               ) -> None:  # fmt: skip
        """Note that an output was made; `seconds` are those of its trace, paint and write, `spans` those by stage."""
        with self.transaction() as execute:
            execute.execute(
                "UPDATE run SET state = 'done', counts = ?, trace_seconds = ?, paint_seconds = ?, write_seconds = ?, "
                "size = ?, changed_ns = ?, digest = ?, device = ?, kernel = ?, checks = ?, achieved = ?, spans = ?, "
                "error = NULL WHERE output = ?",
                (_json({status.name.lower(): int(n) for status, n in counts.items()}), *seconds,
                 stamp.size, stamp.changed_ns, stamp.digest, device, kernel,
                 *(None if each is None else _json(each) for each in (checks, achieved, spans)), output),
            )  # fmt: skip

    def fail(self, output: str, error: str) -> None:
        """Note why an output could not be made."""
        with self.transaction() as execute:
            execute.execute(_RESET, ("failed", error, output))

    def check_in_place(self) -> None:
        """Check that the file is still the one that was opened: SQLite goes on writing one that was removed.

        Raises
        ------
        SweepError
            If it is gone, or another one is in its place.
        """
        if _identity(self.path) != self._identity:
            raise SweepError(
                f"{self.path}: is gone, or was replaced; put its folder back and run the same command again, "
                "which keeps what is still there"
            )

    def about(self, name: str) -> Any:
        """Return what was noted of the sweep: "title", "axes", "program" or "study", a mark of the study's file."""
        with explained(self.path):
            found = self.connection.execute("SELECT value FROM about WHERE name = ?", (name,)).fetchone()
        return None if found is None else json.loads(found[0])

    def rows(self, point: int | None = None) -> Iterator[Row]:
        """Yield the rows of the work list in its order, or those of one point."""
        where = "position IS NOT NULL" if point is None else "position IS NOT NULL AND point = ?"
        with explained(self.path):
            found = self.connection.execute(
                f"SELECT {self._row_columns} FROM run WHERE {where} ORDER BY position",
                () if point is None else (point,),
            )
            for record in found:
                yield _row(*record)

    def row(self, output: str) -> Row:
        """Return the row of one output."""
        with explained(self.path):
            found = self.connection.execute(f"SELECT {self._row_columns} FROM run WHERE output = ?", (output,))
            return _row(*found.fetchone())

    def outputs(self) -> list[str]:
        """Return the name of every output ever planned here, those of earlier forms of the study included."""
        with explained(self.path):
            return [output for (output,) in self.connection.execute("SELECT output FROM run")]

    def left_over(self) -> int:
        """Return how many outputs of earlier forms of the study lie in the folder."""
        with explained(self.path):
            found = self.connection.execute("SELECT output FROM run WHERE position IS NULL AND state = 'done'")
            return sum((self.path.parent / output).exists() for (output,) in found)

    @contextmanager
    def transaction(self) -> Iterator[sqlite3.Connection]:
        """Give the connection for statements that are all carried out, or none of them."""
        with explained(self.path):
            self.connection.execute("BEGIN IMMEDIATE")
            try:
                yield self.connection
                self.connection.execute("COMMIT")
            except BaseException:
                if self.connection.in_transaction:  # SQLite itself rolls back on some errors
                    self.connection.execute("ROLLBACK")
                raise


def _row(output: str, point: int, parameters: str, picture: str, state: Any, counts: str | None,
         trace_seconds: float | None, paint_seconds: float | None, write_seconds: float | None,
         error: str | None, checks: str | None, achieved: str | None, spans: str | None) -> Row:  # fmt: skip
    return Row(
        output=output,
        index=point,
        values=json.loads(parameters),
        picture=picture,
        state=state,
        counts=None if counts is None else {RayStatus[name.upper()]: n for name, n in json.loads(counts).items()},
        trace_seconds=trace_seconds,
        paint_seconds=paint_seconds,
        write_seconds=write_seconds,
        error=error,
        checks=None if checks is None else json.loads(checks),
        achieved=None if achieved is None else json.loads(achieved),
        spans=None if spans is None else json.loads(spans),
    )


def _identity(path: Path) -> tuple[int, int] | None:
    """Return what tells a file from another of the same name; None if there is none."""
    try:
        about = path.stat()
    except OSError:
        return None
    return about.st_dev, about.st_ino


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"))
