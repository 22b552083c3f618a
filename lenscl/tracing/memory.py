"""How much memory there is for results, so that what cannot fit is refused before it is begun.

A system hands out more memory than it has: an array can be made, and as it is filled the process is ended, or the whole
machine stands still. So large ones are held against what is free first.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from lenscl.errors import TraceError

_SMALL = 2**26  # bytes; for less it is not looked up what is free
_PROCESSES, _GROUPS = Path("/proc"), Path("/sys/fs/cgroup")
# Of a control group, in the first and the second kind: its limit, what it uses, and how much of that is files' pages
_GROUP_FILES = {
    "memory": ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
    "": ("memory.max", "memory.current", "inactive_file"),
}


def hold(nbytes: int, key: str, what: str, advice: str) -> None:
    """Refuse results that do not fit into the memory that is free.

    Parameters
    ----------
    nbytes : int
        What they take at most while they are made.
    key : str
        What the user has asked for them by.
    what, advice : str
        What takes so much, in the plural, and what the user can do.

    Raises
    ------
    TraceError
        If more is needed than is free; the message gives both. Where the system does not tell what is free nothing is
        refused.
    """
    if nbytes <= _SMALL or (free := free_memory()) is None or nbytes <= free:
        return
    raise TraceError(f"{key}: {what} take {_gibibytes(nbytes)}, and {_gibibytes(free)} of memory are free; {advice}")


def free_memory() -> int | None:
    """Return how many bytes this process can take without swapping; None where the system does not tell."""
    known = [*_of_the_machine(), *_of_its_groups()]
    return max(0, min(known)) if known else None


def _gibibytes(nbytes: int) -> str:
    return f"{nbytes / 2**30:,.1f} GiB"


def _of_the_machine() -> Iterator[int]:
    """Yield what is free; where that is not told, all that there is."""
    for line in _lines(_PROCESSES / "meminfo"):
        if line.startswith("MemAvailable:"):
            yield 1024 * int(line.split()[1])
            return
    try:
        yield os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # Windows has no sysconf, and not every system knows these
        return


def _of_its_groups() -> Iterator[int]:
    """Yield what is left of each limit that a container or a batch system has set; source: cgroups(7)."""
    for line in _lines(_PROCESSES / "self" / "cgroup"):
        _, kinds, path = line.split(":", 2)
        for kind in {"memory", ""} & set(kinds.split(",")):
            limit, usage, files = _GROUP_FILES[kind]
            root = _GROUPS / kind
            own = root / path.lstrip("/")
            for group in (own, *own.parents):
                most, used = (_lines(group / name) for name in (limit, usage))
                if group.is_relative_to(root) and most and used and most[0] != "max":
                    yield int(most[0]) - int(used[0]) + _counted(group / "memory.stat", files)


def _counted(path: Path, name: str) -> int:
    """Return a number from lines of names and numbers; 0 where there is none."""
    return next((int(line.split()[1]) for line in _lines(path) if line.split()[0] == name), 0)


def _lines(path: Path) -> list[str]:
    """Return a file's lines; none where there is no such file, or it is not for us to read."""
    try:
        return path.read_text(encoding="utf-8").splitlines()
    except OSError:
        return []
