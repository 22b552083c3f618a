"""A picture on the device as linear light, ready to be mixed: as it is, or with ever coarser levels behind it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.device import Buffer, Program
from lenscl.imaging.encoding import decode_table


def lighten(program: Program, picture: NDArray[Any], pixels_there: Buffer, *, is_pyramid: bool) -> Buffer:
    """Return a picture on the device as linear light, colour multiplied by alpha.

    Parameters
    ----------
    program : Program
        Of kernels/paint_light.cl and, for a pyramid, kernels/paint_pyramid.cl.
    picture : array, shape (H, W, C)
    pixels_there : Buffer
        The picture on the device.
    is_pyramid : bool
        Whether its levels follow, down to a single pixel: a third of the memory more.
    """
    device = program.device
    height, width, channels = picture.shape
    levels = list(_levels(width, height)) if is_pyramid else [width * height]
    is_integer = picture.dtype.kind == "u"
    light_of = decode_table(picture.dtype.name) if is_integer else np.zeros(1, np.float32)  # floats read no table
    light_there = device.empty(sum(levels) * channels * max(4, picture.itemsize))
    program.run("lighten", levels[0], [np.int64(levels[0]), pixels_there, device.upload(light_of), light_there])
    for number, count in enumerate(levels[1:], start=1):
        sizes = (np.int32(each) for each in (number, width, height))
        program.run("shrink", count, [np.int64(count), *sizes, light_there])
    return light_there


def _levels(width: int, height: int) -> Iterator[int]:
    """Yield the pixels of every level, the picture's own first."""
    yield width * height
    while width * height > 1:
        width, height = width - width // 2, height - height // 2
        yield width * height
