"""Solids of several faces: which one is met the search tells, not whose value is the largest after rounding."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scenes import make_scene
from thinned import thinned

import lenscl
from lenscl.config import Scene
from lenscl.reference.oracle import prove_rays
from lenscl.status import RayStatus
from lenscl.tracing import film_rays

CUBE = [[-1, -1, -1], [1, 1, 1]]
RAYS = 3000


def rays(seed: int, far: float = 3.0, within: float = 0.9) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    o = rng.normal(size=(RAYS, 3))
    o *= far / np.linalg.norm(o, axis=1, keepdims=True)
    d = rng.uniform(-within, within, (RAYS, 3)) - o
    return o, d / np.linalg.norm(d, axis=1, keepdims=True)


@pytest.mark.parametrize(
    ("size", "precision"),
    thinned(
        product(("1", "1e4", "1e8", "1e12"), ("single", "double", "mixed")),
        [("1", "double"), ("1e4", "mixed"), ("1e8", "single"), ("1e12", "double"), ("1e12", "single")],
    ),
)
def test_faces_of_any_size_make_the_same_solid(size: str, precision: str) -> None:
    o, d = rays(1)

    def traced(surface: str) -> lenscl.RayPaths:
        return lenscl.trace_rays(make_scene({"surface": surface, "bounds": CUBE}), o, d, precision=precision)

    plain = traced("max(x^2 + y^2 + z^2 - 0.5, z - 0.5)")
    scaled = traced(f"max({size}*(x^2 + y^2 + z^2 - 0.5), 1e-3*z - 5e-4)")
    same = (plain.events == scaled.events) & (plain.events > 0) & (plain.events < 4)
    assert same.sum() > RAYS // 3
    assert (plain.events != scaled.events).sum() <= 3  # beside the edge, where 1e-3 and 5e-4 are rounded
    assert not (scaled.status == RayStatus.UNDECIDED).any()
    off = np.abs(plain.direction - scaled.direction)[same].max(axis=1)
    assert np.quantile(off, 0.998) < {"single": 1e-3, "double": 1e-11, "mixed": 1e-11}[precision]


def test_where_one_face_has_no_value_another_may_still_prove_the_outside() -> None:
    o, d = rays(2)
    dome = {"surface": "max(abs(z) - sqrt(1 - x**2 - y**2)*0.5, x^2 + y^2 - 0.5)", "bounds": CUBE}
    found = lenscl.trace_rays(make_scene(dome), o, d)
    assert not (found.status == RayStatus.UNDECIDED).any()
    same = {"surface": "max(4*z^2 + x^2 + y^2 - 1, x^2 + y^2 - 0.5)", "bounds": CUBE}
    expected = lenscl.trace_rays(make_scene(same), o, d)
    np.testing.assert_array_equal(found.events, expected.events)
    few = (expected.events > 0) & (expected.events < 4)
    assert few.sum() > RAYS // 3
    assert np.abs(found.origin - expected.origin)[few].max() < 1e-9


@pytest.mark.parametrize("bound", [10.0, 1e3, 1e5, 1e8])
def test_loose_bounds_leave_nothing_undecided(bound: float) -> None:
    o, d = rays(3)
    wide = [[-bound] * 3, [bound] * 3]
    for surface in ("x^2 + y^2 + z^2 - 0.5", "x^4 + y^4 + z^4 - 0.5"):
        tight, loose = (
            lenscl.trace_rays(make_scene({"surface": surface, "bounds": box}), o, d) for box in (CUBE, wide)
        )
        assert (loose.status == RayStatus.UNDECIDED).sum() <= 2
        assert (loose.events != tight.events).sum() <= 2
        assert (tight.events > 0).sum() > RAYS // 3


LENGTHS = {
    "torus": lambda s: {"surface": "torus", "R": 0.7 * s, "r": 0.25 * s},
    "spindle": lambda s: {"surface": "torus", "R": 0.3 * s, "r": 0.5 * s},
    "barth_sextic": lambda s: {"surface": "barth_sextic", "w": 0.5 * s, "clip": 0.9 * s},
}


@pytest.mark.parametrize("power", [-20, -7, 13, 20])
@pytest.mark.parametrize("name", LENGTHS)
def test_lenses_scaled_by_their_own_lengths_give_the_same_paths_bit_for_bit(name: str, power: int) -> None:
    o, d = rays(5)
    one, other = (
        lenscl.trace_rays(
            make_scene(
                LENGTHS[name](s),
                film={"centre": [0.0, 0.0, 2.5 * s], "right": [s, 0.0, 0.0], "down": [0.0, -s, 0.0]},
                picture={"corner": [-3 * s, 3 * s, -2.5 * s], "right": [6 * s, 0.0, 0.0], "down": [0.0, -6 * s, 0.0]},
                source={"kind": "point", "at": [0.0, 0.0, 4 * s]},
            ),
            o * s,
            d,
        )
        for s in (1.0, 2.0**power)
    )
    assert (one.events > 0).sum() > RAYS // 4
    np.testing.assert_array_equal(other.events, one.events)
    np.testing.assert_array_equal(other.direction, one.direction)
    np.testing.assert_array_equal(other.origin, one.origin * 2.0**power)


@pytest.mark.parametrize("power", [-38, -20, 20, 38])
@pytest.mark.parametrize(
    ("degree", "precision"),
    thinned(
        product((4, 6, 8), ("single", "mixed", "double")), [(4, "mixed"), (6, "double"), (8, "single"), (8, "double")]
    ),
)
def test_no_root_is_lost_where_powers_of_a_direction_leave_the_range(degree: int, power: int, precision: str) -> None:
    text = f"x^{degree} + y^{degree} + z^{degree} - 0.5"
    o, d = rays(6)

    def traced(stretch: float) -> lenscl.RayPaths:
        lens = {"surface": text, "bounds": CUBE, "stretch": [stretch] * 3}
        return lenscl.trace_rays(make_scene(lens), o * stretch, d, precision=precision, method="polynomial")

    one, other = traced(1.0), traced(2.0**power)
    assert (one.events > 0).sum() > RAYS // 2
    np.testing.assert_array_equal(other.events, one.events)
    np.testing.assert_array_equal(other.direction, one.direction)


@pytest.mark.parametrize("power", [-20, 20])
def test_a_march_takes_the_same_face_at_any_scale(power: int) -> None:
    o, d = rays(7)
    one, other = (
        lenscl.trace_rays(
            make_scene(
                LENGTHS["torus"](s), numerics={"method": "march", "step": 2.0**-6 * s, "tolerance": 2.0**-50 * s}
            ),
            o * s,
            d,
        )
        for s in (1.0, 2.0**power)
    )
    assert (one.events > 0).sum() > RAYS // 4
    np.testing.assert_array_equal(other.events, one.events)
    np.testing.assert_array_equal(other.direction, one.direction)


@pytest.mark.parametrize(
    ("parts", "far"),
    [
        (("min(x, z)", "x^2 + y^2 + z^2 - 1"), 1e3),
        (("min(x, z)", "x^2 + y^2 + z^2 - 1"), 1e4),
        (("min(0.3 - abs(x), abs(z) - 0.3)", "x^2 + y^2 + z^2 - 1"), 1e3),
    ],
)
def test_far_from_the_origin_the_order_of_faces_is_no_matter(parts: tuple[str, str], far: float) -> None:
    """Where every face's sign is known by values alone it is still told which face a root is of."""

    def traced(order: tuple[str, str]) -> lenscl.RayMap:
        return lenscl.trace(
            make_scene(
                {"surface": f"max({', '.join(order)})", "bounds": [[-1.05] * 3, [1.05] * 3], "centre": [0, 0, far]},
                source={"at": [1, 2, far + 4]},
                film={"centre": [0.5, 1, far + 2], "right": [1.5, 0, 0], "down": [0, -1.5, 0], "size": [40, 40]},
                picture={"centre": [0, 0, far - 3], "right": [8, 0, 0], "down": [0, -8, 0]},
            )
        )

    one, other = traced(parts), traced((parts[1], parts[0]))
    assert (one.events >= 2).sum() > 300
    assert (one.status == RayStatus.UNDECIDED).sum() + (other.status == RayStatus.UNDECIDED).sum() < 4
    both = (one.status != RayStatus.UNDECIDED) & (other.status != RayStatus.UNDECIDED)
    np.testing.assert_array_equal(one.events[both], other.events[both])
    np.testing.assert_array_equal(one.status[both], other.status[both])
    proofs = prove_rays(*proved_rays(one))
    assert [(proof.status, proof.events) for proof in proofs] == list(
        zip(one.status.ravel()[::97].tolist(), one.events.ravel()[::97].tolist(), strict=True)
    )


def proved_rays(raymap: lenscl.RayMap) -> tuple[Scene, list[list[float]], list[list[float]]]:
    """Return the scene of a map and some of the film's rays."""
    origins, directions = film_rays(raymap.scene, np.arange(raymap.status.size)[::97])
    return raymap.scene, origins.tolist(), directions.tolist()
