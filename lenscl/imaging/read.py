"""Read a picture file, whole and as meant, or say what is wrong with it.

Input: a path. Output: a `Picture`. Of a file with several pictures the first is read; palettes are spread out, a stated
orientation is carried out, and an EXR's pixels are placed in its display window.
"""

from __future__ import annotations

import json
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from hashlib import sha256
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lenscl.errors import ImageError
from lenscl.imaging.encoding import Encoding, encoding_of, full_scale
from lenscl.imaging.library import LARGEST_MEGABYTES, LARGEST_SIDE, check_name, oiio

# Not "double": OpenImageIO 3.2 returns unset memory for a strip of one row of a TIFF of doubles, and says nothing
_DTYPE_OF = {"uint8": "uint8", "uint16": "uint16", "half": "float16", "float": "float32"}
_COLOURS = ({"R", "G", "B"}, {"Y"}, {"I"})  # the names of colour channels that are understood
_TURNED = (5, 6, 7, 8)  # orientations that swap rows and columns
_CONVERT = "convert it to PNG, JPEG, TIFF or EXR with 1 to 4 channels (grey, grey and alpha, RGB, RGBA)"


@dataclass(frozen=True, eq=False)
class Picture:
    """Pixels, and how to take them.

    Attributes
    ----------
    pixels : array, shape (H, W, C)
        Rows from the top; uint8, uint16, float16 or float32, read-only; C = 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA.
    encoding : str
        "srgb" or "linear".
    alpha : str
        "none"; "straight" in integers; "associated", colour already multiplied by alpha, in floats.
    """

    pixels: NDArray[Any] = field(repr=False)
    encoding: Encoding

    @property
    def alpha(self) -> Literal["none", "straight", "associated"]:
        """What the last of 2 or 4 channels means."""
        if self.pixels.shape[2] in (1, 3):
            return "none"
        return "straight" if self.pixels.dtype.kind == "u" else "associated"

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows."""
        return self.pixels.shape[1], self.pixels.shape[0]

    @cached_property
    def digest(self) -> str:
        """A digest of the pixels with their type and shape; equal digests mean equal pixels."""
        digest = sha256(f"{self.pixels.dtype.str} {self.pixels.shape} ".encode())
        digest.update(np.ascontiguousarray(self.pixels).data)
        return digest.hexdigest()


def read_picture(path: str | PathLike[str]) -> Picture:
    """Read a picture file.

    Parameters
    ----------
    path : path
        A file in any format that OpenImageIO reads, found by its content.

    Returns
    -------
    Picture
        sRGB-encoded if it holds integers and linear if it holds floats, unless the file states the other of the two.
        Pixels that are NaN or Inf stay as they are.

    Raises
    ------
    ImageError
        If the file cannot be read whole, or holds no grey or RGB picture; the message leads with the path.
    """
    file = Path(path)
    hints = oiio().ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)  # leave colour as it is stored
    with _opened(file, hints) as source:
        spec = source.spec()
        _check_kind(file, spec)
        pixels = source.read_image(0, 0, 0, spec.nchannels, spec.format)
        trouble = source.geterror()
    if pixels is None or trouble:
        reason = _first_line(trouble) or "its pixels cannot be decoded"
        raise ImageError(f"{file}: is damaged or cut short ({reason}); copy or export it again")
    if pixels.shape != (spec.height, spec.width, spec.nchannels):
        raise ImageError(f"{file}: holds pixels of shape {pixels.shape}, which is no flat picture; {_CONVERT}")

    if spec.alpha_channel >= 0:
        pixels = _with_usual_alpha(pixels, is_straight=bool(spec.getattribute("oiio:UnassociatedAlpha")))
    pixels = _upright(_in_display_window(file, source.format_name(), spec, pixels), spec.getattribute("Orientation"))
    pixels = np.ascontiguousarray(pixels)
    pixels.setflags(write=False)
    return Picture(pixels, _encoding(spec, pixels.dtype))


def read_size(path: str | PathLike[str]) -> tuple[int, int]:
    """Return the columns and rows that `read_picture` would, from the file's head alone.

    Raises
    ------
    ImageError
        If the file is no image.
    """
    with _opened(Path(path)) as source:
        spec, is_exr = source.spec(), source.format_name() == "openexr"
        size = (spec.full_width, spec.full_height) if is_exr else (spec.width, spec.height)
        return size[::-1] if spec.getattribute("Orientation") in _TURNED else size


def read_metadata(path: str | PathLike[str]) -> dict[str, Any]:
    """Return the parameters that `write_image` or `write_map` stored in an image; empty if there are none.

    Raises
    ------
    ImageError
        If the file is no image.
    """
    with _opened(Path(path)) as source:
        text = source.spec().getattribute("ImageDescription") or "{}"
    try:
        stored = json.loads(text)
    except ValueError:  # somebody's words, not our parameters
        return {}
    return stored if isinstance(stored, dict) else {}


@contextmanager
def _opened(file: Path, *hints: Any) -> Iterator[Any]:
    """Open an image and close it again."""
    _check_is_file(file)
    source = oiio().ImageInput.open(str(file), *hints)
    if source is None:
        raise ImageError(f"{file}: is not a picture that can be read ({_first_line(oiio().geterror())}); {_CONVERT}")
    try:
        yield source
    finally:
        source.close()


def _check_is_file(file: Path) -> None:
    """Say in plain words what no format reader says."""
    check_name(file)
    try:
        mode = file.stat().st_mode
        if stat.S_ISDIR(mode):
            raise ImageError(f"{file}: is a folder; name a picture file in it")
        if not stat.S_ISREG(mode):  # a pipe would keep whoever opens it waiting, a device may never end
            raise ImageError(f"{file}: is no regular file; name a picture file")
        with file.open("rb") as stream:
            is_empty = not stream.read(1)
    except OSError as error:
        raise ImageError(f"{file}: cannot be opened ({error.strerror}); check the name and its permissions") from error
    if is_empty:
        raise ImageError(f"{file}: is an empty file; copy or export the picture again")


def _check_kind(file: Path, spec: Any) -> None:
    """Refuse what is not a flat grey or RGB picture of a type we work with."""
    names, alpha = list(spec.channelnames), spec.alpha_channel
    if str(spec.format) not in _DTYPE_OF:
        raise ImageError(f"{file}: holds {spec.format} numbers; convert it to {', '.join(_DTYPE_OF.values())}")
    if spec.deep or spec.depth > 1:
        raise ImageError(f"{file}: is a deep or volume image, not a flat picture; {_CONVERT}")
    colours = [name for i, name in enumerate(names) if i != alpha]
    is_alpha_last = alpha in (-1, len(names) - 1)
    is_colour = len(colours) == 1 or {name.rpartition(".")[2] for name in colours} in _COLOURS
    if len(names) > 4 or not is_alpha_last or not is_colour:
        raise ImageError(f"{file}: has the channels {', '.join(names[:8])}, which are not grey or RGB; {_CONVERT}")


def _encoding(spec: Any, dtype: np.dtype[Any]) -> Encoding:
    stated = str(spec.getattribute("oiio:ColorSpace") or "").lower()
    if stated in ("linear", "scene_linear", "lin_srgb", "lin_rec709", "lin_rec709_scene"):
        return "linear"
    if stated.startswith("srgb"):
        return "srgb"
    return encoding_of(dtype, None)


def _with_usual_alpha(pixels: NDArray[Any], is_straight: bool) -> NDArray[Any]:
    """Bring alpha to our convention: straight in integers, associated in floats."""
    if (pixels.dtype.kind == "u") == is_straight:
        return pixels
    colour, alpha = pixels[..., :-1].astype(np.float64), pixels[..., -1:].astype(np.float64)
    if is_straight:
        colour = colour * alpha
    else:
        most = full_scale(pixels.dtype)
        colour = np.rint(np.minimum(colour * (most / np.where(alpha == 0, most, alpha)), most))
    return np.concatenate([colour.astype(pixels.dtype), pixels[..., -1:]], axis=2)


def _in_display_window(file: Path, format_name: str, spec: Any, pixels: NDArray[Any]) -> NDArray[Any]:
    """Return an EXR's display window: what its data window leaves out is 0, what sticks out is cut off."""
    window = (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    if format_name != "openexr" or window == (spec.x, spec.y, spec.width, spec.height):
        return pixels
    needed = spec.full_width * spec.full_height * pixels.shape[2] * pixels.itemsize
    if max(spec.full_width, spec.full_height) > LARGEST_SIDE or needed > LARGEST_MEGABYTES * 2**20:
        raise ImageError(
            f"{file}: its display window is {spec.full_width} x {spec.full_height}; at most {LARGEST_SIDE} a side and "
            f"{LARGEST_MEGABYTES} MB are read; crop or shrink it"
        )
    shown = np.zeros((spec.full_height, spec.full_width, pixels.shape[2]), pixels.dtype)
    left, top = spec.x - spec.full_x, spec.y - spec.full_y
    rows = slice(max(top, 0), max(min(top + spec.height, spec.full_height), 0))
    columns = slice(max(left, 0), max(min(left + spec.width, spec.full_width), 0))
    shown[rows, columns] = pixels[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]
    return shown


def _upright(pixels: NDArray[Any], orientation: Any) -> NDArray[Any]:
    """Carry out the orientation of EXIF 2.32, table 6: 2 to 4 mirror and turn, 5 to 8 swap rows and columns first."""
    code = orientation if isinstance(orientation, int) else 1
    if code in _TURNED:
        pixels = pixels.swapaxes(0, 1)
    if code in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    if code in (3, 4, 7, 8):
        pixels = pixels[::-1]
    return pixels


def _first_line(message: str) -> str:
    return message.strip().splitlines()[0].strip() if message.strip() else ""
