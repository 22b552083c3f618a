"""Time and error of a trace, side by side: neither is worth anything without the other."""

from __future__ import annotations

from lenscl.accuracy.frozen import FrozenKernel
from lenscl.accuracy.peak import multiply_add_peak

__all__ = ["FrozenKernel", "multiply_add_peak"]
