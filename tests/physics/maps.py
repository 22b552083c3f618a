"""Ray maps of scenes that are moved, turned, mirrored or scaled as a whole, and what must become of them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl import RayStatus, trace, trace_rays
from lenscl.accuracy import pixel_bounds
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.tracing import RayMap, film_rays

Array = NDArray[np.float64]
Law = tuple[Array, Array]  # residuals and bounds, the latter infinite where nothing can be said

EPSILON = {"single": 2.0**-23, "double": 2.0**-52, "mixed": 2.0**-52}
_MOST = 1e-2  # of the picture: a bound beyond is of a ray that roundings lead anywhere
_SCREENS = {"film": ("corner", "right", "down"), "picture": ("corner", "right", "down")}


def carried(scene: Scene, linear: Array, shift: Array, lenses: dict[str, Any]) -> Scene:
    """Return a scene with source and screens mapped linearly, then shifted; `lenses` are keys to change of those."""
    changes: dict[str, Any] = dict(lenses)
    for screen, keys in _SCREENS.items():
        for key in keys:
            vector = linear @ np.asarray(getattr(getattr(scene, screen), key))
            changes[f"{screen}.{key}"] = (vector + shift if key == "corner" else vector).tolist()
    if scene.source.kind == "point":
        changes["source.at"] = (linear @ np.asarray(scene.source.at) + shift).tolist()
    else:
        changes["source.direction"] = (linear @ np.asarray(scene.source.direction)).tolist()
    return scene.replace(changes)


def scaled(scene: Scene, k: float) -> Scene:
    """Return a scene of one lens with every length times k."""
    lens = scene.lenses[0]
    lengths = {"lens.centre": lens.centre, "lens.stretch": lens.stretch}
    grown = {key: [part * k for part in vector] for key, vector in lengths.items()}
    return carried(scene, k * np.eye(3), np.zeros(3), grown)


def mirrored(scene: Scene) -> Scene:
    """Return the mirror image in x = 0 of a scene of one lens that is its own mirror image in its own x = 0."""
    lens = scene.lenses[0]
    x, y, z = lens.centre
    about_x, about_y, about_z = lens.rotate
    turned = {"lens.centre": [-x, y, z], "lens.rotate": [about_x, -about_y, -about_z]}
    return carried(scene, np.diag([-1.0, 1.0, 1.0]), np.zeros(3), turned)


def turned(scene: Scene, degrees: float) -> Scene:
    """Return a scene of one lens turned about the world's z axis."""
    lens = scene.lenses[0]
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    about_z = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    a, b, angle = lens.rotate
    stands = {"lens.centre": (about_z @ lens.centre).tolist(), "lens.rotate": [a, b, angle + degrees]}
    return carried(scene, about_z, np.zeros(3), stands)


def shifted(scene: Scene, shift: Array) -> Scene:
    """Return a scene of one lens moved as a whole."""
    return carried(scene, np.eye(3), shift, {"lens.centre": (np.asarray(scene.lenses[0].centre) + shift).tolist()})


def film_moved(scene: Scene, columns: int, rows: int) -> Scene:
    """Return a scene with its film moved by whole pixels along its spans."""
    film = scene.film
    step = np.asarray(film.right) * columns / film.columns + np.asarray(film.down) * rows / film.rows
    return scene.replace({"film.corner": (np.asarray(film.corner) + step).tolist()})


def film_turned_over(scene: Scene) -> Scene:
    """Return a scene whose film has its columns in the other order, at the same places."""
    film = scene.film
    corner = np.asarray(film.corner) + np.asarray(film.right)
    return scene.replace({"film.corner": corner.tolist(), "film.right": (-np.asarray(film.right)).tolist()})


def bounds(scene: Scene, device: Device) -> Array:
    """Return how far (s, t) of each pixel may be from exact physics, infinite where nothing can be said.

    The bound of a double trace, in proportion to the roundings of the scene's precision.
    """
    film, grown = scene.film, EPSILON[scene.numerics.precision] / EPSILON["double"]
    found = pixel_bounds(scene, np.arange(film.rows * film.columns), device=device).bound * grown
    return np.where((found >= 0.0) & (found < _MOST), found, np.inf).reshape(film.rows, film.columns)


def differs(one: RayMap, other: RayMap, bound: Array) -> Law:
    """Return how far the places of two maps are apart, and the bound, shape (rows, columns).

    Where another way was taken, or another end but at the picture's edge, they are as far apart as can be.
    """
    apart = np.abs(one.st.astype(float) - other.st).max(axis=-1)
    near_edge = (np.minimum(np.abs(one.st), np.abs(one.st - 1.0)) <= bound[..., None]).any(axis=-1)
    changed = (one.events != other.events) | ((one.status != other.status) & ~near_edge)
    undecided = (one.status == RayStatus.UNDECIDED) | (other.status == RayStatus.UNDECIDED)
    return np.where(changed, 1.0, apart), np.where(undecided, np.inf, bound)


def same_bits(one: RayMap, other: RayMap) -> Law:
    """Return residuals that are 0 where two maps are the same to the last bit, and bounds of less than 1."""
    same = (one.st == other.st).all(axis=-1) & (one.status == other.status) & (one.events == other.events)
    return np.where(same, 0.0, 1.0), np.full(same.shape, 0.5)


def film_is_its_rays(scene: Scene, device: Device) -> Law:
    """Hold a film's map against the same rays, given one by one."""
    raymap = trace(scene, device=device)
    paths = trace_rays(scene, *film_rays(scene, np.arange(raymap.status.size)), device=device)
    rows, columns = raymap.status.shape
    given = RayMap(
        st=paths.st.reshape(rows, columns, 2),
        status=paths.status.reshape(rows, columns),
        events=paths.events.reshape(rows, columns),
        legs=lambda _: (paths.origin, paths.direction),
        trace_seconds=0.0, escalated=0, kernel=raymap.kernel, scene=scene, device=device,
    )  # fmt: skip
    return differs(raymap, given, 2.0 * bounds(scene, device))


def order_is_nothing(scene: Scene, device: Device, origins: Array, directions: Array) -> Law:
    """Hold rays in one order against the same in another: none depends on the others of its packet."""
    order = np.random.default_rng(1).permutation(len(origins))
    one = trace_rays(scene, origins, directions, device=device)
    other = trace_rays(scene, origins[order], directions[order], device=device)
    same = (one.origin[order] == other.origin).all(axis=1) & (one.st[order] == other.st).all(axis=1)
    same &= (one.status[order] == other.status) & (one.events[order] == other.events)
    return np.where(same, 0.0, 1.0), np.full(len(origins), 0.5)


def one_of_two_pictures(scene: Scene, device: Device) -> Law:
    """Hold a picture against the one beside it: a ray at their common edge is on one of them, and on one only.

    The film's columns run through the edge: rays go straight to it, along numbers that nothing rounds.
    """
    right = np.asarray(scene.picture.right)
    beside = scene.replace({"picture.corner": (np.asarray(scene.picture.corner) + right).tolist()})
    one, other = (trace(each, device=device).status == RayStatus.PICTURE for each in (scene, beside))
    return (one.astype(float) + other.astype(float) - 1.0) ** 2, np.full(one.shape, 0.5)
