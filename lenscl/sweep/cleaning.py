"""Remove what dead runs left in a sweep's folder, and start a folder over. Only under the folder's lock."""

from __future__ import annotations

import re
from pathlib import Path

from lenscl.sweep.errors import ForeignTableError, SweepError
from lenscl.sweep.schema import STORE_NAME
from lenscl.sweep.store import Store

# What `lenscl.imaging` calls an image until it is whole: .<index>-<picture>.<12 hex digits>.tmp.<ext>
_TEMPORARY = re.compile(r"\.\d{5,}-.*\.[0-9a-f]{12}\.tmp\.\w+", re.DOTALL)


def remove_leftovers(folder: Path) -> int:
    """Remove the temporary files of writes that never ended; return how many there were."""
    found = [path for path in folder.iterdir() if _TEMPORARY.fullmatch(path.name)]
    for path in found:
        _remove(path)
    return len(found)


def clear_folder(folder: Path) -> None:
    """Remove the table and every output it lists; any other file is left alone.

    A table that cannot be read (damaged, or of another schema) is removed without its outputs.

    Raises
    ------
    SweepError
        If the table is another program's, or a file cannot be removed.
    """
    path = folder / STORE_NAME
    if not path.exists():
        return
    try:
        with Store.reading(folder) as store:
            outputs = store.outputs()
    except ForeignTableError:
        raise
    except SweepError:
        outputs = []
    for output in outputs:
        if Path(output).name == output:  # a table may have been edited: remove nothing outside the folder
            _remove(folder / output)
    for ending in ("-wal", "-shm", ""):
        _remove(folder / (STORE_NAME + ending))


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():  # no work of ours, whatever it is called
        return
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise SweepError(f"{path}: cannot be removed: {error.strerror}") from error
