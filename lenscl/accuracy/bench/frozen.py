"""The frozen kernel: launched beside all that is timed, it takes the state of the machine out of a figure.

On shared machines seconds drift by tens of per cent within minutes; the ratio to a kernel that never changes and runs
just before and after holds to a few.
"""

from __future__ import annotations

import hashlib

import numpy as np

from lenscl.codegen import fragment
from lenscl.device import WIDEST, Device, Precision

FILE = "bench_reference.cl"
_SIDE = {"cpu": 512, "gpu": 2048}  # of its film, in pixels: neither a launch that is over at once nor a long wait
_SPAN = 0.8  # of the film, scene units: the torus fills about half


def frozen_key() -> str:
    """Return a digest of the frozen kernel: figures against another one are not to be compared."""
    return hashlib.sha256(fragment(FILE).encode()).hexdigest()[:12]


def frozen_text(precision: Precision, width: int) -> str:
    """Return the whole program; its head is its own, so that nothing else can change it."""
    real = "float" if precision == "single" else "double"
    return f"#define REAL {real}\n#define PACKET {real}{width if width > 1 else ''}\n{fragment(FILE)}"


class FrozenKernel:
    """The frozen kernel with its rays, on a device."""

    def __init__(self, device: Device, precision: Precision, side: int | None = None) -> None:
        self._side = side or _SIDE.get(device.kind, _SIDE["cpu"])
        width = min(device.width(precision), WIDEST)
        self._packets = self._side**2 // width
        self._program = device.build(frozen_text(precision, width), kind="bench")
        self._dtype = np.float32 if precision == "single" else np.float64
        film = [np.ascontiguousarray(each, self._dtype) for each in self.film()]
        self._ends = [device.empty(each.nbytes) for each in film]
        self._arguments = [*(device.upload(each) for each in film), *self._ends, np.int32(self._packets)]
        self._device = device

    def film(self) -> tuple[np.ndarray, np.ndarray]:
        """Return x and y of the film's points, z = 2.5, both of shape (side, side)."""
        centres = ((np.arange(self._side) + 0.5) / self._side - 0.5) * _SPAN
        x, y = np.meshgrid(centres, -centres)
        return x, y

    def seconds_a_ray(self, at_least: float = 0.0) -> float:
        """Launch it, again and again until it has run for some seconds; the device's own, for one ray of one launch."""
        seconds, launches = 0.0, 0
        while launches == 0 or seconds < at_least:
            seconds += self._program.run("reference", self._packets, self._arguments)
            launches += 1
        return seconds / launches / self._side**2

    def ends(self) -> np.ndarray:
        """Return where the rays met the plane z = -2.5, x and y, shape (2, side, side)."""
        seen = np.empty((2, self._side, self._side), self._dtype)
        for buffer, array in zip(self._ends, seen, strict=True):
            self._device.download(buffer, array)
        return seen
