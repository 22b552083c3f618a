"""Mix what a picture looks like at each of several wavelengths, each seen at its own place.

Input: pictures painted in light, one a wavelength, by that wavelength's map. Output: one picture. A wavelength's
picture is what the whole spectrum would show if it went that wavelength's way; its matrix takes its share of that.

All is in linear light, colour multiplied by alpha; the sum is made on the host in double precision.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.effects.colours import LUMINANCE
from lenscl.imaging.encoding import Encoding, decode, decode_table, encode, full_scale

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Layer:
    """One wavelength's part of a ray map, as painting reads it."""

    st: NDArray[Any]
    status: NDArray[np.uint8]
    device: Any
    added: dict[str, NDArray[Any]]
    samples: Any


def layers_of(raymap: Any) -> list[Layer]:
    """Return a map's wavelengths one by one; none where it has no axis of them."""
    added = getattr(raymap, "added", {})
    if "wavelengths" not in added:
        return []
    samples = getattr(raymap, "samples", None)
    return [
        Layer(
            raymap.st[number],
            raymap.status[number],
            raymap.device,
            {name: array[number] for name, array in added.items() if name != "wavelengths"},
            None if samples is None else samples.layer(number),
        )
        for number in range(len(added["wavelengths"]))
    ]


def light_from(pixels: NDArray[Any], encoding: Encoding) -> NDArray[Any]:
    """Return pixels (..., C) as light in floats, straight alpha multiplied in: float64 from 64 bits, else float32."""
    if pixels.dtype.kind != "u":
        return decode(pixels, encoding).astype(np.float64 if pixels.dtype.itemsize == 8 else np.float32)
    colours = colours_of(pixels.shape[-1])
    ratios = pixels.astype(np.float32) / np.float32(full_scale(pixels.dtype))
    light = decode_table(pixels.dtype.name)[pixels] if encoding == "srgb" else ratios
    if colours == pixels.shape[-1]:
        return light
    alpha = ratios[..., colours:]
    return np.concatenate([light[..., :colours] * alpha, alpha], axis=-1)


def pixels_from(light: Array, dtype: np.dtype[Any], encoding: Encoding) -> NDArray[Any]:
    """Return light (..., C) as pixels of a type; the inverse of `light_from`.

    Light beyond what an integer can say is cut off: a single wavelength has no colour within sRGB. Where an integer's
    alpha is 0 its colour is, too.
    """
    colours = colours_of(light.shape[-1])
    if dtype.kind != "u" or colours == light.shape[-1]:
        return encode(light, dtype, encoding)
    alpha = encode(light[..., colours:], dtype, "linear")
    share = np.where(alpha > 0, light[..., colours:], np.inf)
    return np.concatenate([encode(light[..., :colours] / share, dtype, encoding), alpha], axis=-1)


def mixed(painted: Iterable[NDArray[Any]], matrices: Array, shares: Array) -> Array:
    """Return the sum of pictures in light, each (rows, columns, C), as each wavelength's matrix (3, 3) has it.

    A picture without colour is mixed by luminance. Alpha is the mean, by the wavelengths' shares of the spectrum. What
    a matrix takes nothing of is not looked at, so that a NaN or Inf stays in the channels that it reaches.
    """
    total: Array | None = None
    for picture, matrix, share in zip(painted, matrices, shares, strict=True):
        channels = picture.shape[-1]
        colours = colours_of(channels)
        weights = np.zeros((channels, channels))
        weights[:colours, :colours] = matrix if colours == 3 else LUMINANCE @ matrix.sum(axis=1)
        weights[colours:, colours:] = share
        total = np.zeros(picture.shape) if total is None else total
        for to, source in np.argwhere(weights):
            total[..., to] += weights[to, source] * picture[..., source]
    assert total is not None, "a map has a wavelength at least"
    return total


def colours_of(channels: int) -> int:
    """Return how many of so many channels are colours: alpha is the last of 2 or 4."""
    return channels - (channels % 2 == 0)
