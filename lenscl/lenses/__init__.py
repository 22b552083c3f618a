"""The lenses: solids F(x, y, z) <= 0 with parameters, bounding boxes and sources; and those that users write."""

from __future__ import annotations

from lenscl.expr.planar import MOST_PLANES
from lenscl.lenses.coats import coat_functions, coated_planes, face_at, face_functions, face_names, is_whole
from lenscl.lenses.meant import meant_as
from lenscl.lenses.named import catalogue, surface
from lenscl.lenses.polyhedra import FEWEST_PLANES, OCTAHEDRON, plane_values, polyhedron
from lenscl.lenses.solid import Box, Parameter, Surface, Vec3
from lenscl.lenses.user import user_surface

__all__ = [
    "FEWEST_PLANES",
    "MOST_PLANES",
    "OCTAHEDRON",
    "Box",
    "Parameter",
    "Surface",
    "Vec3",
    "catalogue",
    "coat_functions",
    "coated_planes",
    "face_at",
    "face_functions",
    "face_names",
    "is_whole",
    "meant_as",
    "plane_values",
    "polyhedron",
    "surface",
    "user_surface",
]
