"""How the solids of a scene lie to each other, and which of two is the medium where both are.

Solids that are proved apart are not spoken of. Of all others, places in and on both are looked at: one solid lies in
the other, they overlap, they touch, or nothing of that is found, and they may keep apart by less than what is proved.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens, Scene
from lenscl.expr import evaluate, evaluate_with_error, gradient
from lenscl.tracing import Placement, may_touch

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_GRID = 25  # places along each side of a box, its ends among them
_HALVINGS = 60
_ROOM = 4.0  # times what rounding of F and of a place may do
_ROUNDINGS = 8 * 2.0**-52  # of the lengths at hand: what it does to a place
_PARALLEL = 1e-6  # sine between normals of faces in contact


@dataclass(frozen=True, slots=True)
class _Lie:
    """How two solids lie: `how` of the first to the second, and a place of the world that shows it."""

    how: Literal["within", "around", "overlap", "touch", "near"]
    place: tuple[float, float, float] | None
    touches: bool  # whether faces coincide


def arrangement_spots(scene: Scene, first: int, second: int) -> Iterator[tuple[int, str, str]]:
    """Yield (number of the lens spoken of, kind, message) for two lenses of a scene, the first of the lower number."""
    one, other = scene.lenses[first], scene.lenses[second]
    if not may_touch(one, other):
        return
    lie = _lie(replace(one.solid, centre=one.centre), replace(other.solid, centre=other.centre))
    keys = {number: scene.lens_key(number) for number in (first, second)}
    low, high = sorted((first, second), key=scene.by_priority().index)
    why = _why(scene, low, high)
    at = "" if lie.place is None else f", as at ({', '.join(f'{part:.4g}' for part in lie.place)})"
    one_interface = "faces that coincide are one interface, as if cemented: one event between the two media"
    if scene.lenses[first].mirror or scene.lenses[second].mirror:
        one_interface += ", and a mirrored one of them reflects"
    also = f"; {one_interface}" if lie.touches else ""
    match lie.how:
        case "within" | "around":
            inner, outer = (first, second) if lie.how == "within" else (second, first)
            if inner == high:
                text = f"lies in {keys[outer]}, whose medium gives way there: {why}{also}"
                yield inner, f"within-{keys[outer]}", text
            else:
                mirrors = ", its mirrored faces reflect none," if scene.lenses[inner].mirror else ""
                text = (
                    f"lies in {keys[outer]}, which is the medium there: {why}; so it bends no light{mirrors} and is "
                    f"not seen. {_remedy(scene, inner, outer)} makes it seen"
                )
                yield inner, f"hidden-{keys[outer]}", text
        case "overlap":
            text = (
                f"overlaps {keys[second]}{at}; where both are the medium is that of {keys[high]}: {why}. "
                f"{_remedy(scene, low, high)} makes it that of {keys[low]}{also}"
            )
            yield first, f"overlap-{keys[second]}", text
        case "touch":
            yield first, f"touch-{keys[second]}", f"touches {keys[second]}{at}; {one_interface}"
        case "near":
            text = (
                f"is not proved to keep apart from {keys[second]}, though no place in both is found. Rays are told "
                "right all the same; they only take longer than where a gap is proved"
            )
            yield first, f"near-{keys[second]}", text


def _why(scene: Scene, low: int, high: int) -> str:
    """Say why the one lens is the medium where both are."""
    less, more = (scene.lenses.group_of(number) for number in (low, high))
    if less is more:
        return f"of equal priority, {scene.lens_key(high)} stands later in the list"
    if less.lens.priority == more.lens.priority:
        return f"of equal priority, {scene.table_key(more)} stands later in the file"
    return f"{_key(scene, high)} is {more.lens.priority:g}, and {_key(scene, low)} {less.lens.priority:g}"


def _remedy(scene: Scene, low: int, high: int) -> str:
    """Say what lets the lens of the lower number of two be the medium where both are."""
    less, more = (scene.lenses.group_of(number) for number in (low, high))
    if less is more:
        return f"A later place in {scene.table_key(less)}.at"
    return f"{_key(scene, low)} above {more.lens.priority:g}"


def _key(scene: Scene, number: int) -> str:
    group = scene.lenses.group_of(number)
    key = scene.table_key(group)
    return f"{key}.priority" if group.lens.name is not None else f"priority of {key}"


_NEAR = _Lie("near", None, False)


@lru_cache(maxsize=1024)  # a sweep of anything else asks for the same two at every point
def _lie(a: Lens, b: Lens) -> _Lie:
    """Look at places in and on two solids that are not proved apart."""
    of_a, of_b = _look(a, b), _look(b, a)
    touches = bool(len(of_a.shared) or len(of_b.shared))
    both = np.concatenate([of_a.both, of_b.both])
    if of_a.lies_within:
        return _Lie("within", None, touches)
    if of_b.lies_within:
        return _Lie("around", None, touches)
    if len(both):
        return _Lie("overlap", _middle(both), touches)
    return _Lie("touch", _middle(np.concatenate([of_a.shared, of_b.shared])), True) if touches else _NEAR


@dataclass(frozen=True, slots=True, eq=False)
class _Look:
    """What places in and on one solid say of another: those in both, those on both, and whether none is outside."""

    both: Array
    shared: Array
    lies_within: bool


def _look(one: Lens, other: Lens) -> _Look:
    within, on = _inner_places(one), _surface_places(one)
    inside, level = _against(other, within, 0.0, None)
    on_inside, on_level = _against(other, on.world, on.off, None)
    _, along = _against(other, on.world, on.off, on.normal)
    none_outside = bool((inside | level).all() and (on_inside | on_level).all())
    both = np.concatenate([within[inside], on.world[on_inside]])
    return _Look(both, on.world[along], none_outside and bool(len(both)))


def _middle(places: Array) -> tuple[float, float, float]:
    x, y, z = places[len(places) // 2].tolist()
    return x, y, z


@dataclass(frozen=True, slots=True, eq=False)
class _On:
    """Places on a surface, shape (N, 3), how far rounding moves the surface there, and its normals, of any length."""

    world: Array
    off: Array
    normal: Array


def _grid(lens: Lens) -> tuple[Array, Array]:
    """Return places of a lens's own space, shape (_GRID, _GRID, _GRID, 3), and F there."""
    low, high = Placement.of(lens).box
    sides = np.linspace(low, high, _GRID)
    places = np.stack(np.meshgrid(*sides.T, indexing="ij"), axis=-1)
    return places, _value(lens, places)


def _inner_places(lens: Lens) -> Array:
    places, f = _grid(lens)
    return _world(lens, places[f < 0.0])


def _surface_places(lens: Lens) -> _On:
    """Return where lines of the grid cross the surface, found by halving."""
    places, f = _grid(lens)
    inner, outer = [], []
    for axis in range(3):
        near, far = (np.take(places, range(*ends), axis) for ends in ((0, _GRID - 1), (1, _GRID)))
        one, other = (np.take(f, range(*ends), axis) < 0.0 for ends in ((0, _GRID - 1), (1, _GRID)))
        for crosses, low, high in ((one & ~other, near, far), (~one & other, far, near)):
            inner.append(low[crosses])
            outer.append(high[crosses])
    low, high = np.concatenate(inner), np.concatenate(outer)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        is_inside = (_value(lens, middle) < 0.0)[:, None]
        low, high = np.where(is_inside, middle, low), np.where(is_inside, high, middle)
    world = _world(lens, low)
    _, rounding, normal = _known(lens, low, world)
    with np.errstate(all="ignore"):
        off = rounding / np.linalg.norm(normal, axis=-1)
    known = np.isfinite(off)
    return _On(world[known], off[known], normal[known])


def _against(lens: Lens, world: Array, off: Array | float, normal: Array | None) -> tuple[Mask, Mask]:
    """Return which places lie inside a solid, and which on its surface, along it where normals are given."""
    placement = Placement.of(lens)
    local = placement.local(world)
    near = ((local >= placement.box[0]) & (local <= placement.box[1])).all(axis=1)
    f, rounding, its = _known(lens, local, world)
    with np.errstate(all="ignore"):
        most = _ROOM * (rounding + off * np.linalg.norm(its, axis=-1))
        on = near & (np.abs(f) <= most)
        inside = near & (f < 0.0) & ~on
        if normal is not None:
            sine = np.linalg.norm(np.cross(normal, its), axis=-1)
            on &= sine <= _PARALLEL * np.linalg.norm(normal, axis=-1) * np.linalg.norm(its, axis=-1)
    return inside, on


def _known(lens: Lens, local: Array, world: Array) -> tuple[Array, Array, Array]:
    """Return F at places, what rounding may do to it, and its gradient in the world."""
    placement, at = Placement.of(lens), _at(lens, local)
    f, rounding = (np.broadcast_to(part, len(local)) for part in evaluate_with_error(lens.surface.expression, at))
    slopes = [np.broadcast_to(evaluate(slope, at), len(local)) for slope in gradient(lens.surface.expression)]
    normal = np.stack(slopes, axis=-1) @ placement.to_local
    with np.errstate(all="ignore"):
        moved = _ROUNDINGS * (np.abs(world) + np.abs(placement.centre)).sum(axis=-1)
        return f, rounding + moved * np.linalg.norm(normal, axis=-1), normal


def _value(lens: Lens, places: Array) -> Array:
    with np.errstate(all="ignore"):
        return np.broadcast_to(evaluate(lens.surface.expression, _at(lens, places)), places.shape[:-1])


def _at(lens: Lens, places: Array) -> dict[str, Any]:
    return {**lens.values, **dict(zip("xyz", np.moveaxis(places, -1, 0), strict=True))}


def _world(lens: Lens, places: Array) -> Array:
    placement = Placement.of(lens)
    world: Array = placement.centre + places @ placement.to_world.T
    return world
