"""Paint as a study says: its filter, its encoding, its colour outside."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
from lenscl.imaging import Encoding, Painter, Picture


def paint_as_told(painter: Painter, picture: Picture, scene: Scene) -> tuple[NDArray[Any], Encoding]:
    """Return a picture seen through a traced scene, and the encoding of the pixels, which is the picture's own.

    The study's encoding, if it states one, stands in place of the one that the file claims. Its `picture.outside` is
    given as shares of full scale, 1 being white, so that it serves pictures of every depth; it becomes the nearest
    code.
    """
    screen = scene.picture
    encoding = screen.encoding or picture.encoding
    outside = np.asarray(screen.outside, dtype=np.float64)
    if picture.pixels.dtype.kind == "u":
        outside = np.rint(outside * np.iinfo(picture.pixels.dtype).max)
    return painter.paint(picture.pixels, filter=screen.filter, encoding=encoding, outside=outside), encoding
