"""From a picture's colours to light of several wavelengths, and back to colours.

Light of red r, green g and blue b is taken as the spectrum r R + g G + b B. R, G and B (`lenscl.effects.colours`) are
smooth, nowhere negative and sum up to 1, each around the dominant wavelength of its primary. A wavelength's share of
that is seen by the CIE 1931 observer, as a colour in linear sRGB. So a wavelength makes of a colour another one: a
matrix of rank 1. As samples stand for a whole band, their sum is not quite what the colour was; the spectra are mixed
by one matrix for all wavelengths so that it is. A picture seen at one place by all wavelengths stays as it is, and
greys are even spectra but for that.

"rgb" is three lines, each of which carries its own channel.

Source of the observer's curves: Wyman, Sloan & Shirley, Simple analytic approximations to the CIE XYZ color matching
functions, JCGT 2(2), 2013, the fit of several lobes; of the matrix to sRGB: IEC 61966-2-1:1999, section 5.3.

>>> matrices = spectral_matrices([475.0, 545.0, 615.0])
>>> matrices.shape, bool(np.allclose(matrices.sum(axis=0), np.eye(3)))
((3, 3, 3), True)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.effects import RGB_LINES
from lenscl.effects.colours import basis

Array = NDArray[np.float64]

# height, peak in nm, width in nm below and above it; of x, y and z
_LOBES = (
    ((1.056, 599.8, 37.9, 31.0), (0.362, 442.0, 16.0, 26.7), (-0.065, 501.1, 20.4, 26.2)),
    ((0.821, 568.8, 46.9, 40.5), (0.286, 530.9, 16.3, 31.1)),
    ((1.217, 437.0, 11.8, 36.0), (0.681, 459.0, 26.0, 13.8)),
)
_SRGB_FROM_XYZ = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])


def matching(wavelengths_nm: ArrayLike) -> Array:
    """Return the CIE 1931 colour matching functions x, y and z, shape (K, 3), at K wavelengths in nm."""
    nm = np.asarray(wavelengths_nm, dtype=np.float64)
    return np.stack([sum((_lobe(nm, *lobe) for lobe in lobes), np.zeros_like(nm)) for lobes in _LOBES], axis=-1)


def _lobe(nm: Array, height: float, peak: float, below: float, above: float) -> Array:
    part: Array = height * np.exp(-0.5 * ((nm - peak) / np.where(nm < peak, below, above)) ** 2)
    return part


def spectral_matrices(wavelengths_nm: ArrayLike) -> Array:
    """Return what each wavelength makes of a colour: matrices of linear sRGB, shape (K, 3, 3), that sum up to one.

    Parameters
    ----------
    wavelengths_nm : array_like, shape (K,)
        `RGB_LINES`, or three or more evenly spread over the spectrum.
    """
    nm = np.asarray(wavelengths_nm, dtype=np.float64)
    if nm.tolist() == list(RGB_LINES):
        return np.eye(3)[:, :, np.newaxis] * np.eye(3)[:, np.newaxis, :]
    seen = matching(nm) @ _SRGB_FROM_XYZ.T
    raw = seen[:, :, np.newaxis] * basis(nm)[:, np.newaxis, :]
    matrices: Array = raw @ np.linalg.inv(raw.sum(axis=0))
    return matrices
