"""Opaque lenses: what meets one ends there, on its surface, with the direction in which it came."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hard_cases.aims import TINY, aimed_case, down_on, from_afar, generator, joined, rays, tangents, unit
from hard_cases.scenes import PLACED, Table, lens, scene, user
from lenscl.config import scene_from_toml
from lenscl.hardcases import Case

_FAMILY, _EDITION = "opaque lens", 2
_RAYS = 24
_NUMERICS = {"max_events": 16}
_RING = "max(abs(z) - 0.05, max(x^2 + y^2 - 1, 0.16 - x^2 - y^2))"


def cases() -> Iterator[Case]:
    """Yield them."""
    yield from _hits()
    yield from _grazes()
    yield from _among_clear_lenses()
    yield from _inside()
    yield from _films()


def _dark(surface: str, n: float = 1.5, **more: object) -> Table:
    return lens(surface, n, absorbs=True, **more)


def _hits() -> Iterator[Case]:
    for surface in ("sphere", "torus", "heart", "cone"):
        for n, medium in ((1.5, 1.0), (1.0, 1.5)):
            name = f"opaque: {surface} of {n:g} in {medium:g}"
            yield aimed_case(
                name,
                _FAMILY,
                "an opaque lens ends what meets it, whatever its index says of refraction or total reflection",
                scene(_dark(surface, n, **PLACED), medium=medium, numerics=_NUMERICS),
                down_on(generator(f"opaque: {surface}"), _RAYS, 1.0),
                edition=_EDITION,
            )


def _grazes() -> Iterator[Case]:
    for surface in ("sphere", "torus"):
        for n in (1.5, 0.5):
            name = f"opaque: grazing a {surface} of {n:g}"
            clear = scene_from_toml(scene(lens(surface))).lenses[0]
            offsets = np.concatenate([TINY[::2], -TINY[::2]])
            yield aimed_case(
                name,
                _FAMILY,
                "rays pass 1e-2 to 1e-12 beside the surface, on either side: they are stopped or go on straight",
                scene(_dark(surface, n), numerics=_NUMERICS),
                tangents(clear, generator(name), 4, offsets, 3.0),
                edition=_EDITION,
            )


def _among_clear_lenses() -> Iterator[Case]:
    ball = lens("sphere", r=0.7, name="ball")
    for title, lenses in (
        ("a stop before a ball", [{**user(_RING, 1.1, centre=[0.0, 0.0, 1.5], absorbs=True), "name": "stop"}, ball]),
        ("a stop behind a ball", [ball, {**user(_RING, 1.1, centre=[0.0, 0.0, -1.2], absorbs=True), "name": "stop"}]),
        (
            "a needle between two lenses",
            [
                lens("biconvex", centre=[0.0, 0.0, 1.0], name="first"),
                _dark("sphere", 0.5, stretch=[0.02, 0.8, 0.02], rotate=[0.0, 0.0, 30.0], name="needle"),
                lens("biconvex", centre=[0.0, 0.0, -1.0], name="second"),
            ],
        ),
        (
            "dark rings beside a clear one",
            [
                _dark("torus", 1.0, centre=[0.0, 0.0, 1.0], name="above"),
                lens("torus", name="clear"),
                _dark("torus", 2.0, centre=[0.0, 0.0, -1.0], R=0.4, r=0.2, name="below"),
            ],
        ),
    ):
        name = f"opaque: {title}"
        yield aimed_case(
            name,
            _FAMILY,
            "some lenses bend light and others end it, which comes first decides",
            scene(*lenses, numerics=_NUMERICS),
            down_on(generator(name), _RAYS + 6, 0.8),
            edition=_EDITION,
        )


def _inside() -> Iterator[Case]:
    for n, medium in ((1.5, 1.0), (1.0, 1.5)):
        for surface, at in (("sphere", [0.1, -0.2, 0.3]), ("torus", [0.7, 0.05, 0.1])):
            name = f"opaque: from within a {surface} of {n:g} in {medium:g}"
            yield aimed_case(
                name,
                _FAMILY,
                "the source lies in the opaque lens: light ends where it would leave it",
                scene(_dark(surface, n), medium=medium, numerics=_NUMERICS),
                rays(at, unit(generator(name).normal(size=(_RAYS // 2, 3)))),
                edition=_EDITION,
            )
    name = "opaque: from within a clear ball"
    random = generator(name)
    yield aimed_case(
        name,
        _FAMILY,
        "light leaves clear glass and meets a dark shell of parts beyond",
        scene(
            lens("sphere", r=0.5, name="clear"),
            {**user("max(abs(z - 0.9) - 0.1, x^2 + y^2 - 1)", [1.1, 1.1, 1.1], 0.7, absorbs=True), "name": "lid"},
            numerics=_NUMERICS,
        ),
        joined(
            rays([0.1, 0.05, -0.1], unit(random.normal(size=(16, 3)))),
            from_afar(random.uniform(-0.3, 0.3, (8, 3)), unit(random.normal(size=(8, 3))), 3.0),
        ),
        edition=_EDITION,
    )


def _films() -> Iterator[Case]:
    for n in (1.5, 0.8):
        yield Case(
            name=f"opaque: a film before a torus of {n:g}",
            family=_FAMILY,
            why="film rays, which are called by other means than given ones",
            scene=scene(
                _dark("torus", n, name="dark"),
                lens("sphere", r=0.5, centre=[0.0, 0.0, -1.0], name="clear"),
                film={"corner": [-0.6, 0.6, 2.0], "right": [1.2, 0, 0], "down": [0, -1.2, 0], "size": [7, 7]},
                numerics=_NUMERICS,
            ),
            edition=_EDITION,
        )
