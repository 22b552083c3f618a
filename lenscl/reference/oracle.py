"""Certified answers: where a ray of a scene lands, with a radius that is proved, or why that cannot be told.

Input: a scene, whose numbers and rays are taken as exact. Output: a `Proof` a ray. Every number on the way is a ball of
python-flint; the bits are doubled until the answer is as narrow as asked. No step is shared with the kernels or with
the float64 twin but the expression of the surface, and that is evaluated by rules of its own, in `jets`.

Needs python-flint, from the extra `accuracy`. Its working precision is one for the process: ask from one thread.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import TYPE_CHECKING, Any

import numpy as np

from lenscl.config import Scene
from lenscl.errors import LensclError
from lenscl.reference.crossing import UndecidableError
from lenscl.reference.jets import contains_zero
from lenscl.reference.landing import Plane
from lenscl.reference.library import python_flint
from lenscl.reference.near import balls, near_line
from lenscl.reference.placed import PlacedLenses
from lenscl.reference.stops import picture_stops
from lenscl.reference.touching import Met
from lenscl.reference.vectors import dot, minus, plus, times, unit, vector
from lenscl.status import RayStatus

if TYPE_CHECKING:
    from flint import arb

    from lenscl.reference.vectors import Vector

# From the numbers of a ray and of an event, from 0: how the point is moved where the surface's normal is taken, in
# scene units, and what is added to the unit direction behind it
Shake = Callable[[int, int], tuple[Sequence[float], Sequence[float]]]
_ShakeOfRay = Callable[[int], tuple[Sequence[float], Sequence[float]]]

RADIUS = 1e-20  # picture coordinates; a hundred thousandth of the last bit of a double
MOST_BITS = 2048
TOO_LONG = "certified answers of so many rays would take too long"
_FIRST_BITS = 128
_BEYOND = 1.0 + 1e-6  # times a length in double precision, so that it is no shorter
_NORMAL = 2.0**-20  # a unit normal that is known less well is that of an edge, where both sides' are enclosed


@dataclass(frozen=True, slots=True, kw_only=True)
class Proof:
    """What is proved of one ray.

    Attributes
    ----------
    status : RayStatus or None
        None where no number of bits tells: `reason` says why.
    events : int
        Surfaces met, as far as that is proved.
    st : (arb, arb) or None
        Balls about the picture coordinates, None where the plane is not met.
    radius : float
        The larger of their radii, rounded up; 0 where there are none.
    bits : int
        That it took.
    reason : str
        Why the ray is undecidable; else empty.
    lengths : tuple of arb
        How far the ray travelled in each lens that was the medium, in their order, and last around all lenses: up to
        where it landed, or to its last event. Empty where nothing is proved.
    looks : int
        At F along the ray that it took, all numbers of bits together: a measure of time that no clock tells.
    """

    status: RayStatus | None
    events: int
    st: tuple[arb, arb] | None
    radius: float
    bits: int
    reason: str = ""
    lengths: tuple[arb, ...] = ()
    looks: int = 0

    def distance(self, s: float, t: float) -> float:
        """Return an upper bound on how far computed coordinates are from the exact ones, the larger of the two."""
        from flint import arb

        if self.st is None:
            raise LensclError("this ray has no place on the picture's plane")
        return max(float(abs(arb(x) - ball).upper()) for x, ball in zip((s, t), self.st, strict=True))


def prove_pixels(
    scene: Scene,
    pixels: Iterable[int],
    radius: float = RADIUS,
    most_bits: int = MOST_BITS,
    shake: Shake | None = None,
    most_looks: int | None = None,
) -> list[Proof]:
    """Prove the rays of film pixels, numbered row by row, through their exact centres; see `prove_rays`."""
    rows = [divmod(int(pixel), scene.film.columns) for pixel in pixels]
    return _proofs(scene, _film_ray, rows, radius, most_bits, shake, most_looks)


def prove_rays(
    scene: Scene,
    origins: Iterable[Sequence[float]],
    directions: Iterable[Sequence[float]],
    radius: float = RADIUS,
    most_bits: int = MOST_BITS,
    shake: Shake | None = None,
    most_looks: int | None = None,
) -> list[Proof]:
    """Prove where rays land.

    Parameters
    ----------
    scene : Scene
        Snell's law is taken as exact, whatever `numerics.snell` says; method and precision do not matter.
    origins, directions : sequences of three numbers, one a ray
        Taken as exact; directions of any length.
    radius : float
        The largest radius of a coordinate that will do; where the bits do not reach it, the answer has a larger one.
    most_bits : int
        Beyond which a ray that cannot be told is undecidable.
    shake : callable, optional
        From the numbers of a ray and of an event, from 0, to a vector in the world that moves the point where the
        surface's normal is taken, in scene units, and to one that is added to the unit direction behind it. It shows
        what becomes of a ray whose points and directions are rounded.

    Returns
    -------
    list of Proof

    Raises
    ------
    LensclError
        If python-flint is missing or broken, or a ray is not three finite numbers each and a direction that is not
        zero; the message names the first such ray.
    """
    rays = list(zip(origins, directions, strict=True))
    for number, (origin, direction) in enumerate(rays):
        for name, numbers in (("origins", origin), ("directions", direction)):
            if len(numbers) != 3 or not all(math.isfinite(x) for x in numbers):
                raise LensclError(f"{name}[{number}]: expected three finite numbers, got {list(numbers)}")
        if not any(direction):
            raise LensclError(f"directions[{number}]: a direction must not be zero")
    return _proofs(scene, _given_ray, rays, radius, most_bits, shake, most_looks)


def _proofs(
    scene: Scene,
    ray: Any,
    rays: Sequence[Any],
    radius: float,
    most_bits: int,
    shake: Shake | None,
    most_looks: int | None,
) -> list[Proof]:
    proofs: list[Proof] = []
    left = math.inf if most_looks is None else most_looks
    for number, which in enumerate(rays):
        if left > 0:
            proofs.append(_proof(scene, ray, which, radius, most_bits, _of_ray(shake, number), left))
            left -= proofs[-1].looks
        else:
            proofs.append(Proof(status=None, events=0, st=None, radius=0.0, bits=0, reason=TOO_LONG))
    return proofs


def _of_ray(shake: Shake | None, ray: int) -> _ShakeOfRay | None:
    return None if shake is None else lambda event: shake(ray, event)


def _proof(
    scene: Scene,
    ray: Any,
    which: Any,
    radius: float,
    most_bits: int,
    shake: _ShakeOfRay | None,
    most_looks: float,
) -> Proof:
    ctx = python_flint().ctx
    bits, looks = _FIRST_BITS, 0
    while True:
        with ctx.workprec(bits):
            path = _Path(scene, bits, shake)
            try:
                path.start(*ray(scene, which))
                proof = path.followed()
            except UndecidableError as doubt:
                proof = path.doubtful(str(doubt))
        looks += path.lenses.looks
        if (proof.status is not None and proof.radius <= radius) or bits >= most_bits or looks >= most_looks:
            return replace(proof, looks=looks)
        bits *= 2


def _given_ray(_: Scene, which: Any) -> tuple[Vector, Vector]:
    origin, direction = which
    return vector(origin), unit(vector(direction))


def _film_ray(scene: Scene, which: Any) -> tuple[Vector, Vector]:
    from flint import arb, fmpq

    film, (row, column) = scene.film, which
    s, t = (arb(fmpq(2 * i + 1, 2 * n)) for i, n in ((column, film.columns), (row, film.rows)))
    target = plus(plus(vector(film.corner), times(s, vector(film.right))), times(t, vector(film.down)))
    if scene.source.kind == "parallel":
        # The lens events do not depend on where before the lenses a ray starts: any plane ahead of all will do
        direction = unit(vector(scene.source.direction or ()))
        return plus(target, times(-_behind(scene, target), direction)), direction
    origin = vector(scene.source.at or ())
    return origin, unit(minus(target, origin))


def _behind(scene: Scene, target: Vector) -> arb:
    """Return a length that takes a point back beyond every lens, film and picture, whatever the direction."""
    from flint import arb

    reach = arb(1)
    for screen in (scene.film, scene.picture):
        reach += sum(abs(dot(v, v)).sqrt() for v in map(vector, (screen.corner, screen.right, screen.down)))
    middles, radii = balls(scene.lenses)
    reach += float((np.linalg.norm(middles, axis=1) + radii).max()) * _BEYOND
    return (reach + dot(target, target).sqrt()).upper()


class _Path:
    """One ray at one number of bits."""

    def __init__(self, scene: Scene, bits: int, shake: _ShakeOfRay | None) -> None:
        self.scene, self.bits, self.shake = scene, bits, shake
        self.lenses = PlacedLenses(scene.lenses)
        self.events = 0
        self.lengths: dict[int | None, arb] = {}  # by the medium
        self.picture, self.is_screen = Plane(scene.picture), picture_stops(scene)
        self.inside: frozenset[int] = frozenset()  # numbers of the lenses whose solids it travels in
        self.on: frozenset[int] = frozenset()  # and of those on whose surfaces it starts, exactly

    def start(self, origin: Vector, direction: Vector) -> None:
        self.origin, self.direction = origin, direction
        for number in near_line(self.scene.lenses, origin, None):
            lens = self.lenses[number]
            local = lens.point_to_local(origin)
            if not lens.may_hold(local):
                continue
            at = lens.at(local)
            if at.value.is_zero():
                slope = dot(lens.normal(at.slopes), direction)
                if contains_zero(slope):
                    raise UndecidableError("the ray starts on a surface and along it")
                self.on |= {number}
                self.inside |= {number} if slope < 0 else set()
            elif contains_zero(at.value):
                raise UndecidableError("the ray starts on a surface, or beside it")
            elif at.value < 0:
                self.inside |= {number}

    def followed(self) -> Proof:
        """Follow the ray to its end."""
        while True:
            met = self._next_surfaces()
            if met is None or (self.is_screen and self.picture.ends(self.origin, self.direction, met)):
                return self._landed()
            behind = self.inside ^ met.lenses
            before, after = self._medium(self.inside), self._medium(behind)
            self._travels(met.t)
            if before == after:  # within one medium there is no event
                self.origin, self.on, self.inside = met.point, met.lenses, behind
                continue
            if self.events >= self.scene.numerics.max_events:
                return self._ended(RayStatus.TRAPPED)
            if self._is_mirrored(met, before, after):
                self._reflect(met)
                self._shake()
                continue
            if any(number is not None and self.scene.blocks(number) for number in (before, after)):
                self.events += 1
                return self._ended(RayStatus.BLOCKED)
            if not self._bent(met, before, after):
                return self._ended(RayStatus.TOTAL_REFLECTION)
            self._shake()

    def _shake(self) -> None:
        if self.shake is not None:
            self.direction = unit(plus(self.direction, vector(self.shake(self.events - 1)[1])))

    def _travels(self, far: arb) -> None:
        medium = self._medium(self.inside)
        self.lengths[medium] = self.lengths.get(medium, 0) + far

    def _medium(self, inside: frozenset[int]) -> int | None:
        """Return the lens that is the medium where some solids overlap; None around all lenses."""
        return max(inside, key=lambda number: (self.scene.lenses[number].priority, number), default=None)

    def _index(self, medium: int | None) -> float:
        return self.scene.n_medium if medium is None else self.scene.lenses[medium].n

    def _next_surfaces(self) -> Met | None:
        """Return what is met next: one surface, or those that are in contact there; None where there is none."""
        found: list[tuple[arb, int, Vector]] = []
        for number in near_line(self.scene.lenses, self.origin, self.direction):
            lens = self.lenses[number]
            place = lens.crossing(
                self.origin, self.direction, self.bits, departs=number in self.on, inside=number in self.inside
            )
            if place is not None:
                found.append((place[0], number, place[1]))
            elif number in self.inside:
                raise UndecidableError("the ray is inside a solid and meets no surface of it")
        if not found:
            return None
        nearest = reduce(lambda a, b: b if b[0] < a[0] else a, found)
        number, local = nearest[1:]
        lens, normal = self.lenses[number], self._normal(number, local)
        first = Met(
            frozenset({number}), number, nearest[0], lens.point_to_world(local), normal, lens.size, {number: local}
        )
        places = {
            other: its_local
            for t, other, its_local in found
            if other != number and first.touches(t, self._normal(other, its_local), self.direction)
        }
        return replace(first, lenses=first.lenses | places.keys(), places={**first.places, **places})

    def _normal(self, number: int, local: Vector) -> Vector:
        lens = self.lenses[number]
        if self.shake is not None:
            local = plus(local, lens.vector_to_local(vector(self.shake(self.events)[0])))
        return lens.normal(lens.at(local).slopes)

    def _is_mirrored(self, met: Met, before: int | None, after: int | None) -> bool:
        """Say whether a solid that is the medium before the surface or behind it has a mirrored face there."""
        open_edge = False
        for number in (before, after):
            if number is None or number not in met.lenses or not self.scene.lenses[number].mirror:
                continue
            side = 1 if self.scene.lenses[number].is_mirror else self.lenses[number].on_mirror(met.places[number])
            if side > 0:
                return True
            open_edge |= side == 0
        if open_edge:
            raise UndecidableError("the ray meets an edge between a mirrored face and another one")
        return False

    def _reflect(self, met: Met) -> None:
        """Reflect the ray on its side of a surface."""
        against, cosine = self._facing(met)
        self.origin, self.on = met.point, met.lenses
        self.events += 1
        self.direction = plus(self.direction, times(2 * cosine, against))

    def _facing(self, met: Met) -> tuple[Vector, arb]:
        """Return the unit normal of the surface against the ray, and the cosine of incidence."""
        from flint import arb

        against = unit(times(arb(-1) if met.nearest in self.inside else arb(1), met.normal))
        cosine = -dot(self.direction, against)
        if not all(each.rad() < _NORMAL for each in against):
            raise UndecidableError(
                "the ray meets an edge of the surface, or a crease of F, where its normal is not known"
            )
        if not cosine > 0:
            raise UndecidableError("the ray grazes the surface")
        return against, cosine

    def _bent(self, met: Met, before: int | None, after: int | None) -> bool:
        """Go through the surface between two media; False where the ray ends in total reflection."""
        from flint import arb

        n_before, n_after = self._index(before), self._index(after)
        eta = arb(n_before) / arb(n_after)
        against, cosine = self._facing(met)
        self.origin, self.on = met.point, met.lenses
        self.events += 1
        behind = 1 - eta**2 * (1 - cosine**2)
        if n_before == n_after:
            self.inside ^= met.lenses
        elif behind > 0:
            turned = times(eta * cosine - behind.sqrt(), against)
            self.direction = plus(times(eta, self.direction), turned)
            self.inside ^= met.lenses
        elif behind < 0:
            if self.scene.effects.total_reflection == "end":
                return False
            self.direction = plus(self.direction, times(2 * cosine, against))
        else:
            raise UndecidableError("the ray meets the surface at the critical angle")
        return True

    def _landed(self) -> Proof:
        place = self.picture.place(self.origin, self.direction)
        if place is None:
            return self._ended(RayStatus.BEHIND)
        if contains_zero(place.distance):
            raise UndecidableError("the ray starts on the picture's plane")
        status = place.status
        if status is RayStatus.BEHIND:
            return self._ended(status)
        self._travels(place.distance)
        proof = Proof(
            status=status,
            events=self.events,
            st=(place.s, place.t),
            radius=place.radius,
            bits=self.bits,
            lengths=self._lengths_by_medium(),
        )
        return proof if status is not None else replace(proof, reason="the ray lands on an edge of the picture")

    def _lengths_by_medium(self) -> tuple[arb, ...]:
        from flint import arb

        return tuple(self.lengths.get(medium, arb(0)) for medium in (*range(len(self.scene.lenses)), None))

    def _ended(self, status: RayStatus) -> Proof:
        return Proof(
            status=status, events=self.events, st=None, radius=0.0, bits=self.bits, lengths=self._lengths_by_medium()
        )

    def doubtful(self, reason: str) -> Proof:
        """Return that the ray cannot be told at this number of bits."""
        return Proof(status=None, events=self.events, st=None, radius=0.0, bits=self.bits, reason=reason)
