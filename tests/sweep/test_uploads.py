"""What a sweep moves to the device: a picture once, a map once a point."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from imaging.devices import counting

from lenscl.config import load_study
from lenscl.device import choose
from lenscl.imaging import draw, read_picture, write_image
from lenscl.sweep import plan_sweep, run_sweep

PICTURES, POINTS, FILM = 4, 4, (12, 20)


@pytest.mark.parametrize(
    "effects", ["", 'fresnel = "split"\nantialias = "edges"\n', 'dispersion = "rgb"\nfootprint = true\n']
)
def test_a_picture_goes_up_once_and_a_map_once_a_point(effects: str, study_path: Path) -> None:
    folder = study_path.parent / "pictures"
    for path in folder.iterdir():
        path.unlink()
    for number in range(PICTURES):  # each of a size of its own
        write_image(folder / f"{number}.png", draw("checkers", 32 + number), metadata={})
    shapes = [read_picture(folder / f"{number}.png").pixels.shape for number in range(PICTURES)]
    assert len(set(shapes)) == PICTURES
    study_path.write_text(study_path.read_text().replace("[sweep.axes]", f"[effects]\n{effects}[sweep.axes]"))

    device = counting(choose())
    rows = list(run_sweep(plan_sweep(load_study(study_path), study_path.parent / "out"), device=device))
    assert [row.state for row in rows] == ["done"] * PICTURES * POINTS
    ups = Counter(shape for shape, _ in device.uploads)
    assert [ups[shape] for shape in shapes] == [1] * PICTURES
    layers = 3 if "rgb" in effects else 1
    mirrored = 2 if "split" in effects else 1  # where reflections land on the picture
    assert ups[FILM] == ups[(*FILM, 2)] == POINTS * layers * mirrored
    assert ups[(1, 1, 3)] <= 2 * PICTURES * POINTS  # the colour outside
