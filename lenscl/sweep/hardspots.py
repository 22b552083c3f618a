"""What is hard about a scene and can be told before tracing it.

Boxes, planes and points are looked at, and F on boxes: a spot is a reason to look twice, not a fault. Of solids that
are not proved apart it is said how they lie to each other, and which of them is the medium where both are.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Group, Point, Scene, Study
from lenscl.errors import StudyError
from lenscl.imaging import refuse_unseen
from lenscl.sweep.aimed import MOST_PASSED, copies_to_look_at, every_pixel, film_rays_of, is_aimed_at, passed_by
from lenscl.sweep.arrangement import arrangement_spots
from lenscl.sweep.shapes import shape_spots
from lenscl.sweep.solids import solid_spots
from lenscl.sweep.values import value_spots
from lenscl.tracing import MOST_PAIRS, Placement, holding, methods_of, out_of_view, reach_of, touching

Points = NDArray[np.float64]

_BENT_TO = "it is seen only if another lens bends light to it"
_LEFT_OUT = "nor can light that other lenses bend get to it, so that it is left out of the kernel"
_COARSE_RAYS = 2**14  # film rays looked at first; all are, in pieces of this size, where the first decide nothing
_NAMED = 8  # lenses of one message
_MOST_ARRANGED = 64  # pairs of tables that are told how they lie
_ON_FILM = 1e-12  # of the film's size: a source so near to its plane lies in it


@dataclass(frozen=True, slots=True)
class HardSpot:
    """One thing to look at twice."""

    key: str  # the part of the scene it is about, as the study's keys call it
    kind: str  # which rule found it
    message: str
    points: tuple[int, ...] = ()  # of the study, where it was found; the message is the first one's

    def __str__(self) -> str:
        return f"{self.key}: {self.message}"


def study_hard_spots(study: Study, *, most_points: int = 250) -> tuple[tuple[HardSpot, ...], int]:
    """Return the hard spots over a study's points, and how many points were looked at.

    Parameters
    ----------
    study : Study
        What to look at.
    most_points : int
        Of a longer study, this many points spread evenly from the first on.
    """
    stride = max(1, -(-study.point_count() // most_points))
    found: dict[tuple[str, str], HardSpot] = {}
    where: dict[tuple[str, str], list[int]] = {}
    looked_at = 0
    for point in study.points():
        if point.index % stride:
            continue
        looked_at += 1
        for spot in _spots_of(point):
            name = (spot.key, spot.kind)
            found.setdefault(name, spot)
            where.setdefault(name, []).append(point.index)
    spots = tuple(HardSpot(s.key, s.kind, s.message, tuple(where[name])) for name, s in found.items())
    return spots, looked_at


def _spots_of(point: Point) -> tuple[HardSpot, ...]:
    try:
        return tuple(hard_spots(point.scene))
    except StudyError as error:
        return (
            HardSpot("sweep", "impossible", f"values that do not go together; such a point fails: {error.problems[0]}"),
        )


def hard_spots(scene: Scene) -> Iterator[HardSpot]:
    """Yield the hard spots of one scene."""
    for group in scene.lenses.groups:
        yield from _spots_of_a_lens(scene, group)
    yield from _source_in_a_lens(scene)
    yield from _source_on_the_film(scene)
    yield from _places_given_twice(scene)
    yield from _arrangements(scene)
    yield from _boxes_cut_screens(scene)
    yield from _picture_out_of_the_way(scene)
    yield from _lenses_out_of_the_way(scene)
    yield from _steps_too_long(scene)
    yield from _samples_not_seen(scene)
    yield from _environment_not_read(scene)
    yield from _light_not_seen(scene)


def _spots_of_a_lens(scene: Scene, group: Group) -> Iterator[HardSpot]:
    """Yield what the shape of a lens makes hard; of an array each kind once, of the copy that tells most of it."""
    told = set()
    for number in copies_to_look_at(scene, group):
        for kind, message in (*solid_spots(group.lens), *value_spots(scene, number), *shape_spots(scene, number)):
            if group.at is None or kind not in told:
                yield HardSpot(scene.lens_key(number), kind, message)
            told.add(kind)


def _source_in_a_lens(scene: Scene) -> Iterator[HardSpot]:
    if scene.source.at is None:
        return
    inside, on = holding(scene, scene.source.at)
    if inside:
        medium = max(inside, key=scene.by_priority().index)
        start = f"in {scene.lens_key(medium)}, the medium there" if len(inside) > 1 else "in its medium"
        yield HardSpot("source", "source-inside", f"lies inside {_listed(scene, inside)}; its rays start {start}")
    if on:
        yield HardSpot(
            "source", "source-on", f"lies on the surface of {_listed(scene, on)}; each ray's direction decides its side"
        )


def _listed(scene: Scene, numbers: Sequence[int]) -> str:
    more = f" and {len(numbers) - _NAMED} more" if len(numbers) > _NAMED else ""
    return " and ".join(scene.lens_key(number) for number in numbers[:_NAMED]) + more


def _source_on_the_film(scene: Scene) -> Iterator[HardSpot]:
    if scene.source.at is None:
        return
    film = scene.film
    right, down, corner, at = (
        np.asarray(v, dtype=np.float64) for v in (film.right, film.down, film.corner, scene.source.at)
    )
    normal = np.cross(right, down)
    size = max(float(np.abs(v).max()) for v in (at, corner, right, down))
    if abs(float((at - corner) @ normal)) <= _ON_FILM * size * float(np.linalg.norm(normal)):
        yield HardSpot(
            "source",
            "source-on-film",
            "lies in the film's own plane, and so do all of its rays; that of a pixel whose centre it is has no "
            "direction, and ends undecided. Move the film away from the source",
        )


def _places_given_twice(scene: Scene) -> Iterator[HardSpot]:
    for group in scene.lenses.groups:
        places, first, which = np.unique(group.centres, axis=0, return_index=True, return_inverse=True)
        if len(places) == len(group):
            continue
        again = int(np.flatnonzero(first[which.ravel()] != np.arange(len(group)))[0])
        key = scene.table_key(group)
        yield HardSpot(
            f"{key}.at",
            "twice",
            f"{len(group) - len(places)} of its {len(group)} places are given before, the first of them as "
            f"{key}.at[{again}] and {key}.at[{first[which.ravel()[again]]}]: the same solid twice, which "
            "bends light as one does, and takes longer",
        )


def _arrangements(scene: Scene) -> Iterator[HardSpot]:
    pairs = touching(scene.lenses, range(len(scene.lenses)))
    tables: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for i, j in pairs:
        one, other = scene.lenses.group_of(i), scene.lenses.group_of(j)
        if one is not other or scene.lenses[i].centre != scene.lenses[j].centre:
            tables.setdefault((one.first, other.first), []).append((i, j))
    others = " or more other pairs" if len(pairs) == MOST_PAIRS else " other pairs"
    for firsts, alike in list(tables.items())[:_MOST_ARRANGED]:
        keys = dict.fromkeys(scene.table_key(scene.lenses.group_of(first)) for first in firsts)
        more = len(alike) - 1
        also = f". {more}{others} of {' and '.join(keys)} may touch or overlap, too" if more else ""
        for number, kind, message in arrangement_spots(scene, *alike[0]):
            yield HardSpot(scene.lens_key(number), kind, message + also)
    if (left := len(tables) - _MOST_ARRANGED) > 0:
        yield HardSpot("lens", "arrangements", f"{left} more pairs of lenses are not proved to keep apart")


def _boxes_cut_screens(scene: Scene) -> Iterator[HardSpot]:
    for name, screen in (("film", scene.film), ("picture", scene.picture)):
        corner, right, down = (np.asarray(v, dtype=np.float64) for v in (screen.corner, screen.right, screen.down))
        corners = corner + np.array([0 * right, right, down, right + down])
        normal = np.cross(right, down)
        edges = np.array([right, down])
        for group in scene.lenses.groups:
            lens = Placement.of(group.lens.solid)
            # A flat figure is parted from a solid by its own normal, the solid's faces, or a plane along two edges
            axes = [normal, *_normals(lens), *_crossed(lens.to_world.T, edges), *_crossed(edges, normal[None])]
            cut = np.flatnonzero(_overlap(corners, lens.corners(), group.centres, np.array(axes)))
            if not cut.size:
                continue
            yield HardSpot(
                scene.lens_key(group.first + int(cut[0])),
                f"cut-by-{name}",
                f"its box is cut by the {name}; "
                + (
                    "a film stops no light, and where the solid itself is cut, light enters it before the film"
                    if name == "film"
                    else "where the solid itself reaches it, rays end on it when they meet it first, in the solid "
                    "too; see picture.stops"
                )
                + _and_copies(scene, group, len(cut)),
            )


def _and_copies(scene: Scene, group: Group, count: int, at_least: str = "") -> str:
    """Return that a message holds for so many copies of an array; nothing where it is of one lens."""
    if count < 2:
        return ""
    return f". So it is with {at_least}{count} of the {len(group)} places of {scene.table_key(group)}"


def _picture_out_of_the_way(scene: Scene) -> Iterator[HardSpot]:
    normal = np.cross(np.asarray(scene.picture.right, float), np.asarray(scene.picture.down, float))
    origins, directions = film_rays_of(scene, every_pixel(scene, _COARSE_RAYS))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        t = (np.asarray(scene.picture.corner, float) - origins) @ normal / (directions @ normal)
    # A film ray is at 0 at a point source and at 1 on the film; parallel ones come from as far as need be
    is_point = scene.source.at is not None
    never = ~np.isfinite(t) | (is_point & (t <= 0.0))
    early = ~never & (t < (1.0 if is_point else 0.0))
    if never.any():
        yield HardSpot(
            "picture",
            "behind",
            f"{_share(never)} of the straight rays through the film never meet its plane; "
            "they end BEHIND unless a lens turns them",
        )
    if early.any():
        yield HardSpot(
            "picture",
            "before-film",
            f"lies before the film, as seen from the source, for {_share(early)} of the film's rays",
        )


def _lenses_out_of_the_way(scene: Scene) -> Iterator[HardSpot]:
    reached, out = reach_of(scene), out_of_view(scene)
    for group in scene.lenses.groups:
        unsure = passed_by(scene, group, out)
        missed = [number for number in group.numbers if out[number]]
        missed = sorted(missed + [number for number in unsure if not _is_aimed_at_by_any(scene, number)])
        at_least = "at least " if len(unsure) == MOST_PASSED else ""
        for is_in, why in ((False, _LEFT_OUT), (True, _BENT_TO)):
            some = [number for number in missed if (number in reached) is is_in]
            if some:
                message = f"no film ray is aimed at its box; {why}{_and_copies(scene, group, len(some), at_least)}"
                yield HardSpot(scene.lens_key(some[0]), "not-aimed-at", message)


def _is_aimed_at_by_any(scene: Scene, number: int) -> bool:
    lens = Placement.of(scene.lenses[number])
    if is_aimed_at(scene, lens, every_pixel(scene, _COARSE_RAYS)):
        return True
    pixels = scene.film.columns * scene.film.rows
    pieces = (np.arange(start, min(start + _COARSE_RAYS, pixels)) for start in range(0, pixels, _COARSE_RAYS))
    return any(is_aimed_at(scene, lens, piece) for piece in pieces)


def _steps_too_long(scene: Scene) -> Iterator[HardSpot]:
    methods = methods_of(scene)
    for group in scene.lenses.groups:
        lens, method = group.lens, methods[group.first]
        if "step" not in method.reads:
            continue
        low, high = np.asarray(lens.surface.box(lens.values), dtype=np.float64)
        thinnest = float(((high - low) * np.abs(lens.stretch)).min())
        step = scene.numerics.step
        yield HardSpot(
            scene.table_key(group),
            "march-step",
            f"method {method.name} passes over chords shorter than its step of {step:g}; the thinnest extent of this "
            f"lens's box is {thinnest:.3g}, {thinnest / step:.3g} steps; a smaller numerics.step loses less",
        )


def _samples_not_seen(scene: Scene) -> Iterator[HardSpot]:
    if scene.effects["caustics"] and scene.effects["antialias"] != 1:
        yield HardSpot(
            "effects.antialias",
            "not-painted",
            "the picture is painted in the light of effects.caustics, which more rays a film pixel do not change; they "
            "are traced all the same, for maps. For a picture alone take it out; effects.footprint smooths its cells",
        )


def _environment_not_read(scene: Scene) -> Iterator[HardSpot]:
    if scene.environment != "picture" and scene.effects["fresnel"] != "split":
        yield HardSpot(
            "effects.environment", "not-read", 'nothing reflects it; only fresnel = "split" shows what lenses reflect'
        )


def _light_not_seen(scene: Scene) -> Iterator[HardSpot]:
    try:
        refuse_unseen(scene.wavelengths)
    except StudyError as error:
        yield HardSpot("effects.dispersion", "not-seen", error.problems[0].removeprefix("effects.dispersion: "))


def _normals(lens: Placement) -> Points:
    """Return the normals of a placed box's faces: the directions of its edges, as stretching comes before turning."""
    return lens.to_world.T


def _crossed(some: Points, others: Points) -> Points:
    return np.cross(some[:, None], others[None, :]).reshape(-1, 3)


def _overlap(some: Points, others: Points, places: Points, axes: Points) -> NDArray[np.bool_]:
    """Whether a convex figure meets another at places, given their corners and every direction that might part them.

    Source: the separating axis theorem; Gottschalk, Lin & Manocha, OBBTree, SIGGRAPH 1996. An axis of length 0 (from
    parallel edges) parts nothing and does no harm.
    """
    one, other, at = some @ axes.T, others @ axes.T, places @ axes.T
    meets = (one.min(axis=0) <= at + other.max(axis=0)) & (at + other.min(axis=0) <= one.max(axis=0))
    found: NDArray[np.bool_] = meets.all(axis=1)
    return found


def _share(mask: NDArray[np.bool_]) -> str:
    return "all" if mask.all() else f"{max(0.1, 100.0 * mask.mean()):.1f} %"
