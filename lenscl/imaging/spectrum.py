"""From a picture's colours to light of several wavelengths, and back to colours.

Light of red r, green g and blue b is taken as the spectrum r R + g G + b B. R, G and B (`lenscl.effects.colours`) are
smooth, nowhere negative and sum up to 1, each around the dominant wavelength of its primary. A wavelength's share of
that is seen by the CIE 1931 observer, as a colour in linear sRGB. So a wavelength makes of a colour another one: a
matrix of rank 1. As samples stand for a whole band, their sum is not quite what the colour was; the spectra are mixed
by one matrix for all wavelengths so that it is. A picture seen at one place by all wavelengths stays as it is, and
greys are even spectra but for that.

"rgb" is three lines, each of which carries its own channel. Wavelengths that a list gives are uneven samples: each has
the integral over the band that it stands for (`lenscl.effects.wavelengths.bands_of`) in place of the value at itself.
The integrals of all bands sum up to that of the whole spectrum, whatever the list, so even one wavelength has a matrix:
that which leaves colours alone.

Source of the observer's curves: Wyman, Sloan & Shirley, Simple analytic approximations to the CIE XYZ color matching
functions, JCGT 2(2), 2013, the fit of several lobes; of the matrix to sRGB: IEC 61966-2-1:1999, section 5.3.

>>> matrices = spectral_matrices([475.0, 545.0, 615.0])
>>> matrices.shape, bool(np.allclose(matrices.sum(axis=0), np.eye(3)))
((3, 3, 3), True)
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.effects import RGB_LINES, VISIBLE, is_seen
from lenscl.effects.colours import basis
from lenscl.effects.wavelengths import FEWEST, MOST, bands_of, wavelengths_of
from lenscl.errors import StudyError

Array = NDArray[np.float64]

_STEP = 0.1  # nm: the observer's curves are straight lines over less, to 1e-6 of their height

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
        `RGB_LINES`, in any order; the samples of `wavelengths_of(K)`; or any others, rising, of which one is seen at
        least. A list that has the wavelengths of "rgb" or of a number gets the matrices of that.
    """
    nm = np.asarray(wavelengths_nm, dtype=np.float64)
    if _is_rgb(nm):
        lines = np.eye(3)[[RGB_LINES.index(each) for each in nm.tolist()]]
        return lines[:, :, np.newaxis] * lines[:, np.newaxis, :]
    bands = bands_of(nm.tolist())
    raw = _light(nm) if _is_even(nm) else np.stack([_light_of_band(low, high) for low, high in bands])
    matrices: Array = raw @ np.linalg.inv(raw.sum(axis=0))
    return matrices


def shares_of(wavelengths_nm: ArrayLike) -> Array:
    """Return the parts of the spectrum that wavelengths stand for, shape (K,), by which alpha is mixed; their sum is 1.

    Parameters
    ----------
    wavelengths_nm : array_like, shape (K,)
        As for `spectral_matrices`. The lines of "rgb", and the samples of a number, have equal parts.
    """
    nm = np.asarray(wavelengths_nm, dtype=np.float64)
    if _is_rgb(nm) or _is_even(nm):
        return np.full(len(nm), 1.0 / len(nm))
    widths = np.diff(np.array(bands_of(nm.tolist())), axis=1)[:, 0]
    shares: Array = widths / widths.sum()
    return shares


def refuse_unseen(wavelengths_nm: Sequence[float]) -> None:
    """Raise where a picture is to be painted in light of which nothing is seen; without wavelengths all is.

    Raises
    ------
    StudyError
    """
    if len(wavelengths_nm) and not any(map(is_seen, wavelengths_nm)):
        raise StudyError(
            [
                f"effects.dispersion: no wavelength of the list is seen, and a picture shows light from {VISIBLE[0]:g} "
                f"to {VISIBLE[1]:g} nm; add one there, or write the ray map alone, as .npz, with `lenscl map`"
            ]
        )


def _is_rgb(nm: Array) -> bool:
    return sorted(nm.tolist()) == sorted(RGB_LINES)


def _is_even(nm: Array) -> bool:
    """Return whether wavelengths are those that a number of them stands for."""
    return FEWEST <= len(nm) <= MOST and bool(np.allclose(nm, wavelengths_of(len(nm)), rtol=1e-9, atol=0.0))


def _light(nm: Array) -> Array:
    """Return what is seen of red, green and blue at K wavelengths, in linear sRGB, shape (K, 3, 3)."""
    seen = matching(nm) @ _SRGB_FROM_XYZ.T
    light: Array = seen[:, :, np.newaxis] * basis(nm)[:, np.newaxis, :]
    return light


def _light_of_band(low: float, high: float) -> Array:
    """Return what is seen of red, green and blue from one wavelength to another, shape (3, 3), by the midpoint rule."""
    steps = max(1, round((high - low) / _STEP))
    step = (high - low) / steps
    middles = low + step * (np.arange(steps, dtype=np.float64) + 0.5)
    light: Array = step * _light(middles).sum(axis=0)
    return light
