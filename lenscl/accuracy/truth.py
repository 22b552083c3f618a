"""Where rays should end: by certified answers, or by a trace that is known to be far better.

The rays are those of a film's pixels, or given ones; either are told apart by their numbers.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Self

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.bounds import Places, pixel_bounds, place_bounds
from lenscl.accuracy.combination import Combination
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.reference import oracle
from lenscl.status import RayStatus
from lenscl.tracing import RayMap

Array = NDArray[np.float64]

CERTIFIED = "certified answers"
# How a scene is traced plays no part: what is proved of it serves all ways
_AS_ONE = Combination(method="auto", step=0.01, tolerance=1e-6)
_REMEMBERED = 4  # scenes, of each of which some thousand rays are proved


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Truth:
    """The ends that some rays of a film have.

    Attributes
    ----------
    pixels : int array, shape (N,)
        Which rays: numbers of pixels, row by row, or of given rays.
    st, rest : float64 arrays, shape (N, 2)
        Picture coordinates, as a double and what that leaves off; (-1, -1) and 0 where the plane is not met.
    status, events : uint8 arrays, shape (N,)
    is_known : bool array, shape (N,)
        False where this truth cannot tell.
    is_undecidable : bool array, shape (N,)
        Where nobody can tell, by certified answers: an exact tangent, an edge, the critical angle.
    radius : float64 array, shape (N,)
        The coordinates are right to so much; it is added to every error.
    against : str
        What says so, for people.
    doubt : str
        Why certified answers cannot tell the most of those that they cannot; empty where there are none.
    """

    pixels: NDArray[np.intp] = field(repr=False)
    st: Array = field(repr=False)
    rest: Array = field(repr=False)
    status: NDArray[np.uint8] = field(repr=False)
    events: NDArray[np.uint8] = field(repr=False)
    is_known: NDArray[np.bool_] = field(repr=False)
    is_undecidable: NDArray[np.bool_] = field(repr=False)
    radius: Array = field(repr=False)
    against: str
    doubt: str = ""

    @classmethod
    def certified(cls, scene: Scene, pixels: NDArray[np.intp], most_looks: int | None = None) -> Self:
        """Prove the rays of some pixels, a few milliseconds each; see `lenscl.reference.oracle`.

        What was proved of a scene lately is remembered, ray by ray. `most_looks` is as for `oracle.prove_rays`.

        Raises
        ------
        LensclError
            If python-flint is missing or broken.
        """
        kept = _proofs(_AS_ONE.of(scene))
        missing = [number for number in pixels.tolist() if number not in kept]
        made = dict(zip(missing, oracle.prove_pixels(scene, missing, most_looks=most_looks), strict=True))
        kept.update({number: proof for number, proof in made.items() if proof.reason != oracle.TOO_LONG})
        return cls._of_proofs(pixels, [made[number] if number in made else kept[number] for number in pixels.tolist()])

    @classmethod
    def certified_rays(
        cls,
        scene: Scene,
        origins: Array,
        directions: Array,
        numbers: NDArray[np.intp],
        most_looks: int | None = None,
    ) -> Self:
        """Prove some of given rays; `most_looks` and errors as for `certified`."""
        origins, directions = origins[numbers].tolist(), directions[numbers].tolist()
        return cls._of_proofs(numbers, oracle.prove_rays(scene, origins, directions, most_looks=most_looks))

    @classmethod
    def _of_proofs(cls, numbers: NDArray[np.intp], proofs: Sequence[oracle.Proof]) -> Self:
        st, rest = np.full((len(proofs), 2), -1.0), np.zeros((len(proofs), 2))
        for number, proof in enumerate(proofs):
            if proof.st is not None:
                balls = [ball.mid() for ball in proof.st]
                st[number] = [float(middle) for middle in balls]
                rest[number] = [float(middle - float(middle)) for middle in balls]
        is_known = np.array([proof.status is not None for proof in proofs], np.bool_)
        doubts = Counter(proof.reason for proof in proofs if proof.status is None).most_common(1)
        return cls(
            pixels=numbers,
            st=st,
            rest=rest,
            status=np.array([RayStatus.UNDECIDED if p.status is None else p.status for p in proofs], np.uint8),
            events=np.array([proof.events for proof in proofs], np.uint8),
            is_known=is_known,
            is_undecidable=np.array(
                [proof.status is None and proof.reason != oracle.TOO_LONG for proof in proofs], bool
            ),
            radius=np.array([proof.radius for proof in proofs]),
            against=CERTIFIED,
            doubt=doubts[0][0] if doubts else "",
        )

    @classmethod
    def traced(cls, raymap: RayMap) -> Self:
        """Take the ends of a map for true; of what it leaves undecided, it says that nobody can tell."""
        st, numerics = raymap.st.reshape(-1, 2).astype(np.float64), raymap.scene.numerics
        is_known = raymap.status.ravel() != RayStatus.UNDECIDED
        return cls(
            pixels=np.arange(raymap.status.size),
            st=st,
            rest=np.zeros_like(st),
            status=raymap.status.ravel(),
            events=raymap.events.ravel(),
            is_known=is_known,
            is_undecidable=~is_known,
            radius=np.zeros(len(st)),
            against=f"{numerics.method}, {numerics.precision}",
        )

    @classmethod
    def bounded(cls, scene: Scene, pixels: NDArray[np.intp], device: Device) -> Self:
        """Trace some pixels in double precision, each with a bound on its error; see `lenscl.accuracy.bounds`."""
        return cls._of_places(pixels, pixel_bounds(scene, pixels, device=device))

    @classmethod
    def bounded_rays(
        cls, scene: Scene, origins: Array, directions: Array, numbers: NDArray[np.intp], device: Device
    ) -> Self:
        """Trace some of given rays in double precision, each with a bound on its error."""
        return cls._of_places(numbers, place_bounds(scene, origins[numbers], directions[numbers], device=device))

    @classmethod
    def _of_places(cls, numbers: NDArray[np.intp], places: Places) -> Self:
        lands = np.isin(places.status, [status for status in RayStatus if status.lands])
        return cls(
            pixels=numbers,
            st=places.st,
            rest=np.zeros_like(places.st),
            status=places.status,
            events=places.events,
            is_known=np.where(lands, places.bound >= 0, places.status != RayStatus.UNDECIDED),
            is_undecidable=np.zeros(len(numbers), np.bool_),
            radius=np.where(lands, np.maximum(places.bound, 0.0), 0.0),
            against="double precision and its error bounds",
        )

    def with_known(self, better: Self) -> Self:
        """Return the same with what another truth says of some of its rays in the place of its own."""
        _, here, there = np.intersect1d(self.pixels, better.pixels, return_indices=True)
        arrays = {}
        for name in ("st", "rest", "status", "events", "is_known", "is_undecidable", "radius"):
            arrays[name] = getattr(self, name).copy()
            arrays[name][here] = getattr(better, name)[there]
        return replace(self, **arrays, doubt=better.doubt)


@lru_cache(maxsize=_REMEMBERED)
def _proofs(_: Scene) -> dict[int, oracle.Proof]:
    """Return what is proved of the pixels of a scene, by their numbers, for more to be added."""
    return {}
