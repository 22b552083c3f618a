"""Rays through solids of the words that bend and jump, against dense samples by numpy of what their texts mean.

Where F goes on smoothly, every ray is decided, also across the borders of the cells that mod makes. Where F changes its
sign by a jump there is no surface: a ray that meets the jump is undecided, and any other is right.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import pytest
from faults_in_kernels import Fault, broken
from numpy.typing import NDArray
from probe import plain_device
from sampled import Sampled, field, off, sampled
from scenes import make_scene
from thinned import thinned

import lenscl
from lenscl import RayStatus

Array = NDArray[Any]
PRECISIONS = ("double", "single", "mixed")
CLOSE = {"double": 1e-6, "single": 2e-3, "mixed": 1e-6}  # of what sampling, by differences, can tell
RAYS, INDEX = 600, 1.3
FEW = 4  # events: what sampling is off by grows with each
BALL = "x^2 + y^2 + z^2 - 0.9"
CUBE = [[-1.1, -1.1, -1.1], [1.1, 1.1, 1.1]]


def cell(axis: str) -> str:
    return f"(mod({axis} + 0.25, 0.5) - 0.25)"


def wave(first: str, second: str) -> str:
    return f"sin(4*pi*mod({first}, 0.5))*cos(4*pi*mod({second}, 0.5))"


SMOOTH = {  # F; where it jumps at all it does not change its sign
    "arc sine": f"max({BALL}, 0.2 - asin(x)*z)",
    "cone": f"max({BALL}, acos(z/sqrt(x^2 + y^2 + z^2)) - 0.5)",
    "cone, its own sign form": f"max({BALL}, acos(z/sqrt(x^2 + y^2 + z^2)) - 0.6 - 0.1*sin(3*x))",
    "arc tangent": f"max({BALL}, atan(3*x) - 0.5*y - 0.1)",
    "catenoid": f"max({BALL}, sqrt(x^2 + y^2) - 0.3*cosh(z/0.3)/2)",
    "hyperbolic sine": f"max({BALL}, sinh(2*x) + y*sinh(2*z) - 0.3)",
    "gyroid of cells": f"max({BALL}, {wave('x', 'y')} + {wave('y', 'z')} + {wave('z', 'x')} - 0.2)",
    "sign of F": "sign(x^4 + y^4 + z^4 - 0.5)",
    "floor of F": "floor(x^2 + 2*y^2 + z^2) - 0.5",
    "sign of F, and 1": f"max({BALL}, sign(sinh(x) - y*z) + 0.5)",
    "power with a sign": f"max({BALL}, sign(x)*abs(x)^1.5 + z - 0.2)",
    "balls in cells": f"max({BALL}, {cell('x')}^2 + {cell('y')}^2 + {cell('z')}^2 - 0.04)",
}
JUMPING = {  # F; the share of rays that must be decided
    "two halves": (f"max({BALL}, y - 0.3*sign(x))", 0.6),
    "stairs": (f"max({BALL}, z - 0.25*floor(4*x))", 0.4),
    "slabs": (f"max({BALL}, mod(x, 0.4) - 0.2)", 0.1),
    "slabs, the other way": (f"max({BALL}, 0.3 - mod(-x, 0.7))", 0.2),
    "saw": (f"max({BALL}, z - mod(x + y, 0.5))", 0.3),
    "a wall between cells": (f"max({BALL}, {cell('x')} + {cell('y')})", 0.05),
    "a step within a step": (f"max({BALL}, floor(3*z - floor(2*x)) + 0.5)", 0.2),
    "a step of a step": (f"max({BALL}, floor(1.3*z*floor(3*x) + y) + x)", 0.2),
}
PLAIN = {  # what has the same sign where only that jumps, and slopes that differences tell
    "sign of F": "x^4 + y^4 + z^4 - 0.5",
    "floor of F": "x^2 + 2*y^2 + z^2 - 1",
    "sign of F, and 1": f"max({BALL}, sinh(x) - y*z)",
    "a step within a step": f"max({BALL}, 3*z - floor(2*x))",
}


def forms(names: Iterable[str]) -> list[Any]:
    """Return each name with each precision; always run are the first and last in all, the others in one of them."""
    every = list(names)
    kept = [(name, PRECISIONS[i % 3]) for i, name in enumerate(every)]
    kept += [(name, precision) for name in (every[0], every[-1]) for precision in PRECISIONS]
    return thinned(list(itertools.product(every, PRECISIONS)), kept)


@pytest.fixture(scope="module")
def rays() -> tuple[Array, Array]:
    """Return origins and unit directions: anywhere through the ball, every tenth along an axis."""
    rng = np.random.default_rng(0)
    through, direction = rng.uniform(-0.7, 0.7, (RAYS, 3)), rng.normal(size=(RAYS, 3))
    direction[::10] = np.eye(3)[rng.integers(0, 3, len(direction[::10]))]
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return through - 3.0 * direction, direction


def judged(text: str, precision: str, rays: tuple[Array, Array], told: Sampled) -> tuple[Array, Array]:
    """Return which rays are decided, and which of these sampling finds otherwise."""
    scene = make_scene({"surface": text, "bounds": CUBE, "n": INDEX}, numerics={"max_events": 32})
    paths = lenscl.trace_rays(scene, *rays, precision=precision, device=plain_device())
    decided = np.asarray(paths.status != RayStatus.UNDECIDED)
    apart = (off(told, paths.origin, paths.direction) > CLOSE[precision]) | (paths.events != told.events)
    met = (paths.events > 0) | (told.events > 0)
    return decided, decided & told.sure & met & apart & (told.events <= FEW)


@pytest.fixture(scope="module")
def told(rays: tuple[Array, Array]) -> Iterator[Any]:
    """Return a function from a name to where sampling sends the rays, each once."""
    found: dict[str, Sampled] = {}

    def of(name: str) -> Sampled:
        if name not in found:
            text = PLAIN.get(name) or (SMOOTH.get(name) or JUMPING[name][0])
            found[name] = sampled(field(text), *rays, INDEX, 0.96 if BALL in text else 1.2, samples=1200)
        return found[name]

    return of


@pytest.mark.parametrize(("name", "precision"), forms(SMOOTH))
def test_rays_through_what_goes_on_smoothly_are_decided_and_right(
    name: str, precision: str, rays: tuple[Array, Array], told: Any
) -> None:
    text = SMOOTH[name]
    decided, wrong = judged(text, precision, rays, told(name))
    met = told(name).events[told(name).sure]
    assert ((met > 0) & (met <= FEW)).sum() > 60
    assert decided.mean() > 0.995
    assert not wrong.any(), np.flatnonzero(wrong)


@pytest.mark.parametrize(("name", "precision"), forms(JUMPING))
def test_no_ray_takes_a_jump_for_a_surface(name: str, precision: str, rays: tuple[Array, Array], told: Any) -> None:
    text, share = JUMPING[name]
    decided, wrong = judged(text, precision, rays, told(name))
    assert share < decided.mean() < 0.95
    assert not wrong.any(), np.flatnonzero(wrong)


FAULTS = {  # each with a solid that shows it
    Fault("a jump that no slope shows", "interval_jumps.cl", "band_known(step.error < (realv)NUMBER(0.25), slope)",
          "slope"): "stairs",
    Fault("a step as a climb", "interval_jumps.cl", "{one, (realv)0, sure", "{one, sure ? (realv)0 : (realv)1, sure"):
        "two halves",
    Fault("one side of a jump alone", "interval_jumps.cl", "band_pick(same, first, both)", "first"): "slabs",
    Fault("a floor that is rounded", "jumps.cl", "near > a ? near - (realv)1 : near", "near"): "saw",
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_in_the_jumps_is_seen(fault: Fault, rays: tuple[Array, Array], told: Any) -> None:
    name = FAULTS[fault]
    with broken(fault):
        _, wrong = judged(JUMPING[name][0], "double", rays, told(name))
    assert wrong.any()
