"""The mean colour of a film pixel's samples, in linear light, on the OpenCL device.

The samples of a map are painted in parts, as maps of their own, with the picture as linear light; the means of what
comes of that take the place of the colours that the pixels' own rays found. Alpha is averaged, too, and colour
multiplied by it. A sample that did not land on the picture counts with the colour outside.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lenscl.codegen import fragment
from lenscl.device import Buffer, Device, Program
from lenscl.imaging.encoding import ENCODE_STEPS, Encoding, decode_table, encode_table, full_scale

BITS = {1: "uchar", 2: "ushort", 4: "uint", 8: "ulong"}  # what a pixel of so many bytes is as bits
_FLOATS = {"float16": "paint_half.cl", "float32": "paint_single.cl", "float64": "paint_double.cl"}
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
        The picture and the colour outside, linear light in `dtype`, multiplied by alpha.
    dtype : dtype
        float32, or float64 for pictures of that.
    """

    def __init__(
        self, device: Device, picture: NDArray[Any], pixels_there: Buffer, outside: NDArray[Any], encoding: Encoding
    ) -> None:
        self._device = device
        self._program = device.build(_source(picture.dtype.name, picture.shape[2], encoding), kind="paint")
        self.dtype = np.dtype(np.float64 if picture.dtype.itemsize == 8 else np.float32)
        self.light = lighten(self._program, picture, pixels_there)
        colour = outside.reshape(1, 1, -1)
        self.outside = lighten(self._program, colour, device.upload(colour))

    def write(self, part: Part, light_there: Buffer, painted_there: Buffer) -> None:
        """Put the means of samples' light, shape `part.status` has, into a painted film."""
        count, each = part.status.shape
        numbers = self._device.upload(part.pixels.astype(np.int64))
        table = self._device.upload(encode_table())
        arguments = [np.int64(count), np.int32(each), numbers, light_there, table, painted_there]
        self._program.run("mean", count, arguments)


def lighten(program: Program, picture: NDArray[Any], pixels_there: Buffer) -> Buffer:
    """Return the picture on the device as linear light, colour multiplied by alpha."""
    device = program.device
    is_integer = picture.dtype.kind == "u"
    light_of = decode_table(picture.dtype.name) if is_integer else np.zeros(1, np.float32)  # floats read no table
    light_there = device.empty(picture.size * max(4, picture.itemsize))
    count = picture.shape[0] * picture.shape[1]
    program.run("lighten", count, [np.int64(count), pixels_there, device.upload(light_of), light_there])
    return light_there


def light_head(dtype: np.dtype[Any]) -> dict[str, Any]:
    """Return what the head of a program that works with light says of the pixels' type."""
    return {"FULL_SCALE": full_scale(dtype), "ENCODE_STEPS": ENCODE_STEPS} if dtype.kind == "u" else {}


def light_parts(dtype: np.dtype[Any], channels: int, encoding: Encoding) -> Sequence[str]:
    """Return the fragments that turn pixels into linear light and back, with the kernel `lighten`."""
    if dtype.kind == "u":
        light: Sequence[str] = ("paint_codes.cl", f"paint_codes_{encoding}.cl")
        mix = "paint_straight.cl" if channels in (2, 4) else "paint_opaque.cl"
    else:
        light, mix = (_FLOATS[dtype.name], f"paint_floats_{encoding}.cl"), "paint_opaque.cl"
    return (*light, mix, "paint_light.cl")


def text_of(head: Mapping[str, Any], names: Sequence[str]) -> str:
    """Return the text of a paint program: the head, then the fragments."""
    lines = [f"#define {name} {value}\n" for name, value in head.items()]
    if "double" in head.values():
        lines.append("#pragma OPENCL EXTENSION cl_khr_fp64 : enable\n")
    return "".join(lines) + "".join(f'#line 1 "{name}"\n{fragment(name)}' for name in names)


@cache
def _source(dtype_name: str, channels: int, encoding: Encoding) -> str:
    dtype = np.dtype(dtype_name)
    head = {
        "STORED": BITS[dtype.itemsize],
        "WORK": "double" if dtype.itemsize == 8 else "float",
        "CHANNELS": channels,
        **light_head(dtype),
    }
    return text_of(head, (*light_parts(dtype, channels, encoding), "paint_mean.cl"))
