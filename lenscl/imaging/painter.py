"""Paint pictures as a ray map sees them, or as the light on them shows them: `paint`, `light`, and many by a `Painter`.

Input: a ray map and pixels (H, W, C). Output: pixels (rows, columns, C) of the same type. `lenscl.imaging.compose` says
how colours come about.
"""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike, NDArray

from lenscl.errors import StudyError
from lenscl.imaging.compose import paint_film
from lenscl.imaging.device_picture import DevicePicture
from lenscl.imaging.film import Film
from lenscl.imaging.film_of_map import PaintableMap, film_of
from lenscl.imaging.relight import LightingMap, relit_film_of


class Painter:
    """A film held on its device, ready to be painted with any number of pictures.

    Parameters
    ----------
    raymap : RayMap or Film
        Whose film is painted, whatever light is on the picture; see `painter_of`.

    Attributes
    ----------
    film : Film

    Examples
    --------
    One trace serves a whole folder::

        painter = Painter(lenscl.trace(scene))
        painted = [painter.paint(read_picture(path).pixels) for path in paths]
    """

    def __init__(self, raymap: PaintableMap | Film) -> None:
        self.film = raymap if isinstance(raymap, Film) else film_of(raymap)

    @property
    def has_wavelengths(self) -> bool:
        """Whether the map has several wavelengths, so that greys may get colours."""
        return self.film.spectrum is not None

    def paint(
        self,
        pixels: NDArray[Any] | DevicePicture,
        *,
        filter: str = "bilinear",  # noqa: A002 - the word of the study file
        encoding: str | None = None,
        outside: ArrayLike = 0,
    ) -> NDArray[Any]:
        """Return the picture as the film shows it.

        Parameters
        ----------
        pixels : array, shape (H, W, C) or (H, W), or DevicePicture
        filter, encoding, outside
            As for `paint`; a `DevicePicture` has its own encoding.

        Returns
        -------
        array, shape (rows, columns, C) or (rows, columns)
        """
        if isinstance(pixels, DevicePicture):
            return paint_film(self.film, pixels, filter=filter, outside=outside)
        picture = DevicePicture.of(self.film.device, pixels, encoding)
        painted = paint_film(self.film, picture, filter=filter, outside=outside)
        return painted if pixels.ndim == 3 else painted[..., 0]


def painter_of(raymap: LightingMap) -> Painter:
    """Return what paints as a map's scene asks: its film, or with `effects.caustics` the picture in its light."""
    return Painter(raymap if raymap.caustic is None else relit_film_of(raymap))


def paint(
    raymap: PaintableMap,
    pixels: NDArray[Any],
    *,
    filter: str = "bilinear",  # noqa: A002 - the word of the study file
    encoding: str | None = None,
    outside: ArrayLike = 0,
) -> NDArray[Any]:
    """Return the picture as the film sees it: each film pixel takes the colour at the place where its ray lands.

    Parameters
    ----------
    raymap : RayMap
        A ray of status PICTURE takes the colour at `st`; every other ray takes `outside`. Arrays of effects change the
        colour:

        - `transmittance` and `transmission` multiply it, in linear light. A grey picture takes the luminance of what
          they leave of white.
        - `jacobian`: it is the mean over the pixel's footprint, of up to 16 x 16 places. A footprint that is 8 picture
          pixels wide, or more than 16 long, takes places of a coarser level of an image pyramid. Beyond the picture,
          its edge pixels continue. Edges of the lens stay hard.
        - `samples`: it is the mean over the samples of a pixel, in linear light and with equal weights, whatever their
          status.
        - `wavelengths`: each wavelength adds its share of the light at its own place; `outside` likewise. Alpha is the
          mean. Integers clip colours beyond sRGB. A grey picture takes the luminance; give it as RGB to see fringes.
    pixels : array, shape (H, W, C) or (H, W)
        uint8, uint16, float16, float32 or float64; C = 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA. The picture and the
        result must each fit into one allocation of the device.
    filter : str
        "nearest" copies the pixel (floor(t H), floor(s W)) bit for bit. "bilinear" mixes 2 x 2 samples. "bicubic" mixes
        4 x 4 (Catmull-Rom: it passes through the samples and overshoots at hard edges).
    encoding : str, optional
        "srgb" or "linear"; default "srgb" for integers, "linear" for floats.
    outside : number or sequence
        In the numbers of the pixels (0 to 255 for uint8): one number, one for each colour, or one for each channel.
        Alpha is 1 by default.

    Returns
    -------
    array, shape (rows, columns, C) or (rows, columns)
        Of the dtype of `pixels`. A picture of one colour keeps exactly that colour (sRGB-encoded floats: to rounding).
        Where the mixed alpha of an integer picture is 0, the colour is that of the pixel nearest to the landing place.
        A pixel that is NaN or Inf affects only the places whose mix includes it; with `jacobian`, only those whose
        pyramid levels include it.

    Raises
    ------
    StudyError
        If an argument is not valid, or no wavelength of the map is visible; the message says which and what is valid.
    TraceError
        If the device has too little memory.
    """
    return Painter(raymap).paint(pixels, filter=filter, encoding=encoding, outside=outside)


def light(
    raymap: LightingMap,
    pixels: NDArray[Any],
    *,
    filter: str = "bilinear",  # noqa: A002 - the word of the study file
    encoding: str | None = None,
    outside: ArrayLike = 0,
) -> NDArray[Any]:
    """Return a picture in the light that the lenses leave on it.

    Parameters
    ----------
    raymap : RayMap
        Of a scene with `effects.caustics`.
    pixels, filter, encoding, outside
        As for `lenscl.paint`. A cell always lies on the picture: `outside` is not seen.

    Returns
    -------
    array, shape (H, W, C) or (H, W)
        Of the dtype of `pixels`; H and W are those of `raymap.irradiance`.

    Raises
    ------
    StudyError
        As `lenscl.paint`, and if the map has no light on its picture.
    """
    if raymap.caustic is None:
        raise StudyError(["effects.caustics: the map has no light on its picture; trace with caustics = true"])
    return Painter(relit_film_of(raymap)).paint(pixels, filter=filter, encoding=encoding, outside=outside)
