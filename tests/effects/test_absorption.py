"""Absorption along chords that are known, and lenses that let nothing through."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import make_scene

from lenscl import RayStatus, trace, trace_rays
from lenscl.errors import StudyError

RED = [0.1, 0.7, 3.0]
TIGHT = {"single": 3e-6, "mixed": 1e-14, "double": 1e-14}


@pytest.mark.parametrize("precision", TIGHT)
def test_a_ball_of_the_index_around_it_takes_by_the_length_of_the_chord(precision: str) -> None:
    scene = make_scene(
        {"surface": "sphere", "r": 0.8, "n": 1.0, "absorption": RED}, numerics={"precision": precision},
        film={"size": [40, 30]},
    )  # fmt: skip
    raymap = trace(scene)
    film = scene.film
    s, t = np.meshgrid((np.arange(40) + 0.5) / 40, (np.arange(30) + 0.5) / 30)
    d = film.corner + s[..., None] * film.right + t[..., None] * film.down - np.array([0.0, 0.0, 4.0])
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    nearest2 = 16.0 - (4.0 * d[..., 2]) ** 2
    chord = 2.0 * np.sqrt(np.maximum(0.64 - nearest2, 0.0))
    assert (chord > 0).sum() > 200
    assert (chord == 0).sum() > 100
    assert raymap.transmission.shape == (30, 40, 3)
    np.testing.assert_allclose(raymap.transmission, np.exp(-chord[..., None] * RED), atol=30 * TIGHT[precision])


def test_every_leg_inside_counts_and_none_between() -> None:
    """Through two eggs, by the paths' own points: what each leaves is its own, in its world's length."""
    lenses = (
        {"surface": "torus", "name": "ring", "absorption": RED, "stretch": [1.0, 1.2, 2.0], "rotate": [20, 30, 40]},
        {"surface": "sphere", "name": "ball", "r": 0.5, "centre": [0.0, 0.0, -1.5], "absorption": [2.0, 1.0, 0.5]},
    )
    scene = make_scene(*lenses, effects={"total_reflection": "follow"})
    random = np.random.default_rng(5)
    start = np.column_stack([random.uniform(-0.2, 0.2, (300, 2)), np.full(300, 4.0)])
    d = np.column_stack([random.uniform(-0.2, 0.2, (300, 2)), -np.ones(300)])
    ends = trace_rays(scene, start, d)
    depth, before = np.zeros((300, 3)), start
    inside = np.full(300, -1)
    for k in range(1, int(ends.events.max()) + 1):
        at = trace_rays(scene.replace({"numerics.max_events": k}), start, d)
        met = at.events == k
        length = np.linalg.norm(at.origin - before, axis=1)
        of = np.array([lens.absorption for lens in scene.lenses])[inside]
        depth += np.where((met & (inside >= 0))[:, None], length[:, None] * of, 0.0)
        ball = np.linalg.norm(at.origin - [0.0, 0.0, -1.5], axis=1) < 0.5 + 1e-9
        # Behind the surface: inside what was met where the ray goes inwards there, by another ray from that point
        ahead = at.origin + 1e-6 * at.direction
        within = [lens_holds(scene, number, ahead) for number in (0, 1)]
        inside = np.where(met, np.where(ball & within[1], 1, np.where(~ball & within[0], 0, -1)), inside)
        before = np.where(met[:, None], at.origin, before)
    assert (ends.events >= 4).sum() > 10
    assert (depth > 0).all(axis=1).sum() > 200
    np.testing.assert_allclose(ends.transmission, np.exp(-depth), rtol=0, atol=1e-12)


def lens_holds(scene, number, points):  # type: ignore[no-untyped-def] # a helper of the test above
    from lenscl.reference.placed import Placed

    placed = Placed(scene.lenses[number])
    from flint import arb

    return np.array([placed.at(placed.point_to_local(tuple(map(arb, map(float, p))))).value < 0 for p in points])


def test_a_stop_blocks_what_meets_it_and_nothing_else() -> None:
    """A plate with a hole before a lens: light is cut by the edge of the hole's shadow."""
    stop = {
        "surface": "max(max(abs(z) - 0.05, 0.3 - sqrt(x^2 + y^2)), sqrt(x^2 + y^2) - 5)", "name": "stop",
        "bounds": [[-6, -6, -1], [6, 6, 1]], "centre": [0.0, 0.0, 1.5], "absorbs": True,
    }  # fmt: skip
    lens = {"surface": "sphere", "name": "ball", "r": 0.7}
    both, bare = make_scene(stop, lens), make_scene(lens)
    stopped, free = trace(both), trace(bare)
    is_blocked = stopped.status == RayStatus.BLOCKED
    assert 100 < is_blocked.sum() < is_blocked.size - 100
    np.testing.assert_array_equal(stopped.st[~is_blocked], free.st[~is_blocked])
    assert (stopped.st[is_blocked] == -1.0).all()
    assert (stopped.events[is_blocked] == 1).all()
    # The hole's radius at its near face, seen from the source at 4
    s, t = np.meshgrid((np.arange(48) + 0.5) / 48 - 0.5, (np.arange(48) + 0.5) / 48 - 0.5)
    radius = np.hypot(1.3 * s, 1.3 * t) / 1.5  # tangent of the angle to the axis
    assert is_blocked[radius > 0.3 / (4 - 1.55) + 1e-9].all()
    assert not is_blocked[radius < 0.3 / (4 - 1.45) - 1e-9].any()
    np.testing.assert_allclose(stopped.origin[is_blocked][:, 2], 1.5, atol=0.05 + 1e-12)


def test_a_ray_that_starts_in_a_stop_ends_at_its_surface() -> None:
    rays = trace_rays(make_scene({"surface": "sphere", "absorbs": True}), [[0.0, 0.0, 0.2]], [[0.0, 0.0, 1.0]])
    assert (rays.status[0], rays.events[0]) == (RayStatus.BLOCKED, 1)
    np.testing.assert_allclose(rays.origin[0], [0.0, 0.0, 1.0], atol=1e-15)


def test_total_reflection_that_ends_rays_does_not_bring_back_those_that_are_blocked() -> None:
    scene = make_scene(
        {"surface": "torus", "absorbs": True, "n": 0.4}, effects={"total_reflection": "end"}, film={"size": [32, 32]}
    )
    counts = trace(scene).counts()
    assert counts[RayStatus.TOTAL_REFLECTION] == 0
    assert counts[RayStatus.BLOCKED] > 100


@pytest.mark.parametrize("key", ["absorption", "absorbs"])
def test_it_is_left_out_where_no_lens_states_it_or_it_is_switched_off(key: str) -> None:
    states = {"surface": "torus", key: RED if key == "absorption" else True}
    name = "absorption_interface" if key == "absorption" else "opaque_interface"
    for lens, asked, is_in in (
        ({"surface": "torus"}, "auto", False),
        (states, "auto", True),
        (states, False, False),
        ({"surface": "torus"}, True, True),
    ):
        raymap = trace(make_scene(lens, effects={"absorption": asked}, film={"size": [16, 16]}))
        assert (name in raymap.kernel.text) == is_in
        if not is_in:
            with pytest.raises(AttributeError, match=r"effects\.absorption"):
                _ = raymap.transmission


@pytest.mark.parametrize(
    ("lens", "says"),
    [
        ({"absorption": [1.0, 2.0]}, "lens.absorption: must be three numbers"),
        ({"absorption": [1.0, 2.0, -1.0]}, "lens.absorption: .* place 3"),
        ({"absorbs": "yes"}, "lens.absorbs: must be true or false"),
    ],
)
def test_what_no_lens_can_have_is_refused(lens: dict[str, object], says: str) -> None:
    with pytest.raises(StudyError, match=says):
        make_scene({"surface": "torus", **lens})


def test_a_scene_that_absorbs_is_written_and_read_back() -> None:
    from lenscl import scene_from_toml

    scene = make_scene({"surface": "torus", "absorption": RED, "absorbs": True}, effects={"absorption": True})
    again = scene_from_toml(scene.to_toml())
    assert again == scene
    assert again.replace({"lens.absorption": [0, 0, 1], "lens.absorbs": False}).lenses[0].absorption == (0, 0, 1)


def test_the_oracle_and_the_twin_know_what_blocks() -> None:
    from lenscl.reference import trace as twin_of
    from lenscl.reference.oracle import prove_pixels

    lenses = (
        {"surface": "torus", "name": "mount", "R": 0.6, "r": 0.15, "centre": [0.0, 0.0, 1.2], "absorbs": True},
        {"surface": "sphere", "name": "ball", "r": 0.7, "centre": [0.0, 0.0, -0.3]},
    )
    scene = make_scene(*lenses, film={"size": [24, 24]})
    found, twin = trace(scene), twin_of(scene)
    np.testing.assert_array_equal(found.status, twin.status.reshape(24, 24))
    np.testing.assert_array_equal(found.events, twin.events.reshape(24, 24))
    pixels = np.arange(0, 576, 7)
    proofs = prove_pixels(scene, pixels)
    assert [proof.status for proof in proofs] == found.status.ravel()[pixels].tolist()
    assert [proof.events for proof in proofs] == found.events.ravel()[pixels].tolist()
    assert {RayStatus.BLOCKED, RayStatus.PICTURE} <= {proof.status for proof in proofs}
