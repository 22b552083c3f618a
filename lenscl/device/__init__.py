"""Choose an OpenCL device, build programs for it, move buffers, launch kernels.

Input: OpenCL C text and numpy arrays. Output: arrays and the device's own seconds. This package is the only place that
imports pyopencl, and it knows nothing of lenses.

>>> from lenscl import device
>>> best = device.choose()
>>> best.width("double") in (1, 2, 4, 8, 16, 32)
True
"""

from __future__ import annotations

from lenscl.device.choose import choose, devices
from lenscl.device.environment import cache_folder, problems
from lenscl.device.loss import answers, means_lost
from lenscl.device.runtime import WIDEST, Buffer, Device, Precision, Program, compile_count

__all__ = [
    "WIDEST",
    "Buffer",
    "Device",
    "Precision",
    "Program",
    "answers",
    "cache_folder",
    "choose",
    "compile_count",
    "devices",
    "means_lost",
    "problems",
]
