"""The mean colour of a film pixel's samples, in linear light, on the OpenCL device.

The samples of a map are painted in parts, as maps of their own, with the picture as linear light; the means of what
comes of that take the place of the colours that the pixels' own rays found. Alpha is averaged, too, and colour
multiplied by it. A sample that did not land on the picture counts with the colour outside.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lenscl.device import Buffer, Device
from lenscl.imaging.encoding import Encoding, encode_table
from lenscl.imaging.light import BITS, PYRAMID, light_head, light_parts, lighten, text_of

_TOGETHER = 2**20  # samples on the device at a time: some 40 MB


class SampledPixels(Protocol):
    """What painting reads of a map's samples; `lenscl.tracing.Samples` says what each is."""

    @property
    def side(self) -> int:
        """Samples of a pixel, each way."""

    @property
    def pixels(self) -> NDArray[np.integer[Any]]:
        """Numbers of the film pixels that have samples, (P,)."""

    @property
    def st(self) -> NDArray[Any]:
        """Places on the picture, (P, side^2, 2)."""

    @property
    def status(self) -> NDArray[np.uint8]:
        """The `RayStatus` of every sample."""

    @property
    def added(self) -> Mapping[str, NDArray[Any]]:
        """What the scene's effects add, by name."""


@dataclass(frozen=True, slots=True)
class Part:
    """The samples of some pixels as a map to paint: a row a pixel, a column a sample."""

    pixels: NDArray[np.integer[Any]]
    st: NDArray[Any]
    status: NDArray[np.uint8]
    added: Mapping[str, NDArray[Any]]
    device: Device


def parts(samples: SampledPixels, device: Device) -> Iterator[Part]:
    """Yield all samples, as many at a time as the device shall hold."""
    together = max(1, _TOGETHER // samples.side**2)
    for first in range(0, len(samples.pixels), together):
        some = slice(first, first + together)
        added = {name: array[some] for name, array in samples.added.items()}
        yield Part(samples.pixels[some], samples.st[some], samples.status[some], added, device)


class Means:
    """A picture as linear light on a device, and the way back from mean light to its own numbers.

    Attributes
    ----------
    light, outside : Buffer
        The picture and the colour outside, linear light in `dtype`, multiplied by alpha; where `is_pyramid`, the
        picture with ever coarser levels behind it.
    dtype : dtype
        float32, or float64 for pictures of that.
    """

    def __init__(
        self,
        device: Device,
        picture: NDArray[Any],
        pixels_there: Buffer,
        outside: NDArray[Any],
        encoding: Encoding,
        *,
        is_pyramid: bool,
    ) -> None:
        self._device = device
        text = _source(picture.dtype.name, picture.shape[2], encoding, is_pyramid)
        self._program = device.build(text, kind="paint")
        self.dtype = np.dtype(np.float64 if picture.dtype.itemsize == 8 else np.float32)
        self.light = lighten(self._program, picture, pixels_there, is_pyramid=is_pyramid)
        colour = outside.reshape(1, 1, -1)
        self.outside = lighten(self._program, colour, device.upload(colour), is_pyramid=False)

    def write(self, part: Part, light_there: Buffer, painted_there: Buffer) -> None:
        """Put the means of samples' light, shape `part.status` has, into a painted film."""
        count, each = part.status.shape
        numbers = self._device.upload(part.pixels.astype(np.int64))
        table = self._device.upload(encode_table())
        arguments = [np.int64(count), np.int32(each), numbers, light_there, table, painted_there]
        self._program.run("mean", count, arguments)


@cache
def _source(dtype_name: str, channels: int, encoding: Encoding, is_pyramid: bool) -> str:
    dtype = np.dtype(dtype_name)
    head = {
        "STORED": BITS[dtype.itemsize],
        "WORK": "double" if dtype.itemsize == 8 else "float",
        "CHANNELS": channels,
        **light_head(dtype),
    }
    levels: tuple[str, ...] = ()
    if is_pyramid:
        head["PLACE"] = "float"  # of which it takes none
        levels = ("paint_picture.cl", PYRAMID)
    return text_of(head, (*light_parts(dtype, channels, encoding), *levels, "paint_mean.cl"))
