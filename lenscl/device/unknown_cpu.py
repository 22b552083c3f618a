"""Tell PoCL's compiler what to compile for, on processors that are newer than it.

PoCL asks the LLVM inside it for the name of the processor. For one that came out later, such as AMD's family 26 before
the LLVM 14 of PoCL 3.0, the answer is "generic", which the same compiler then refuses in every build ("unknown target
CPU 'generic'", https://github.com/pocl/pocl/issues/1049). PoCL has no setting for it; but the name is a string that
its device points to. So it is pointed to the name of the newest processor known that has no instructions which this
one lacks. The pointer is found by what it points to, whatever the release's layout, and read by way of /proc: no
guess can fault.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator
from pathlib import Path

_REFUSED = b"generic\0"
_REACH = 2048  # bytes of a device in which its compiler's target is looked for; in PoCL 3.0 it is at 640
_WORD = ctypes.sizeof(ctypes.c_void_p)
_CPUINFO = Path("/proc/cpuinfo")

# The best first, by what Linux says of a processor. They are those of PoCL's libraries of built-in functions
_TARGETS = {
    "skylake-avx512": {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl", "avx2", "fma", "bmi2", "f16c"},
    "haswell": {"avx2", "fma", "bmi1", "bmi2", "f16c", "movbe"},
}


def best_target(cpuinfo: str) -> str | None:
    """Return the name to compile for, from the text of /proc/cpuinfo; None for a processor that is in none's class."""
    lines = (line.partition(":") for line in cpuinfo.splitlines())
    flags = next((set(after.split()) for before, _, after in lines if before.strip() == "flags"), set())
    return next((name for name, needed in _TARGETS.items() if needed <= flags), None)


def name_processor(device: int) -> str | None:
    """Give a PoCL device a processor that its compiler knows, if it has none.

    Parameters
    ----------
    device : int
        The address that OpenCL calls the device by (cl_device_id).

    Returns
    -------
    str or None
        The name it compiles for from now on; None where nothing was to be done, or nothing can be.
    """
    if not _CPUINFO.exists():
        return None
    place = next(_pointers_to_refused(device), None)
    target = best_target(_CPUINFO.read_text(errors="replace"))
    if place is None or target is None:
        return None
    libc = ctypes.CDLL(None)
    libc.strdup.restype = ctypes.c_void_p
    ctypes.c_void_p.from_address(place).value = libc.strdup(target.encode())  # PoCL's own, to free as it likes
    return target


def _pointers_to_refused(device: int) -> Iterator[int]:
    """Yield the addresses of pointers in a device to the name that its compiler refuses."""
    memory = os.open("/proc/self/mem", os.O_RDONLY)
    try:
        words = memoryview(os.pread(memory, _REACH, device)).cast("L")
        for place, word in enumerate(words):
            try:
                if 0 < word < 2**63 and os.pread(memory, len(_REFUSED), word) == _REFUSED:
                    yield device + place * _WORD
            except OSError:  # no memory there: it was no pointer
                continue
    finally:
        os.close(memory)
