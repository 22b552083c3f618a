"""Write a ray map for other programs: an ST map for compositors, or every array for numpy.

An ST map is a picture whose red and green say where on another picture each pixel looks: R = s from the left, G = 1 - t
from the bottom, as in Nuke's STMap and OpenImageIO's `st_warp` with flip_t. B is 0. A is 1 where the ray landed on the
picture and 0 elsewhere; R = G = -1 where it met the picture's plane nowhere. Where bounds on the error are asked for, a
fifth channel `error` holds them, -1 where there is none.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sized
from os import PathLike
from pathlib import Path
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from lenscl.errors import ImageError
from lenscl.imaging.atomic import whole_file
from lenscl.imaging.outputs import OUTPUT_USES
from lenscl.imaging.write import write_image
from lenscl.status import RayStatus

_ARRAYS = ("st", "status", "events", "origin", "direction")
_ROUNDINGS = 4
_HAS_PLACE = tuple(int(status) for status in RayStatus if status.lands)


class WritableMap(Protocol):
    """What writing reads of a ray map."""

    @property
    def st(self) -> NDArray[Any]:
        """Places on the picture, (rows, columns, 2)."""

    @property
    def status(self) -> NDArray[np.uint8]:
        """The `RayStatus` of every ray."""

    @property
    def events(self) -> NDArray[np.uint8]:
        """Surfaces met."""

    @property
    def origin(self) -> NDArray[Any]:
        """Starts of the last legs, (rows, columns, 3)."""

    @property
    def direction(self) -> NDArray[Any]:
        """Directions of the last legs, (rows, columns, 3)."""

    @property
    def added(self) -> Mapping[str, NDArray[Any]]:
        """What the scene's effects add, by name."""

    @property
    def scene(self) -> Any:
        """What was traced; `to_toml()` makes a text of it."""


def write_map(path: str | PathLike[str], raymap: WritableMap, error: NDArray[np.float64] | None = None) -> None:
    """Write a ray map as `.exr` (an ST map, float32 RGBA) or `.npz` (every array, in the precision traced).

    Parameters
    ----------
    path : path
        The suffix decides. Equal ray maps give equal bytes.
    raymap : RayMap
        In an `.npz` each array has its attribute's name: st, status, events, origin, direction, and what the effects
        add, with what a map makes of that: magnification and fold beside jacobian; `scene_toml` is the scene as text.
        What `effects.antialias` adds is there as samples.side, .pixels, .st, .status, .events, and .transmittance and
        so on, see `lenscl.tracing.Samples`; what `effects.caustics` adds as irradiance, with where the light goes as
        caustic.ends, .shares, .flux, .cut, .not_excluded, .bent, and .rgb of coloured light, see
        `lenscl.tracing.Caustic`. An EXR has what effects add to each pixel as further channels: transmittance,
        path_length, transmission.R, .G, .B, jacobian.ds_drow, .ds_dcolumn, .dt_drow, .dt_dcolumn (of t, not of G),
        magnification, fold, reflectance, reflected_st.s, .t (of t, not of G), reflected.x, .y, .z. It has one place a
        pixel, and so leaves out the samples; and the irradiance, which is not on the film. A map of several wavelengths
        is written as `.npz` alone: an ST map says of a pixel one place, not one for each. A map of a list of one
        wavelength is written as either. The seconds are left out. An EXR carries `scene_toml` among its parameters.
    error : float64 array, shape (rows, columns), optional
        Bounds on the error of (s, t), -1 where there is none; in an `.npz` the array `error`. The EXR's channel `error`
        bounds the error of its own numbers: what R and G lose as float32 is added, and it is rounded up.

    Raises
    ------
    ImageError
        If the suffix is another, or the file cannot be written.
    """
    file = Path(path)
    if "wavelengths" in raymap.added:
        refuse_wavelengths(file, raymap.added["wavelengths"])
    scene_toml: str = raymap.scene.to_toml()
    match file.suffix.lower():
        case ".exr":
            raymap, error = _alone(raymap, error)
            image = _st_map(raymap)
            further = dict(_channels(_added(raymap)))
            if error is not None:
                further["error"] = _error_of(image, raymap, error)[..., np.newaxis]
            image = np.concatenate([image, *further.values()], axis=2)
            write_image(file, image, metadata={"scene_toml": scene_toml}, further=tuple(further))
        case ".npz":
            _write_npz(file, raymap, scene_toml, {} if error is None else {"error": error})
        case other:
            raise ImageError(f"{file}: a ray map is written as .exr (an ST map) or .npz (numpy arrays), not {other!r}")


def error_in_file(path: str | PathLike[str], raymap: WritableMap, error: NDArray[np.float64]) -> NDArray[Any]:
    """Return the bounds on the error of (s, t) as `write_map` stores them; parameters as there.

    An `.exr` has R and G as float32, and what they lose is in its bounds; an `.npz` has every number as it was traced.
    """
    is_st_map = Path(path).suffix.lower() == ".exr"
    return _error_of(_st_map(raymap), raymap, error) if is_st_map else error


def refuse_wavelengths(path: str | PathLike[str], wavelengths: Sized) -> None:
    """Raise where a map of several wavelengths is to be written as a format that holds one."""
    if Path(path).suffix.lower() == ".exr" and len(wavelengths) > 1:
        raise ImageError(
            f"{path}: an ST map holds one wavelength, and effects.dispersion asks for several; write the map as .npz, "
            "or set effects.dispersion = false for the d line's, or a list of one wavelength"
        )


def _alone(raymap: WritableMap, error: NDArray[np.float64] | None) -> tuple[WritableMap, NDArray[np.float64] | None]:
    """Return a map, and the bounds on its error, without the axis of wavelengths, of which there is one at most."""
    if "wavelengths" not in raymap.added:
        return raymap, error
    (layer,) = cast(Any, raymap).layers()
    return layer, None if error is None else error[0]


def _st_map(raymap: WritableMap) -> NDArray[np.float32]:
    has_place = np.isin(raymap.status, _HAS_PLACE)
    image = np.zeros((*raymap.status.shape, 4), np.float32)
    image[..., 0] = np.where(has_place, raymap.st[..., 0], -1.0)
    image[..., 1] = np.where(has_place, 1.0 - raymap.st[..., 1].astype(np.float64), -1.0)
    image[..., 3] = raymap.status == RayStatus.PICTURE
    return image


def _added(raymap: WritableMap) -> dict[str, NDArray[Any]]:
    """Return what effects add to a map, and what it makes of that."""
    derived = (name for use in OUTPUT_USES.values() if use.name in raymap.added for name in use.derived)
    return {**raymap.added, **{name: getattr(raymap, name) for name in derived}}


def _channels(added: Mapping[str, NDArray[Any]]) -> Iterator[tuple[str, NDArray[np.float32]]]:
    """Yield a name and a channel, shape (rows, columns, 1), for every number that effects add to a pixel."""
    for name, array in added.items():
        if array.ndim == 2:
            yield name, _single(array)[..., np.newaxis]
        else:
            numbers = _single(array).reshape(*array.shape[:2], -1)
            for number, part in enumerate(OUTPUT_USES[name].channels):
                yield f"{name}.{part}", numbers[..., number : number + 1]


def _single(array: NDArray[Any]) -> NDArray[np.float32]:
    """Return numbers in single precision, no larger than its largest."""
    most = np.finfo(np.float32).max
    held: NDArray[np.float32] = np.clip(array, -most, most).astype(np.float32)
    return held


def _error_of(image: NDArray[np.float32], raymap: WritableMap, error: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the bounds on what an ST map's R and G are off as they are stored, shape (rows, columns)."""
    st = raymap.st.astype(np.float64)
    lost = np.maximum(np.abs(image[..., 0] - st[..., 0]), np.abs(image[..., 1] - (1.0 - st[..., 1])))
    rounded = _ROUNDINGS * np.finfo(np.float64).eps * (1.0 + np.abs(st).max(axis=-1))  # of 1 - t, twice, and the sum
    bound = np.where(error < 0, error, error + lost + rounded)
    stored = bound.astype(np.float32)
    rounded_up: NDArray[np.float32] = np.where(stored < bound, np.nextafter(stored, np.float32(np.inf)), stored)
    return rounded_up


def _sampled(samples: Any) -> dict[str, NDArray[Any]]:
    """Return the arrays of a map's samples by their names in a file."""
    if samples is None:
        return {}
    own = {name: getattr(samples, name) for name in ("side", "pixels", "st", "status", "events")}
    return {f"samples.{name}": np.asarray(array, order="C") for name, array in {**own, **samples.added}.items()}


def _lit(caustic: Any) -> dict[str, NDArray[Any]]:
    """Return the light on a map's picture by its names in a file."""
    if caustic is None:
        return {}
    shares = caustic.shares
    ends = {"caustic.ends": np.array(list(shares)), "caustic.shares": np.array(list(shares.values()))}
    ends |= {"caustic.flux": np.array(caustic.flux), "caustic.cut": np.array(caustic.cut)}
    ends |= {f"caustic.{name}": np.array(getattr(caustic, name)) for name in ("not_excluded", "bent")}
    coloured = {} if caustic.rgb is None else {"caustic.rgb": np.ascontiguousarray(caustic.rgb)}
    return {"irradiance": np.ascontiguousarray(caustic.irradiance), **coloured, **ends}


def _write_npz(file: Path, raymap: WritableMap, scene_toml: str, further: Mapping[str, NDArray[Any]]) -> None:
    arrays: dict[str, Any] = {name: np.ascontiguousarray(getattr(raymap, name)) for name in _ARRAYS}
    arrays |= {name: np.ascontiguousarray(array) for name, array in _added(raymap).items()}
    arrays |= _sampled(getattr(raymap, "samples", None)) | _lit(getattr(raymap, "caustic", None))
    arrays |= further
    arrays["scene_toml"] = np.array(scene_toml)
    with whole_file(file, sum(array.nbytes for array in arrays.values()) + 2**16) as temporary:
        with temporary.open("wb") as stream:
            np.savez(stream, **arrays)  # its zip entries carry the year 1980, not the clock
        with np.load(temporary) as stored:  # reads the table at the file's very end
            is_same = stored.files == list(arrays)
        if not is_same:
            raise ImageError(f"{file}: does not read back as it was written; is the disk full or faulty?")
