"""What the rows of lenses are written with: faces along z from their vertices, and the parameters that they share.

The vertices lie at z = -thickness / 2 (front) and z = thickness / 2 (back).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lenscl.expr import Expr
from lenscl.lenses.rows import length, read, signed
from lenscl.lenses.solid import Parameter

FRONT, BACK = "(z + 0.5*thickness)", "(z - 0.5*thickness)"  # along z from the vertices
BACKWARD = "(0.5*thickness - z)"
RIM = "x^2 + y^2 - (0.5*diameter)^2"

SPHERE_SAG = "sag(R) = R - sqrt(R^2 - x^2 - y^2)"
CONIC_SAG = "sag(c, k) = c*r^2/(1 + sqrt(1 - (1 + k)*c^2*r^2)), r^2 = x^2 + y^2"


def sphere(radius: str, w: str) -> str:
    """Write a face that bulges: negative in the ball of its vertex, w = 0, and beyond the ball's centre.

    In w, along z from the vertex, nothing cancels, however large the radius is.
    """
    return f"min(1/{radius}*(x^2 + y^2 + {w}^2) - 2*{w}, {radius} - {w})"


def conic(c: str, k: str, w: str, across: str = "x^2 + y^2") -> str:
    """Write a face of curvature c and conic constant k: negative where w, along z from the vertex, exceeds its sag.

    The conic c q + (1 + k) c w^2 - 2 w = 0, q = x^2 + y^2, has a second sheet. The two part where (1 + k) c w = 1, so
    from there on the second factor of c q - w (2 - (1 + k) c w) is kept at 1: what is left, c q - w, has one sign up to
    where the conic ends. That serves either sign of c and of 1 + k, and 0; on the face the slope along z is
    -2 sqrt(1 - (1 + k) c^2 q).
    """
    return f"({c}*({across}) - {w}*max(2 - (1 + {k})*{c}*{w}, 1))"


def round_lens(front: str, back: str, *parameters: str) -> dict[str, Any]:
    """Return F, of the solid behind the front, before the back and within the rim, and these faces."""
    return {
        "expression": read(f"max(0.5*diameter*max({front}, {back}), {RIM})", *parameters),
        "faces": named_faces({"front": front, "back": back, "rim": RIM}, *parameters),
    }


def named_faces(texts: Mapping[str, str], *parameters: str) -> tuple[tuple[str, Expr], ...]:
    """Return faces by their names, each a function that is negative on its inner side."""
    return tuple((name, read(text, *parameters)) for name, text in texts.items())


def rim(diameter: float, thickness: float) -> tuple[Parameter, Parameter]:
    """Return the parameters of a round lens, of these defaults."""
    return length("thickness", thickness, "from vertex to vertex"), length("diameter", diameter, "of the rim")


CONICS = (
    signed("c1", 0.8, "curvature of the front, 1 / radius, positive if its centre is towards +z"),
    signed("k1", 0.0, "conic constant of the front"),
    signed("c2", -0.4, "curvature of the back, positive if its centre is towards +z"),
    signed("k2", 0.0, "conic constant of the back"),
)
