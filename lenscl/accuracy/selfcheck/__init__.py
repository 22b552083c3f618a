"""Check a ray map by laws that every path obeys, whatever the lens; nothing is compared with another answer.

Input: a `RayMap`, or rays. Output: a `SelfCheck`, by `check_map` or `check_rays`. `hits` are surface points with bounds
on F and the normal there, `bends` hold Snell's law against them, `returns` send rays back the way they came, `findings`
say what was found.
"""

from __future__ import annotations

from lenscl.accuracy.selfcheck.check import check_map, check_rays
from lenscl.accuracy.selfcheck.findings import Failure, SelfCheck

__all__ = ["Failure", "SelfCheck", "check_map", "check_rays"]
