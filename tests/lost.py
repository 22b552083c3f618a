"""A driver that reports that it lost its device."""

from __future__ import annotations

from types import SimpleNamespace

import pyopencl

from lenscl.errors import TraceError

LOST = -36  # CL_INVALID_COMMAND_QUEUE, as after a kernel that the driver ended
REFUSED = -61  # CL_INVALID_BUFFER_SIZE


def driver_error(code: int) -> pyopencl.Error:
    """Return what pyopencl raises for a status code."""
    record = SimpleNamespace(code=lambda: code, what=lambda: "made up", routine=lambda: "clEnqueueNDRangeKernel")
    return pyopencl.LogicError(record)


def trace_error(code: int) -> TraceError:
    """Return what a launch raises for a status code, with its cause."""
    error = TraceError("the device: kernel trace failed")
    error.__cause__ = driver_error(code)
    return error
