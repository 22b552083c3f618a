"""What every combination costs on a device, measured once for a kind of scene and kept.

A calibration is of a structure: the kernel of a scene, whatever its numbers, on a device with a driver, by a version
of this program. Its times put the combinations in order; what decides between the nearest is timed again on the scene.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import platformdirs
from pydantic import Field, TypeAdapter, ValidationError

from lenscl.accuracy.combination import Combination
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.errors import LensclError
from lenscl.imaging.atomic import whole_file
from lenscl.tracing import RayMap, kernel_source, trace
from lenscl.version import program_version

_ROUNDS = (3, 40)  # at the least and at the most
_SECONDS = 0.1  # for a scene, after which the fewest rounds are enough


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """Nanoseconds a ray of each combination, the best of some rounds; and what they are times of."""

    about: dict[str, str]
    ns: tuple[tuple[Combination, Annotated[float, Field(gt=0, allow_inf_nan=False)]], ...]


_FORM = TypeAdapter(Calibration)


class CalibrationCache:
    """A folder of calibrations, one file each; it is made when the first is kept."""

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder or Path(platformdirs.user_cache_dir("lenscl", appauthor=False)) / "calibration"

    def get(self, about: dict[str, str]) -> Calibration | None:
        """Return what was kept for a structure, None where that is nothing, or not whole."""
        try:
            kept = _FORM.validate_json(self._path(about).read_bytes())
        except (OSError, ValidationError):
            return None
        return kept if kept.about == about else None

    def keep(self, calibration: Calibration) -> None:
        """Write a calibration down, whole or not at all.

        Raises
        ------
        LensclError
            If it cannot be written.
        """
        text = _FORM.dump_json(calibration, indent=1)
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise LensclError(
                f"{self.folder}: cannot be made: {error.strerror}; XDG_CACHE_HOME names another place for caches"
            ) from error
        with whole_file(self._path(calibration.about), len(text)) as temporary:
            temporary.write_bytes(text)

    def _path(self, about: dict[str, str]) -> Path:
        digest = hashlib.sha256(json.dumps(about, sort_keys=True).encode()).hexdigest()[:24]
        return self.folder / f"{digest}.json"


def key_of(scene: Scene, device: Device) -> dict[str, str]:
    """Return what a calibration hangs on: device, driver, version and kernel."""
    plain = Combination(method="auto").of(scene)
    return {
        **device.circumstances(),
        "units": str(device.units),
        "program": program_version(),
        "kernel": kernel_source(plain, device=device).key,
    }


def best_times(scenes: Sequence[Scene], device: Device) -> list[float]:
    """Trace scenes in turn; nanoseconds a ray, the best of the rounds, which a busy machine disturbs least.

    There are the more rounds the shorter the traces are: a moment's disturbance is then not all that is seen.
    """
    best = [float("inf")] * len(scenes)
    for scene in scenes:  # builds what is not built yet
        trace(scene, device=device)
    start, (fewest, most) = time.perf_counter(), _ROUNDS
    for turn in range(most):
        for number, scene in enumerate(scenes):
            raymap = trace(scene, device=device)
            best[number] = min(best[number], ns_of(raymap))
        if turn + 1 >= fewest and time.perf_counter() - start >= _SECONDS * len(scenes):
            break
    return best


def ns_of(raymap: RayMap) -> float:
    """Return the nanoseconds a ray that a map took, by the device's clock."""
    return raymap.trace_seconds / raymap.status.size * 1e9
