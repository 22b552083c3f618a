"""Light that is spread over a grid by exact area, against polygons that are cut cell by cell."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from lenscl.tracing.overlap import Cells

ROWS, COLUMNS = 7, 9
Point = tuple[float, float]


def spread(triangles: NDArray[np.float64], carried: NDArray[np.float64]) -> NDArray[np.float64]:
    cells = Cells(ROWS, COLUMNS)
    cells.spread(triangles, carried[:, np.newaxis])
    return cells.filled()[..., 0]


def drop(points: NDArray[np.float64], carried: NDArray[np.float64]) -> NDArray[np.float64]:
    cells = Cells(ROWS, COLUMNS)
    cells.drop(points, carried[:, np.newaxis])
    return cells.filled()[..., 0]


def half(polygon: list[Point], axis: int, border: float, side: int) -> list[Point]:
    """Return the part of a convex polygon on one side of a border across an axis (Sutherland & Hodgman, 1974)."""
    kept: list[Point] = []
    for p, q in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        at_p, at_q = side * (p[axis] - border), side * (q[axis] - border)
        if at_p >= 0:
            kept.append(p)
        if (at_p < 0) != (at_q < 0):
            way = at_p / (at_p - at_q)
            kept.append((p[0] + way * (q[0] - p[0]), p[1] + way * (q[1] - p[1])))
    return kept


def area(polygon: list[Point]) -> float:
    pairs = zip(polygon, polygon[1:] + polygon[:1], strict=True)
    return abs(sum(p[0] * q[1] - p[1] * q[0] for p, q in pairs)) / 2


def cut_cell_by_cell(triangles: NDArray[np.float64], carried: NDArray[np.float64]) -> NDArray[np.float64]:
    cells = np.zeros((ROWS, COLUMNS))
    for triangle, carries in zip(triangles.tolist(), carried.tolist(), strict=True):
        whole = [(x, y) for x, y in triangle]
        for row, column in np.ndindex(ROWS, COLUMNS):
            part = whole
            for axis, low in enumerate((column, row)):
                part = half(part, axis, low, 1)
                part = half(part, axis, low + 1, -1)
            cells[row, column] += carries * area(part) / area(whole)
    return cells


@pytest.mark.parametrize("size", [0.02, 0.6, 5.0, 300.0])
def test_each_cell_gets_the_part_that_it_shares(size: float) -> None:
    random = np.random.default_rng(round(100 * size))
    triangles = random.uniform(-2, 11, (60, 1, 2)) + size * random.standard_normal((60, 3, 2))
    carried = random.random(60)
    found, expected = spread(triangles, carried), cut_cell_by_cell(triangles, carried)
    assert expected.sum() > 1e-4 * carried.sum()
    np.testing.assert_allclose(found, expected, atol=1e-9 * max(1.0, expected.max()))
    np.testing.assert_allclose(spread(triangles[:, ::-1], carried), found, atol=1e-12)


def test_edges_along_the_cells_own_count_once() -> None:
    """A grid of squares, each cut in two, laid on the cells' borders, and turned about."""
    corners = np.array([[2.0, 1.0], [6.0, 1.0], [2.0, 5.0], [6.0, 5.0]])
    for order in ([0, 1, 2, 3], [3, 2, 1, 0], [2, 0, 3, 1]):
        a, b, c, d = corners[order]
        cells = spread(np.array([[a, b, c], [b, d, c]]), np.array([8.0, 8.0]))
        expected = np.zeros((ROWS, COLUMNS))
        expected[1:5, 2:6] = 1.0
        np.testing.assert_allclose(cells, expected, atol=1e-14)


def test_nothing_is_lost_of_what_lies_within_however_thin_it_is() -> None:
    random = np.random.default_rng(3)
    thin = random.uniform(1, 6, (400, 3, 2))
    thin[:, 2] = thin[:, 0] + (thin[:, 1] - thin[:, 0]) * random.random((400, 1))
    thin[:, 2] += 10.0 ** random.uniform(-14, -3, (400, 1))
    thin[:50] = thin[:50, :1]  # all corners at one point
    carried = random.random(400)
    cells = spread(thin, carried)
    assert cells.sum() == pytest.approx(carried.sum(), rel=1e-9)
    assert cells.min() >= -1e-9


def test_points_fall_into_their_cell_or_beside_the_grid() -> None:
    points = np.array([[0.0, 0.0], [0.999, 0.0], [8.999, 6.999], [9.0, 3.0], [3.0, 7.0], [-1e-9, 2.0], [2.0, 3.5]])
    cells = drop(points, np.arange(1.0, 8.0))
    assert {place: cells[place] for place in zip(*map(tuple, np.nonzero(cells)), strict=True)} == {
        (0, 0): 3.0, (6, 8): 3.0, (3, 2): 7.0,
    }  # fmt: skip


def test_a_grid_without_light_is_dark() -> None:
    assert not spread(np.zeros((0, 3, 2)), np.zeros(0)).any()
    away = np.array([[[20.0, 1.0], [30.0, 1.0], [20.0, 5.0]], [[1.0, -9.0], [2.0, -9.0], [1.0, -3.0]]])
    assert not spread(away, np.ones(2)).any()


def test_what_comes_in_parts_and_channels_adds_up() -> None:
    random = np.random.default_rng(5)
    triangles, carried = random.uniform(-1, 10, (40, 3, 2)), random.random((40, 3))
    points, dropped = random.uniform(-1, 10, (20, 2)), random.random((20, 3))
    cells = Cells(ROWS, COLUMNS, 3)
    for part in (slice(0, 13), slice(13, 14), slice(14, 40)):
        cells.spread(triangles[part], carried[part])
        cells.drop(points[part], dropped[part])
    for channel in range(3):
        expected = spread(triangles, carried[:, channel]) + drop(points, dropped[:, channel])
        np.testing.assert_allclose(cells.filled()[..., channel], expected, atol=1e-12)


def test_dark_cells_stay_dark_beside_bright_ones_and_faint_ones_are_kept() -> None:
    """Light as dense as it gets, of triangles hardly thick enough, and a millionth of it to the right."""
    rows, columns = 40, 2000
    random = np.random.default_rng(11)
    bright = random.uniform((20, 2), (300, 20), (3000, 1, 2)) + random.uniform(-1, 1, (3000, 3, 2))
    bright[:500, 2] = bright[:500, :2].mean(axis=1) + 3e-6
    faint = np.array([[[900.0, 5.0], [1000.0, 5.0], [900.0, 9.0]], [[1000.5, 5.5], [1001.5, 5.5], [1000.5, 9.5]]])
    cells = Cells(rows, columns)
    cells.spread(bright, np.ones((3000, 1)))
    cells.spread(faint, np.array([[2e-4], [2e-6]]))
    got = cells.filled()[..., 0]
    assert got.min() >= 0.0
    assert got.max() > 1
    assert (got[22:] == 0.0).all()
    assert (got[:, :19] == 0.0).all()
    assert (got[:, 302:900] == 0.0).all()
    assert (got[:, 1002:] == 0.0).all()
    np.testing.assert_allclose(got[5:8, 910:920], 1e-6, rtol=0.02)
    assert got.sum() == pytest.approx(3000 + 2.02e-4, rel=1e-9)


def test_a_linear_density_is_spread_as_many_even_parts_of_it() -> None:
    """Triangles on the grid, across its borders and beyond, cut into 4^6 whose middles say their density."""
    draw = np.random.default_rng(4)
    triangles = draw.uniform(-6.0, 16.0, (30, 3, 2))
    triangles[20:] = triangles[20:, :1] + draw.uniform(-0.6, 0.6, (10, 3, 2))
    triangles[0] = [[2.0, 1.0], [2.0, 7.0], [9.0, 4.0]]  # an edge on a border
    carried, gathered = draw.uniform(0.5, 2.0, (30, 2)), draw.uniform(0.0, 1.0, (30, 3, 2))
    gathered[3] = 0.0  # even
    found, expected = Cells(9, 11, 2), Cells(9, 11, 2)
    found.spread(triangles, carried, gathered)
    corners, weights = triangles[:, None], np.broadcast_to(np.eye(3), (30, 1, 3, 3))
    for _ in range(6):
        parts = []
        for arrays in (corners, weights):
            a, b, c = (arrays[:, :, k] for k in range(3))
            ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
            cut = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            parts.append(np.concatenate([np.stack(part, axis=2) for part in cut], axis=1))
        corners, weights = parts
    density = np.einsum("nmi,nic->nmc", weights.mean(axis=2), gathered)
    density[3] = 1.0
    light = carried[:, None] * density / density.sum(axis=1, keepdims=True)
    expected.spread(corners.reshape(-1, 3, 2), light.reshape(-1, 2))
    np.testing.assert_allclose(found.filled(), expected.filled(), atol=2e-4)
    even = Cells(9, 11, 2)
    even.spread(triangles, carried)
    assert np.abs(even.filled() - expected.filled()).max() > 0.02
    inside = (
        (triangles.min(axis=(1, 2)) > 0) & (triangles[..., 0].max(axis=1) < 11) & (triangles[..., 1].max(axis=1) < 9)
    )
    alone = Cells(9, 11, 2)
    alone.spread(triangles[inside], carried[inside], gathered[inside])
    assert inside.sum() >= 3
    np.testing.assert_allclose(alone.filled().sum(axis=(0, 1)), carried[inside].sum(axis=0), rtol=1e-13)
