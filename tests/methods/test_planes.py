"""Convex polyhedra searched by their planes: against clipping in long double, and at their edges."""

from __future__ import annotations

import re
from typing import Any

import hypothesis.strategies as st
import numpy as np
import pytest
from faults_in_kernels import Fault, broken
from hypothesis import given, settings
from lenses import analytic
from numpy.typing import NDArray
from scenes import make_scene

from lenscl import RayStatus, compile_count, trace, trace_rays
from lenscl.config import Scene
from lenscl.errors import StudyError
from lenscl.expr import evaluate, parse
from lenscl.expr.planar import planes_of
from lenscl.lenses import surface, user_surface
from lenscl.methods import METHODS, choose
from lenscl.reference.oracle import prove_rays
from lenscl.tracing.structure import methods_of

Array = NDArray[Any]
RAYS = 600
MOST = 16
OCTAHEDRON = [[a, b, c, 1.0] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]
CUBE = [[*(side * float(i == j) for j in range(3)), 0.5] for i in range(3) for side in (1, -1)]
BOUNDS = ((-2.0, -2.0, -2.0), (2.0, 2.0, 2.0))


def scene_of(planes: Any, **how: Any) -> Scene:
    lens = {"surface": "polyhedron", "planes": [[float(x) for x in row] for row in planes]}
    return make_scene(lens | how, numerics={"max_events": MOST})


def faces_of(planes: Any) -> list[analytic.Face]:
    table = np.asarray(planes, np.longdouble)
    size = np.linalg.norm(table[:, :3].astype(float), axis=1).astype(np.longdouble)
    size *= np.sqrt((table[:, :3] ** 2).sum(1)) / size  # the length in long double
    return [analytic.Plane(tuple(row[:3] / length), row[3] / length) for row, length in zip(table, size, strict=True)]


def random_planes(seed: int, count: int) -> Array:
    """Return planes about the origin that enclose a solid: six of a skewed box, and others; normals of any length."""
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(count, 3))
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    normals[:6] = np.concatenate([turn, -turn]) + 0.1 * rng.normal(size=(6, 3))
    normals *= 10.0 ** rng.uniform(-3, 3, (count, 1))
    distances = np.linalg.norm(normals, axis=1) * rng.uniform(0.3, 0.8, count)
    table = np.column_stack([normals, distances])
    return table[rng.permutation(count)]


def rays_at(rng: np.random.Generator, count: int, reach: float = 1.0) -> tuple[Array, Array]:
    d = rng.normal(size=(count, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    return rng.uniform(-reach, reach, (count, 3)) - 5.0 * d, d


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.sampled_from([7, 20]), n=st.sampled_from([1.5, 0.7, 2.4]))
def test_random_polyhedra_are_those_of_clipping_in_long_double(seed: int, count: int, n: float) -> None:
    planes = random_planes(seed, count)
    scene = scene_of(planes, n=n)
    o, d = rays_at(np.random.default_rng(seed), RAYS)
    want = analytic.trace(faces_of(planes), o, d, n, 1.0, MOST)
    got = trace_rays(scene, o, d)
    sure = ~want.unsure
    assert sure.sum() > 0.9 * RAYS
    assert (want.events[sure] > 0).sum() > 20
    assert not (sure & (got.status == RayStatus.UNDECIDED)).any()
    np.testing.assert_array_equal(got.events[sure], want.events[sure])
    few = sure & (want.events <= 4)
    assert np.abs(got.origin - want.origin)[few].max() < 1e-11
    assert np.abs(got.direction - want.direction)[few].max() < 1e-11


def test_the_search_that_was_asked_for_by_name_agrees() -> None:
    planes = random_planes(3, 7)
    scene = scene_of(planes)
    assert [method.name for method in methods_of(scene)] == ["planes"]
    o, d = rays_at(np.random.default_rng(1), RAYS)
    by_planes, by_bounds = trace_rays(scene, o, d), trace_rays(scene, o, d, method="interval")
    decided = by_bounds.status != RayStatus.UNDECIDED
    assert decided.sum() > 0.99 * RAYS
    np.testing.assert_array_equal(by_planes.status[decided], by_bounds.status[decided])
    np.testing.assert_array_equal(by_planes.events[decided], by_bounds.events[decided])
    assert np.abs(by_planes.origin - by_bounds.origin)[decided].max() < 1e-9
    with pytest.raises(StudyError, match=r'"planes" searches convex polyhedra, and lens\[0\] \(torus\) is none'):
        trace_rays(make_scene({"surface": "torus"}), o, d, method="planes")
    assert choose("auto", is_polynomial=False, is_polyhedron=True) is METHODS["planes"]
    assert choose("planes", is_polynomial=True) is None


def aimed_at_edges(count: int) -> tuple[Scene, list[analytic.Face], Array, Array, Array]:
    """Return a turned cube, and rays that pass its edges or corners at 1e-17 to 0.1; and how far from them."""
    rng = np.random.default_rng(5)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    planes = [[*row, 0.5] for row in np.concatenate([turn, -turn])]
    p = rng.uniform(-0.5, 0.5, (count, 3))
    which = rng.permuted(np.tile([0, 1, 2], (count, 1)), axis=1)[:, :2]
    for column in (0, 1):
        p[np.arange(count), which[:, column]] = rng.choice([-0.5, 0.5], count)
    off = np.where(rng.random(count) < 0.1, 0.0, 10.0 ** rng.uniform(-17, -1, count))
    p += off[:, None] * rng.normal(size=(count, 3))
    d = rng.normal(size=(count, 3))
    d[::5, 0] = 0.0  # in the plane of a face, or nearly
    d[1::5, 0] *= 10.0 ** rng.uniform(-17, -11, len(d[1::5]))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    o = p - np.where(rng.random((count, 1)) < 0.7, 3.0, 0.2) * d
    outside = np.abs(o).max(1) > 0.5 + 1e-6
    return scene_of(planes), faces_of(planes), (o @ turn)[outside], (d @ turn)[outside], off[outside]


@pytest.mark.parametrize("precision", ["double", "single"])
def test_rays_aimed_at_edges_and_corners_are_right_or_undecided(precision: str) -> None:
    scene, faces, o, d, off = aimed_at_edges(4000)
    want = analytic.trace(faces, o, d, 1.5, 1.0, MOST)
    got = trace_rays(scene, o, d, precision=precision)
    undecided, sure = got.status == RayStatus.UNDECIDED, ~want.unsure
    assert undecided.sum() > 20, "some are at an edge"
    assert not (undecided & (off > 1e-9) & sure).any(), "what single does not decide is traced again in double"
    assert (sure & ~undecided).sum() > 1000
    if precision == "double":
        assert not (sure & ~undecided & (got.events != want.events)).any()


def test_nearer_to_an_edge_than_closed_forms_tell_balls_agree_and_a_search_without_its_check_fails() -> None:
    scene, _, o, d, off = aimed_at_edges(1500)
    near = np.flatnonzero(off < 1e-14)[:70]
    o, d = o[near], d[near]
    proofs = prove_rays(scene, o, d, radius=1e-9, most_bits=192)

    def wrong() -> tuple[int, int]:
        got = trace_rays(scene, o, d)
        judged = faults = 0
        for proof, status, events, place in zip(proofs, got.status, got.events, got.st, strict=True):
            if proof.status is None or status == RayStatus.UNDECIDED:
                continue
            judged += 1
            lands = proof.status in (RayStatus.PICTURE, RayStatus.OFF_PICTURE)
            faults += (proof.status, proof.events) != (status, events) or (lands and proof.distance(*place) > 1e-6)
        return judged, faults

    judged, faults = wrong()
    assert judged > 5
    assert faults == 0
    check = "SURFACE(second_value)(shape, p) + share + moved < (realv)0;"
    with broken(Fault("no look at the other planes", "search_planes.cl", check, "(maskv)-1;")):
        judged, faults = wrong()
    assert judged > 25
    assert faults > 3


@pytest.mark.parametrize("precision", ["single", "double", "mixed"])
@pytest.mark.parametrize(
    ("inner", "status", "events"),
    [
        ({"mirror": True}, RayStatus.BEHIND, 2),
        ({"n": 1.0}, RayStatus.BEHIND, 3),
        ({"absorbs": True}, RayStatus.BLOCKED, 1),
    ],
)
def test_an_edge_behind_what_is_met_first_is_no_doubt(
    inner: dict[str, Any], status: RayStatus, events: int, precision: str
) -> None:
    """A ray meets a ball in a cube, beyond which it would leave by an edge; and one before a cube's edge."""
    ball = {"name": "ball", "surface": "sphere", "r": 0.15, "centre": [0.5, 0.55, 0.0], **inner}
    cube = {"name": "cube", "surface": "box", "a": 2.0, "b": 2.0, "c": 2.0}
    within = trace_rays(make_scene(cube, ball), [[0.0, 0.0, 0.0]], [[1.0, 1.0, 0.0]], precision=precision)
    assert (within.status[0], within.events[0]) == (status, events)
    stop = {"name": "stop", "surface": "sphere", "r": 0.3, "centre": [0.0, 0.0, 2.5], "absorbs": True}
    turned = trace_rays(
        make_scene(stop, cube | {"rotate": [45, 0, 0]}), [[0.1, 0, 4]], [[0, 0, -1]], precision=precision
    )
    assert (turned.status[0], turned.events[0]) == (RayStatus.BLOCKED, 1)


def test_a_ray_that_misses_is_decided_wherever_it_passes() -> None:
    """Also in the plane of a face, beside it: the others tell."""
    scene = scene_of(OCTAHEDRON)
    o = np.array([[-3.4, 4.6, -0.2], [0.0, 0.6, 5.0], [1.5, -0.5, 5.0], [0.9, 0.9, 3.0]])
    d = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0], [0.0, 0.0, -1.0], [0.0, 0.0, -1.0]])
    got = trace_rays(scene, o, d)
    assert (got.events == 0).all()
    assert not (got.status == RayStatus.UNDECIDED).any()


def test_redundant_and_repeated_planes_change_nothing() -> None:
    """One far away, one that is given twice, one longer, and one that touches an edge from outside."""
    o, d = rays_at(np.random.default_rng(7), RAYS, 0.6)
    plain = trace_rays(scene_of(CUBE), o, d)
    more = [*CUBE, [1.0, 1.0, 1.0, 90.0], [1.0, 0.0, 0.0, 0.5], [0.0, 3.0, 0.0, 1.5], [0.0, 0.0, -1.0, 0.75]]
    same = trace_rays(scene_of(more), o, d)
    np.testing.assert_array_equal(plain.status, same.status)
    np.testing.assert_array_equal(plain.events, same.events)
    assert np.abs(plain.origin - same.origin).max() < 1e-14
    touching = trace_rays(scene_of([*CUBE, [1.0, 1.0, 0.0, 1.0]]), o, d)
    np.testing.assert_array_equal(plain.status, touching.status)


def test_a_sweep_over_planes_compiles_once_and_text_does_not_grow_with_them() -> None:
    trace(scene_of(OCTAHEDRON).replace({"film.size": [16, 16]}))
    before = compile_count()
    for d in (0.7, 0.8, 0.9):
        scene = scene_of(OCTAHEDRON).replace({"lens.planes": [[*row[:3], d] for row in OCTAHEDRON]})
        assert scene.lenses[0].surface.box(scene.lenses[0].values)[1][0] == pytest.approx(d, rel=1e-5)
        trace(scene.replace({"film.size": [16, 16]}))
    assert compile_count() == before
    texts = [trace(scene_of(random_planes(1, n)).replace({"film.size": [8, 8]})).kernel.text for n in (7, 20)]
    assert abs(len(texts[0]) - len(texts[1])) < 10
    small, large = (re.sub(r"\b(7|20|42|120)\b", "N", " ".join(text.split())) for text in texts)
    assert small == large


@pytest.mark.parametrize("precision", ["double", "mixed"])
def test_effects_know_flat_faces(precision: str) -> None:
    """The Jacobian, which asks for second derivatives, against differences of places; transmittance is there, too."""
    scene = make_scene(
        {"surface": "brilliant", "n": 1.4, "rotate": [20.0, 10.0, 0.0]},
        effects={"footprint": True, "fresnel": True},
        numerics={"precision": precision},
        film={"size": [24, 24], "right": [0.4, 0.0, 0.0], "down": [0.0, -0.4, 0.0]},
    )
    found = trace(scene)
    o = np.array(scene.source.at)
    rows, columns = np.nonzero((found.status == RayStatus.PICTURE) & (found.events > 0))
    some = np.random.default_rng(1).choice(len(rows), 40, replace=False)
    corner, right, down = (np.array(v) for v in (scene.film.corner, scene.film.right, scene.film.down))
    size = np.array([scene.film.rows, scene.film.columns])
    checked = 0
    for row, column in zip(rows[some], columns[some], strict=True):
        places = np.array([row, column]) + 0.5 + 1e-4 * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
        ends = corner + (places[:, 1:] / size[1]) * right + (places[:, :1] / size[0]) * down
        paths = trace_rays(scene, np.broadcast_to(o, ends.shape), ends - o)
        if len({*paths.events}) == 1 and (paths.status == RayStatus.PICTURE).all():
            change = np.stack([(paths.st[1] - paths.st[2]), (paths.st[3] - paths.st[4])], 1) / 2e-4
            if np.abs(change).max() < 1e2:
                np.testing.assert_allclose(found.jacobian[row, column], change, rtol=1e-4, atol=1e-6)
                checked += 1
    assert checked >= 20
    assert (found.transmittance[rows, columns] <= 1.0).all()


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("max(abs(x), abs(y), abs(z)) - 0.5", 6),
        ("abs(x) + abs(y) + abs(z) - 1", 8),
        ("max(x - k, -x - 1, k*y - z, z - 1, -y - 2*z - 1, y - 1)", 6),
        ("2*max(x - 1, max(y - 1, -x - y - z)) + max(z, -z) - 1", 6),
        ("-min(1 - x, 1 + x, 1 - y, 1 + y, 1 - z, 1 + z)", 6),
        ("max(x, y, z, -x - y - z - k^2)", 4),
        ("max(x, y, z)", 0),  # encloses nothing
        ("max(x^2 - 1, y, z, -x - y - z)", 0),
        ("max(x*y, y, z, -x, -y - z - 1)", 0),
        ("max(min(x, y), y, z, -x, -y - z - 1)", 0),
        ("max(x, y, z, -x - y - z - 1, -2)", 0),  # a leaf without a normal
        ("max(k*abs(x), y, z, -x, -y - z - 1)", 0),  # k may be negative
        ("max(sin(x), y, z, -x, -y - z - 1)", 0),
        ("x^2 + y^2 + z^2 - 1", 0),
    ],
)
def test_what_is_a_max_of_planes_is_found(text: str, count: int) -> None:
    F = parse(text, ["x", "y", "z", "k"])
    planes = planes_of(F)
    assert len(planes) == count
    if not planes:
        return
    rng = np.random.default_rng(2)
    x, y, z = rng.normal(size=(3, 500))
    values = {"k": 0.7, "x": x, "y": y, "z": z}
    most = np.max([evaluate(a, values) * x + evaluate(b, values) * y + evaluate(c, values) * z - evaluate(d, values)
                   for a, b, c, d in planes], axis=0)  # fmt: skip
    np.testing.assert_allclose(most, evaluate(F, values), atol=1e-12)
    assert user_surface(text, ["k"] if "k" in text else [], BOUNDS).is_convex


def test_written_planes_are_the_catalogues() -> None:
    """As an expression, with a parameter in the coefficients; also in bounds that are far too wide."""
    o, d = rays_at(np.random.default_rng(9), RAYS, 0.8)
    plain = trace_rays(make_scene({"surface": "box", "a": 1.2, "b": 0.8, "c": 1.0}), o, d)
    for wide in (1.0, 1e3, 1e9):
        text = {"surface": "max(abs(x) - 0.5*a, abs(y) - 0.4, 2*abs(z) - 1)"}
        lens = text | {"a": 1.2, "bounds": [[-wide] * 3, [wide] * 3]}
        written = trace_rays(make_scene(lens), o, d)
        np.testing.assert_array_equal(plain.events, written.events)
        np.testing.assert_array_equal(plain.status, written.status)
        assert np.abs(plain.origin - written.origin).max() < 1e-14


@pytest.mark.parametrize(
    ("planes", "message"),
    [
        (CUBE[:5], "must enclose a solid, but it goes on without end"),
        ([[1, 0, 0, 1], [-1, 0, 0, 1], [0, 1, 0, 1], [0, -1, 0, 1]], "must enclose a solid, but it goes on"),
        ([*CUBE, [1, 0, 0, -2]], "hold no solid: no point lies in all of them"),
        ([*CUBE, [1, 1, 0, -1]], "hold no solid"),  # an edge is left
        ([*CUBE, [-1, 0, 0, -0.5]], "hold no solid: "),  # a face is left
        (CUBE[:3], "must be 4 to 256 planes [a, b, c, d], the solid being where a x + b y + c z <= d, got 3 of them"),
        ([*CUBE, [0, 0, 0, 1]], "plane 7 must have a normal"),
        ([*CUBE, [0, 0, 1]], "plane 7 must be four numbers [a, b, c, d]"),
        ([*CUBE, [0, 0, 1, "x"]], "plane 7 must be four numbers"),
        ("CUBE", "must be 4 to 256 planes"),
    ],
)
def test_what_is_no_solid_is_an_error_of_its_key(planes: Any, message: str) -> None:
    with pytest.raises(StudyError, match=r"^lens\.planes: ") as caught:
        make_scene({"surface": "polyhedron", "planes": planes})
    assert message in str(caught.value)


def test_planes_are_for_polyhedra_only_and_scenes_keep_them() -> None:
    with pytest.raises(StudyError, match=r'lens\.planes: is only for surface = "polyhedron"'):
        make_scene({"surface": "box", "planes": CUBE})
    with pytest.raises(StudyError, match=r"lens\.a1: unknown key"):
        make_scene({"surface": "polyhedron", "a1": 1.0})
    scene = scene_of(CUBE)
    assert scene.replace({"film.size": [8, 8]}).lenses == scene.lenses
    other = scene.replace({"lens.surface": "box"})
    assert other.lenses[0].planes is None
    assert other.lenses[0].surface is surface("box")


def test_boxes_of_random_polyhedra_hold_their_corners_tightly() -> None:
    for seed in range(40):
        planes = random_planes(seed, 12)
        made = scene_of(planes).lenses[0]
        low, high = (np.array(corner) for corner in made.surface.box(made.values))
        support = [_support(planes, side * np.eye(3)[axis]) for axis in range(3) for side in (1, -1)]
        margin = 1e-6 * float((high - low).max())
        np.testing.assert_allclose(high, np.array(support[::2]) + margin, atol=0.01 * margin)
        np.testing.assert_allclose(-low, np.array(support[1::2]) + margin, atol=0.01 * margin)


def _support(planes: Array, way: Array) -> float:
    """Return how far a polyhedron reaches along a direction: the least corner-dual, by trying all triples of planes."""
    from itertools import combinations

    best = -np.inf
    unit = planes / np.linalg.norm(planes[:, :3], axis=1, keepdims=True)
    for some in combinations(range(len(unit)), 3):
        matrix = unit[list(some), :3]
        if abs(np.linalg.det(matrix)) < 1e-9:
            continue
        corner = np.linalg.solve(matrix, unit[list(some), 3])
        if (unit[:, :3] @ corner <= unit[:, 3] + 1e-9).all():
            best = max(best, float(corner @ way))
    return best


def test_a_gem_shows_every_one_of_its_faces() -> None:
    row = surface("brilliant")
    for more in ({}, {"table": 70.0, "star": 60.0}, {"crown_angle": 20.0, "lower": 60.0}):
        values = {parameter.name: parameter.default for parameter in row.parameters} | more
        assert list(row.problems(values)) == []
        d = np.random.default_rng(1).normal(size=(200_000, 3))
        numbers = [[float(evaluate(each, values)) for each in plane] for plane in row.planes]
        table = np.array(numbers)
        nearest = (d @ table[:, :3].T / table[:, 3]).argmax(1)  # the face that a ray from the middle meets
        assert len(np.unique(nearest)) == len(row.planes) == 73
    assert "more than" in dict(row.problems(values | {"table": 85.0, "star": 20.0}))["star"]
