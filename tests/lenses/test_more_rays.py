"""Every event of rays through aspheres, cylinders, toruses and solids of planes is that of closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from lenses import analytic
from numpy.typing import NDArray
from scenes import BENT, FLAT, make_scene

from lenscl import RayStatus, trace, trace_rays
from lenscl.config import Scene
from lenscl.reference.oracle import prove_pixels

Array = NDArray[Any]
RAYS = 3000
MOST = 16

CASES: list[tuple[str, dict[str, float]]] = [
    *((name, {}) for name in (*BENT, *FLAT) if name in analytic.FACES),
    ("biconcave", {"R1": 0.8, "R2": 40.0, "thickness": 0.02}),
    ("half_ball", {"diameter": 0.9}),
    ("drum", {"diameter": 1.4, "length": 1.4}),
    ("cylindrical_singlet", {"c1": -1.2, "k1": -1.5, "c2": 0.0, "thickness": 0.2, "width": 0.5}),
    ("toroidal_singlet", {"c1x": 0.0, "c1y": 0.7, "c2x": -0.5, "c2y": -0.9, "thickness": 0.8}),
    ("toroidal_singlet", {"c1x": -0.9, "c1y": 0.6, "c2x": 0.3, "c2y": -0.2, "thickness": 0.9}),
    ("asphere_singlet", {"A2": 0.05, "A4": 0.1, "A10": -0.1, "A20": 0.2, "B6": 0.1}),
    ("asphere_singlet", {"A3": 0.1, "A4": 0.05, "B5": -0.05, "B19": 0.1}),
    ("box", {"a": 0.3, "b": 1.1, "c": 1e-3}),
    ("wedge", {"angle": 26.565051177077994, "thickness": 0.3, "height": 1.2}),  # down to an edge
]
EACH = pytest.mark.parametrize(
    ("name", "given"), CASES, ids=lambda v: v if isinstance(v, str) else "-".join(map(str, v)) or "default"
)


def scene_of(name: str, given: dict[str, float], **numerics: Any) -> Scene:
    return make_scene({"surface": name, **given}, numerics={"max_events": MOST, **numerics})


def aimed(scene: Scene, count: int, seed: int) -> tuple[Array, Array]:
    """Return rays from outside at points of the box; a half keeps within some 30 degrees of the axis."""
    rng = np.random.default_rng(seed)
    low, high = (np.array(corner) for corner in scene.lenses[0].surface.box(scene.lenses[0].values))
    d = rng.normal(size=(count, 3))
    d[::2, 2] += np.where(d[::2, 2] < 0.0, -4.0, 4.0)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    return rng.uniform(low, high, (count, 3)) - 2.0 * np.linalg.norm(high - low) * d, d


@EACH
def test_events_ends_and_directions_are_those_of_closed_forms(name: str, given: dict[str, float]) -> None:
    scene = scene_of(name, given)
    faces = analytic.FACES[name](scene.lenses[0].values)
    sampled = any(isinstance(face, analytic.Height) for face in faces)
    rays = RAYS // 6 if sampled else RAYS
    o, d = aimed(scene, rays, 1)
    want = analytic.trace(faces, o, d, 1.5, 1.0, MOST)
    sure = ~want.unsure
    assert sure.sum() >= 0.98 * rays
    assert (want.events > 0).sum() > rays // 3
    if given != {"diameter": 1.4, "length": 1.4}:  # a whole ball reflects nothing totally
        assert want.reflected.sum() > 10, "total reflection is exercised"
    for precision in ("double", "mixed", "single") if name in FLAT else ("double",):  # the others' search is not new
        got = trace_rays(scene, o, d, precision=precision)
        assert (got.status == RayStatus.UNDECIDED).sum() <= rays // 500
        few = sure & (want.events <= 4) & (got.status != RayStatus.UNDECIDED)
        if precision == "single":  # its rounding tells on which side of an edge a ray passes
            assert (few & (got.events != want.events)).sum() <= rays // 200
            continue
        settled = sure & (got.status != RayStatus.UNDECIDED)
        np.testing.assert_array_equal(got.events[settled], want.events[settled])
        assert np.abs(got.origin - want.origin)[few].max() < 1e-9
        assert np.abs(got.direction - want.direction)[few].max() < 1e-9
        met = few & (want.events > 0)
        assert np.median(np.abs(got.origin - want.origin)[met].max(1)) < 2e-15


@pytest.mark.parametrize(
    ("name", "given"),
    [*((name, {}) for name in (*BENT, *FLAT)), ("asphere_singlet", {"A4": 0.1, "A3": 0.1, "B20": 0.1})],
    ids=lambda v: v if isinstance(v, str) else "-".join(v) or "default",
)
def test_certified_answers_of_the_written_form_agree(name: str, given: dict[str, float]) -> None:
    scene = make_scene({"surface": name, "rotate": [15.0, 25.0, 0.0], **given}, film={"size": [33, 33]})
    found = trace(scene)
    pixels = np.random.default_rng(2).choice(np.flatnonzero(found.events.ravel() > 0), 12, replace=False)
    proofs = prove_pixels(scene, pixels, radius=1e-12, most_bits=256)
    proved = 0
    for pixel, proof in zip(pixels, proofs, strict=True):
        if proof.status is None or found.status.ravel()[pixel] == RayStatus.UNDECIDED:
            continue
        proved += 1
        assert found.status.ravel()[pixel] == proof.status
        assert found.events.ravel()[pixel] == proof.events
        if proof.st is not None and proof.status in (RayStatus.PICTURE, RayStatus.OFF_PICTURE):
            assert proof.distance(*found.st.reshape(-1, 2)[pixel]) < 1e-8
    assert proved >= 10
