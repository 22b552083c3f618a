"""Labels lie apart, inside, and near their points."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from lenscl.views.labels import Box, place_labels

FRAME = Box(0, 0, 1000, 600)
SIZE = (110.0, 13.0)


def boxes(middles: list[tuple[float, float]]) -> list[Box]:
    w, h = SIZE
    return [Box(x - w / 2, y - h / 2, x + w / 2, y + h / 2) for x, y in middles]


def hidden(middles: list[tuple[float, float]]) -> float:
    found = boxes(middles)
    return sum(a.overlap(b) for k, a in enumerate(found) for b in found[:k])


@given(st.lists(st.tuples(st.floats(0, 1000), st.floats(0, 600)), min_size=1, max_size=24))
def test_labels_of_any_points_do_not_hide_each_other(points: list[tuple[float, float]]) -> None:
    middles = place_labels(points, [SIZE] * len(points), FRAME)
    assert hidden(middles) < 1e-6
    for box in boxes(middles):
        assert box.overlap(FRAME) > SIZE[0] * SIZE[1] - 1e-6


def test_thirty_points_in_one_place_keep_their_labels_apart() -> None:
    points = [(500.0 + k % 6, 300.0 + k // 6) for k in range(30)]
    assert hidden(points) > 0  # they would hide each other
    assert hidden(place_labels(points, [SIZE] * 30, FRAME)) == 0.0


def test_a_single_label_is_beside_its_point() -> None:
    ((x, y),) = place_labels([(500.0, 300.0)], [SIZE], FRAME)
    assert abs(x - 500) <= SIZE[0] / 2 + 20
    assert abs(y - 300) <= SIZE[1] / 2 + 20
