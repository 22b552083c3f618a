"""One ray's path as plain values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from lenscl.status import RayStatus

Vec3 = tuple[float, float, float]
Kind = Literal["entry", "exit", "cemented", "total reflection", "mirror"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """A ray meeting a surface. Lengths are in scene units; None stands for what is not known.

    Attributes
    ----------
    number : int
        Counted from 1.
    kind : str
        "entry" to the lens, "exit" from it, "cemented" where its surface is that of the next lens, too,
        "total reflection", or "mirror".
    face : str or None
        The name of the mirrored face that reflects the ray; None where no mirror does.
    lens : str
        Whose surface it is, as the study's keys call it: "lens", "lens.NAME", or "lens 2" where it has no name. Of two
        in contact it is the one that the ray comes from.
    before, after : str or None
        The lenses whose media are before the surface and behind it, be it that the ray gets there or is reflected;
        None for what is around all lenses.
    n_before, n_after : float
        Refractive indices of these media.
    point : Vec3
        World.
    leg : float
        Length of the way here, from the start or the point before.
    bracket : (float, float) or None
        Along the ray, from `point`: F is proved to have opposite signs at these two places, in float64 by interval
        arithmetic, so that the surface is met between them. None where no such places are found.
    residual, allowed : float or None
        F at `point`, in double; and how large it may be, by the rounding of F and of the point in the precision traced.
    normal : Vec3 or None
        World, unit, outward; None where the gradient leaves too little to tell it.
    turn : float or None
        How far the normal may be turned by rounding, radians.
    incidence, behind : float or None
        Degrees between the normal and the ray before and behind the surface.
    k, k_bound : float or None
        `c^2 + (1 - eta)(1 + eta) s^2` of the cosine c and the sine s of incidence, eta the ratio of indices: below 0
        there is no refracted ray. And how far rounding may be off it.
    margin : float or None
        Degrees of incidence that are left to the critical angle, negative beyond; None where there is none, the ray
        going to an index as high or higher.
    growth : float or None
        By how much a relative change of the ray's start grows up to `point`: see `RayPath`.
    effects : mapping
        What the scene's effects have made of the ray behind the surface, by the names of a map's arrays: a number, or a
        list of them.
    """

    number: int
    kind: Kind
    face: str | None
    lens: str
    before: str | None
    after: str | None
    n_before: float
    n_after: float
    point: Vec3
    leg: float
    bracket: tuple[float, float] | None
    residual: float | None
    allowed: float | None
    normal: Vec3 | None
    turn: float | None
    incidence: float | None
    behind: float | None
    k: float | None
    k_bound: float | None
    margin: float | None
    growth: float | None
    effects: Mapping[str, Any]

    def as_json(self) -> dict[str, Any]:
        """Return it as a plain dictionary."""
        return {name: getattr(self, name) for name in self.__slots__}


@dataclass(frozen=True, slots=True, kw_only=True)
class Proved:
    """What the certified oracle says of the same ray, by Snell's exact law.

    Attributes
    ----------
    status : RayStatus or None
        None where nobody can tell: `reason` says why.
    events : int
    distance : float or None
        An upper bound on how far the traced place is from the proved one, in picture coordinates, the larger of the
        two; None where either has no place.
    bits : int
        That the proof took.
    reason : str
    """

    status: RayStatus | None
    events: int
    distance: float | None
    bits: int
    reason: str

    def as_json(self) -> dict[str, Any]:
        """Return it as a plain dictionary."""
        values = {name: getattr(self, name) for name in self.__slots__}
        return values | {"status": None if self.status is None else self.status.name}


@dataclass(frozen=True, slots=True, kw_only=True)
class RayPath:
    """The path of a film pixel's ray. Lengths are in scene units; None stands for what is not known, or is not there.

    Growth is a condition number: a change e of the ray's four numbers, its start moved across by a times `reach` and
    its direction turned by b radians, e^2 = a^2 + b^2, moves a point by up to growth times e times `reach`, and (s, t)
    by up to growth times e. It is a derivative: the largest singular value over all such changes.

    Attributes
    ----------
    row, column : int
        The film pixel, from 0.
    film, picture : (int, int)
        Their sizes, columns and rows.
    searches : tuple of str
        The method that searches each lens.
    precision, snell : str
        Of the trace shown.
    asked : str
        The precision that the scene asks for. Where it leaves the ray undecided, a finer one is shown, as in a map.
    device : str
    start, direction : Vec3
        World; the direction unit.
    inside : str or None
        The lens whose medium the start lies in.
    solids : tuple of str
        All lenses whose solids it lies in, lowest priority first.
    reach : float
        The largest coordinate of the lenses and the start.
    events : tuple of Event
    status : RayStatus
    total : int
        Events in all; more than are shown where the last resort decided the ray.
    last_resort : bool
        Whether only what searches in twice the precision of double decided it: of that, no events are shown.
    last : float or None
        Length of the last leg, up to the picture's plane.
    st : (float, float) or None
        Where it lands, in picture coordinates.
    pixel : (int, int) or None
        Row and column of the picture.
    error : float or None
        A bound on max(|ds|, |dt|), validated, not proved: see `lenscl.accuracy.bounds`. None where rounding may decide
        the path, or there is no place.
    growth : float or None
        Up to (s, t).
    effects : mapping
        What the scene's effects add to the map at this pixel, as in `Event`.
    proof : Proved or None
        None where python-flint is missing or broken: `lenscl.reference.flint_trouble` says which.
    """

    row: int
    column: int
    film: tuple[int, int]
    picture: tuple[int, int]
    searches: tuple[str, ...]
    precision: str
    snell: str
    asked: str
    device: str
    start: Vec3
    direction: Vec3
    inside: str | None
    solids: tuple[str, ...]
    reach: float
    events: tuple[Event, ...]
    status: RayStatus
    total: int
    last_resort: bool
    last: float | None
    st: tuple[float, float] | None
    pixel: tuple[int, int] | None
    error: float | None
    growth: float | None
    effects: Mapping[str, Any]
    proof: Proved | None

    def as_json(self) -> dict[str, Any]:
        """Return it as a plain dictionary."""
        values = {name: getattr(self, name) for name in self.__slots__}
        return values | {
            "status": self.status.name,
            "events": [event.as_json() for event in self.events],
            "proof": None if self.proof is None else self.proof.as_json(),
        }
