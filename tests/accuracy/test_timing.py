"""What is timed stands between two launches of the frozen kernel, and says how it came about."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scenes import make_scene

from lenscl import RayStatus, trace
from lenscl.accuracy.bench import Bench, Expected, FrozenKernel, Row, Timing, timing
from lenscl.accuracy.bench.frozen import frozen_key
from lenscl.device import choose
from lenscl.tracing import count_steps

pytestmark = pytest.mark.users_kernels  # as the bench of a module is

SCENE = make_scene({"surface": "torus", "R": 0.7, "r": 0.25}, film={"size": [40, 30]})


def row(precision: str = "double", method: str = "auto") -> Row:
    return Row(name="small", scene=SCENE, method=method, precision=precision)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def measuring() -> Bench:
    return Bench(choose())


@pytest.mark.parametrize(
    ("precision", "method"), [("double", "auto"), ("single", "auto"), ("mixed", "auto"), ("double", "march")]
)
def test_a_row_says_what_was_measured_and_where(measuring: Bench, precision: str, method: str) -> None:
    measured = measuring.measure(row(precision, method), rounds=4)
    raymap = trace(SCENE, method=method, precision=precision)
    assert measured.row == ("small", method, precision)
    assert measured.searches == ("polynomial" if method == "auto" else "march",)
    about = measured.circumstances
    assert about.rays == 40 * 30
    assert about.kernel_key == raymap.kernel.key
    assert about.width == choose().width("single" if precision == "single" else "double")
    assert about.units == choose().units >= 1
    assert {name: getattr(about, name) for name in choose().circumstances()} == choose().circumstances()
    assert about.reference_key == frozen_key()
    assert len(measured.ratios) == 4
    assert 0 < measured.ns_least <= measured.ns_median
    assert measured.slots == pytest.approx(measured.ns_least * 1e-9 * measured.peak)
    assert measured.steps == count_steps(SCENE, method=method, precision=precision).mean > 1
    assert measured.error == Expected.of(SCENE).error_of(raymap)
    assert measured.undecided == (raymap.status == RayStatus.UNDECIDED).mean()
    assert measured.escalated == raymap.escalated / raymap.status.size


def test_scenes_are_told_apart_by_what_they_are(measuring: Bench) -> None:
    thicker = Row(name="small", scene=SCENE.replace({"lens.r": 0.3}), method="auto", precision="single")
    keys = [measuring.measure(each, rounds=1).circumstances.scene_key for each in (row("single"), thicker)]
    assert len(set(keys)) == 2


def test_what_rows_share_is_made_once(measuring: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    measuring.timing(row("single"))

    def fails(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr(Expected, "of", fails)
    monkeypatch.setattr(timing, "FrozenKernel", fails)
    measuring.timing(row("single", "march"))


class Told:
    """A frozen kernel and a tracer that take as long as they are told to, in turn."""

    def __init__(self, frozen: list[float], traced: list[float]) -> None:
        self.frozen, self.traced = iter(frozen), iter(traced)
        self.order: list[str] = []
        self.raymap = trace(SCENE)

    def seconds_a_ray(self, at_least: float = 0.0) -> float:
        self.order.append("frozen")
        return next(self.frozen)

    def trace(self, *_: object, **__: object) -> SimpleNamespace:
        self.order.append("traced")
        raymap = self.raymap
        return SimpleNamespace(
            trace_seconds=next(self.traced) * raymap.status.size,
            status=raymap.status,
            events=raymap.events,
            st=raymap.st,
            scene=raymap.scene,
            kernel=raymap.kernel,
            escalated=30,
        )


def told(monkeypatch: pytest.MonkeyPatch, frozen: list[float], traced: list[float]) -> tuple[Told, Timing]:
    """Return a timing on which two launches and a trace, to be warm, are spent already."""
    tale = Told([9.0, *frozen], [9.0, *traced])
    monkeypatch.setattr(timing, "trace", tale.trace)
    monkeypatch.setattr(timing, "multiply_add_peak", lambda *_, **__: 1e9)
    return tale, Timing(row(), choose(), tale, Expected.of(SCENE, 8))  # type: ignore[arg-type]


def test_launches_are_interleaved_and_each_is_paired_with_its_neighbours(monkeypatch: pytest.MonkeyPatch) -> None:
    tale, timed = told(monkeypatch, frozen=[1.0, 3.0, 5.0, 1.0], traced=[4.0, 2.0, 6.0])
    del tale.order[:]
    timed.beside()
    for _ in range(3):
        timed.once()
        timed.beside()
    assert tale.order == ["frozen", "traced"] * 3 + ["frozen"]
    measured = timed.measurement()
    assert measured.ratios == (4.0 / 2.0, 2.0 / 4.0, 6.0 / 3.0)
    assert (measured.ns_least, measured.ns_median) == (2e9, 4e9)
    assert measured.escalated == 30 / (40 * 30)


def test_a_machine_that_slows_down_cancels(monkeypatch: pytest.MonkeyPatch) -> None:
    speed = np.linspace(1.0, 2.0, 9)  # each launch is slower than the one before
    _, timed = told(monkeypatch, frozen=list(0.1 * speed[0::2]), traced=list(0.3 * speed[1::2]))
    timed.beside()
    for _ in range(4):
        timed.once()
        timed.beside()
    measured = timed.measurement()
    assert measured.ratios == pytest.approx((3.0,) * 4)
    assert measured.ns_median / measured.ns_least > 1.2


def test_the_frozen_kernel_runs_half_as_long_as_what_it_stands_beside(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def seconds_a_ray(self: FrozenKernel, at_least: float = 0.0) -> float:
        asked.append(at_least)
        return 1.0

    monkeypatch.setattr(FrozenKernel, "seconds_a_ray", seconds_a_ray)
    measuring = Bench(choose())
    monkeypatch.setattr(timing, "multiply_add_peak", lambda *_, **__: 1e9)
    timed = measuring.timing(row())
    timed.beside()
    assert asked == [0.0, timed._raymap.trace_seconds / 2]
