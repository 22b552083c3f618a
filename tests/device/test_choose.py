from __future__ import annotations

import sys
from types import SimpleNamespace

import pytest

from lenscl.device import choose, environment
from lenscl.errors import NoDeviceError

pytestmark = pytest.mark.users_kernels

choosing = sys.modules["lenscl.device.choose"]


def device(platform: str, name: str, driver: str) -> SimpleNamespace:
    return SimpleNamespace(label=f"{platform}: {name}", driver=driver)


HERE = (
    device("Portable Computing Language", "cpu", "OpenCL 3.0 PoCL 5.0, 5.0"),
    device("Some Vendor", "graphics", "OpenCL 3.0, 1.2"),
    device("Oclgrind", "simulator", "OpenCL 1.2, 21.10"),
)


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(choosing, "_devices", lambda: HERE)
    monkeypatch.delenv("LENSCL_DEVICE", raising=False)


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("wanted", "number"), [(None, 0), ("PORTABLE", 0), ("pocl", 0), ("graphics", 1), ("oclgrind", 2), ("1.2", 1)]
)
@pytest.mark.parametrize("by_variable", [False, True])
def test_a_device_is_found_by_its_label_and_else_by_its_driver(
    monkeypatch: pytest.MonkeyPatch, wanted: str | None, number: int, by_variable: bool
) -> None:
    if by_variable:
        monkeypatch.setenv("LENSCL_DEVICE", wanted or "")
    assert choose(None if by_variable else wanted) is HERE[number]


@pytest.mark.usefixtures("here")
def test_a_name_that_fits_nothing_is_refused_by_where_it_came_from(monkeypatch: pytest.MonkeyPatch) -> None:
    labels = "; ".join(one.label for one in HERE)
    with pytest.raises(NoDeviceError, match="no OpenCL device is called 'abacus'; use part of: ") as refused:
        choose("abacus")
    assert labels in str(refused.value)
    monkeypatch.setenv("LENSCL_DEVICE", "abacus")
    with pytest.raises(
        NoDeviceError, match=r"^LENSCL_DEVICE=abacus names no device; unset it or use part of: "
    ) as refused:
        choose()
    assert labels in str(refused.value)


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(("found", "says"), [((), "no OpenCL device was found"), (HERE[2:], "simulators.*Oclgrind")])
def test_a_machine_without_a_device_is_told_how_to_get_one(
    monkeypatch: pytest.MonkeyPatch, found: tuple[SimpleNamespace, ...], says: str
) -> None:
    monkeypatch.setattr(choosing, "_devices", lambda: found)
    with pytest.raises(NoDeviceError, match=f"{says}.*pip install"):
        choose()


@pytest.mark.parametrize("error", [ImportError("libOpenCL.so.1: cannot open"), OSError("libOpenCL.so.1: invalid ELF")])
def test_a_pyopencl_that_cannot_be_imported_is_no_device_with_its_fix(
    monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    class Broken:
        @staticmethod
        def find_spec(name: str, *_: object) -> None:
            if name == "pyopencl":
                raise error

    monkeypatch.setattr(environment, "problems", lambda: iter(()))
    monkeypatch.delitem(sys.modules, "pyopencl", raising=False)
    monkeypatch.setattr(sys, "meta_path", [Broken, *sys.meta_path])
    with pytest.raises(NoDeviceError, match=r"libOpenCL\.so\.1: .*; to mend it: pip install") as refused:
        environment.opencl.__wrapped__()
    assert refused.value.exit_code == 4
