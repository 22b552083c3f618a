"""What can go wrong with a sweep's folder, in sentences."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lenscl.errors import LensclError

# SQLite's primary result codes (the low byte), each with what it means for the user
_MEANINGS = {
    sqlite3.SQLITE_FULL: "the disk is full; free some space and run the same command again, it goes on where it was",
    sqlite3.SQLITE_READONLY: "cannot be written; make the folder and the file writable, or choose another with -o",
    sqlite3.SQLITE_CANTOPEN: "cannot be opened; make the folder readable and writable, or choose another with -o",
    sqlite3.SQLITE_PERM: "access is denied; make the folder readable and writable, or choose another with -o",
    sqlite3.SQLITE_NOTADB: "is not the table of a sweep; `--fresh` replaces it, or choose another folder with -o",
    sqlite3.SQLITE_CORRUPT: "is damaged; `--fresh` replaces it and makes every image again",
    sqlite3.SQLITE_BUSY: "is in use by another program; close it and run the same command again",
    sqlite3.SQLITE_LOCKED: "is in use by another program; close it and run the same command again",
    sqlite3.SQLITE_IOERR: "the disk reports an error (it may be full); see to it and run the same command again",
}


class SweepError(LensclError):
    """A sweep's folder or table that cannot be used; the message leads with its path."""


class ForeignTableError(SweepError):
    """A file in the place of a sweep's table that another program made."""


@contextmanager
def explained(path: Path) -> Iterator[None]:
    """Turn SQLite's errors into sentences that lead with a path.

    Raises
    ------
    SweepError
        In place of any `sqlite3.Error`.
    """
    try:
        yield
    except sqlite3.Error as error:
        code = getattr(error, "sqlite_errorcode", None)  # absent when the sqlite3 module itself complains
        meaning = None if code is None else _MEANINGS.get(code & 0xFF)
        raise SweepError(f"{path}: {meaning} ({error})" if meaning else f"{path}: {error}") from error
