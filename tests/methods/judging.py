"""Judge what a search says of rays: companion matrices for all of them, certified isolation for what is left open."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from methods.hostile import Aim, Array, Rays
from numpy.typing import NDArray

from lenscl.config import Lens
from lenscl.expr import Expr
from lenscl.expr.graph import walk
from lenscl.reference import certified, companion, sign_polynomial

Mask = NDArray[np.bool_]
EPSILON = {"single": 2.0**-23, "double": 2.0**-52}
ROOM = 16.0  # roundings of F's terms on the ray: F at a root that is found is 0 but for so many; measured are 7.5
TOUCH = 256.0  # so many keep an undecided ray from a touch; the searches allow for up to 120, and for double roots


@dataclass(frozen=True, eq=False)
class Answers:
    """What a search says of N rays."""

    t: Array
    found: Mask
    undecided: Mask

    def some(self, which: Mask) -> Answers:
        """Return the answers of some rays."""
        return Answers(self.t[which], self.found[which], self.undecided[which])


@dataclass(eq=False)
class Judge:
    """Rays at one lens, and what is true of them.

    The rays travel outside it at first, or where `inside` says so within; `departs`: from its very surface. In single
    precision the rays are judged that are left of them when they are rounded.
    """

    lens: Lens
    given: Rays
    precision: str
    inside: Mask | bool = False
    departs: bool = False
    _proofs: dict[int, certified.Certified] = field(default_factory=dict)

    @cached_property
    def rays(self) -> Rays:
        """The rays that are judged."""
        return self.given.rounded() if self.precision == "single" else self.given

    @cached_property
    def side(self) -> NDArray[np.int8]:
        """The sign that F has along each ray at first, shape (N,)."""
        return np.where(np.broadcast_to(self.inside, len(self.rays.length)), -1, 1).astype(np.int8)

    @cached_property
    def values(self) -> dict[str, float]:
        """The lens's parameters in the precision that is judged."""
        dtype = {"single": np.float32, "double": np.float64}[self.precision]
        return {name: float(dtype(value)) for name, value in self.lens.values.items()}

    @cached_property
    def form(self) -> Expr:
        """What has the sign of F along a ray. For rays that depart the heart's own F, with a simple root everywhere."""
        surface = self.lens.surface
        found = surface.expression if self.departs and surface.name == "heart" else sign_polynomial(surface)
        assert found is not None
        return found

    @cached_property
    def judged(self) -> companion.Judged:
        """What companion matrices say of every ray."""
        rays = self.rays
        return companion.first_roots(
            self.form, self.values, rays.origin, rays.direction, rays.length, departs=self.departs
        )

    @cached_property
    def terms(self) -> Array:
        """How large F's terms get on each ray, shape (N,): what rounding is relative to."""
        reach = np.abs(self.rays.origin) + np.abs(self.rays.direction) * self.rays.length[:, None]
        return size_of_terms(self.lens.surface.expression, {**self.values, **dict(zip("xyz", reach.T, strict=True))})

    def proof(self, ray: int, shift: float = 0.0) -> certified.Certified:
        """Return what is certified of a ray, of F moved by a shift: a positive one shrinks the solid."""
        if shift == 0.0 and ray in self._proofs:
            return self._proofs[ray]
        surface = self.lens.surface
        form = self.form if shift == 0.0 else (surface.sign_polynomial(self.values) or surface.expression) + shift
        place = self.rays.origin[ray], self.rays.direction[ray], self.rays.length[ray]
        proof = certified.first_root(form, self.values, *place, departs=self.departs)
        if shift == 0.0:
            self._proofs[ray] = proof
        return proof

    def tolerance(self, ray: NDArray[np.intp], t: Array) -> Array:
        """Return how far from crossings at t the search may put them, shape (N,): what moves F by ROOM roundings."""
        point = self.rays.origin[ray] + t[:, None] * self.rays.direction[ray]
        slope = self._slopes(ray, t)
        with np.errstate(divide="ignore", invalid="ignore"):
            by_f = np.where(slope > 0.0, self.terms[ray] / slope, 0.0)
        step = np.linalg.norm(point, axis=1) + self.rays.length[ray]
        room: Array = ROOM * EPSILON[self.precision] * (by_f + step)
        return room

    def _slopes(self, ray: NDArray[np.intp], t: Array) -> Array:
        """Return |dF/dt|."""
        direction = self.rays.direction[ray]
        with np.errstate(all="ignore"):
            slopes = Aim(self.lens, 0).slopes(self.rays.origin[ray] + t[:, None] * direction)
            size: Array = np.abs(np.sum(slopes * direction, axis=1))
        return size

    def verdict(self, answers: Answers, certify: int, look: int = 20, seed: int = 0) -> Counter[str]:
        """Count what a search got right and wrong.

        Parameters
        ----------
        answers : Answers
            Of every ray.
        certify : int
            So many rays chosen at random are certified, beside all those that the companion matrices leave open or in
            which they differ from the search.
        look : int
            So many undecided rays are looked at, whether they all but touch.

        Returns
        -------
        Counter
            "missed", "invented" and "misplaced" events, "judges differ", and undecided rays that are "unreasoned" are
            faults. Beside them what was exercised; "elsewhere" are rays that prove not to travel where `inside` says.
        """
        judged, side, every = self.judged, self.side, np.arange(len(self.side))
        near = np.abs(answers.t - judged.t) <= judged.radius + self.tolerance(every, judged.t)
        known = ~judged.undecided & (judged.before == side)
        agrees = known & (answers.found == judged.found) & (~answers.found | near)
        elsewhere = ~judged.undecided & (judged.before != side)
        rng = np.random.default_rng(seed)
        opened = np.flatnonzero(~answers.undecided & ~agrees & ~elsewhere)
        chosen = rng.permutation(every)[:certify]
        counts = Counter(
            {
                "rays": len(every),
                "found": int(answers.found.sum()),
                "undecided": int((answers.undecided & ~self.rays.ordinary).sum()),
                "undecided, ordinary": int((answers.undecided & self.rays.ordinary).sum()),
                "opened": len(opened),
            }
        )
        for ray in {*opened.tolist(), *chosen.tolist()}:
            proof = self.proof(ray)
            counts["certified"] += 1
            counts["certified, crossed"] += proof.crossing is not None
            if not judged.undecided[ray]:
                counts["judges differ"] += judged.found[ray] != (proof.crossing is not None)
            if proof.start != side[ray]:
                counts["elsewhere"] += 1
            elif not answers.undecided[ray]:
                counts[self._settled(ray, proof.crossing, answers)] += 1
        for ray in rng.permutation(np.flatnonzero(answers.undecided))[:look]:
            counts["looked at"] += 1
            counts["unreasoned"] += not self.nearly_touches(int(ray))
        return counts

    def _settled(self, ray: int, crossing: certified.Root | None, answers: Answers) -> str:
        if crossing is None or not answers.found[ray]:
            return "invented" if answers.found[ray] else "right" if crossing is None else "missed"
        room = self.tolerance(np.array([ray]), np.array([float(crossing.t)]))[0]
        return "right" if crossing.distance(float(answers.t[ray])) <= room else "misplaced"

    def nearly_touches(self, ray: int, times: float = 1.0) -> bool:
        """Say whether F all but touches 0 on this ray, so that rounding, TOUCH times so many, may hide what it does.

        It does if the solid, grown and shrunk by that, is met differently; or if a root is all but a multiple one,
        where F's slope is no more than such a rounding and F's curvature can undo, or there is no slope.
        """
        terms = float(self.terms[ray])
        shift = TOUCH * EPSILON[self.precision] * terms * times
        proofs = [self.proof(ray, level) for level in (-shift, 0.0, shift)]
        if len({(each.start, sum(root.crosses for root in each.roots)) for each in proofs}) > 1:
            return True
        known = [0.0] if self.departs else []  # the root that is removed is a touch, too, where the ray departs along F
        roots = np.array([*known, *(float(root.t) for each in proofs for root in each.roots)])
        rise = self._slopes(np.full(len(roots), ray), roots) * self.rays.length[ray]
        return not (rise**2 > 16.0 * shift * terms).all()


def size_of_terms(expression: Expr, at: Mapping[str, Any]) -> Array:
    """Return the sum of an expression's terms, all taken as positive, at coordinates that are."""
    sizes: dict[Expr, Any] = {}
    for each in walk([expression]):
        parts = [sizes[arg] for arg in each.args]
        match each.op, parts:
            case "symbol", _:
                sizes[each] = np.abs(at[str(each.name)])
            case _ if each.value is not None:
                sizes[each] = abs(each.value)
            case (("+" | "-"), [u, v]):
                sizes[each] = u + v
            case "*", [u, v]:
                sizes[each] = u * v
            case "/", [u, v]:
                sizes[each] = u / v
            case "power", [u, n]:
                sizes[each] = u**n
            case (("min" | "max"), [u, v]):
                sizes[each] = np.maximum(u, v)
            case (("neg" | "abs"), [u]):
                sizes[each] = u
            case "cbrt", [u]:
                sizes[each] = np.cbrt(u)
            case op, _:
                raise ValueError(f"{op}: no rule")
    total: Array = sizes[expression]
    return total
