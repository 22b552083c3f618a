"""The text of painting's two kinds of OpenCL programs: a head of macros, then the fragments that are called for.

A light program turns pixels into linear light, makes the levels of a pyramid, and takes means of samples:

    kernels lighten, shrink, mean     by the pixels' type, channels and encoding

A paint program looks film samples up on a picture:

    kernel paint                      by the same, the places' type, the filter, and what is known of each sample
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import DTypeLike

from lenscl.codegen import fragment
from lenscl.device import Device, Program
from lenscl.errors import StudyError
from lenscl.imaging.encoding import ENCODE_STEPS, Encoding, colours_of, full_scale
from lenscl.status import RayStatus

Filter: TypeAlias = Literal["nearest", "bilinear", "bicubic"]

_BITS = {1: "uchar", 2: "ushort", 4: "uint", 8: "ulong"}  # what a pixel of so many bytes is as bits
_FLOATS = {"float16": "paint_half.cl", "float32": "paint_single.cl", "float64": "paint_double.cl"}


def light_program(device: Device, dtype: DTypeLike, channels: int, encoding: Encoding) -> Program:
    """Return the program with the kernels `lighten`, `shrink` and `mean` for pixels of a type.

    Raises
    ------
    StudyError
        If the device has not the precision of the pixels.
    """
    return _built(device, _light_text(np.dtype(dtype).name, channels, encoding))


def paint_program(
    device: Device,
    dtype: DTypeLike,
    channels: int,
    encoding: Encoding,
    *,
    places: DTypeLike,
    filter: Filter,  # noqa: A002 - the word of the study file
    is_weighted: bool,
    has_footprints: bool,
) -> Program:
    """Return the program with the kernel `paint` for pixels of a type.

    Parameters
    ----------
    device, dtype, channels, encoding
        The pixels'.
    places : dtype
        Of the places on the picture, float32 or float64.
    filter : str
    is_weighted : bool
        Whether colours are multiplied by weights.
    has_footprints : bool
        Whether samples have the Jacobian of their place, so that colours are means over footprints.

    Raises
    ------
    StudyError
        If the device has not the precision of the pixels.
    """
    names = np.dtype(dtype).name, np.dtype(places).name
    return _built(device, _paint_text(*names, channels, encoding, filter, is_weighted, has_footprints))


def mixes(filter: Filter, *, is_weighted: bool, has_footprints: bool) -> bool:  # noqa: A002
    """Return whether a paint program works on linear light; else it copies pixels bit for bit."""
    return filter != "nearest" or is_weighted or has_footprints


def _built(device: Device, text: str) -> Program:
    if "double" in text and not device.has_double:
        raise StudyError([f"pixels: {device.label} has no double precision; give the picture as float32"])
    return device.build(text, kind="paint")


@cache
def _light_text(dtype_name: str, channels: int, encoding: Encoding) -> str:
    dtype = np.dtype(dtype_name)
    head = {
        "PLACE": "float",  # the type of a place, of which this program takes none
        "STORED": _BITS[dtype.itemsize],
        "WORK": "double" if dtype.itemsize == 8 else "float",
        "CHANNELS": channels,
        **_curve_head(dtype),
    }
    levels = ("paint_picture.cl", "paint_levels.cl", "paint_pyramid.cl")
    return _text(head, (*_pixel_fragments(dtype, channels, encoding), "paint_light.cl", *levels, "paint_mean.cl"))


@cache
def _paint_text(
    dtype_name: str,
    places_name: str,
    channels: int,
    encoding: Encoding,
    filter_name: Filter,
    is_weighted: bool,
    has_footprints: bool,
) -> str:
    dtype, is_mixed = (
        np.dtype(dtype_name),
        mixes(filter_name, is_weighted=is_weighted, has_footprints=has_footprints),
    )
    head = {
        "PLACE": "double" if places_name == "float64" else "float",
        "STORED": _BITS[dtype.itemsize],
        "WORK": "double" if dtype.itemsize == 8 and is_mixed else "float",
        "CHANNELS": channels,
        "COLOURS": colours_of(channels),
        "ON_PICTURE": int(RayStatus.PICTURE),
    }
    names: Sequence[str] = ("paint_nearest.cl",)
    if is_mixed:
        head |= _curve_head(dtype)
        taps = ("paint_point.cl",) if filter_name == "nearest" else (f"paint_{filter_name}.cl", "paint_blend.cl")
        places = ("paint_levels.cl", "paint_footprint.cl") if has_footprints else ("paint_once.cl",)
        names = (*_pixel_fragments(dtype, channels, encoding), *taps, *places)
    weights = f"paint_{'weighted' if is_weighted else 'unweighted'}.cl"
    known = f"paint_{'footprints' if has_footprints else 'places'}.cl"
    return _text(head, ("paint_picture.cl", weights, known, *names, "paint.cl"))


def _curve_head(dtype: np.dtype[Any]) -> dict[str, Any]:
    """Return what the head of a program that works with light says of integer pixels."""
    return {"FULL_SCALE": full_scale(dtype), "ENCODE_STEPS": ENCODE_STEPS} if dtype.kind == "u" else {}


def _pixel_fragments(dtype: np.dtype[Any], channels: int, encoding: Encoding) -> Sequence[str]:
    """Return the fragments that turn a pixel into linear light and back."""
    if dtype.kind != "u":
        return _FLOATS[dtype.name], f"paint_floats_{encoding}.cl", "paint_opaque.cl"
    alpha = "paint_opaque.cl" if colours_of(channels) == channels else "paint_straight.cl"
    return "paint_codes.cl", f"paint_codes_{encoding}.cl", alpha


def _text(head: Mapping[str, Any], names: Sequence[str]) -> str:
    lines = [f"#define {name} {value}\n" for name, value in head.items()]
    if "double" in head.values():
        lines.append("#pragma OPENCL EXTENSION cl_khr_fp64 : enable\n")
    return "".join(lines) + "".join(f'#line 1 "{name}"\n{fragment(name)}' for name in names)
