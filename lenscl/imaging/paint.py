"""Colour a ray map with a picture, on the OpenCL device that traced it.

Input: a ray map and pixels (H, W, C). Output: pixels (rows, columns, C) of the same type. A picture's samples stand at
(i + 1/2) / W; between them colours are mixed in linear light, and the edges go on outwards. Each film pixel is one
point: nothing is averaged where the lens makes the picture smaller. Where the map says how much light gets through, its
colours are dimmed by that, in linear light; alpha is not, nor is the colour outside. Where the map has several
wavelengths, each shows its share of the picture at its own place (`spectrum`, `dispersed`): as many launches.

Alpha is the last of 2 or 4 channels. Integers carry straight alpha and are mixed multiplied by it, so that no hidden
colour shows; floats carry colour already multiplied (associated), as EXR does. Floats are never cut off; integers are
held within their range, where a bicubic mix can overshoot.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, Protocol, TypeAlias, cast, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.codegen import fragment
from lenscl.device import Buffer, Device, Program
from lenscl.errors import StudyError
from lenscl.imaging.dispersed import LUMINANCE, layers_of, light_from, mixed, pixels_from
from lenscl.imaging.encoding import (
    DTYPES,
    ENCODE_STEPS,
    Encoding,
    decode_table,
    encode_table,
    encoding_of,
    full_scale,
)
from lenscl.imaging.spectrum import spectral_matrices
from lenscl.status import RayStatus

Filter: TypeAlias = Literal["nearest", "bilinear", "bicubic"]

_CHANNELS = (1, 2, 3, 4)
_BITS = {1: "uchar", 2: "ushort", 4: "uint", 8: "ulong"}  # what a pixel of so many bytes is as bits
_FLOATS = {"float16": "paint_half.cl", "float32": "paint_single.cl", "float64": "paint_double.cl"}


class PaintableMap(Protocol):
    """What painting reads of a ray map."""

    @property
    def st(self) -> NDArray[Any]:
        """Places on the picture, (rows, columns, 2), float32 or float64."""

    @property
    def status(self) -> NDArray[np.uint8]:
        """The `RayStatus` of every ray, (rows, columns)."""

    @property
    def device(self) -> Device:
        """The device to paint on."""


@dataclass(frozen=True, slots=True)
class _Ready:
    """A picture on a device, and the program that paints it."""

    program: Program
    picture: NDArray[Any]
    pixels: Buffer
    light: Buffer
    outside: Buffer


class Painter:
    """A ray map held on its device, ready to paint any number of pictures.

    Parameters
    ----------
    raymap : RayMap
        Of it only `st`, `status`, `device` and, where its scene asks for them, `wavelengths`, `transmittance` and
        `transmission` are read.

    Examples
    --------
    One trace serves a whole folder::

        painter = Painter(lenscl.trace(scene))
        painted = [painter.paint(read_picture(path).pixels) for path in paths]
    """

    def __init__(self, raymap: PaintableMap) -> None:
        self._layers = [Painter(layer) for layer in layers_of(raymap)]
        if self._layers:
            self._matrices = spectral_matrices(cast(Any, raymap).added["wavelengths"])
            return
        self._shape: tuple[int, int] = raymap.status.shape[:2]
        self._double_places = raymap.st.dtype == np.float64
        self._device = raymap.device
        self._places = raymap.device.upload(raymap.st)
        self._status = raymap.device.upload(raymap.status)
        self._weights = _weights(getattr(raymap, "added", {}))

    @property
    def has_wavelengths(self) -> bool:
        """Whether the map has several wavelengths, so that greys may get colours."""
        return bool(self._layers)

    def paint(
        self,
        pixels: NDArray[Any],
        *,
        filter: str = "bilinear",  # noqa: A002 - the word of the study file
        encoding: str | None = None,
        outside: ArrayLike = 0,
    ) -> NDArray[Any]:
        """Return the picture seen through the film; see `paint`."""
        picture, filter_name = _as_picture(pixels), _filter_of(filter)
        curve = encoding_of(picture.dtype, encoding)
        colour = _outside_colour(outside, picture.dtype, picture.shape[2])
        if self._layers:
            light = light_from(picture, curve)
            ready = self._layers[0]._ready(light, filter_name, "linear", light_from(colour, curve))
            seen = mixed((layer._painted(ready) for layer in self._layers), self._matrices)
            painted = pixels_from(seen, picture.dtype, curve)
        else:
            painted = self._painted(self._ready(picture, filter_name, curve, colour))
        return painted if pixels.ndim == 3 else painted[..., 0]

    def _ready(self, picture: NDArray[Any], filter_name: Filter, curve: Encoding, outside: NDArray[Any]) -> _Ready:
        """Return a picture on the device, for this map and others of its kind."""
        channels = picture.shape[2]
        source = _source(
            picture.dtype.name, channels, self._double_places, filter_name, curve, self._weights is not None
        )
        device = self._device
        if "double" in source and not device.has_double:
            raise StudyError([f"pixels: {device.label} has no double precision; give the picture as float32"])
        program = device.build(source, kind="paint")

        pixels_there = device.upload(picture)
        light_there = pixels_there
        if filter_name != "nearest" or self._weights is not None:
            light_there = _lighten(program, picture, pixels_there)
        return _Ready(program, picture, pixels_there, light_there, device.upload(outside))

    def _painted(self, ready: _Ready) -> NDArray[Any]:
        """Return what a picture looks like, shape (rows, columns, C)."""
        device, picture = self._device, ready.picture
        height, width, channels = picture.shape
        painted = np.empty((*self._shape, channels), picture.dtype)
        painted_there = device.empty(painted.nbytes)
        count = self._shape[0] * self._shape[1]
        ready.program.run(
            "paint",
            count,
            [
                np.int64(count),
                self._places,
                self._status,
                np.int32(width),
                np.int32(height),
                ready.pixels,
                ready.light,
                device.upload(encode_table()),
                ready.outside,
                painted_there,
                *self._weights_there(picture.dtype, channels),
            ],
        )
        device.download(painted_there, painted)
        return painted

    def _weights_there(self, dtype: np.dtype[Any], channels: int) -> list[Buffer]:
        """Return on the device what reaches the film of each colour; nothing where all of it does."""
        if self._weights is None:
            return []
        is_grey = channels < 3
        weights = self._weights @ LUMINANCE[:, np.newaxis] if is_grey else self._weights
        return [self._device.upload(weights.astype(np.float64 if dtype.itemsize == 8 else np.float32))]


def paint(
    raymap: PaintableMap,
    pixels: NDArray[Any],
    *,
    filter: str = "bilinear",  # noqa: A002 - the word of the study file
    encoding: str | None = None,
    outside: ArrayLike = 0,
) -> NDArray[Any]:
    """Colour every film pixel from the place on the picture that its ray found.

    Parameters
    ----------
    raymap : RayMap
        Rays of status PICTURE take their colour at `st`, all others take `outside`. Where its effects say what gets
        through (`transmittance`, `transmission`), colours are dimmed by that in linear light; a picture without colour
        by what is left of the luminance of white. With `wavelengths` each of them adds its part of the light at its own
        place, outside likewise; alpha is the mean. Integers cut off colours beyond sRGB, and a picture without colour
        gets the luminance alone: give it as RGB to see its fringes.
    pixels : array, shape (H, W, C) or (H, W)
        uint8, uint16, float16, float32 or float64; C = 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA. The picture and the
        result must each fit into one allocation of the device.
    filter : str
        "nearest" copies the pixel (floor(t H), floor(s W)) bit for bit; "bilinear" mixes 2 x 2 samples, "bicubic"
        (Catmull-Rom, which passes through the samples and overshoots at hard edges) 4 x 4.
    encoding : str, optional
        "srgb" or "linear"; default "srgb" for integers, "linear" for floats.
    outside : number or sequence
        In the pixels' own numbers (0 to 255 for uint8): one for all colours, or one a colour, or one a channel. Where
        alpha is not given it is 1.

    Returns
    -------
    array, shape (rows, columns, C) or (rows, columns)
        Of the dtype of `pixels`. A picture of one colour stays exactly that colour (sRGB-encoded floats to rounding).
        Where the mixed alpha of an integer picture is 0, the colour is the nearest pixel's. A pixel that is NaN or Inf
        makes the places NaN or Inf whose mix includes it, and no others.

    Raises
    ------
    StudyError
        If an argument is not one of those above; the message says which and what is.
    TraceError
        If the device has not the memory.
    """
    return Painter(raymap).paint(pixels, filter=filter, encoding=encoding, outside=outside)


def _lighten(program: Program, picture: NDArray[Any], pixels_there: Buffer) -> Buffer:
    """Return the picture on the device as linear light, colour multiplied by alpha."""
    device = program.device
    is_integer = picture.dtype.kind == "u"
    light_of = decode_table(picture.dtype.name) if is_integer else np.zeros(1, np.float32)  # floats read no table
    light_there = device.empty(picture.size * max(4, picture.itemsize))
    count = picture.shape[0] * picture.shape[1]
    program.run("lighten", count, [np.int64(count), pixels_there, device.upload(light_of), light_there])
    return light_there


def _as_picture(pixels: NDArray[Any]) -> NDArray[Any]:
    """Return pixels as a native, contiguous (H, W, C) array."""
    if pixels.dtype.name not in DTYPES:
        raise StudyError([f"pixels: {pixels.dtype} is not painted; convert the picture to one of {', '.join(DTYPES)}"])
    picture = pixels[..., np.newaxis] if pixels.ndim == 2 else pixels
    if picture.ndim != 3 or 0 in picture.shape or picture.shape[2] not in _CHANNELS:
        raise StudyError(
            [f"pixels: the shape is {pixels.shape}; expected (H, W) or (H, W, C) with C = 1 to 4 and no side of 0"]
        )
    return np.ascontiguousarray(picture, dtype=picture.dtype.newbyteorder("="))


def _filter_of(name: str) -> Filter:
    if name not in get_args(Filter):
        raise StudyError([f"filter: {name!r} is not known; it is one of {', '.join(get_args(Filter))}"])
    return cast(Filter, name)


def _outside_colour(outside: ArrayLike, dtype: np.dtype[Any], channels: int) -> NDArray[Any]:
    """Return one stored number a channel."""
    values = np.atleast_1d(np.asarray(outside, dtype=np.float64))
    most = full_scale(dtype)
    colours = channels - (channels % 2 == 0)
    if values.ndim != 1 or (len(values) not in (1, colours, channels) and not _is_grey(values, colours)):
        raise StudyError(
            [f"outside: {values.size} numbers for a picture of {channels} channels; expected 1, or one a channel"]
        )
    if dtype.kind == "u" and not np.all((values >= 0) & (values <= most) & (values == np.rint(values))):
        raise StudyError(
            [
                f"outside: {_listed(values)} must be whole numbers from 0 to {most}, for the picture is {dtype}; "
                f"a share of full scale is to be multiplied by {most}"
            ]
        )
    if len(values) != channels:
        alpha = [float(most)] * (channels - colours)
        values = np.concatenate([np.broadcast_to(values[:1] if len(values) != colours else values, colours), alpha])
    return values.astype(dtype)


def _is_grey(values: NDArray[np.float64], colours: int) -> bool:
    """Whether an RGB colour is a grey, and so can stand outside a grey picture."""
    return colours == 1 and len(values) == 3 and bool(np.all(values == values[0]))


def _listed(values: NDArray[np.float64]) -> str:
    return ", ".join(f"{value:g}" for value in values)


def _weights(added: Mapping[str, NDArray[Any]]) -> NDArray[np.float64] | None:
    """Return the share of red, green and blue that reaches the film, shape (rows, columns, 3), None where all does."""
    factors = []
    if "transmittance" in added:
        factors.append(added["transmittance"][..., np.newaxis])
    if "transmission" in added:
        factors.append(added["transmission"])
    if not factors:
        return None
    weights = np.ones((*factors[0].shape[:2], 3))
    for factor in factors:
        weights *= factor
    return weights


@cache
def _source(
    dtype_name: str, channels: int, double_places: bool, filter_name: Filter, encoding: Encoding, is_weighted: bool
) -> str:
    """Return the text of one paint program: the head, then the fragments that the picture calls for."""
    dtype = np.dtype(dtype_name)
    head = {
        "PLACE": "double" if double_places else "float",
        "STORED": _BITS[dtype.itemsize],
        "WORK": "double" if dtype.itemsize == 8 and (filter_name != "nearest" or is_weighted) else "float",
        "CHANNELS": channels,
        "COLOURS": channels - (channels % 2 == 0),
        "ON_PICTURE": int(RayStatus.PICTURE),
    }
    names: Sequence[str] = ("paint_nearest.cl",)
    if filter_name != "nearest" or is_weighted:
        if dtype.kind == "u":
            head |= {"FULL_SCALE": full_scale(dtype), "ENCODE_STEPS": ENCODE_STEPS}
            light = ("paint_codes.cl", f"paint_codes_{encoding}.cl")
            mix = "paint_straight.cl" if channels in (2, 4) else "paint_opaque.cl"
        else:
            light = (_FLOATS[dtype_name], f"paint_floats_{encoding}.cl")
            mix = "paint_opaque.cl"
        taps = ("paint_point.cl",) if filter_name == "nearest" else (f"paint_{filter_name}.cl", "paint_blend.cl")
        names = (*light, mix, "paint_light.cl", *taps)
    lines = [f"#define {name} {value}\n" for name, value in head.items()]
    if "double" in head.values():
        lines.append("#pragma OPENCL EXTENSION cl_khr_fp64 : enable\n")
    parts = ("paint_picture.cl", f"paint_{'weighted' if is_weighted else 'unweighted'}.cl", *names, "paint.cl")
    return "".join(lines) + "".join(f'#line 1 "{name}"\n{fragment(name)}' for name in parts)
