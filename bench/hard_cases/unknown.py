"""Operands that nothing is known of: without a value, infinite or with poles on a part of the box or of the way.

F itself has a value wherever a ray is judged; what has none is the bound on one operand over a long stretch, or the
operand itself beyond the solid. Each operation meets such an operand as its first and as its second.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from hard_cases.aims import Rays, aimed_case, down_on, from_afar, generator, joined, rays, unit
from hard_cases.scenes import scene, user
from lenscl.expr import evaluate, parse
from lenscl.expr.graph import walk
from lenscl.hardcases import Case

_FAMILY, _EDITION = "unknown operand", 2
_FEW = {"max_events": 8}
_RAYS = 30
_LONGEST, _LOOKS = 60.0, 6001  # of a ray's parameter: beyond the bounds, and how often F is looked at before

_BALL = "x^2 + y^2 + z^2 - 0.1"
_RING = "sqrt((sqrt(x^2 + y^2) - 0.7)^2 + z^2) - 0.1"  # its roots' arguments seem to dip below 0 on long segments
_BIG = "x^2 + y^2 + z^2 - 0.7"

# Title, F with the known operand first, the other way round, half the box, why
_PAIRS = (
    ("min: ball and ring", f"min({_BALL}, {_RING})", f"min({_RING}, {_BALL})", 1.1, "a root's bound in min"),
    ("max: half a ring", f"max(x - 0.1, {_RING})", f"max({_RING}, x - 0.1)", 1.1, "a root's bound in max"),
    (
        "max: no solid",
        "max(x^2 + y^2 + z^2 - 1, sqrt(0.3 + cos(4.54*x)^2) - 0.10)",
        "max(sqrt(0.3 + cos(4.54*x)^2) - 0.10, x^2 + y^2 + z^2 - 1)",
        1.1,
        "F is 0.44 or more everywhere, so that no event is right",
    ),
    (
        "min: a ball beside a pole",
        "min(x^2 + y^2 + z^2 - 0.3, max(z^2 - 0.04 + 0.001/(x^2 + y^2), x^2 + y^2 + z^2 - 0.9))",
        "min(max(x^2 + y^2 + z^2 - 0.9, z^2 - 0.04 + 0.001/(x^2 + y^2)), x^2 + y^2 + z^2 - 0.3)",
        1.1,
        "one operand is infinite on the axis, and the other decides there",
    ),
    (
        "sum: a root that ends at 0",
        "x^2 + y^2 + z^2 - 0.7 + 0.2*sqrt(abs(x*y))",
        "0.2*sqrt(abs(x*y)) + x^2 + y^2 + z^2 - 0.7",
        1.1,
        "the root's argument is 0 on two planes",
    ),
    (
        "product: infinity times 0",
        "x^2 + y^2 + z^2 - 0.6 + 0.3*z*exp(-1/(x^2 + y^2))",
        "exp(-1/(x^2 + y^2))*z*0.3 + x^2 + y^2 + z^2 - 0.6",
        1.1,
        "an exponent is -infinity on the axis, and its function 0",
    ),
    (
        "quotient: by a root",
        "(x^2 + y^2 + z^2 - 0.6)/(0.1 + sqrt(x^2 + y^2)) + 0.05",
        "0.05 - (0.6 - x^2 - y^2 - z^2)/(sqrt(x^2 + y^2) + 0.1)",
        1.1,
        "the divisor is a root whose bound is not known on long segments",
    ),
    (
        "tanh: of a quotient",
        "tanh(2 - 1/(x^2 + y^2 + z^2))",
        "-tanh(1/(x^2 + y^2 + z^2) - 2)",
        1.1,
        "the argument is infinite at the centre",
    ),
    (
        "log: of a root",
        "log(sqrt(x^2 + y^2) + z^2 + 0.2)",
        "-log(1/(z^2 + 0.2 + sqrt(x^2 + y^2)))",
        1.1,
        "the logarithm's argument holds a root",
    ),
    (
        "pow: that is not whole",
        "pow(x^2 + y^2, 0.75) + z^2 - 0.5",
        "z^2 - 0.5 + pow(x^2 + y^2, 0.75)",
        1.1,
        "a power whose base may seem negative",
    ),
    (
        "abs: of a ring's distance",
        "abs(sqrt((sqrt(x^2 + y^2) - 0.6)^2 + z^2) - 0.3) - 0.06",
        "max(sqrt((sqrt(x^2 + y^2) - 0.6)^2 + z^2) - 0.36, 0.24 - sqrt((sqrt(x^2 + y^2) - 0.6)^2 + z^2))",
        1.1,
        "a shell: abs of what nothing is known of may have any sign",
    ),
    (
        "max: a domain that ends beyond the solid",
        f"max({_BIG}, 0.3 - sqrt(2 - x^2 - y^2 - z^2))",
        f"max(0.3 - sqrt(2 - x^2 - y^2 - z^2), {_BIG})",
        1.1,
        "one operand has no value in the corners of the box, where the other is positive",
    ),
    (
        "min: a domain that ends beyond the solid",
        f"min({_BIG}, sqrt(2 - x^2 - y^2 - z^2) + 0.1)",
        f"min(sqrt(2 - x^2 - y^2 - z^2) + 0.1, {_BIG})",
        1.1,
        "one operand has no value in the corners of the box, and decides nothing where it has one",
    ),
    (
        "max: a logarithm of little",
        "max(x^2 + y^2 + z^2 - 0.8, 2 + log(0.02 + abs(x*y)))",
        "max(log(abs(x*y) + 0.02) + 2, x^2 + y^2 + z^2 - 0.8)",
        1.1,
        "a logarithm that is deep near two planes",
    ),
    (
        "max: overflow",
        f"max({_BIG}, exp(2000*(x - 0.3)) - 1)",
        f"max(exp(2000*(x - 0.3)) - 1, {_BIG})",
        1.1,
        "one operand is beyond any number in a half of the box",
    ),
)
# The same solids, where the oracle cannot follow F itself
_TWINS = {
    "min: a ball beside a pole": "min(x^2 + y^2 + z^2 - 0.3, "
    "max((z^2 - 0.04)*(x^2 + y^2) + 0.001, x^2 + y^2 + z^2 - 0.9))",
    "tanh: of a quotient": "x^2 + y^2 + z^2 - 0.5",
    "log: of a root": "sqrt(x^2 + y^2) + z^2 - 0.8",
    "max: a domain that ends beyond the solid": _BIG,
    "min: a domain that ends beyond the solid": _BIG,
    "max: overflow": f"max({_BIG}, x - 0.3)",
}


def cases() -> Iterator[Case]:
    """Yield them."""
    for title, first, second, half, why in _PAIRS:
        for formula, order in ((first, ""), (second, ", the other way round")):
            name = f"unknown: {title}{order}"
            some = down_on(generator(f"unknown: {title}"), _RAYS, 0.9, height=2.0)
            twin = _TWINS.get(title)
            yield aimed_case(
                name, _FAMILY, why, scene(user(formula, half), numerics=_FEW), some, edition=_EDITION,
                proved_as="" if twin is None else scene(user(twin, half), numerics=_FEW),
                lacks_values=_lacking(formula, half, some),
            )  # fmt: skip
    yield from _far()
    yield from _deep()
    yield from _gaps()


def _far() -> Iterator[Case]:
    """Long segments: a small solid in a large box."""
    for order, formula in (("ball first", f"min({_BALL}, {_RING})"), ("ring first", f"min({_RING}, {_BALL})")):
        name = f"unknown: a box of 40, {order}"
        random = generator("unknown: a box of 40")
        through = random.uniform(-0.75, 0.75, (_RAYS, 3)) * [1.0, 1.0, 0.15]
        yield aimed_case(
            name,
            _FAMILY,
            "bounds are known on no segment that is as long as the box",
            scene(user(formula, 20.0), numerics=_FEW),
            from_afar(through, random.normal(size=(_RAYS, 3)), 45.0),
            edition=_EDITION,
        )


def _deep() -> Iterator[Case]:
    """A branch of max that is -infinity on the axis, and another that decides there."""
    base, top = "max(-z, x^2 + y^2 - 1)", "z - 0.75"
    trumpet = "z - 0.3 + 0.03*log(x^2 + y^2)"
    twin = "max(max(max(-z, x^2 + y^2 - 1), x^2 + y^2 - exp((0.3 - z)/0.03)), z - 0.75)"
    for order, formula in (
        ("second", f"max(max({base}, {trumpet}), {top})"),
        ("first", f"max({trumpet}, max({top}, {base}))"),
        ("of four", f"max(-z, {trumpet}, x^2 + y^2 - 1, {top})"),
    ):
        name = f"unknown: max with -infinity, {order}"
        random = generator("unknown: max with -infinity")
        at = np.zeros((14, 3))
        at[:, 2] = 2.0
        at[2:, :2] = 10.0 ** -np.arange(1.0, 13.0)[:, None] * unit(random.normal(size=(12, 2)))
        down = np.tile([0.0, 0.0, -1.0], (14, 1))
        down[1] = [0.0, 0.0, -2.0]
        through = np.column_stack([np.zeros((8, 2)), random.uniform(0.1, 0.6, 8)])
        aslant = from_afar(through, random.normal(size=(8, 3)), 3.0)  # cross the axis, nearly
        yield aimed_case(
            name,
            _FAMILY,
            "one branch of max is -infinity on the axis, where another decides",
            scene(user(formula, 1.1), numerics=_FEW),
            joined((at, down), aslant, down_on(random, 10, 0.9, height=2.0)),
            edition=_EDITION,
            proved_as=scene(user(twin, 1.1), numerics=_FEW),
        )


def _gaps() -> Iterator[Case]:
    """F ends, or jumps through a pole, on the way: rays that come there cannot be told."""
    for title, formula, some, why in (
        ("a wall without values", "sqrt(x + 0.5) + y^2 + z^2 - 0.9", _across_x(-0.1), "F ends within the solid"),
        (
            "a wall of a logarithm",
            "y^2 + z^2 - 0.6 - 0.1*log(x + 0.5)",
            _across_x(0.2),
            "F grows beyond bounds, and ends within the box",
        ),
        (
            "a domain that ends beside the solid",
            "abs(sqrt(x + 0.2) - 0.5) + y^2 + z^2 - 0.3",
            _across_x(0.1),
            "F ends within the box, not far from the solid",
        ),
        (
            "a power's domain",
            "y^2 + z^2 + pow(x + 0.4, 1.5) - 0.5",
            _across_x(0.1),
            "F ends within the solid, where its last term is 0",
        ),
        ("a pole, second", "max(x^2 + y^2 + z^2 - 1, 1/x - 2)", _across_x(0.7), "F jumps from -infinity to infinity"),
        ("a pole, first", "max(1/x - 2, x^2 + y^2 + z^2 - 1)", _across_x(0.7), "F jumps from -infinity to infinity"),
        (
            "a tangent's pole",
            "max(tan(2*x) - 1, x^2 + y^2 + z^2 - 0.9)",
            _across_x(-0.2),
            "F jumps from infinity to -infinity",
        ),
    ):
        name = f"unknown: {title}"
        table = user(formula, 1.1, 1.1)
        if title == "a wall of a logarithm":
            table["bounds"] = [[-1.1, -1.1, -1.1], [0.9, 1.1, 1.1]]
            table["surface"] = f"max({formula}, x - 0.7)"
        yield aimed_case(
            name, _FAMILY, why, scene(table, numerics=_FEW), some, edition=_EDITION, has_gaps=True
        )  # fmt: skip


def _across_x(at: float) -> Rays:
    """Return rays along the planes x = constant near a place, which stay there, and rays along x, which do not."""
    random = generator(f"across {at}")
    turn = random.uniform(0.0, 2.0 * np.pi, 16)
    through = np.column_stack([at + random.uniform(-0.1, 0.1, 16), random.uniform(-0.4, 0.4, (16, 2))])
    stays = from_afar(through, np.column_stack([random.uniform(-0.02, 0.02, 16), np.cos(turn), np.sin(turn)]), 3.0)
    ends = rays(
        np.column_stack([np.full(8, 3.0), random.uniform(-0.4, 0.4, (8, 2))]),
        np.column_stack([-np.ones(8), random.uniform(-0.03, 0.03, (8, 2))]),
    )
    return joined(stays, ends)


def _lacking(formula: str, half: float, some: Rays) -> NDArray[np.bool_] | None:
    """Return the rays on which an operand of F has no finite value somewhere within the box; None where there is none.

    Of what is nested in F every part is looked at: whether F itself has a value there is a matter of how it is taken.
    """
    t = np.linspace(0.0, _LONGEST, _LOOKS)[:, None] / np.linalg.norm(some[1], axis=1)
    x, y, z = (some[0][:, axis] + t * some[1][:, axis] for axis in range(3))
    with np.errstate(all="ignore"):
        values = [evaluate(part, {"x": x, "y": y, "z": z}) for part in walk([parse(formula, "xyz")])]
    within = np.maximum(np.maximum(abs(x), abs(y)), abs(z)) <= half
    found: NDArray[np.bool_] = sum((~np.isfinite(value) & within).any(axis=0) for value in values) > 0
    return found if found.any() else None
