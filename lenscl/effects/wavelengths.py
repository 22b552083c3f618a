"""Which wavelengths a scene is traced at, where its light is not of one wavelength.

>>> [round(nm, 1) for nm in wavelengths_of(3)]
[475.0, 545.0, 615.0]
>>> wavelengths_of("rgb")
(611.4, 549.1, 464.2)
>>> wavelengths_of(False)
()
"""

from __future__ import annotations

# nm, of red, green and blue: the dominant wavelengths of sRGB's primaries, where the line from D65 through each meets
# the spectrum (IEC 61966-2-1:1999, table 1, on the chart of CIE 015:2018)
RGB_LINES = (611.4, 549.1, 464.2)
# nm. In it lie 98 % of the eye's sensitivity to luminance, and every material of the catalogue has data
BAND = (440.0, 650.0)
# The fewest from which three colours can be told, and more than any picture needs
FEWEST, MOST = 3, 64


def wavelengths_of(asked: str | int) -> tuple[float, ...]:
    """Return the wavelengths that a value of `effects.dispersion` asks for.

    Parameters
    ----------
    asked : str or int
        False, "rgb", or how many samples.

    Returns
    -------
    tuple of float
        Vacuum wavelengths in nm. "rgb": `RGB_LINES`, in the order of a picture's channels. A number N: the middles of N
        equal parts of `BAND`, ascending. False: none.
    """
    if asked is False:
        return ()
    if asked == "rgb":
        return RGB_LINES
    assert isinstance(asked, int), f"effects.dispersion is checked as it is read, and was {asked!r}"
    low, high = BAND
    return tuple(low + (high - low) * (i + 0.5) / asked for i in range(asked))
