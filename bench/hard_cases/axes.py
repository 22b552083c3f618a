"""Axes, diagonals and outer functions: F is 0/0, infinitely steep or flat there as written, and the solid is smooth.

Answers are proved on another F of the same solid.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from hard_cases.aims import Rays, aimed_case, down_on, from_afar, generator, joined, rays, unit
from hard_cases.scenes import Table, lens, scene, user
from lenscl.hardcases import Case

_FAMILY, _EDITION = "axis", 2
_NUMERICS = {"max_events": 8}
_RAYS = 24
_EXPONENTS = (
    *((e, e) for e in (0.5, 1.0, 1.5, 1.9, 2.0)),
    *((2.0, 1.0), (1.0, 2.0), (0.5, 1.5), (1.5, 0.5), (0.6, 1.2)),
)
# Rays along -x, -y and -z all meet this picture, whose normal is (1, 0.6, 0.8); no diagonal runs along it
_OBLIQUE = {"corner": [-7.0, 0.5, 0.875], "right": [6.0, -10.0, 0.0], "down": [4.0, 4.0, -8.0]}
_QUARTIC = "x^4 + y^4 + z^4 - 0.5"
_ELLIPSOID = "x^2 + 2*y^2 + 1.5*z^2 - 0.5"
_OF_BOTH = ("F^3", "the cube root of F", "tanh(5 F)", "exp(F) - 1")  # what users write most


def cases() -> Iterator[Case]:
    """Yield them."""
    yield from _superellipsoids()
    yield from _distances()
    yield from _outer_functions()
    yield from _films()


def _case(name: str, why: str, tables: tuple[Table, Table], some: Rays | None, **more: Any) -> Case:
    """Return the case of a lens, proved on another of the same solid."""
    own, twin = (scene(table, numerics=_NUMERICS, **{"picture": _OBLIQUE, **more}) for table in tables)
    proved_as = "" if own == twin else twin
    if some is None:
        return Case(name=name, family=_FAMILY, why=why, scene=own, proved_as=proved_as, edition=_EDITION)
    return aimed_case(name, _FAMILY, why, own, some, proved_as=proved_as, edition=_EDITION)


def _barr(e1: float, e2: float) -> Table:
    """Return a superellipsoid as Barr writes it, whose slopes are known wherever the solid has any."""

    def power(base: str, exponent: float) -> str:
        if exponent == 1.0:
            return base
        return f"({base})^{exponent:.0f}" if exponent.is_integer() else f"pow({base}, {exponent!r})"

    def side(name: str, e: float) -> str:
        whole = (2.0 / e).is_integer() and (2.0 / e) % 2 == 0
        return power(name if whole else f"abs({name})", 2.0 / e)

    around = f"{side('x', e2)} + {side('y', e2)}"
    # The outline of |u|^p + |z|^p <= 1 is that of u + |z| <= 1 for p = 1, and u <= 1 - |z| has a slope wherever u has
    return user(f"{power(around, e2 / e1)} + {side('z', e1)} - 1", 1.001)


def _superellipsoids() -> Iterator[Case]:
    for e1, e2 in _EXPONENTS:
        name = f"axis: a superellipsoid of {e1:g}, {e2:g}"
        random = generator(name)
        diagonal = unit(np.array([[1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, 1.0, 0.0]]))
        inside = random.uniform(-0.2, 0.2, (6, 1)) * [0.0, 0.0, 1.0]
        crossing = from_afar(inside, random.normal(size=(6, 3)), 3.0)  # meets the axis inside
        in_plane = rays(
            np.repeat(random.uniform(0.2, 0.5, (4, 1)), 3, axis=1) * [1.0, 1.0, 0.0] + [0.0, 0.0, 3.0],
            unit(np.column_stack([[0.02, -0.05, 0.08, 0.0]] * 2 + [[-1.0] * 4])),
        )  # in the plane x = y
        yield _case(
            name,
            "rays along the axes and the diagonals |x| = |y|, and across an axis inside",
            (lens("superellipsoid", e1=e1, e2=e2), _barr(e1, e2)),
            joined(
                rays(3.0 * np.eye(3), -np.eye(3)),
                rays(3.0 * diagonal + [0.0, 0.0, 0.1], -diagonal),
                crossing,
                in_plane,
                down_on(random, 8, 0.8, slant=0.1),
            ),
        )


def _distances() -> Iterator[Case]:
    torus = user("(x^2 + y^2 + z^2 + 0.2975)^2 - 1.44*(x^2 + y^2)", 1.0)  # R = 0.6, r = 0.25
    for title, table, twin in (
        ("a torus by hypot", user("hypot(hypot(x, y) - 0.6, z) - 0.25", 1.0), torus),
        ("a torus by roots", user("sqrt((sqrt(x^2 + y^2) - 0.6)^2 + z^2) - 0.25", 1.0), torus),
        ("a ball by hypot", user("hypot(hypot(x, y), z) - 0.7", 1.0), user("x^2 + y^2 + z^2 - 0.7*0.7", 1.0)),
        ("a ball by a root", user("sqrt(x^2 + y^2 + z^2) - 0.7", 1.0), user("x^2 + y^2 + z^2 - 0.7*0.7", 1.0)),
        (
            "a cylinder by hypot",
            user("max(hypot(x, y) - 0.5, abs(z) - 0.4)", 1.0),
            user("max(x^2 + y^2 - 0.25, abs(z) - 0.4)", 1.0),
        ),
        (
            "a shell by the root of a square",
            user("sqrt((x^2 + y^2 + z^2 - 0.5)^2) - 0.1", 1.0),
            user("abs(x^2 + y^2 + z^2 - 0.5) - 0.1", 1.0),
        ),
        (
            "an octahedron by roots of squares",
            user("sqrt(x^2) + sqrt(y^2) + sqrt(z^2) - 0.9", 1.1),
            user("abs(x) + abs(y) + abs(z) - 0.9", 1.1),
        ),
        (
            "a double cone",
            user("sqrt(x^2 + y^2) + abs(z) - 0.8", 1.1),
            user("sqrt(x^2 + y^2) + abs(z) - 0.8", 1.1),
        ),
        (
            "a cone by hypot",
            user("max(hypot(x, y) + 0.5*z - 0.4, -0.6 - z)", 1.1),
            user("max(sqrt(x^2 + y^2) + 0.5*z - 0.4, -0.6 - z)", 1.1),
        ),
    ):
        name = f"axis: {title}"
        random = generator(name)
        heights = np.column_stack([np.zeros((6, 2)), random.uniform(-0.3, 0.3, 6)])
        beside = np.column_stack([10.0 ** -np.arange(3.0, 13.0, 3.0), np.zeros(4), np.full(4, 3.0)])
        yield _case(
            name,
            "rays along the axis, beside it and across it, where distances have no slope",
            (table, twin),
            joined(
                rays([[0.0, 0.0, 3.0], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0]], -np.eye(3)[[2, 0, 1]]),
                rays(beside, [0.0, 0.0, -1.0]),
                from_afar(heights, random.normal(size=(6, 3)), 3.0),
                down_on(random, 11, 0.8),
            ),
        )


def _outer_functions() -> Iterator[Case]:
    for title, outer in (
        ("F^3", "({F})^3"),
        ("the cube root of F", "cbrt({F})"),
        ("tanh(5 F)", "tanh(5*({F}))"),
        ("exp(F) - 1", "exp({F}) - 1"),
        ("log(1 + F)", "log(1 + ({F}))"),
        ("a root of F + c", "sqrt({F} + 0.5625) - 0.75"),
        ("F^5 of tanh", "tanh({F})^5"),
        ("1 - exp(-F)", "1 - exp(-({F}))"),
        ("the cube root of F^3", "cbrt(({F})^3)"),
        ("F times abs(F)", "({F})*abs({F})"),
    ):
        for kind, inner in (("a rounded cube", _QUARTIC), ("an ellipsoid", _ELLIPSOID)):
            if kind == "an ellipsoid" and title not in _OF_BOTH:
                continue
            formula = outer.replace("{F}", inner)
            name = f"axis: {title}, {kind}"
            random = generator(name)
            yield _case(
                name,
                "an outer function that rises changes no sign: F within decides",
                (user(formula, 1.1), user(inner, 1.1)),
                joined(
                    rays(3.0 * np.eye(3), -np.eye(3)),
                    down_on(random, 15, 0.8),
                ),
            )


def _films() -> Iterator[Case]:
    source, corner = {"at": [0.0, 0.0, 6.0]}, {"corner": [-0.5, 0.5, 3.0], "right": [1.0, 0, 0], "down": [0, -1.0, 0]}
    for title, own, twin, columns, rows in (
        ("superellipsoid of 0.5", lens("superellipsoid", e1=0.5, e2=0.5), _barr(0.5, 0.5), 7, 7),
        ("superellipsoid of 1", lens("superellipsoid", e1=1.0, e2=1.0), _barr(1.0, 1.0), 7, 7),
        ("superellipsoid of 1.5", lens("superellipsoid", e1=1.5, e2=1.5), _barr(1.5, 1.5), 8, 8),
        ("superellipsoid of 2, 1", lens("superellipsoid", e1=2.0, e2=1.0), _barr(2.0, 1.0), 8, 8),
        (
            "ball by a root",
            user("sqrt(x^2 + y^2 + z^2) - 0.7", 1.0),
            user("x^2 + y^2 + z^2 - 0.7*0.7", 1.0),
            9,
            5,
        ),
    ):
        yield _case(
            f"axis: a film of {columns} x {rows} before a {title}",
            "pixels on the axis and on the diagonals of the film",
            (own, twin),
            None,
            source=source,
            film={**corner, "size": [columns, rows]},
            picture=None,
        )
