from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from lenscl.imaging import write_image
from lenscl.imaging.samples import SAMPLES, draw

STUDY = """
title = "A small study"
[source]
kind = "point"
at = [0.0, 0.0, 4.0]
[film]
centre = [0.0, 0.0, 2.5]
right = [2.0, 0.0, 0.0]
down = [0.0, -2.0, 0.0]
size = [20, 12]
[picture]
centre = [0.0, 0.0, -2.5]
right = [6.0, 0.0, 0.0]
down = [0.0, -6.0, 0.0]
images = "pictures/*"
[[lens]]
surface = "ellipsoid"
a = 1.0
b = 0.8
c = 0.6
n = 1.5
[sweep.axes]
"lens.c" = [0.4, 0.6]
"lens.n" = [1.3, 1.5]
"""


@pytest.fixture
def study_path(tmp_path: Path) -> Path:
    """A study of 4 points and 3 pictures."""
    folder = tmp_path / "study"
    (folder / "pictures").mkdir(parents=True)
    for name in sorted(SAMPLES)[:3]:
        write_image(folder / "pictures" / f"{name}.png", draw(name, 32), metadata={})
    path = folder / "small.toml"
    path.write_text(STUDY)
    return path


@pytest.fixture(scope="session")
def outputs() -> Callable[[Path], dict[str, bytes]]:
    """Read every file of a sweep's folder but its table and lock."""
    return lambda folder: {
        path.name: path.read_bytes() for path in folder.iterdir() if not path.name.startswith("sweep.")
    }
