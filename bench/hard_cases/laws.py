"""Laws of optics as rays: reversed paths, bundles, mirrored and turned scenes, and lenses that image exactly."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hard_cases.aims import aimed_case, down_on, generator, joined, rays, unit
from hard_cases.scenes import PLACED, SLAB, Table, lens, scene, user
from lenscl.config import scene_from_toml
from lenscl.hardcases import Array, Case
from lenscl.tracing import trace_rays

_FEW = {"max_events": 12}


def cases() -> Iterator[Case]:
    """Yield them."""
    yield from _snell()
    yield from _reversed()
    yield from _bundles()
    yield from _symmetries()
    yield from _exact_lenses()
    yield from _effects()


def _snell() -> Iterator[Case]:
    for n, medium in ((1.5, 1.0), (2.417, 1.333), (1.0, 1.5)):
        name = f"Snell's law: a turned slab of {n:g} in {medium:g}"
        yield aimed_case(
            name,
            "Snell's law",
            "a slab turned anyhow moves a ray aside and keeps its direction, or reflects it",
            scene(user(SLAB, 2.1, n, rotate=[30.0, 40.0, 50.0]), medium=medium, numerics=_FEW),
            down_on(generator(name), 120, 0.8),
        )


def _reversed() -> Iterator[Case]:
    """Rays that were traced through a lens are sent back; the picture lies where they came from."""
    for surface in ("sphere", "torus", "heart", "bifolia", "biconvex"):
        name = f"reversed: {surface}"
        forward = scene_from_toml(scene(lens(surface, **PLACED), numerics=_FEW))
        source = np.array([0.5, -0.25, 4.0])
        through = generator(name).uniform(-0.9, 0.9, (250, 3))
        paths = trace_rays(forward, np.broadcast_to(source, through.shape), through - source)
        back = paths.origin + 2.0 * paths.direction  # beyond the lens they turn round
        kept = paths.events > 0
        yield aimed_case(
            name,
            "reversibility",
            "light goes back the way it came: every ray must return to the point (0.5, -0.25) of its source's plane",
            scene(
                lens(surface, **PLACED),
                picture={"corner": [-3.5, 3.75, 4.0], "right": [8.0, 0.0, 0.0], "down": [0.0, -8.0, 0.0]},
                numerics={"max_events": 13},
            ),
            (back[kept], -paths.direction[kept]),
        )


def _bundles() -> Iterator[Case]:
    """Rays with neighbours at 1e-5: what their distances become is judged ray by ray."""
    for family, why in (
        (
            "etendue",
            "five neighbours a ray, a hundred-thousandth away: a bundle's volume hangs on their differences",
        ),
        (
            "Malus and Dupin",
            "three neighbours a ray, from one point: a wave's surface hangs on their differences",
        ),
        ("Fermat", "three neighbours a ray: optical paths are compared by their differences"),
    ):
        for surface in ("ellipsoid", "torus"):
            name = f"{family}: {surface}"
            random = generator(name)
            origins, ahead = down_on(random, 25, 0.8)
            count = 5 if family == "etendue" else 3
            beside = 1e-5 * random.normal(size=(count, 25, 3))
            aside = 1e-5 * random.normal(size=(count, 25, 3)) if family == "etendue" else 0.0 * beside
            parts = [(origins + o, ahead + d) for o, d in zip(aside, beside, strict=True)]
            yield aimed_case(
                name, family, why, scene(lens(surface, **PLACED), numerics=_FEW), joined((origins, ahead), *parts)
            )


def _symmetries() -> Iterator[Case]:
    why = "a scene that is mirrored or turned by a right angle has the same map, mirrored or turned"
    for surface in ("sphere", "torus", "biconvex"):
        table = lens(surface, centre=[0.25, -0.125, 0.5])
        plain = f"symmetry: {surface}"
        origins, ahead = down_on(generator(plain), 100, 0.8)
        yield aimed_case(plain, "symmetry", why, scene(table, numerics=_FEW), (origins, ahead))
        mirror = np.array([-1.0, 1.0, 1.0])
        picture = {"corner": [4.0, 4.0, -3.0], "right": [-8.0, 0.0, 0.0], "down": [0.0, -8.0, 0.0]}
        yield aimed_case(
            f"{plain}, mirrored", "symmetry", why,
            scene(lens(surface, centre=[-0.25, -0.125, 0.5]), picture=picture, numerics=_FEW),
            (origins * mirror, ahead * mirror), equals=plain,
        )  # fmt: skip
        turned: Array = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        picture = {"corner": [-4.0, -4.0, -3.0], "right": [0.0, 8.0, 0.0], "down": [8.0, 0.0, 0.0]}
        yield aimed_case(
            f"{plain}, turned", "symmetry", why,
            scene(lens(surface, centre=[0.125, 0.25, 0.5]), picture=picture, numerics=_FEW),
            (origins @ turned.T, ahead @ turned.T),
        )  # fmt: skip


def _exact_lenses() -> Iterator[Case]:
    n = 1.5

    def ending_at(solid: str, z: float) -> str:
        """Cut a solid off at a height, and hollow a ball about (0, 0, z): rays leave the glass straight towards it."""
        return f"max(max({solid}, {z!r} - z), 0.01 - x^2 - y^2 - (z - {z!r})^2)"

    def at_height(z: float) -> Table:
        return {"corner": [-0.5, 0.5, z], "right": [1.0, 0.0, 0.0], "down": [0.0, -1.0, 0.0]}

    def disc(name: str, radius: float) -> Array:
        random = generator(name)
        turn, out = random.uniform(0, 2 * np.pi, 80), radius * np.sqrt(random.random(80))
        return np.column_stack([out * np.cos(turn), out * np.sin(turn), np.full(80, 3.0)])

    name, focus = "exact lens: an ellipsoid's focus", -1.0 / n
    wide = 1.0 - 1.0 / n**2  # semi-axes 1 along z, the root of this across: an eccentricity of 1 / n
    yield aimed_case(
        name,
        "exact lens",
        "an ellipsoid of eccentricity 1 / n brings parallel light to its far focus",
        scene(
            user(ending_at(f"(x^2 + y^2)/{wide!r} + z^2 - 1", focus), 1.1, n), picture=at_height(focus), numerics=_FEW
        ),
        rays(disc(name, 0.6), [0.0, 0.0, -1.0]),
    )
    name = "exact lens: an aplanatic ball"
    above = disc(name, 1.5)
    yield aimed_case(
        name,
        "exact lens",
        "light towards a point n radii off the centre of a ball meets 1 / n radii off it",
        scene(user(ending_at("x^2 + y^2 + z^2 - 1", -1.0 / n), 1.1, n), picture=at_height(-1.0 / n), numerics=_FEW),
        rays(above, np.array([0.0, 0.0, -n]) - above),
    )
    name = "exact lens: a Cartesian oval"
    # n |P - A| + |P - B| = c, A inside at the origin and B outside at z = 2.5: all light of A reaches B
    far, c = 2.5, 3.2
    oval = f"{n!r}*sqrt(x^2 + y^2 + z^2) + sqrt(x^2 + y^2 + (z - {far!r})^2) - {c!r}"
    ahead = unit(np.column_stack([generator(name).uniform(-0.3, 0.3, (80, 2)), np.ones(80)]))
    yield aimed_case(
        name,
        "exact lens",
        "a Cartesian oval images one point to another, exactly",
        scene(user(oval, 1.6, n), picture=at_height(far), numerics=_FEW),
        rays(0.25 * ahead, ahead),
    )
    name = "exact lens: a hollow shell"
    shell: Table = user("max(x^2 + y^2 + z^2 - 1, 0.81 - x^2 - y^2 - z^2)", 1.1, 1.333)
    yield aimed_case(
        name,
        "exact lens",
        "a hollow shell of the medium's own index changes nothing",
        scene(shell, medium=1.333, numerics=_FEW),
        down_on(generator(name), 80, 0.8),
    )


def _effects() -> Iterator[Case]:
    glass = lens("torus", **PLACED, absorption=[0.3, 1.2, 2.5])
    plain = "effects: none"
    some = down_on(generator(plain), 80, 0.9)
    for name, effects in (
        (plain, {"absorption": False}),
        ("effects: all that observe", {"absorption": True, "fresnel": True, "path_length": True}),
        ("effects: polarised", {"absorption": False, "fresnel": "polarised"}),
    ):
        yield aimed_case(
            name,
            "effects",
            "effects that only observe leave every place as it is, bit for bit",
            scene(glass, effects=effects, numerics=_FEW),
            some,
            equals="" if name == plain else plain,
        )
    name = "effects: a stop"
    ring = user("max(abs(z) - 0.05, max(x^2 + y^2 - 1, 0.16 - x^2 - y^2))", 1.1, centre=[0.0, 0.0, 1.5], absorbs=True)
    yield aimed_case(
        name,
        "effects",
        "an opaque ring before a lens blocks what meets it, and bends nothing",
        scene({**ring, "name": "stop"}, lens("sphere", name="ball"), numerics=_FEW),
        down_on(generator(name), 80, 1.2),
    )
