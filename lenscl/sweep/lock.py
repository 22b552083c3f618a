"""One sweep at a time in a folder, by a lock that dies with its process.

The lock is an exclusive transaction on an empty SQLite file: SQLite takes the right kind of lock on every operating
system, and the kernel drops it when the process ends, however it ends. The file itself stays and means nothing.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lenscl.sweep.errors import SweepError, explained

LOCK_NAME = "sweep.lock"


@contextmanager
def folder_lock(folder: Path) -> Iterator[None]:
    """Hold a folder, made if it is missing, for the length of a `with`.

    Raises
    ------
    SweepError
        If another process (or thread) holds it, or the folder cannot be made or written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SweepError(f"{folder}: cannot be made: {error.strerror}; choose another folder with -o") from error
    path = folder / LOCK_NAME
    with explained(path):
        connection = sqlite3.connect(path, timeout=0, isolation_level=None)
    try:
        with explained(path):
            _take(connection, folder)
        yield
    finally:
        connection.close()


def _take(connection: sqlite3.Connection, folder: Path) -> None:
    try:
        connection.execute("PRAGMA journal_mode = OFF")  # nothing is ever written: no journal beside the lock
        connection.execute("BEGIN EXCLUSIVE")
    except sqlite3.OperationalError as error:
        if error.sqlite_errorcode != sqlite3.SQLITE_BUSY:
            raise
        raise SweepError(
            f"{folder}: another sweep is writing here; wait for it to end, or choose another folder with -o"
        ) from error
