"""A picture on an OpenCL device: its pixels, the same as linear light, and a pyramid of coarser levels of that.

Each is made when first used, and stays as long as the picture. `PictureCache` keeps pictures for the next ray map.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.device import Buffer, Device
from lenscl.errors import StudyError
from lenscl.imaging.encoding import DTYPES, Encoding, encoding_of, light_dtype, light_table, linear_light
from lenscl.imaging.programs import light_program

CACHED_BYTES = 512 * 2**20  # 29 pictures of a megapixel, RGB of 8 bits, with their light

_CHANNELS = (1, 2, 3, 4)
_NO_TABLE = np.zeros(1, np.float32)  # where the kernel `lighten` reads none
_NO_TABLE.setflags(write=False)


@dataclass(frozen=True, slots=True)
class Texture:
    """What the kernel `paint` reads of a picture.

    Attributes
    ----------
    shape : (H, W, C)
    dtype : dtype
        Of `pixels`.
    encoding : str
        Of `pixels`.
    pixels : Buffer
    light : Buffer
        The same as linear light, in `light_dtype(dtype)`, with associated alpha; a pyramid's levels may follow.
    """

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    encoding: Encoding
    pixels: Buffer
    light: Buffer


@dataclass(frozen=True, eq=False)
class DevicePicture:
    """A picture, and what of it is on a device.

    Attributes
    ----------
    device : Device
    pixels : array, shape (H, W, C)
        C-contiguous and of native byte order: uint8, uint16, float16, float32 or float64; not to be changed.
    encoding : str
        "srgb" or "linear".
    """

    device: Device
    pixels: NDArray[Any] = field(repr=False)
    encoding: Encoding
    _light: dict[bool, Buffer] = field(default_factory=dict, init=False, repr=False)  # by whether levels follow

    @classmethod
    def of(cls, device: Device, pixels: NDArray[Any], encoding: str | None = None) -> DevicePicture:
        """Take pixels of shape (H, W, C) or (H, W); integers are sRGB and floats linear unless told otherwise.

        Raises
        ------
        StudyError
            If they are no picture, or the encoding is none.
        """
        picture = _as_picture(pixels)
        return cls(device, picture, encoding_of(picture.dtype, encoding))

    @property
    def channels(self) -> int:
        """Colours, and alpha where there is one."""
        return int(self.pixels.shape[2])

    @property
    def nbytes(self) -> int:
        """Bytes held: the pixels, and what is on the device so far."""
        stored, linear = (self.__dict__.get(name) for name in ("stored", "linear"))  # None until first used
        buffers = [stored, *(light for light in self._light.values() if light is not stored)]
        further = linear.nbytes if linear is not None and linear is not self else 0
        return self.pixels.nbytes + sum(buffer.nbytes for buffer in buffers if buffer is not None) + further

    @cached_property
    def stored(self) -> Buffer:
        """The pixels."""
        return self.device.upload(self.pixels)

    @cached_property
    def linear(self) -> DevicePicture:
        """The picture as linear light with associated alpha, float64 of pixels of 64 bits, else float32."""
        if self._is_light:
            return self
        return DevicePicture(self.device, linear_light(self.pixels, self.encoding), "linear")

    def texture(self, *, is_mixed: bool, has_levels: bool) -> Texture:
        """Return the pixels for the kernel `paint`.

        Parameters
        ----------
        is_mixed : bool
            Whether it reads their light.
        has_levels : bool
            Whether it reads a pyramid of their light.
        """
        light = self.light(has_levels=has_levels) if is_mixed else self.stored
        return Texture(self.pixels.shape, self.pixels.dtype, self.encoding, self.stored, light)

    def light_texture(self, *, has_levels: bool) -> Texture:
        """Return the light in the place of the pixels, so that painted colours are light, too."""
        light = self.light(has_levels=has_levels)
        return Texture(self.pixels.shape, light_dtype(self.pixels.dtype), "linear", light, light)

    def light(self, *, has_levels: bool) -> Buffer:
        """Return the picture as linear light; with a pyramid's levels behind it, down to a single pixel, where asked.

        A pyramid is a third larger, and serves those who ask for no levels, too.
        """
        if has_levels not in self._light and True not in self._light:
            made = self._made_light(has_levels)
            self._light.clear()
            self._light[has_levels] = made
        return self._light[True] if True in self._light else self._light[False]

    @property
    def _is_light(self) -> bool:
        return self.encoding == "linear" and self.pixels.dtype == light_dtype(self.pixels.dtype)

    def _made_light(self, has_levels: bool) -> Buffer:
        if self._is_light and not has_levels:
            return self.stored
        height, width, channels = self.pixels.shape
        program = light_program(self.device, self.pixels.dtype, channels, self.encoding)
        levels = list(_levels(width, height)) if has_levels else [width * height]
        is_integer = self.pixels.dtype.kind == "u"
        table = light_table(self.pixels.dtype.name, "srgb") if is_integer else _NO_TABLE
        light = self.device.empty(sum(levels) * channels * light_dtype(self.pixels.dtype).itemsize)
        program.run("lighten", levels[0], [np.int64(levels[0]), self.stored, self.device.constant(table), light])
        for number, count in enumerate(levels[1:], start=1):
            sizes = (np.int32(each) for each in (number, width, height))
            program.run("shrink", count, [np.int64(count), *sizes, light])
        return light


def _levels(width: int, height: int) -> Iterator[int]:
    """Yield the pixels of every level, the picture's own first."""
    yield width * height
    while width * height > 1:
        width, height = width - width // 2, height - height // 2
        yield width * height


def _as_picture(pixels: NDArray[Any]) -> NDArray[Any]:
    """Return pixels as a C-contiguous array (H, W, C) of native byte order."""
    if pixels.dtype.name not in DTYPES:
        raise StudyError([f"pixels: {pixels.dtype} is not painted; convert the picture to one of {', '.join(DTYPES)}"])
    picture = pixels[..., np.newaxis] if pixels.ndim == 2 else pixels
    if picture.ndim != 3 or 0 in picture.shape or picture.shape[2] not in _CHANNELS:
        raise StudyError(
            [f"pixels: the shape is {pixels.shape}; expected (H, W) or (H, W, C) with C = 1 to 4 and no side of 0"]
        )
    return np.ascontiguousarray(picture, dtype=picture.dtype.newbyteorder("="))


class PictureCache:
    """Pictures on a device, by their content; where all are too large, the least recently used are let go.

    A picture grows as it is used: what it holds is counted when the next one is asked for.

    Parameters
    ----------
    device : Device
    most_bytes : int
        What the pictures may hold together, beyond the one in use.
    """

    def __init__(self, device: Device, most_bytes: int = CACHED_BYTES) -> None:
        self.device = device
        self._most_bytes = most_bytes
        self._held: OrderedDict[Hashable, DevicePicture] = OrderedDict()  # the most recently used last

    @property
    def nbytes(self) -> int:
        """Bytes held by all pictures."""
        return sum(picture.nbytes for picture in self._held.values())

    def __len__(self) -> int:
        return len(self._held)

    def get(self, content: Hashable, pixels: Callable[[], NDArray[Any]], encoding: str | None = None) -> DevicePicture:
        """Return a picture, the same one as long as it is held.

        Parameters
        ----------
        content : hashable
            What determines the pixels, such as a digest of a file with what is made of it.
        pixels : callable
            Makes the pixels, where they are not held.
        encoding : str, optional
            As for `DevicePicture.of`; part of the key.
        """
        key = (content, encoding)
        if key not in self._held:
            self._held[key] = DevicePicture.of(self.device, pixels(), encoding)
        self._held.move_to_end(key)
        total = self.nbytes
        while total > self._most_bytes and len(self._held) > 1:
            _, oldest = self._held.popitem(last=False)
            total -= oldest.nbytes
        return self._held[key]
