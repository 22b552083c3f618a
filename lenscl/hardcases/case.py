"""What a hard case is: a scene, rays, what is true of them, and why they are hard."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Level = Literal["double", "single"]

LEVELS: tuple[Level, ...] = ("double", "single")
ULPS = 16  # of every number of a problem: an answer is right where so much of a change explains it
ROUNDING: dict[Level, float] = {"double": 2.0**-53, "single": 2.0**-24}  # one half of an ulp of 1: of one rounding


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """A scene with rays, or one that has to be refused.

    Attributes
    ----------
    name, family, why : str
        What it is called, the kind of difficulty, and what is hard about it, in a sentence.
    scene : str
        As a study file has it.
    origins, directions : float64 array, shape (N, 3), or None
        The rays, taken as exact; None for those of the scene's film.
    is_exact : bool
        Rounding is no excuse: every number on the way is exact, or the answer is the same beside the ray.
    lacks_values : bool array, shape (N,), or None
        Rays on whose way within the bounds F is larger than any double: they may be undecided. None where it is none.
    starts_exactly : bool
        The rays start on a surface, or an ulp beside it: where they start, and the lens, are not moved to see what
        rounding may do.
    keeps_contact : bool
        Solids are in contact, or nearly: lenses are not moved to see what rounding may do, for that would part them.
    counts_from : (float, float, float), optional
        The point of a surface that the rays count as starting from: rounding does not tell their own from it.
    equals : str
        The case whose answers have to be the same, bit for bit; empty where there is none.
    refused : str
        The key that the refusal of the scene leads with; empty for scenes that are fine.
    edition : int
        Of the pack in which the case came: what it counts for stands apart, so that editions can be compared.
    proved_as : str
        The scene that the answers are proved on, where it is not the case's own: one of the same solids, whose F the
        oracle can follow where the case's own has an infinite slope, a multiple root or no finite value.
    has_gaps : bool
        F has no value, or jumps, on some of the rays' way. Those of which neither the oracle nor any move tells how
        they end must be left undecided: any answer is a guess.
    counts_lengths : bool
        The rays are those of a film, and the scene counts path length, or absorbs: what is counted is judged, too.
    """

    name: str
    family: str
    why: str
    scene: str = field(repr=False)
    origins: Array | None = field(default=None, repr=False)
    directions: Array | None = field(default=None, repr=False)
    is_exact: bool = False
    lacks_values: NDArray[np.bool_] | None = field(default=None, repr=False)
    starts_exactly: bool = False
    keeps_contact: bool = False
    counts_from: tuple[float, float, float] | None = None
    equals: str = ""
    refused: str = ""
    edition: int = 1
    proved_as: str = ""
    has_gaps: bool = False
    counts_lengths: bool = False

    @property
    def key(self) -> str:
        """What the answers hang on: equal keys have the same."""
        parts = [self.name, self.scene, str(self.starts_exactly), str(self.counts_from)]
        parts += [self.proved_as] if self.proved_as else []
        parts += ["keeps contact"] if self.keeps_contact else []
        parts += ["counts lengths"] if self.counts_lengths else []
        digest = hashlib.sha256("\n".join(parts).encode())
        for array in (self.origins, self.directions):
            digest.update(b"" if array is None else np.ascontiguousarray(array).tobytes())
        return digest.hexdigest()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Answers:
    """How N rays end.

    Attributes
    ----------
    status, events : uint8 array, shape (N,)
        UNDECIDED where nobody can tell: an exact tangent, an edge, the critical angle.
    st : float64 array, shape (N, 2)
        Picture coordinates, the nearest numbers; (-1, -1) where the ray has no place.
    """

    status: NDArray[np.uint8]
    events: NDArray[np.uint8]
    st: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Moved:
    """What becomes of a case's answers where every number of its problem is moved by `ULPS` roundings of a precision.

    The numbers are those of the ray and of the scene, the points where normals are taken and the directions behind
    them: they are rounded, too.

    Attributes
    ----------
    spread : float64 array, shape (N,)
        The largest change of s or t, of what ends alike; divided by the size of the move it is the ray's condition
        number. 0 where no move ends alike.
    is_stable : bool array, shape (N,)
        Whether all moves leave status and events as they are.
    beside : Answers
        Those of all moves of the rays that are not stable, M in all.
    ray : int array, shape (M,)
        Whose they are.
    length_spread : float64 array, shape (N, L + 1), or None
        The largest changes of `Expected.lengths`, of what ends alike.
    """

    spread: Array
    is_stable: NDArray[np.bool_]
    beside: Answers
    ray: NDArray[np.int32]
    length_spread: Array | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Expected:
    """What is true of a case's rays, and how firmly.

    Attributes
    ----------
    answers : Answers
    moved : dict of Level to Moved
    reasons : uint8 array, shape (N,), or None
        Numbers in `REASONS`: why the oracle does not decide a ray, or one of its moves by roundings of double; 0 where
        it decides all. None where nothing is known of it.
    lengths : float64 array, shape (N, L + 1), or None
        How far each ray travels in each of L lenses where that is the medium, and last around all lenses, up to where
        it lands. None where the scene counts neither path length nor absorption.
    """

    answers: Answers
    moved: dict[Level, Moved]
    reasons: NDArray[np.uint8] | None = None
    lengths: Array | None = None
