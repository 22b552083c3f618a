"""A film as painting sees it: samples of its pixels, and how their light is put together.

    Film -- layers, one a wavelength (or one alone) --> Layer -- one sample a pixel --> FilmSamples
         |                                                   `-- Supersamples: more of some pixels, in parts
         `- spectrum, environment, highlights

Every array of samples has the shape (rows, columns, ...), whatever the effects are. Nothing here knows of ray maps:
`lenscl.imaging.film_of_map` makes these values of one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import DTypeLike, NDArray

from lenscl.device import Buffer, Device
from lenscl.effects.colours import LUMINANCE
from lenscl.imaging.encoding import light_dtype
from lenscl.imaging.spectrum import refuse_unseen, shares_of, spectral_matrices

Array: TypeAlias = NDArray[np.float64]

TOGETHER = 2**20  # further samples on the device at a time: some 40 MB


@dataclass(frozen=True, eq=False)
class FilmSamples:
    """Where rays of the film found the picture, with how much of its light they bring.

    What the device needs of them is uploaded when first used, and stays as long as the samples.

    Attributes
    ----------
    device : Device
    st : real array, shape (rows, columns, 2)
        Places on the picture, float32 or float64; of no meaning where the ray did not land on it.
    status : uint8 array, shape (rows, columns)
        Values of `RayStatus`; rays of PICTURE landed.
    weights : float64 array, shape (rows, columns, 3), optional
        The share of red, green and blue that reaches the film; None where all does.
    jacobian : real array, shape (rows, columns, 2, 2), optional
        d(s, t)/d(row, column), where colours are means over the pixels' footprints.
    reflection : Reflection, optional
        What first surfaces reflect, which is added.
    """

    device: Device
    st: NDArray[Any] = field(repr=False)
    status: NDArray[np.uint8] = field(repr=False)
    weights: Array | None = field(default=None, repr=False)
    jacobian: NDArray[Any] | None = field(default=None, repr=False)
    reflection: Reflection | None = field(default=None, repr=False)
    _weights_there: dict[tuple[bool, np.dtype[Any]], Buffer] = field(default_factory=dict, init=False, repr=False)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, columns = self.status.shape
        return rows, columns

    @cached_property
    def places_there(self) -> Buffer:
        """The places, on the device."""
        return self.device.upload(self.st)

    @cached_property
    def status_there(self) -> Buffer:
        """The statuses, on the device."""
        return self.device.upload(self.status)

    @cached_property
    def jacobian_there(self) -> Buffer | None:
        """The Jacobians, on the device, in the precision of the places."""
        return None if self.jacobian is None else self.device.upload(self.jacobian.astype(self.st.dtype))

    def weights_there(self, dtype: DTypeLike, *, is_grey: bool) -> Buffer | None:
        """Return the weights on the device, for pixels of a type; of a picture without colour the luminance's."""
        if self.weights is None:
            return None
        key = is_grey, light_dtype(dtype)
        if key not in self._weights_there:
            weights = self.weights @ LUMINANCE[:, np.newaxis] if is_grey else self.weights
            self._weights_there[key] = self.device.upload(weights.astype(key[1]))
        return self._weights_there[key]


@dataclass(frozen=True, eq=False)
class Reflection:
    """What first surfaces reflect of the environment.

    Attributes
    ----------
    share : real array, shape (rows, columns)
        Of the environment's light.
    on_picture : FilmSamples, optional
        Where reflections land on the picture's plane, where the environment is the picture.
    directions : real array, shape (rows, columns, 3), optional
        Where they go, where the environment is an image.
    """

    share: NDArray[Any] = field(repr=False)
    on_picture: FilmSamples | None = field(default=None, repr=False)
    directions: NDArray[Any] | None = field(default=None, repr=False)


@dataclass(frozen=True, eq=False)
class Supersamples:
    """More samples of some film pixels, whose colour is their mean in linear light.

    Attributes
    ----------
    pixels : int array, shape (P,)
        Numbers of the film pixels: row x columns + column.
    each : int
        Samples of a pixel.
    some : callable
        Makes the samples of a slice of the pixels: `FilmSamples`, a row a pixel and a column a sample.
    together : int
        Samples that may be on the device at a time. As many stay there from one picture to the next.
    """

    pixels: NDArray[np.integer[Any]] = field(repr=False)
    each: int
    some: Callable[[slice], FilmSamples] = field(repr=False)
    together: int = TOGETHER

    def parts(self) -> Iterator[Part]:
        """Yield all samples, as many at a time as the device shall hold."""
        step = max(1, self.together // self.each)
        if 0 < len(self.pixels) <= step:
            yield self._all
            return
        for first in range(0, len(self.pixels), step):
            yield self._part(slice(first, first + step))

    @cached_property
    def _all(self) -> Part:
        return self._part(slice(None))

    def _part(self, part: slice) -> Part:
        return Part(self.pixels[part], self.some(part))


@dataclass(frozen=True, eq=False)
class Part:
    """The further samples of some film pixels: a row a pixel, a column a sample."""

    pixels: NDArray[np.integer[Any]] = field(repr=False)
    samples: FilmSamples

    @cached_property
    def pixels_there(self) -> Buffer:
        """The numbers of the pixels, on the device."""
        return self.samples.device.upload(self.pixels.astype(np.int64))


@dataclass(frozen=True, eq=False)
class Layer:
    """A film in one kind of light.

    Attributes
    ----------
    samples : FilmSamples
        One a film pixel.
    more : Supersamples, optional
        Of the pixels that take the mean of those instead.
    """

    samples: FilmSamples
    more: Supersamples | None = None


@dataclass(frozen=True, eq=False)
class Spectrum:
    """What each of K wavelengths adds to a colour.

    Attributes
    ----------
    matrices : float64 array, shape (K, 3, 3)
        Of linear sRGB; they sum to one.
    shares : float64 array, shape (K,)
        Parts of the spectrum, by which alpha is mixed; they sum to 1.
    """

    matrices: Array = field(repr=False)
    shares: Array = field(repr=False)

    @classmethod
    def of(cls, wavelengths_nm: NDArray[Any]) -> Spectrum:
        """Return that of some wavelengths in nm.

        Raises
        ------
        StudyError
            If none of them is seen.
        """
        refuse_unseen(wavelengths_nm.tolist())
        return cls(spectral_matrices(wavelengths_nm), shares_of(wavelengths_nm))


@dataclass(frozen=True, eq=False)
class Film:
    """All that painting needs of a film.

    Attributes
    ----------
    layers : tuple of Layer
        One; or with a spectrum one a wavelength, of the same pixels.
    spectrum : Spectrum, optional
    environment : str or tuple of float
        What surfaces reflect: "picture", the path of an image, or a colour in the picture's own encoding.
    highlights : callable, optional
        Yields film pixels that exceed white in a part of themselves: their numbers, shape (P,), and a film of those
        parts, a row a pixel. Integers clip each part at white, and then take the mean.
    """

    layers: tuple[Layer, ...]
    spectrum: Spectrum | None = None
    environment: str | tuple[float, ...] = "picture"
    highlights: Callable[[], Iterator[tuple[NDArray[np.integer[Any]], Film]]] | None = field(default=None, repr=False)

    @property
    def device(self) -> Device:
        """Where the film is painted."""
        return self.layers[0].samples.device

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.layers[0].samples.shape

    @property
    def has_reflections(self) -> bool:
        """Whether light of the environment is added."""
        return self.layers[0].samples.reflection is not None
