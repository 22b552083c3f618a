"""Solids that lie in one another, touch, overlap, or stand apart by little: by priority, and with contact as cement."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from random_arrangements import drawn

from hard_cases.aims import Rays, aimed_case, down_on, from_afar, generator
from hard_cases.scenes import Table, lens, scene, user
from lenscl.hardcases import Case
from lenscl.tracing.start import locate_sets

_FAMILY, _EDITION = "arrangements", 3
_RAYS = 16
_WHY = {
    "one in another": "each solid lies in the one before, or reaches out of it",
    "overlap": "solids overlap in part: the one of highest priority is the medium",
    "concentric": "one solid in several sizes about one centre",
    "the same twice": "two solids share all of their surface",
    "the same in other words": "two solids share their surface, and each says it in another way",
    "stacked slabs": "faces coincide over all of an area or a part of it; rays run along faces and through edges",
    "bricks": "boxes share corners, edges, parts of faces, or volume",
    "halves": "a solid is cut by planes, and its parts are cemented",
    "doublet": "two or three lenses are cemented at faces of common curvature",
    "lens on a window": "the flat face of a lens lies on a window, whose edges it does not reach",
    "kissing": "balls touch at a point, from outside and from within",
    "flush": "a coin is let into a slab: one of its faces lies in the slab's",
    "filled glass": "wall and ground of a liquid are those of the glass around it",
    "filled shell": "a ball fills a hollow",
    "prism cube": "two prisms are cemented to a cube",
    "nearly touching": "a gap, or an overlap, of 1e-3 to 1e-11 of a scene unit",
}
_LOOSE = ("one in another", "overlap", "concentric")  # where no faces are meant to coincide
# Rays through an edge of one solid, where either face leads on alike: they may be undecided, and no move shows why
_THROUGH_EDGES = {("concentric", 0): 6, ("lens on a window", 0): 4}
_FORMS = dict.fromkeys(_WHY, 3) | {"overlap": 4, "halves": 4, "bricks": 4}


def cases() -> Iterator[Case]:
    """Yield them."""
    for name, why in _WHY.items():
        for number in range(_FORMS[name]):
            one = drawn(3000 + number, number, _RAYS, name)
            _, on = locate_sets(one.scene, one.origins)
            clear = np.flatnonzero(on == 0)  # what starts within rounding of a surface counts as starting on it
            clear = np.delete(clear, [_THROUGH_EDGES[name, number]] if (name, number) in _THROUGH_EDGES else [])
            case = f"arrangements: {name}, {number + 1}"
            yield _case(case, why, one.text, (one.origins[clear], one.directions[clear]), keeps=name not in _LOOSE)
    yield from _of_prescriptions()
    yield from _gaps()


def _case(name: str, why: str, text: str, some: Rays, *, keeps: bool = True) -> Case:
    return aimed_case(name, _FAMILY, why, text, some, edition=_EDITION, keeps_contact=keeps)


def _singlet(n: float, c1: float, c2: float, thickness: float, diameter: float, z: float, name: str) -> Table:
    sizes = {"c1": c1, "c2": c2, "thickness": thickness, "diameter": diameter}
    return lens("conic_singlet", n, **sizes, centre=[0.0, 0.0, z], name=name)


def _of_prescriptions() -> Iterator[Case]:
    crown = _singlet(1.5168, 0.0159362549800797, -0.0218770509735288, 4.0, 25.4, 2.0, "crown")
    flint = _singlet(1.6727, -0.0218770509735288, -0.0077984870935039, 2.5, 25.4, 5.25, "flint")
    for which, distance in (("", 30.0), (" from afar", 1e5)):
        name = f"arrangements: doublet of a prescription{which}"
        random = generator(name)
        through = np.column_stack([random.uniform(-9.0, 9.0, (_RAYS, 2)), np.full(_RAYS, 4.0)])
        ahead = np.column_stack([random.uniform(-0.05, 0.05, (_RAYS, 2)), np.ones(_RAYS)])
        why = "a cemented doublet: one event at the common face"
        yield _case(name, why, scene(crown, flint, scale=10.0), from_afar(through, ahead, distance))
    name = "arrangements: no total reflection in cement"
    dense = _singlet(1.7, 0.0, -0.125, 8.0, 15.0, 4.0, "dense")
    thin = _singlet(1.5, -0.125, 0.0, 3.0, 15.0, 9.5, "thin")
    heights = np.linspace(-7.0, 7.0, _RAYS)
    through = np.column_stack([heights, 0.1 * heights, np.zeros(_RAYS)])
    why = "with air between, rays were reflected totally from 4.8 on"
    yield _case(name, why, scene(dense, thin, scale=10.0), from_afar(through, np.array([[0.0, 0.0, 1.0]] * _RAYS), 5.0))
    name = "arrangements: bubble"
    ball, bubble = lens("sphere", r=0.5, name="ball"), lens("sphere", 1.0, r=0.4, name="bubble")
    yield _case(
        name, "a ball of air in a ball of glass", scene(ball, bubble), down_on(generator(name), _RAYS, 0.5), keeps=False
    )


def _gaps() -> Iterator[Case]:
    slab = "max(abs(z) - 0.25, x^2 + y^2 - 1)"
    for gap in (1e-12, -1e-12, 1e-11, 1e-9):
        name = f"arrangements: slabs {gap:g} apart"
        upper, lower = (user(slab, 1.2, centre=[0.0, 0.0, z]) for z in (0.25 + gap, -0.25))
        text = scene(upper | {"name": "upper"}, lower | {"name": "lower"})
        yield _case(name, "a gap of a trillionth of a lens is a gap", text, down_on(generator(name), _RAYS, 0.5))
