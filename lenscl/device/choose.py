"""Find the OpenCL devices of this machine and rank them.

The order in which drivers report themselves means nothing: a simulator or a system's older PoCL may come first. Rank
by what the work needs: double precision, then kind, then driver; and let the user name another.
"""

from __future__ import annotations

import os
import re
from functools import cache
from typing import Any

from lenscl.device.environment import opencl
from lenscl.device.runtime import Device
from lenscl.device.unknown_cpu import name_processor
from lenscl.errors import NoDeviceError

_VARIABLE = "LENSCL_DEVICE"
_SIMULATORS = ("oclgrind",)  # they check kernels, thousands of times slower: only when named
# Oclgrind 21.10 interprets LLVM's text but not the marks that inlining leaves in it, of functions with `restrict` or a
# structure for result: nothing is inlined there, not even what asks for it
_SIMULATOR_OPTIONS = ("-cl-opt-disable", "-Dalways_inline=")
_KIND_RANK = {"gpu": 0, "accelerator": 1, "cpu": 2}
_ADVICE = (
    "Install one with `pip install pocl-binary-distribution` (Linux x86-64) or your vendor's OpenCL driver, "
    "then look at `lenscl devices` and `lenscl doctor`."
)


def devices() -> tuple[Device, ...]:
    """Return every OpenCL device, the one to be chosen first; simulators last.

    Raises
    ------
    NoDeviceError
        If OpenCL cannot start here at all.
    """
    return _devices()


def choose(wanted: str | None = None) -> Device:
    """Return the device to work on.

    Parameters
    ----------
    wanted : str, optional
        Part of a device's label ("platform: name"), any case, or else of its driver's version. Default: the
        environment variable LENSCL_DEVICE, else the best device that is not a simulator.

    Raises
    ------
    NoDeviceError
        If there is none, or none of that name; the message lists what there is and how to install one.
    """
    found = _devices()
    named = wanted or os.environ.get(_VARIABLE) or None
    if named is None:
        fit = [device for device in found if not _is_simulator(device.label)]
    else:
        fit = [device for device in found if named.lower() in device.label.lower()]
        fit = fit or [device for device in found if named.lower() in device.driver.lower()]
    if fit:
        return fit[0]
    listed = "; ".join(device.label for device in found)
    if not found:
        raise NoDeviceError(f"no OpenCL device was found. {_ADVICE}")
    if named is None:
        raise NoDeviceError(f"no OpenCL device was found but simulators, used only when named: {listed}. {_ADVICE}")
    asked = f"no OpenCL device is called {named!r}" if wanted else f"{_VARIABLE}={named} names no device; unset it"
    raise NoDeviceError(f"{asked}{';' if wanted else ' or'} use part of: {listed}. See `lenscl doctor`.")


@cache
def _devices() -> tuple[Device, ...]:
    cl = opencl()
    try:
        platforms = cl.get_platforms()
    except cl.Error:  # the loader reports "no platform" as an error
        return ()
    found = [_describe(platform, handle) for platform in platforms for handle in _handles(cl, platform)]
    return tuple(sorted(found, key=_rank))


def _handles(cl: Any, platform: Any) -> list[Any]:
    try:
        return list(platform.get_devices())
    except cl.Error:  # a driver without hardware
        return []


def _describe(platform: Any, handle: Any) -> Device:
    cl = opencl()
    kinds = {cl.device_type.GPU: "gpu", cl.device_type.CPU: "cpu", cl.device_type.ACCELERATOR: "accelerator"}
    kind = next((name for flag, name in kinds.items() if handle.type & flag), "other")
    driver = f"{platform.version.strip()}, {handle.driver_version.strip()}"
    if kind == "cpu" and _is_pocl(platform.name) and (target := name_processor(handle.int_ptr)) is not None:
        driver += f", compiling for {target}, for it does not know this processor"
    return Device(
        platform=platform.name.strip(),
        name=handle.name.strip(),
        driver=driver,
        kind=kind,
        has_double="cl_khr_fp64" in handle.extensions,
        widths=_widths(kind, handle),
        handle=handle,
        build_options=_SIMULATOR_OPTIONS if _is_simulator(platform.name) else (),
    )


def _widths(kind: str, handle: Any) -> tuple[int, int]:
    """Return the lanes of a packet in (single, double): a CPU's registers, one ray a work-item elsewhere."""
    if kind != "cpu":
        return 1, 1
    single, double = handle.native_vector_width_float, handle.native_vector_width_double
    if single >= 16:
        single, double = (
            2 * single,
            2 * double,
        )  # AVX-512 has registers enough for two chains: each fills the other's waits
    return _supported(single), _supported(double)


def _supported(native: int) -> int:
    return max(width for width in (1, 2, 4, 8, 16, 32) if width <= max(native, 1))


def _rank(device: Device) -> tuple[bool, bool, int, bool, list[int]]:
    version = [-int(part) for part in re.findall(r"\d+", device.driver)]
    kind = _KIND_RANK.get(device.kind, len(_KIND_RANK))
    # Packets are measured on PoCL
    return _is_simulator(device.label), not device.has_double, kind, not _is_pocl(device.platform), version


def _is_pocl(platform: str) -> bool:
    return "portable computing language" in platform.lower()


def _is_simulator(label: str) -> bool:
    return any(name in label.lower() for name in _SIMULATORS)
