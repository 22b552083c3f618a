"""What tracing yields, as frozen values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from inspect import cleandoc
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.codegen import KernelSource
from lenscl.config import Scene
from lenscl.config.scene import Frozen
from lenscl.device import Device, choose, devices
from lenscl.effects import EFFECTS
from lenscl.lenses import Vec3
from lenscl.status import RayStatus
from lenscl.tracing.arrayvalue import ArrayValue

_ADDED_BY = {
    effect.key: {output.name for some in effect.variants.values() for one in some for output in one.adds}
    | {"wavelengths" for some in effect.variants.values() for one in some if one.layers}
    for effect in EFFECTS.values()
} | {"caustics": {"irradiance"}}
_ADDED_BY["footprint"] |= {"magnification", "fold"}  # made of its jacobian


_DESCRIBED = tuple(each.name for each in fields(Device) if each.compare)  # what a pickle keeps of a device


@dataclass(frozen=True, kw_only=True, eq=False)
class _Rays(ArrayValue):
    """The ends of rays. Lengths are in scene units; real arrays have the precision traced (float32 or float64).

    With `effects.dispersion` every array of rays has a leading axis of the K wavelengths: `st` has the shape
    (K, ..., 2). The attribute `wavelengths`, float64 of shape (K,), has the wavelengths in nm.

    Attributes
    ----------
    st : real array, shape (..., 2)
        Picture coordinates: s along right, t along down, both in [0, 1) on the picture; (-1, -1) where the ray has no
        place on the picture's plane.
    status : uint8 array, shape (...)
        Values of `RayStatus`.
    events : uint8 array, shape (...)
        Number of surfaces met: entries, exits and total reflections. 0: the ray missed every lens.
    origin, direction : real array, shape (..., 3)
        The last straight leg: its start, a surface point or the source, and its unit direction.
    trace_seconds : float
        Device time of all launches.
    escalated : int
        Number of rays that were undecided and traced again in higher precision.
    kernel : KernelSource
        The kernel. That of escalated rays differs in precision.
    scene : Scene
        What was traced, with the method and precision of the call.
    device : Device
        Where it was traced. For unpickled rays it is looked up when first read: the same device, else one of its name,
        else the default one.
    added : mapping of str to array
        The arrays of effects, by name. Each is an attribute as well: `raymap.path_length`, or `raymap.jacobian`,
        d(s, t)/d(row, column) of shape (..., 2, 2). The Jacobian is 0 where the ray has no place, and has no meaning on
        an edge. For given rays it is that of the pencil of the film's rays, moved to the ray's own start or direction.

    Equality compares the rays, the scene, the kernel and the device's description, and not `trace_seconds`. A pickle
    holds no device, only its description; reading arrays from it starts no driver.
    """

    st: NDArray[Any] = field(repr=False)
    status: NDArray[np.uint8] = field(repr=False)
    events: NDArray[np.uint8] = field(repr=False)
    trace_seconds: float = field(compare=False)
    escalated: int
    kernel: KernelSource = field(repr=False)
    scene: Scene = field(repr=False)
    device: Device = field(compare=False)  # by its description; see `_parts`
    added: Mapping[str, NDArray[Any]] = field(default=Frozen(), repr=False)

    def __getattr__(self, name: str) -> Any:
        # Asked for what is no attribute of its own
        if name == "device" and "_described" in self.__dict__:
            self.__dict__["device"] = _found(self.__dict__["_described"])
            return self.__dict__["device"]
        added: Mapping[str, NDArray[Any]] = self.__dict__.get("added", {})
        if name in added:
            return added[name]
        effect = next((key for key, names in _ADDED_BY.items() if name in names), None)
        advice = f"; trace with effects.{effect} for it" if effect else ""
        raise AttributeError(f"{type(self).__name__} has no {name}{advice}")

    def __getstate__(self) -> dict[str, Any]:
        state = {**self.__dict__, "_described": self._description()}
        state.pop("device", None)
        return state

    def _description(self) -> Mapping[str, Any]:
        """Return what tells the device from others."""
        from_pickle: Mapping[str, Any] | None = self.__dict__.get("_described")
        return from_pickle or {name: getattr(self.device, name) for name in _DESCRIBED}

    def _parts(self) -> list[Any]:
        return [*super()._parts(), self._description()]

    @property
    def magnification(self) -> NDArray[np.float64]:
        """Area of a film pixel's footprint on the picture over the pixel's own, shape (...); 0 without a place.

        With `footprint`, to first order: abs(det(jacobian)) times the picture's area over the pixel's, in scene units.
        Light that the film sends to the picture is spread over so much more; towards a fold it goes to 0.
        """
        film, picture = self.scene.film, self.scene.picture
        pixel = _area(film.right, film.down) / (film.rows * film.columns)
        ratio = _area(picture.right, picture.down) / pixel
        magnified: NDArray[np.float64] = np.abs(self._turned()) * ratio
        return magnified

    @property
    def fold(self) -> NDArray[np.int8]:
        """Which way round the picture is seen, shape (...): 1 as it is, -1 mirrored, 0 without a place or on a fold.

        With `footprint`: the sign of det d(s, t)/d(column, row). Where it changes between neighbours that take the same
        path the picture is folded, and light from the source through the film would draw a caustic there.
        """
        sign: NDArray[np.int8] = np.sign(self._turned()).astype(np.int8)
        return sign

    def _turned(self) -> NDArray[np.float64]:
        """Return det d(s, t)/d(column, row); in double, where no product of two places overflows."""
        j = self.jacobian.astype(np.float64)
        determinant: NDArray[np.float64] = j[..., 0, 1] * j[..., 1, 0] - j[..., 0, 0] * j[..., 1, 1]
        return determinant

    def counts(self) -> dict[RayStatus, int]:
        """Return how many rays ended how; they sum to the rays, those of all wavelengths counted."""
        counted = np.bincount(self.status.ravel(), minlength=len(RayStatus))
        return {status: int(counted[status]) for status in RayStatus}


def _found(described: Mapping[str, Any]) -> Device:
    """Return the device of a description; see `_Rays`."""
    here = devices()
    label = Device(**described, handle=None).label
    same = (each for each in here if all(getattr(each, name) == value for name, value in described.items()))
    namesakes = (each for each in here if each.label == label)
    return next(same, None) or next(namesakes, None) or choose()


def _area(right: Vec3, down: Vec3) -> float:
    return float(np.linalg.norm(np.cross(right, down)))


@dataclass(frozen=True, kw_only=True, eq=False)
class Samples(ArrayValue):
    """More rays than the one through its centre, of all film pixels or of some: what `effects.antialias` adds.

    They stand at the centres of `side` x `side` squares that make up the pixel, row by row. With `effects.dispersion`
    the arrays of rays have an axis of wavelengths in front, and a pixel that one of those refines has them of all.

    Attributes
    ----------
    side : int
        Samples of a pixel, each way.
    pixels : int array, shape (P,)
        Which pixels have them: row x columns + column, rising.
    st : real array, shape (P, side^2, 2)
    status, events : uint8 array, shape (P, side^2)
    added : mapping of str to array, shape (P, side^2, ...)
        Each as in a `RayMap`.
    """

    side: int
    pixels: NDArray[np.integer[Any]] = field(repr=False)
    st: NDArray[Any] = field(repr=False)
    status: NDArray[np.uint8] = field(repr=False)
    events: NDArray[np.uint8] = field(repr=False)
    added: Mapping[str, NDArray[Any]] = field(default=Frozen(), repr=False)

    def layer(self, number: int) -> Samples:
        """Return the samples of one wavelength, without that axis."""
        added = {name: array[number] for name, array in self.added.items()}
        rays = {name: getattr(self, name)[number] for name in ("st", "status", "events")}
        return replace(self, **rays, added=Frozen(added))


@dataclass(frozen=True, eq=False)
class BrightCells(ArrayValue):
    """Cells of the picture in which the irradiance exceeds 1 and varies, with the irradiance of their parts.

    A whole number stops at white, so the colour of such a cell is the mean over its parts of what each of them shows.
    The parts of a cell are n x n equal ones, row by row: 3 x 3, and of pictures of more than 2^24 cells the cell.

    Attributes
    ----------
    cells : int64 array, shape (P,)
        Their numbers, row by row, rising.
    irradiance : float32 array, shape (P, n^2, C)
        As `Caustic.rgb` where there is that, of C = 3 channels, else as `Caustic.irradiance`, of C = 1. The mean over
        the parts is that of the cell. With `effects.dispersion` it has an axis of wavelengths in front; in a cell
        that is bright at some wavelengths only, all parts have the cell's mean at the others.
    """

    cells: NDArray[np.int64] = field(repr=False)
    irradiance: NDArray[np.float32] = field(repr=False)


@dataclass(frozen=True, kw_only=True, eq=False)
class Caustic(ArrayValue):
    """The light on the picture: what `effects.caustics` adds.

    Attributes
    ----------
    irradiance : float64 array, shape (H, W)
        On the cells of `picture.size`, from above: 1 is what the source would send there, were there neither lenses nor
        a film that lets only its own cone of light through; 0 where none of the cone gets to. With `effects.dispersion`
        it has an axis of wavelengths in front. Of light that is coloured by absorption it is the luminance, or what
        is left of the wavelength's own light.
    rgb : float64 array, shape (H, W, 3), or None
        The irradiance of red, green and blue, linear, where `absorption` is compiled in; else all are the same. With
        `effects.dispersion` it has an axis of wavelengths in front: the three along the ways of each.
    bright : BrightCells
        The irradiance of the parts of cells in which it exceeds 1 and varies.
    flux : float
        Light of the cone through the film: its solid angle in steradian, or for parallel light its area across.
    shares : mapping of str to float
        Where that light goes, which sums to 1: the statuses in lower case, and what is "reflected" and "absorbed" on
        the way where `fresnel` and `absorption` are compiled in. The light that gets to its end counts by the status
        of its rays; of several wavelengths it is the mean.
    cut : int
        Film pixels that were cut into smaller tubes, for the map is torn, folded or bent there, or a lens's outline may
        lie there; the sum over wavelengths.
    not_excluded : float
        Which part of the light may go elsewhere than `shares` say, at most: what passes so near a lens's outline that
        bounds do not exclude a part of a lens which no ray has met, and `bent`. Of several wavelengths the mean.
    bent : float
        Which part of the light has been bent by a lens and may meet another surface then: of that no bounds say where
        it goes, only the rays at the corners of tubes. 0 where there is but one lens, and that is convex or opaque.
    """

    irradiance: NDArray[np.float64] = field(repr=False)
    rgb: NDArray[np.float64] | None = field(repr=False)
    bright: BrightCells = field(repr=False)
    flux: float
    shares: Mapping[str, float]
    cut: int
    not_excluded: float
    bent: float


@dataclass(frozen=True, kw_only=True, eq=False)
class RayMap(_Rays):
    """Where the ray of every film pixel lands; arrays of shape (rows, columns, ...).

    `origin` and `direction` are traced when they are first read; `trace_seconds` does not count that. `samples` has the
    further rays of `effects.antialias`, a `Samples`, else None. `caustic` is the light on the picture with
    `effects.caustics`, a `Caustic`, else None. `trace_seconds` and `escalated` count both. `legs` is the function that
    traces the last legs of a map.
    """

    __doc__ = f"{cleandoc(__doc__)}\n\n{cleandoc(str(_Rays.__doc__))}"

    legs: Callable[[RayMap], tuple[NDArray[Any], NDArray[Any]]] = field(repr=False, compare=False)
    samples: Samples | None = field(default=None, repr=False)
    caustic: Caustic | None = field(default=None, repr=False)

    @property
    def irradiance(self) -> NDArray[np.float64]:
        """The light on the picture, shape (H, W): that of its `caustic`."""
        if self.caustic is None:
            raise AttributeError("irradiance")  # what to do is said by __getattr__, which is asked next
        return self.caustic.irradiance

    @property
    def origin(self) -> NDArray[Any]:
        """Where the last straight leg starts."""
        return self._legs[0]

    @property
    def direction(self) -> NDArray[Any]:
        """Its unit direction."""
        return self._legs[1]

    def layers(self) -> tuple[RayMap, ...]:
        """Return the map of each wavelength as one without that axis; itself, alone, where it has none.

        The scene of each is in light of its wavelength, `Scene.at_wavelength`, and none has a `caustic`. Each has its
        share of the seconds, and counts in `escalated` the rays of all.
        """
        if "wavelengths" not in self.added:
            return (self,)
        scenes = self.scene.layers()
        return tuple(self._layer(number, scene) for number, scene in enumerate(scenes))

    def _layer(self, number: int, scene: Scene) -> RayMap:
        return replace(
            self,
            st=self.st[number],
            status=self.status[number],
            events=self.events[number],
            scene=scene,
            trace_seconds=self.trace_seconds / len(self.status),
            added=Frozen({name: array[number] for name, array in self.added.items() if name != "wavelengths"}),
            samples=None if self.samples is None else self.samples.layer(number),
            caustic=None,
            legs=_LegsOfLayer(self, number),
        )

    @cached_property
    def _legs(self) -> tuple[NDArray[Any], NDArray[Any]]:
        return self.legs(self)


@dataclass(frozen=True)
class _LegsOfLayer:
    """Where the legs of one wavelength are: in the map of all of them."""

    whole: RayMap
    number: int

    def __call__(self, layer: RayMap) -> tuple[NDArray[Any], NDArray[Any]]:
        return self.whole.origin[self.number], self.whole.direction[self.number]


@dataclass(frozen=True, kw_only=True, eq=False)
class RayPaths(_Rays):
    """Where given rays land; arrays of shape (N, ...)."""

    __doc__ = f"{cleandoc(__doc__)}\n\n{cleandoc(str(_Rays.__doc__))}"

    origin: NDArray[Any] = field(repr=False)
    direction: NDArray[Any] = field(repr=False)
