"""Time rows: launches of the frozen kernel before, between and after those of the trace."""

from __future__ import annotations

import hashlib
from itertools import pairwise

from lenscl.accuracy.bench.error import Expected
from lenscl.accuracy.bench.frozen import FrozenKernel, frozen_key
from lenscl.accuracy.bench.measurement import Circumstances, Measurement
from lenscl.accuracy.bench.peak import multiply_add_peak
from lenscl.accuracy.bench.scenes import Row
from lenscl.accuracy.statistics import median
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.status import RayStatus
from lenscl.tracing import count_steps, trace

ROUNDS = 9  # at the least of a figure that is to be believed
_BESIDE = 0.5  # of a trace's time: for so long the frozen kernel runs on either side, to meet the same disturbances


class Bench:
    """Measures rows one after another on one device; what they share is made once."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self._frozen: dict[str, FrozenKernel] = {}
        self._expected: dict[Scene, Expected] = {}

    def measure(self, row: Row, rounds: int = ROUNDS) -> Measurement:
        """Return a row's time and error.

        Raises
        ------
        StudyError, BuildError, TraceError
            If the scene cannot be traced so.
        """
        timing = self.timing(row)
        timing.beside()
        for _ in range(rounds):
            timing.once()
            timing.beside()
        return timing.measurement()

    def timing(self, row: Row) -> Timing:
        """Return a row made ready, for those who count the rounds themselves."""
        if row.carried not in self._frozen:
            self._frozen[row.carried] = FrozenKernel(self.device, row.carried)
        if row.scene not in self._expected:
            self._expected[row.scene] = Expected.of(row.scene)
        return Timing(row, self.device, self._frozen[row.carried], self._expected[row.scene])


class Timing:
    """The samples of one row: `beside`, `once`, `beside`, `once`, ..., `beside`, and then `measurement`.

    It begins warm: everything was built and run once.
    """

    def __init__(self, row: Row, device: Device, frozen: FrozenKernel, expected: Expected) -> None:
        self._row, self._device, self._frozen, self._expected = row, device, frozen, expected
        self._raymap = trace(row.scene, method=row.method, precision=row.precision, device=device)
        self._frozen_seconds = _BESIDE * self._raymap.trace_seconds
        self._peak = multiply_add_peak(device, row.carried)
        frozen.seconds_a_ray()
        self._between: list[float] = []
        self._seconds: list[float] = []

    def once(self) -> None:
        """Trace once more."""
        row = self._row
        self._raymap = trace(row.scene, method=row.method, precision=row.precision, device=self._device)
        self._seconds.append(self._raymap.trace_seconds / self._raymap.status.size)

    def beside(self) -> None:
        """Run what is not timed for itself: the frozen kernel, and the peak's.

        The least time and the peak are both the best of many moments, and so are sought in the same ones.
        """
        self._between.append(self._frozen.seconds_a_ray(self._frozen_seconds))
        self._peak = max(self._peak, multiply_add_peak(self._device, self._row.carried, tries=1))

    def measurement(self) -> Measurement:
        """Return what the rounds have given; at least one, and each between two of `beside`."""
        raymap, seconds = self._raymap, self._seconds
        frozen = [(before + after) / 2 for before, after in pairwise(self._between)]
        structure = raymap.kernel.structure
        return Measurement(
            scene=self._row.name,
            method=self._row.method,
            precision=self._row.precision,
            searches=tuple(method.name for method in structure.methods.values()),
            ns_least=min(seconds) * 1e9,
            ns_median=median(seconds) * 1e9,
            peak=self._peak,
            ratios=tuple(own / beside for own, beside in zip(seconds, frozen, strict=True)),
            steps=count_steps(
                self._row.scene, method=self._row.method, precision=self._row.precision, device=self._device
            ).mean,
            error=self._expected.error_of(raymap),
            undecided=float((raymap.status == RayStatus.UNDECIDED).mean()),
            escalated=raymap.escalated / raymap.status.size,
            circumstances=Circumstances(
                **self._device.circumstances(),
                units=self._device.units,
                width=structure.width,
                rays=raymap.status.size,
                state="warm",
                scene_key=hashlib.sha256(self._row.scene.to_toml().encode()).hexdigest()[:12],
                reference_key=frozen_key(),
                kernel_key=raymap.kernel.key,
            ),
        )
