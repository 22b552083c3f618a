"""Which wavelengths a scene is traced at, where its light is not of one wavelength.

>>> [round(nm, 1) for nm in wavelengths_of(3)]
[475.0, 545.0, 615.0]
>>> wavelengths_of("rgb")
(611.4, 549.1, 464.2)
>>> wavelengths_of(False)
()
>>> bands_of([486.1, 587.6, 656.3])
((440.0, 536.85), (536.85, 621.95), (621.95, 650.0))
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

# nm, of red, green and blue: the dominant wavelengths of sRGB's primaries, where the line from D65 through each meets
# the spectrum (IEC 61966-2-1:1999, table 1, on the chart of CIE 015:2018)
RGB_LINES = (611.4, 549.1, 464.2)
# nm. In it lie 98 % of the eye's sensitivity to luminance, and every material of the catalogue has data
BAND = (440.0, 650.0)
# nm. Light beyond is not seen: it lights no picture
VISIBLE = (380.0, 780.0)
# The fewest from which three colours can be told, and more than any picture needs
FEWEST, MOST = 3, 64
LISTED = (1, MOST)  # how many wavelengths a list has
WAVELENGTH_LIMITS = (100.0, 1e5)  # nm, of a list: from the far ultraviolet to the far infrared


def wavelengths_of(asked: str | int | tuple[float, ...]) -> tuple[float, ...]:
    """Return the wavelengths that a value of `effects.dispersion` asks for.

    Parameters
    ----------
    asked : str, int or tuple of float
        False, "rgb", how many samples, or the wavelengths themselves.

    Returns
    -------
    tuple of float
        Vacuum wavelengths in nm. "rgb": `RGB_LINES`, in the order of a picture's channels. A number N: the middles of N
        equal parts of `BAND`, ascending. A list: itself. False: none.
    """
    if asked is False:
        return ()
    if asked == "rgb":
        return RGB_LINES
    if isinstance(asked, tuple):
        return asked
    assert isinstance(asked, int), f"effects.dispersion is checked as it is read, and was {asked!r}"
    low, high = BAND
    return tuple(low + (high - low) * (i + 0.5) / asked for i in range(asked))


def is_seen(wavelength_nm: float) -> bool:
    """Return whether light of a wavelength is seen."""
    return VISIBLE[0] <= wavelength_nm <= VISIBLE[1]


def bands_of(wavelengths_nm: Sequence[float]) -> tuple[tuple[float, float], ...]:
    """Return the part of `BAND` that each of some wavelengths stands for in a picture.

    Parameters
    ----------
    wavelengths_nm : sequence of float, length K
        In nm, rising.

    Returns
    -------
    tuple of (float, float), length K
        Both ends in nm. Each that is seen stands for what lies up to the middles between it and its neighbours, the
        first and the last of those for all up to the ends of `BAND`. A part may be empty, its ends equal: of a
        wavelength that is not seen, or that lies so far outside `BAND` that a neighbour is nearer to all of it.
    """
    low, high = BAND
    seen = [nm for nm in wavelengths_nm if is_seen(nm)]
    ends = [low, *(min(max(0.5 * (a + b), low), high) for a, b in pairwise(seen)), high]
    parts = iter(pairwise(ends))
    return tuple(next(parts) if is_seen(nm) else (low, low) for nm in wavelengths_nm)
