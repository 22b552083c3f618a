"""What `lenscl doctor` looks at. Every fault comes with its fix; nothing here lets a broken driver end this process."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, Literal, TypeAlias

State: TypeAlias = Literal["ok", "note", "FAULT"]
FAULT: State = "FAULT"

FORMATS = ("png", "jpg", "tif", "exr")  # what a study's output.format can be
_PROBE_SECONDS = 300  # a simulator takes long; a driver that hangs must not hang us
_LOW_DISK = 500 * 2**20  # bytes below which a sweep may soon fill the disk
_FEW_FILES = 256  # open files below which drivers and readers are known to stumble
_UNSEEN_EXTRAS = ("all", "dev", "test")
_IMPORTS = {"python-flint": "from flint import arb", "intel-opencl-rt": "pass"}  # where it is not `import NAME`
_DRIVER_FIX = (
    "pip install pocl-binary-distribution (Linux x86-64), or install your vendor's OpenCL driver; "
    "`lenscl devices` lists what is found"
)


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing looked at."""

    what: str
    state: State
    detail: str
    fix: str = ""
    is_device: bool = False  # True for the fault that no device works

    def as_dict(self) -> dict[str, Any]:
        """Return it for JSON."""
        return asdict(self)


def examine() -> Iterator[Finding]:
    """Yield every finding, as soon as it is made."""
    yield Finding(
        "program", "ok", f"lenscl {metadata.version('lenscl')}, Python {sys.version.split()[0]}, {sys.platform}"
    )
    surroundings = list(_surroundings())
    yield from surroundings
    if all(finding.state == "ok" for finding in surroundings):  # else no device can work, and each fix is given
        yield from _devices()
    yield from _formats()
    yield from _limits()
    yield from _disk()
    yield from _extras()


def _surroundings() -> Iterator[Finding]:
    from lenscl.device import cache_folder, problems

    found = [Finding("OpenCL's surroundings", FAULT, wrong, fix, is_device=True) for wrong, fix in problems()]
    yield from found
    if not found:
        yield Finding("linker", "ok", shutil.which("ld") or "none, and none is needed here")
        yield Finding("kernel cache", "ok", f"{cache_folder()} can be written")


def _devices() -> Iterator[Finding]:
    """Try every device; a fault is one of the device that would be chosen, what else does not work is a note."""
    listed, trouble = _probe()
    if trouble is not None:
        trouble, _, fix = trouble.partition("; to mend it: ")
        yield Finding("devices", FAULT, f"OpenCL cannot start: {trouble}", fix or _DRIVER_FIX, is_device=True)
        return
    if listed["chosen"] is None:
        fix = "unset LENSCL_DEVICE, or name one of `lenscl devices`"
        yield Finding("choice of device", FAULT, listed["trouble"], fix, is_device=True)
    working = 0
    for label in listed["labels"]:
        found, trouble = _probe(label)
        wrong = [trouble] if trouble is not None else found["problems"]
        if wrong:
            state: State = FAULT if label == listed["chosen"] else "note"
            fix = "update this driver, or choose another device by LENSCL_DEVICE"
            yield Finding("device", state, f"{label}: {'; '.join(wrong)}", fix)
        else:
            working += 1
            precisions = " and ".join(found["precisions"])
            yield Finding("device", "ok", f"{label}: compiled, traced and compared in {precisions} ({found['driver']})")
    if working == 0:
        yield Finding("devices", FAULT, f"none works of {len(listed['labels'])} found", _DRIVER_FIX, is_device=True)


def _probe(*arguments: str) -> tuple[Any, str | None]:
    """Run the probe in a process of its own; return what it printed, or why there is nothing."""
    command = [sys.executable, "-m", "lenscl.cli.probe", *arguments]
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=_PROBE_SECONDS)
    except subprocess.TimeoutExpired:
        return None, f"no answer within {_PROBE_SECONDS} seconds"
    if done.returncode == 0:
        return json.loads(done.stdout.splitlines()[-1]), None
    if done.returncode < 0:
        return None, f"the driver ended its process with {signal.Signals(-done.returncode).name}: {_last_words(done)}"
    return None, _last_words(done)


def _last_words(done: subprocess.CompletedProcess[str]) -> str:
    return next((line for line in reversed(done.stderr.splitlines()) if line.strip()), "it says nothing")


def _formats() -> Iterator[Finding]:
    import numpy as np

    from lenscl.imaging import read_picture, write_image

    pixels = np.full((5, 7, 3), 128, dtype=np.uint8)
    with tempfile.TemporaryDirectory(prefix="lenscl-doctor-") as folder:
        for ending in FORMATS:
            path = Path(folder) / f"probe.{ending}"
            try:
                write_image(path, pixels if ending != "exr" else pixels.astype(np.float32) / 255, metadata={})
                shape = read_picture(path).pixels.shape
                if shape != pixels.shape:
                    raise ValueError(f"came back as {shape}, was written as {pixels.shape}")
            except Exception as error:  # whatever is wrong with one format, look at the others too
                yield Finding("image format", FAULT, f"{ending}: {error}", "pip install --force-reinstall OpenImageIO")
            else:
                yield Finding("image format", "ok", f"{ending}: written and read back")


def _limits() -> Iterator[Finding]:
    try:
        import resource
    except ImportError:  # not a Unix
        yield Finding("limits", "ok", f"{os.cpu_count()} processors")
        return
    files = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    memory = resource.getrlimit(resource.RLIMIT_AS)[0]
    shown = "unlimited" if memory == resource.RLIM_INFINITY else f"{memory / 2**30:.1f} GiB"
    detail = f"{os.cpu_count()} processors, {files} open files, address space {shown}"
    if 0 <= files < _FEW_FILES:
        yield Finding("limits", FAULT, detail, "ulimit -n 1024")
    else:
        yield Finding("limits", "ok", detail)


def _disk() -> Iterator[Finding]:
    for name, folder in (
        ("disk of this folder", Path.cwd()),
        ("disk for temporary files", Path(tempfile.gettempdir())),
    ):
        free = shutil.disk_usage(folder).free
        detail = f"{free / 2**30:.1f} GiB free in {folder}"
        if free < _LOW_DISK:
            yield Finding(name, FAULT, detail, "remove what is not needed, or sweep into another folder with -o")
        else:
            yield Finding(name, "ok", detail)


def _extras() -> Iterator[Finding]:
    wanted: dict[str, list[str]] = defaultdict(list)
    for requirement in metadata.requires("lenscl") or ():
        condition = re.search(r"""extra\s*==\s*['"]([^'"]+)['"]""", requirement)
        package = re.match(r"[A-Za-z0-9._-]+", requirement)
        if condition and package and condition[1] not in _UNSEEN_EXTRAS:
            wanted[condition[1]].append(package[0])
    for extra, names in sorted(wanted.items()):
        missing = [name for name in names if not _is_installed(name)]
        if missing:
            yield Finding(
                f"extra {extra}", "note", f"{', '.join(missing)} not installed", f"pip install 'lenscl[{extra}]'"
            )
        elif trouble := _cannot_import(names):
            fix = f"pip install --force-reinstall {' '.join(names)}"
            yield Finding(f"extra {extra}", FAULT, f"installed, but cannot be used: {trouble}", fix)
        else:
            yield Finding(f"extra {extra}", "ok", ", ".join(f"{name} {metadata.version(name)}" for name in names))


def _is_installed(name: str) -> bool:
    try:
        metadata.version(name)
    except metadata.PackageNotFoundError:
        return False
    return True


def _cannot_import(names: list[str]) -> str | None:
    """Import packages in a process of their own; return what that ends in, None where all is well."""
    program = "\n".join(_IMPORTS.get(name, f"import {name}") for name in names)
    try:
        done = subprocess.run(
            [sys.executable, "-c", program], capture_output=True, text=True, errors="replace", timeout=_PROBE_SECONDS
        )
    except subprocess.TimeoutExpired:
        return f"no answer within {_PROBE_SECONDS} seconds"
    if done.returncode < 0:
        return f"the process was ended with {signal.Signals(-done.returncode).name}: {_last_words(done)}"
    return _last_words(done) if done.returncode else None
