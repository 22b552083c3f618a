"""What a picture pixel is, in a study of pictures of several sizes."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from lenscl.config import Scene
from lenscl.errors import ImageError
from lenscl.imaging import read_size


def largest_size(scene: Scene, images: Iterable[Path]) -> tuple[int, int]:
    """Return the most columns and rows of any picture, those of `picture.size` where none can be read.

    A picture that cannot be read fails by itself, when it is painted with.
    """
    sizes = []
    for image in images:
        with suppress(ImageError):
            sizes.append(read_size(image))
    if not sizes:
        return scene.picture.size
    return max(columns for columns, _ in sizes), max(rows for _, rows in sizes)
