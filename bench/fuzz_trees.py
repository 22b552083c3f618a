"""Trace random expression trees, and judge every first root by dense sampling of the text's own meaning.

    python bench/fuzz_trees.py [TREES [SEED]] [--from N] [--keep FILE] [--precision NAME]...

A tree of depth 5 of all operations, with poles and ends of domains anywhere, is cut by a ball, and rays are traced
through it as a null lens: so every event lies on the straight ray, and the ray tells where F crosses zero first, how
often, and where last. The judge has nothing in common with the program but the text (see `random_trees`): it samples F
along each ray, halves where signs differ, and looks at what seems wrong to many digits, at the place itself and at
those that rounding may make of it. A ray is wrong if it is decided and

    missed     F is below zero, beyond rounding, before the first event or after the last one
    invented   F has one sign, beyond rounding, all about an event

A tree that is wrong is printed with its rays; `--keep` writes a line of JSON for every tree, and goes on after the last
one that is there. The same trees attack what the oracle and the kernels have in common, the graph: its value, its
derivatives, its coefficients along a ray and its bounds, against mpmath (see `attack`).
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import time
import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
from flint import arb
from hard_cases import scenes
from random_trees import Array, by_balls, by_mpmath, by_numpy, tree

import lenscl
from lenscl import RayStatus, device
from lenscl.config import Scene
from lenscl.errors import ExpressionError, LensclError
from lenscl.expr import bounds, differentiate, evaluate, evaluate_with_error, parse, polynomial, symbol

PRECISIONS = ("double", "single", "mixed")
_BOX = 1.1
_BALL = "x^2 + y^2 + z^2 - 1"
_SAMPLES = 1500  # of a ray in the box
_ASTRAY = {"double": 2e-15, "single": 1e-6, "mixed": 1e-6}  # of a place, by rounding: of all numbers here of size 1
_NEAR = {"double": 1e-11, "single": 3e-5, "mixed": 1e-11}  # of an event's place, by all that rounds
_SINGLE = 4 * 2.0**29  # times what double precision loses: the kernels' operations come in another order
_PARTS = 500  # of the place of an event, at most, of which F is bounded
_PICTURE = {"corner": [-1000.0, 1000.0, -2000.0], "right": [2000.0, 0.0, 0.0], "down": [0.0, -2000.0, 0.0]}
_NUMERICS = {"max_events": 255, "method": "interval"}


@dataclass(frozen=True)
class Tree:
    """A tree with rays through it: origins and unit directions, shape (N, 3)."""

    number: int
    text: str
    origin: Array
    direction: Array


@dataclass
class Verdict:
    """What became of a tree's rays in one precision."""

    counts: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)


def made(number: int, seed: int, rays: int) -> Tree | None:
    """Return a tree and rays; None where the tree has nothing in it, or the program refuses its text."""
    rng = random.Random(f"{seed} {number}")
    text = tree(rng)
    value = by_numpy(text, np.float64)
    places = np.random.default_rng([seed, number])
    points = places.uniform(-1, 1, (3, 400))
    try:
        found = np.broadcast_to(value(*points), 400)
    except (TypeError, ValueError, ZeroDivisionError, OverflowError):
        return None
    if np.iscomplexobj(found):  # of numbers alone: Python has powers of negative ones
        return None
    found = found[np.isfinite(found) & (np.sum(points**2, axis=0) < 1)]
    if len(found) < 20 or np.ptp(found) == 0:
        return None
    level = float(np.quantile(found, rng.uniform(0.1, 0.6)))
    text = f"{text} - {level:.5g}" if level >= 0 else f"{text} + {-level:.5g}"
    text = rng.choice(("max({0}, {1})", "max({1}, {0})", "min(max({0}, {1}), max({2}, {1}))", "max({0}, {1}, -({2}))",
                       "max({1}, min({2}, {0}))")).format(text, _BALL, "x^2 + y^2 + (z - 0.2)^2 - 0.1")  # fmt: skip
    through = places.uniform(-0.9, 0.9, (rays, 3))
    direction = places.normal(size=(rays, 3))
    axes = places.random(rays) < 0.15
    direction[axes] = np.eye(3)[places.integers(0, 3, axes.sum())] * places.choice([-1.0, 1.0], (axes.sum(), 1))
    through[places.random(rays) < 0.1, places.integers(0, 3)] = 0.0
    for _ in range(4):
        direction /= np.sqrt(np.sum(direction**2, axis=1, keepdims=True))
    inside = places.random(rays) < 0.2
    origin = np.where(inside[:, None], through, through - 3.0 * direction)
    return Tree(number, text, origin, direction)


def _scene(text: str) -> Scene | None:
    try:
        return lenscl.scene_from_toml(scenes.scene(scenes.user(text, _BOX, 1.0), picture=_PICTURE, numerics=_NUMERICS))
    except LensclError:
        return None


@dataclass(frozen=True)
class Ends:
    """What paths come to: last surface points, shape (N, 3), status and events, shape (N,)."""

    origin: Array
    status: Array
    events: Array


def traced(each: Tree, precision: str, here: device.Device) -> tuple[Ends, Ends] | None:
    """Return the rays' paths, up to the first event and to the end; None where the text is refused.

    What is undecided before the first event, which takes the longest, is not traced once more.
    """
    scene = _scene(each.text)
    if scene is None:
        return None
    first = _ends(scene.replace({"numerics.max_events": 1}), each.origin, each.direction, precision, here)
    whole = Ends(first.origin.copy(), first.status.copy(), first.events.copy())
    goes_on = np.flatnonzero(first.status == RayStatus.TRAPPED)
    if len(goes_on):
        rest = _ends(scene, each.origin[goes_on], each.direction[goes_on], precision, here)
        whole.origin[goes_on], whole.status[goes_on], whole.events[goes_on] = rest.origin, rest.status, rest.events
    return first, whole


def _ends(scene: Scene, origin: Array, direction: Array, precision: str, here: device.Device) -> Ends:
    paths = lenscl.trace_rays(scene, origin, direction, precision=precision, device=here)
    return Ends(np.array(paths.origin, float), np.array(paths.status), np.array(paths.events))


class Judge:
    """A tree's rays by the meaning of its text."""

    def __init__(self, each: Tree) -> None:
        self.tree = each
        self.value, self.exact, self.balls = by_numpy(each.text), by_mpmath(each.text), by_balls(each.text)
        with np.errstate(divide="ignore", invalid="ignore"):
            sides = [(end - each.origin) / each.direction for end in (-_BOX, _BOX)]
        self.enter = np.maximum(np.fmin(*sides).max(axis=1), 0.0)
        self.leave = np.maximum(np.fmax(*sides).min(axis=1), self.enter)
        share = np.linspace(0.0, 1.0, _SAMPLES)
        self.t = self.enter[:, None] + share * (self.leave - self.enter)[:, None]
        self.f = self.at(self.t)
        self.start = self.at(np.zeros((len(each.origin), 1)))[:, 0]

    def at(self, t: Array) -> Array:
        """Return F at places t, shape (N, M), of the rays."""
        points = self.tree.origin[:, :, None] + t[:, None, :] * self.tree.direction[:, :, None]
        value = self.value(points[:, 0], points[:, 1], points[:, 2])
        with np.errstate(over="ignore"):
            found: Array = np.broadcast_to(value, t.shape).astype(np.float64)
        return found

    def sign(self, ray: int, t: float, astray: float) -> int | None:
        """Return the sign of F at a place and wherever rounding may move it, to many digits; None if it has none."""
        with mpmath.workdps(40):
            o, d = (
                [mpmath.mpf(float(each)) for each in vector[ray]] for vector in (self.tree.origin, self.tree.direction)
            )
            place = [a + mpmath.mpf(float(t)) * b for a, b in zip(o, d, strict=True)]
            signs = set()
            for moves in ((0, 0, 0), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1), (1, 1, 1),
                          (-1, -1, -1)):  # fmt: skip
                value = self.exact(*(a + m * astray for a, m in zip(place, moves, strict=True)))
                if value is None or abs(value) < 1e-25:
                    return None
                signs.add(1 if value > 0 else -1)
        return signs.pop() if len(signs) == 1 else None

    def side(self, ray: int, astray: float) -> int | None:
        """Return the sign of F where a ray starts; None where rounding may make it another."""
        if abs(self.start[ray]) > 0.1:
            return self.sign(ray, 0.0, astray) if abs(self.start[ray]) > 10 else int(np.sign(self.start[ray]))
        return self.sign(ray, 0.0, astray)

    def below(self, ray: int, low: float, high: float, side: int, astray: float) -> float | None:
        """Return a place between two where F has surely not the sign `side`."""
        with np.errstate(invalid="ignore"):
            off = (self.t[ray] > low) & (self.t[ray] < high) & (side * self.f[ray] < 0)
        places = np.flatnonzero(off)
        if not len(places):
            return None
        deepest = places[np.argsort(side * self.f[ray][places])]
        for place in (*deepest[:3].tolist(), int(places[len(places) // 2])):
            t = float(self.t[ray, place])
            if self.sign(ray, t, astray) == -side:
                return t
        return None

    def may_be_zero(self, ray: int, t: float, precision: str) -> bool:
        """Say whether F may be zero anywhere about an event, for all that its text, in balls, rules out."""
        near, astray = _NEAR[precision], _ASTRAY[precision]
        before, after = self.at(np.full((len(self.start), 2), t) + near * np.array([-1.0, 1.0]))[ray]
        if before * after < 0 and min(abs(before), abs(after)) > 1e-15:
            return True
        if precision != "double" and self._is_rounding(ray, t):
            return True
        parts = [(t - near, t + near)]
        for _ in range(_PARTS):
            if not parts:
                return False
            low, high = parts.pop()
            middle = (low + high) / 2
            if self._zero_between(ray, low, high, astray):
                if not low < middle < high:
                    return True
                parts += [(low, middle), (middle, high)]
        return True

    def _is_rounding(self, ray: int, t: float) -> bool:
        """Say whether F is no larger than what single precision may lose of it there."""
        point = self.tree.origin[ray] + t * self.tree.direction[ray]
        value, lost = evaluate_with_error(parse(self.tree.text, "xyz"), dict(zip("xyz", point, strict=True)))
        return bool(np.isfinite(lost) & (abs(value) <= _SINGLE * lost))

    def _zero_between(self, ray: int, low: float, high: float, astray: float) -> bool:
        place = arb((low + high) / 2, (high - low) / 2 * (1 + 1e-9))
        o, d = self.tree.origin[ray], self.tree.direction[ray]
        found = self.balls(*(arb(float(a)) + place * arb(float(b)) + arb(0, astray) for a, b in zip(o, d, strict=True)))
        return not (found > 0 or found < 0)


def judged(each: Tree, paths: tuple[Ends, Ends], precision: str, judge: Judge) -> Verdict:
    """Judge what a precision made of a tree's rays."""
    first, whole = paths
    verdict, near, astray = Verdict(), _NEAR[precision], _ASTRAY[precision]
    t_first = np.sum((first.origin - each.origin) * each.direction, axis=1)
    t_last = np.sum((whole.origin - each.origin) * each.direction, axis=1)
    for ray in range(len(each.origin)):
        verdict.counts["rays"] += 1
        within = (np.abs(each.origin[ray]) < 1).all()
        start = judge.side(ray, astray) if within else 1
        if start is None:
            verdict.counts["start unsure"] += 1
            continue
        met = first.events[ray] > 0
        if whole.status[ray] == RayStatus.UNDECIDED:
            verdict.counts["undecided"] += 1
            verdict.counts[f"undecided: {_reason(judge, ray)}"] += 1
        else:
            verdict.counts["decided"] += 1
            verdict.counts["decided, events"] += int(whole.events[ray])
        faults = []
        if first.status[ray] != RayStatus.UNDECIDED:
            before = float(t_first[ray]) - near if met else np.inf
            if (missed := judge.below(ray, 0.0, before, start, astray)) is not None:
                faults.append(f"missed at {missed!r}")
            if not met and start < 0:
                faults.append("never left")
        if met and not judge.may_be_zero(ray, float(t_first[ray]), precision):
            faults.append(f"invented at {t_first[ray]!r}")
        events = int(whole.events[ray])
        if events > 1 and not judge.may_be_zero(ray, float(t_last[ray]), precision):
            faults.append(f"invented, the last, at {t_last[ray]!r}")
        if whole.status[ray] not in (RayStatus.UNDECIDED, RayStatus.TRAPPED) and events:
            side = start * (-1) ** events
            if (missed := judge.below(ray, float(t_last[ray]) + near, np.inf, side, astray)) is not None:
                faults.append(f"missed after the last at {missed!r}")
        for fault in faults:
            verdict.counts["wrong"] += 1
            verdict.wrong.append(
                f"{precision}, ray {ray}, {events} events, {RayStatus(whole.status[ray]).name}: {fault}"
            )
    return verdict


def _reason(judge: Judge, ray: int) -> str:
    """Say what the samples show of an undecided ray."""
    f = judge.f[ray]
    if np.isnan(f).any() or not np.isfinite(f).all():
        return "F has no value on the way"
    change = np.abs(np.diff(f))
    if change.max() > 0.3 * max(np.ptp(f), 1e-300):
        return "F jumps or has a pole"
    if np.abs(f).min() < 1e-3 * np.abs(f).max() and not (np.diff(np.sign(f)) != 0).any():
        return "F nearly touches zero"
    return "F crosses zero" if (np.diff(np.sign(f)) != 0).any() else "F stays off zero"


def attack(text: str, seed: int) -> tuple[Counter[str], list[str]]:
    """Hold the graph of a text against mpmath: value, derivatives, coefficients along a ray, and bounds.

    Returns
    -------
    counts : Counter
        How much of each was held against it.
    faults : list of str
    """
    rng = np.random.default_rng(seed)
    graph, exact, counts, faults = parse(text, "xyz"), by_mpmath(text), Counter[str](), []
    points = rng.uniform(-1, 1, (12, 3))
    at = dict(zip("xyz", points.T, strict=True))
    values = evaluate(graph, at)
    slopes = [evaluate(differentiate(graph, axis), at) for axis in "xyz"]
    step = mpmath.mpf(10) ** -18
    for i, point in enumerate(points):
        there = exact(*point)
        if there is None or abs(there) > 1e290:  # beyond, double has only infinity
            continue
        room = _conditioned(exact, point, there)
        if room is None:
            continue  # beside a jump or a pole
        counts["values"] += 1
        if not abs(there - mpmath.mpf(float(values[i]))) <= room:
            faults.append(f"value at {point.tolist()}: {values[i]!r} for {mpmath.nstr(there, 17)}")
        for axis in range(3):
            with mpmath.workdps(50):
                beside = [exact(*(mpmath.mpf(float(c)) + (k * step if j == axis else 0) for j, c in enumerate(point)))
                          for k in (-2, -1, 1, 2)]  # fmt: skip
                if None in beside:
                    continue
                central, wider = (beside[2] - beside[1]) / (2 * step), (beside[3] - beside[0]) / (4 * step)
                if abs(central - wider) > 1e-9 * (1 + abs(central)):
                    continue  # a crease
                counts["derivatives"] += 1
                got = mpmath.mpf(float(slopes[axis][i]))
                if mpmath.isnan(got):  # unknown, not wrong: 0 / 0 where a cube root's argument is flat at 0
                    counts["derivatives, unknown"] += 1
                    continue
                if mpmath.isfinite(got) and abs(got - central) <= 1e-6 * (1 + abs(central)) * (1 + 1e9 * room):
                    continue
                faults.append(
                    f"d/d{'xyz'[axis]} at {point.tolist()}: {slopes[axis][i]!r} for {mpmath.nstr(central, 17)}"
                )
    faults += _bounds_broken(graph, by_numpy(text), rng, counts)
    faults += _coefficients_wrong(graph, exact, rng, counts)
    return counts, faults


def _conditioned(exact: Any, point: Array, there: Any) -> Any:
    """Return what rounding may change of a value, from what moves of 1e-13 do; None where they change it by much."""
    size = abs(there) * mpmath.mpf("1e-11") + mpmath.mpf("1e-13")
    for axis in range(3):
        for move in (1e-13, -1e-13):
            moved = exact(*(c + (move if j == axis else 0) for j, c in enumerate(point)))
            if moved is None or abs(moved - there) > 1e-3 * (1 + abs(there)):
                return None
            size += 1000 * abs(moved - there)
    return size


def _bounds_broken(graph: Any, value: Any, rng: np.random.Generator, counts: Counter[str]) -> list[str]:
    """Hold bounds over boxes of all sizes against samples."""
    boxes = 60
    middle, size = (
        rng.uniform(-1, 1, (3, boxes)),
        10.0 ** rng.uniform(-6, 0.3, (3, boxes)) * (rng.random((3, boxes)) < 0.9),
    )
    low, high = middle - size, middle + size
    least, most = bounds(graph, {axis: (low[i], high[i]) for i, axis in enumerate("xyz")})
    share = rng.choice([0.0, 1.0, 0.5], (3, 40, 1))
    share = np.where(rng.random(share.shape) < 0.6, rng.random(share.shape), share)
    found = np.broadcast_to(value(*(low[:, None] + share * (high - low)[:, None])), (40, boxes))
    counts["bounds"] += int(np.isfinite(found).sum())
    with np.errstate(invalid="ignore"):
        slack = 1e-9 * np.abs(found)  # of this test's own roundings: those of the program are in its bounds
        broken = (found < least - slack) | (found > most + slack)
    counts["bounds, finite"] += int((np.isfinite(least) | np.isfinite(most)).sum())
    return [f"bounds [{least[b]!r}, {most[b]!r}] of box {low[:, b].tolist()}, {high[:, b].tolist()}: {found[s, b]!r}"
            for s, b in zip(*np.nonzero(broken), strict=True)][:1]  # fmt: skip


def _coefficients_wrong(graph: Any, exact: Any, rng: np.random.Generator, counts: Counter[str]) -> list[str]:
    """Hold the coefficients along a ray of what is a polynomial against values."""
    found = polynomial(graph, {axis: (symbol(f"o{axis}"), symbol(f"d{axis}")) for axis in "xyz"})
    if found is None:
        return []
    ray = {f"{vector}{axis}": float(rng.uniform(-1, 1)) for vector in "od" for axis in "xyz"}
    coefficients = [float(evaluate(each, ray)) for each in found]
    for t in (0.0, 0.5, -1.25):
        want = exact(*(ray[f"o{axis}"] + t * ray[f"d{axis}"] for axis in "xyz"))
        if want is None or not np.isfinite(coefficients).all():
            continue
        counts["coefficients"] += 1
        size = sum(abs(c) * abs(t) ** k for k, c in enumerate(coefficients))
        got = mpmath.fsum(mpmath.mpf(c) * mpmath.mpf(t) ** k for k, c in enumerate(coefficients))
        if abs(got - want) > 1e-9 * (size + abs(want)):
            return [f"coefficients {coefficients} at t = {t}: {mpmath.nstr(got, 17)} for {mpmath.nstr(want, 17)}"]
    return []


def plain() -> device.Device:
    """Return the device with few lanes and nothing optimised, which compiles in a fourth of the time."""
    here = device.choose()
    return replace(here, widths=(4, 4), build_options=(*here.build_options, "-cl-opt-disable", "-w"))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the script."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("trees", nargs="?", type=int, default=10_000)
    parser.add_argument("seed", nargs="?", type=int, default=1)
    parser.add_argument("--from", dest="start", type=int, default=0)
    parser.add_argument("--step", type=int, default=1, help="every STEP-th tree: for several processes")
    parser.add_argument("--rays", type=int, default=48)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--precision", action="append", choices=PRECISIONS, help="in turn where none is named")
    given = parser.parse_args(arguments)
    warnings.simplefilter("ignore")
    here, total, start = plain(), Counter[str](), given.start
    if given.keep and given.keep.exists():
        for line in given.keep.read_text().splitlines():
            kept = json.loads(line)
            total.update(kept["counts"])
            start = kept["number"] + given.step
    began = time.monotonic()
    for number in range(start, given.trees, given.step):
        counts, wrong, text = one(number, given.seed, given.rays, given.precision or [PRECISIONS[number % 3]], here)
        total.update(counts)
        for fault in wrong[:6]:
            print(f"tree {number}: {text}\n  {fault}", flush=True)
        if given.keep:
            with given.keep.open("a") as file:
                file.write(json.dumps({"number": number, "counts": counts, "wrong": wrong, "text": text}) + "\n")
    print(f"{time.monotonic() - began:.0f} s")
    for name, count in sorted(total.items()):
        print(f"{count:10,d}  {name}")
    return 1 if total["wrong"] or total["faults of the graph"] else 0


def one(
    number: int, seed: int, rays: int, precisions: Sequence[str], here: device.Device
) -> tuple[Counter[str], list[str], str]:
    """Return what becomes of one tree: counts, what is wrong, and its text."""
    total, wrong = Counter[str](), []
    each = made(number, seed, rays)
    if each is None:
        return Counter({"trees without any inside": 1}), [], ""
    try:
        counts, faults = attack(each.text, number)
    except ExpressionError:
        return Counter({"trees refused": 1}), [], each.text
    total.update(counts)
    total["faults of the graph"] += len(faults)
    wrong += faults
    judge: Judge | None = None
    for precision in precisions:
        paths = traced(each, precision, here)
        if paths is None:
            total["trees refused"] += 1
            break
        judge = judge or Judge(each)
        verdict = judged(each, paths, precision, judge)
        total.update({f"{precision}: {name}": count for name, count in verdict.counts.items()})
        total["wrong"] += verdict.counts["wrong"]
        wrong += verdict.wrong
    else:
        total["trees"] += 1
    return total, wrong, each.text


if __name__ == "__main__":
    sys.exit(main())
