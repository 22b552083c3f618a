"""How long a ray takes, over the scenes of configs/bench, methods and precisions.

    pytest bench/bench_trace.py --benchmark-columns=min,median --benchmark-sort=name

A row's extra_info has what a figure needs to be believed: nanoseconds and slots a ray (seconds a ray times the device's
multiply-add peak, measured beside it), the share undecided, the error against `march` in double at a fine step, and
the circumstances. Warm: the kernel is built and run once before. Timings of other runs are not to be compared with
these; compare the rows of one run.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lenscl import RayStatus, load_study, trace
from lenscl.accuracy import multiply_add_peak
from lenscl.device import choose

SCENES = sorted((Path(__file__).parent.parent / "configs" / "bench").glob("*.toml"))
ROUNDS = 9
FINE_STEP = 1e-3


@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("method", ["auto", "interval", "march"])
@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def bench_trace(benchmark: Any, path: Path, method: str, precision: str) -> None:
    scene = load_study(path).scene
    raymap = trace(scene, method=method, precision=precision)  # warm
    seconds: list[float] = []

    def once() -> None:
        seconds.append(trace(scene, method=method, precision=precision).trace_seconds)

    benchmark.pedantic(once, rounds=ROUNDS, iterations=1)
    rays = raymap.status.size
    peak = multiply_add_peak(choose(), precision)  # type: ignore[arg-type]
    benchmark.extra_info |= choose().circumstances() | {
        "rays": rays,
        "width": raymap.kernel.structure.width,
        "kernel": raymap.kernel.key,
        "methods": [row.name for row in raymap.kernel.structure.methods],
        "ns_per_ray_min": min(seconds) / rays * 1e9,
        "ns_per_ray_median": float(np.median(seconds)) / rays * 1e9,
        "peak_gflops": peak / 1e9,
        "slots_per_ray": min(seconds) / rays * peak,
        "undecided": int((raymap.status == RayStatus.UNDECIDED).sum()),
        "escalated": raymap.escalated,
        **_error(scene, raymap),
    }


def _error(scene: Any, raymap: Any) -> dict[str, float]:
    """Compare with a fine march on a smaller film, ray by ray, in picture coordinates."""
    small = scene.replace({"film.size": [128, 128]})
    truth = trace(small.replace({"numerics.step": FINE_STEP}), method="march", precision="double")
    structure = raymap.kernel.structure
    seen = trace(small, method=structure.methods[0].name, precision=structure.precision)
    same = (seen.events == truth.events) & (truth.events > 0)
    error = np.abs(seen.st - truth.st).max(axis=-1)[same]
    return {
        "error_median": float(np.median(error)),
        "error_99": float(np.quantile(error, 0.99)),
        "events_differ": float((seen.events != truth.events).mean()),
    }
