"""Write a scene down as the numbers its kernel reads."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.codegen import EMPTY, KernelSource
from lenscl.config import Film, Picture, Scene
from lenscl.lenses import Vec3
from lenscl.tracing.blur import blur_of, coat_noise
from lenscl.tracing.placement import Placement
from lenscl.tracing.start import locate, locate_sets

# Scene units; where a polished root of `march` stops moving
TOLERANCE = {"single": 1e-6, "double": 1e-13, "mixed": 1e-13}


def scene_numbers(scene: Scene, source: KernelSource) -> Mapping[str, ArrayLike]:
    """Return a value for every slot of the kernel's layout."""
    values: dict[str, ArrayLike] = {
        "film.corner": scene.film.corner,
        "film.column_step": np.asarray(scene.film.right, dtype=np.float64) / scene.film.columns,
        "film.row_step": np.asarray(scene.film.down, dtype=np.float64) / scene.film.rows,
    }
    values |= _prefixed("source", _source(scene, source.structure.rays, bool(source.structure.nests)))
    values |= _prefixed("picture", picture_numbers(scene))
    values |= _prefixed("method", _method(scene, source.structure.reads()))
    for number in source.structure.lenses:
        lens = scene.lenses[number]
        values |= _prefixed(f"lens_{number}", Placement.of(lens).numbers())
        if source.structure.nests:
            is_polynomial = source.structure.methods[number].wants_polynomial
            searched = (lens.surface.polynomial_form if is_polynomial else None) or lens.surface.expression
            values |= _prefixed(f"lens_{number}", blur_of(lens, searched, source.structure.carried))
        if coats := source.structure.coats:
            noise = coat_noise(lens, source.structure.carried) if number in coats else 0.0
            values[f"lens_{number}.coat_noise"] = noise
        values |= {f"lens_{number}.{name}": getattr(lens, name) for name, _ in source.structure.lens_reads}
        values |= _prefixed(f"shape_{number}", source.shape_values(number, lens.values))
    return values | index_numbers(scene, source)


def index_numbers(scene: Scene, source: KernelSource) -> dict[str, ArrayLike]:
    """Return the values of the layout that hang on refractive indices, and so on the wavelength."""
    values: dict[str, ArrayLike] = {"n_medium": scene.n_medium}
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


def _source(scene: Scene, rays: str, is_nested: bool) -> Mapping[str, ArrayLike]:
    if rays == "given":
        return {EMPTY.name: 0.0}
    if rays == "point":
        at = np.asarray(scene.source.at, dtype=np.float64)
        inside, on = (locate_sets if is_nested else locate)(scene, at[None, :])
        return {"at": at, "inside": inside[0], "on": on[0]}
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
    return np.concatenate([*screens, *(Placement.of(lens).corners() for lens in scene.lenses)])


def _screen_corners(screen: Film | Picture) -> NDArray[np.float64]:
    corner, right, down = (np.asarray(v, dtype=np.float64) for v in (screen.corner, screen.right, screen.down))
    return np.stack([corner, corner + right, corner + down, corner + right + down])


def _method(scene: Scene, keys: tuple[str, ...]) -> dict[str, ArrayLike]:
    given = {key: getattr(scene.numerics, key) for key in keys}
    usual = TOLERANCE[scene.numerics.precision]
    return {key: usual if value is None else value for key, value in given.items()} or {EMPTY.name: 0.0}


def _prefixed(prefix: str, values: Mapping[str, ArrayLike]) -> dict[str, ArrayLike]:
    return {f"{prefix}.{name}": value for name, value in values.items()}
