"""The surfaces that lenscl knows by name. One row each: form, parameters, box, source; those of optics in `optical`.

Each form is the best conditioned that is known: its gradient vanishes on the surface at true singular points only, and
nearby terms are subtracted before they are squared.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from functools import lru_cache

from lenscl.errors import LensclError
from lenscl.expr import Expr, build, symbol
from lenscl.lenses.bent import bent_rows
from lenscl.lenses.optical import optical_rows
from lenscl.lenses.polyhedra import flat_rows
from lenscl.lenses.rows import length, read
from lenscl.lenses.solid import Box, Parameter, Surface, Values


def _cube(half: float) -> Box:
    return (-half, -half, -half), (half, half, half)


def _sphere_box(values: Values) -> Box:
    return _cube(values["r"])


def _ellipsoid_box(values: Values) -> Box:
    a, b, c = (values[name] * values["r"] for name in "abc")
    return (-a, -b, -c), (a, b, c)


def _is_ring(values: Values) -> bool:
    return values["r"] <= values["R"]


def _torus_box(values: Values) -> Box:
    out, r = values["R"] + values["r"], values["r"]
    return (-out, -out, -r), (out, out, r)


# Half widths of the heart. On x = 0 (y = 0) it reaches furthest where dF/dz = 0, z = q / 2 with q = cbrt(x^2/10 + y^2):
# 2 x^2 - (x^2/10)^(2/3) / 4 = 1 and 2 y^2 - y^(4/3) / 4 = 1. Its top is on x = 0 where dF/dy = 0, z = 6 y^(4/3); its
# lowest point is the tip, z = -1.
_HEART_X, _HEART_Y, _HEART_Z = 0.71927425663922107, 0.76661801920269593, 1.15703467117845234


def _heart_box(values: Values) -> Box:
    return (-_HEART_X, -_HEART_Y, -1.0), (_HEART_X, _HEART_Y, _HEART_Z)


_BIFOLIA_RADIUS = 9 * math.sqrt(3) / 16  # of r = 3 cos(t) sin(t)^2 about y: greatest r sin(t), at t = 60 degrees


def _bifolia_box(values: Values) -> Box:
    return (-_BIFOLIA_RADIUS, 0.0, -_BIFOLIA_RADIUS), (_BIFOLIA_RADIUS, 0.75, _BIFOLIA_RADIUS)


def _barth_box(values: Values) -> Box:
    return _cube(values["clip"])  # the axes lie inside the sextic, so the ball alone ends the solid there


def _unit_box(values: Values) -> Box:
    return _cube(1.0)


# B = x^2 + y^2 + z^2 - R^2 - r^2, grouped so that a thin tube loses nothing: the quartic A^2 - 4 R^2 (x^2 + y^2) of
# A = B + 2 R^2 is B^2 + 4 R^2 (z^2 - r^2) exactly. Inside a spindle torus (r > R) it has a second sheet; A < 0 there. A
# is taken times a length squared: values that are compared must be of one degree, or rounding decides in large scenes.
_TORUS_B = "((x^2 + y^2 - R^2) + (z^2 - r^2))"
_TORUS_QUARTIC = f"{_TORUS_B}^2 + 4*R^2*(z^2 - r^2)"
_TORUS = f"min({_TORUS_QUARTIC}, (R^2 + r^2)*({_TORUS_B} + 2*R^2))"

_GOLDEN2 = "2.618033988749895"  # t^2, t = (1 + sqrt 5) / 2
_BARTH = (
    f"4*({_GOLDEN2}*x^2 - y^2)*({_GOLDEN2}*y^2 - z^2)*({_GOLDEN2}*z^2 - x^2)"
    " - 4.23606797749979*w^2*(x^2 + y^2 + z^2 - w^2)^2"  # 1 + 2 t
)


def _superellipsoid() -> Expr:
    """Return a norm of norms, of exponents 2 / e >= 1, less 1: convex, and smooth wherever the surface is."""
    x, y, z, e1, e2 = (symbol(name) for name in ("x", "y", "z", "e1", "e2"))
    return build("norm", build("norm", x, y, 2.0 / e2), z, 2.0 / e1) - 1.0


def _rows() -> tuple[Surface, ...]:
    return (
        Surface(
            name="sphere",
            summary="a ball",
            formula="x^2 + y^2 + z^2 - r^2",
            source="elementary",
            parameters=(length("r", 1.0, "radius"),),
            expression=read("x^2 + y^2 + z^2 - r^2", "r"),
            extent=_sphere_box,
            is_convex=True,
        ),
        Surface(
            name="ellipsoid",
            summary="a ball stretched along x, y and z",
            formula="(x/a)^2 + (y/b)^2 + (z/c)^2 - r^2",
            source="elementary",
            parameters=(
                length("a", 1.0, "semi-axis along x, in units of r"),
                length("b", 1.0, "semi-axis along y, in units of r"),
                length("c", 1.0, "semi-axis along z, in units of r"),
                length("r", 1.0, "scale"),
            ),
            expression=read("(1/a*x)^2 + (1/b*y)^2 + (1/c*z)^2 - r^2", "a", "b", "c", "r"),
            extent=_ellipsoid_box,
            is_convex=True,
        ),
        Surface(
            name="torus",
            summary="a ring about the z axis; for r > R a spindle, filled",
            formula="(R - sqrt(x^2 + y^2))^2 + z^2 - r^2",
            source="elementary; here min(A^2 - 4 R^2 (x^2 + y^2), (R^2 + r^2) A) of A = x^2 + y^2 + z^2 + R^2 - r^2",
            parameters=(length("R", 0.7, "radius of the ring"), length("r", 0.25, "radius of the tube")),
            expression=read(_TORUS, "R", "r"),
            polynomial=read(_TORUS_QUARTIC, "R", "r"),
            holds=_is_ring,
            extent=_torus_box,
        ),
        Surface(
            name="heart",
            summary="a heart, point down along z",
            formula="(2*x^2 + 2*y^2 + z^2 - 1)^3 - x^2*z^3/10 - y^2*z^3",
            source="Taubin, IEEE Computer Graphics and Applications 14(2), 1994; here its cube root, simple at z = 0",
            expression=read("2*x^2 + 2*y^2 + z^2 - 1 - z*cbrt(0.1*x^2 + y^2)"),
            extent=_heart_box,
        ),
        Surface(
            name="bifolia",
            summary="a bifolium turned about the y axis: a ring closed to a point at the origin",
            formula="(x^2 + y^2 + z^2)^2 - 3*y*(x^2 + z^2)",
            source="the bifolium r = 3 cos(t) sin(t)^2, turned about its axis",
            expression=read("(x^2 + y^2 + z^2)^2 - 3*y*(x^2 + z^2)"),
            extent=_bifolia_box,
        ),
        Surface(
            name="barth_sextic",
            summary="Barth's sextic of 65 nodes, ended by a ball",
            formula="4*(t^2*x^2 - y^2)*(t^2*y^2 - z^2)*(t^2*z^2 - x^2) - (1 + 2*t)*w^2*(x^2 + y^2 + z^2 - w^2)^2",
            source="W. Barth, Two projective surfaces with many nodes, J. Algebraic Geom. 5, 1996; t = (1 + sqrt(5))/2",
            parameters=(length("w", 1.0, "scale of the sextic"), length("clip", 1.8, "radius of the ball")),
            expression=read(f"max({_BARTH}, clip^4*(x^2 + y^2 + z^2 - clip^2))", "w", "clip"),
            faces=(
                ("sextic", read(_BARTH, "w", "clip")),
                ("ball", read("clip^4*(x^2 + y^2 + z^2 - clip^2)", "w", "clip")),
            ),
            extent=_barth_box,
        ),
        Surface(
            name="superellipsoid",
            summary="from a cube (0.2) over a ball (1) to a double cone or an octahedron (2)",
            formula="((x^2)^(1/e2) + (y^2)^(1/e2))^(e2/e1) + (z^2)^(1/e1) - 1",
            source="A. H. Barr, IEEE Computer Graphics and Applications 1(1), 1981; here its e1/2 power, a norm less 1",
            parameters=(
                Parameter(name="e1", default=0.5, low=0.2, high=2.0, meaning="squareness along z"),
                Parameter(name="e2", default=0.5, low=0.2, high=2.0, meaning="squareness about z"),
            ),
            expression=_superellipsoid(),
            extent=_unit_box,
            is_convex=True,
        ),
    )


@lru_cache(maxsize=1)
def catalogue() -> Mapping[str, Surface]:
    """Return every surface by its name, in a fixed order.

    >>> list(catalogue())  # doctest: +NORMALIZE_WHITESPACE
    ['sphere', 'ellipsoid', 'torus', 'heart', 'bifolia', 'barth_sextic', 'superellipsoid', 'biconvex', 'plano_convex',
     'meniscus', 'ball', 'rod', 'prism', 'cone', 'conic_singlet', 'even_asphere_singlet', 'biconcave',
     'half_ball', 'drum', 'cylindrical_singlet', 'toroidal_singlet', 'asphere_singlet', 'box', 'wedge', 'polyhedron',
     'brilliant']
    """
    return {row.name: row for row in (*_rows(), *optical_rows(), *bent_rows(), *flat_rows())}


def surface(name: str) -> Surface:
    """Return a surface of the catalogue.

    Raises
    ------
    LensclError
        For an unknown name; the message names the nearest.
    """
    rows = catalogue()
    if name not in rows:
        near = difflib.get_close_matches(name[:40], rows, n=1)
        advice = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(rows)}"
        raise LensclError(f"unknown surface {name!r}; {advice}")
    return rows[name]
