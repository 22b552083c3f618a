"""A picture in its own place, lit by what a source sends there through the lenses.

Input: a ray map with a `caustic`, and pixels. Output: pixels of the size of its irradiance, the scene's `picture.size`.
The picture is looked at from straight above, as if it gave back all light alike: each cell has the picture's colour at
its middle, multiplied by the irradiance in linear light, colour by colour where glass has coloured that. Where light is
gathered that exceeds white: whole numbers stop there, floats do not. Of a map with a `jacobian` a cell has the mean of
the picture over itself instead, as film pixels have over what they see; irradiance is a mean already. Samples of film
pixels say nothing of cells.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.device import Device
from lenscl.errors import StudyError
from lenscl.imaging.paint import PaintableMap, Painter
from lenscl.status import RayStatus


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
    if raymap.caustic is None:
        return Painter(raymap)
    irradiance: NDArray[np.float64] = raymap.caustic.irradiance
    rows, columns = irradiance.shape[-2:]
    s, t = np.meshgrid((np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows)
    st = np.stack([s, t], axis=-1).astype(raymap.st.dtype)
    status = np.full(irradiance.shape, RayStatus.PICTURE, np.uint8)
    coloured: NDArray[np.float64] | None = raymap.caustic.rgb
    added = {"transmittance": irradiance} if coloured is None else {"transmission": coloured}
    if "jacobian" in raymap.added:
        cell = np.array([[0.0, 1.0 / columns], [1.0 / rows, 0.0]])  # d(s, t)/d(row, column)
        added["jacobian"] = np.broadcast_to(cell, (*irradiance.shape, 2, 2))
    if irradiance.ndim == 3:  # each wavelength lights the picture by itself
        st = np.broadcast_to(st, (*irradiance.shape, 2))
        added["wavelengths"] = raymap.added["wavelengths"]
    return Painter(_Above(st, status, raymap.device, added))


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
