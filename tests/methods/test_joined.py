"""Polynomials under max and min, searched leaf by leaf: against the search by bounds, and proofs in ball arithmetic."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import hypothesis.strategies as st
import numpy as np
import pytest
from faults_in_kernels import Fault, broken
from hypothesis import given, settings
from numpy.typing import NDArray
from probe import plain_device
from scenes import make_scene

from lenscl import RayStatus, trace, trace_rays
from lenscl.codegen import kernel_source
from lenscl.config import Scene
from lenscl.errors import StudyError
from lenscl.expr import evaluate, parse
from lenscl.expr.joined import polynomial_leaves
from lenscl.lenses import surface
from lenscl.methods import METHODS, choose
from lenscl.reference.oracle import prove_rays
from lenscl.tracing import Follower
from lenscl.tracing.structure import methods_of, structure_of

Array = NDArray[Any]
BALL = "x^2 + y^2 + z^2 - 1"
BOX = "max(max(abs(x), abs(y)), abs(z)) - 0.8"
SEXTIC = "a*x^6 + b*x^3*y^2*z + c*y^4*z^2 + e*x*y*z + g*z^3 + h*y - 0.3"
QUARTIC = "k*x^4 + y^4 + z^4 + a*x*y - 0.2"
FORMS = {  # with the leaves that have no closed form
    "cut by a ball": (f"max({SEXTIC}, {BALL})", 1),
    "cut by a box": (f"max({SEXTIC}, {BOX})", 1),
    "cut by a cylinder": (f"max({SEXTIC}, x^2 + y^2 - 0.7, abs(z) - 0.9)", 1),
    "hollow": (f"max({SEXTIC}, 0.1 - {QUARTIC} - 0.2, {BALL})", 2),
    "two together": (f"max(min({SEXTIC}, {QUARTIC}), {BALL})", 2),
    "with a ball": (f"max(min({SEXTIC}, x^2 + (y - 0.85)^2 + z^2 - k/8), {BALL})", 1),
}
NAMES = ("a", "b", "c", "e", "g", "h", "k")
USUAL = {"a": 1.5, "b": -2.0, "c": 1.0, "e": 2.5, "g": -1.0, "h": 0.4, "k": 1.3}
DEVICE = plain_device(4)


@dataclass(frozen=True)
class Bundle:
    origins: Array
    directions: Array


def scene_of(form: str, values: dict[str, float] = USUAL, precision: str = "double", events: int = 8) -> Scene:
    text = FORMS[form][0]
    used = {name: value for name, value in values.items() if parse(text, [*"xyz", *NAMES]).depends_on([name])}
    lens = {"surface": text, "bounds": [[-1.25] * 3, [1.25] * 3], "n": 1.4, **used}
    return make_scene(lens, numerics={"max_events": events, "precision": precision})


def rays(seed: int, count: int) -> Bundle:
    """Return rays from outside, some along an axis, and some from places that may lie in the solid."""
    rng = np.random.default_rng(seed)
    d = rng.normal(size=(count, 3))
    straight = rng.random(count) < 0.1
    d[straight] = np.eye(3)[rng.integers(0, 3, straight.sum())]
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    back = np.where(rng.random(count) < 0.3, 0.0, 3.0)[:, None]
    return Bundle(rng.uniform(-0.9, 0.9, (count, 3)) - back * d, d)


def leaf_values(scene: Scene, points: Array) -> Array:
    """Return the leaves at points on the lens, which is not moved, shape (leaves, N)."""
    lens = scene.lenses[0]
    values = {**lens.values, **dict(zip("xyz", points.T, strict=True))}
    leaves = lens.surface.polynomial_leaves
    return np.stack([np.broadcast_to(evaluate(leaf, values), len(points)) for leaf in leaves])


def first_leaves(scene: Scene, bundle: Bundle) -> Array:
    """Return by which leaf rays are met first, -1 where they are not."""
    found = trace_rays(scene.replace({"numerics.max_events": 1}), bundle.origins, bundle.directions, device=DEVICE)
    leaf = np.abs(leaf_values(scene, found.origin)).argmin(axis=0)
    return np.where(found.events > 0, leaf, -1)


@pytest.mark.parametrize("form", FORMS)
@settings(max_examples=4, deadline=None)
@given(
    values=st.fixed_dictionaries({name: st.floats(-3.0, 3.0) for name in NAMES[:-1]} | {"k": st.floats(0.2, 2.0)}),
    seed=st.integers(0, 2**32 - 1),
)
def test_random_ones_are_those_of_the_search_by_bounds(form: str, values: dict[str, float], seed: int) -> None:
    """Before any ray is traced again, so that undecided rays count, too."""
    scene, bundle = scene_of(form, values), rays(seed, 400)
    found, wanted = (
        Follower(scene.replace({"numerics.method": method}), DEVICE).ends(bundle.origins, bundle.directions, 8)
        for method in ("joined", "interval")
    )
    undecided = [ends.status == RayStatus.UNDECIDED for ends in (found, wanted)]
    assert undecided[0].sum() <= undecided[1].sum() + 2
    sure = ~(undecided[0] | undecided[1])
    np.testing.assert_array_equal(found.events[sure], wanted.events[sure])
    few = sure & (found.events <= 2)
    assert np.abs(found.origin - wanted.origin)[few].max(initial=0.0) < 1e-6


@pytest.mark.parametrize("form", FORMS)
def test_rays_meet_every_kind_of_leaf(form: str) -> None:
    scene, bundle = scene_of(form), rays(5, 1500)
    assert [method.name for method in methods_of(scene)] == ["joined"]
    leaves = scene.lenses[0].surface.polynomial_leaves
    met = first_leaves(scene, bundle)
    counts = [int((met == leaf).sum()) for leaf in range(len(leaves))]
    assert min(counts) > 5, counts
    text = kernel_source(structure_of(scene, "given", "legs", DEVICE)).text
    assert text.count("// joined_leaf.cl") == FORMS[form][1]


def near_edges(scene: Scene, count: int) -> tuple[Bundle, Array]:
    """Return rays that pass an edge of the first leaf and another at 1e-17 to 0.1, and how far."""
    rng = np.random.default_rng(8)
    lens = scene.lenses[0]
    p = rng.normal(size=(20 * count, 3))
    p /= np.linalg.norm(p, axis=1, keepdims=True)  # on the ball
    step = 1e-6
    for _ in range(60):  # to where the first leaf is zero, too
        values = leaf_values(scene, p)[0]
        slopes = np.stack([(leaf_values(scene, p + step * e)[0] - values) / step for e in np.eye(3)], axis=1)
        slopes -= (slopes * p).sum(axis=1, keepdims=True) * p
        with np.errstate(all="ignore"):
            move = values[:, None] * slopes / (slopes**2).sum(axis=1, keepdims=True)
        p = p - np.clip(np.nan_to_num(move), -0.1, 0.1)
        p /= np.linalg.norm(p, axis=1, keepdims=True)
    there = np.abs(leaf_values(scene, p)[0]) < 1e-14
    p = p[there][:count]
    assert lens.surface.name == "expression"
    off = 10.0 ** rng.uniform(-17, -1, len(p))
    off[::7] = 0.0
    p = p + off[:, None] * rng.normal(size=p.shape)
    d = rng.normal(size=p.shape)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    return Bundle(p - 2.0 * d, d), off


def judged(scene: Scene, bundle: Bundle, proofs: list[Any]) -> tuple[int, int]:
    """Return how many rays were decided whose answer is proved, and how many of them are wrong."""
    got = Follower(scene, DEVICE).ends(bundle.origins, bundle.directions, scene.numerics.max_events)
    right = wrong = 0
    for proof, status, events in zip(proofs, got.status, got.events, strict=True):
        if proof.status is None or status == RayStatus.UNDECIDED:
            continue
        wrong += (proof.status, proof.events) != (status, events)
        right += (proof.status, proof.events) == (status, events)
    return right, wrong


def test_at_edges_nothing_is_decided_wrong_and_broken_searches_are_noticed() -> None:
    scene = scene_of("cut by a ball", events=2)
    bundle, off = near_edges(scene, 120)
    assert len(off) > 90
    proofs = prove_rays(scene, bundle.origins, bundle.directions, radius=1e-9, most_bits=192)
    right, wrong = judged(scene, bundle, proofs)
    assert wrong == 0
    assert right > 60
    faults = [
        ("zones that overlap are taken one by one", "search_joined.cl", "(first[k].low <= high) |", ""),
        ("the next zone is not looked through", "search_joined.cl", "through[k] = own ? -side : before[k];",
         "through[k] = before[k];"),
    ]  # fmt: skip
    told = {}
    for name, file, old, new in faults:
        with broken(Fault(name, file, old, new)):
            told[name] = judged(scene, bundle, proofs)
    assert sum(bad > 0 for _, bad in told.values()) == len(faults), told


def test_what_is_known_of_a_leaf_ends_where_its_search_ended() -> None:
    scene, bundle = scene_of("with a ball"), rays(4, 1000)

    def differs() -> int:
        found, wanted = (
            Follower(scene.replace({"numerics.method": method}), DEVICE).ends(bundle.origins, bundle.directions, 8)
            for method in ("joined", "interval")
        )
        sure = (found.status != RayStatus.UNDECIDED) & (wanted.status != RayStatus.UNDECIDED)
        return int((found.events != wanted.events)[sure].sum())

    assert differs() == 0
    with broken(Fault("known for good", "joined_leaves.cl", "(zone.low < NEVER ? zone.high : end)", "NEVER")):
        assert differs() > 3


@pytest.mark.parametrize("precision", ["single", "mixed", "double"])
def test_proofs_of_random_rays_hold_in_every_precision(precision: str) -> None:
    scene, bundle = scene_of("cut by a box", events=2, precision=precision), rays(3, 80)
    starts = Follower(scene, DEVICE).starts(bundle.origins, bundle.directions)
    proofs = prove_rays(scene, *starts, radius=1e-9, most_bits=192)
    right, wrong = judged(scene, Bundle(*starts), proofs)
    assert wrong <= (2 if precision == "single" else 0)  # rays bend by single's rounding
    assert right > 60


def test_a_ray_in_the_plane_of_a_face_is_told_by_the_other_leaves() -> None:
    scene = scene_of("cut by a box")
    o = np.array([[0.5, 0.8, 3.0], [0.8, -0.3, 3.0], [0.8, 1.1, 3.0]])
    found = Follower(scene, DEVICE).ends(o, np.array([[0.0, 0.0, -1.0]] * 3), 8)
    values = [leaf_values(scene, p + np.linspace(0, 6, 999)[:, None] * [0.0, 0.0, -1.0]) for p in o]
    expected = [RayStatus.UNDECIDED if (each[0] < 0).any() else RayStatus.PICTURE for each in values]
    expected[2] = RayStatus.PICTURE  # beside the box
    for status, events, one in zip(found.status, found.events, expected, strict=True):
        assert status == RayStatus.UNDECIDED if one == RayStatus.UNDECIDED else events == 0
    assert found.status[2] != RayStatus.UNDECIDED


def test_a_map_of_the_catalogue() -> None:
    """The Barth sextic cut by its ball: as by bounds."""
    scene = make_scene({"surface": "barth_sextic", "n": 1.3, "stretch": [0.4] * 3}, film={"size": [40, 40]})
    assert [method.name for method in methods_of(scene)] == ["joined"]
    found, wanted = trace(scene), trace(scene, method="interval")
    np.testing.assert_array_equal(found.status, wanted.status)
    np.testing.assert_array_equal(found.events, wanted.events)
    assert (found.events > 0).sum() > 200
    few = found.events <= 4
    assert np.abs(found.st - wanted.st)[few].max() < 1e-7


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("max(x^4 + y^4 + z^4 - 1, z)", 2),
        ("max(x^4 + y^4 - 1, abs(z) - 1)", 3),
        ("min(x^3 - y, y^4 + x*z) + 1", 2),
        ("2*max(x^3, -y) - 3*min(z^5, k*x)", 4),
        ("max(x^2 + y^2 + z^2 - 1, z)", 0),  # quadrics
        ("max(x^4 + y^4 + z^4 - 1, sin(z))", 0),
        ("max(x^13 + y^4 + z^4 - 1, z)", 0),
        ("x^4 + y^4 + z^4 - 1", 0),
        ("abs(x)^3 + y^4 + z^4 - 1", 0),  # no polynomials under max
    ],
)
def test_what_is_max_and_min_of_polynomials_is_found(text: str, count: int) -> None:
    assert len(polynomial_leaves(parse(text, ["x", "y", "z", "k"]))) == count


def test_the_method_is_refused_by_name_where_it_does_not_serve() -> None:
    with pytest.raises(StudyError, match=r'"joined" searches max and min of polynomials, and lens\[0\] \(torus\)'):
        trace(make_scene({"surface": "torus"}), method="joined")
    assert surface("torus").polynomial_leaves == ()
    assert choose("auto", is_polynomial=False, is_joined=True) is METHODS["joined"]
    assert choose("auto", is_polynomial=True, is_joined=True) is METHODS["polynomial"]
    assert choose("joined", is_polynomial=True) is None
