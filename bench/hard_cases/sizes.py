"""Sizes: squashed lenses, scenes in other units, scenes far from the origin, sources far away."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hard_cases.aims import aimed_case, down_on, from_afar, generator, rays, unit
from hard_cases.scenes import Table, lens, scene, user
from lenscl.hardcases import Case

_WHOLE = (-20, -10, -3, 3, 10, 20)


def cases() -> Iterator[Case]:
    """Yield them."""
    yield from _squashed()
    yield from _units()
    yield from _offsets()


def _squashed() -> Iterator[Case]:
    for surface in ("sphere", "torus", "heart"):
        for factor in (1e-3, 1e3):
            name = f"squash: {surface}, {factor:g} along z"
            random = generator(name)
            some = (
                down_on(random, 120, 0.8)
                if factor < 1
                else from_afar(random.uniform(-0.5, 0.5, (120, 3)) * [1, 1, 200], random.normal(size=(120, 3)), 3.0)
            )
            yield aimed_case(
                name,
                "squash",
                "a lens a thousand times as thin, or as long, as it is wide",
                scene(lens(surface, stretch=[1.0, 1.0, factor]), numerics={"max_events": 8}),
                some,
            )


def _units() -> Iterator[Case]:
    """One scene in other units: its lens by parameters where it has lengths, else stretched."""

    def placed(surface: str, k: float) -> Table:
        sizes = {"torus": {"R": 0.7 * k, "r": 0.25 * k}, "sphere": {"r": k}}
        size = sizes.get(surface, {"stretch": [k, k, k]})
        return lens(surface, rotate=[25.0, -40.0, 110.0], centre=[0.25 * k, -0.125 * k, 0.0625 * k], **size)

    for surface in ("sphere", "torus", "heart", "prism"):
        plain = f"units: {surface}"
        origins, ahead = down_on(generator(plain), 72, 0.9)
        why = "the same scene in other units: a power of two changes no digit of the map"
        yield aimed_case(plain, "units", why, scene(placed(surface, 1.0)), (origins, ahead))
        for power in _WHOLE:
            k = 2.0**power
            name = f"units: {surface}, 2^{power}"
            yield aimed_case(name, "units", why, scene(placed(surface, k), scale=k), (k * origins, ahead), equals=plain)
        why = "the same scene in other units, which round differently"
        for k in (1e-6, 1e-3, 1e3, 1e6):
            name = f"units: {surface}, {k:g}"
            yield aimed_case(name, "units", why, scene(placed(surface, k), scale=k), (k * origins, ahead))


def _offsets() -> Iterator[Case]:
    away = np.array([1e6, -2e6, 1.5e6])
    for surface in ("sphere", "torus", "heart"):
        name = f"offset: {surface}"
        origins, ahead = down_on(generator(name), 120, 0.9)
        picture = {
            "corner": (away + np.array([-4.0, 4.0, -3.0])).tolist(),
            "right": [8.0, 0.0, 0.0],
            "down": [0.0, -8.0, 0.0],
        }
        yield aimed_case(
            name,
            "offset",
            "the whole scene lies millions of units from the origin: coordinates cancel",
            scene(lens(surface, centre=away.tolist()), picture=picture, numerics={"max_events": 8}),
            (origins + away, ahead),
        )
    for surface in ("sphere", "torus", "biconvex"):
        name = f"far source: {surface}"
        random = generator(name)
        at = np.array([1e5, -3e5, 1e6])
        through = np.column_stack([random.uniform(-0.9, 0.9, (120, 2)), np.zeros(120)])
        yield aimed_case(
            name,
            "offset",
            "the source is a million units away: the ray is known to so much less beside the lens",
            scene(lens(surface), numerics={"max_events": 8}),
            rays(at, through - at),
        )
    name = "offset: inside the expression"
    formula = "(x - 1000)^2 + y^2 + z^2 - 1"
    ahead = unit(generator(name).normal(size=(80, 3)))
    yield aimed_case(
        name,
        "offset",
        "the user's expression itself is that of a ball far from its own origin",
        scene(
            user(formula, 1.1, centre=[-1000.0, 0.0, 0.0]) | {"bounds": [[998.9, -1.1, -1.1], [1001.1, 1.1, 1.1]]},
            numerics={"max_events": 8},
        ),
        from_afar(0.7 * unit(generator(name + " ").normal(size=(80, 3))), ahead, 4.0),
    )
