"""Noisy paths: F that is a small difference of large numbers, before, behind and between lenses that are not.

`(x + k)^2 - k^2 - 2 k x` is `x^2`, exactly; as it is computed it is off by k^2 roundings, and so is the place where a
ray is bent.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hard_cases.aims import aimed_case, down_on, generator, rays
from hard_cases.scenes import Table, lens, scene, user
from lenscl.hardcases import Case

_FAMILY, _EDITION = "noisy path", 2
_RAYS = 30
_NUMERICS = {"max_events": 16}


def cases() -> Iterator[Case]:
    """Yield them."""
    yield from _alone()
    yield from _among_others()
    yield from _far_foci()


def _noisy(k: float, z: float = 0.0, **more: object) -> Table:
    formula = f"(x + {k:.0f})^2 - {k:.0f}^2 - {2 * k:.0f}*x + y^2 + z^2 - 0.25"
    return user(formula, 0.6, centre=[0.0, 0.0, z], **more)


def _ball(z: float, r: float = 0.8, **more: object) -> Table:
    return lens("sphere", r=r, centre=[0.0, 0.0, z], **more)


def _alone() -> Iterator[Case]:
    for k in (1e3, 1e4, 1e5, 1e6):
        name = f"noisy: a ball by numbers of {k:g} squared"
        yield aimed_case(
            name,
            _FAMILY,
            "F cancels: it is known to k^2 roundings, and that is how far the surface may be off",
            scene(_noisy(k), numerics=_NUMERICS),
            down_on(generator("noisy: a ball"), _RAYS, 0.45, slant=0.1),
            edition=_EDITION,
        )


def _among_others() -> Iterator[Case]:
    for title, lenses in (
        ("first of two", [_noisy(1e4, 1.0), _ball(-1.5)]),
        ("last of two", [_ball(1.5), _noisy(1e4, -0.5)]),
        ("first of two, very noisy", [_noisy(1e5, 1.0), _ball(-1.5)]),
        ("in the middle of three", [_ball(2.0, 0.7), _noisy(1e3, 0.5), _ball(-1.5)]),
        ("in the middle of three, noisier", [_ball(2.0, 0.7), _noisy(1e4, 0.5), lens("torus", centre=[0, 0, -1.0])]),
        ("first and third of four", [_noisy(1e3, 2.5), _ball(1.0, 0.6), _noisy(1e4, -0.5), _ball(-2.0, 0.6)]),
        ("before a thin lens", [_noisy(1e4, 1.0), lens("biconvex", centre=[0.0, 0.0, -0.5])]),
    ):
        tables = [{**table, "name": f"number{number}"} for number, table in enumerate(lenses, 1)]
        yield aimed_case(
            f"noisy: {title}",
            _FAMILY,
            "what one surface is off by is carried through all that come after it",
            scene(*tables, numerics=_NUMERICS),
            down_on(generator(f"noisy: {title}"), _RAYS, 0.3, slant=0.05),
            edition=_EDITION,
        )


def _far_foci() -> Iterator[Case]:
    """Parallel light is gathered by one ball and again by a small one, far from the origin."""
    for away in (1e3, 1e5):
        at = np.full(3, away)
        name = f"noisy: foci {away:g} from the origin"
        random = generator("noisy: foci")
        turn, out = random.uniform(0.0, 2.0 * np.pi, _RAYS), 0.1 * np.sqrt(random.random(_RAYS))
        starts = np.column_stack([out * np.cos(turn), out * np.sin(turn), np.full(_RAYS, 3.0)])
        picture = {
            "corner": (at + np.array([-0.005, 0.005, -1.6])).tolist(),
            "right": [0.01, 0.0, 0.0],
            "down": [0.0, -0.01, 0.0],
        }
        yield aimed_case(
            name,
            _FAMILY,
            "at a focus moves of the start do nothing, and rounding of the points between does",
            scene(
                lens("sphere", r=1.0, centre=at.tolist(), name="large"),
                lens("sphere", r=0.02, centre=(at - np.array([0.0, 0.0, 1.53])).tolist(), name="small"),
                picture=picture,
                numerics=_NUMERICS,
            ),
            rays(starts + at, [0.0, 0.0, -1.0]),
            edition=_EDITION,
        )
