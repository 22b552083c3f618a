"""How a traced ray meets a surface: the face, its normal, the angles, and what is left to the critical angle."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lenscl.accuracy.selfcheck.hits import SAFETY, Hits

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bend:
    """A ray at a face whose normal is known; angles in degrees, the other numbers as in `Event`.

    Attributes
    ----------
    face : int
        Its number in `lenscl.codegen.faces_of`.
    normal, against : float64 array, shape (3,)
        Unit, outward; and turned against the ray.
    eta : float
        n_before / n_after, n_after being that of the other side.
    turns_back : bool
        Whether the ray stays on its side.
    """

    face: int
    normal: Array = field(repr=False)
    against: Array = field(repr=False)
    turn: float
    eta: float
    turns_back: bool
    incidence: float
    behind: float
    k: float
    k_bound: float
    margin: float | None


def bend_at(
    hits: Hits, ray: int, before: Array, after: Array, n_before: float, n_other: float, eps: float, *, leaves: bool,
    mirrors: bool = False,
) -> Bend | None:  # fmt: skip
    """Return how a ray bends at a surface point, None where no face has a normal that is known well enough.

    Parameters
    ----------
    hits : Hits
    ray : int
        Which of them.
    before, after : float64 array, shape (3,)
        Unit directions, world.
    n_before, n_other : float
        Indices on the incident side and the other one.
    eps : float
        Of the precision that the ray was carried in.
    leaves : bool
        Whether the ray comes from inside.
    mirrors : bool
        Whether a mirrored face reflects it.
    """
    known = np.flatnonzero(np.isfinite(hits.turn[ray]))
    if not known.size:
        return None

    # On an edge, take the face that best explains where the ray goes, refracted or reflected
    changes = [n_before * before - n * after for n in (n_before, n_other)]
    misses = [min(_sine(hits.normal[ray, face], change) for change in changes) for face in known]
    face = int(known[int(np.argmin(misses))])
    normal, turn = hits.normal[ray, face], float(hits.turn[ray, face])
    against = -normal if leaves else normal
    eta = n_before / n_other
    cosine, sine, onward = max(float(-before @ against), 0.0), _sine(before, against), float(after @ against)
    k = cosine * cosine + (1.0 - eta) * (1.0 + eta) * sine * sine
    return Bend(
        face=face,
        normal=normal,
        against=against,
        turn=turn,
        eta=eta,
        turns_back=mirrors or (eta > 1.0 and onward > 0.0),
        incidence=math.degrees(math.atan2(sine, cosine)),
        behind=math.degrees(math.atan2(_sine(after, against), abs(onward))),
        k=k,
        k_bound=SAFETY * eps * (1.0 + eta * eta) + 2.0 * eta * eta * turn,
        margin=None if mirrors else _margin(cosine, sine, eta, k),
    )


def _margin(cosine: float, sine: float, eta: float, k: float) -> float | None:
    """Return the critical angle less the angle of incidence, from k: their difference would cancel."""
    if eta <= 1.0:
        return None
    q = math.sqrt((eta - 1.0) * (eta + 1.0))
    return math.degrees(math.asin(max(-1.0, min(1.0, k / (eta * (cosine + q * sine))))))


def _sine(a: Array, b: Array) -> float:
    return float(np.linalg.norm(np.cross(a, b)))
