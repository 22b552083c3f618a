"""What a stored number means as light: full scale, the sRGB curve, alpha.

Integers hold codes of 0 to full scale, sRGB-encoded unless told otherwise, and straight alpha; floats hold linear light
unless told otherwise, and associated alpha. Alpha is the last of 2 or 4 channels. Source of the curve: IEC
61966-2-1:1999, sections 5.2 and 5.3.
"""

from __future__ import annotations

from functools import cache
from typing import Any, Literal, TypeAlias, cast, get_args

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from lenscl.errors import StudyError

Encoding: TypeAlias = Literal["srgb", "linear"]

DTYPES = ("uint8", "uint16", "float16", "float32", "float64")  # the pixels this program works with
ENCODE_STEPS = 4096  # cells of the encoding table: its error stays under 0.003 of a 16-bit code


def full_scale(dtype: DTypeLike) -> int:
    """Return the number that means 1: the largest code of an integer type, 1 for floats."""
    kind = np.dtype(dtype)
    return int(np.iinfo(kind).max) if kind.kind == "u" else 1


def encoding_of(dtype: DTypeLike, encoding: str | None) -> Encoding:
    """Return the encoding asked for, or the usual one: sRGB for integers, linear for floats.

    Raises
    ------
    StudyError
        If it is none of the known ones.
    """
    if encoding is None:
        return "srgb" if np.dtype(dtype).kind == "u" else "linear"
    if encoding not in get_args(Encoding):
        known = " or ".join(f'"{name}"' for name in get_args(Encoding))
        raise StudyError([f"encoding: {encoding!r} is not known; it is {known}, or left out"])
    return cast(Encoding, encoding)


def linear_from_srgb(encoded: ArrayLike) -> NDArray[np.float64]:
    """Return linear light from sRGB values, 1 being white; below 0 the straight part of the curve goes on."""
    e = np.asarray(encoded, dtype=np.float64)
    curve = np.power((np.maximum(e, 0.04045) + 0.055) / 1.055, 2.4)
    return np.where(e <= 0.04045, e / 12.92, curve)


def srgb_from_linear(light: ArrayLike) -> NDArray[np.float64]:
    """Return sRGB values from linear light; the inverse of `linear_from_srgb`."""
    x = np.asarray(light, dtype=np.float64)
    curve = 1.055 * np.power(np.maximum(x, 0.0031308), 1 / 2.4) - 0.055
    return np.where(x <= 0.0031308, x * 12.92, curve)


def decode(pixels: NDArray[Any], encoding: Encoding) -> NDArray[np.float64]:
    """Return stored numbers as linear light, 1 being white."""
    values = pixels / full_scale(pixels.dtype)
    return linear_from_srgb(values) if encoding == "srgb" else values


def encode(light: NDArray[np.float64], dtype: DTypeLike, encoding: Encoding) -> NDArray[Any]:
    """Return linear light as stored numbers; integers are rounded and held within their range."""
    kind = np.dtype(dtype)
    values = srgb_from_linear(light) if encoding == "srgb" else light
    if kind.kind == "u":
        values = np.rint(np.clip(values, 0.0, 1.0) * full_scale(kind))
    return values.astype(kind)


def colours_of(channels: int) -> int:
    """Return how many of so many channels are colours: alpha is the last of 2 or 4."""
    return channels - (channels % 2 == 0)


def light_dtype(dtype: DTypeLike) -> np.dtype[Any]:
    """Return the type in which light of such pixels is mixed: float64 for pixels of 64 bits, else float32."""
    return np.dtype(np.float64 if np.dtype(dtype).itemsize == 8 else np.float32)


def linear_light(pixels: NDArray[Any], encoding: Encoding, dtype: DTypeLike | None = None) -> NDArray[Any]:
    """Return pixels as linear light with associated alpha: colour is multiplied by it.

    Parameters
    ----------
    pixels : array, shape (..., C)
        Integers with straight alpha, or floats with associated alpha.
    encoding : str
        Of the pixels.
    dtype : dtype, optional
        Of the result, and of the product with alpha. Default: `light_dtype` of the pixels.

    Returns
    -------
    array, shape (..., C)
    """
    kind = light_dtype(pixels.dtype) if dtype is None else np.dtype(dtype)
    if pixels.dtype.kind != "u":
        return decode(pixels, encoding).astype(kind)
    colours = colours_of(pixels.shape[-1])
    light: NDArray[Any] = light_table(pixels.dtype.name, encoding, kind.name)[pixels[..., :colours]]
    if colours == pixels.shape[-1]:
        return light
    alpha = light_table(pixels.dtype.name, "linear", kind.name)[pixels[..., colours:]]
    return np.concatenate([light * alpha, alpha], axis=-1)


def pixels_from_light(light: NDArray[np.float64], dtype: DTypeLike, encoding: Encoding) -> NDArray[Any]:
    """Return linear light, shape (..., C), as pixels of a type; the inverse of `linear_light`.

    Integers clip light outside [0, 1], as that of a single wavelength, which has no colour within sRGB. Where the alpha
    of an integer pixel is 0 its colour is 0.
    """
    kind, colours = np.dtype(dtype), colours_of(light.shape[-1])
    if kind.kind != "u" or colours == light.shape[-1]:
        return encode(light, kind, encoding)
    alpha = encode(light[..., colours:], kind, "linear")
    share = np.where(alpha > 0, light[..., colours:], np.inf)
    return np.concatenate([encode(light[..., :colours] / share, kind, encoding), alpha], axis=-1)


def light_of(pixels: NDArray[Any], encoding: Encoding) -> NDArray[Any]:
    """Return integer pixels (H, W, C) as the linear light that an EXR holds: float16 from 8 bits, else float32.

    Half precision has 11 bits, and neighbouring codes of 8 bits, sRGB-encoded or linear, stay apart in it.
    """
    return linear_light(pixels, encoding, np.float64).astype(np.float16 if pixels.dtype == np.uint8 else np.float32)


@cache
def light_table(dtype_name: str, encoding: Encoding, kind: str = "float32") -> NDArray[Any]:
    """Return the linear light of every code of an integer type, in a type of floats; read-only."""
    codes = np.arange(full_scale(dtype_name) + 1, dtype=dtype_name)
    table = decode(codes, encoding).astype(kind)
    table.setflags(write=False)
    return table


@cache
def encode_table() -> NDArray[np.float32]:
    """Return the sRGB curve on an even grid in sqrt(light), where it is nearly straight; read-only.

    Cell i starts at light = (i / ENCODE_STEPS)^2; one entry more than a reader at light = 1 can touch.
    """
    roots = np.arange(ENCODE_STEPS + 2, dtype=np.float64) / ENCODE_STEPS
    x = np.maximum(roots**2, 1e-9)
    table = (1.055 * np.power(x, 1 / 2.4) - 0.055).astype(np.float32)  # the curved part alone: no kink to cut off
    table.setflags(write=False)
    return table
