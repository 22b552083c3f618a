"""What the first surface of a lens reflects, as light that is added to what is seen through it.

Input: the `Reflection` of film samples, and the environment. Output: light for each film pixel, linear. A share of the
light of the environment is seen where the reflection goes:

- a colour, shares of full scale in the encoding of the picture that is painted, is the same everywhere;
- the picture is met where the straight ray from the surface meets its plane, ahead; around it is the colour outside;
- an image is a panorama around the scene, far away: s runs once around the z axis and t from +z down to -z. Its middle
  column lies towards +x, and columns further right towards -y, as one turns right who looks along x with z up.

No lens is met on the way, and nothing is averaged but between samples of the image. The reflection is added to light
that is multiplied by alpha and leaves alpha as it is: integers show it only where the picture is opaque.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lenscl.effects.colours import LUMINANCE
from lenscl.errors import ImageError
from lenscl.imaging.device_picture import DevicePicture
from lenscl.imaging.encoding import Encoding, colours_of, decode, linear_light
from lenscl.imaging.film import FilmSamples, Layer, Reflection
from lenscl.imaging.programs import Filter
from lenscl.imaging.read import read_picture
from lenscl.imaging.resample import resampled

_KEPT = 2  # images as light: a sweep paints one picture after another in the same one

Array: TypeAlias = NDArray[np.float64]


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

    def reflected(self, reflection: Reflection) -> Array:
        """Return the light that reflections bring, shape (rows, columns, C)."""
        assert reflection.directions is not None, "a map says where reflections go, where an image shows that"
        return self.towards(reflection.directions)

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
    light = linear_light(image.pixels, image.encoding).astype(np.float64)
    light = light[..., : colours_of(light.shape[-1])]
    if light.shape[-1] > colours:
        light = light @ LUMINANCE[:, np.newaxis]
    return np.broadcast_to(light, (*light.shape[:2], colours))


@dataclass(frozen=True, slots=True)
class _OneColour:
    """Surroundings of the same light everywhere, shape (C,)."""

    light: Array

    def reflected(self, reflection: Reflection) -> Array:
        return self.light


@dataclass(frozen=True, slots=True)
class _PictureAround:
    """The picture's plane: the picture as linear light, and around it one pixel's light."""

    picture: DevicePicture
    filter: Filter
    outside: DevicePicture

    def reflected(self, reflection: Reflection) -> Array:
        samples = reflection.on_picture
        assert samples is not None, "a map says where reflections land, where they land on the picture"
        seen = resampled(samples, None, self.picture, self.filter, self.outside)
        return seen[..., : colours_of(self.picture.channels)].astype(np.float64)


Environment: TypeAlias = Panorama | _OneColour | _PictureAround


def environment_of(
    shown: str | tuple[float, ...],
    picture: DevicePicture,
    filter: Filter,  # noqa: A002 - the word of the study file
    outside: DevicePicture,
    encoding: Encoding,
) -> Environment:
    """Return what surfaces reflect, as light for a picture with so many colours.

    Parameters
    ----------
    shown : str or tuple of float
        "picture", the path of an image, or a colour: shares of full scale in `encoding`.
    picture : DevicePicture
        As linear light.
    filter : str
    outside : DevicePicture
        One pixel: the light outside the picture.
    encoding : str
        Of the picture as it was given.

    Raises
    ------
    ImageError
        If the image cannot be read.
    """
    if shown == "picture":
        return _PictureAround(picture, filter, outside)
    colours = colours_of(picture.channels)
    if isinstance(shown, str):
        return Panorama.read(shown, colours)
    colour = decode(np.array(shown), encoding)
    return _OneColour(np.broadcast_to(colour if len(colour) <= colours else colour @ LUMINANCE, (colours,)))


def reflected_light(layer: Layer, environment: Environment, channels: int) -> Array:
    """Return the light that first surfaces reflect, shape (rows, columns, C); 0 in alpha. Supersamples count as means.

    Parameters
    ----------
    layer : Layer
        Whose samples have reflections.
    environment : Environment
    channels : int
        Of the picture.
    """
    light = _reflected(layer.samples, environment, channels)
    if layer.more is not None:
        flat = light.reshape(-1, channels)  # a view of it
        for part in layer.more.parts():
            flat[part.pixels] = _reflected(part.samples, environment, channels).mean(axis=1)
    return light


def _reflected(samples: FilmSamples, environment: Environment, channels: int) -> Array:
    reflection = samples.reflection
    assert reflection is not None, "a layer's samples have reflections, or none of them has"
    share = reflection.share.astype(np.float64)[..., np.newaxis]
    light = np.zeros((*samples.shape, channels))
    light[..., : colours_of(channels)] = np.where(share > 0.0, share * environment.reflected(reflection), 0.0)
    return light
