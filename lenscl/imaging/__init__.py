"""Pictures in and out: read them, look at them through a ray map, write them with their parameters, draw samples.

>>> import numpy as np
>>> from lenscl.imaging import SAMPLES, draw
>>> draw("checkers", 64).shape, sorted(SAMPLES)[0]
((64, 64, 3), 'cat')
"""

from __future__ import annotations

from lenscl.imaging.compose import paint_film
from lenscl.imaging.device_picture import DevicePicture, PictureCache
from lenscl.imaging.encoding import Encoding, light_of
from lenscl.imaging.film import Film, FilmSamples
from lenscl.imaging.film_of_map import film_of
from lenscl.imaging.maps import error_in_file, refuse_wavelengths, write_map
from lenscl.imaging.painter import Painter, light, paint, painter_of
from lenscl.imaging.programs import Filter
from lenscl.imaging.read import Picture, read_metadata, read_picture, read_size
from lenscl.imaging.samples import SAMPLES, draw
from lenscl.imaging.spectrum import refuse_unseen
from lenscl.imaging.write import formats_of, write_image

__all__ = [
    "SAMPLES",
    "DevicePicture",
    "Encoding",
    "Film",
    "FilmSamples",
    "Filter",
    "Painter",
    "Picture",
    "PictureCache",
    "draw",
    "error_in_file",
    "film_of",
    "formats_of",
    "light",
    "light_of",
    "paint",
    "paint_film",
    "painter_of",
    "read_metadata",
    "read_picture",
    "read_size",
    "refuse_unseen",
    "refuse_wavelengths",
    "write_image",
    "write_map",
]
