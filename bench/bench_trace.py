"""How long a ray takes, over the scenes of configs/bench, methods and precisions, by pytest-benchmark.

    pytest bench/bench_trace.py --benchmark-columns=min,median --benchmark-sort=name

`lenscl bench` measures the same without pytest. A row's extra_info is a `Measurement`: nanoseconds and slots a ray, the
ratio to the frozen kernel round by round, the error, the steps a search, the shares undecided and escalated, and the
circumstances. The seconds that pytest-benchmark shows are the host's, extra_info has the device's own. Compare rows of
one run with each other, and rows of two runs by `ratio` alone.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import pytest

from lenscl.accuracy.bench import ROUNDS, Bench, plan_rows, scene_files
from lenscl.device import choose


@pytest.fixture(scope="session")
def measuring() -> Bench:
    return Bench(choose())


@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("method", ["auto", "interval", "march"])
@pytest.mark.parametrize("name", scene_files())
def bench_trace(benchmark: Any, measuring: Bench, name: str, method: str, precision: Any) -> None:
    (row,), _ = plan_rows([name], [method], [precision], measuring.device)
    timing = measuring.timing(row)
    benchmark.pedantic(timing.once, setup=timing.beside, rounds=ROUNDS, iterations=1)
    timing.beside()
    measured = timing.measurement()
    benchmark.extra_info |= asdict(measured) | {"slots": measured.slots, "ratio": measured.ratio}
