"""Draw the pictures of README.md and docs/, from studies of configs/.

    python docs/figures/draw.py            # all of them, some minutes
    python docs/figures/draw.py gallery    # one group: glass, gallery, effects, arrangements, mirrors or caustics

Each study is rendered by the command line. The result is stored as JPEG of quality 88, so that the repository stays
small; `lenscl render` itself writes quality 95.
"""

from __future__ import annotations

import csv
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Sequence
from pathlib import Path

import OpenImageIO

ROOT = Path(__file__).parents[2]
PICTURES = ROOT / "docs" / "pictures"
QUALITY = 88
GROUPS = ("glass", "gallery", "effects", "arrangements", "mirrors", "caustics")


def _shrunk(source: Path, target: Path) -> None:
    """Store a picture as a small JPEG, without metadata."""
    pixels = OpenImageIO.ImageBuf(str(source)).get_pixels(OpenImageIO.UINT8)[:, :, :3]
    height, width, channels = pixels.shape
    spec = OpenImageIO.ImageSpec(width, height, channels, "uint8")
    spec["Compression"] = f"jpeg:{QUALITY}"
    target.parent.mkdir(parents=True, exist_ok=True)
    output = OpenImageIO.ImageOutput.create(str(target))
    if not (output and output.open(str(target), spec) and output.write_image(pixels) and output.close()):
        raise SystemExit(f"{target}: {OpenImageIO.geterror()}")
    print(f"{target.relative_to(ROOT)}: {target.stat().st_size} bytes")


def _render(study: Path, target: Path, scratch: Path) -> None:
    made = scratch / f"{study.stem}.png"
    subprocess.run(["lenscl", "render", str(study), "-o", str(made)], check=True)
    _shrunk(made, target)


def _gallery(scratch: Path) -> None:
    study = ROOT / "configs" / "gallery.toml"
    subprocess.run(["lenscl", "sweep", str(study), "-o", str(scratch)], check=True, stdout=subprocess.DEVNULL)
    names = tomllib.loads(study.read_text(encoding="utf-8"))["sweep"]["zip"][0]["lens.surface"]
    table = subprocess.run(["lenscl", "export", str(scratch), "--csv"], check=True, stdout=subprocess.PIPE, text=True)
    for name, row in zip(names, csv.DictReader(table.stdout.splitlines()), strict=True):
        assert row["lens.surface"] == name, row
        _shrunk(scratch / row["output"], PICTURES / "lenses" / f"{name}.jpg")


def _folder(name: str, scratch: Path) -> None:
    for study in sorted((ROOT / "configs" / name).glob("*.toml")):
        _render(study, PICTURES / name / f"{study.stem}.jpg", scratch)


def main(groups: Sequence[str]) -> None:
    """Draw the groups that are named, or all."""
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        for group in groups or GROUPS:
            if group == "glass":
                _render(ROOT / "configs" / "glass.toml", PICTURES / "glass.jpg", scratch)
            elif group == "gallery":
                _gallery(scratch)
            else:
                _folder(group, scratch)


if __name__ == "__main__":
    main(sys.argv[1:])
