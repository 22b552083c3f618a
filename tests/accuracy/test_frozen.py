"""The kernel that everything timed is held against never changes, and does what it says."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import pytest
from scenes import make_scene

from lenscl import reference
from lenscl.accuracy.bench import FrozenKernel
from lenscl.accuracy.bench.frozen import frozen_text
from lenscl.device import Precision, choose

SIDE = 64


def test_the_frozen_kernel_is_frozen() -> None:
    """Saved figures are ratios to it: with another kernel under them they would all be worth nothing, silently.

    Whoever wants another one adds it under another name and keeps this.
    """
    path = Path(__file__).parent.parent.parent / "kernels" / "bench_reference.cl"
    assert (
        hashlib.sha256(path.read_bytes()).hexdigest()
        == "c420605759fccc70d6128a1b11bca3d7c78b5e278d028f02869efdc6c385bc03"
    )


@pytest.mark.parametrize(
    ("precision", "width", "packet"),
    [("single", 16, "float16"), ("single", 1, "float"), ("double", 8, "double8"), ("double", 1, "double")],
)
def test_its_program_is_the_file_behind_two_lines_and_nothing_else(
    precision: Precision, width: int, packet: str
) -> None:
    head, packets, rest = frozen_text(precision, width).split("\n", 2)
    assert (head, packets) == (f"#define REAL {packet.rstrip('0123456789')}", f"#define PACKET {packet}")
    assert rest == (Path(__file__).parent.parent.parent / "kernels" / "bench_reference.cl").read_text()
    assert "#include" not in rest


def share_that_lands_elsewhere(precision: Precision, tolerance: float, R: float) -> float:
    """Return the share of rays that the float64 twin, which marches too, sees land elsewhere.

    Of those that meet the torus, of a ring R, twice and without total reflection: the kernel stops after two surfaces.
    """
    frozen = FrozenKernel(choose(), precision, SIDE)
    assert frozen.seconds_a_ray() > 0
    x, y = (each.ravel() for each in frozen.film())
    directions = np.stack([x, y, np.full(SIDE**2, -1.5)], axis=1)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    scene = make_scene({"surface": "torus", "R": R, "r": 0.25}, numerics={"step": 0.01})
    twin = reference.trace_rays(scene, np.tile([0.0, 0.0, 4.0], (SIDE**2, 1)), directions)
    plain = (twin.events == 2) & (twin.total == 0)
    assert plain.sum() > 0.4 * SIDE**2
    far = (-2.5 - twin.origin[:, 2]) / twin.direction[:, 2]
    expected = twin.origin + far[:, None] * twin.direction
    seen = frozen.ends().reshape(2, -1).T
    return float((np.abs(seen - expected[:, :2]).max(axis=1) > tolerance)[plain | (twin.events == 0)].mean())


@pytest.mark.parametrize(("precision", "tolerance"), [("double", 1e-10), ("single", 1e-3)])
def test_it_traces_a_torus(precision: Precision, tolerance: float) -> None:
    """All but the rays that graze: there the last bit of a normal decides where one goes."""
    assert share_that_lands_elsewhere(precision, tolerance, 0.75) < 0.005
    assert share_that_lands_elsewhere(precision, tolerance, 0.751) > 0.3


def test_it_runs_again_until_it_has_run_long_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    frozen = FrozenKernel(choose(), "single", SIDE)
    launches = []

    def run(*_: object) -> float:
        launches.append(1)
        return 0.25

    monkeypatch.setattr(frozen._program, "run", run)
    assert frozen.seconds_a_ray() == 0.25 / SIDE**2
    assert len(launches) == 1
    assert frozen.seconds_a_ray(at_least=1.0) == 0.25 / SIDE**2
    assert len(launches) == 1 + 4
