"""The slow, plain float64 twin of every kernel step: what tests compare the kernels against.

Input: a `Scene`. Output: `Paths`, the same facts as a ray map. Each step is a function of its own, written in another
way than its kernel wherever there is one (bisection for Newton, a linear solve for the dual vectors, the textbook's
form of Snell's law), so that a fault in one is not a fault in both. `Steps` holds them; a test can put a fault into one
and see that it is caught.

What a first root is, is settled by two judges of claims: `certified.first_root` proves it for one ray, and
`companion.first_roots` for many rays, in float64, where roots stand apart. Where a whole ray lands is proved by
`oracle.prove_rays`, with a radius or a reason why nobody can tell.
"""

from __future__ import annotations

from lenscl.reference import certified, companion, oracle
from lenscl.reference.certified import sign_polynomial
from lenscl.reference.library import flint_trouble
from lenscl.reference.march import first_root
from lenscl.reference.mirror import on_mirror
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
    "certified",
    "companion",
    "film_rays",
    "first_root",
    "flint_trouble",
    "land",
    "on_mirror",
    "oracle",
    "paint",
    "reflect",
    "refract",
    "refract_paraxial",
    "sign_polynomial",
    "trace",
    "trace_rays",
]
