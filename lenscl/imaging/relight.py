"""The picture in its own place, lit by what a source sends there through the lenses: a film of its cells.

Input: a ray map with a `caustic`. Output: a `Film` with the size of its irradiance, the scene's `picture.size`. Its
pixels look at the picture from straight above, as if that scattered all light alike: each cell has the picture's colour
at its middle, multiplied by the irradiance in linear light, colour by colour where glass has coloured that. Of a map
with a `jacobian` a cell has the mean of the picture over itself instead, as film pixels have over what they see;
irradiance is a mean already. Samples of film pixels say nothing of cells.

Gathered light exceeds white. Floats hold it; integers clip at white, in each part of a cell by itself, and a cell has
the mean of its parts. So a cell that the edge of a caustic crosses gets a colour between, as along any other edge.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lenscl.device import Device
from lenscl.imaging.film import TOGETHER, Film, FilmSamples, Layer, Spectrum
from lenscl.imaging.film_of_map import PaintableMap, is_spectral, spectrum_of
from lenscl.status import RayStatus

Array: TypeAlias = NDArray[np.float64]


class LightingMap(PaintableMap, Protocol):
    """What lighting a picture reads of a ray map."""

    @property
    def caustic(self) -> Any:
        """A `lenscl.tracing.Caustic`, or None."""


def relit_film_of(raymap: LightingMap) -> Film:
    """Return the film of a picture's cells in the light on them, of a map with a `caustic`.

    Raises
    ------
    StudyError
        If no wavelength of the map is seen.
    """
    caustic = raymap.caustic
    light = caustic.irradiance[..., np.newaxis] if caustic.rgb is None else caustic.rgb
    bright, size = caustic.bright, caustic.irradiance.shape[-2:]
    cells = _Cells(size, raymap.device, raymap.st.dtype, "jacobian" in raymap.added, spectrum_of(raymap))
    wavelengths = light.shape[0] if is_spectral(raymap) else 1  # of an axis in front, which a film has as layers

    def highlights() -> Iterator[tuple[NDArray[np.int64], Film]]:
        parts, channels = bright.irradiance.shape[-2:]
        together = TOGETHER // parts
        each = bright.irradiance.reshape(wavelengths, -1, parts, channels)
        for first in range(0, len(bright.cells), together):
            some = slice(first, first + together)
            numbers = bright.cells[some]
            yield numbers, cells.film(np.repeat(numbers[:, np.newaxis], parts, axis=1), each[:, some])

    whole = cells.film(np.arange(size[0] * size[1]).reshape(size), light.reshape(wavelengths, *size, -1))
    return Film(whole.layers, whole.spectrum, highlights=highlights if len(bright.cells) else None)


@dataclass(frozen=True, slots=True)
class _Cells:
    """The cells of a picture of so many rows and columns, and how films of them are made."""

    size: tuple[int, int]
    device: Device
    dtype: np.dtype[Any]  # of places
    is_filtered: bool  # whether a cell has the mean of the picture over itself
    spectrum: Spectrum | None

    def film(self, numbers: NDArray[np.int64], light: NDArray[Any]) -> Film:
        """Return the film of some cells.

        Parameters
        ----------
        numbers : int array, shape (rows, columns)
            Row by row in the picture.
        light : real array, shape (K, rows, columns, C)
            The irradiance at each of K wavelengths, with C = 1 or 3 colours.
        """
        rows, columns = self.size
        places = [(numbers % columns + 0.5) / columns, (numbers // columns + 0.5) / rows]
        st = np.stack(places, axis=-1).astype(self.dtype)
        status = np.full(numbers.shape, RayStatus.PICTURE, np.uint8)
        jacobian = None
        if self.is_filtered:
            cell = np.array([[0.0, 1.0 / columns], [1.0 / rows, 0.0]])  # d(s, t)/d(row, column)
            jacobian = np.broadcast_to(cell, (*numbers.shape, 2, 2))
        each = (np.ones((*numbers.shape, 3)) * one for one in light)
        return Film(
            tuple(Layer(FilmSamples(self.device, st, status, weights, jacobian)) for weights in each), self.spectrum
        )
