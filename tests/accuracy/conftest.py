from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from lenscl.accuracy.bench import Circumstances, Error, Measurement, Quantiles, Run

Make = Callable[..., Measurement]


@pytest.fixture(scope="session")
def measurement() -> Make:
    """Make up a measurement, parts replaced as given; those of `Circumstances` too."""
    none = Quantiles(median=0.0, high=1e-12, largest=1e-11)
    error = Error(against="a friend", sampled=100, compared=99, differ=0.01, pixels=none, coordinates=none, floor=1e-13)
    circumstances = Circumstances(
        platform="Portable", device="a processor", driver="3.0", kind="cpu", units=2, width=8, rays=1024, state="warm",
        scene_key="0123456789ab", reference_key="ba9876543210", kernel_key="000011112222",
    )  # fmt: skip
    usual = Measurement(
        scene="torus-close", method="auto", precision="double", searches=("polynomial",), ns_least=80.0, ns_median=82.0,
        peak=1e11, ratios=(1.0,) * 9, error=error, steps=2.5, undecided=0.0, escalated=0.0, circumstances=circumstances,
    )  # fmt: skip

    def make(**changes: Any) -> Measurement:
        about = {name: changes.pop(name) for name in list(changes) if name in Circumstances.__slots__}
        return replace(usual, circumstances=replace(circumstances, **about), **changes)

    return make


@pytest.fixture(scope="session")
def run() -> Callable[..., Run]:
    def make(*measurements: Measurement) -> Run:
        return Run(program="lenscl 9 (abc)", made="2030-01-02T03:04:05+00:00", measurements=measurements)

    return make
