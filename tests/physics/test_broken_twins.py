"""Every fault that is put into the kernels is caught, and by each of the properties named with it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from faults_in_kernels import FAULTS, Fault, broken
from physics import differentials, maps, paths
from physics.paths import Law, Paths
from physics.test_many_lenses import BALL, EGG
from physics.test_symmetries import edge_on_edge
from probe import plain_device
from scenes import make_scene

from lenscl.accuracy.selfcheck import check_rays
from lenscl.config import Scene
from lenscl.tracing import film_rays

FILM = {"size": [12, 12]}
NARROW = 1  # one ray to a packet, and plain: compiled in a fourth of the time


@cache
def scene_of(name: str) -> Scene:
    """Return a scene: each shows what some fault breaks."""
    match name:
        case "askew":  # the source is inside: rays leave, some of them after total reflections
            lens = {"surface": "ellipsoid", "a": 1.0, "b": 0.7, "c": 0.5, "centre": [0.1, 0.05, -0.2], "n": 2.2}
            stand = {"rotate": [20, 30, 10], "stretch": [1.0, 0.9, 0.8]}
            return make_scene(lens | stand, source={"kind": "point", "at": [0.3, 0.1, -0.1]}, film=FILM)
        case "egg":
            return make_scene({"surface": "ellipsoid", "b": 0.8, "c": 0.6, "rotate": [20, 30, 10]}, film=FILM)
        case "ring":  # from the side: through both walls
            return make_scene({"surface": "torus", "rotate": [90, 10, 0]}, film=FILM)
        case "behind":  # the picture is behind the source
            return scene_of("egg").replace({"picture.corner": [-3.0, 3.0, 6.5]})
        case "two":
            film = {"right": [0.5, 0.0, 0.0], "down": [0.0, -0.5, 0.0]} | FILM
            return make_scene(BALL | {"centre": [0, 0, 0.9]}, EGG | {"centre": [0, 0, -1.4]}, film=film)
        case "touched":  # one ray in three passes a ball at the rounding of its rim
            return make_scene({"surface": "sphere", "r": 0.5}, film=FILM)
        case "beyond":
            # F is less than 0 in a second ball, which is no part of the solid: it lies beyond the box. Were it a factor
            # of F, it would be left out, being positive in the box
            other = "(x^2 + y^2 + (z + 1.5)^2 - 0.36)"
            balls = {"surface": f"(x^2 + y^2 + z^2 - 0.36)*{other} - 1e-6", "bounds": [[-0.7] * 3, [0.7] * 3]}
            return make_scene(balls, film=FILM)
        case "edge":
            return edge_on_edge("double")
    raise ValueError(name)


def rays_of(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the rays to send through a scene: its film's."""
    origins, directions = film_rays(scene_of(name), np.arange(144))
    if name == "touched":
        past = np.arange(144) % 3 == 0
        origins = np.where(past[:, None], [0.5, 0.0, 4.0], origins)
        directions = np.where(past[:, None], [0.0, 0.0, -1.0], directions)
    return origins, directions


def of_paths(law: Callable[[Paths], Law]) -> Callable[[str], Law]:
    """Return a law of paths as one of a scene's rays."""
    return lambda name: law(Paths.of(scene_of(name), plain_device(NARROW), *rays_of(name)))


def of_checks(law: str) -> Callable[[str], Law]:
    """Return the worst residual of one of the laws of self-checks, in units of its bound."""

    def worst(name: str) -> Law:
        check = check_rays(scene_of(name), plain_device(NARROW), *rays_of(name))
        return np.array([check.worst.get(law, 0.0)]), np.ones(1)

    return worst


PROPERTIES: dict[str, Callable[[str], Law]] = {
    **{law: of_checks(law) for law in ("length", "surface", "snell", "return", "ahead", "place")},
    "decided": of_paths(paths.decided),
    "clear": of_paths(paths.unobstructed),
    "box": of_paths(paths.within_box),
    "stationary": of_paths(paths.stationary),
    "landing": of_paths(paths.landing_statuses),
    "limits": of_paths(paths.limits),
    "etendue": of_paths(differentials.symplectic),
    "wavefront": of_paths(differentials.wavefront),
    "film": lambda name: maps.film_is_its_rays(scene_of(name), plain_device(NARROW)),
    "edges": lambda name: maps.one_of_two_pictures(scene_of(name), plain_device(NARROW)),
    "packets": lambda name: maps.order_is_nothing(scene_of(name), plain_device(4), *rays_of(name)),
}
CAUGHT: dict[str, tuple[str, tuple[str, ...]]] = {  # where, and by what
    "sign under the root of Snell's law": ("egg", ("snell", "stationary", "length", "return")),
    "total reflection missed": ("askew", ("length",)),
    "total reflection too early": ("askew", ("snell",)),
    "index ratio inverted on exit": ("egg", ("snell", "return")),
    "normal not turned against the ray": ("egg", ("snell", "return")),
    "normal without the inverse transpose": ("askew", ("snell", "stationary", "wavefront", "etendue")),
    "reflected not quite": ("askew", ("length",)),
    "direction not unit": ("egg", ("film",)),
    "refracted longer than unit": ("egg", ("length",)),
    "last roots dropped": ("ring", ("ahead", "return")),
    "first root passed over": ("egg", ("decided",)),
    "box left behind": ("beyond", ("box",)),
    "known root met again": ("ring", ("decided",)),
    "re-entry lost": ("ring", ("ahead", "return")),
    "side taken from the sign of F": ("ring", ("decided",)),
    "farther lens met first": ("two", ("clear", "return")),
    "point beside the surface": ("egg", ("surface",)),
    "picture closed at 1": ("edge", ("edges",)),
    "s and t swapped": ("egg", ("place",)),
    "screen behind the ray accepted": ("behind", ("landing",)),
    "half a pixel off": ("egg", ("film",)),
    "rows and columns of the film mixed up": ("egg", ("film",)),
    "event limit off by one": ("egg", ("limits",)),
    "event limit without its status": ("egg", ("limits",)),
    "one doubt ends its whole packet": ("touched", ("packets",)),
}


def worst(name: str, scene: str) -> tuple[float, int]:
    """Return the largest residual of a property, in units of its bound, and how many residuals have a bound."""
    with np.errstate(all="ignore"):  # a broken ray may hold anything
        residual, bound = PROPERTIES[name](scene)
        told = np.isfinite(bound)
        ratio = np.where(np.isfinite(residual), residual / bound, 1e30)
    return float(np.max(ratio[told], initial=0.0)), int(told.sum())


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_in_the_kernels_is_caught(fault: Fault) -> None:
    scene, names = CAUGHT[fault.name]
    with broken(fault):
        found = {name: worst(name, scene) for name in names}
    assert all(ratio > 1.0 for ratio, _ in found.values()), found


@pytest.mark.parametrize("scene", sorted({scene for scene, _ in CAUGHT.values()}))
def test_whole_kernels_pass_each_property_that_catches_a_fault(scene: str) -> None:
    names = {name for where, names in CAUGHT.values() for name in names if where == scene}
    found = {name: worst(name, scene) for name in names}
    assert all(ratio <= 1.0 and told for ratio, told in found.values()), found


def test_every_fault_has_a_property_and_every_property_a_fault() -> None:
    assert [fault.name for fault in FAULTS] == list(CAUGHT)
    assert {name for _, names in CAUGHT.values() for name in names} == PROPERTIES.keys()
