"""What red, green and blue are as light: of one wavelength, and to an eye that sees no colour.

What glass lets through of red, green and blue says by these what it lets through of a wavelength, or of white.

>>> basis([611.4, 490.0]).round(2).tolist()
[[1.0, 0.0, 0.0], [0.0, 0.21, 0.79]]
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.effects.wavelengths import RGB_LINES

Array = NDArray[np.float64]

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of sRGB's primaries: IEC 61966-2-1:1999


def basis(wavelengths_nm: ArrayLike) -> Array:
    """Return the spectra of red, green and blue, shape (K, 3), at K wavelengths in nm; they sum up to 1.

    Each is 1 at its line of `RGB_LINES` and goes down to 0 at its neighbours', as cos^2 does; blue stays 1 below its
    line as red does above.
    """
    nm = np.asarray(wavelengths_nm, dtype=np.float64)
    red, green, blue = RGB_LINES
    upper = np.sin(0.5 * np.pi * np.clip((nm - green) / (red - green), 0.0, 1.0)) ** 2
    lower = np.sin(0.5 * np.pi * np.clip((green - nm) / (green - blue), 0.0, 1.0)) ** 2
    return np.stack([upper, 1.0 - upper - lower, lower], axis=-1)
