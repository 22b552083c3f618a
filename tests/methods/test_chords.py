"""Convex quadrics are entered and left without a box: every ray against exact rational arithmetic.

The rays run along an axis, so neither their direction nor the way into local space rounds anything, and the lens has
the medium's index, so they go straight on: what is met, and where, follows from the given numbers alone.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from probe import Probe

import lenscl
from lenscl import RayStatus
from lenscl.codegen import fragment
from lenscl.codegen.surfaces import surface_functions
from lenscl.lenses import surface

SCENE = """
[source]
kind = "point"
at = [0, 0, -9]
[film]
centre = [0, 0, -8]
right = [1, 0, 0]
down = [0, 1, 0]
size = [1, 1]
[picture]
centre = [0, 0, 1e12]
right = [1, 0, 0]
down = [0, 1, 0]
[medium]
n = 1.0
[[lens]]
surface = "ellipsoid"
a = {0}
b = {1}
c = {2}
n = 1.0
"""
AXES = {"round": (1.0, 0.75, 0.5), "flat": (1.0, 0.75, 2.0**-9), "thin": (2.0**-9, 0.75, 1.0), "tiny": (2.0**-21,) * 3}
EPSILON = {"single": 2.0**-23, "double": 2.0**-52}
COUNT = 4000
TRACED_AGAIN = {"single": 0.65, "double": 0.2}  # shares; faults give more, for the parity of events tells them

Array = NDArray[np.float64]


def rays(axes: tuple[float, float, float], precision: str, seed: int) -> tuple[Array, Array]:
    """Return rays along z or against it: past, through, tangent and from inside, from near and from far."""
    rng = np.random.default_rng(seed)
    a, b, c = axes
    depth = rng.choice([-1.0, 1.0], COUNT) * 10.0 ** rng.uniform(-16, 0, COUNT)
    radius, angle = np.sqrt(1 - depth), rng.uniform(0, 2 * np.pi, COUNT)
    x, y = a * radius * np.cos(angle), b * radius * np.sin(angle)
    within = rng.random(COUNT) < 0.25
    away = c * np.where(within, rng.uniform(-1, 1, COUNT), -(10.0 ** rng.uniform(0, 4, COUNT)))
    turned = rng.choice([-1.0, 1.0], COUNT)
    origins = np.stack([x, y, turned * away], axis=1)
    if precision == "single":
        origins = origins.astype(np.float32).astype(np.float64)
    return origins, np.stack([0 * x, 0 * x, turned], axis=1)


def exact(axes: tuple[float, float, float], origin: Array, forward: float) -> tuple[int, float, float]:
    """Return the events of a ray, F where it is deepest, and F at its origin; all signs are exact."""
    a, b, c = (Fraction(value) for value in axes)
    x, y, z = (Fraction(float(value)) for value in origin)
    deepest = (x / a) ** 2 + (y / b) ** 2 - 1
    start = deepest + (z / c) ** 2
    if start <= 0:
        return 1, float(deepest), float(start)
    return (2 if deepest < 0 and z * Fraction(forward) < 0 else 0), float(deepest), float(start)


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("name", AXES)
def test_rays_meet_an_ellipsoid_as_often_as_exact_arithmetic_says(name: str, precision: Any) -> None:
    axes = AXES[name]
    scene = lenscl.scene_from_toml(SCENE.format(*axes)).replace({"numerics.precision": precision})
    origins, directions = rays(axes, precision, seed=5)
    paths = lenscl.trace_rays(scene, origins, directions)
    wanted = [exact(axes, o, d[2]) for o, d in zip(origins, directions, strict=True)]
    events, deepest, start = (np.array(column) for column in zip(*wanted, strict=True))
    decided = paths.status != RayStatus.UNDECIDED

    # Only what lies within rounding may be undecided: a touch, or a start on the surface
    slack = 64 * EPSILON["double"]  # what single leaves undecided is traced again in double
    assert (np.minimum(np.abs(deepest), np.abs(start))[~decided] < slack).all()
    assert decided.mean() > 0.9
    assert paths.escalated < TRACED_AGAIN[precision] * COUNT
    assert {int(count) for count in events[decided]} == {0, 1, 2}
    np.testing.assert_array_equal(paths.events[decided], events[decided])

    # Both ends of a chord are on the surface, on their own sides of the solid
    stopped = lenscl.trace_rays(scene.replace({"numerics.max_events": 1}), origins, directions)
    leaves, enters = decided & (events > 0), decided & (events == 2)
    assert (stopped.status[enters] == RayStatus.TRAPPED).all()
    for ends, chosen, side in ((paths, leaves, 1.0), (stopped, enters, -1.0)):
        on = (ends.origin[chosen] / np.array(axes)) ** 2
        np.testing.assert_allclose(on.sum(axis=1), 1.0, atol=24 * EPSILON[precision], rtol=0)
        assert (ends.origin[chosen, 2] * directions[chosen, 2] * side > 0).all()


def test_the_last_root_before_and_the_first_behind_the_origin_are_told_apart() -> None:
    """A ray that starts just outside, before or behind the solid: the roots lie on one side of it."""
    scene = lenscl.scene_from_toml(SCENE.format(1.0, 0.75, 0.5))
    gaps = 2.0 ** -np.arange(4.0, 44.0)
    for side, events in ((-1.0, 2), (1.0, 0)):
        origins = np.stack([0 * gaps, 0 * gaps, side * (0.5 + gaps)], axis=1)
        paths = lenscl.trace_rays(scene, origins, np.array([[0.0, 0.0, 1.0]] * len(gaps)))
        assert (paths.events == events).all()


@pytest.mark.parametrize("precision", ["single", "double", "mixed"])
def test_no_ray_depends_on_the_others_of_its_packet(precision: Any) -> None:
    turned = SCENE.replace("n = 1.0\n[[lens]]", "n = 1.0\n[[lens]]\nrotate = [20, 30, 40]")
    scene = lenscl.scene_from_toml(turned.format(1.0, 0.75, 0.5)).replace(
        {"numerics.precision": precision, "lens.n": 1.5, "numerics.max_events": 16}
    )
    rng = np.random.default_rng(8)
    origins = np.where(rng.random((3000, 1)) < 0.3, 0.3, 4.0) * rng.normal(size=(3000, 3))
    directions = rng.normal(size=(3000, 3)) * 0.3 - origins
    shuffled = rng.permutation(3000)
    paths = lenscl.trace_rays(scene, origins, directions)
    others = lenscl.trace_rays(scene, origins[shuffled], directions[shuffled])
    assert {0, 1, 2} <= set(paths.events.tolist())
    for name in ("events", "status", "origin", "direction", "st"):
        np.testing.assert_array_equal(getattr(paths, name)[shuffled], getattr(others, name))


class Chords:
    """The chords alone: a ray that the box would be asked for is not certain here, and nothing else is done for it."""

    def __init__(self, precision: str, edit: Callable[[str], str] | None = None) -> None:
        ellipsoid = surface("ellipsoid")
        before = "\n".join(
            [
                "typedef struct { real none; } method_t;\ntypedef struct { real none; } lens_t;",
                fragment("search.cl"),
                "typedef struct { real a, b, c, r; } s_t;",
                surface_functions("s", ellipsoid, ["along"], precision),  # type: ignore[arg-type]
                "#define SURFACE(name) s_##name",
                fragment("polynomial_ray.cl"),
                "static inline root_t s_root_in_box(const lens_t *lens, search_t *search, s_t shape,"
                " const method_t *method, realv *from) {"
                " root_t root = no_root(); root.undecided = search->lanes; *from = (realv)0; return root; }",
                edit(fragment("ahead_chord.cl")) if edit else fragment("ahead_chord.cl"),
            ]
        )
        body = """
  s_t shape = {(real)1, (real)0.75, (real)0.5, (real)1};
  lens_t lens;
  method_t method;
  search_t search;
  search.origin.x = in_0; search.origin.y = in_1; search.origin.z = in_2;
  search.direction.x = in_3; search.direction.y = in_4; search.direction.z = in_5;
  search.length = (realv)0;
  search.inside = in_6 > (realv)0;
  search.departs = search.inside;
  search.lanes = in_6 == in_6;
  realv from;
  const root_t root = s_root_ahead(&lens, &search, shape, &method, &from);
  out_0 = from + root.t;
  out_1 = root.found ? (realv)1 : (realv)0;
  out_2 = root.undecided ? (realv)1 : (realv)0;"""
        self._probe = Probe((), body, 7, 3, precision, 8, before, is_plain=edit is not None)

    def __call__(self, o: Array, d: Array, entered: Any) -> tuple[Array, Any, Any]:
        out = self._probe(*o.T, *d.T, np.asarray(entered, float))
        return out[:, 0], out[:, 1] > 0, out[:, 2] == 0


def exact_quadratic(o: Array, d: Array) -> tuple[Fraction, Fraction, Fraction]:
    """Return the coefficients of F along a ray."""
    axes = [Fraction(value) for value in AXES["round"]]
    u, v = ([Fraction(float(x)) / a for x, a in zip(w, axes, strict=True)] for w in (o, d))
    pairs = list(zip(u, v, strict=True))
    return sum((a * a for a in u), Fraction(-1)), 2 * sum(a * b for a, b in pairs), sum((b * b for b in v), Fraction(0))


def judged(chords: Chords, precision: str) -> tuple[float, int]:
    """Return the share of hostile rays that were certain, and how many of these are wrong."""
    dtype = np.float32 if precision == "single" else np.float64
    rng = np.random.default_rng(4)
    axes = np.array(AXES["round"])
    on, off = rng.normal(size=(2, COUNT, 3))
    on, off = (each / np.linalg.norm(each, axis=1, keepdims=True) for each in (on, off))
    across = np.cross(on, off)

    # Towards a point of the surface, off its tangent by an angle of any size, and from any distance, or from it on
    slope = 10.0 ** rng.uniform(-9, 0, (COUNT, 1)) * rng.choice([-1.0, 1.0], (COUNT, 1))
    d = axes * (across + slope * on)
    away = np.where(
        rng.random((COUNT, 1)) < 0.1, 10.0 ** rng.uniform(-8, 0, (COUNT, 1)), 10.0 ** rng.uniform(0, 3, (COUNT, 1))
    )
    entered = (np.arange(COUNT) // 16) % 2 == 0
    o = np.where(entered[:, None], axes * on, axes * on * (1 + 10.0 ** rng.uniform(-9, 0, (COUNT, 1))) - away * d)
    o, d = (each.astype(dtype).astype(np.float64) for each in (o, d))
    t, found, certain = chords(o, d, entered)
    wrong = 0
    for k in np.flatnonzero(certain):
        c0, c1, c2 = exact_quadratic(o[k], d[k])
        if entered[k]:
            root = -c1 / c2
            exists, near = root > 0, abs(Fraction(float(t[k])) - root) * 2 <= root
        else:
            if c0 <= 0:
                continue  # starts inside: nobody asks
            square = c1 * c1 / 4 - c0 * c2
            exists = square > 0 and c1 < 0
            point = Fraction(float(t[k]))
            rounding = Fraction(64 * EPSILON[precision]) * (1 + abs(c0))
            first = 2 * c2 * point <= -c1 * (1 + Fraction(4 * EPSILON[precision]))
            near = (first and abs(c0 + point * (c1 + point * c2)) <= rounding) or not exists
        wrong += bool(found[k]) != exists or not near
    return float(certain.mean()), wrong


@pytest.mark.parametrize(("precision", "share"), [("single", 0.2), ("double", 0.65)])
def test_what_is_certain_of_a_chord_is_right_in_exact_arithmetic(precision: str, share: float) -> None:
    certain, wrong = judged(Chords(precision), precision)
    assert certain > share
    assert wrong == 0


@pytest.mark.parametrize(
    ("whole", "broken"),
    [
        ("(realv)4 * noise) & (b", "(realv)-1 * noise) & (b"),
        (" & (middle > (realv)0)", ""),
        ("-(b + reach)", "(reach - b)"),
        ("(root->t > (realv)0) & (term > (realv)2 * noise)", "(root->t == root->t)"),
        ("root->t = -c[1] / c[2];", "root->t = (realv)-2 * c[1] / c[2];"),
    ],
)
def test_faults_in_the_chords_are_seen(whole: str, broken: str) -> None:
    def edit(text: str) -> str:
        assert whole in text
        return text.replace(whole, broken)

    _, wrong = judged(Chords("single", edit), "single")
    assert wrong > 0
