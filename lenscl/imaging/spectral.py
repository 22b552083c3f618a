"""Mix what a picture looks like at each of several wavelengths into one picture.

Input: pictures in linear light, one a wavelength. A wavelength's picture is what the whole spectrum would show if all
of it took that wavelength's path; the wavelength's matrix takes its share of that. Output: their sum, made on the host
in double precision.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lenscl.effects.colours import LUMINANCE
from lenscl.imaging.encoding import colours_of
from lenscl.imaging.film import Spectrum

Array: TypeAlias = NDArray[np.float64]


def mixed(painted: Iterable[NDArray[Any]], spectrum: Spectrum) -> Array:
    """Return the sum of pictures in light, each of shape (rows, columns, C), as the wavelengths' matrices weigh them.

    A picture without colour is mixed by luminance. Alpha is the mean by the wavelengths' shares of the spectrum. A
    channel to which a matrix gives no weight is not read, so that a NaN or Inf stays in the channels that it reaches.
    """
    total: Array | None = None
    for picture, matrix, share in zip(painted, spectrum.matrices, spectrum.shares, strict=True):
        channels = picture.shape[-1]
        colours = colours_of(channels)
        weights = np.zeros((channels, channels))
        weights[:colours, :colours] = matrix if colours == 3 else LUMINANCE @ matrix.sum(axis=1)
        weights[colours:, colours:] = share
        total = np.zeros(picture.shape) if total is None else total
        for to, source in np.argwhere(weights):
            total[..., to] += weights[to, source] * picture[..., source]
    assert total is not None, "a film has a layer at least"
    return total
