"""What the first surface of a lens reflects, as light that is added to what is seen through it.

Input: what `fresnel = "split"` adds to a map, and the environment. Output: light for each film pixel, linear. A share
`reflectance` of the light of the environment is seen where the reflection goes:

- a colour, shares of full scale in the encoding of the picture that is painted, is the same everywhere;
- the picture is met where the straight ray from the surface meets its plane, ahead; beside it there is what is outside;
- an image is a panorama around the scene, far away: s runs once around the z axis and t from +z down to -z. Its middle
  column lies towards +x, and columns further right towards -y, as one turns right who looks along x with z up.

No lens is met on the way, and nothing is averaged but between samples of the image. The reflection is added to light
that is multiplied by alpha and leaves alpha as it is: integers show it only where the picture is opaque.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.effects.colours import LUMINANCE
from lenscl.errors import ImageError
from lenscl.imaging.dispersed import colours_of, light_from
from lenscl.imaging.encoding import Encoding, decode
from lenscl.imaging.read import read_picture

_KEPT = 2  # images as light: a sweep paints one picture after another in the same one

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Panorama:
    """An image around the scene, as linear light, shape (H, W, C)."""

    light: Array

    @classmethod
    def read(cls, path: str, colours: int) -> Panorama:
        """Read an image; one without colour is grey, and of one that has more than the picture the luminance is left.

        Raises
        ------
        ImageError
            If it cannot be read.
        """
        try:
            about = os.stat(path)
        except (OSError, ValueError):  # reading it says what is wrong
            return cls(_light_of(path, (0, 0), colours))
        return cls(_light_of(path, (about.st_mtime_ns, about.st_size), colours))

    def towards(self, directions: NDArray[Any]) -> Array:
        """Return the light from directions, shape (..., 3) -> (..., C), bilinear between samples at (i + 1/2) / W."""
        height, width = self.light.shape[:2]
        x, y, z = np.moveaxis(directions.astype(np.float64), -1, 0)
        column = (0.5 - np.arctan2(y, x) / (2.0 * np.pi)) * width - 0.5
        row = np.clip(np.arctan2(np.hypot(x, y), z) / np.pi * height - 0.5, 0.0, height - 1.0)
        left, above = np.floor(column).astype(int), np.minimum(np.floor(row).astype(int), max(0, height - 2))
        across, down = (column - left)[..., np.newaxis], (row - above)[..., np.newaxis]
        below = np.minimum(above + 1, height - 1)
        upper, lower = (
            _between(self.light[at, left % width], self.light[at, (left + 1) % width], across) for at in (above, below)
        )
        return _between(upper, lower, down)


def _between(first: Array, second: Array, share: Array) -> Array:
    """Return what lies so far from one to the other; what has no share in it, NaN too, has none."""
    mixed: Array = np.where(share < 1.0, (1.0 - share) * first, 0.0) + np.where(share > 0.0, share * second, 0.0)
    return mixed


@lru_cache(maxsize=_KEPT)
def _light_of(path: str, _stamp: tuple[int, int], colours: int) -> Array:
    """Return an image as light; it is read again where its time of change or its size is another."""
    try:
        image = read_picture(path)
    except ImageError as error:
        raise ImageError(f"effects.environment: {error}") from error
    light = light_from(image.pixels, image.encoding).astype(np.float64)
    light = light[..., : colours_of(light.shape[-1])]
    if light.shape[-1] > colours:
        light = light @ LUMINANCE[:, np.newaxis]
    return np.broadcast_to(light, (*light.shape[:2], colours))


def shown_by(environment: str | tuple[float, ...], channels: int, curve: Encoding) -> Panorama | Array | None:
    """Return what an environment shows: an image, the light of a colour, or None for the picture itself.

    A colour is given as shares of full scale, in the picture's encoding.
    """
    colours = colours_of(channels)
    if not isinstance(environment, str):
        colour = decode(np.array(environment), curve)
        return np.broadcast_to(colour if len(colour) <= colours else colour @ LUMINANCE, (colours,))
    return None if environment == "picture" else Panorama.read(environment, colours)


def reflection(
    shown: Panorama | Array | None,
    added: Mapping[str, NDArray[Any]],
    channels: int,
    mirrored: Callable[[NDArray[Any]], NDArray[Any]],
) -> Array:
    """Return the light that first surfaces reflect, shape (rows, columns, C).

    Parameters
    ----------
    shown
        As `shown_by` returns it.
    added : mapping of str to array
        What the effects add to the map.
    channels : int
    mirrored : callable
        The picture's light at places of its plane, shape (rows, columns, 2).
    """
    share, colours = added["reflectance"].astype(np.float64)[..., np.newaxis], colours_of(channels)
    if isinstance(shown, Panorama):
        seen = shown.towards(added["reflected"])
    else:
        seen = mirrored(added["reflected_st"])[..., :colours].astype(np.float64) if shown is None else shown
    light = np.zeros((*share.shape[:-1], channels))
    light[..., :colours] = np.where(share > 0.0, share * seen, 0.0)
    return light
