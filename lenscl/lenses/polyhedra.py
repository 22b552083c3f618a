"""The solids of flat faces: boxes, wedges, cut gems, and any that are given by their planes.

They are written as the `max` of functions linear in x, y and z, so `Surface.planes` finds their planes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from lenscl.expr import Expr, number, symbol
from lenscl.lenses.coats import largest
from lenscl.lenses.rows import length, read, spelled
from lenscl.lenses.solid import Box, Parameter, Problem, Surface, Values

Row = tuple[float, float, float, float]

FEWEST_PLANES = 4  # no bounded solid has less
OCTAHEDRON: tuple[Row, ...] = tuple((a, b, c, 1.0) for a in (-1.0, 1.0) for b in (-1.0, 1.0) for c in (-1.0, 1.0))
_LARGEST = 1e300
_DEGREE = "0.017453292519943295"  # radians


def plane_values(planes: Sequence[Row]) -> dict[str, float]:
    """Return the planes' numbers by the names of `polyhedron`'s parameters: a1, b1, c1, d1, a2, ..."""
    return {f"{name}{i}": value for i, row in enumerate(planes, 1) for name, value in zip("abcd", row, strict=True)}


def polyhedron(planes: Sequence[Row]) -> Surface:
    """Return the solid where a x + b y + c z <= d for every plane; its parameters are the planes' numbers.

    Surfaces of equally many planes have the same code. The numbers given become the parameters' defaults.
    """
    values = plane_values(planes)
    numbers = [[symbol(f"{name}{i}") for name in "abcd"] for i in range(1, len(planes) + 1)]
    return replace(
        _polyhedron(numbers),
        variant=str(len(planes)),
        parameters=tuple(
            Parameter(name=name, default=value, low=-_LARGEST, high=_LARGEST, meaning="of a plane")
            for name, value in values.items()
        ),
    )


def _polyhedron(planes: Sequence[Sequence[Expr]]) -> Surface:
    x, y, z = (symbol(axis) for axis in "xyz")
    expression = largest([a * x + b * y + c * z - d for a, b, c, d in planes])
    return Surface(
        name="polyhedron",
        given_as="planes",
        summary="a convex solid by its planes, a list of [a, b, c, d]; (a, b, c) points outward, of any length",
        formula="the largest of a*x + b*y + c*z - d",
        source="elementary",
        expression=expression,
        extent=PlanesBox(expression),
        rules=PlanesRules(expression),
        is_convex=True,
    )


def _box_box(values: Values) -> Box:
    a, b, c = (0.5 * values[name] for name in "abc")
    return (-a, -b, -c), (a, b, c)


def _wedge_box(values: Values) -> Box:
    x, y, half = 0.5 * values["width"], 0.5 * values["height"], 0.5 * values["thickness"]
    return (-x, -y, -half), (x, y, half + y * math.tan(math.radians(values["angle"])))


def _wedge_rules(values: Values) -> Iterator[Problem]:
    rise = 0.5 * values["height"] * math.tan(math.radians(values["angle"]))
    if rise > values["thickness"] * (1.0 + 2.0**-48):
        yield (
            "thickness",
            f"must be at least {spelled(rise, up=True)}, or the faces cross within the height, got "
            f"{values['thickness']!r}; raise it, or lower angle or height",
        )


def _wedge() -> Surface:
    sine, cosine = f"sin({_DEGREE}*angle)", f"cos({_DEGREE}*angle)"
    return Surface(
        name="wedge",
        summary="a rectangular plate whose back is tilted about x: it is thin towards +y",
        formula="max(-z - thickness/2, z - thickness/2 + y*tan(angle), abs(x) - width/2, abs(y) - height/2)",
        source="W. J. Smith, Modern Optical Engineering, 4th ed., ch. 7: thin prisms",
        parameters=(
            Parameter(name="angle", default=10.0, low=0.0, high=80.0, meaning="between the faces, degrees"),
            length("thickness", 0.3, "in the middle"),
            length("width", 1.2, "along x"),
            length("height", 1.2, "along y"),
        ),
        expression=read(
            f"max(max(-z - 0.5*thickness, {cosine}*(z - 0.5*thickness) + {sine}*y),"
            " max(abs(x) - 0.5*width, abs(y) - 0.5*height))",
            "angle",
            "thickness",
            "width",
            "height",
        ),
        extent=_wedge_box,
        rules=_wedge_rules,
        plane_names=("front", "back", "+x", "-x", "+y", "-y"),
        is_convex=True,
    )


# The round brilliant: the table, 8 bezels, 8 stars, 16 upper and 16 lower girdle facets, 8 pavilion mains, and 16
# planes of the girdle. Corners of the girdle lie at multiples of 22.5 degrees: in the middle of a bezel (M), and half
# way between two (H).
_HALF, _QUARTER = math.pi / 8, math.pi / 16  # radians: from M to H, from M to the middle of a girdle plane
_COS_HALF, _COS_QUARTER = repr(math.cos(_HALF)), repr(math.cos(_QUARTER))
_BRILLIANT = {
    "R": "0.5*diameter",
    "h": "0.005*girdle*diameter",  # half of the girdle
    "t": "0.005*table*diameter",  # from the axis to a corner of the table, at M
    "e": f"0.005*table*diameter*{_COS_HALF}",  # to the middle of its edge, at H
}


def _brilliant_faces() -> Iterator[tuple[str, str]]:
    """Yield the functions whose largest is F, each behind its kind.

    rho stands for the distance from the axis along a face's normal.
    """
    R, h, t, e = (f"({text})" for text in _BRILLIANT.values())
    star = f"({e} + 0.01*star*({R} - {e}))"  # the lower corner of a star, at H
    lower = f"({R} - 0.01*lower*{R})"  # the lower corner of the lower girdle facets, at H
    sin_a, cos_a = f"sin({_DEGREE}*crown_angle)", f"cos({_DEGREE}*crown_angle)"
    sin_b, cos_b = f"sin({_DEGREE}*pavilion_angle)", f"cos({_DEGREE}*pavilion_angle)"
    yield "table", f"z - {h} - ({R} - {t})*{sin_a}/{cos_a}"
    for i in range(8):
        main, half = 2 * i * _HALF, (2 * i + 1) * _HALF
        yield "bezels", f"{sin_a}*({_rho(main)} - {R}) + {cos_a}*(z - {h})"
        yield "mains", f"{sin_b}*({_rho(main)} - {R}) - {cos_b}*(z + {h})"
        steep, flat = f"({star}*{_COS_HALF} - {t})", f"({star} - {e})"
        yield "stars", f"{steep}*{sin_a}*({_rho(half)} - {e}) + {flat}*({cos_a}*(z - {h}) - {sin_a}*({R} - {t}))"
    for i in range(16):
        rho, rim = _rho((2 * i + 1) * _QUARTER), f"{R}*{_COS_QUARTER}"
        yield "girdle", f"{rho} - {rim}"
        for kind, corner, side, sine, cosine in (
            ("upper", star, "(z - {h})", sin_a, cos_a),
            ("lower", lower, "(-z - {h})", sin_b, cos_b),
        ):
            steep, flat = f"({R} - {corner}*{_COS_HALF})", f"{_COS_QUARTER}*({R} - {corner})"
            yield kind, f"{steep}*{sine}*({rho} - {rim}) + {flat}*{cosine}*{side.format(h=h)}"


def _rho(azimuth: float) -> str:
    parts = (f"{value!r}*{axis}" for axis, value in (("x", _cosine(azimuth)), ("y", _cosine(azimuth - math.pi / 2))))
    return f"({' + '.join(parts)})"


def _cosine(angle: float) -> float:
    """Return a cosine, exact where it is 0."""
    value = math.cos(angle)
    return 0.0 if abs(value) < 1e-12 else value


def _brilliant_box(values: Values) -> Box:
    R, t, h = (values["diameter"] * part for part in (0.5, 0.005 * values["table"], 0.005 * values["girdle"]))
    top = h + (R - t) * math.tan(math.radians(values["crown_angle"]))
    return (-R, -R, -h - R * math.tan(math.radians(values["pavilion_angle"]))), (R, R, top)


def _brilliant_rules(values: Values) -> Iterator[Problem]:
    """Yield what is wrong where a star's lower corner would not lie below the table."""
    t, c = 0.01 * values["table"], math.cos(_HALF)
    least = 100.0 * t * (1.0 - c * c) / (c * (1.0 - t * c))
    if values["star"] <= least:
        yield (
            "star",
            f"must be more than {spelled(least, up=True)} for this table, or the stars would rise from it, got "
            f"{values['star']!r}; raise it, or lower table",
        )


def _brilliant() -> Surface:
    def share(name: str, default: float, low: float, high: float, meaning: str) -> Parameter:
        return Parameter(name=name, default=default, low=low, high=high, meaning=meaning)

    parameters = (
        length("diameter", 1.4, "of the girdle, from corner to corner"),
        share("table", 57.0, 10.0, 90.0, "its width between corners, % of the diameter"),
        share("crown_angle", 34.5, 5.0, 60.0, "of the bezels to the girdle's plane, degrees"),
        share("pavilion_angle", 40.75, 5.0, 60.0, "of the pavilion mains, degrees"),
        share("girdle", 3.0, 0.1, 30.0, "its height, % of the diameter"),
        share("star", 50.0, 5.0, 95.0, "length of a star from table to girdle, seen from above, %"),
        share("lower", 77.0, 5.0, 95.0, "length of the lower girdle facets from girdle to culet, %"),
    )
    names = [parameter.name for parameter in parameters]
    return Surface(
        name="brilliant",
        summary="the round brilliant cut of 73 flat faces, its table towards +z and the girdle's middle at the origin",
        formula="the largest of 73 planes: table, 8 bezels, 8 stars, 32 girdle facets, 16 of the girdle, 8 mains",
        source="M. Tolkowsky, Diamond Design, 1919; proportions as gem laboratories print them",
        parameters=parameters,
        expression=largest([read(face, *names) for _, face in _brilliant_faces()]),
        plane_names=tuple(kind for kind, _ in _brilliant_faces()),
        extent=_brilliant_box,
        rules=_brilliant_rules,
        is_convex=True,
    )


def flat_rows() -> tuple[Surface, ...]:
    """Return the rows, in the catalogue's order."""
    return (
        Surface(
            name="box",
            summary="a cuboid; its sides are along x, y and z",
            formula="max(abs(x) - a/2, abs(y) - b/2, abs(z) - c/2)",
            source="elementary",
            parameters=(
                length("a", 1.0, "side along x, from face to face"),
                length("b", 1.0, "side along y"),
                length("c", 1.0, "side along z"),
            ),
            expression=read("max(abs(x) - 0.5*a, abs(y) - 0.5*b, abs(z) - 0.5*c)", "a", "b", "c"),
            extent=_box_box,
            plane_names=("+x", "-x", "+y", "-y", "+z", "-z"),
            is_convex=True,
        ),
        _wedge(),
        _polyhedron([[number(value) for value in row] for row in OCTAHEDRON]),
        _brilliant(),
    )


@dataclass(frozen=True, slots=True)
class PlanesBox:
    """The tight box of a solid of planes."""

    expression: Expr

    def __call__(self, values: Values) -> Box:
        """Return the lowest and the highest corner."""
        return _solid(self.expression, values)[1]


@dataclass(frozen=True, slots=True)
class PlanesRules:
    """What keeps planes that are given as a list from enclosing a solid."""

    expression: Expr

    def __call__(self, values: Values) -> Iterator[Problem]:
        """Yield (key, what is wrong)."""
        wrong, _ = _solid(self.expression, values)
        if wrong:
            yield "planes", wrong


def _solid(expression: Expr, values: Values) -> tuple[str, Box]:
    from lenscl.expr.planar import planes_of
    from lenscl.lenses.planes import solid_of  # numpy, which reading the catalogue need not wait for

    return solid_of(planes_of(expression), tuple(sorted(values.items())))
