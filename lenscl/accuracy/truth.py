"""Where rays of a film should end: by certified answers, or by a trace that is known to be far better."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.bounds import pixel_bounds
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.reference import oracle
from lenscl.status import RayStatus
from lenscl.tracing import RayMap

Array = NDArray[np.float64]

CERTIFIED = "certified answers"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Truth:
    """The ends that some rays of a film have.

    Attributes
    ----------
    pixels : int array, shape (N,)
        Which rays: numbers of pixels, row by row.
    st, rest : float64 arrays, shape (N, 2)
        Picture coordinates, as a double and what that leaves off; (-1, -1) and 0 where the plane is not met.
    status, events : uint8 arrays, shape (N,)
    is_known : bool array, shape (N,)
        False where nobody can tell: an exact tangent, an edge, the critical angle.
    radius : float64 array, shape (N,)
        The coordinates are right to so much; it is added to every error.
    against : str
        What says so, for people.
    """

    pixels: NDArray[np.intp] = field(repr=False)
    st: Array = field(repr=False)
    rest: Array = field(repr=False)
    status: NDArray[np.uint8] = field(repr=False)
    events: NDArray[np.uint8] = field(repr=False)
    is_known: NDArray[np.bool_] = field(repr=False)
    radius: Array = field(repr=False)
    against: str

    @classmethod
    def certified(cls, scene: Scene, pixels: NDArray[np.intp]) -> Self:
        """Prove the rays of some pixels, a few milliseconds each; see `lenscl.reference.oracle`.

        Raises
        ------
        LensclError
            If python-flint is missing or broken.
        """
        proofs = oracle.prove_pixels(scene, pixels.tolist())
        st, rest = np.full((len(proofs), 2), -1.0), np.zeros((len(proofs), 2))
        for number, proof in enumerate(proofs):
            if proof.st is not None:
                balls = [ball.mid() for ball in proof.st]
                st[number] = [float(middle) for middle in balls]
                rest[number] = [float(middle - float(middle)) for middle in balls]
        return cls(
            pixels=pixels,
            st=st,
            rest=rest,
            status=np.array([RayStatus.UNDECIDED if p.status is None else p.status for p in proofs], np.uint8),
            events=np.array([proof.events for proof in proofs], np.uint8),
            is_known=np.array([proof.status is not None for proof in proofs], np.bool_),
            radius=np.array([proof.radius for proof in proofs]),
            against=CERTIFIED,
        )

    @classmethod
    def traced(cls, raymap: RayMap) -> Self:
        """Take the ends of a map for true."""
        st, numerics = raymap.st.reshape(-1, 2).astype(np.float64), raymap.scene.numerics
        return cls(
            pixels=np.arange(raymap.status.size),
            st=st,
            rest=np.zeros_like(st),
            status=raymap.status.ravel(),
            events=raymap.events.ravel(),
            is_known=raymap.status.ravel() != RayStatus.UNDECIDED,
            radius=np.zeros(len(st)),
            against=f"{numerics.method}, {numerics.precision}",
        )

    @classmethod
    def bounded(cls, scene: Scene, pixels: NDArray[np.intp], device: Device) -> Self:
        """Trace some pixels in double precision, each with a bound on its error; see `lenscl.accuracy.bounds`."""
        places = pixel_bounds(scene, pixels, device=device)
        lands = np.isin(places.status, [status for status in RayStatus if status.lands])
        return cls(
            pixels=pixels,
            st=places.st,
            rest=np.zeros_like(places.st),
            status=places.status,
            events=places.events,
            is_known=np.where(lands, places.bound >= 0, places.status != RayStatus.UNDECIDED),
            radius=np.where(lands, np.maximum(places.bound, 0.0), 0.0),
            against="double precision and its error bounds",
        )
