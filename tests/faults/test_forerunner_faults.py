"""The forerunner's faults, one by one: each is absent from kernels and twin, and each is seen when put back.

A check takes a `Tracer`: the kernels, the twin, or the twin with one faulty step. It fails on the fault.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import CATALOGUE, make_scene

import lenscl
from lenscl import RayStatus, reference
from lenscl.config import Scene
from lenscl.methods import METHODS
from lenscl.reference import Steps

Array = NDArray[Any]
UP = {"corner": [-0.5, 0.5, 2.5], "right": [1.0, 0.0, 0.0], "down": [0.0, -1.0, 0.0]}
SQUARE = {"corner": [-3.0, 3.0, -2.5], "right": [6.0, 0.0, 0.0], "down": [0.0, -6.0, 0.0]}


@dataclass(frozen=True)
class Tracer:
    """One way to trace a scene: (st (N, 2), status (N,), events (N,), origin (N, 3), direction (N, 3))."""

    name: str
    film: Callable[[Scene], Any]
    rays: Callable[[Scene, Array, Array], Any]
    paint: Callable[[Scene, Any, Array, int], Array]

    def __str__(self) -> str:
        return self.name


def twin(name: str = "twin", change: Callable[[Scene], Scene] = lambda scene: scene, **faulty: Any) -> Tracer:
    steps = Steps(**faulty)
    return Tracer(
        name,
        lambda scene: reference.trace(change(scene), steps),
        lambda scene, o, d: reference.trace_rays(change(scene), o, d, steps),
        painted_by_twin,
    )


def painted_by_twin(scene: Scene, ends: Any, pixels: Array, outside: int) -> Array:
    shape = scene.film.rows, scene.film.columns
    painted = reference.paint(ends.st.reshape(*shape, 2), ends.status.reshape(shape), pixels, outside=outside)
    return painted.reshape(-1, pixels.shape[2])


def kernels(precision: str) -> Tracer:
    def film(scene: Scene) -> Any:
        raymap = lenscl.trace(scene, precision=precision)
        n = raymap.status.size
        return SimpleNamespace(
            st=raymap.st.reshape(n, 2),
            status=raymap.status.reshape(n),
            events=raymap.events.reshape(n),
            origin=raymap.origin.reshape(n, 3),
            direction=raymap.direction.reshape(n, 3),
        )

    def paint(scene: Scene, _ends: Any, pixels: Array, outside: int) -> Array:
        return lenscl.paint(lenscl.trace(scene, precision=precision), pixels, outside=outside).reshape(
            -1, pixels.shape[2]
        )

    return Tracer(precision, film, lambda scene, o, d: lenscl.trace_rays(scene, o, d, precision=precision), paint)


SOUND = [twin(), kernels("double"), kernels("single")]
Check = Callable[[Tracer], None]


def unit(v: Any) -> Array:
    v = np.asarray(v, float)
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


# Q1: the exit's square root


def q1_a_null_lens_is_the_identity_and_exits_obey_snell(tracer: Tracer) -> None:
    scene = make_scene({"surface": "torus", "n": 1.0}, film={"size": [32, 32]})
    straight = make_scene({"surface": "torus", "n": 1.0, "centre": [0.0, 50.0, 0.0]}, film={"size": [32, 32]})
    bent, free = tracer.film(scene), tracer.film(straight)
    assert (bent.events > 0).sum() > 100
    assert (free.events == 0).all()
    assert np.abs(bent.st - free.st).max() < 1e-6

    # 40 degrees inside glass of 1.458 leave at asin(1.458 sin 40) = 69.6: from inside a large ball, seen as flat
    ball = make_scene({"surface": "sphere", "n": 1.458, "r": 1.0})
    angle = np.radians(40.0)
    start = np.array([[0.5 * np.sin(angle), 0.0, 1.0 - 0.5 * np.cos(angle)]])
    leg = tracer.rays(ball, start, np.array([[-np.sin(angle), 0.0, np.cos(angle)]]))
    assert np.degrees(np.arccos(leg.direction[0, 2])) == pytest.approx(
        np.degrees(np.arcsin(1.458 * np.sin(angle))), abs=1e-3
    )


def flipped_root(d: Array, n: Array, eta: Array) -> tuple[Array, Array]:
    c = -np.sum(d * n, axis=1)
    s2 = 1 - c * c
    k = np.where(eta >= 1, 1 + eta**2 * s2, 1 - eta**2 * s2)
    bent = eta[:, None] * d + (eta * c - np.sqrt(np.maximum(k, 0)))[:, None] * n
    return unit(bent), np.zeros(len(d), bool)


# Q2: total reflection


def q2_total_reflection_has_a_status_and_nothing_is_nan(tracer: Tracer) -> None:
    # An air bubble in glass: total reflection on entry beyond the impact parameter r / n
    scene = make_scene({"surface": "sphere", "n": 1.0, "r": 0.5}, medium=1.5, effects={"total_reflection": "end"})
    height = np.linspace(0.01, 0.49, 97)
    paths = tracer.rays(scene, np.stack([height, 0 * height, 3 + 0 * height], 1), np.tile([0.0, 0.0, -1.0], (97, 1)))
    for array in (paths.st, paths.origin, paths.direction):
        assert np.isfinite(array).all()
    clear = np.abs(height - 0.5 / 1.5) > 1e-6
    np.testing.assert_array_equal((paths.status == RayStatus.TOTAL_REFLECTION)[clear], (height > 0.5 / 1.5)[clear])
    assert (paths.st[paths.status == RayStatus.TOTAL_REFLECTION] == -1).all()


def complex_root(d: Array, n: Array, eta: Array) -> tuple[Array, Array]:
    c = -np.sum(d * n, axis=1)
    root = np.sqrt((1 - eta**2 * (1 - c * c)).astype(complex))
    return np.real(eta[:, None] * d + (eta * c - root)[:, None] * n), np.zeros(len(d), bool)


# Q3: no exit found


def q3_a_ray_that_finds_no_exit_is_undecided(tracer: Tracer) -> None:
    # F is no number in a ball round the south pole of the sphere: what goes there cannot be followed out
    expression = "x**2 + y**2 + z**2 - 1 + 1e-9 * sqrt(x**2 + y**2 + (z + 1)**2 - h**2)"
    scene = make_scene({"surface": expression, "h": 0.3, "bounds": [[-1.2] * 3, [1.2] * 3], "n": 1.0})
    height = np.array([0.0, 0.1, 0.2, 0.5, 0.7])
    paths = tracer.rays(scene, np.stack([height, 0 * height, 3 + 0 * height], 1), np.tile([0.0, 0.0, -1.0], (5, 1)))
    assert (paths.status[:3] == RayStatus.UNDECIDED).all()
    assert (paths.status[3:] == RayStatus.PICTURE).all()
    assert (paths.events[3:] == 2).all()


def passes_unrefracted(*arguments: Any) -> tuple[Array, Array, Array]:
    t, found, undecided = reference.first_root(*arguments)
    return t, found, np.zeros_like(undecided)


# Q4: the side of a surface


def q4_the_side_is_known_however_thin_the_chord(tracer: Tracer) -> None:
    ball = make_scene({"surface": "sphere", "n": 1.5})
    step = ball.numerics.step
    # Chords through the ball from 0.008 down to 1e-5, all shorter than a step; seen from inside
    chord = np.geomspace(0.8 * step, 1e-5, 40)
    height = np.sqrt(1 - (chord / 2) ** 2)
    start = np.stack([height, 0 * height, 0 * height], 1)
    paths = tracer.rays(ball, start, np.tile([0.0, 0.0, -1.0], (40, 1)))
    assert (paths.status != RayStatus.UNDECIDED).all()
    bounces = tracer.rays(ball.replace({"effects.total_reflection": "end"}), start, np.tile([0.0, 0.0, -1.0], (40, 1)))
    assert (bounces.status == RayStatus.TOTAL_REFLECTION).all(), "they leave at grazing incidence from inside"
    assert (bounces.events == 1).all()

    # A source inside the ball: one exit, bent away from the normal
    inside = np.tile([0.0, 0.0, 0.3], (20, 1))
    angle = np.linspace(0.05, 1.5, 20)
    leaving = tracer.rays(ball, inside, np.stack([np.sin(angle), 0 * angle, np.cos(angle)], 1))
    normal = leaving.origin
    sine_in = 0.3 * np.sin(angle)  # law of sines, r = 1
    assert (leaving.events == 1).all()
    cosine = np.sum(leaving.direction * normal, axis=1)
    np.testing.assert_allclose(cosine, np.sqrt(1 - (1.5 * sine_in) ** 2), atol=2e-6)


def guessed_side(
    f: Any, origin: Array, direction: Array, length: Array, inside: Array, departs: Array, step: float
) -> Any:
    side = f(origin + 0.01 * direction) < 0
    return reference.first_root(f, origin, direction, length, side, departs, step)


# Q5: chords shorter than a step


def q5_a_march_finer_than_the_lens_loses_no_chord(tracer: Tracer) -> None:
    assert "one step" in METHODS["march"].guarantee, "march says what it may lose"
    lost = {}
    for thickness in (0.032, 0.016, 0.008):
        lens = {"surface": "ellipsoid", "r": 0.8, "stretch": [1.0, 1.0, thickness / 1.6]}
        for step in (0.01, thickness / 64):
            scene = make_scene(lens, film={"size": [40, 40], **UP}, numerics={"method": "march", "step": step})
            lost[thickness, step] = share_lost(tracer.film(scene), scene, thickness)
    for thickness in (0.032, 0.016, 0.008):
        assert lost[thickness, thickness / 64] <= 0.01
    assert lost[0.032, 0.01] > 0.01
    assert lost[0.008, 0.01] > 0.9, "the default step loses what is thinner than itself, as it says"


def share_lost(ends: Any, scene: Scene, thickness: float) -> float:
    """Return the share of film rays through the ellipsoid that met nothing."""
    origin, direction = reference.film_rays(scene)
    scale = np.array([0.8, 0.8, thickness / 2])
    o, d = origin / scale, direction / scale
    discriminant = np.sum(o * d, 1) ** 2 - np.sum(d * d, 1) * (np.sum(o * o, 1) - 1)
    hits = discriminant > 0
    assert hits.sum() > 300
    return float((ends.events[hits] == 0).mean())


def fixed_step(*arguments: Any) -> Any:
    return reference.first_root(*arguments[:-1], 0.01)


# Q6: a limit of events


def q6_a_ray_caught_for_ever_is_trapped_at_the_limit(tracer: Tracer) -> None:
    ball = make_scene({"surface": "sphere", "n": 1.5}, numerics={"max_events": 7})
    start = np.array([[0.9, 0.0, 0.0]])
    caught = tracer.rays(ball, start, np.array([[0.0, 1.0, 0.0]]))
    assert caught.status[0] == RayStatus.TRAPPED
    assert caught.events[0] == 7
    # A ray that leaves at exactly the limit lands
    through = tracer.rays(
        ball.replace({"numerics.max_events": 2}), np.array([[0.1, 0.0, 3.0]]), np.array([[0.0, 0.0, -1.0]])
    )
    assert through.status[0] == RayStatus.PICTURE
    assert through.events[0] == 2


def no_limit(scene: Scene) -> Scene:
    return scene.replace({"numerics.max_events": 255})


# Q7: the tube radius of the torus


def q7_the_tubes_radius_is_r(tracer: Tracer) -> None:
    scene = make_scene({"surface": "torus", "R": 0.6, "r": 0.2, "n": 1.5})
    x = np.array([0.39, 0.41, 0.6, 0.79, 0.81])
    down = tracer.rays(scene, np.stack([x, 0 * x, 2 + 0 * x], 1), np.tile([0.0, 0.0, -1.0], (5, 1)))
    assert (down.events > 0).tolist() == [False, True, True, True, False]
    across = tracer.rays(scene, np.array([[2.0, 0.0, 0.19], [2.0, 0.0, 0.21]]), np.tile([-1.0, 0.0, 0.0], (2, 1)))
    assert (across.events > 0).tolist() == [True, False]


def tube_unsquared(scene: Scene) -> Scene:
    values = scene.lenses[0].values
    text = "(sqrt(x**2 + y**2) - R)**2 + z**2 - r"
    reach = values["R"] + 1.0
    lens = {"surface": text, "R": values["R"], "r": values["r"], "bounds": [[-reach] * 3, [reach] * 3], "n": 1.5}
    return make_scene(lens)


# Q8: stretch


def q8_every_surface_is_stretched_alike(tracer: Tracer) -> None:
    """The silhouette along each axis is the unit silhouette times the stretch."""
    stretch = np.array([1.5, 0.7, 0.4])
    seen = 0
    for name in CATALOGUE:
        unit_lens = make_scene({"surface": name, "n": 1.0})
        stretched = make_scene({"surface": name, "n": 1.0, "stretch": stretch.tolist()})
        low, high = (np.array(corner) for corner in unit_lens.lenses[0].surface.box(unit_lens.lenses[0].values))
        grid = (np.arange(24) + 0.5) / 24
        for along in range(3):
            a, b = (along + 1) % 3, (along + 2) % 3
            points = np.empty((24 * 24, 3))
            points[:, a] = np.repeat(low[a] + (high[a] - low[a]) * grid, 24)
            points[:, b] = np.tile(low[b] + (high[b] - low[b]) * grid, 24)
            points[:, along] = high[along] + 1.0
            direction = np.zeros((24 * 24, 3))
            direction[:, along] = -1.0
            hit_unit = tracer.rays(unit_lens, points, direction).events > 0
            hit_stretched = tracer.rays(stretched, points * stretch, direction).events > 0
            # Chords near a silhouette may be shorter than a step of the march in one and not in the other
            assert (hit_unit != hit_stretched).mean() < 0.01, f"{name} along axis {along}"
            seen += int(hit_unit.sum())
    assert seen > 3000


def squared_stretch(lens: Any) -> reference.Placement:
    placement = reference.Placement.of(lens)
    return replace(placement, stretch=placement.stretch**2)


# Q9: rows and columns


def q9_films_and_pictures_of_any_shape(tracer: Tracer) -> None:
    away = {"surface": "sphere", "centre": [0.0, 40.0, 0.0]}
    pixels = 0
    for columns, rows in ((3, 7), (7, 3), (1, 5), (5, 1), (1, 1), (17, 4)):
        scene = make_scene(
            away,
            film={
                "size": [columns, rows],
                "corner": [-0.3, 0.2, 2.5],
                "right": [0.7, 0.1, 0.0],
                "down": [0.0, -0.4, 0.1],
            },
            picture={
                "size": [320, 200],
                "corner": [-3.0, 2.0, -2.5],
                "right": [6.0, 0.0, 0.0],
                "down": [0.0, -4.0, 0.0],
            },
        )
        ends = tracer.film(scene)
        assert ends.st.shape == (rows * columns, 2)
        for row in range(rows):
            for column in range(columns):
                x = -0.3 + 0.7 * (column + 0.5) / columns
                y = 0.2 + 0.1 * (column + 0.5) / columns - 0.4 * (row + 0.5) / rows
                z = 2.5 + 0.1 * (row + 0.5) / rows
                reach = (4.0 + 2.5) / (4.0 - z)
                expected = (reach * x + 3.0) / 6.0, (2.0 - reach * y) / 4.0
                assert ends.st[row * columns + column] == pytest.approx(expected, abs=1e-6)
                pixels += 1
    assert pixels == 21 + 21 + 5 + 5 + 1 + 68


def mixed_up(scene: Scene) -> tuple[Array, Array]:
    film = scene.film
    return reference.film_rays(scene.replace({"film.size": [film.rows, film.columns]}))


# Q10: the picture's edges


def q10_the_picture_is_half_open(tracer: Tracer) -> None:
    scene = make_scene(
        {"surface": "sphere", "centre": [0.0, 40.0, 0.0]},
        picture={"corner": [0.0, 4.0, -2.0], "right": [4.0, 0.0, 0.0], "down": [0.0, -4.0, 0.0]},
    )
    x = np.array([0.0, 2.0, 4.0, 2.0, 2.0, 0.0, 4.0])
    y = np.array([2.0, 2.0, 2.0, 4.0, 0.0, 4.0, 0.0])
    ends = tracer.rays(scene, np.stack([x, y, 0 * x], 1), np.tile([0.0, 0.0, -1.0], (7, 1)))
    np.testing.assert_array_equal(ends.st, np.stack([x / 4, (4 - y) / 4], 1))
    on = ends.status == RayStatus.PICTURE
    assert on.tolist() == [True, True, False, True, False, True, False]
    assert (ends.status[~on] == RayStatus.OFF_PICTURE).all()


def closed_edges(origin: Array, direction: Array, picture: Any) -> tuple[Array, Array]:
    st, status = reference.land(origin, direction, picture)
    status[((st >= 0) & (st <= 1)).all(axis=1) & (status != RayStatus.BEHIND)] = RayStatus.PICTURE
    return np.where(st == 0, 1.0, st), status


# Q11: screens behind the ray or along it


def q11_a_screen_behind_or_along_the_ray_is_not_hit(tracer: Tracer) -> None:
    scene = make_scene({"surface": "sphere", "centre": [0.0, 40.0, 0.0]})
    directions = unit([[0, 0, -1], [0, 0, 1], [1, 0, 0], [0, -1, 0], [0.1, 0.1, 1], [1, 0, -1e-31]])
    ends = tracer.rays(scene, np.zeros((6, 3)), directions)
    expected = [RayStatus.PICTURE] + [RayStatus.BEHIND] * 5
    assert ends.status.tolist() == expected
    assert (ends.st[1:] == -1).all()


def any_distance(origin: Array, direction: Array, picture: Any) -> tuple[Array, Array]:
    st, status = reference.land(origin, direction, picture)
    back, backward = reference.land(origin, -direction, picture)
    hit = (status == RayStatus.BEHIND) & (backward != RayStatus.BEHIND)
    return np.where(hit[:, None], back, st), np.where(hit, backward, status)


# Q12: a swept screen stays where the study holds it


def q12_a_swept_size_keeps_what_the_study_holds_fixed(tracer: Tracer) -> None:
    away = {"surface": "sphere", "centre": [0.0, 40.0, 0.0]}
    held = make_scene(away, film={"size": [3, 3], "centre": [0.1, 0.2, 2.5]})
    for scale in (0.25, 1.0, 3.0):
        ends = tracer.film(held.replace({"film.scale": scale}))
        reach = 6.5 / 1.5
        assert ends.st[4] == pytest.approx(((reach * 0.1 + 3) / 6, (3 - reach * 0.2) / 6), abs=1e-6), "the centre pixel"
        corner = 0.1 - scale * 1.3 / 3, 0.2 + scale * 1.3 / 3
        assert ends.st[0] == pytest.approx(((reach * corner[0] + 3) / 6, (3 - reach * corner[1]) / 6), abs=1e-6)


def corner_held(scene: Scene) -> Scene:
    """Grow the film from its corner, whatever the study says."""
    scale = scene.film.scale
    unscaled = scene.replace({"film.scale": 1.0})
    spans = {f"film.{name}": [scale * x for x in getattr(unscaled.film, name)] for name in ("right", "down")}
    centre = np.array(unscaled.film.corner) + sum(np.array(span) for span in spans.values()) / 2
    return unscaled.replace({**spans, "film.centre": centre.tolist()})


# Q13: a miss is told from black content


def q13_a_miss_has_a_status_and_the_users_colour(tracer: Tracer) -> None:
    scene = make_scene(
        {"surface": "sphere"}, film={"size": [24, 24]}, picture={"right": [2.0, 0, 0], "down": [0, -2.0, 0]}
    )
    ends = tracer.film(scene)
    landed = ends.status == RayStatus.PICTURE
    assert 20 < landed.sum() < 500
    black = np.zeros((4, 4, 3), np.uint8)
    painted = tracer.paint(scene, ends, black, 200)
    assert (painted[landed] == 0).all()
    assert (painted[~landed] == 200).all()


def black_outside(scene: Scene, ends: Any, pixels: Array, _outside: int) -> Array:
    return painted_by_twin(scene, ends, pixels, 0)


CASES: list[tuple[Check, Tracer]] = [
    (q1_a_null_lens_is_the_identity_and_exits_obey_snell, twin("flipped root", refract=flipped_root)),
    (q2_total_reflection_has_a_status_and_nothing_is_nan, twin("complex root", refract=complex_root)),
    (q3_a_ray_that_finds_no_exit_is_undecided, twin("passes unrefracted", first_root=passes_unrefracted)),
    (q4_the_side_is_known_however_thin_the_chord, twin("guessed side", first_root=guessed_side)),
    (q5_a_march_finer_than_the_lens_loses_no_chord, twin("fixed step", first_root=fixed_step)),
    (q6_a_ray_caught_for_ever_is_trapped_at_the_limit, twin("no limit", change=no_limit)),
    (q7_the_tubes_radius_is_r, twin("tube unsquared", change=tube_unsquared)),
    (q8_every_surface_is_stretched_alike, twin("squared stretch", placement=squared_stretch)),
    (q9_films_and_pictures_of_any_shape, twin("mixed up", film_rays=mixed_up)),
    (q10_the_picture_is_half_open, twin("closed edges", land=closed_edges)),
    (q11_a_screen_behind_or_along_the_ray_is_not_hit, twin("any distance", land=any_distance)),
    (q12_a_swept_size_keeps_what_the_study_holds_fixed, twin("corner held", change=corner_held)),
    (q13_a_miss_has_a_status_and_the_users_colour, replace(twin("black outside"), paint=black_outside)),
]


@pytest.mark.parametrize("tracer", SOUND, ids=str)
@pytest.mark.parametrize("check", [check for check, _ in CASES], ids=lambda check: check.__name__)
def test_the_fault_is_absent(check: Check, tracer: Tracer) -> None:
    check(tracer)


@pytest.mark.parametrize(("check", "broken"), CASES, ids=lambda value: getattr(value, "__name__", str(value)))
def test_the_fault_is_seen_when_put_back(check: Check, broken: Tracer) -> None:
    with pytest.raises(AssertionError):
        check(broken)
