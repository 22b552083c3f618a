"""Write a scene down as the numbers its kernel reads."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.codegen import EMPTY, KernelSource, Structure
from lenscl.config import Film, Picture, Scene
from lenscl.lenses import Vec3
from lenscl.tracing.blur import blur_of, coat_noise, searched
from lenscl.tracing.placement import Placement
from lenscl.tracing.start import locate, locate_colours, locate_sets
from lenscl.tracing.tabled import table_indices, table_numbers
from lenscl.tracing.tight import search_box

# Scene units; where a polished root of `march` stops moving
TOLERANCE = {"single": 1e-6, "double": 1e-13, "mixed": 1e-13}


def scene_numbers(scene: Scene, source: KernelSource) -> Mapping[str, ArrayLike]:
    """Return a value for every slot of the kernel's layout, and of its table where it has one."""
    values: dict[str, ArrayLike] = {
        "film.corner": scene.film.corner,
        "film.column_step": np.asarray(scene.film.right, dtype=np.float64) / scene.film.columns,
        "film.row_step": np.asarray(scene.film.down, dtype=np.float64) / scene.film.rows,
    }
    values |= _prefixed("source", _source(scene, source.structure))
    values |= _prefixed("picture", picture_numbers(scene))
    values |= _prefixed("method", _method(scene, source.structure.reads()))
    if source.structure.tabled:
        return values | table_numbers(scene, source) | index_numbers(scene, source)
    for number in source.structure.lenses:
        lens = scene.lenses[number]
        low, high = search_box(lens)
        values |= _prefixed(f"lens_{number}", {**Placement.of(lens).numbers(), "box_low": low, "box_high": high})
        if source.structure.nests:
            expression = searched(lens, source.structure.methods[number])
            values |= _prefixed(f"lens_{number}", blur_of(lens, expression, source.structure.carried))
        if coats := source.structure.coats:
            noise = coat_noise(lens, source.structure.carried) if number in coats else 0.0
            values[f"lens_{number}.coat_noise"] = noise
        values |= {f"lens_{number}.{name}": getattr(lens, name) for name, _ in source.structure.lens_reads}
        values |= _prefixed(f"shape_{number}", source.shape_values(number, lens.values))
    return values | index_numbers(scene, source)


def index_numbers(scene: Scene, source: KernelSource) -> dict[str, ArrayLike]:
    """Return the values of the layout that hang on refractive indices, and so on the wavelength."""
    values: dict[str, ArrayLike] = {"n_medium": scene.n_medium}
    if source.structure.tabled:
        return values | table_indices(scene, source)
    for number in source.structure.lenses:
        lens = scene.lenses[number]
        indices = {"n": lens.n, "eta_in": scene.n_medium / lens.n, "eta_out": lens.n / scene.n_medium}
        values |= _prefixed(f"lens_{number}", indices)
    return values


def picture_numbers(scene: Scene) -> Mapping[str, NDArray[np.float64]]:
    """Return the picture's corner, unit normal and dual vectors.

    Computed as exact fractions and rounded once: spans that are nearly parallel lose no digits here.
    """
    right, down = _exact(scene.picture.right), _exact(scene.picture.down)
    normal = _cross(right, down)
    square = sum(part * part for part in normal)
    largest = max(abs(part) for part in normal)
    scaled = np.array([float(part / largest) for part in normal])
    return {
        "corner": np.asarray(scene.picture.corner, dtype=np.float64),
        "normal": scaled / np.linalg.norm(scaled),
        "dual_s": np.array([float(part / square) for part in _cross(down, normal)]),
        "dual_t": np.array([float(part / square) for part in _cross(normal, right)]),
    }


def _exact(vector: Vec3) -> list[Fraction]:
    return [Fraction(part) for part in vector]


def _cross(a: list[Fraction], b: list[Fraction]) -> list[Fraction]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _source(scene: Scene, structure: Structure) -> Mapping[str, ArrayLike]:
    if structure.rays == "given":
        return {EMPTY.name: 0.0}
    if structure.rays == "point":
        at = np.asarray(scene.source.at, dtype=np.float64)
        if structure.colours:
            inside, on, solids = locate_colours(scene, at[None, :], structure.colours)
            return {"at": at, "inside": inside[0], "on": on[0], "solids": solids[0]}
        located = (locate_sets if structure.nests else locate)(scene, at[None, :])
        return {"at": at, "inside": located[0][0], "on": located[1][0]}
    direction, plane = parallel_source(scene)
    return {"direction": direction, "plane": plane}


def parallel_source(scene: Scene) -> tuple[NDArray[np.float64], float]:
    """Return the unit direction of parallel light, and where along it the rays start, before everything."""
    direction = np.asarray(scene.source.direction, dtype=np.float64)
    direction = direction / np.linalg.norm(direction)
    return direction, float((_extent(scene) @ direction).min())


def _extent(scene: Scene) -> NDArray[np.float64]:
    """Return points, shape (N, 3), whose convex hull holds film, picture and every lens."""
    screens = [_screen_corners(screen) for screen in (scene.film, scene.picture)]
    boxes = (group.centres[:, None] + Placement.of(group.lens.solid).corners() for group in scene.lenses.groups)
    return np.concatenate([*screens, *(box.reshape(-1, 3) for box in boxes)])


def _screen_corners(screen: Film | Picture) -> NDArray[np.float64]:
    corner, right, down = (np.asarray(v, dtype=np.float64) for v in (screen.corner, screen.right, screen.down))
    return np.stack([corner, corner + right, corner + down, corner + right + down])


def _method(scene: Scene, keys: tuple[str, ...]) -> dict[str, ArrayLike]:
    given = {key: getattr(scene.numerics, key) for key in keys}
    usual = TOLERANCE[scene.numerics.precision]
    return {key: usual if value is None else value for key, value in given.items()} or {EMPTY.name: 0.0}


def _prefixed(prefix: str, values: Mapping[str, ArrayLike]) -> dict[str, ArrayLike]:
    return {f"{prefix}.{name}": value for name, value in values.items()}
