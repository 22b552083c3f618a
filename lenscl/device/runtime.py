"""One device at work: its context and queue, built programs, buffers that stay alive, launches that are timed.

Launches use one fixed local size and no offset, for PoCL compiles a kernel anew for every local size and for a
non-zero offset. The global size is padded up, so a kernel must test its id against a count.
"""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lenscl.device.environment import opencl
from lenscl.errors import BuildError, NoDeviceError, TraceError

Precision: TypeAlias = Literal["single", "double"]
WIDEST = 16  # lanes of OpenCL's own vectors; packets may be wider

_LOCAL_SIZE = {"gpu": 64, "cpu": 8}  # work-items a group; a packet already fills a CPU's registers
_RUN = {"cpu": 16}  # what a packet's work-item reads is then read once for 16; a GPU wants them all at once
_built: Counter[str] = Counter()  # programs built in this process, by kind
_build_lock = threading.Lock()


def compile_count(kind: str = "trace") -> int:
    """Return the number of programs of a kind that were built in this process; reused programs do not count."""
    return _built[kind]


@dataclass(frozen=True, slots=True)
class Buffer:
    """Memory on a device; it lives as long as this object."""

    handle: Any = field(repr=False)
    nbytes: int


@dataclass(frozen=True)
class Device:
    """An OpenCL device, described; its context and queue are made when first used."""

    platform: str
    name: str
    driver: str
    kind: str  # "cpu", "gpu", "accelerator" or "other"
    has_double: bool
    widths: tuple[int, int]  # lanes of a packet in (single, double)
    handle: Any = field(repr=False, compare=False)
    build_options: tuple[str, ...] = ()  # that its compiler needs

    @property
    def label(self) -> str:
        """The name by which a user can ask for it."""
        return f"{self.platform}: {self.name}"

    @property
    def units(self) -> int:
        """Its compute units: cores of a CPU, multiprocessors of a GPU."""
        return int(self.handle.max_compute_units)

    def width(self, precision: Precision) -> int:
        """Return the lanes of a packet."""
        return self.widths[0] if precision == "single" else self.widths[1]

    @property
    def run(self) -> int:
        """Return the packets that a work-item should carry, one after the other."""
        return _RUN.get(self.kind, 1)

    def circumstances(self) -> dict[str, str]:
        """Return what must stand beside every figure measured here."""
        return {"platform": self.platform, "device": self.name, "driver": self.driver, "kind": self.kind}

    def upload(self, array: NDArray[Any]) -> Buffer:
        """Copy an array to new memory on the device."""
        array = np.ascontiguousarray(array)
        buffer = self.empty(array.nbytes)
        if array.nbytes:
            opencl().enqueue_copy(self._session.queue, buffer.handle, array, is_blocking=True)
        return buffer

    def constant(self, table: NDArray[Any]) -> Buffer:
        """Return a read-only array's copy on the device, uploaded when first asked for; both stay for good."""
        if table.flags.writeable:
            raise ValueError("a constant is read-only: its copy on the device does not follow changes")
        held = self._session.constants
        if id(table) not in held:
            held[id(table)] = (table, self.upload(table))
        return held[id(table)][1]

    def empty(self, nbytes: int) -> Buffer:
        """Reserve memory on the device, with whatever it holds.

        Raises
        ------
        TraceError
            If the device has not that much; the message gives both sizes.
        """
        cl = opencl()
        if nbytes > self.handle.max_mem_alloc_size:
            raise TraceError(
                f"{self.label}: {nbytes / 2**20:.0f} MiB were asked for in one piece, "
                f"{self.handle.max_mem_alloc_size / 2**20:.0f} MiB are possible; use a smaller picture or film"
            )
        try:
            handle = self._session.memory.allocate(max(nbytes, 1))
        except (cl.Error, MemoryError) as error:
            raise TraceError(f"{self.label}: no memory for {nbytes / 2**20:.0f} MiB: {error}") from error
        return Buffer(handle, nbytes)

    def download(self, buffer: Buffer, array: NDArray[Any]) -> None:
        """Copy the start of a buffer into a C-contiguous array."""
        if array.nbytes:
            opencl().enqueue_copy(self._session.queue, array, buffer.handle, is_blocking=True)

    def build(self, text: str, *, options: Sequence[str] = (), kind: str = "trace") -> Program:
        """Build OpenCL C text, or return the program built from the same text and options before.

        Raises
        ------
        BuildError
            If the driver refuses it; the message carries the driver's log.
        """
        session = self._session
        options = (*self.build_options, *options)
        key = (text, options)
        with _build_lock:
            if key not in session.programs:
                session.programs[key] = Program(self, session.build(text, options), session.queue)
                _built[kind] += 1
            return session.programs[key]

    @cached_property
    def _session(self) -> _Session:
        return _Session(self)


class Program:
    """A built program. Its kernels are made once; a launch holds them, for their arguments are state."""

    def __init__(self, device: Device, handle: Any, queue: Any) -> None:
        self.device = device
        self._handle, self._queue = handle, queue
        self._kernels: dict[str, Any] = {}
        self._lock = threading.Lock()

    def run(self, kernel_name: str, items: int, arguments: Sequence[Any]) -> float:
        """Run a kernel over at least `items` work-items and wait for it.

        Parameters
        ----------
        kernel_name : str
            A kernel of the program.
        items : int
            Work-items that have work; the launch is padded up to whole groups, ids from 0.
        arguments : sequence of Buffer or numpy scalar
            In the kernel's order.

        Returns
        -------
        float
            Seconds between the kernel's start and end by the device's own clock.
        """
        cl = opencl()
        local = _LOCAL_SIZE.get(self.device.kind, _LOCAL_SIZE["cpu"])
        padded = -(-max(items, 1) // local) * local
        with self._lock:
            try:
                if kernel_name not in self._kernels:
                    self._kernels[kernel_name] = cl.Kernel(self._handle, kernel_name)
                kernel = self._kernels[kernel_name]
                kernel.set_args(*(a.handle if isinstance(a, Buffer) else a for a in arguments))
                event = cl.enqueue_nd_range_kernel(self._queue, kernel, (padded,), (local,))
                event.wait()
            except cl.Error as error:
                raise TraceError(f"{self.device.label}: kernel {kernel_name} failed: {error}") from error
        return float(event.profile.end - event.profile.start) * 1e-9


class _Session:
    """What one process holds of one device."""

    def __init__(self, device: Device) -> None:
        cl = opencl()
        from pyopencl.tools import ImmediateAllocator, MemoryPool

        try:
            self.context = cl.Context([device.handle])
            properties = cl.command_queue_properties.PROFILING_ENABLE
            self.queue = cl.CommandQueue(self.context, properties=properties)
        except cl.Error as error:
            raise NoDeviceError(
                f"{device.label}: the driver refuses a context: {error}; try `lenscl doctor`"
            ) from error
        # Fresh memory is zeroed page by page as a kernel first writes to it: what one launch lets go, the next takes
        self.memory = MemoryPool(ImmediateAllocator(self.queue))
        self.programs: dict[tuple[str, tuple[str, ...]], Program] = {}
        self.constants: dict[int, tuple[NDArray[Any], Buffer]] = {}  # by id(), which the array keeps from reuse

    def build(self, text: str, options: Sequence[str]) -> Any:
        cl = opencl()
        try:
            return cl.Program(self.context, text).build(options=list(options), cache_dir=False)
        except cl.Error as error:
            raise BuildError(f"the driver refused a generated program:\n{error}") from error
