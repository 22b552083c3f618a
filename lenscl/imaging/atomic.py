"""Files that appear whole or not at all."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from lenscl.errors import DiskFullError, ImageError

_FULL = (errno.ENOSPC, errno.EDQUOT)  # the disk's room, or the user's share of it
_RESERVE = 4 * 2**20  # bytes left free on the disk: some formats' libraries end or hang the process on a full one


@contextmanager
def whole_file(file: Path, largest_bytes: int) -> Iterator[Path]:
    """Give a temporary name in the folder of `file`; on leaving without an error it becomes `file`.

    Parameters
    ----------
    file : Path
        What is to be written or replaced.
    largest_bytes : int
        The most that will be written: that much must be free.

    Raises
    ------
    ImageError
        If the folder is not there or not writable, or the disk too full: then it is a `DiskFullError`. Whatever goes
        wrong, an interrupt included, nothing is left behind, and an old `file` stays as it was.
    """
    # Readers go by the suffix; 48 characters of the name are at most 192 of the 255 bytes that a name may have
    temporary = file.with_name(f".{file.stem[:48]}.{secrets.token_hex(6)}.tmp{file.suffix}")
    try:
        _check_room(file, largest_bytes)
        yield temporary
        _settle(temporary)
        os.replace(temporary, file)
    except OSError as error:
        kind = DiskFullError if error.errno in _FULL else ImageError
        raise kind(f"{file}: cannot be written ({error.strerror}); check the folder's permissions and disk") from error
    finally:
        with suppress(OSError):  # a disk that has become read-only: the error that told so is on its way
            temporary.unlink(missing_ok=True)


def _check_room(file: Path, largest_bytes: int) -> None:
    folder = file.parent
    if not folder.is_dir():
        raise ImageError(f"{file}: there is no folder {folder}; make it first")
    if file.is_dir():
        raise ImageError(f"{file}: is a folder; give a file name")
    free = shutil.disk_usage(folder).free
    if free < largest_bytes + _RESERVE:
        raise DiskFullError(
            f"{file}: may need {largest_bytes / 2**20:.1f} MiB, and {free / 2**20:.1f} MiB are free; "
            "make room on the disk"
        )


def _settle(temporary: Path) -> None:
    """Have the bytes on the disk before the name: a power cut must not leave an empty file under a good name."""
    with temporary.open("rb") as stream:
        os.fsync(stream.fileno())
