"""The registry of searches: how the next intersection of a ray with a surface is found.

A method is data: the kernel fragments that implement it, all with the one interface that `kernels/lens.cl` calls, what
it guarantees and which keys of `[numerics]` it reads. A new method is one new row here and its fragment.

>>> METHODS["march"].reads
('step', 'tolerance')
"""

from __future__ import annotations

from lenscl.methods.registry import LAST_RESORT, METHODS, Method, choose

__all__ = ["LAST_RESORT", "METHODS", "Method", "choose"]
