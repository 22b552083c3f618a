from __future__ import annotations

import numpy as np
import pytest

from lenscl.errors import StudyError
from lenscl.imaging import SAMPLES, draw


@pytest.mark.parametrize("name", SAMPLES)
def test_a_sample_is_drawn_at_any_size(name):
    assert len(SAMPLES) >= 5
    for size in ((1, 1), (1, 9), (70, 33), (33, 70), (128, 128)):
        picture = draw(name, size)
        assert picture.shape == (size[1], size[0], 3)
        assert picture.dtype == np.uint8
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) >= 6  # something is on it
    assert np.array_equal(draw(name, 128), picture)


@pytest.mark.parametrize("name", SAMPLES)
def test_bands_leave_no_seams(name):
    """A tall picture is drawn in bands; shifted by half a band, the middle must come out the same."""
    tall = draw(name, (48, 48))
    padded = draw(name, (48, 48 + 64))
    assert np.array_equal(padded[32:80], tall)


def test_the_corners_of_the_checkers_differ_and_edges_are_exact():
    picture = draw("checkers", 64)
    corners = {tuple(picture[i, j]) for i in (0, -1) for j in (0, -1)}
    assert len(corners) == 4
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) == 6  # squares of whole pixels need no smoothing


def test_edges_are_smooth_in_linear_light():
    picture = draw("chart", 256).astype(int)
    star = picture[100:156, 100:156, 1]
    between = ((star > 30) & (star < 225)).mean()
    assert between > 0.3


def test_an_unknown_sample_or_size_says_what_there_is():
    with pytest.raises(StudyError, match="cat, chart, checkers"):
        draw("dog")
    with pytest.raises(StudyError, match="0 x 5"):
        draw("cat", (0, 5))
