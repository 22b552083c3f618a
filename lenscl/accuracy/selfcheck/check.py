"""Check a ray map by itself: on a sample of its rays, what must hold of every path, whatever the lens.

Six laws are checked at every surface point of some 64 rays, or of rays that are given, followed through the device's
own kernels, and two more on their first and last legs:

    length    directions stay unit
    surface   |F| = 0 where a surface is met
    contact   faces of lenses in contact are one interface; a ray ends where the picture that stops it lies on a face
    snell     rays bend there by the scene's rule, and turn back only where there is no way through
    stop      rays end where an opaque lens is the medium before or behind it, unbent, and nowhere else
    return    sent back along each leg, a ray comes back the way it came; where it ended, it comes there again
    ahead     nothing lies in the way of a ray that has left the lenses: F is nowhere negative; nor on the way to the
              first surface, and to one where the ray ends; where solids may overlap no leg leaves its medium, and no
              leg goes through a picture that stops light
    place     it lands where its last leg meets the picture's plane

and one more that joins them to a map: the followed ray ends as the map says that its pixel did. Nothing is compared
with another program's answer. Where solids may touch or overlap the media before and behind a surface are those that
the signs of F and the priorities of the lenses make them, not what the kernel has kept count of.

Every residual is held against a bound of its own, made of the roundings that the precision makes unavoidable at that
very place, so 1 is the most that a healthy ray shows. Where no bound is known, nothing is compared, and nothing is
counted as checked.

Rays that the precision leaves undecided, and the map has decided in a finer one, are followed in that.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.selfcheck.findings import SelfCheck
from lenscl.accuracy.selfcheck.hits import Tolerance, hits_of
from lenscl.accuracy.selfcheck.paths import Paths
from lenscl.accuracy.selfcheck.sample import sampled
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.status import RayStatus
from lenscl.tracing import Ends, Follower, RayMap, film_rays

Array = NDArray[np.float64]
Pixels = NDArray[np.intp]

_BESIDE = (4.0, 16.0)  # roundings
_CORNERS = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])  # a tetrahedron's


def check_map(raymap: RayMap) -> SelfCheck:
    """Check a sample of a map's rays by laws that hold without any reference.

    Parameters
    ----------
    raymap : RayMap
        As traced. The rays are traced again on its device by its method, in its precision. Of several wavelengths each
        is checked, and a failure names its own.

    Raises
    ------
    BuildError, TraceError
        If the device refuses to trace them again.
    """
    checks = [_checked(layer) for layer in raymap.layers()]
    if "wavelengths" in raymap.added:
        checks = [check.at_wavelength(nm) for check, nm in zip(checks, raymap.wavelengths.tolist(), strict=True)]
    return sum(checks, SelfCheck())


def _checked(raymap: RayMap) -> SelfCheck:
    pixels = sampled(raymap.events, raymap.status == RayStatus.UNDECIDED)
    if raymap.kernel.structure.stops:  # those that the picture ends before any lens
        lands = ((raymap.status == RayStatus.PICTURE) & (raymap.events == 0)).astype(np.uint8)
        pixels = np.union1d(pixels, sampled(lands))
    if not pixels.size:
        return SelfCheck()
    goes = film_rays(raymap.scene, pixels)[1].any(axis=1)  # a pixel on the source sends no ray, and is undecided
    idle = len(pixels) - int(goes.sum())
    found = SelfCheck(rays=idle, untold=idle, unchecked={"undecided": idle} if idle else {})
    pixels, follower = pixels[goes], Follower(raymap.scene, raymap.device, "check")
    with np.errstate(all="ignore"):  # a broken ray may hold anything; what is no number is a failure, not a warning
        while pixels.size:
            check = _Check(raymap, pixels, follower)
            result, again = check.result(), check.decided_elsewhere
            finer = follower.finer() if again.size else None
            if finer is None:
                return found + result
            left = len(again)
            undecided = result.unchecked["undecided"] - left
            unchecked = {why: n for why, n in {**result.unchecked, "undecided": undecided}.items() if n}
            rest = replace(result, rays=result.rays - left, untold=result.untold - left, unchecked=unchecked)
            found, pixels, follower = found + rest, again, finer
    return found


def check_rays(scene: Scene, device: Device, origins: Array, vectors: Array) -> SelfCheck:
    """Check rays of the caller's own by the laws of paths; there is no map to hold their ends against.

    Parameters
    ----------
    scene : Scene
        With the method and the precision to follow them in.
    device : Device
        Where to trace.
    origins, vectors : float64 array, shape (N, 3)
        World, scene units; vectors of any length but 0.

    Returns
    -------
    SelfCheck
        A failure's ray is its column; of rays that meet nothing the last leg is checked.

    Raises
    ------
    BuildError, TraceError
        If the device refuses to trace them.
    """
    with np.errstate(all="ignore"):  # as in `check_map`
        return Paths(Follower(scene, device, "check"), device, origins, vectors).result()


class _Check(Paths):
    """One map's check at work."""

    def __init__(self, raymap: RayMap, pixels: Pixels, follower: Follower) -> None:
        super().__init__(follower, raymap.device, *film_rays(raymap.scene, pixels))
        self.raymap, self.pixels = raymap, pixels
        self.decided_elsewhere: Pixels = pixels[:0]  # undecided here, and decided in the map by a finer precision

    def _pixel(self, ray: int) -> tuple[int, int]:
        row, column = divmod(int(self.pixels[ray]), self.scene.film.columns)
        return row, column

    def _ends(self) -> Ends:
        """Follow the sample to its end; where a ray ends otherwise than the map says, ask rays beside it."""
        numerics = self.scene.numerics
        ends = super()._ends()
        status, events = (array.ravel()[self.pixels] for array in (self.raymap.status, self.raymap.events))
        self.decided_elsewhere = self.pixels[self.undecided & (status != RayStatus.UNDECIDED)]
        self.undecided |= status == RayStatus.UNDECIDED
        differs = np.flatnonzero(~self.undecided & ((ends.status != status) | (ends.events != events)))
        if self.may_lose:  # a rounding of a march's steps decides what it loses, beside the pixel as well as on it
            self.tally.unchecked["lost"] += len(differs)
        elif differs.size:
            beside = self._rays_beside(differs, ends)
            alike = np.ones(len(differs), dtype=np.bool_)
            for vectors in beside:
                other = self.follower.ends(self.origins[differs], vectors, numerics.max_events)
                alike &= (other.status == ends.status[differs]) & (other.events == ends.events[differs])
            self.tally.unchecked["borderline"] += int((~alike).sum())
            residual = np.maximum(np.abs(ends.events.astype(float) - events)[differs], 1.0)
            self.tally.note("map", differs, 0, residual, np.where(alike, 0.5, np.inf))
        return ends

    def _rays_beside(self, rays: Pixels, ends: Ends) -> list[Array]:
        """Return directions that are off by more than the rounding of the kernel's own film pixels, on all sides.

        Where the rounding of F displaces the first surface that is met, or the last one, by more, that counts.
        """
        vectors, origins = self.vectors[rays], self.origins[rays]
        size = np.abs(origins) + np.abs(origins + vectors)
        aside = self.eps * size.max(axis=1, keepdims=True)
        for at in (self.follower.ends(origins, vectors, 1).origin, ends.origin[rays]):
            hits = hits_of(self.scene, at, self.eps, Tolerance.of(self.scene, self.eps))
            shift = (hits.noise / hits.slope)[:, None]
            aside = np.maximum(aside, np.where(np.isfinite(shift), shift, 0.0))
        return [vectors + reach * aside * corner for reach in _BESIDE for corner in _CORNERS]
