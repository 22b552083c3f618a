"""The lenses: solids F(x, y, z) <= 0 with parameters, bounding boxes and sources; and those that users write."""

from __future__ import annotations

from lenscl.lenses.meant import meant_as
from lenscl.lenses.named import catalogue, surface
from lenscl.lenses.solid import Box, Parameter, Surface, Vec3
from lenscl.lenses.user import user_surface

__all__ = ["Box", "Parameter", "Surface", "Vec3", "catalogue", "meant_as", "surface", "user_surface"]
