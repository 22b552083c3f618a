"""What is done to a whole scene is done to its map: to the last bit where no number is rounded, else within bounds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from itertools import permutations

import numpy as np
import pytest
from hypothesis import event, given, settings
from hypothesis import strategies as st
from physics import maps
from physics.test_many_lenses import BALL, EGG, RING
from probe import plain_device
from scenes import make_scene
from strategies import Seen, seen
from thinned import thinned

from lenscl import RayStatus, trace
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.tracing import RayMap

FORMS = [(precision, width) for precision in ("single", "double", "mixed") for width in (1, 4, 8, 16)]
ONE_EACH = (
    *("torus", "sphere", "prism", "ellipsoid", "heart", "bifolia", "biconvex", "superellipsoid"),
    *("quartic", "torus", "cone", "meniscus"),
)
DEALT = [
    pytest.param(*form, name, id=f"{form[0]}-{form[1]}-{name}") for form, name in zip(FORMS, ONE_EACH, strict=True)
]
EXAMPLES = 6

dealt = pytest.mark.parametrize(("precision", "width", "name"), DEALT)


def counted(law: maps.Law, raymap: RayMap, counts: Counter[str]) -> None:
    """Hold a law's residuals against their bounds, and count what was told."""
    residual, bound = law
    told = np.isfinite(bound)
    met = raymap.events > 0
    counts.update(
        {"pixels": met.size, "met": int(met.sum()), "told": int(told.sum()), "told, met": int((told & met).sum())}
    )
    event(f"{int(met.any())} with rays that meet the lens")
    broken = np.argwhere(told & ~(residual <= bound))
    assert not broken.size, f"pixels {broken.tolist()}: {residual[tuple(broken.T)]}, {bound[tuple(broken.T)]}"


def unchanged(change: Callable[[Scene], Scene], precision: str, width: int, name: str) -> None:
    """Hold that a change to the whole scene leaves every bit of its map."""
    counts: Counter[str] = Counter()
    device = plain_device(width, width)

    @settings(max_examples=EXAMPLES)
    @given(seen([name]))
    def holds(drawn: Seen) -> None:
        scene = drawn.scene(precision)
        one = trace(scene, device=device)
        counted(maps.same_bits(one, trace(change(scene), device=device)), one, counts)

    holds()
    assert counts["met"] > 20


@dealt
def test_the_mirror_image_of_a_scene_has_the_same_map_bit_for_bit(precision: str, width: int, name: str) -> None:
    unchanged(maps.mirrored, precision, width, name)


@dealt
def test_lengths_times_a_power_of_two_leave_every_bit_of_a_map(precision: str, width: int, name: str) -> None:
    for power in (-20, -7, 1, 20):
        unchanged(lambda scene, k=2.0**power: maps.scaled(scene, k), precision, width, name)


@dealt
def test_a_film_moved_by_pixels_moves_its_map_by_pixels_bit_for_bit(precision: str, width: int, name: str) -> None:
    counts: Counter[str] = Counter()
    device = plain_device(width, width)

    @settings(max_examples=EXAMPLES)
    @given(seen([name]), st.integers(0, 2), st.integers(0, 2))
    def holds(drawn: Seen, columns: int, rows: int) -> None:
        scene = drawn.scene(precision)
        one, other = (trace(each, device=device) for each in (scene, maps.film_moved(scene, columns, rows)))
        height, width_ = one.status.shape
        first, moved = (
            one.st[rows:, columns:], other.st[: max(height - rows, 0), : max(width_ - columns, 0)]
        )  # fmt: skip
        np.testing.assert_array_equal(first, moved)
        counts.update({"met": int((one.events[rows:, columns:] > 0).sum()), "moved": int(columns + rows > 0)})
        turned = trace(maps.film_turned_over(scene), device=device)
        np.testing.assert_array_equal(turned.st[:, ::-1], one.st)
        np.testing.assert_array_equal(turned.status[:, ::-1], one.status)

    holds()
    assert counts["met"] > 10
    assert counts["moved"] > 0


@dealt
def test_a_scene_turned_scaled_or_moved_has_its_map_within_bounds(precision: str, width: int, name: str) -> None:
    counts: Counter[str] = Counter()
    device = plain_device(width, width)

    @settings(max_examples=EXAMPLES)
    @given(seen([name]), st.integers(-180, 180), st.sampled_from([3.0, 0.1, 1e-6, 1e6, 12.7]))
    def holds(drawn: Seen, degrees: int, k: float) -> None:
        scene = drawn.scene(precision)
        one = trace(scene, device=device)
        bound = 4.0 * maps.bounds(scene, plain_device(1, 1))  # of two traces, and of two scenes of rounded numbers
        for other in (
            maps.turned(scene, degrees),
            maps.scaled(scene, k),
            maps.shifted(scene, np.array([0.3, -0.7, 0.1])),
        ):
            counted(maps.differs(one, trace(other, device=device), bound), one, counts)

    holds()
    assert counts["told, met"] > 0.5 * counts["met"] > 20


@dealt
def test_a_films_rays_are_those_through_its_pixels(precision: str, width: int, name: str) -> None:
    counts: Counter[str] = Counter()

    @settings(max_examples=EXAMPLES)
    @given(seen([name]))
    def holds(drawn: Seen) -> None:
        scene, device = drawn.scene(precision), plain_device(width, width)
        counted(maps.film_is_its_rays(scene, device), trace(scene, device=device), counts)

    holds()
    assert counts["told"] > 0.6 * counts["pixels"] > 20


@pytest.mark.parametrize(("precision", "width"), thinned(FORMS, [("single", 8), ("double", 1), ("mixed", 4)]))
def test_the_order_of_lenses_changes_no_bit(precision: str, width: int) -> None:
    device: Device = plain_device(width, width)
    film, numerics = {"size": [21, 20]}, {"precision": precision}
    scenes = [make_scene(*lenses, film=film, numerics=numerics) for lenses in permutations((BALL, EGG, RING))]
    first, *others = (trace(scene, device=device) for scene in scenes[:3])
    assert (first.events >= 4).sum() > 10
    for other in others:
        residual, _ = maps.same_bits(first, other)
        assert not residual.any()


@pytest.mark.parametrize(
    ("precision", "width"), thinned(FORMS, [("single", 16), ("single", 1), ("double", 8), ("mixed", 4)])
)
def test_pictures_side_by_side_share_no_ray_and_lose_none(precision: str, width: int) -> None:
    scene = edge_on_edge(precision)
    residual, _ = maps.one_of_two_pictures(scene, plain_device(width, width))
    assert not residual.any()
    status = trace(scene, device=plain_device(width, width)).status
    assert set(np.unique(status)) == {RayStatus.PICTURE, RayStatus.OFF_PICTURE}


def edge_on_edge(precision: str) -> Scene:
    """Return a scene whose middle column of rays, of nine, meets the right edge of the picture."""
    return make_scene(
        {"surface": "sphere", "r": 0.25, "centre": [30.0, 0.0, 0.0]},
        source={"kind": "parallel", "direction": [0.0, 0.0, -1.0]},
        film={"corner": [-0.5625, 0.5, 2.0], "right": [1.125, 0.0, 0.0], "down": [0.0, -1.0, 0.0], "size": [9, 8]},
        picture={"corner": [-1.0, 1.0, -2.0], "right": [1.0, 0.0, 0.0], "down": [0.0, -2.0, 0.0]},
        numerics={"precision": precision},
    )
