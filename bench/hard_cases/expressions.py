"""Expressions as users write them: without a solid, without a derivative, without a value, or no expression at all."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from hard_cases.aims import Rays, aimed_case, down_on, generator, rays
from hard_cases.scenes import lens, scene, user
from lenscl.expr import evaluate, parse
from lenscl.hardcases import Case

_FEW = {"max_events": 8}
_RAYS = 80
_LONGEST, _LOOKS = 10.0, 4001  # of a ray's parameter: beyond the bounds, and how often F is looked at before

_FINE = (
    ("constant sign", "x^2 + y^2 + z^2 + 1", 1.1, "F is positive everywhere: there is no solid, and no event"),
    ("disconnected parts", "min((x - 0.5)^2 + y^2 + z^2 - 0.1, (x + 0.5)^2 + y^2 + z^2 - 0.1)", 1.1, "two balls"),
    ("edges", "abs(x) + abs(y) + abs(z) - 0.9", 1.1, "an octahedron: F has no derivative on its edges"),
    (
        "square root of 0",
        "sqrt(x^2 + y^2) + abs(z) - 0.8",
        1.1,
        "a double cone: no slope on its axis",
    ),
    ("a quotient by 0", "z^2 + 0.2*(x^2 + y^2) - 0.1 + 0.001/(x^2 + y^2)", 1.1, "F has a pole on the axis"),
    ("no value inside", "max(sqrt(x + 0.5) - 1, x^2 + y^2 + z^2 - 0.7)", 1.1, "F has no value for x below -0.5"),
    ("overflow", "exp(400*(x^2 + y^2 + z^2)) - exp(200)", 1.3, "F grows beyond the largest number within the bounds"),
    ("a square", "(x^2 + y^2 + z^2 - 0.7)^2", 1.1, "F never changes sign, and its gradient vanishes where it is 0"),
    ("huge slopes", "tanh(1e4*(x^2 + y^2 + z^2 - 0.7))", 1.1, "F goes from -1 to 1 within a ten-thousandth"),
    ("waves", "x^2 + y^2 + z^2 - 0.6 + 0.02*sin(40*x)*sin(40*y)*sin(40*z)", 1.1, "a ball with fine waves on it"),
    ("powers", "pow(abs(x), 2.5) + pow(abs(y), 1.5) + z^2 - 0.6", 1.1, "powers that are not whole"),
    ("high degree", "x^8 + y^8 + z^8 - 0.5", 1.1, "a rounded cube of degree 8"),
    ("a logarithm", "log(x^2 + y^2 + z^2 + 0.5) + 0.3*x", 1.2, "F is steepest where it is least"),
    ("a tangent", "tan(0.9*x)^2 + y^2 + z^2 - 0.6", 1.1, "F has poles outside its bounds"),
    ("a distance", "hypot(hypot(x, y) - 0.6, z) - 0.25", 1.0, "a torus by distances: no slope where they are 0"),
    ("a cube root", "x^2 + y^2 + z^2 - 0.6 + 0.2*cbrt(x*y*z + 0.05)", 1.2, "F is infinitely steep on a curved sheet"),
    ("a quotient", "x^2 + y^2 + z^2 - 0.5/(1 + 4*x^2)", 1.1, "F's slope is a quotient"),
    (
        "a star",
        "max(sqrt(x^2 + y^2) - 0.6 - 0.15*cos(5*atan2(y, x)), abs(z) - 0.3)",
        1.1,
        "its angle jumps by a full turn at a cut, and F does not",
    ),
    (
        "a cut",
        "max(atan2(z, y) + 2.9, x^2 + y^2 + z^2 - 0.5)",
        1.0,
        "a wedge, one side of which is an angle's cut: F jumps there, and is never 0",
    ),
    ("slopes of 1e6", "max(x + 0.3*tanh(1e6*z), x^2 + y^2 + z^2 - 0.5)", 1.0, "a step that single cannot resolve"),
    ("slopes of 1e10", "max(x + 0.3*tanh(1e10*z), x^2 + y^2 + z^2 - 0.5)", 1.0, "a step as steep as a face"),
    ("tiny values", "1e-30*(x^2 + y^2 + z^2 - 0.7)", 1.1, "F itself is as good as 0 everywhere"),
    ("huge values", "1e30*(x^2 + y^2 + z^2 - 0.7)", 1.1, "F itself is huge everywhere"),
)

_REFUSED = (
    ("an import", "__import__('os').system('true')"),
    ("an attribute", "x.real + y"),
    ("an unknown function", "eval(x) + y"),
    ("a comparison", "x < y"),
    ("a tower of powers", "9**9**9**9 + x"),
    ("five thousand brackets", "(" * 5000 + "x" + ")" * 5000),
    ("nothing", ""),
    ("words", "a ball of glass"),
    ("a number", "1.5"),
)


def cases() -> Iterator[Case]:
    """Yield them."""
    for title, formula, half, why in _FINE:
        name = f"expression: {title}"
        some = down_on(generator(name), _RAYS, 0.9, height=2.0)
        text = scene(user(formula, half), numerics=_FEW)
        yield aimed_case(name, "expression", why, text, some, lacks_values=_too_large(formula, half, some))
    name = "expression: 500 terms"
    random = generator(name)
    terms = [f"{0.001 * float(random.uniform(-1, 1))!r}*{'xyz'[i % 3]}^{2 + i % 7}*{'yzx'[i % 3]}" for i in range(500)]
    some = down_on(random, 12, 0.9, height=2.0)
    text = scene(user("x^2 + y^2 + z^2 - 0.7 + " + " + ".join(terms), 1.2), numerics=_FEW)
    yield aimed_case(name, "expression", "a sum of 500 terms", text, some)
    apex = "max(sqrt(x^2 + y^2) + z - 0.7, -z - 0.7)"
    turn = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    beside = np.concatenate([[0.0], np.repeat([1e-9, 1e-6, 1e-3], 4)])
    yield aimed_case(
        "expression: straight at a tip",
        "expression",
        "rays come straight down on a cone's tip, which has no normal, and beside it",
        scene(user(apex, 1.5), numerics=_FEW),
        rays(
            np.stack([np.append(0.0, np.cos(turn)) * beside, np.append(0.0, np.sin(turn)) * beside, beside * 0 + 3], 1),
            [0.0, 0.0, -1.0],
        ),
    )
    yield from _refused()


def _too_large(formula: str, half: float, some: Rays) -> NDArray[np.bool_] | None:
    """Return the rays on which F is beyond the doubles somewhere within a cube about the origin; None where none is."""
    t = np.linspace(0.0, _LONGEST, _LOOKS)[:, None]
    x, y, z = (some[0][:, axis] + t * some[1][:, axis] for axis in range(3))
    with np.errstate(all="ignore"):
        value = evaluate(parse(formula, "xyz"), {"x": x, "y": y, "z": z})
    within = np.maximum(np.maximum(abs(x), abs(y)), abs(z)) <= half
    found: NDArray[np.bool_] = (np.isinf(value) & within).any(axis=0)
    return found if found.any() else None


def _refused() -> Iterator[Case]:
    for title, formula in _REFUSED:
        yield Case(
            name=f"refused: {title}",
            family="refused",
            why="no expression of x, y and z, so it is refused and nothing of it is carried out",
            scene=scene(user(formula, 1.1)),
            refused="lens.surface",
        )
    for title, table, key in (
        ("no bounds", lens("x^2 + y^2 - 0.5"), "lens.bounds"),
        ("a solid that reaches out of its bounds", user("x^2 + y^2 - 0.5", 1.1), "lens.bounds"),
        ("a negative radius", lens("sphere", r=-1.0), "lens.r"),
        ("an index of 0", lens("sphere", 0.0), "lens.n"),
        ("a stretch of 0", lens("sphere", stretch=[1.0, 0.0, 1.0]), "lens.stretch"),
    ):
        yield Case(
            name=f"refused: {title}",
            family="refused",
            why="a lens that cannot be, so it is refused by its key",
            scene=scene(table),
            refused=key,
        )
    flat = {"corner": [0.0, 0.0, -3.0], "right": [1.0, 2.0, 0.0], "down": [2.0, 4.0, 0.0]}
    yield Case(
        name="refused: parallel spans",
        family="refused",
        why="spans along one line make no screen",
        scene=scene(lens("sphere"), picture=flat),
        refused="picture.down",
    )
