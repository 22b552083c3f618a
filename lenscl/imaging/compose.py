"""Paint a film with a picture, on the OpenCL device: `paint_film`.

Input: a `Film` and a `DevicePicture`. Output: pixels (rows, columns, C) of the picture's type and encoding.

- A picture's samples stand at (i + 1/2) / W. Between them colours are mixed in linear light, and beyond them the edges
  go on.
- A film pixel is one point of the picture. With a Jacobian it is the mean over the parallelogram that it covers there,
  to first order; where that is no longer than half a picture pixel the two are the same.
- With further samples of a pixel it is their mean in linear light, each with the same weight whatever its status.
- Weights multiply colours in linear light, but neither alpha nor the colour outside.
- With a spectrum each layer is painted by itself, in linear light, and adds its wavelength's share.
- Reflections of the environment are added, in linear light.
- Where integers would clip highlights, each part of a film pixel is clipped by itself, before the mean.

Alpha is the last of 2 or 4 channels. Integers carry straight alpha and are mixed multiplied by it, so that no hidden
colour shows; floats carry associated alpha, as EXR does. Floats are never clipped; integers are held within their
range, where a bicubic mix can overshoot.
"""

from __future__ import annotations

from typing import Any, TypeAlias, cast, get_args

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from lenscl.errors import StudyError
from lenscl.imaging.device_picture import DevicePicture
from lenscl.imaging.encoding import colours_of, full_scale, pixels_from_light
from lenscl.imaging.environment import environment_of, reflected_light
from lenscl.imaging.film import Film
from lenscl.imaging.programs import Filter
from lenscl.imaging.resample import resampled
from lenscl.imaging.spectral import mixed

Array: TypeAlias = NDArray[np.float64]


def paint_film(
    film: Film,
    picture: DevicePicture,
    *,
    filter: str = "bilinear",  # noqa: A002 - the word of the study file
    outside: ArrayLike = 0,
) -> NDArray[Any]:
    """Return the colours of a film's pixels.

    Parameters
    ----------
    film : Film
    picture : DevicePicture
        On the film's device.
    filter : str
        "nearest", "bilinear" or "bicubic".
    outside : number or sequence
        The colour of rays that did not land, in the picture's own numbers; see `lenscl.paint`.

    Returns
    -------
    array, shape (rows, columns, C)
        In the picture's type and encoding.

    Raises
    ------
    StudyError
        If the filter or the colour outside is not one of those.
    ImageError
        If the environment is an image that cannot be read.
    TraceError
        If the device has not the memory.
    """
    filter_name = _filter_of(filter)
    around = _one_pixel(picture, _outside_colour(outside, picture.pixels.dtype, picture.channels))
    if film.spectrum is None and not film.has_reflections:
        (layer,) = film.layers
        painted = resampled(layer.samples, layer.more, picture, filter_name, around)
    else:
        light = _light(film, picture, filter_name, around)
        painted = pixels_from_light(light, picture.pixels.dtype, picture.encoding)
    if film.highlights is not None and picture.pixels.dtype.kind == "u":
        _clip_highlights(painted, film, picture, filter_name)
    return painted


def _light(film: Film, picture: DevicePicture, filter_name: Filter, around: DevicePicture) -> Array:
    """Return the light of film pixels: the layers' with what they reflect, mixed by the spectrum where there is one."""
    linear, outside = picture.linear, around.linear
    layers = (resampled(layer.samples, layer.more, linear, filter_name, outside) for layer in film.layers)
    if film.has_reflections:
        environment = environment_of(film.environment, linear, filter_name, outside, picture.encoding)
        reflected = (reflected_light(layer, environment, picture.channels) for layer in film.layers)
        layers = (seen + added for seen, added in zip(layers, reflected, strict=True))
    if film.spectrum is None:
        return next(layers).astype(np.float64)
    return mixed(layers, film.spectrum)


def _clip_highlights(painted: NDArray[Any], film: Film, picture: DevicePicture, filter_name: Filter) -> None:
    """Replace colours of painted integers that exceed white in a part of the film pixel."""
    assert film.highlights is not None
    flat = painted.reshape(-1, picture.channels)  # a view of it
    for pixels, parts in film.highlights():
        seen = paint_film(parts, picture.linear, filter=filter_name)
        means = pixels_from_light(_up_to_white(seen).mean(axis=1), painted.dtype, picture.encoding)
        if colours_of(picture.channels) < picture.channels:  # where nothing is seen, the hidden colour stays
            is_seen = means[:, -1] > 0
            pixels, means = pixels[is_seen], means[is_seen]
        flat[pixels] = means


def _up_to_white(light: NDArray[Any]) -> Array:
    """Return light, shape (..., C), as far as an integer can show it: colours from 0 to alpha."""
    held = light.astype(np.float64)
    colours = colours_of(held.shape[-1])
    alpha = held[..., colours:] if colours < held.shape[-1] else 1.0
    held[..., :colours] = np.clip(held[..., :colours], 0.0, alpha)
    return held


def _one_pixel(picture: DevicePicture, colour: NDArray[Any]) -> DevicePicture:
    """Return a colour, shape (C,), as a picture like another."""
    return DevicePicture(picture.device, colour.reshape(1, 1, -1), picture.encoding)


def _filter_of(name: str) -> Filter:
    if name not in get_args(Filter):
        raise StudyError([f"filter: {name!r} is not known; it is one of {', '.join(get_args(Filter))}"])
    return cast(Filter, name)


def _outside_colour(outside: ArrayLike, dtype: DTypeLike, channels: int) -> NDArray[Any]:
    """Return one stored number a channel."""
    kind = np.dtype(dtype)
    values = np.atleast_1d(np.asarray(outside, dtype=np.float64))
    most = full_scale(kind)
    colours = colours_of(channels)
    if values.ndim != 1 or (len(values) not in (1, colours, channels) and not _is_grey(values, colours)):
        raise StudyError(
            [f"outside: {values.size} numbers for a picture of {channels} channels; expected 1, or one a channel"]
        )
    if kind.kind == "u" and not np.all((values >= 0) & (values <= most) & (values == np.rint(values))):
        raise StudyError(
            [
                f"outside: {_listed(values)} must be whole numbers from 0 to {most}, for the picture is {kind}; "
                f"a share of full scale is to be multiplied by {most}"
            ]
        )
    if len(values) != channels:
        alpha = [float(most)] * (channels - colours)
        values = np.concatenate([np.broadcast_to(values[:1] if len(values) != colours else values, colours), alpha])
    return values.astype(kind)


def _is_grey(values: Array, colours: int) -> bool:
    """Whether an RGB colour is a grey, and so can stand outside a grey picture."""
    return colours == 1 and len(values) == 3 and bool(np.all(values == values[0]))


def _listed(values: Array) -> str:
    return ", ".join(f"{value:g}" for value in values)
