"""Where a user's F has no value, none that a number can hold, or a pole: there no search proves what a ray meets.

Parts of the bounds without a value, or beyond the largest number, are seen at a grid of places. Poles are points, lines
and sheets between these: they are where a divisor is zero, or what a logarithm is taken of. Boxes are parted in eight
again and again and kept where that may be, by interval arithmetic; from what is left the place is sought at which it is
least, and this is a pole where only rounding is left of it. Cuts, across which an angle, a sign or a floor makes F
jump, are seen between places of the grid.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
from lenscl.expr import Expr, jumps, why_undefined
from lenscl.expr.graph import build, walk
from lenscl.lenses import Box
from lenscl.sweep.boxes import Array, Points, may_be_zero, most_boxes, parted, value_at
from lenscl.sweep.solids import PLACES, on_grid
from lenscl.sweep.view import place_in_view, told_place

_ASIDE = np.array([0.137, 0.291, 0.173])  # of a grid's step: a place so far beside a pole on the grid has a value
_MOST_PLACES = 1000
_LEVELS = 9  # halvings of the bounds
_STARTS = 64  # of the search for a pole, for each divisor
_ZOOMS = 30
_ZERO = 1e-9  # of a divisor's size in the bounds
_POLES = {  # what they are, and what to write instead
    "/": ("a division by 0", "Keep the divisor from 0, 1/(u^2 + 1e-6) for 1/u^2"),
    "log": ("a logarithm of 0", "Keep its operand from 0, log(max(u, 1e-30)) for log(u)"),
    "tan": ("a tangent of a right angle", "Write sin(u)/cos(u) < c as sin(u) - c*cos(u), where cos(u) > 0"),
}
_WALL = "Cut the solid by a surface of its own there, max(F, G) with G = 0 on the jump"
_JUMPS = {
    "atan2": (
        "the turn of an angle, atan2",
        "Take whole multiples of the angle through sin or cos, which go on smoothly",
    ),
    "sign": ("the change of a sign", _WALL),
    "floor": ("a step of a floor, which mod has, too", _WALL),
}
_HALVINGS = 45  # of the way between two places of the grid, to the jump between them
_AROUND = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, 3)] * 3), axis=-1).reshape(-1, 3)


def value_spots(scene: Scene, number: int) -> Iterator[tuple[str, str]]:
    """Yield (kind, message) for where a user's lens lacks a value; the catalogue's are known to have one."""
    lens = scene.lenses[number]
    bounds = lens.surface.promised
    if bounds is None:
        return
    values = tuple(sorted(lens.values.items()))
    expression, given = lens.surface.expression, dict(values)
    (lacks, lacking), (overflows, beyond) = _regions(expression, values, bounds)
    if lacking:
        place, _, point = told_place(scene, number, lacking)
        blamed = why_undefined(expression, given | dict(zip("xyz", point, strict=True)))
        why, instead = blamed or ("an operation without a value", "sqrt(max(u, 0)) for sqrt(u)")
        yield (
            "no-value",
            f"F has no value in part of its bounds ({_percent(lacks)} of them), such as {place}; rays there may end "
            f"undecided. There F holds {why}, in the lens's own coordinates: write {instead}, or let lens.bounds leave "
            "the place out",
        )
    if beyond:
        place, _ = place_in_view(scene, number, beyond)
        yield (
            "overflow",
            f"F is beyond the largest number in part of its bounds ({_percent(overflows)} of them), such as {place}; "
            "rays there may end undecided. Draw lens.bounds closer, or write what has the same sign and stays small: "
            "u - v for exp(u) - exp(v)",
        )
    for first, (op, points) in enumerate(_poles(expression, values, bounds)):
        what, instead = _POLES[op]
        place, _ = place_in_view(scene, number, points)
        yield (
            f"pole-{op}" if first else "pole",
            f"F has a pole, {what}, such as {place}; rays that meet it may end undecided. {instead}, or let "
            "lens.bounds leave it out",
        )
    for first, (op, cuts) in enumerate(_cuts(expression, values, bounds)):
        what, instead = _JUMPS[op]
        place, _ = place_in_view(scene, number, cuts)
        yield (
            f"jump-{op}" if first else "jump",
            f"F jumps by {what}, such as {place}: it is never 0 there, and rays that enter or leave the solid by that "
            f"cut end undecided. {instead}, or let lens.bounds leave the cut out",
        )


def _percent(share: float) -> str:
    return f"{max(0.1, 100.0 * share):.1f} %"


@lru_cache(maxsize=1024)  # a sweep of anything else asks for the same solid at every point
def _regions(
    expression: Expr, values: tuple[tuple[str, float], ...], bounds: Box
) -> tuple[tuple[float, Points], tuple[float, Points]]:
    """Return where F is NaN, and where it is infinite: the share of the bounds, and some places, the inmost first."""
    low, high = (np.asarray(corner, dtype=np.float64) for corner in bounds)
    found = on_grid(expression, values, bounds)
    regions = []
    for is_bad in (np.isnan, np.isinf):
        bad = np.argwhere(is_bad(found)) / (PLACES - 1)
        # A pole on the grid is no region: it is gone a little way aside, towards the centre
        aside = bad + np.where(bad < 0.5, _ASIDE, -_ASIDE) / (PLACES - 1)
        bad = bad[is_bad(value_at(expression, dict(values), low + aside * (high - low)))]
        regions.append((len(bad) / found.size, _inmost(low + bad * (high - low), low, high)))
    return regions[0], regions[1]


@lru_cache(maxsize=1024)
def _poles(expression: Expr, values: tuple[tuple[str, float], ...], bounds: Box) -> tuple[tuple[str, Points], ...]:
    """Return the operations that have poles, and some places of each, the inmost first."""
    given = dict(values)
    low, high = (np.asarray(corner, dtype=np.float64) for corner in bounds)
    found: dict[str, list[Array]] = {}
    for divisor, op in _divisors(expression).items():
        most, side, lows = most_boxes(divisor), high - low, low[None]
        for _ in range(_LEVELS):
            side = 0.5 * side
            lows = parted(lows, side)
            lows = lows[may_be_zero(divisor, given, lows, side)]
            if not len(lows) or len(lows) > most:
                break
        if not len(lows):
            continue
        starts = lows[:: -(-len(lows) // _STARTS)] + 0.5 * side
        places, sizes = _least(divisor, given, starts, 0.5 * side)
        places = places[sizes <= _ZERO * _size(divisor, given, low, high)]
        if len(places):
            found.setdefault(op, []).append(places)
    return tuple((op, _inmost(np.clip(np.concatenate(places), low, high), low, high)) for op, places in found.items())


@lru_cache(maxsize=1024)
def _cuts(expression: Expr, values: tuple[tuple[str, float], ...], bounds: Box) -> tuple[tuple[str, Points], ...]:
    """Return the operations by which F jumps, and places between those of the grid where it does, the inmost first.

    An angle jumps where it turns over. A sign or a floor counts only where F has another sign on the two sides.
    """
    low, high = (np.asarray(corner, dtype=np.float64) for corner in bounds)
    found: dict[str, list[Array]] = {}
    for jump in jumps(expression):
        if not jump.depends_on("xyz"):
            continue
        parts = [np.broadcast_to(on_grid(each, values, bounds), (PLACES,) * 3) for each in (jump, *jump.args)]
        for axis in range(3):
            step, first, *second = ([np.take(part, range(i, i + PLACES - 1), axis) for i in (0, 1)] for part in parts)
            if jump.op == "atan2":
                over = ((first[0] < 0.0) != (first[1] < 0.0)) & (second[0][0] < 0.0)
                at = low + (np.argwhere(over) + 0.5 * np.eye(3)[axis]) / (PLACES - 1) * (high - low)
            else:
                sides = (low + (np.argwhere(step[0] != step[1]) + i * np.eye(3)[axis]) / (PLACES - 1) * (high - low)
                         for i in (0, 1))  # fmt: skip
                at = _walls(expression, jump, dict(values), *sides)
            if len(at):
                found.setdefault(jump.op, []).append(at)
    return tuple((op, _inmost(np.concatenate(places), low, high)) for op, places in found.items())


def _walls(expression: Expr, jump: Expr, given: dict[str, float], first: Array, second: Array) -> Array:
    """Return where F has another sign on the two sides of a jump, which lies between points, shape (N, 3)."""
    start = value_at(jump, given, first)
    for _ in range(_HALVINGS):
        middle = 0.5 * (first + second)
        before = (value_at(jump, given, middle) == start)[:, None]
        first, second = np.where(before, middle, first), np.where(before, second, middle)
    return first[value_at(expression, given, first) * value_at(expression, given, second) < 0.0]


def _divisors(expression: Expr) -> dict[Expr, str]:
    """Return what must not be zero, of what depends on the place, and for which operation."""
    found: dict[Expr, str] = {}
    for each in walk([expression]):
        if each.op == "/":
            found.setdefault(each.args[1], "/")
        elif each.op == "log" or (each.op == "pow" and (each.args[1].value or 0.0) < 0.0):
            found.setdefault(each.args[0], "log" if each.op == "log" else "/")
        elif each.op == "tan":
            found.setdefault(build("cos", each.args[0]), "tan")
    return {divisor: op for divisor, op in found.items() if divisor.depends_on("xyz")}


def _least(divisor: Expr, given: dict[str, float], points: Array, reach: Array) -> tuple[Array, NDArray[np.float64]]:
    """Return where near points, shape (N, 3), a divisor is least, and its sizes there."""
    rows = np.arange(len(points))
    sizes = np.full(len(points), np.inf)
    for _ in range(_ZOOMS):
        places = points[:, None] + _AROUND * reach
        size = np.abs(value_at(divisor, given, places.reshape(-1, 3))).reshape(len(points), -1)
        size = np.where(np.isnan(size), np.inf, size)
        least = size.argmin(axis=1)
        points, sizes = places[rows, least], size[rows, least]
        reach = 0.5 * reach
    return points, sizes


def _size(divisor: Expr, given: dict[str, float], low: Array, high: Array) -> float:
    unit = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 7)] * 3), axis=-1).reshape(-1, 3)
    sizes = np.abs(value_at(divisor, given, low + unit * (high - low)))
    return float(np.max(sizes, initial=0.0, where=np.isfinite(sizes)))


def _inmost(points: Array, low: Array, high: Array) -> Points:
    """Return points, as many as are wanted, those that are nearest to the middle of the bounds first."""
    far = np.linalg.norm((points - 0.5 * (low + high)) / (high - low), axis=1)
    return tuple((float(x), float(y), float(z)) for x, y, z in points[np.argsort(far, kind="stable")][:_MOST_PLACES])
