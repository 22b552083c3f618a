"""A picture on the device as linear light, ready to be mixed: as it is, or with ever coarser levels behind it.

And the programs that do so: what their heads say, and their fragments.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.codegen import fragment
from lenscl.device import Buffer, Program
from lenscl.imaging.encoding import ENCODE_STEPS, Encoding, decode_table, full_scale

BITS = {1: "uchar", 2: "ushort", 4: "uint", 8: "ulong"}  # what a pixel of so many bytes is as bits
PYRAMID = "paint_pyramid.cl"
_FLOATS = {"float16": "paint_half.cl", "float32": "paint_single.cl", "float64": "paint_double.cl"}


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
