"""The plain twin of painting: float64, whole arrays, one formula a step.

Where the kernel mixes differences from a base sample and encodes by table, this sums weight times sample and raises to
powers, so that the two share no shortcut.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.status import RayStatus


def paint(
    st: NDArray[Any],
    status: NDArray[np.uint8],
    pixels: NDArray[Any],
    *,
    filter: str = "bilinear",  # noqa: A002 - the word of the study file
    encoding: str | None = None,
    outside: ArrayLike = 0,
) -> NDArray[np.float64]:
    """Return what painting should give, before rounding to the picture's type.

    Parameters
    ----------
    st : real array, shape (..., 2)
        Places on the picture.
    status : uint8 array, shape (...)
        Values of `RayStatus`.
    pixels : array, shape (H, W, C)
        With alpha in the last of 2 or 4 channels: straight in integers, associated in floats.
    filter, encoding : str
        As in `lenscl.paint`.
    outside : number or sequence
        One value, or one a channel.

    Returns
    -------
    float64 array, shape (..., C)
        In the numbers of `pixels`; integers are held within their range but not rounded.
    """
    height, width, channels = pixels.shape
    is_integer = pixels.dtype.kind == "u"
    most = float(np.iinfo(pixels.dtype).max) if is_integer else 1.0
    is_srgb = (encoding or ("srgb" if is_integer else "linear")) == "srgb"
    is_straight = is_integer and channels in (2, 4)
    lands = status == RayStatus.PICTURE
    x, y = st[lands][:, 0].astype(np.float64) * width, st[lands][:, 1].astype(np.float64) * height

    colour = pixels[_held(np.floor(y), height), _held(np.floor(x), width)].astype(np.float64) / most
    if filter != "nearest":
        ratios = pixels.astype(np.float64) / most
        hidden = colour[:, :-1]
        if is_straight:
            light = _light(ratios[..., :-1], is_srgb) * ratios[..., -1:]
            mixed = _mixed(x, y, np.concatenate([light, ratios[..., -1:]], axis=2), filter)
            colour = _unmultiplied(mixed, hidden, is_srgb, 0.5 / most)
        else:
            mixed = _mixed(x, y, _light(ratios, is_srgb), filter)
            colour = _encoded(np.clip(mixed, 0.0, 1.0) if is_integer else mixed, is_srgb)

    painted = np.empty((*status.shape, channels))
    painted[...] = outside
    if np.ndim(outside) == 0 and channels in (2, 4):
        painted[..., -1] = most
    painted[lands] = most * colour
    return painted


def _mixed(
    x: NDArray[np.float64], y: NDArray[np.float64], values: NDArray[np.float64], filter_name: str
) -> NDArray[np.float64]:
    """Return the sum of weight times sample at places in pixels, (N,), of values (H, W, C)."""
    total = np.zeros((x.size, values.shape[2]))
    for row, weight_y in _taps(y - 0.5, filter_name):
        for column, weight_x in _taps(x - 0.5, filter_name):
            weight = (weight_y * weight_x)[:, np.newaxis]
            value = values[_held(row, values.shape[0]), _held(column, values.shape[1])]
            with np.errstate(invalid="ignore"):
                total += np.where(weight == 0.0, 0.0, weight * value)
    return total


def _taps(x: NDArray[np.float64], filter_name: str) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Return (sample, its weight) for every sample that a filter reads on one axis."""
    reach = 1 if filter_name == "bilinear" else 2
    first = np.floor(x) - (reach - 1)
    kernel = _tent if filter_name == "bilinear" else _catmull_rom
    return [(first + i, kernel(np.abs(x - (first + i)))) for i in range(2 * reach)]


def _tent(distance: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.maximum(1.0 - distance, 0.0)


def _catmull_rom(distance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return Keys' cubic, a = -1/2, of the distance to a sample (Keys 1981, eq. 15)."""
    d = distance
    near = 1.5 * d**3 - 2.5 * d**2 + 1.0
    far = -0.5 * d**3 + 2.5 * d**2 - 4.0 * d + 2.0
    return np.where(d <= 1.0, near, np.where(d < 2.0, far, 0.0))


def _unmultiplied(
    mixed: NDArray[np.float64], hidden: NDArray[np.float64], is_srgb: bool, least_alpha: float
) -> NDArray[np.float64]:
    """Return straight colour and alpha; `hidden` is the colour where alpha rounds to 0."""
    alpha = np.clip(mixed[:, -1:], 0.0, 1.0)
    is_seen = alpha >= least_alpha
    colour = np.clip(mixed[:, :-1] / np.where(is_seen, mixed[:, -1:], 1.0), 0.0, 1.0)
    return np.concatenate([np.where(is_seen, _encoded(colour, is_srgb), hidden), alpha], axis=1)


def _held(index: NDArray[np.float64], size: int) -> NDArray[np.intp]:
    return np.clip(index, 0, size - 1).astype(np.intp)


def _light(encoded: NDArray[np.float64], is_srgb: bool) -> NDArray[np.float64]:
    """Return linear light (IEC 61966-2-1:1999, section 5.2)."""
    if not is_srgb:
        return encoded
    above = np.maximum(encoded, 0.04045)
    return np.where(encoded <= 0.04045, encoded / 12.92, ((above + 0.055) / 1.055) ** 2.4)


def _encoded(light: NDArray[np.float64], is_srgb: bool) -> NDArray[np.float64]:
    """Return sRGB values (IEC 61966-2-1:1999, section 5.3)."""
    if not is_srgb:
        return light
    above = np.maximum(light, 0.0031308)
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * above ** (1 / 2.4) - 0.055)
