"""Hold maps against POV-Ray: the same lenses over the same checkerboard, pixel by pixel.

    python bench/against_povray.py [SIZE]

POV-Ray traces a glass ball, a torus, a bifolia and a heart by its own intersections (the heart as an isosurface: its
sextic is lost at the equator), and follows total reflection. Pixels beside a silhouette, where a neighbour's ray meets
another number of surfaces or ends otherwise, are left out, and so are rays of 16 surfaces and more; both are counted.
Where POV-Ray is missing (Debian: apt-get install povray) that is said, and nothing is compared. Exits 1 where less than
99.8 % agree.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray

from lenscl import RayStatus, scene_from_toml, trace
from lenscl.imaging import read_picture

SQUARES = 16  # along each side of the picture
MOST_EVENTS = 16  # rays of so many surfaces and more are not compared
AGREE = 0.998
SOURCE, FILM, PICTURE = 4.0, 2.5, -2.5  # along z
SIDE, BOARD = 0.8, 6.0

# A lens's key in the study, and what POV-Ray calls it
LENSES: dict[str, tuple[dict[str, Any], str]] = {
    "ball": ({"surface": "sphere", "r": 0.6}, "sphere { 0, 0.6 }"),
    "torus": ({"surface": "torus", "R": 0.7, "r": 0.25}, "torus { 0.7, 0.25 sturm rotate 90*x }"),
    "bifolia": (
        {"surface": "bifolia", "centre": [0.0, -0.375, 0.0]},
        "polynomial { 4, xyz(4,0,0): 1, xyz(0,4,0): 1, xyz(0,0,4): 1, xyz(2,2,0): 2, xyz(2,0,2): 2, xyz(0,2,2): 2, "
        "xyz(2,1,0): -3, xyz(0,1,2): -3 sturm translate -0.375*y }",
    ),
    "heart": (
        {"surface": "heart", "rotate": [-90.0, -90.0, 0.0]},
        "isosurface { function { 2*x*x + 2*y*y + z*z - 1 - z*pow(0.1*x*x + y*y, 1/3) } "
        "contained_by { box { <-0.8, -0.8, -1.1>, <0.8, 0.8, 1.2> } } max_gradient 8 accuracy 1e-6 all_intersections "
        "matrix <0, 0, 1, 1, 0, 0, 0, 1, 0, 0, 0, 0> }",
    ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """How many pixels were compared, of them agree, and were left out."""

    name: str
    through: int  # a lens
    compared: int
    agree: int
    beside: int  # a silhouette
    long: int  # of too many surfaces


def compare(name: str, size: int, folder: Path) -> Outcome:
    """Trace a lens both ways."""
    lens, theirs = LENSES[name]
    raymap = trace(scene_from_toml(_study(lens, size)))
    ours = _squares(raymap.st, raymap.status)
    board = _rendered(theirs, size, folder / name)
    through = raymap.events > 0
    # POV-Ray's white squares are even or odd ones: as beside the lens
    even = np.array([np.mean(board[~through & (ours == parity)]) for parity in (0, 1)])
    white = int(np.argmax(even))
    seen = np.where(board < 0, -1, np.where(board > 0, white, 1 - white))
    long = through & ((raymap.events >= MOST_EVENTS) | (raymap.status == RayStatus.TRAPPED))
    beside = through & ~long & _differs(raymap.events.astype(int) * 16 + raymap.status)
    compared = through & ~long & ~beside
    return Outcome(
        name=name, through=int(through.sum()), compared=int(compared.sum()), agree=int((seen == ours)[compared].sum()),
        beside=int(beside.sum()), long=int(long.sum()),
    )  # fmt: skip


def _study(lens: dict[str, Any], size: int) -> str:
    return tomli_w.dumps(
        {
            "source": {"at": [0.0, 0.0, SOURCE]},
            "film": {"centre": [0.0, 0.0, FILM], "right": [SIDE, 0.0, 0.0], "down": [0.0, -SIDE, 0.0]}
            | {"size": [size, size]},
            "picture": {"centre": [0.0, 0.0, PICTURE], "right": [BOARD, 0.0, 0.0], "down": [0.0, -BOARD, 0.0]},
            "lens": [{"n": 1.5, **lens}],
            "numerics": {"max_events": 64},
        }
    )


def _squares(st: NDArray[Any], status: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Return 0 or 1 for the squares of the board, -1 beside it."""
    parity = np.floor(st * SQUARES).astype(np.int64).sum(axis=-1) % 2
    return np.where(status == RayStatus.PICTURE, parity, -1)


def _rendered(lens: str, size: int, path: Path) -> NDArray[np.float64]:
    """Return POV-Ray's board: 1 on white squares, 0 on black ones, -1 beside it, where all is red."""
    scene = f"""
#version 3.7;
global_settings {{ assumed_gamma 1 max_trace_level 120 adc_bailout 0 }}
background {{ rgb <1, 0, 0> }}
camera {{
  perspective location <0, 0, {SOURCE}>
  direction <0, 0, {FILM - SOURCE}> right <{SIDE}, 0, 0> up <0, {SIDE}, 0>
}}
polygon {{
  5, <{-BOARD / 2}, {-BOARD / 2}>, <{BOARD / 2}, {-BOARD / 2}>, <{BOARD / 2}, {BOARD / 2}>, <{-BOARD / 2}, {BOARD / 2}>,
  <{-BOARD / 2}, {-BOARD / 2}>
  pigment {{ checker rgb 1, rgb 0 translate <0, 0, 0.5> scale {BOARD / SQUARES} }}
  finish {{ ambient 0 diffuse 0 emission 1 }}
  translate {PICTURE}*z
}}
object {{
  {lens}
  pigment {{ rgbt 1 }} finish {{ ambient 0 diffuse 0 specular 0 phong 0 reflection 0 }}
  interior {{ ior 1.5 }}
}}
"""
    source, image = path.with_suffix(".pov"), path.with_suffix(".png")
    source.write_text(scene)
    asked = [f"+I{source}", f"+O{image}", f"+W{size}", f"+H{size}", "-D", "-A", "+FN8", "File_Gamma=1.0"]
    done = subprocess.run(["povray", *asked], capture_output=True, text=True, check=False)
    if done.returncode or not image.exists():
        raise SystemExit(f"povray failed on {source}:\n{done.stderr[-2000:]}")
    pixels = read_picture(image).pixels.astype(np.float64)
    return np.where(pixels[..., 0] - pixels[..., 1] > 100, -1.0, (pixels[..., 1] > 127).astype(float))


def _differs(labels: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which pixels have another label than one of their eight neighbours."""
    padded = np.pad(labels, 1, mode="edge")
    rows, columns = labels.shape
    around = [padded[i : i + rows, j : j + columns] for i in range(3) for j in range(3)]
    return np.any([part != labels for part in around], axis=0)


def main() -> None:
    """Print a line a lens."""
    if shutil.which("povray") is None:
        print("skipped: POV-Ray is not installed (Debian: apt-get install povray)")
        return
    size = int(sys.argv[1]) if len(sys.argv) > 1 else 512
    worst = 1.0
    with tempfile.TemporaryDirectory() as folder:
        for name in LENSES:
            one = compare(name, size, Path(folder))
            share = one.agree / one.compared
            worst = min(worst, share)
            print(
                f"{one.name:8} {100 * share:8.4f} % of {one.compared:,} pixels agree; of {one.through:,} through the "
                f"lens {one.beside:,} lie beside a silhouette, {one.long:,} meet {MOST_EVENTS} surfaces or more",
                flush=True,
            )
    if worst < AGREE:
        raise SystemExit(f"less than {100 * AGREE:g} % agree")


if __name__ == "__main__":
    main()
