"""Roots: tangents, short chords, step grids, twin roots, and rays that start on, in or beside a surface."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hard_cases.aims import TINY, aimed_case, both_signs, down_on, from_afar, generator, joined, rays, tangents, unit
from hard_cases.scenes import GYROID, SLAB, Table, lens, scene, user
from lenscl.config import scene_from_toml
from lenscl.hardcases import Case

_ALL = (
    *("sphere", "ellipsoid", "torus", "heart", "bifolia", "barth_sextic", "superellipsoid", "biconvex", "plano_convex"),
    *("meniscus", "ball", "rod", "prism", "cone", "conic_singlet", "even_asphere_singlet"),
)


def cases() -> Iterator[Case]:
    """Yield them."""
    yield from _tangents()
    yield from _chords()
    yield from _grids()
    yield from _twins()
    yield from _starts()


def _tangents() -> Iterator[Case]:
    shapes: list[tuple[str, Table, int]] = [(name, lens(name), 8) for name in _ALL]
    shapes.append(("gyroid", user(GYROID, 1.1), 4))
    for name, table, points in shapes:
        text = scene(table, numerics={"max_events": 8})
        title = f"tangent: {name}"
        offsets = both_signs(TINY)[both_signs(TINY) != 0]
        yield aimed_case(
            title,
            "tangent",
            "rays pass points of the surface at 1e-2 to 1e-12, outside and inside: two roots meet",
            text,
            tangents(scene_from_toml(text).lenses[0], generator(title), points, offsets, 4.0),
        )


def _chords() -> Iterator[Case]:
    lengths = 10.0 ** -np.arange(1.0, 8.0)  # a shorter one lies less than a rounding below the rim
    for title, table, axes in (
        ("a ball", lens("sphere"), (1.0, 1.0, 1.0)),
        ("a flat ellipsoid", lens("ellipsoid", a=1.0, b=0.7, c=0.05), (1.0, 0.7, 0.05)),
    ):
        name = f"short chord: {title}"
        random = generator(name)
        # On the unit ball a chord of length c lies sqrt(1 - c^2 / 4) from the centre; stretched, it is as many parts
        normal = unit(random.normal(size=(10, 3)))
        along = unit(np.cross(normal, random.normal(size=(10, 3))))
        depth = np.sqrt((1.0 - 0.5 * lengths) * (1.0 + 0.5 * lengths))
        through = depth[:, None] * normal[:, None] * np.asarray(axes)
        yield aimed_case(
            name,
            "short chord",
            "chords of 1e-1 to 1e-7: the two roots of an entry and an exit",
            scene(table),
            from_afar(through, np.broadcast_to((along * np.asarray(axes))[:, None], through.shape), 3.0),
        )
    for thickness in (1e-3, 1e-6, 1e-9, 1e-12):
        name = f"short chord: a sheet {thickness:g} thick"
        yield aimed_case(
            name,
            "short chord",
            "a sheet between two planes, thinner than any step of a march",
            scene(user(SLAB, 2.1, stretch=[1.0, 1.0, 2.0 * thickness])),
            down_on(generator(name), 80, 1.2, height=2.0),
        )


def _grids() -> Iterator[Case]:
    for offset in (0.0, 0.005, 0.00314159):
        heights = 1.0 + 0.01 * np.arange(24.0) + offset
        yield aimed_case(
            f"step grid: {offset:g} beside",
            "step grid",
            "faces lie at whole steps of 0.01 from where the rays start, or between two of them",
            scene(user(SLAB, 2.1)),
            rays(np.column_stack([np.full(24, 0.3), np.full(24, 0.2), heights]), [0.0, 0.0, -1.0]),
        )


def _twins() -> Iterator[Case]:
    for gap in (1e-3, 1e-6, 1e-9, 1e-12):
        name = f"twin roots: {gap:g} apart"
        sheet = f"abs(abs(z) - {0.2 + gap / 2!r}) - 0.2"
        formula = f"max({sheet}, x^2 + y^2 - 1)"
        yield aimed_case(
            name,
            "twin roots",
            "two slabs with a gap between them: the exit of one and the entry of the next nearly coincide",
            scene(user(formula, 1.1)),
            down_on(generator(name), 80, 0.6, height=2.0),
        )
    name = "first root before a far second"
    formula = "min((x - 1)^2 + y^2 + z^2 - 1e-4, (x + 50)^2 + y^2 + z^2 - 100)"
    random = generator(name)
    through = np.array([1.0, 0.0, 0.0]) + 0.009 * unit(random.normal(size=(80, 3))) * random.random((80, 1))
    yield aimed_case(
        name,
        "twin roots",
        "a small ball stands before one a thousand times as large: the near pair of roots must not be lost",
        scene(user(formula, [61.0, 10.5, 10.5])),
        rays([3.0, 0.0, 0.0], through - np.array([3.0, 0.0, 0.0])),
    )
    name = "first root of many"
    formula = " + ".join(f"({x}^2 - 1)^2*({x}^2 + 0.1)" for x in "xyz") + " - 0.3"
    bundles = (((-2.84, 2.05, -2.2), (0.755, -0.245, 0.609)), ((1.51, 1.87, -1.74), (-0.644, -0.725, 0.242)))
    random = generator(name)
    yield aimed_case(
        name,
        "twin roots",
        "blobs in a row: iterating from the Bernstein coefficients finds the third root, and not the first",
        scene(user(formula, 2.0)),
        joined(*(rays(at + 0.01 * random.normal(size=(40, 3)), ahead) for at, ahead in bundles)),
    )


def _starts() -> Iterator[Case]:
    shapes = (
        ("sphere", lens("sphere"), 1.0),
        ("ellipsoid", lens("ellipsoid", a=1.0, b=0.5, c=0.25), 1.0),
        ("torus", lens("torus", R=0.75, r=0.25), 1.0),
        ("slab", user("max(abs(x) - 1, y^2 + z^2 - 4)", 2.1), 1.0),
    )
    for shape, table, at in shapes:
        random = generator(f"start: {shape}")
        ahead = unit(random.normal(size=(40, 3)))
        beside = (("on it", at), ("an ulp outside", np.nextafter(at, 2.0)), ("an ulp inside", np.nextafter(at, 0.0)))
        for place, x in beside:
            yield aimed_case(
                f"start: {shape}, {place}",
                "start",
                "rays start on the surface or a rounding beside it, and go in, out or along",
                scene(table, numerics={"max_events": 6}),
                rays([x, 0.0, 0.0], ahead),
                starts_exactly=True,
                counts_from=(at, 0.0, 0.0),
            )
    turn = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    along = np.column_stack([0.0 * turn, np.cos(turn), np.sin(turn)])
    for place, table, x in (
        ("sphere", lens("sphere"), 1.0),
        ("torus, outside", lens("torus", R=0.75, r=0.25), 1.0),
        ("torus, in its hole", lens("torus", R=0.75, r=0.25), 0.5),
        ("end of a rod", lens("rod", diameter=1.0, length=2.0, rotate=[0.0, 90.0, 0.0]), 1.0),
    ):
        yield aimed_case(
            f"start: along the {place}",
            "start",
            "rays start on the surface and exactly along it: they touch, enter at once, or stay on it",
            scene(table, numerics={"max_events": 6}),
            rays([x, 0.0, 0.0], along),
            starts_exactly=True,
        )
    for place, table, at in (
        ("tip of a cone", user("max(sqrt(x^2 + y^2) + z - 1, -z - 1)", 2.1), (0.0, 0.0, 1.0)),
        ("dimple of the heart", lens("heart"), (0.0, 0.0, 1.0)),
        ("pinch of the bifolia", lens("bifolia"), (0.0, 0.0, 0.0)),
    ):
        name = f"start: at the {place}"
        yield aimed_case(
            name,
            "start",
            "rays start where the surface has no normal, and so no side",
            scene(table, numerics={"max_events": 6}),
            rays(at, unit(generator(name).normal(size=(24, 3)))),
            starts_exactly=True,
        )
    inner = {
        "sphere": (0.2, 0.1, 0.3),
        "torus": (0.7, 0.05, 0.02),
        "heart": (0.1, 0.1, 0.2),
        "bifolia": (0.4, 0.3, 0.1),
    }
    for shape, inside in inner.items():
        name = f"start: inside the {shape}"
        yield aimed_case(
            name,
            "start",
            "the source lies inside a lens: the first event is an exit",
            scene(lens(shape), numerics={"max_events": 8}),
            rays(inside, unit(generator(name).normal(size=(100, 3)))),
        )
