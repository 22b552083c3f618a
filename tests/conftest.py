"""Settings shared by every test."""

from __future__ import annotations

import os
import sys

import pytest
from hypothesis import HealthCheck, settings
from probe import device_of_width, plain_device

from lenscl import device

settings.register_profile("tests", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("explore", deadline=None, max_examples=2000, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "tests"))


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--slow", action="store_true", help="also run the long sweeps")
    parser.addoption("--write-golden", action="store_true", help="write the kernels in tests/golden anew")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if not config.getoption("--slow"):
        skip = pytest.mark.skip(reason="a long sweep; give --slow to run it")
        for item in items:
            if "slow" in item.keywords:
                item.add_marker(skip)


@pytest.fixture
def plain_kernels(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the device that is chosen unasked be one that compiles fast; see `plain_device`."""
    _choose_unasked(monkeypatch, plain_device())


@pytest.fixture(autouse=True)
def few_lanes(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the device that is chosen unasked take packets of 4 rays in single and 2 in double.

    Such kernels compile in two thirds of the time, optimised as ever. Packets of every width have tests of their own,
    which choose them; what is to be as wide as users have it is marked `users_widths`.
    """
    is_plain = "plain_kernels" in request.fixturenames
    if not (is_plain or request.node.get_closest_marker("users_widths")):
        _choose_unasked(monkeypatch, device_of_width(4, 2))


def _choose_unasked(monkeypatch: pytest.MonkeyPatch, chosen: device.Device) -> None:
    others = [each for each in device.devices() if each.label != chosen.label]
    monkeypatch.setattr(sys.modules["lenscl.device.choose"], "_devices", lambda: (chosen, *others))
