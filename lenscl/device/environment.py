"""What the process must have in order before pyopencl is imported.

PoCL aborts the whole process when it finds no linker, and silently offers no device when its cache folder cannot be
written. Both are looked for here, first, so that the user reads a sentence instead.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import platformdirs

from lenscl.errors import NoDeviceError

_CACHE_VARIABLE = "POCL_CACHE_DIR"


def cache_folder() -> Path:
    """Return the folder in which PoCL keeps compiled kernels: the user's choice, or our own."""
    chosen = os.environ.get(_CACHE_VARIABLE)
    return Path(chosen) if chosen else Path(platformdirs.user_cache_dir("lenscl", appauthor=False)) / "pocl"


def problems() -> Iterator[tuple[str, str]]:
    """Yield (what is wrong, how to mend it) for everything that would keep OpenCL from starting."""
    if find_spec("pyopencl") is None:
        yield "pyopencl is not installed", "pip install pyopencl"
    if find_spec("pocl_binary_distribution") is not None and shutil.which("ld") is None:
        yield (
            "no linker `ld` on PATH, without which PoCL aborts the process",
            "apt-get install binutils (or put ld on PATH)",
        )
    folder = cache_folder()
    if (trouble := _cannot_write(folder)) is not None:
        yield (
            f"PoCL's cache folder {folder} cannot be used: {trouble}",
            f"make it writable, or set {_CACHE_VARIABLE} to a folder that is",
        )


@cache
def opencl() -> Any:
    """Import pyopencl with its surroundings in order; the module.

    Raises
    ------
    NoDeviceError
        If `problems` finds any, or pyopencl cannot be imported; the message carries each with its fix.
    """
    found = [f"{wrong}; to mend it: {fix}" for wrong, fix in problems()]
    if found:
        raise NoDeviceError("OpenCL cannot start here.\n" + "\n".join(found))
    os.environ[_CACHE_VARIABLE] = str(cache_folder())
    try:
        import pyopencl
    except (ImportError, OSError) as error:  # its loader of drivers is missing, or of another machine
        fix = "pip install --force-reinstall pyopencl (its wheels carry the OpenCL loader)"
        raise NoDeviceError(
            f"OpenCL cannot start here.\npyopencl cannot be imported: {' '.join(str(error).split())}; to mend it: {fix}"
        ) from error
    return pyopencl


def _cannot_write(folder: Path) -> str | None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder):
            pass
    except OSError as error:
        return error.strerror or str(error)
    return None
