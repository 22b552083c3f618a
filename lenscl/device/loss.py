"""Tell a device that was lost from work that it refuses, and find out whether it can be had again."""

from __future__ import annotations

import numpy as np

from lenscl.device.environment import opencl
from lenscl.device.runtime import Device
from lenscl.errors import LensclError

# What drivers report once a context is of no more use. NVIDIA's has codes of its own (CL_INVALID_COMMAND_QUEUE, -9999)
# after a kernel that it ended, or that read memory not its own; OUT_OF_RESOURCES may mean either
_LOST = {
    "DEVICE_NOT_FOUND": -1,
    "DEVICE_NOT_AVAILABLE": -2,
    "OUT_OF_RESOURCES": -5,
    "EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST": -14,
    "INVALID_DEVICE": -33,
    "INVALID_CONTEXT": -34,
    "INVALID_COMMAND_QUEUE": -36,
    "NVIDIA_ILLEGAL_ACCESS": -9999,
}


def means_lost(error: BaseException) -> bool:
    """Whether an error, or what caused it, is a driver's report that a context or device is of no more use."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, opencl().Error) and cause.code in _LOST.values():
            return True
        cause = cause.__cause__ or (None if cause.__suppress_context__ else cause.__context__)
    return False


def answers(device: Device) -> bool:
    """Whether a device takes four bytes and gives them back."""
    sent, received = np.arange(4, dtype=np.uint8), np.zeros(4, np.uint8)
    try:
        device.download(device.upload(sent), received)
    except (opencl().Error, LensclError):
        return False
    return bool((sent == received).all())
