"""Tell PoCL's compiler what to compile for, on processors that are newer than it.

PoCL asks the LLVM inside it for the name of the processor. For one that came out later than the LLVM 14 of PoCL 3.0 the
answer is of no use: for AMD's family 26 it is "generic", which the same compiler then refuses in every build ("unknown
target CPU 'generic'", https://github.com/pocl/pocl/issues/1049); for the AVX-512 models of family 25 it is "znver3",
which has no AVX-512, while the built-in functions that PoCL links to are those compiled for it (a call of them ends the
process, or finds its arguments elsewhere). PoCL has no setting for it; but the name is a string that its device points
to. So it is pointed to the name of the newest processor known that has no instructions which this one lacks. The
pointer is found by what it points to, whatever the release's layout, and read by way of /proc: no guess can fault.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_REACH = 2048  # bytes of a device in which its compiler's target is looked for; in PoCL 3.0 it is at 640
_WORD = ctypes.sizeof(ctypes.c_void_p)
_CPUINFO = Path("/proc/cpuinfo")


@dataclass(frozen=True, slots=True)
class _Target:
    """A processor that the compiler knows, and for which PoCL has built-in functions."""

    name: str
    flags: frozenset[str]  # what it has, in Linux's words
    stands_for: tuple[bytes, ...]  # what the compiler calls a processor that has all this, and should not


# The best first
_TARGETS = (
    _Target(
        name="skylake-avx512",
        flags=frozenset({"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl", "avx2", "fma", "bmi2", "f16c"}),
        stands_for=(b"generic", b"znver3"),
    ),
    _Target(
        name="haswell",
        flags=frozenset({"avx2", "fma", "bmi1", "bmi2", "f16c", "movbe"}),
        stands_for=(b"generic",),
    ),
)


def name_processor(device: int, cpuinfo: str | None = None) -> str | None:
    """Give a PoCL device a processor that its compiler knows, if it has none.

    Parameters
    ----------
    device : int
        The address that OpenCL calls the device by (cl_device_id).
    cpuinfo : str, optional
        What Linux says of the processor; by default the text of /proc/cpuinfo.

    Returns
    -------
    str or None
        The name it compiles for from now on; None where nothing was to be done, or nothing can be.
    """
    if cpuinfo is None:
        cpuinfo = _CPUINFO.read_text(errors="replace") if _CPUINFO.exists() else ""
    target = _best_target(cpuinfo)
    if target is None:
        return None
    place = next(_pointers_to(target.stands_for, device), None)
    if place is None:
        return None
    libc = ctypes.CDLL(None)
    libc.strdup.restype = ctypes.c_void_p
    ctypes.c_void_p.from_address(place).value = libc.strdup(target.name.encode())  # PoCL's own, to free as it likes
    return target.name


def _best_target(cpuinfo: str) -> _Target | None:
    """Return the best processor to compile for on one that /proc/cpuinfo describes so; None if all have more."""
    lines = (line.partition(":") for line in cpuinfo.splitlines())
    flags = next((set(after.split()) for before, _, after in lines if before.strip() == "flags"), set())
    return next((target for target in _TARGETS if target.flags <= flags), None)


def _pointers_to(names: tuple[bytes, ...], device: int) -> Iterator[int]:
    """Yield the addresses of pointers in a device to one of these names."""
    memory = os.open("/proc/self/mem", os.O_RDONLY)
    try:
        words = memoryview(os.pread(memory, _REACH, device)).cast("L")
        for place, word in enumerate(words):
            try:
                if 0 < word < 2**63 and _text_at(memory, word, names):
                    yield device + place * _WORD
            except OSError:  # no memory there: it was no pointer
                continue
    finally:
        os.close(memory)


def _text_at(memory: int, address: int, names: tuple[bytes, ...]) -> bool:
    """Whether one of these zero-terminated names stands at an address."""
    return any(os.pread(memory, len(name) + 1, address) == name + b"\0" for name in names)
