"""Boxes around lenses: no ray that meets one is lost by rounding, and none of the lenses is forgotten."""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from itertools import product

import numpy as np
import pytest
from probe import REALS, Probe

from lenscl.codegen import wide_levels
from lenscl.tracing.hierarchy import Hierarchy, hierarchy_of, world_boxes

_BODY = """
  realv enter = (realv)0, leave = (realv)REAL_MAX;
  clip_by_inverse(in_0, (realv)1 / in_3, in_6, in_9, &enter, &leave);
  clip_by_inverse(in_1, (realv)1 / in_4, in_7, in_10, &enter, &leave);
  clip_by_inverse(in_2, (realv)1 / in_5, in_8, in_11, &enter, &leave);
  out_0 = passes_box(&enter, leave, (realv)REAL_MAX) ? (realv)1 : (realv)0;
  out_1 = enter;
"""


@cache
def slab(precision: str, width: int, before: str = "") -> Probe:
    return Probe(("slab.cl",), _BODY.replace("passes_box", "passes_thin" if before else "passes_box"), 12, 2,
                 precision, width, is_plain=True, before=before)  # fmt: skip


def exactly(o: np.ndarray, d: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[bool, Fraction]:
    """Return whether a ray meets a box, and where it enters; along a face it does not: no solid reaches the faces."""
    enter, leave = Fraction(0), None
    for axis in range(3):
        start, along, a, b = (Fraction(float(v[axis])) for v in (o, d, low, high))
        if along == 0:
            if not a < start < b:
                return False, enter
            continue
        near, far = sorted([(a - start) / along, (b - start) / along])
        enter, leave = max(enter, near), far if leave is None else min(leave, far)
    return leave is None or enter <= leave, enter


def boxes_and_rays(precision: str, count: int = 4000) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return rays and boxes of that precision: needles and plates one rounding thin, far away, and beside axes."""
    rng = np.random.default_rng(7)
    real = REALS[precision]
    low = rng.uniform(-1.0, 1.0, (count, 3)).astype(real)
    high = low.copy()
    thick = rng.random((count, 3)) < 0.4
    high[thick] += rng.uniform(0.0, 0.5, thick.sum()).astype(real)
    for _ in range(2):
        high[~thick] = np.where(rng.random((~thick).sum()) < 0.6, np.nextafter(high[~thick], real(2)), high[~thick])
    inner = low + (high - low) * rng.random((count, 3)).astype(real)
    o = (inner + rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-3, 3, (count, 1))).astype(real)
    flat = rng.random((count, 3)) < 0.15
    o[flat] = inner[flat]  # in the plane of a face, or between two
    o[rng.random(count) < 0.1, 2] = low[0, 2]
    d = (inner.astype(np.float64) - o) * np.where(rng.random((count, 1)) < 0.9, 1.0, -1.0)
    d /= np.maximum(np.linalg.norm(d, axis=1, keepdims=True), 1e-300)
    d = d.astype(real)
    d[flat] = np.where(rng.random(flat.sum()) < 0.5, 0.0, -0.0)
    tiny = rng.random((count, 3)) < 0.05
    d[tiny] = (np.sign(d[tiny]) * np.finfo(real).tiny * 3).astype(real)
    unit = np.abs(d).max(axis=1) > 0.5  # as rays have them: others reach nothing nearer than the largest number
    return o[unit], d[unit], low[unit], high[unit]


@pytest.mark.parametrize(("precision", "width"), [("single", 4), ("single", 32), ("double", 16)])
def test_no_ray_that_meets_a_box_is_lost(precision: str, width: int) -> None:
    rays = boxes_and_rays(precision)
    met, enter = slab(precision, width)(*(column for each in rays for column in each.T)).T
    truth = [exactly(*each) for each in zip(*rays, strict=True)]
    hits = np.array([hit for hit, _ in truth])
    assert 1000 < hits.sum() < 3500
    assert (hits & (rays[1] == 0.0).any(axis=1)).sum() > 50
    np.testing.assert_array_equal(met[hits], 1.0)
    places = np.array([float(min(place, Fraction(10) ** 30)) for _, place in truth])
    assert (enter[hits] <= places[hits]).all()
    assert (met[~hits] == 0.0).mean() > 0.3


def test_without_its_margin_rays_are_lost() -> None:
    before = """
static inline maskv passes_thin(realv *enter, realv leave, realv limit) {
  return (*enter <= leave) & (*enter <= limit);
}
"""
    rays = boxes_and_rays("single")
    met, _ = slab("single", 4, before)(*(column for each in rays for column in each.T)).T
    hits = np.array([exactly(*each)[0] for each in zip(*rays, strict=True)])
    assert (met[hits] == 0.0).sum() > 20


def lenses_below(tree: Hierarchy, node: int) -> list[int]:
    """Return the lenses of a node, and hold that its children lie in its box."""
    first = tree.links[node, 0]
    if first < 0:
        return [~int(first)]
    for child in (first, first + 1):
        assert (tree.boxes[node, :3] <= tree.boxes[child, :3]).all()
        assert (tree.boxes[node, 3:] >= tree.boxes[child, 3:]).all()
    return [lens for child in (first, first + 1) for lens in lenses_below(tree, child)]


def lenses_of_wide(tree: Hierarchy, wide: int) -> list[tuple[int, np.ndarray]]:
    """Return the lenses below a wide node, each with the box that stands for it in the last of them."""
    found = []
    for box, link in zip(tree.wide_boxes[wide].T, tree.wide_links[wide].tolist(), strict=True):
        if np.isinf(box).all():
            continue
        found += [(~link, box)] if link < 0 else lenses_of_wide(tree, link)
    return found


@pytest.mark.parametrize(("count", "width", "dtype"), [
    *product((1, 2, 3, 9, 17, 100, 257), (1, 4, 16), (np.float32,)), (1000, 32, np.float32), (1000, 16, np.float64),
])  # fmt: skip
def test_every_lens_is_in_every_box_above_it(count: int, width: int, dtype: type) -> None:
    rng = np.random.default_rng(count)
    low = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-3, 3)
    high = low + rng.uniform(0.0, 0.1, (count, 3)) * rng.integers(0, 2, (count, 3))  # flat ones among them
    numbers = rng.permutation(2 * count)[:count]
    tree = hierarchy_of(low, high, numbers, dtype, wide_levels(width))
    assert tree.boxes.dtype == dtype
    assert sorted(lenses_below(tree, 0)) == sorted(numbers.tolist())
    leaf = {~int(first): box for (first, _), box in zip(tree.links, tree.boxes, strict=True) if first < 0}
    for number, a, b in zip(numbers.tolist(), low, high, strict=True):
        assert (leaf[number][:3].astype(np.float64) < a).all()
        assert (leaf[number][3:].astype(np.float64) > b).all()

    # A wide node leads to the lenses below its node, by their own boxes
    wide = tree.links[:, 1] >> 2
    assert (tree.links[wide < 0, 1] < 0).all()
    assert set((tree.links[:, 1] & 3).tolist()) <= {0, 1, 2}
    roots = np.flatnonzero(wide >= 0)
    assert sorted(wide[roots].tolist()) == list(range(len(roots)))
    deep, levels = (count - 1).bit_length(), wide_levels(width)
    assert bool(len(roots)) == (0 < levels <= deep)
    for node in roots[:50].tolist():
        held = lenses_of_wide(tree, int(wide[node]))
        assert sorted(lens for lens, _ in held) == sorted(lenses_below(tree, node))
        assert all((leaf[lens] == box).all() for lens, box in held)


def test_the_depth_and_the_waiting_nodes_fit_the_kernel() -> None:
    """Lenses are halved from level to level, however they lie."""
    for places in (np.zeros((3000, 3)), 2.0 ** -np.arange(3000)[:, np.newaxis] * [1.0, 0.0, 0.0]):
        tree = hierarchy_of(places, places, np.arange(3000), np.float64, 4)

        def depth(node: int, tree: Hierarchy = tree) -> int:
            first = int(tree.links[node, 0])
            return 0 if first < 0 else 1 + max(depth(first), depth(first + 1))

        assert depth(0) == 12


def test_boxes_in_the_world_hold_the_corners_of_boxes_in_the_spaces_of_lenses() -> None:
    rng = np.random.default_rng(3)
    to_world, centre = rng.normal(size=(50, 3, 3)), rng.normal(size=(50, 3)) * 100.0
    low = rng.normal(size=(50, 3))
    high = low + rng.random((50, 3))
    world_low, world_high = world_boxes(to_world, centre, low, high)
    corners = np.stack([np.where(np.array(which), high, low) for which in product((0, 1), repeat=3)], axis=1)
    placed = centre[:, np.newaxis] + np.einsum("nij,nkj->nki", to_world, corners)
    np.testing.assert_allclose(world_low, placed.min(axis=1), atol=1e-12)
    np.testing.assert_allclose(world_high, placed.max(axis=1), atol=1e-12)
