"""Colour a ray map with a picture, on the OpenCL device that traced it.

Input: a ray map and pixels (H, W, C). Output: pixels (rows, columns, C) of the same type. A picture's samples stand at
(i + 1/2) / W; between them colours are mixed in linear light, and the edges go on outwards. Each film pixel is one
point: nothing is averaged where the lens makes the picture smaller, unless the map has a `jacobian`. Then a film pixel
is the mean over the parallelogram that it covers on the picture, to first order; where that is no longer than half a
picture pixel the two are the same. Where the map has samples of a pixel, it is their mean (`lenscl.imaging.mean`).
Where the map says how much light gets through, its colours are dimmed by that, in linear light; alpha is not, nor is
the colour outside. Where the map has several wavelengths, each shows its share of the picture at its own place
(`spectrum`, `dispersed`): as many launches. Where it says what the first surface reflects, the light of the environment
is added to that extent (`reflected`).

Alpha is the last of 2 or 4 channels. Integers carry straight alpha and are mixed multiplied by it, so that no hidden
colour shows; floats carry colour already multiplied (associated), as EXR does. Floats are never cut off; integers are
held within their range, where a bicubic mix can overshoot.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any, Literal, Protocol, TypeAlias, cast, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.device import Buffer, Device, Program
from lenscl.effects.colours import LUMINANCE
from lenscl.errors import StudyError
from lenscl.imaging.dispersed import colours_of, layers_of, light_from, mixed, pixels_from
from lenscl.imaging.encoding import DTYPES, Encoding, encode_table, encoding_of, full_scale
from lenscl.imaging.light import BITS, PYRAMID, light_head, light_parts, lighten, text_of
from lenscl.imaging.mean import Means, SampledPixels, parts
from lenscl.imaging.reflected import Panorama, reflection, shown_by
from lenscl.imaging.spectrum import refuse_unseen, shares_of, spectral_matrices
from lenscl.status import RayStatus

Array: TypeAlias = NDArray[np.float64]
Filter: TypeAlias = Literal["nearest", "bilinear", "bicubic"]

_CHANNELS = (1, 2, 3, 4)


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
    """A picture on a device and the program that paints it, with what more is asked."""

    program: Program
    picture: NDArray[Any]
    pixels: Buffer
    light: Buffer
    outside: NDArray[Any]
    filter: Filter
    curve: Encoding


@dataclass(frozen=True, slots=True)
class _Mirror:
    """A map of where reflections land."""

    st: NDArray[Any]
    status: NDArray[np.uint8]
    device: Device


class Painter:
    """A ray map held on its device, ready to paint any number of pictures.

    Parameters
    ----------
    raymap : RayMap
        Of it only `st`, `status`, `device` and, where its scene asks for them, `samples`, `wavelengths`,
        `transmittance`, `transmission` and `jacobian` are read. Samples stay on the host, and pass through the device
        part by part.

    Examples
    --------
    One trace serves a whole folder::

        painter = Painter(lenscl.trace(scene))
        painted = [painter.paint(read_picture(path).pixels) for path in paths]
    """

    def __init__(self, raymap: PaintableMap) -> None:
        self._environment: str | tuple[float, ...] = getattr(getattr(raymap, "scene", None), "environment", "picture")
        layers = layers_of(raymap)
        if layers:
            wavelengths = cast(Any, raymap).added["wavelengths"]
            refuse_unseen(wavelengths.tolist())
            self._matrices, self._shares = spectral_matrices(wavelengths), shares_of(wavelengths)
        self._layers = [Painter(layer) for layer in layers]
        if layers:
            return
        self._shape: tuple[int, int] = raymap.status.shape[:2]
        self._double_places = raymap.st.dtype == np.float64
        self._device = raymap.device
        self._places = raymap.device.upload(raymap.st)
        self._status = raymap.device.upload(raymap.status)
        added = getattr(raymap, "added", {})
        self._added: Mapping[str, NDArray[Any]] = added
        self._weights = _weights(added)
        jacobian = added.get("jacobian")
        self._footprints = [] if jacobian is None else [raymap.device.upload(jacobian.astype(raymap.st.dtype))]
        self._samples: SampledPixels | None = getattr(raymap, "samples", None)

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
        layers = self._layers or [self]
        if self._layers or "reflectance" in self._added:
            ready = layers[0]._ready(light_from(picture, curve), filter_name, "linear", light_from(colour, curve))
            shown = shown_by(self._environment, picture.shape[2], curve)
            lit = (layer._whole(ready) + layer._reflected(ready, shown) for layer in layers)
            seen = mixed(lit, self._matrices, self._shares) if self._layers else next(lit).astype(np.float64)
            painted = pixels_from(seen, picture.dtype, curve)
        else:
            painted = self._whole(self._ready(picture, filter_name, curve, colour))
        return painted if pixels.ndim == 3 else painted[..., 0]

    def _ready(self, picture: NDArray[Any], filter_name: Filter, curve: Encoding, outside: NDArray[Any]) -> _Ready:
        """Return a picture on the device, for this map and others of its kind."""
        program = self._program(picture.dtype, picture.shape[2], filter_name, curve)
        pixels_there = self._device.upload(picture)
        light_there = pixels_there
        if filter_name != "nearest" or self._weights is not None or self._footprints:
            light_there = lighten(program, picture, pixels_there, is_pyramid=bool(self._footprints))
        return _Ready(program, picture, pixels_there, light_there, outside, filter_name, curve)

    def _program(self, dtype: np.dtype[Any], channels: int, filter_name: Filter, curve: Encoding) -> Program:
        is_weighted, has_footprints = self._weights is not None, bool(self._footprints)
        text = _source(dtype.name, channels, self._double_places, filter_name, curve, is_weighted, has_footprints)
        if "double" in text and not self._device.has_double:
            raise StudyError([f"pixels: {self._device.label} has no double precision; give the picture as float32"])
        return self._device.build(text, kind="paint")

    def _whole(self, ready: _Ready) -> NDArray[Any]:
        """Return what a picture looks like, shape (rows, columns, C), the means of samples among it."""
        device, picture = self._device, ready.picture
        channels = picture.shape[2]
        outside_there = device.upload(ready.outside)
        seen = (ready.pixels, ready.light, outside_there)
        painted_there = self._painted(ready.program, picture.shape, picture.dtype, seen)
        if self._samples is not None:
            is_pyramid = bool(self._footprints)
            means = Means(device, picture, ready.pixels, ready.outside, ready.curve, is_pyramid=is_pyramid)
            for part in parts(self._samples, device):
                painter = Painter(part)
                program = painter._program(means.dtype, channels, ready.filter, "linear")
                seen = (means.light, means.light, means.outside)
                means.write(part, painter._painted(program, picture.shape, means.dtype, seen), painted_there)
        painted = np.empty((*self._shape, channels), picture.dtype)
        device.download(painted_there, painted)
        return painted

    def _reflected(self, ready: _Ready, shown: Panorama | Array | None) -> Array | float:
        """Return the light that first surfaces reflect, shape (rows, columns, C), the means of samples among it."""
        if "reflectance" not in self._added:
            return 0.0
        mirrored, channels = partial(self._mirrored, ready), ready.picture.shape[2]
        light = reflection(shown, self._added, channels, mirrored)
        if self._samples is not None:
            flat = light.reshape(-1, light.shape[-1])
            for part in parts(self._samples, self._device):
                flat[part.pixels] = reflection(shown, part.added, channels, mirrored).mean(axis=1)
        return light

    def _mirrored(self, ready: _Ready, st: NDArray[Any]) -> NDArray[Any]:
        """Return the picture's light at places of its plane, and the light outside beside it."""
        is_on = ((st >= 0.0) & (st < 1.0)).all(axis=-1)
        status = np.where(is_on, np.uint8(RayStatus.PICTURE), np.uint8(RayStatus.OFF_PICTURE))
        mirror = Painter(_Mirror(np.ascontiguousarray(st), status, self._device))
        program = mirror._program(ready.picture.dtype, ready.picture.shape[2], ready.filter, ready.curve)
        return mirror._whole(replace(ready, program=program))

    def _painted(
        self,
        program: Program,
        shape: tuple[int, ...],
        dtype: np.dtype[Any],
        seen: tuple[Buffer, Buffer, Buffer],
    ) -> Buffer:
        """Return the film as it is painted, on the device.

        Parameters
        ----------
        program : Program
            Of `_source`.
        shape, dtype : (H, W, C), dtype
            Of the picture.
        seen : three buffers
            The picture's pixels, the same as linear light, and the colour outside.
        """
        height, width, channels = shape
        pixels_there, light_there, outside_there = seen
        device, count = self._device, self._shape[0] * self._shape[1]
        painted_there = device.empty(count * channels * dtype.itemsize)
        program.run(
            "paint",
            count,
            [
                np.int64(count),
                self._places,
                self._status,
                np.int32(width),
                np.int32(height),
                pixels_there,
                light_there,
                device.upload(encode_table()),
                outside_there,
                painted_there,
                *self._weights_there(dtype, channels),
                *self._footprints,
            ],
        )
        return painted_there

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
    """Return the picture as the film sees it: each film pixel takes the colour at the place where its ray lands.

    Parameters
    ----------
    raymap : RayMap
        A ray of status PICTURE takes the colour at `st`; every other ray takes `outside`. Arrays of effects change the
        colour:

        - `transmittance` and `transmission` multiply it, in linear light. A grey picture takes the luminance of what
          they leave of white.
        - `jacobian`: it is the mean over the pixel's footprint, of up to 16 x 16 places. A footprint that is 8 picture
          pixels wide, or more than 16 long, takes places of a coarser level of an image pyramid. Beyond the picture,
          its edge pixels continue. Edges of the lens stay hard.
        - `samples`: it is the mean over the samples of a pixel, in linear light and with equal weights, whatever their
          status.
        - `wavelengths`: each wavelength adds its share of the light at its own place; `outside` likewise. Alpha is the
          mean. Integers clip colours beyond sRGB. A grey picture takes the luminance; give it as RGB to see fringes.
    pixels : array, shape (H, W, C) or (H, W)
        uint8, uint16, float16, float32 or float64; C = 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA. The picture and the
        result must each fit into one allocation of the device.
    filter : str
        "nearest" copies the pixel (floor(t H), floor(s W)) bit for bit. "bilinear" mixes 2 x 2 samples. "bicubic" mixes
        4 x 4 (Catmull-Rom: it passes through the samples and overshoots at hard edges).
    encoding : str, optional
        "srgb" or "linear"; default "srgb" for integers, "linear" for floats.
    outside : number or sequence
        In the numbers of the pixels (0 to 255 for uint8): one number, one for each colour, or one for each channel.
        Alpha is 1 by default.

    Returns
    -------
    array, shape (rows, columns, C) or (rows, columns)
        Of the dtype of `pixels`. A picture of one colour keeps exactly that colour (sRGB-encoded floats: to rounding).
        Where the mixed alpha of an integer picture is 0, the colour is that of the pixel nearest to the landing place.
        A pixel that is NaN or Inf affects only the places whose mix includes it; with `jacobian`, only those whose
        pyramid levels include it.

    Raises
    ------
    StudyError
        If an argument is not valid, or no wavelength of the map is visible; the message says which and what is valid.
    TraceError
        If the device has too little memory.
    """
    return Painter(raymap).paint(pixels, filter=filter, encoding=encoding, outside=outside)


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
    colours = colours_of(channels)
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
    dtype_name: str,
    channels: int,
    double_places: bool,
    filter_name: Filter,
    encoding: Encoding,
    is_weighted: bool,
    has_footprints: bool = False,
) -> str:
    """Return the text of one paint program: the head, then the fragments that the picture calls for."""
    dtype = np.dtype(dtype_name)
    mixes = filter_name != "nearest" or is_weighted or has_footprints
    head = {
        "PLACE": "double" if double_places else "float",
        "STORED": BITS[dtype.itemsize],
        "WORK": "double" if dtype.itemsize == 8 and mixes else "float",
        "CHANNELS": channels,
        "COLOURS": colours_of(channels),
        "ON_PICTURE": int(RayStatus.PICTURE),
    }
    names: Sequence[str] = ("paint_nearest.cl",)
    if mixes:
        head |= light_head(dtype)
        taps = ("paint_point.cl",) if filter_name == "nearest" else (f"paint_{filter_name}.cl", "paint_blend.cl")
        places = (PYRAMID, "paint_footprint.cl") if has_footprints else ("paint_once.cl",)
        names = (*light_parts(dtype, channels, encoding), *taps, *places)
    weights = f"paint_{'weighted' if is_weighted else 'unweighted'}.cl"
    known = f"paint_{'footprints' if has_footprints else 'places'}.cl"
    return text_of(head, ("paint_picture.cl", weights, known, *names, "paint.cl"))
