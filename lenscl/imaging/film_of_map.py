"""Make a film to paint of a ray map: the one place where painting knows how a map holds its arrays.

A map of several wavelengths has an axis of them in front of every array of rays; a film has a layer for each instead.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import EllipsisType
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lenscl.device import Device
from lenscl.imaging.film import TOGETHER, Film, FilmSamples, Layer, Reflection, Spectrum, Supersamples
from lenscl.imaging.outputs import OUTPUT_USES
from lenscl.status import RayStatus

Array: TypeAlias = NDArray[np.float64]


class Rays(Protocol):
    """What painting reads of rays of the film, be they a map's or its samples'."""

    @property
    def st(self) -> NDArray[Any]:
        """Places on the picture, shape (..., 2), float32 or float64."""

    @property
    def status(self) -> NDArray[np.uint8]:
        """The `RayStatus` of every ray, shape (...)."""

    @property
    def added(self) -> Mapping[str, NDArray[Any]]:
        """What the scene's effects add, by name."""


class SampledPixels(Rays, Protocol):
    """What painting reads of a map's samples; `lenscl.tracing.Samples` says what each is."""

    @property
    def pixels(self) -> NDArray[np.integer[Any]]:
        """Numbers of the film pixels that have samples, shape (P,)."""


class PaintableMap(Rays, Protocol):
    """What painting reads of a ray map."""

    @property
    def device(self) -> Device:
        """The device to paint on."""

    @property
    def samples(self) -> SampledPixels | None:
        """Further rays of film pixels."""

    @property
    def scene(self) -> Any:
        """What was traced; its `environment` is read."""


def film_of(raymap: PaintableMap, *, together: int = TOGETHER) -> Film:
    """Return the film of a ray map.

    Parameters
    ----------
    raymap : PaintableMap
    together : int
        Samples of pixels that may be on the device at a time.

    Raises
    ------
    StudyError
        If no wavelength of the map is seen.
    """
    wavelengths: Iterable[int | EllipsisType] = range(len(raymap.status)) if is_spectral(raymap) else (...,)
    layers = tuple(
        Layer(
            _film_samples(raymap.device, _at(raymap, one)),
            None if raymap.samples is None else _supersamples(raymap.device, raymap.samples, one, together),
        )
        for one in wavelengths
    )
    return Film(layers, spectrum_of(raymap), raymap.scene.environment)


def is_spectral(raymap: Rays) -> bool:
    """Return whether a map's arrays have an axis of wavelengths in front of rows and columns."""
    return raymap.status.ndim == 3


def spectrum_of(raymap: Rays) -> Spectrum | None:
    """Return the spectrum of a map's wavelengths; None where its light is of the d line alone.

    Raises
    ------
    StudyError
        If none of them is seen.
    """
    return Spectrum.of(raymap.added["wavelengths"]) if is_spectral(raymap) else None


@dataclass(frozen=True, slots=True)
class _Part:
    """Some of a map's rays."""

    st: NDArray[Any]
    status: NDArray[np.uint8]
    added: Mapping[str, NDArray[Any]]


def _at(rays: Rays, index: int | slice | EllipsisType) -> _Part:
    """Return the rays at an index of the first axis: of a wavelength, of some pixels, or all of them."""
    added = {name: array[index] for name, array in rays.added.items() if name in OUTPUT_USES}
    return _Part(rays.st[index], rays.status[index], added)


def _supersamples(
    device: Device, samples: SampledPixels, wavelength: int | EllipsisType, together: int
) -> Supersamples:
    rays = _at(samples, wavelength)
    each = rays.status.shape[1]
    return Supersamples(samples.pixels, each, lambda part: _film_samples(device, _at(rays, part)), together)


def _film_samples(device: Device, rays: Rays) -> FilmSamples:
    """Return rays, shape (rows, columns), with what the effects say that painting uses."""
    return FilmSamples(
        device, rays.st, rays.status, _weights(rays), rays.added.get("jacobian"), _reflection(device, rays.added)
    )


def _weights(rays: Rays) -> Array | None:
    """Return the share of red, green and blue that reaches the film, shape (rows, columns, 3); None where all does."""
    factors = [rays.added[name] for name, use in OUTPUT_USES.items() if use.weighs and name in rays.added]
    if not factors:
        return None
    weights = np.ones((*rays.status.shape, 3))
    for factor in factors:
        weights *= factor[..., np.newaxis] if factor.ndim == rays.status.ndim else factor
    return weights


def _reflection(device: Device, added: Mapping[str, NDArray[Any]]) -> Reflection | None:
    if "reflectance" not in added:
        return None
    places, on_picture = added.get("reflected_st"), None
    if places is not None:
        is_on = ((places >= 0.0) & (places < 1.0)).all(axis=-1)
        status = np.where(is_on, np.uint8(RayStatus.PICTURE), np.uint8(RayStatus.OFF_PICTURE))
        on_picture = FilmSamples(device, places, status)
    return Reflection(added["reflectance"], on_picture, added.get("reflected"))
