"""Call a single kernel step from Python: one small kernel around a few fragments."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl import device
from lenscl.codegen import VOCABULARY, fragment, head
from lenscl.status import RayStatus

REALS: dict[str, Any] = {"single": np.float32, "double": np.float64}
FORMS = [(p, w) for p, widths in (("single", (1, 4, 8, 16, 32)), ("double", (1, 2, 8, 16))) for w in widths]


PLAIN = ("-cl-opt-disable",)


def of_width(here: device.Device, single: int, double: int) -> device.Device:
    """Return a device with packets of other widths."""
    options = (*here.build_options, *quiet(here, single, double))
    return replace(here, widths=(single, double), build_options=options)


def quiet(here: device.Device, single: int, double: int) -> tuple[str, ...]:
    """Return the options for packets wider than a device's own.

    Clang warns of vectors wider than the registers, for code compiled for wider registers takes them another way; all
    that a kernel calls is compiled for the same.
    """
    return ("-w",) if single > here.widths[0] or double > here.widths[1] else ()


@cache
def users_device() -> device.Device:
    """Return the device that is chosen unasked outside tests; see `conftest.plain_kernels`."""
    return device.choose()


@cache
def optimised_device(single: int, double: int) -> device.Device:
    """Return this machine's device with packets of other widths: the same one each time, with what it has built."""
    return of_width(users_device(), single, double)


@cache
def plain_device(single: int = 4, double: int | None = None) -> device.Device:
    """Return this machine's device as it compiles in a fourth of the time: few lanes, and nothing optimised.

    What is optimised ends alike (see kernels/test_determinism.py). Packets in double are as wide as in single unless
    told.
    """
    here = optimised_device(single, single if double is None else double)
    return replace(here, build_options=(*here.build_options, *PLAIN))


@dataclass(frozen=True)
class Probe:
    """A step of the kernels as a function of arrays.

    `body` computes `out_0 ... ` from `in_0 ...`, all realv; `before` is C text put before the fragments. A plain one is
    not optimised.
    """

    fragments: tuple[str, ...]
    body: str
    inputs: int
    outputs: int
    precision: str
    width: int
    before: str = ""
    is_plain: bool = False

    @cached_property
    def _program(self) -> device.Program:
        reads = "\n".join(
            f"  const realv in_{i} = gather(in + first * {self.inputs} + {i}, {self.inputs});"
            for i in range(self.inputs)
        )
        declares = "\n".join(f"  realv out_{i} = (realv)0;" for i in range(self.outputs))
        writes = "\n".join(
            f"  scatter(out_{i}, out + first * {self.outputs} + {i}, {self.outputs});" for i in range(self.outputs)
        )
        text = "\n".join(
            [
                head(self.precision, self.width),  # type: ignore[arg-type]
                "".join(f"#define RAY_{status.name} {status.value}\n" for status in RayStatus),
                *(fragment(name) for name in VOCABULARY),
                self.before,
                *(fragment(name) for name in self.fragments),
                "kernel void probe(global const real *restrict in, global real *restrict out, const int count) {",
                "  const int first = (int)get_global_id(0) * VW;",
                "  if (first >= count) return;",
                reads,
                declares,
                self.body,
                writes,
                "}",
            ]
        )
        here = users_device()
        options = (*(PLAIN if self.is_plain else ()), *quiet(here, self.width, self.width))
        return here.build(text, options=options, kind="probe")

    def __call__(self, *columns: ArrayLike) -> NDArray[np.float64]:
        """Return shape (N, outputs) for inputs of N numbers each; N is padded to whole packets."""
        here = users_device()
        dtype = REALS[self.precision]
        rows = np.stack(np.broadcast_arrays(*columns), axis=-1).reshape(-1, self.inputs)
        count = len(rows)
        padded = np.concatenate([rows, np.repeat(rows[-1:], -count % self.width, axis=0)]).astype(dtype)
        out = here.empty(len(padded) * self.outputs * dtype().itemsize)
        self._program.run("probe", len(padded) // self.width, [here.upload(padded), out, np.int32(len(padded))])
        result = np.empty((len(padded), self.outputs), dtype)
        here.download(out, result)
        return result[:count].astype(np.float64)
