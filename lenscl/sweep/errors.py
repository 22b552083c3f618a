"""What can go wrong with a sweep, by kind, in sentences.

| kind | examples | what a sweep does |
|---|---|---|
| stops | no device, a full disk, the output folder or its table gone, an interrupt | ends; the rest is pending |
| lost | the driver gave the device up | opens the device anew and makes the point once more |
| the row's own | a bad picture, a point that cannot be traced | notes the failure and goes on |
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lenscl.errors import DiskFullError, LensclError, NoDeviceError

RESUME = "what was made is noted: run the same command again to go on"
_LONGEST_REASON = 1000  # characters of an error that a row keeps

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


def stop_for(error: BaseException, folder: Path) -> LensclError | None:
    """Return what ends the whole sweep, with how to resume it; None where an error is the row's own.

    Parameters
    ----------
    error : exception
        What making a point, or writing one of its images, raised.
    folder : Path
        Where the images are written.
    """
    if isinstance(error, SweepError):
        return error
    if isinstance(error, NoDeviceError):
        return NoDeviceError(f"{error}; {RESUME}")
    if isinstance(error, DiskFullError):
        return SweepError(f"{error}; {RESUME}")
    if not folder.is_dir():
        return SweepError(
            f"{folder}: is gone; put it back and run the same command again, which keeps what is still there"
        )
    if not os.access(folder, os.W_OK):
        return SweepError(f"{folder}: can no longer be written; {RESUME} once it can")
    return None


def reason(error: BaseException) -> str:
    """Return an error as one line, of a driver's log the start; one that is not ours carries its kind."""
    text = " ".join(str(error).encode("utf-8", "backslashreplace").decode().split())
    if len(text) > _LONGEST_REASON:
        text = text[: _LONGEST_REASON - 3] + "..."
    return text if isinstance(error, LensclError) else f"{type(error).__name__}: {text}"
