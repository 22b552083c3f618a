"""POV-Ray sees the same through the same lenses, where it is installed."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from against_povray import LENSES, _differs, compare


@pytest.mark.skipif(shutil.which("povray") is None, reason="POV-Ray is not installed (Debian: apt-get install povray)")
@pytest.mark.parametrize("name", LENSES)
def test_pov_ray_sees_the_same(name: str, tmp_path: Path) -> None:
    one = compare(name, 96, tmp_path)
    assert one.compared > 1000
    assert one.compared + one.beside + one.long == one.through
    assert one.agree >= 0.998 * one.compared


def test_only_pixels_beside_another_kind_are_left_out() -> None:
    labels = np.zeros((5, 6), np.int64)
    labels[2, 3] = 1
    beside = _differs(labels)
    assert beside.sum() == 9
    assert beside[1:4, 2:5].all()
