"""Where rays of a film should end: by certified answers, or by a trace that is known to be far better."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
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
    radius : float
        The coordinates are right to so much, the worst of all.
    against : str
        What says so, for people.
    """

    pixels: NDArray[np.intp] = field(repr=False)
    st: Array = field(repr=False)
    rest: Array = field(repr=False)
    status: NDArray[np.uint8] = field(repr=False)
    events: NDArray[np.uint8] = field(repr=False)
    is_known: NDArray[np.bool_] = field(repr=False)
    radius: float
    against: str

    @classmethod
    def certified(cls, scene: Scene, pixels: NDArray[np.intp]) -> Self:
        """Prove the rays of some pixels, a few milliseconds each; see `lenscl.reference.oracle`.

        Raises
        ------
        LensclError
            If python-flint is missing.
        """
        proofs = oracle.prove_pixels(scene, pixels.tolist())
        st, rest = np.full((len(proofs), 2), -1.0), np.zeros((len(proofs), 2))
        for number, proof in enumerate(proofs):
            if proof.st is not None:
                balls = [ball.mid() for ball in proof.st]
                st[number] = [float(middle) for middle in balls]
                rest[number] = [float(middle - float(middle)) for middle in balls]
        known = [proof.status is not None for proof in proofs]
        return cls(
            pixels=pixels,
            st=st,
            rest=rest,
            status=np.array([RayStatus.UNDECIDED if p.status is None else p.status for p in proofs], np.uint8),
            events=np.array([proof.events for proof in proofs], np.uint8),
            is_known=np.array(known, np.bool_),
            radius=max((proof.radius for proof, is_known in zip(proofs, known, strict=True) if is_known), default=0.0),
            against=CERTIFIED,
        )

    @classmethod
    def traced(cls, raymap: RayMap, radius: float, pixels: NDArray[np.intp] | None = None) -> Self:
        """Take a map's own ends for true; `radius` is what its coordinates are right to."""
        every = np.arange(raymap.status.size) if pixels is None else pixels
        numerics = raymap.scene.numerics
        st = raymap.st.reshape(-1, 2)[every].astype(np.float64)
        return cls(
            pixels=every,
            st=st,
            rest=np.zeros_like(st),
            status=raymap.status.ravel()[every],
            events=raymap.events.ravel()[every],
            is_known=raymap.status.ravel()[every] != RayStatus.UNDECIDED,
            radius=radius,
            against=f"{numerics.method}, {numerics.precision}",
        )
