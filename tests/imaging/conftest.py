from __future__ import annotations

import pytest

from lenscl import device


@pytest.fixture(scope="session")
def opencl_device() -> device.Device:
    return device.choose()
