"""The slow, plain float64 twin of every kernel step: what tests compare the kernels against.

Input: a `Scene`. Output: `Paths`, the same facts as a ray map. Each step is a function of its own, written in another
way than its kernel wherever there is one (bisection for Newton, a linear solve for the dual vectors, the textbook's
form of Snell's law), so that a fault in one is not a fault in both. `Steps` holds them; a test can put a fault into one
and see that it is caught.
"""

from __future__ import annotations

from lenscl.reference.march import first_root
from lenscl.reference.paint import paint
from lenscl.reference.placement import Placement
from lenscl.reference.rays import film_rays
from lenscl.reference.screen import land
from lenscl.reference.snell import reflect, refract, refract_paraxial
from lenscl.reference.trace import Paths, Steps, trace, trace_rays

__all__ = [
    "Paths",
    "Placement",
    "Steps",
    "film_rays",
    "first_root",
    "land",
    "paint",
    "reflect",
    "refract",
    "refract_paraxial",
    "trace",
    "trace_rays",
]
