"""The solids that optics knows by name: singlets, balls, rods, prisms and cones, as faces joined by `max`.

The optical axis is z. What is called front lies towards lesser z and is met first by light along +z; the origin is the
middle of the thickness. Shapes with a name of their own take radii as stock lists print them, without a sign; the
singlets take signed curvatures, as lens design programs do, so that a flat face is 0 and bending a lens passes it.

The faces of a solid are scaled alike, to slopes of about `diameter`: the nearer they are to each other's size, the
sooner bounds on a segment of a ray tell which of them is meant. That is worth a factor of 2 to 7 in time where
curvatures are weak.
"""

from __future__ import annotations

import math

from lenscl.lenses.forms import (
    BACK,
    BACKWARD,
    CONIC_SAG,
    CONICS,
    FRONT,
    RIM,
    SPHERE_SAG,
    conic,
    named_faces,
    rim,
    round_lens,
    sphere,
)
from lenscl.lenses.rows import length, read, signed
from lenscl.lenses.singlets import Face, SingletBox, SingletRules
from lenscl.lenses.solid import Box, Parameter, Surface, Values

_HALF_APEX = "(apex*0.008726646259971648)"  # radians: pi / 360 a degree


def _even(vertex: str, letter: str) -> str:
    """Write w less the even terms, which leaves the conic's own."""
    return f"({vertex} - (x^2 + y^2)^2*({letter}4 + (x^2 + y^2)*({letter}6 + (x^2 + y^2)*{letter}8)))"


def _biconvex(values: Values) -> tuple[Face, Face]:
    return Face(c=1.0 / values["R1"], keys="R1"), Face(c=-1.0 / values["R2"], keys="R2")


def _plano_convex(values: Values) -> tuple[Face, Face]:
    return Face(c=1.0 / values["R"], keys="R"), Face(c=0.0)


def _meniscus(values: Values) -> tuple[Face, Face]:
    return Face(c=1.0 / values["R1"], keys="R1"), Face(c=1.0 / values["R2"], keys="R2")


def _conics(values: Values) -> tuple[Face, Face]:
    return (
        Face(c=values["c1"], k=values["k1"], keys="c1 and k1"),
        Face(c=values["c2"], k=values["k2"], keys="c2 and k2"),
    )


def _even_aspheres(values: Values) -> tuple[Face, Face]:
    a, b = ((values[f"{letter}4"], values[f"{letter}6"], values[f"{letter}8"]) for letter in "AB")
    return (
        Face(c=values["c1"], k=values["k1"], even=a, keys="c1 and k1"),
        Face(c=values["c2"], k=values["k2"], even=b, keys="c2 and k2"),
    )


def _ball_box(values: Values) -> Box:
    r = 0.5 * values["diameter"]
    return (-r, -r, -r), (r, r, r)


def _rod_box(values: Values) -> Box:
    r, half = 0.5 * values["diameter"], 0.5 * values["length"]
    return (-r, -r, -half), (r, r, half)


def _prism_box(values: Values) -> Box:
    angle, side, x = math.radians(0.5 * values["apex"]), values["side"], 0.5 * values["length"]
    third, z = side * math.cos(angle) / 3.0, side * math.sin(angle)
    return (-x, -third, -z), (x, 2.0 * third, z)


def _cone_box(values: Values) -> Box:
    r, half = 0.5 * values["diameter"], 0.5 * values["height"]
    return (-r, -r, -half), (r, r, half)


_EVEN = tuple(
    signed(f"{letter}{power}", 0.0, f"of r^{power} in the {face}'s sag")
    for letter, face in (("A", "front"), ("B", "back"))
    for power in (4, 6, 8)
)
_CONIC_NAMES = tuple(parameter.name for parameter in CONICS)
_EVEN_NAMES = tuple(parameter.name for parameter in _EVEN)


def optical_rows() -> tuple[Surface, ...]:
    """Return the rows, in the catalogue's order."""
    return (
        Surface(
            name="biconvex",
            summary="a lens of two spheres that bulge outward",
            formula="max(sag(R1) - z - thickness/2, z - thickness/2 + sag(R2), hypot(x, y) - diameter/2); "
            + SPHERE_SAG,
            source="E. Hecht, Optics, sec. 5.2; both radii positive",
            parameters=(
                length("R1", 1.5, "radius of the front"),
                length("R2", 1.5, "radius of the back"),
                *rim(1.4, 0.5),
            ),
            **round_lens(sphere("R1", FRONT), sphere("R2", BACKWARD), "R1", "R2", "thickness", "diameter"),
            extent=SingletBox(_biconvex),
            rules=SingletRules(_biconvex),
            is_convex=True,
        ),
        Surface(
            name="plano_convex",
            summary="a lens of a sphere that bulges towards -z, and a plane",
            formula="max(sag(R) - z - thickness/2, z - thickness/2, hypot(x, y) - diameter/2); " + SPHERE_SAG,
            source="E. Hecht, Optics, sec. 5.2",
            parameters=(length("R", 1.0, "radius of the front"), *rim(1.4, 0.45)),
            **round_lens(sphere("R", FRONT), f"2*{BACK}", "R", "thickness", "diameter"),
            extent=SingletBox(_plano_convex),
            rules=SingletRules(_plano_convex),
            is_convex=True,
        ),
        Surface(
            name="meniscus",
            summary="a lens of two spheres that both bulge towards -z; it gathers light if R1 < R2",
            formula="max(sag(R1) - z - thickness/2, z - thickness/2 - sag(R2), hypot(x, y) - diameter/2); "
            + SPHERE_SAG,
            source="E. Hecht, Optics, sec. 5.2; both radii positive",
            parameters=(
                length("R1", 0.9, "radius of the front, which is convex"),
                length("R2", 1.8, "radius of the back, which is hollow"),
                *rim(1.4, 0.4),
            ),
            **round_lens(sphere("R1", FRONT), f"-{sphere('R2', BACK)}", "R1", "R2", "thickness", "diameter"),
            extent=SingletBox(_meniscus),
            rules=SingletRules(_meniscus),
        ),
        Surface(
            name="ball",
            summary="a ball lens: the sphere, by its diameter",
            formula="x^2 + y^2 + z^2 - diameter^2/4",
            source="elementary",
            parameters=(length("diameter", 1.4, "of the ball"),),
            expression=read("x^2 + y^2 + z^2 - (0.5*diameter)^2", "diameter"),
            extent=_ball_box,
            is_convex=True,
        ),
        Surface(
            name="rod",
            summary="a cylinder along z with flat ends",
            formula="max(hypot(x, y) - diameter/2, abs(z) - length/2)",
            source="elementary",
            parameters=(length("diameter", 0.8, "of the cylinder"), length("length", 1.4, "from end to end")),
            expression=read(f"max({RIM}, diameter*(abs(z) - 0.5*length))", "diameter", "length"),
            faces=named_faces({"front": "-z - 0.5*length", "back": "z - 0.5*length", "rim": RIM}, "diameter", "length"),
            extent=_rod_box,
            is_convex=True,
        ),
        Surface(
            name="prism",
            summary="a prism: edges along x, its apex towards +y between two equal sides, its centroid at the origin",
            formula="max(y*sin(apex/2) + abs(z)*cos(apex/2) - side/3*sin(apex), -y - side/3*cos(apex/2), "
            "abs(x) - length/2)",
            source="M. Born and E. Wolf, Principles of Optics, 7th ed., sec. 4.7.2",
            parameters=(
                Parameter(
                    name="apex", default=60.0, low=0.0, low_open=True, high=179.0, meaning="angle at the apex, degrees"
                ),
                length("side", 1.2, "from the apex to the base, along either side"),
                length("length", 1.2, "along x"),
            ),
            expression=read(
                f"max(sin({_HALF_APEX})*y + cos({_HALF_APEX})*z - 2/3*side*sin({_HALF_APEX})*cos({_HALF_APEX}),"
                f" sin({_HALF_APEX})*y - cos({_HALF_APEX})*z - 2/3*side*sin({_HALF_APEX})*cos({_HALF_APEX}),"
                f" -y - 1/3*side*cos({_HALF_APEX}), abs(x) - 0.5*length)",
                "apex",
                "side",
                "length",
            ),
            extent=_prism_box,
            is_convex=True,
            faces=named_faces(
                {
                    "front": f"sin({_HALF_APEX})*y - cos({_HALF_APEX})*z"
                    f" - 2/3*side*sin({_HALF_APEX})*cos({_HALF_APEX})",
                    "back": f"sin({_HALF_APEX})*y + cos({_HALF_APEX})*z - 2/3*side*sin({_HALF_APEX})*cos({_HALF_APEX})",
                    "base": f"-y - 1/3*side*cos({_HALF_APEX})",
                    "+x": "x - 0.5*length",
                    "-x": "-x - 0.5*length",
                },
                "apex",
                "side",
                "length",
            ),
            by_planes=False,  # its kernel and its proofs at edges, in twice the precision, stay as they are
        ),
        Surface(
            name="cone",
            summary="a cone about z, its tip towards +z: an axicon where it is flat",
            formula="max(2*hypot(x, y)/diameter + z/height - 1/2, -z - height/2)",
            source="J. H. McLeod, The axicon, J. Opt. Soc. Am. 44, 1954",
            parameters=(length("diameter", 1.4, "of the base"), length("height", 0.4, "from the base to the tip")),
            expression=read(
                "max(height*sqrt(x^2 + y^2) - 0.5*diameter*(0.5*height - z), -0.5*diameter*(z + 0.5*height))",
                "diameter",
                "height",
            ),
            faces=named_faces(
                {
                    "side": "height*sqrt(x^2 + y^2) - 0.5*diameter*(0.5*height - z)",
                    "base": "-0.5*diameter*(z + 0.5*height)",
                },
                "diameter",
                "height",
            ),
            extent=_cone_box,
            is_convex=True,
        ),
        Surface(
            name="conic_singlet",
            summary="a lens of two conic sections turned about z; a curvature of 0 is a plane",
            formula="max(sag(c1, k1) - z - thickness/2, z - thickness/2 - sag(c2, k2), hypot(x, y) - diameter/2); "
            + CONIC_SAG,
            source="ISO 10110-12, Aspheric surfaces; k: 0 sphere, -1 paraboloid, below hyperboloid, above ellipsoid",
            parameters=(*CONICS, *rim(1.4, 0.5)),
            **round_lens(
                conic("c1", "k1", FRONT), f"-{conic('c2', 'k2', BACK)}", *_CONIC_NAMES, "thickness", "diameter"
            ),
            extent=SingletBox(_conics),
            rules=SingletRules(_conics),
        ),
        Surface(
            name="even_asphere_singlet",
            summary="a conic singlet with terms in r^4, r^6 and r^8 added to each face",
            formula="max(sag(c1, k1, A4, A6, A8) - z - thickness/2, z - thickness/2 - sag(c2, k2, B4, B6, B8), "
            "hypot(x, y) - diameter/2); sag = c*r^2/(1 + sqrt(1 - (1 + k)*c^2*r^2)) + A4*r^4 + A6*r^6 + A8*r^8",
            source="ISO 10110-12, Aspheric surfaces; here without the root, as a conic in z less the even terms",
            parameters=(*CONICS, *_EVEN, *rim(1.4, 0.5)),
            **round_lens(
                conic("c1", "k1", _even(FRONT, "A")),
                f"-{conic('c2', 'k2', _even(BACK, 'B'))}",
                *_CONIC_NAMES,
                *_EVEN_NAMES,
                "thickness",
                "diameter",
            ),
            extent=SingletBox(_even_aspheres),
            rules=SingletRules(_even_aspheres),
        ),
    )
