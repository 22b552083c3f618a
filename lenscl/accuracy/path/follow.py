"""Follow a film pixel's ray through the device's own kernels, and say of every event what is known of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, SupportsFloat

import numpy as np
from numpy.typing import NDArray

from lenscl import device as devices
from lenscl.accuracy.bounds import pixel_bounds
from lenscl.accuracy.path.bend import bend_at
from lenscl.accuracy.path.bracket import root_bracket
from lenscl.accuracy.path.growth import Growth, normal_bend
from lenscl.accuracy.path.media import Media, Meeting, media_of, starts_in
from lenscl.accuracy.path.proved import proved
from lenscl.accuracy.path.values import Event, Kind, RayPath, Vec3
from lenscl.accuracy.rounding import reach
from lenscl.codegen import faces_of
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.errors import StudyError
from lenscl.expr import evaluate
from lenscl.lenses import face_at
from lenscl.reference import Placement as ReferencePlacement
from lenscl.reference import on_mirror
from lenscl.status import RayStatus
from lenscl.tracing import (
    Ends,
    Follower,
    PixelFollower,
    Placement,
    film_rays,
    methods_of,
    picture_numbers,
    pixel_effects,
    trace_rays,
)

Array = NDArray[np.float64]

_ENDS_AT_SURFACE = (RayStatus.TOTAL_REFLECTION, RayStatus.BLOCKED)  # with the direction in which the ray came
_ASIDE = 0.5  # of a leg, or of the lens where that is shorter: a bracket's ends are no farther from the traced point


def explain_pixel(
    scene: Scene, row: int, column: int, *, device: Device | str | None = None, size: tuple[int, int] | None = None
) -> RayPath:
    """Return the path of the ray of one film pixel, event by event.

    Parameters
    ----------
    scene : Scene
        Traced by its method and precision, in light of the d line; where these leave the ray undecided, in the next
        finer one, as in a map.
    row, column : int
        Of the film, from 0.
    device : Device or str, optional
        As for `lenscl.trace`.
    size : (int, int), optional
        Columns and rows of the picture whose pixel is named; default: those of `picture.size`.

    Raises
    ------
    StudyError
        If the film has no such pixel, or the scene asks for an accuracy and was not planned.
    NoDeviceError, BuildError, TraceError
        As `lenscl.trace`.
    """
    scene = scene.at_d_line()
    film = scene.film
    if not (0 <= row < film.rows and 0 <= column < film.columns):
        raise StudyError(
            [
                f"pixel ({row}, {column}) is not on the film, which has {film.rows} rows and {film.columns} columns "
                f"(film.size); rows are 0 to {film.rows - 1}, columns 0 to {film.columns - 1}"
            ]
        )
    chosen = device if isinstance(device, Device) else devices.choose(device)
    number = row * film.columns + column
    traced = _traced(scene, row, column, chosen)
    made = _effects(traced, row, column, chosen)
    events, growth = _explained(traced, made)
    columns, rows = size or scene.picture.size
    st = (float(traced.st[0]), float(traced.st[1])) if traced.status.lands else None
    is_on_picture = st is not None and traced.status is RayStatus.PICTURE
    return RayPath(
        row=row,
        column=column,
        film=film.size,
        picture=(columns, rows),
        searches=tuple(method.name for method in methods_of(traced.scene)),
        precision=traced.scene.numerics.precision,
        snell=scene.numerics.snell,
        asked=scene.numerics.precision,
        device=chosen.label,
        start=_vector(traced.points[0]),
        direction=_vector(traced.directions[0]),
        inside=scene.lens_key(traced.inside[-1]) if traced.inside else None,
        solids=tuple(scene.lens_key(number) for number in traced.inside),
        reach=_reach(traced),
        events=events,
        status=traced.status,
        total=traced.total,
        last_resort=traced.last_resort,
        last=_last_leg(traced) if st is not None else None,
        st=st,
        pixel=(int(st[1] * rows), int(st[0] * columns)) if st is not None and is_on_picture else None,
        error=_error(traced, number, chosen),
        growth=growth,
        effects=made[-1],
        proof=proved(scene, number, st),
    )


@dataclass(frozen=True, kw_only=True)
class _Traced:
    """A ray as the device traced it: the scene with the precision that it took, and where it was.

    Attributes
    ----------
    points, directions : float64 array, shape (N + 1, 3)
        The start, then every surface point; the direction behind each.
    origin, direction : float64 array, shape (3,)
        Of the last leg.
    inside : tuple of int
        The lenses whose solids the ray starts in, lowest priority first: the last one is the medium.
    """

    scene: Scene
    eps: float
    points: Array
    directions: Array
    origin: Array
    direction: Array
    st: Array
    status: RayStatus
    total: int
    inside: tuple[int, ...]
    last_resort: bool = False


def _traced(scene: Scene, row: int, column: int, device: Device) -> _Traced:
    start, vector = film_rays(scene, np.array([row * scene.film.columns + column]))
    if not vector.any():  # the pixel lies on the source, and sends no ray
        return _Traced(
            scene=scene, eps=0.0, points=start, directions=vector, origin=start[0], direction=vector[0],
            st=np.full(2, -1.0), status=RayStatus.UNDECIDED, total=0, inside=(),
        )  # fmt: skip
    pixel = PixelFollower(scene, row, column, device, "explain")
    found = _followed(scene, pixel.ends, pixel.dtype)
    if found.status is RayStatus.UNDECIDED and scene.numerics.precision != "double" and device.has_double:
        scene = scene.replace({"numerics.precision": "double"})
        follower = Follower(scene, device, "explain")
        found = _followed(scene, lambda most: follower.ends(start, vector, most), follower.dtype)
    if found.status is not RayStatus.UNDECIDED:
        return found
    last = trace_rays(scene, start, vector, device=device)  # once more, by what decides the last of a map's rays
    origin, direction, st = (each[0].astype(np.float64) for each in (last.origin, last.direction, last.st))
    status = RayStatus(last.status[0])
    return replace(
        found, origin=origin, direction=direction, st=st, status=status, total=int(last.events[0]),
        last_resort=status is not RayStatus.UNDECIDED,
    )  # fmt: skip


def _followed(scene: Scene, ends: Callable[[int], Ends], dtype: type[np.floating[Any]]) -> _Traced:
    """Follow a ray through the kernels event by event: a limit of k events ends it at its k-th surface point."""
    end = ends(scene.numerics.max_events)
    total = int(end.events[0])
    each = [ends(k) for k in range(total)] + [end]
    points, directions = (np.concatenate([getattr(one, name) for one in each]) for name in ("origin", "direction"))
    return _Traced(
        scene=scene, eps=float(np.finfo(dtype).eps), points=points, directions=directions, origin=points[-1],
        direction=directions[-1], st=end.st[0], status=RayStatus(end.status[0]), total=total,
        inside=starts_in(scene, points[0], directions[0]),
    )  # fmt: skip


def _effects(traced: _Traced, row: int, column: int, device: Device) -> list[Mapping[str, Any]]:
    """Return what the effects have made of the ray behind each surface that is shown, and in the map."""
    shown = len(traced.points) - 1
    if not traced.directions[0].any() or traced.last_resort:
        return [{}] * (shown + 1)
    made = pixel_effects(traced.scene, row, column, device, shown)
    return [{name: array.tolist() for name, array in each.items()} for each in made] or [{}] * (shown + 1)


def _explained(traced: _Traced, made: Sequence[Mapping[str, Any]]) -> tuple[tuple[Event, ...], float | None]:
    """Return the events, and the growth up to (s, t)."""
    shown = len(traced.points) - 1
    if not traced.directions[0].any():
        return (), None
    growth = Growth(_unit(traced.directions[0]), _reach(traced))
    events: list[Event] = []
    if shown:
        media = media_of(traced.scene, traced.points, traced.directions, _goes_to(traced), traced.eps)
        events.extend(_events(traced, media, growth, made))
    is_whole = traced.status.lands and not traced.last_resort and all(event.growth is not None for event in events)
    return tuple(events), growth.on_picture(traced.scene, traced.origin, _unit(traced.direction)) if is_whole else None


def _events(traced: _Traced, media: Media, growth: Growth, made: Sequence[Mapping[str, Any]]) -> Iterator[Event]:
    scene = traced.scene
    leaves = bool(traced.inside)
    grows = True
    allowed = 0.0
    for i, point in enumerate(traced.points[1:]):
        met = media.meeting(i, leaves=leaves)
        lens, leaves, hits = scene.lenses[met.lens], met.leaves, met.hits
        before, after = _unit(traced.directions[i]), _unit(traced.directions[i + 1])
        leg = float(np.linalg.norm(point - traced.points[i]))
        n_before, n_behind = met.n_before(scene), met.n_behind(scene)
        mirror = _mirror(scene, met, point, before, leg, traced.eps)
        is_mirrored = mirror is not None
        bend = bend_at(hits, i, before, after, n_before, n_behind, traced.eps, leaves=leaves, mirrors=is_mirrored)
        ends_here = traced.status in _ENDS_AT_SURFACE and i + 2 == len(traced.points) and not traced.last_resort
        total = traced.status is RayStatus.TOTAL_REFLECTION if ends_here else bend is not None and bend.turns_back
        grown = None
        if bend is not None and grows:
            grown = growth.to_surface(leg, before, bend.against)
            leaf = faces_of(lens.surface)[1][bend.face]
            turned = normal_bend(lens, leaf, point) * (-1.0 if leaves else 1.0)
            paraxial = scene.numerics.snell == "paraxial"
            growth.through(before, bend.against, turned, bend.eta, bend.k, total=total, paraxial=paraxial)
        grows = grown is not None
        kind: Kind = (
            "mirror"
            if is_mirrored
            else "total reflection"
            if total
            else "cemented"
            if met.cemented
            else "exit"
            if leaves
            else "entry"
        )
        aside = _ASIDE * min(leg, float(hits.size[i]))
        local = Placement.of(lens).local(point)
        allowed += float(hits.bound[i])  # a search that starts on a surface takes off what F is there
        yield Event(
            number=i + 1,
            kind=kind,
            face=None if mirror is None else mirror[1],
            lens=scene.lens_key(met.lens if mirror is None else mirror[0]),
            before=None if met.before is None else scene.lens_key(met.before),
            after=None if met.behind is None else scene.lens_key(met.behind),
            n_before=n_before,
            n_after=n_behind,
            point=_vector(point),
            leg=leg,
            bracket=root_bracket(lens, point, before, aside, leaves=leaves),
            residual=_finite(
                evaluate(lens.surface.expression, {**lens.values, **dict(zip("xyz", local, strict=True))})
            ),
            allowed=_finite(allowed),
            normal=None if bend is None else _vector(bend.normal),
            turn=None if bend is None else bend.turn,
            incidence=None if bend is None else bend.incidence,
            behind=None if bend is None or ends_here else bend.behind,
            k=None if bend is None else bend.k,
            k_bound=None if bend is None else bend.k_bound,
            margin=None if bend is None else bend.margin,
            growth=grown,
            effects=made[i],
        )
        leaves = leaves if total else not leaves


def _mirror(
    scene: Scene, met: Meeting, point: Array, direction: Array, leg: float, eps: float
) -> tuple[int, str] | None:
    """Return the lens with a mirrored face that a ray meets, and the name of that face; None where it meets none."""
    media = [number for number in (met.before, met.behind) if number is not None]
    for number in [met.lens, *media] if met.cemented else [met.lens]:
        lens = scene.lenses[number]
        if not lens.mirror or number not in media:
            continue
        reach = np.array([float(np.abs(point).max()) + leg])
        coarser = eps / float(np.finfo(np.float64).eps)
        coated, unsure = on_mirror(lens, ReferencePlacement.of(lens), point[None], direction[None], reach, coarser)
        if coated[0] and not unsure[0]:
            return number, face_at(lens.surface, lens.values, Placement.of(lens).local(point).tolist())
    return None


def _goes_to(traced: _Traced) -> Array | None:
    """Return where the last leg that is shown ends; None where nothing tells."""
    if traced.last_resort or not traced.status.lands:
        return None
    end: Array = traced.origin + _last_leg(traced) * _unit(traced.direction)
    return end


def _error(traced: _Traced, number: int, device: Device) -> float | None:
    """Return a bound on the error of the place: its distance from a double trace, and the bound of that."""
    if not (traced.status.lands and device.has_double):
        return None
    places = pixel_bounds(traced.scene, [number], device=device)
    if places.bound[0] < 0.0:
        return None
    return float(np.abs(traced.st - places.st[0]).max() + places.bound[0])


def _reach(traced: _Traced) -> float:
    return max(reach(traced.scene), float(np.abs(traced.points[0]).max()))


def _last_leg(traced: _Traced) -> float:
    numbers = picture_numbers(traced.scene)
    return float((numbers["corner"] - traced.origin) @ numbers["normal"] / (traced.direction @ numbers["normal"]))


def _finite(value: SupportsFloat) -> float | None:
    return float(value) if math.isfinite(float(value)) else None


def _unit(v: Array) -> Array:
    unit: Array = v / np.linalg.norm(v)
    return unit


def _vector(v: Array) -> Vec3:
    return float(v[0]), float(v[1]), float(v[2])
