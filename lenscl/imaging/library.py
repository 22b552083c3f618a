"""OpenImageIO, imported when first needed and held to limits.

Its own limit is the machine's whole memory; a broken or hostile header must not cost that much. The limits are set for
the whole process.
"""

from __future__ import annotations

from functools import cache
from typing import Any

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
