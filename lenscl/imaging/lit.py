"""A picture in its own place, lit by what a source sends there through the lenses.

Input: a ray map with a `caustic`, and pixels. Output: pixels of the size of its irradiance, the scene's `picture.size`.
The picture is looked at from straight above, as if it gave back all light alike: each cell has the picture's colour at
its middle, multiplied by the irradiance in linear light, colour by colour where glass has coloured that. Of a map with
a `jacobian` a cell has the mean of the picture over itself instead, as film pixels have over what they see; irradiance
is a mean already. Samples of film pixels say nothing of cells.

Gathered light exceeds white. Floats hold it; whole numbers stop at white, in each part of a cell by itself: a cell has
the mean of its parts, each up to white. So cells that the edge of a caustic crosses get what is between, as they do
along any other edge, and the edge has no steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.device import Device
from lenscl.errors import StudyError
from lenscl.imaging.dispersed import colours_of, light_from, pixels_from
from lenscl.imaging.encoding import encoding_of
from lenscl.imaging.paint import PaintableMap, Painter
from lenscl.status import RayStatus

_TOGETHER = 2**20  # parts of cells on the device at a time


class LightingMap(PaintableMap, Protocol):
    """What lighting a picture reads of a ray map."""

    @property
    def caustic(self) -> Any:
        """A `lenscl.tracing.Caustic`, or None."""

    @property
    def added(self) -> Mapping[str, NDArray[Any]]:
        """What the scene's effects add, by name: `jacobian`, which says that pictures are filtered, `wavelengths`."""


@dataclass(frozen=True, slots=True)
class _Above:
    """A map of a film that sees the picture as it is, dimmed and brightened by the light on it."""

    st: NDArray[Any]
    status: NDArray[np.uint8]
    device: Device
    added: Mapping[str, NDArray[Any]]


def painter_of(raymap: LightingMap) -> Painter:
    """Return what paints as a map's scene asks: its film, or with `effects.caustics` the picture in its light."""
    return Painter(raymap) if raymap.caustic is None else _LitPainter(raymap)


class _LitPainter(Painter):
    """Paint the picture in its light, cell by cell; bright cells as means of their parts.

    Parameters
    ----------
    raymap : LightingMap
        With a `caustic`.
    """

    def __init__(self, raymap: LightingMap) -> None:
        self._map = raymap
        caustic = raymap.caustic
        self._size: tuple[int, int] = caustic.irradiance.shape[-2:]
        light = caustic.irradiance[..., np.newaxis] if caustic.rgb is None else caustic.rgb
        super().__init__(self._above(np.arange(self._size[0] * self._size[1]).reshape(self._size), light))

    def paint(
        self,
        pixels: NDArray[Any],
        *,
        filter: str = "bilinear",  # noqa: A002 - the word of the study file
        encoding: str | None = None,
        outside: ArrayLike = 0,
    ) -> NDArray[Any]:
        """Return the picture in its light; see `light`."""
        painted = super().paint(pixels, filter=filter, encoding=encoding, outside=outside)
        bright = self._map.caustic.bright
        if pixels.dtype.kind != "u" or not len(bright.cells):
            return painted
        picture = pixels if pixels.ndim == 3 else pixels[..., np.newaxis]
        curve = encoding_of(picture.dtype, encoding)
        linear = light_from(picture, curve)
        flat = painted.reshape(-1, picture.shape[2])  # a view of it
        parts = bright.irradiance.shape[-2]
        for first in range(0, len(bright.cells), _TOGETHER // parts):
            some = slice(first, first + _TOGETHER // parts)
            cells, light = bright.cells[some], bright.irradiance[..., some, :, :]
            above = Painter(self._above(np.repeat(cells[:, np.newaxis], parts, axis=1), light))
            seen = above.paint(linear, filter=filter, encoding="linear")
            means = pixels_from(_up_to_white(seen).mean(axis=1), picture.dtype, curve)
            if colours_of(means.shape[-1]) < means.shape[-1]:  # hidden colours stay
                is_seen = means[:, -1] > 0
                cells, means = cells[is_seen], means[is_seen]
            flat[cells] = means
        return painted

    def _above(self, cells: NDArray[np.int64], light: NDArray[np.float64]) -> _Above:
        """Return the map of some cells, by their numbers, shape (rows, columns), in light of shape (..., C)."""
        (rows, columns), shape = self._size, light.shape[:-1]
        places = [(cells % columns + 0.5) / columns, (cells // columns + 0.5) / rows]
        st = np.stack(places, axis=-1).astype(self._map.st.dtype)
        added = {"transmittance": light[..., 0]} if light.shape[-1] == 1 else {"transmission": light}
        if "jacobian" in self._map.added:
            cell = np.array([[0.0, 1.0 / columns], [1.0 / rows, 0.0]])  # d(s, t)/d(row, column)
            added["jacobian"] = np.broadcast_to(cell, (*shape, 2, 2))
        if light.ndim == 4:  # each wavelength lights the picture by itself
            added["wavelengths"] = self._map.added["wavelengths"]
        status = np.full(shape, RayStatus.PICTURE, np.uint8)
        return _Above(np.broadcast_to(st, (*shape, 2)), status, self._map.device, added)


def _up_to_white(light: NDArray[Any]) -> NDArray[np.float64]:
    """Return light, shape (..., C), as far as a whole number can show it: from 0 to its alpha."""
    held = light.astype(np.float64)
    colours = colours_of(held.shape[-1])
    alpha = held[..., colours:] if colours < held.shape[-1] else 1.0
    held[..., :colours] = np.clip(held[..., :colours], 0.0, alpha)
    return held


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
    return painter_of(raymap).paint(pixels, filter=filter, encoding=encoding, outside=outside)
