"""Settings shared by every test."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers
from probe import plain_device, users_device

from lenscl import device

settings.register_profile("tests", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("anew", settings.get_profile("tests"), derandomize=False, database=None)
settings.register_profile("explore", deadline=None, max_examples=2000, suppress_health_check=[HealthCheck.too_slow])
_profile = os.environ.get("HYPOTHESIS_PROFILE", "tests")
settings.load_profile(_profile)
if _profile == "tests":
    # Hypothesis also draws constants that it finds in the modules loaded so far: those of whatever ran before in the
    # same process. What a test draws, and so whether it draws enough, is to hang on the test alone
    providers._get_local_constants = providers.Constants


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--slow", action="store_true", help="also run the long sweeps")
    parser.addoption("--write-golden", action="store_true", help="write the kernels in tests/golden anew")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if not config.getoption("--slow"):
        skip = pytest.mark.skip(reason="a long sweep; give --slow to run it")
        for item in items:
            if "slow" in item.keywords:
                item.add_marker(skip)


@pytest.fixture(scope="session", autouse=True)
def plain_kernels() -> Iterator[None]:
    """Let the device that is chosen unasked be one that compiles fast; see `plain_device`.

    Most of the tests' time is compiling. What a compiler makes of kernels is tested where `optimised_device` is named
    (packets of every width end as plain kernels do) and where a module or a test is marked `users_kernels` (among them
    some hard cases and pairs of effects).
    """
    users_device()  # looked up before another takes its place
    with _chosen_unasked(plain_device()):
        yield


@pytest.fixture(scope="module", autouse=True)
def module_kernels(request: pytest.FixtureRequest) -> Iterator[None]:
    """Give a module that is marked so, with its own fixtures, the devices as users have them."""
    with _as_marked(request.node):
        yield


@pytest.fixture(autouse=True)
def test_kernels(request: pytest.FixtureRequest) -> Iterator[None]:
    """Give a test that is marked so the devices as users have them."""
    with _as_marked(request.node):
        yield


_users_devices = sys.modules["lenscl.device.choose"]._devices


@contextmanager
def _as_marked(node: pytest.Item) -> Iterator[None]:
    if not node.get_closest_marker("users_kernels"):
        yield
        return
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(sys.modules["lenscl.device.choose"], "_devices", _users_devices)
        yield


@contextmanager
def _chosen_unasked(chosen: device.Device) -> Iterator[None]:
    others = [each for each in device.devices() if each.label != chosen.label]
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(sys.modules["lenscl.device.choose"], "_devices", lambda: (chosen, *others))
        yield
