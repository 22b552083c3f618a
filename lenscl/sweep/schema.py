"""The schema of a sweep's table, by version, and how tables of earlier versions are brought up to it."""

from __future__ import annotations

import sqlite3
from pathlib import Path

from lenscl.sweep.errors import ForeignTableError, SweepError

STORE_NAME = "sweep.sqlite"
SCHEMA_VERSION = 3
_APPLICATION_ID = 0x6C656E73  # "lens"

SCHEMA = f"""
CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL);  -- JSON: title, axes, program, study
CREATE TABLE run (
    output TEXT PRIMARY KEY,     -- file name in this folder
    position INTEGER UNIQUE,     -- place in the work list; NULL: of an earlier form of the study
    point INTEGER NOT NULL,
    parameters TEXT NOT NULL,    -- JSON, axis key -> value: one column, for SQLite folds the case of names (R and r)
    picture TEXT NOT NULL,
    key TEXT NOT NULL,           -- digest of all that the output depends on
    state TEXT NOT NULL CHECK (state IN ('pending', 'done', 'failed')),
    counts TEXT,                 -- JSON, status -> film pixels
    trace_seconds REAL, paint_seconds REAL, write_seconds REAL,
    size INTEGER, changed_ns INTEGER, digest TEXT,  -- of the output as written
    device TEXT, kernel TEXT,    -- what traced it
    error TEXT,
    checks TEXT,                 -- JSON, what the self-checks of its point's trace found
    achieved TEXT,               -- JSON, how accurate the trace is; NULL: no accuracy was asked for
    spans TEXT                   -- JSON, stage -> wall seconds, see lenscl.sweep.spans; sums over rows are sums of work
);
CREATE INDEX run_of_point ON run (point, position);
PRAGMA application_id = {_APPLICATION_ID};
PRAGMA user_version = {SCHEMA_VERSION};
"""

# What later schemas added to the first one, all of it columns that may be NULL: a table without one is given it
_ADDED = ("checks", "achieved", "spans")


def check_schema(path: Path, connection: sqlite3.Connection) -> None:
    """Refuse a table that this program can neither use nor bring up.

    Raises
    ------
    SweepError
        If it is empty, another program's, or of a later schema.
    """
    if is_empty(connection):
        raise SweepError(f"{path}: holds no sweep yet; run `lenscl sweep` first")
    if connection.execute("PRAGMA application_id").fetchone()[0] != _APPLICATION_ID:
        raise ForeignTableError(f"{path}: is another program's table; move it away, or choose another folder with -o")
    version = connection.execute("PRAGMA user_version").fetchone()[0]
    if not 1 <= version <= SCHEMA_VERSION:
        raise SweepError(
            f"{path}: has schema {version}, this program reads and writes schema {SCHEMA_VERSION}; `--fresh` starts "
            "over, or use the program that wrote it, or choose another folder with -o"
        )


def migration(connection: sqlite3.Connection) -> str:
    """Return the statements that bring a table up to this schema, to be run in one transaction."""
    if connection.execute("PRAGMA user_version").fetchone()[0] == SCHEMA_VERSION:
        return ""
    there = columns(connection)
    added = "".join(f"ALTER TABLE run ADD COLUMN {name} TEXT; " for name in _ADDED if name not in there)
    return f"{added}PRAGMA user_version = {SCHEMA_VERSION};"


def columns(connection: sqlite3.Connection) -> set[str]:
    """Return the names of the columns that a row has."""
    return {name for _, name, *_ in connection.execute("PRAGMA table_info(run)")}


def is_empty(connection: sqlite3.Connection) -> bool:
    """Whether a database holds no table yet."""
    return bool(connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0] == 0)
