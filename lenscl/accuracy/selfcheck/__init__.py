"""Check a ray map by laws that every path obeys, whatever the lens; nothing is compared with another answer.

Input: a `RayMap`, or rays. Output: a `SelfCheck`, by `check_map` or `check_rays`. `sample` says which rays are looked
at, `paths` follow them, a `walk` is what was followed, `hits` are surface points with bounds on F and the normal there,
`separate` tells what the surfaces of solids that are apart part, `arranged` what those of solids that touch or overlap
do, by the `media` there, `bends` hold Snell's law against them, `legs` look for what lies in the way, `returns` send
rays back the way they came, `tally` counts what was compared, `causes` tell why a law may be broken, `findings` say
what was found.
"""

from __future__ import annotations

from lenscl.accuracy.selfcheck.check import check_map, check_rays
from lenscl.accuracy.selfcheck.findings import Failure, SelfCheck

__all__ = ["Failure", "SelfCheck", "check_map", "check_rays"]
