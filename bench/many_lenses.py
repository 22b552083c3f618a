"""Time scenes of very many balls against one ball on the same film, interleaved in one process.

    python bench/many_lenses.py [ROUNDS [PRECISION]]

Prints, for every scene, the time a ray as a multiple of the single ball's, by the device's clock and by the processor
time of this process, each the median of the rounds; and the processor time that text, compiling and the first small map
take. On a busy machine only processor time means anything.

On 2026-12-01, two busy cores of an AMD EPYC, PoCL 3.0, 65,536 rays, by processor time, in double and single: 32 x 32
balls side by side 4 and 5; 1,000 balls strewn in a cube, a twentieth of its side across, 35 and 28; 10 x 10 x 10
balls that nearly touch 73 and 59: a ray meets 12.8 surfaces there, 1.9 at the single ball. Rays in a heap of balls go
apart, and each has boxes of its own.
"""

from __future__ import annotations

import sys
import time
from statistics import median
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray

from lenscl import scene_from_toml
from lenscl.config import Scene
from lenscl.tracing.job import Job

Array = NDArray[np.float64]
_SIDE = 256  # pixels


def balls(places: Array, radius: float, precision: str, side: int = _SIDE) -> Scene:
    """Return balls on a film that [-1, 1] fills."""
    study: dict[str, Any] = {
        "source": {"kind": "point", "at": [0.0, 0.0, 6.0]},
        "film": {"centre": [0.0, 0.0, 2.5], "right": [1.0, 0.0, 0.0], "down": [0.0, -1.0, 0.0], "size": [side, side]},
        "picture": {"corner": [-3.0, 3.0, -2.5], "right": [6.0, 0.0, 0.0], "down": [0.0, -6.0, 0.0]},
        "medium": {"n": 1.0},
        "lens": [
            {"surface": "sphere", "name": f"b{i}", "r": radius, "n": 1.5, "centre": place}
            for i, place in enumerate(places.tolist())
        ],
        "numerics": {"precision": precision, "max_events": 64},
    }
    return scene_from_toml(tomli_w.dumps(study))


def grid(*shape: int) -> Array:
    """Return places in a grid, [-1, 1] wide."""
    lines = [(np.arange(count) - (count - 1) / 2) * (2.0 / shape[0]) for count in shape]
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)


def strewn(count: int, radius: float) -> Array:
    """Return places in [-1, 1]^3 of balls that do not touch."""
    rng, places = np.random.default_rng(1), np.zeros((0, 3))
    while len(places) < count:
        place = rng.uniform(radius - 1.0, 1.0 - radius, 3)
        if (np.linalg.norm(places - place, axis=1) > 2.02 * radius).all():
            places = np.vstack([places, place])
    return places


def timed(job: Job) -> tuple[float, float]:
    """Return seconds of the device's clock and of processor time that a film takes."""
    before, began = job.record()["trace_seconds"], time.process_time()
    job.run_film()
    return job.record()["trace_seconds"] - before, time.process_time() - began


def main() -> None:
    """Print the ratios."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 9
    precision = sys.argv[2] if len(sys.argv) > 2 else "double"
    kinds = {
        "one": (np.zeros((1, 3)), 1.0),
        "32 x 32": (grid(32, 32, 1), 0.028),
        "1000 strewn": (strewn(1000, 0.05), 0.05),
        "10 x 10 x 10": (grid(10, 10, 10), 0.09),
    }
    jobs: dict[str, Job] = {}
    for name, (places, radius) in kinds.items():
        began = time.process_time()
        Job.prepare(balls(places, radius, precision, 8), "point", "map", None, None, None).run_film()
        print(f"{name:14s} {len(places):5d} lenses, first map {time.process_time() - began:.2f} s of processor time")
        jobs[name] = Job.prepare(balls(places, radius, precision), "point", "map", None, None, None)
        jobs[name].run_film()
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in kinds}
    for _ in range(rounds):
        for name, job in jobs.items():
            found[name].append(timed(job))
    for name, times in found.items():
        ratios = [
            tuple(a / b for a, b in zip(own, one, strict=True)) for own, one in zip(times, found["one"], strict=True)
        ]
        clock, processor = (median(each) for each in zip(*ratios, strict=True))
        print(f"{name:14s} {clock:7.1f} times by the clock, {processor:7.1f} by processor time")


if __name__ == "__main__":
    main()
