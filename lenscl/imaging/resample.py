"""Look film samples up on a picture, on the device: one launch, one colour a sample; and take means of such colours."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.device import Buffer
from lenscl.imaging.device_picture import DevicePicture, Texture
from lenscl.imaging.encoding import colours_of, encode_table
from lenscl.imaging.film import FilmSamples, Part, Supersamples
from lenscl.imaging.programs import Filter, light_program, mixes, paint_program


def resampled(
    samples: FilmSamples,
    more: Supersamples | None,
    picture: DevicePicture,
    filter: Filter,  # noqa: A002 - the word of the study file
    outside: DevicePicture,
) -> NDArray[Any]:
    """Return the colours of film pixels.

    Parameters
    ----------
    samples : FilmSamples
        One a pixel.
    more : Supersamples, optional
        Of the pixels whose colour is their mean.
    picture : DevicePicture
    filter : str
    outside : DevicePicture
        One pixel of the picture's type and encoding: the colour of rays that did not land.

    Returns
    -------
    array, shape (rows, columns, C)
        In the picture's type and encoding.
    """
    device = samples.device
    texture = picture.texture(is_mixed=_mixes(samples, filter), has_levels=samples.jacobian is not None)
    painted_there = _looked_up(samples, texture, filter, outside.stored)
    if more is not None:
        colour = outside.light(has_levels=False)
        for part in more.parts():
            light = picture.light_texture(has_levels=part.samples.jacobian is not None)
            _write_means(part, _looked_up(part.samples, light, filter, colour), painted_there, picture)
    painted = np.empty((*samples.shape, picture.channels), picture.pixels.dtype)
    device.download(painted_there, painted)
    return painted


def _mixes(samples: FilmSamples, filter_name: Filter) -> bool:
    is_weighted, has_footprints = samples.weights is not None, samples.jacobian is not None
    return mixes(filter_name, is_weighted=is_weighted, has_footprints=has_footprints)


def _looked_up(samples: FilmSamples, texture: Texture, filter_name: Filter, outside: Buffer) -> Buffer:
    """Return the samples' colours on the device, in the texture's type and encoding."""
    device, (height, width, channels) = samples.device, texture.shape
    weights = samples.weights_there(texture.dtype, is_grey=colours_of(channels) == 1)
    program = paint_program(
        device,
        texture.dtype,
        channels,
        texture.encoding,
        places=samples.st.dtype,
        filter=filter_name,
        is_weighted=weights is not None,
        has_footprints=samples.jacobian_there is not None,
    )
    count = samples.status.size
    colours = device.empty(count * channels * texture.dtype.itemsize)
    arguments = [
        np.int64(count),
        samples.places_there,
        samples.status_there,
        np.int32(width),
        np.int32(height),
        texture.pixels,
        texture.light,
        device.constant(encode_table()),
        outside,
        colours,
    ]
    arguments += [known for known in (weights, samples.jacobian_there) if known is not None]
    program.run("paint", count, arguments)
    return colours


def _write_means(part: Part, light: Buffer, painted: Buffer, picture: DevicePicture) -> None:
    """Put the means of samples' light in the place of the colours of their film pixels."""
    device, (count, each) = picture.device, part.samples.shape
    program = light_program(device, picture.pixels.dtype, picture.channels, picture.encoding)
    table = device.constant(encode_table())
    program.run("mean", count, [np.int64(count), np.int32(each), part.pixels_there, light, table, painted])
