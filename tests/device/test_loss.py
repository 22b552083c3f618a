from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from lost import LOST, REFUSED, driver_error, trace_error

from lenscl.device import Buffer, Device, answers, choose, means_lost
from lenscl.errors import NoDeviceError, TraceError


@pytest.mark.parametrize("code", [-1, -2, -5, -14, -33, -34, LOST, -9999])
def test_a_drivers_report_of_a_lost_device_is_known_through_what_it_caused(code: int) -> None:
    assert driver_error(code).code == code
    assert means_lost(driver_error(code))
    assert means_lost(trace_error(code))
    told = TraceError("told once more")
    told.__cause__ = trace_error(code)
    assert means_lost(told)
    in_passing = ValueError("on the way")
    in_passing.__context__ = driver_error(code)
    assert means_lost(in_passing)


def test_other_errors_are_not_taken_for_a_lost_device() -> None:
    for error in (driver_error(REFUSED), trace_error(REFUSED), TraceError("too large"), NoDeviceError("none")):
        assert not means_lost(error)
    unrelated = TraceError("told in place of another")
    unrelated.__context__, unrelated.__suppress_context__ = driver_error(LOST), True
    assert not means_lost(unrelated)


@dataclass(frozen=True)
class Forgetful(Device):
    """A device that gives back other bytes than it took."""

    def download(self, buffer: Buffer, array: np.ndarray[Any, Any]) -> None:
        array[...] = 7


@dataclass(frozen=True)
class Dead(Device):
    """A device that takes nothing any more."""

    def upload(self, array: np.ndarray[Any, Any]) -> Buffer:
        raise driver_error(LOST)


def test_a_device_answers_if_it_gives_back_what_it_took() -> None:
    device = choose()
    described = {name: getattr(device, name) for name in Device.__dataclass_fields__}
    assert answers(device)
    assert answers(replace(device))  # in a context of its own
    assert not answers(Dead(**described))
    assert not answers(Forgetful(**described))
