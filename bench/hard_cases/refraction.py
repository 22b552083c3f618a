"""Refraction: equal indices, bubbles, the critical angle, normal and grazing incidence, weak and strong glass."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hard_cases.aims import TINY, Rays, aimed_case, both_signs, down_on, from_afar, generator, joined, rays, unit
from hard_cases.scenes import PLACED, SLAB, lens, scene, user
from lenscl.hardcases import Array, Case

_FINE = 10.0 ** -np.arange(3.0, 13.0)  # 1e-3 ... 1e-12
_FINEST = 10.0 ** -np.arange(3.0, 15.0)  # 1e-3 ... 1e-14


def cases() -> Iterator[Case]:
    """Yield them."""
    yield from _null_lenses()
    yield from _bubbles()
    yield from _critical_angles()
    yield from _normal_incidence()
    yield from _grazing_incidence()
    yield from _indices()


def _null_lenses() -> Iterator[Case]:
    for surface in ("sphere", "torus", "heart", "bifolia", "prism", "biconvex"):
        name = f"null lens: {surface}"
        yield aimed_case(
            name,
            "null lens",
            "the lens has the medium's own index, so light must go on as if there were none",
            scene(lens(surface, 1.333, **PLACED), medium=1.333),
            down_on(generator(name), 120, 1.0),
        )


def _bubbles() -> Iterator[Case]:
    for surface, medium in (("sphere", 1.5), ("torus", 1.5), ("heart", 1.333), ("biconvex", 2.417)):
        name = f"air bubble: {surface} in {medium:g}"
        yield aimed_case(
            name,
            "air bubble",
            "light enters a lower index: slanting rays are totally reflected off the outside",
            scene(lens(surface, 1.0, **PLACED), medium=medium),
            down_on(generator(name), 150, 1.0),
        )


def _critical_angles() -> Iterator[Case]:
    """At sin(i) = (1 + d) / n, for d of 1e-3 ... 1e-14 on either side: both for rays that leave and that enter."""
    beside = 1.0 + both_signs(_FINEST)[both_signs(_FINEST) != 0]
    for n in (1.001, 1.333, 1.5, 2.417):
        name = f"critical angle: leaving a ball of {n:g}"
        heights = beside / n
        yield aimed_case(
            name,
            "critical angle",
            "light leaves a ball within 1e-3 to 1e-14 of the critical angle, on either side",
            scene(lens("sphere", n), numerics={"max_events": 6}),
            joined(*(_around(heights, turn, start=0.0) for turn in (0.0, 0.7, 2.5))),
        )
    for n in (1.333, 1.5, 2.417):
        yield aimed_case(
            f"critical angle: entering a bubble in {n:g}",
            "critical angle",
            "light meets a bubble within 1e-3 to 1e-14 of the critical angle, on either side",
            scene(lens("sphere", 1.0), medium=n, numerics={"max_events": 6}),
            joined(*(_around(beside / n, turn, start=-3.0) for turn in (0.0, 0.7, 2.5))),
        )
    for n in (1.1, 1.7):
        sines = beside / n
        slants = np.column_stack([sines, 0.0 * sines, -np.sqrt((1.0 - sines) * (1.0 + sines))])
        yield aimed_case(
            f"critical angle: the flat face of a slab of {n:g}",
            "critical angle",
            "light in a slab meets its flat face within 1e-3 to 1e-14 of the critical angle, on either side",
            scene(user(SLAB, 2.1, n), numerics={"max_events": 3}),
            rays([0.0, 0.1, 0.125], slants),
        )


def _around(heights: Array, turn: float, start: float) -> Rays:
    """Return slanting rays at heights over the centre, from so far before it, in a plane that is turned about z."""
    along = unit([np.cos(turn), np.sin(turn), -0.7])
    aside = unit(np.cross(along, [0.2, 0.1, 1.0]))
    return rays(start * along + heights[:, None] * aside, along)


def _normal_incidence() -> Iterator[Case]:
    name = "normal incidence: a ball"
    radial = unit(generator(name).normal(size=(100, 3)))
    radial = np.concatenate([radial, np.eye(3), -np.eye(3)])
    yield aimed_case(
        name,
        "normal incidence",
        "rays through the centre meet the surface with no tangential part, which has no direction then",
        scene(lens("sphere")),
        joined(from_afar(0.0 * radial, radial, 3.0), rays([0.0, 0.0, 0.0], radial)),
    )
    name = "normal incidence: a slab"
    random = generator(name)
    yield aimed_case(
        name,
        "normal incidence",
        "rays straight down through two flat faces must not move at all",
        scene(user(SLAB, 2.1)),
        rays(np.column_stack([random.uniform(-1.3, 1.3, (60, 2)), np.full(60, 2.0)]), [0.0, 0.0, -1.0]),
    )
    name = "normal incidence: nearly"
    random = generator(name)
    tilt = np.repeat(TINY, 10)[:, None] * unit(random.normal(size=(110, 3)))
    yield aimed_case(
        name,
        "normal incidence",
        "rays tilted by 1e-2 to 1e-12 against the normal of a face",
        scene(user(SLAB, 2.1)),
        rays([0.0, 0.0, 2.0], np.array([0.0, 0.0, -1.0]) + tilt),
    )


def _grazing_incidence() -> Iterator[Case]:
    for n, medium in ((1.5, 1.0), (1.0, 1.5), (2.417, 1.0)):
        yield aimed_case(
            f"grazing incidence: a ball of {n:g} in {medium:g}",
            "grazing incidence",
            "rays meet a ball 1e-3 to 1e-12 of its radius below its rim",
            scene(lens("sphere", n), medium=medium),
            joined(*(_around(1.0 - _FINE, turn, start=-3.0) for turn in (0.0, 0.4, 1.1, 2.5, 4.0))),
        )
    fine = np.repeat(_FINE[:5], 6)  # rays with finer ones would start on the face, and rounding decide on which side
    slants = np.column_stack([np.ones_like(fine), np.tile(np.linspace(-0.2, 0.3, 6), 5), -fine])
    heights = np.column_stack([-fine, 0.0 * fine, fine * fine]) + np.array([0.0, 0.0, 0.25])
    yield aimed_case(
        "grazing incidence: a slab",
        "grazing incidence",
        "rays meet a flat face at 1e-3 to 1e-7 radians",
        scene(user(SLAB, 2.1)),
        rays(heights, slants),
    )


def _indices() -> Iterator[Case]:
    weak = (1.0 + 1e-12, 1.0 + 1e-9, 1.0 + 1e-6, 1.001)
    for n in (*weak, 0.5, 0.8, 2.417, 4.0, 10.0, 100.0, 1000.0):
        name = f"index of {n:.13g}: a ball"
        yield aimed_case(
            name,
            "index",
            "from glass that hardly bends light to glass in which all rays go straight to the centre",
            scene(lens("sphere", n, **PLACED), numerics={"max_events": 8}),
            down_on(generator(name), 100, 0.8),
        )
    for n in (1.0 + 1e-12, 1.0 + 1e-6, 10.0, 1000.0):
        name = f"index of {n:.13g}: a torus"
        yield aimed_case(
            name,
            "index",
            "the same for a shape that light can meet again",
            scene(lens("torus", n, **PLACED), numerics={"max_events": 8}),
            down_on(generator(name), 100, 0.9),
        )
