"""Write a picture with its parameters, whole or not at all.

| suffix | pixels | alpha | compression |
|---|---|---|---|
| .png | uint8, uint16 | straight | deflate, level 1 |
| .jpg .jpeg | uint8 | none: laid over black | quality 95 |
| .tif .tiff | all, float16 and float64 as float32 | straight in integers, associated in floats | deflate |
| .exr | float16, float32, float64 as float32 | associated | zip |

Nothing else is converted: a format that cannot hold the pixels is refused. No clock, host or duration gets into the
bytes. Parameters are kept exactly as one JSON object in ImageDescription (in EXR: `comments`); in EXR also one by one,
typed, under `lenscl:KEY`, where numbers that are not whole have single precision.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from lenscl.errors import ImageError
from lenscl.imaging.atomic import whole_file
from lenscl.imaging.encoding import DTYPES, Encoding, decode, encode, encoding_of
from lenscl.imaging.library import LARGEST_SIDE, check_name, oiio

_FORMAT_OF = {"uint8": "uint8", "uint16": "uint16", "float16": "half", "float32": "float"}
_DESCRIPTION = "ImageDescription"
_PREFIX = "lenscl:"
_WRITER_ROOM = 1.1  # what a format may need beyond the bare pixels that it cannot compress


@dataclass(frozen=True, slots=True, kw_only=True)
class _Format:
    """What a file format holds, and how it is written."""

    name: str
    dtypes: tuple[str, ...]
    hints: Mapping[str, Any]
    stored_as: Mapping[str, str] = field(default_factory=dict)  # pixels that are kept as another type
    has_alpha: bool = True
    longest_description: int = 2**24  # bytes
    last_bytes: bytes = b""  # how a complete file ends; empty: its last row is read instead


_PNG = _Format(name="PNG", dtypes=("uint8", "uint16"), hints={"png:compressionLevel": 1}, last_bytes=b"IEND\xaeB`\x82")
_JPEG = _Format(
    name="JPEG",
    dtypes=("uint8",),
    hints={"CompressionQuality": 95, "jpeg:subsampling": "4:4:4"},
    has_alpha=False,
    longest_description=60_000,  # one marker holds 64 KiB; beyond, its library ends the process
    last_bytes=b"\xff\xd9",
)
_TIFF = _Format(
    name="TIFF",
    dtypes=DTYPES,
    hints={"compression": "zip", "tiff:zipquality": 1},
    stored_as={"float16": "float32", "float64": "float32"},
)
_EXR = _Format(
    name="EXR", dtypes=("float16", "float32", "float64"), hints={"compression": "zip"}, stored_as={"float64": "float32"}
)
_FORMATS = {".png": _PNG, ".jpg": _JPEG, ".jpeg": _JPEG, ".tif": _TIFF, ".tiff": _TIFF, ".exr": _EXR}


def write_image(
    path: str | PathLike[str],
    pixels: NDArray[Any],
    *,
    metadata: Mapping[str, Any] | None = None,
    encoding: str | None = None,
    further: Sequence[str] = (),
) -> None:
    """Write an image; the table of this module says what each format holds.

    Parameters
    ----------
    path : path
        Its suffix chooses the format. An existing file is replaced, at once and only by a good one.
    pixels : array, shape (H, W, C) or (H, W)
        As `paint` returns them.
    metadata : mapping, optional
        The image's parameters: anything that JSON can say.
    encoding : str, optional
        "srgb" or "linear"; default sRGB for integers, linear for floats. PNG, JPEG and EXR state it.
    further : sequence of str, optional
        Names of the last channels of the pixels, which are no colour; only EXR holds such.

    Raises
    ------
    ImageError
        If the format cannot hold these pixels or this much metadata, the folder is missing, the disk full, or the
        file does not read back; the message leads with the path. Nothing is left behind.
    """
    file = Path(path)
    check_name(file)
    image = pixels[..., np.newaxis] if pixels.ndim == 2 else pixels
    image_format = _format_for(file, image, further)
    stated = encoding_of(image.dtype, encoding)
    description = _description(file, image_format, metadata or {})
    if not image_format.has_alpha:
        image = _over_black(image, stated)
    stored_type = np.dtype(image_format.stored_as.get(image.dtype.name, image.dtype.name))
    image = np.ascontiguousarray(image, dtype=stored_type)

    spec = _spec(image, image_format, stated, description, further)
    if image_format is _EXR:
        for key, value in (metadata or {}).items():
            _add_typed(spec, _PREFIX + key, value)
    with whole_file(file, int(_WRITER_ROOM * image.nbytes) + 2 * len(description)) as temporary:
        _write(file, temporary, spec, image)
        _verify(file, temporary, image_format, spec, description)


def formats_of(dtype: DTypeLike) -> tuple[str, ...]:
    """Return the file formats, such as "png", that hold pixels of a type as they are."""
    formats = {image_format.name: suffix[1:] for suffix, image_format in reversed(_FORMATS.items())
               if np.dtype(dtype).name in image_format.dtypes}  # fmt: skip
    return tuple(reversed(formats.values()))


def _format_for(file: Path, image: NDArray[Any], further: Sequence[str]) -> _Format:
    image_format = _FORMATS.get(file.suffix.lower())
    if image_format is None:
        raise ImageError(
            f"{file}: {file.suffix or 'no suffix'!r} is not written; end the name in {', '.join(_FORMATS)}"
        )
    if image.dtype.name not in image_format.dtypes:
        fit = [suffix for suffix, other in _FORMATS.items() if image.dtype.name in other.dtypes]
        raise ImageError(
            f"{file}: {image_format.name} holds {' or '.join(image_format.dtypes)}, and the picture is {image.dtype}; "
            + (f"write it as {' or '.join(fit)}" if fit else f"convert it to {' or '.join(image_format.dtypes)}")
        )
    if further and image_format is not _EXR:
        raise ImageError(f"{file}: {image_format.name} holds no channel called {further[0]!r}; write it as .exr")
    colours = image.shape[2] - len(further) if image.ndim == 3 else 0
    if not 1 <= colours <= 4 or 0 in image.shape or max(image.shape) > LARGEST_SIDE:
        raise ImageError(
            f"{file}: the pixels have the shape {image.shape}; expected (H, W) or (H, W, C), C = 1 to 4, sides from 1 "
            f"to {LARGEST_SIDE}"
        )
    return image_format


def _description(file: Path, image_format: _Format, metadata: Mapping[str, Any]) -> str:
    """Return the parameters as JSON in ASCII, which every format keeps."""
    if not metadata:
        return ""
    try:
        text = json.dumps(dict(metadata), default=_plain, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise ImageError(f"{file}: its metadata cannot be written as JSON ({error})") from error
    if len(text) > image_format.longest_description:
        raise ImageError(
            f"{file}: {len(text)} bytes of metadata, and {image_format.name} holds {image_format.longest_description}; "
            "write it as .png, .tif or .exr"
        )
    return text


def _plain(value: Any) -> Any:
    """Return numpy's numbers and arrays as Python's, for JSON."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    raise TypeError(f"a {type(value).__name__} is not a number, text, list or table")


def _over_black(image: NDArray[Any], encoding: Encoding) -> NDArray[Any]:
    """Lay straight alpha over black, in linear light; a format without alpha would show what it hides."""
    if image.shape[2] not in (2, 4):
        return image
    alpha = image[..., -1:] / np.iinfo(image.dtype).max
    return encode(decode(image[..., :-1], encoding) * alpha, image.dtype, encoding)


def _spec(
    image: NDArray[Any], image_format: _Format, encoding: Encoding, description: str, further: Sequence[str]
) -> Any:
    library = oiio()
    height, width, channels = image.shape
    spec = library.ImageSpec(width, height, channels, library.TypeDesc(_FORMAT_OF[image.dtype.name]))
    colours = {1: ("Y",), 2: ("Y", "A"), 3: ("R", "G", "B"), 4: ("R", "G", "B", "A")}[channels - len(further)]
    spec.channelnames = (*colours, *further)
    if colours[-1] == "A":
        spec.alpha_channel = len(colours) - 1
        if image.dtype.kind == "u":
            spec.attribute("oiio:UnassociatedAlpha", 1)
    spec.attribute("oiio:ColorSpace", "srgb_rec709_scene" if encoding == "srgb" else "lin_rec709_scene")
    spec.attribute("DateTime", "")  # an empty one keeps the clock out: EXR and TIFF would write the time
    for key, value in image_format.hints.items():
        spec.attribute(key, value)
    if (
        image_format is _TIFF
    ):  # without any EXIF value, writing its empty directory fails; 1 is sRGB, 65535 no statement
        spec.attribute("Exif:ColorSpace", 1 if encoding == "srgb" else 65535)
    if description:
        spec.attribute(_DESCRIPTION, description)
    return spec


def _add_typed(spec: Any, name: str, value: Any) -> None:
    """Add one parameter in the nearest of EXR's types: whole number, number, text, three numbers; else JSON text."""
    library = oiio()
    plain = _plain(value) if isinstance(value, (np.generic, np.ndarray)) else value
    if isinstance(plain, bool):
        spec.attribute(name, int(plain))
    elif isinstance(plain, int) and abs(plain) < 2**31:
        spec.attribute(name, plain)
    elif isinstance(plain, (int, float)) and math.isfinite(plain) and abs(plain) < float(np.finfo(np.float32).max):
        spec.attribute(name, library.TypeDesc("float"), float(plain))
    elif isinstance(plain, str):
        spec.attribute(name, plain)
    elif isinstance(plain, (list, tuple)) and len(plain) == 3 and all(type(v) in (int, float) for v in plain):
        spec.attribute(name, library.TypeDesc("vector"), tuple(float(v) for v in plain))
    else:
        spec.attribute(name, json.dumps(plain, default=_plain))


def _write(file: Path, temporary: Path, spec: Any, image: NDArray[Any]) -> None:
    """Write and close; the library tells of some failures by a return value, of others only by its message."""
    output = oiio().ImageOutput.create(str(temporary))
    if output is None or not output.open(str(temporary), spec):
        reason = oiio().geterror() if output is None else output.geterror()
        raise ImageError(f"{file}: cannot be written ({reason.strip()}); check the folder's permissions")
    is_written = output.write_image(image)
    trouble = output.geterror()
    is_closed = output.close()
    trouble = trouble or output.geterror()
    if not is_written or not is_closed or trouble:
        raise ImageError(
            f"{file}: writing failed ({trouble.strip() or 'the library does not say why'}); is the disk full?"
        )


def _verify(file: Path, temporary: Path, image_format: _Format, spec: Any, description: str) -> None:
    """Open the written file again: the same picture, the same parameters, and an end."""
    source = oiio().ImageInput.open(str(temporary))
    if source is None:
        raise ImageError(f"{file}: does not read back ({oiio().geterror().strip()}); is the disk full or faulty?")
    try:
        found = source.spec()
        is_same = (found.width, found.height, found.nchannels, str(found.format)) == (
            spec.width,
            spec.height,
            spec.nchannels,
            str(spec.format),
        ) and (found.getattribute(_DESCRIPTION) or "") == description
        if is_same and not image_format.last_bytes:
            is_same = source.read_scanline(spec.height - 1, 0, "float") is not None and not source.geterror()
    finally:
        source.close()
    if is_same and image_format.last_bytes:
        with temporary.open("rb") as stream:
            stream.seek(-len(image_format.last_bytes), 2)
            is_same = stream.read() == image_format.last_bytes
    if not is_same:
        raise ImageError(f"{file}: does not read back as it was written; is the disk full or faulty?")
