"""Ask for accuracies of random scenes over all surfaces; hold what the planner does against certified answers.

For every scene: is the 99 % error within the wish, by certified answers of some hundred rays that the planner did not
choose; and how does the time compare with the best of all combinations that are as accurate, timed in turn with it?

    python bench/validate_planner.py [SCENES [SEED]]
"""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from lenscl import scene_from_toml
from lenscl.accuracy import CalibrationCache, Combination, Planner
from lenscl.accuracy.achieved import wanted_of
from lenscl.accuracy.calibration import best_times
from lenscl.accuracy.combination import MARCH, every_combination
from lenscl.accuracy.judgement import MOST_DIFFER, judge
from lenscl.accuracy.sample import Sample
from lenscl.accuracy.truth import Truth
from lenscl.config import Scene
from lenscl.device import choose
from lenscl.errors import StudyError
from lenscl.lenses import catalogue
from lenscl.tracing import trace

FILM = 256  # a side
SLOW_FILM, SLOW = 96, 5e-6  # where a ray takes so many seconds
RAYS = {"many": 30, "edge": 60, "steep": 80, "lens": 400, "free": 30}
TRIES = 20  # of a scene that shows no lens
EXPRESSIONS = (
    "max(abs(sin(3*x)*cos(3*y) + sin(3*y)*cos(3*z) + sin(3*z)*cos(3*x)) - 0.3, x**2 + y**2 + z**2 - 1)",
    "x**4 + y**4 + z**4 - 0.5",
)


@dataclass(frozen=True)
class Outcome:
    """What came of one wish."""

    name: str
    wish: str
    chosen: str
    error: float
    differ: float
    rays: int
    ratio: float
    best: str
    planned: float
    is_met: bool


def random_scene(random: np.random.Generator, surface: str) -> Scene:
    """Return a scene that shows a lens of a surface, placed at random, with an accuracy of 1 to 1e-6 pixels."""
    for _ in range(TRIES):
        side = float(random.uniform(0.6, 1.6))
        lens: dict[str, Any] = {
            "surface": surface,
            "n": float(random.uniform(1.2, 2.2)),
            "rotate": random.uniform(-180, 180, 3).tolist(),
            "centre": random.uniform(-0.2, 0.2, 3).tolist(),
            "stretch": random.uniform(0.6, 1.2, 3).tolist(),
        }
        if surface in EXPRESSIONS:
            lens["bounds"] = [[-1.1] * 3, [1.1] * 3]
        scene = scene_from_toml(
            tomli_w.dumps(
                {
                    "source": {"at": [0.0, 0.0, float(random.uniform(3.0, 6.0))]},
                    "film": {"centre": [0.0, 0.0, 2.5], "right": [side, 0.0, 0.0], "down": [0.0, -side, 0.0],
                             "size": [FILM, FILM]},
                    "picture": {"centre": [0.0, 0.0, -2.5], "right": [6.0, 0.0, 0.0], "down": [0.0, -6.0, 0.0]},
                    "lens": [lens],
                    "numerics": {"accuracy": f"{10 ** random.uniform(-6, 0):.3g} px", "max_events": 32},
                }
            )
        )  # fmt: skip
        small = scene.replace({"film.size": [32, 32], "numerics.precision": "double"})
        seen = trace(small)
        if (seen.events > 0).mean() > 0.05:
            is_slow = seen.trace_seconds > SLOW * seen.status.size
            return scene.replace({"film.size": [SLOW_FILM, SLOW_FILM]}) if is_slow else scene
    raise SystemExit(f"{surface}: no scene of {TRIES} shows the lens")


def outcome(scene: Scene, name: str, folder: Path) -> Outcome:
    """Plan, trace, and judge."""
    device, wanted = choose(), wanted_of(scene)
    start = time.perf_counter()
    raymap, achieved = Planner(device, CalibrationCache(folder)).trace(scene)
    planned = time.perf_counter() - start
    assert achieved is not None
    chosen = achieved.combination
    certified = scene.replace({"numerics.precision": "double"})
    sample = Sample.of(trace(certified, device=device), RAYS)
    judgement = judge(raymap, Truth.certified(certified, sample.pixels), sample.drawn)

    # Whatever else is as accurate, by the error bounds of all rays; a march in finer steps of its step
    truth = Truth.bounded(certified, np.arange(raymap.status.size), device)
    others = [each for each in every_combination(scene, device) if each != chosen]
    coarse = [each for each in others if each.method == MARCH and each.step is not None and each.tolerance is None]
    others += [
        Combination(method=MARCH, precision=each.precision, step=each.step * part)
        for each in coarse
        for part in (0.8, 0.6, 0.4)
    ]
    good = []
    for each in others:
        found = judge(trace(each.of(scene), device=device), truth)
        if found.pixels.high.value <= wanted.value and found.differ.value <= MOST_DIFFER:
            good.append(each)
    times = best_times([each.of(scene) for each in (chosen, *good)], device)
    best = int(np.argmin(times))
    return Outcome(
        name=name, wish=str(wanted), chosen=str(chosen), error=judgement.pixels.high.value,
        differ=judge(raymap, truth).differ.value, rays=judgement.compared, ratio=times[0] / times[best],
        best=str((chosen, *good)[best]), planned=planned, is_met=judgement.pixels.high.value <= wanted.value,
    )  # fmt: skip


def main() -> None:
    """Print a line a scene, and what they come to."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    random = np.random.default_rng(int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    surfaces = [*catalogue(), *EXPRESSIONS]
    random.shuffle(surfaces)
    found: list[Outcome] = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            surface = surfaces[number % len(surfaces)]
            scene = random_scene(random, surface)
            name = surface if surface in catalogue() else f"{surface[:17]}..."
            try:
                one = outcome(scene, name, Path(folder))
            except StudyError as error:
                print(f"{name:22} {scene.numerics.accuracy!s:12} refused: {error}", flush=True)
                continue
            found.append(one)
            print(
                f"{one.name:22} {one.wish:12} {one.chosen:24} {one.error:9.2e} px {'met' if one.is_met else 'MISSED':6}"
                f" {100 * one.differ:7.4f} %  {one.ratio:5.2f} x {one.best:24} {one.planned:6.1f} s",
                flush=True,
            )
    met, near = sum(one.is_met for one in found), sum(one.ratio <= 1.3 for one in found)
    print(f"{met} of {len(found)} met; {near} within 1.3 of the best; largest ratio {max(o.ratio for o in found):.2f}")


if __name__ == "__main__":
    main()
