"""Hold the light on pictures against counts of rays, cell by cell.

    python bench/validate_caustics.py [--rays 1000000] [--scene PART]... [--random] [--save FOLDER]

Prints a row a scene: the cells that counted rays or the program light, how many of them differ by more than 4 standard
errors of the counts, the root mean square of the difference over that error, and the root mean square of what the
program is off by where a cell has 100 rays or more, beside what the counts alone would give. Rays start at the source
and go through random places of the film, one in each of as many equal squares (`--random`: anywhere). A ray carries the
flux of its square: solid angle or area across. The standard error of a cell is that of as many rays as it is to get,
each as heavy as those that it and the cells around it got: no less than the root of the sum of their squares.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import lenscl
from lenscl.config import Scene
from lenscl.effects.colours import LUMINANCE
from lenscl.status import RayStatus
from lenscl.tracing import flux, trace_rays
from lenscl.tracing.film import rays_through

CONFIGS = Path(__file__).parent.parent / "configs" / "caustics"
_TOGETHER = 2**20  # rays at a time
_SEED = 11
Array = NDArray[np.float64]

_FILM = {"film.size": [48, 48]}
_PLAIN = {"effects.fresnel": False}


def _changed(name: str, changes: dict[str, Any]) -> Callable[[], Scene]:
    return lambda: lenscl.load_study(CONFIGS / f"{name}.toml").scene.replace(changes)


def _text(lenses: str, source: str, effects: str) -> Callable[[], Scene]:
    return lambda: lenscl.scene_from_toml(
        f"""
[source]
{source}
[film]
centre = [0.0, 0.0, 2.0]
right = [2.4, 0.0, 0.0]
down = [0.0, -2.4, 0.0]
size = [160, 160]
[picture]
centre = [0.1, -0.1, -1.2]
right = [2.6, 0.0, 0.0]
down = [0.0, -2.6, 0.0]
size = [120, 120]
{lenses}
[effects]
caustics = true
{effects}
"""
    )


_BALL = '[[lens]]\nname = "a"\nsurface = "sphere"\nr = 0.5\ncentre = [-0.25, 0.1, 0.3]\n'
_RING = (
    '[[lens]]\nname = "b"\nsurface = "torus"\nR = 0.5\nr = 0.15\ncentre = [0.25, -0.1, -0.6]\nrotate = [20, 10, 0]\n'
)
_POINT = 'kind = "point"\nat = [-1.0, 0.8, 4.0]'
_SLANTED = 'kind = "parallel"\ndirection = [0.25, -0.15, -1.0]'

SCENES: dict[str, Callable[[], Scene]] = {
    "ball": _changed("ball", {}),
    "ball, 128 x 128 cells": _changed("ball", {"picture.size": [128, 128]}),
    "ball, 64 x 64 cells": _changed("ball", {"picture.size": [64, 64]}),
    "ball, film of 90 x 80": _changed("ball", {"film.size": [90, 80], "picture.size": [128, 128]}),
    "ball, no fresnel": _changed("ball", {"picture.size": [128, 128], "effects.fresnel": False}),
    "torus": _changed("torus", {}),
    "torus, 128 x 128 cells": _changed("torus", {"picture.size": [128, 128]}),
    "torus, film of 90 x 90": _changed("torus", {"film.size": [90, 90], "picture.size": [128, 128]}),
    "two lenses": _text(_BALL + "n = 1.5\n" + _RING + "n = 1.6\n", _POINT, "fresnel = true"),
    "two lenses, parallel": _text(_BALL + "n = 1.5\n" + _RING + "n = 1.6\n", _SLANTED, "fresnel = true"),
    "coloured": _text(_BALL + "n = 1.5\nabsorption = [0.2, 0.8, 2.5]\n", _POINT, "fresnel = true"),
    "dispersed": _text(_BALL + 'n = "SF11"\n', _SLANTED, 'dispersion = "rgb"\nfresnel = true'),
    "diamond ring": _text(_RING + "n = 2.4\n", _SLANTED, "fresnel = true"),
}


def counted(scene: Scene, rays: int, seed: int, *, is_random: bool) -> tuple[Array, Array, NDArray[np.int64]]:
    """Return the light of counted rays on every cell, the sum of their squares, and how many they are.

    Shapes (rows, columns); in units of what the source alone sends to the cell.
    """
    plain = scene.replace({"effects.caustics": False})
    film, picture = scene.film, scene.picture
    side = int(np.ceil(np.sqrt(rays)))
    cells = picture.rows * picture.columns
    light, squares, count = np.zeros(cells), np.zeros(cells), np.zeros(cells, np.int64)
    draw = np.random.default_rng(seed)
    for first in range(0, side * side, _TOGETHER):
        numbers = np.arange(first, min(first + _TOGETHER, side * side))
        if is_random:
            s, t = draw.random((2, len(numbers)))
        else:
            s, t = (
                (numbers % side + draw.random(len(numbers))) / side,
                (numbers // side + draw.random(len(numbers))) / side,
            )
        origins, directions = rays_through(scene, s, t)
        paths = trace_rays(plain, origins, directions)
        normal = np.cross(film.right, film.down)
        lengths = np.linalg.norm(directions, axis=1)
        carried = np.abs(directions @ normal) / lengths / (side * side)
        if scene.source.at is not None:
            carried /= lengths**2
        if "transmittance" in paths.added:
            carried *= paths.transmittance
        if "transmission" in paths.added:
            carried *= paths.transmission @ LUMINANCE
        lands = paths.status == RayStatus.PICTURE
        column, row = np.floor(paths.st[lands].astype(float) * picture.size).astype(int).T
        at = row * picture.columns + column
        light += np.bincount(at, carried[lands], cells)
        squares += np.bincount(at, carried[lands] ** 2, cells)
        count += np.bincount(at, minlength=cells)
    direct = flux.flux_of_cells(scene, picture).sum(axis=-1)
    shape = direct.shape
    return light.reshape(shape) / direct, squares.reshape(shape) / direct**2, count.reshape(shape)


def standard_errors(light: Array, squares: Array, count: NDArray[np.int64], expected: Array) -> Array:
    """Return the standard error of counted light on each cell, given what is expected there."""
    # A ray is as heavy as the cell and those around it got; where they got none, as all of the picture did. By itself a
    # cell may have missed the heavy ones
    around_light, around_squares = (
        sum(np.roll(array, (down, right), axis=(0, 1)) for down in (-1, 0, 1) for right in (-1, 0, 1))
        for array in (light, squares)
    )
    overall = np.full_like(light, squares.sum() / light.sum())
    heavy = np.divide(around_squares, around_light, where=around_light > 0, out=overall)
    return np.sqrt(np.maximum(squares, heavy * np.maximum(expected, 0.0)))


def compared(
    scene: Scene, rays: int, *, is_random: bool
) -> Iterator[tuple[Array, Array, Array, NDArray[np.int64], Any]]:
    """Yield, for each wavelength, what the program says, the counts, their standard errors, and how many they are."""
    raymap = lenscl.trace(scene)
    assert raymap.caustic is not None
    irradiance = raymap.irradiance
    many = [irradiance] if irradiance.ndim == 2 else list(irradiance)
    for number, (one, found) in enumerate(zip(raymap.scene.layers() if len(many) > 1 else [scene], many, strict=True)):
        light, squares, count = counted(one, rays, _SEED + number, is_random=is_random)
        yield found, light, standard_errors(light, squares, count, found), count, raymap


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rays", type=int, default=1_000_000)
    parser.add_argument("--scene", action="append", default=[], metavar="PART")
    parser.add_argument("--random", action="store_true")
    parser.add_argument("--save", type=Path)
    asked = parser.parse_args()
    print(f"{'':26} {'':>7} {'beyond':>6} {'':>7} {'':>6} {'':>6} {'with 100 rays':>14} {'by':>7} {'not':>8}")
    print(
        f"{'scene':26} {'cells':>7} {'4':>6} {'%':>7} {'rms':>6} {'worst':>6} {'off':>14} {'counts':>7} excluded",
        flush=True,
    )
    for name, make in SCENES.items():
        if asked.scene and not any(part in name for part in asked.scene):
            continue
        scene = make()
        begin = time.perf_counter()
        for found, light, error, count, raymap in compared(scene, asked.rays, is_random=asked.random):
            lit = (found > 0) | (count > 0)
            z = (found - light)[lit] / error[lit]
            beyond = int((np.abs(z) > 4).sum())
            many = count >= 100
            off = np.sqrt((((found - light)[many] / found[many]) ** 2).mean()) if many.any() else np.nan
            alone = np.sqrt(((error[many] / found[many]) ** 2).mean()) if many.any() else np.nan
            open_ = raymap.caustic.not_excluded - raymap.caustic.bent
            row = f"{name:26} {lit.sum():7d} {beyond:6d} {100 * beyond / max(lit.sum(), 1):7.3f}"
            row += f" {np.sqrt((z**2).mean()):6.2f} {np.abs(z).max():6.1f} {100 * off:12.2f} % {100 * alone:5.2f} %"
            print(f"{row} {open_:8.1g} {time.perf_counter() - begin:6.1f} s", flush=True)
            if asked.save:
                asked.save.mkdir(parents=True, exist_ok=True)
                part = "".join(c if c.isalnum() else "-" for c in name)
                np.savez(asked.save / f"{part}.npz", found=found, light=light, error=error, count=count)


if __name__ == "__main__":
    main()
