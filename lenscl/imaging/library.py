"""OpenImageIO, imported when first needed and held to limits.

Its own limit is the machine's whole memory; a broken or hostile header must not cost that much. The limits are set for
the whole process.
"""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path
from typing import Any

from lenscl.errors import ImageError

LARGEST_MEGABYTES = 4096  # of one uncompressed picture
LARGEST_SIDE = 65536  # pixels
MOST_CHANNELS = 256  # readable; what is then used is checked with a better message


@cache
def oiio() -> Any:
    """Import OpenImageIO; the module."""
    import OpenImageIO

    OpenImageIO.attribute("limits:imagesize_MB", LARGEST_MEGABYTES)
    OpenImageIO.attribute("limits:resolution", LARGEST_SIDE)
    OpenImageIO.attribute("limits:channels", MOST_CHANNELS)
    return OpenImageIO


def check_name(file: Path) -> None:
    """Refuse a name that the library cannot be given: it takes UTF-8 alone, and a file may be called anything.

    Raises
    ------
    ImageError
        If the path is not UTF-8, or holds a zero byte.
    """
    shown = os.fsencode(file).decode("utf-8", "backslashreplace")
    if shown != str(file):
        raise ImageError(f"{shown}: its name is not UTF-8; rename it or its folder")
    if "\0" in shown:
        raise ImageError(f"{shown!r}: no file can have a zero byte in its name")
