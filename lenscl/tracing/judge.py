"""Trace rays by which others are judged, through the scene or through one that is moved by roundings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lenscl.config import Scene
from lenscl.device import Device
from lenscl.tracing.called import steering
from lenscl.tracing.job import Job, traced_rays
from lenscl.tracing.raymap import RayPaths

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Nudge:
    """How the lenses are moved, by so little that only first order counts.

    Attributes
    ----------
    turn : three numbers
        Each lens is turned about its own centre, by these angles (radians) about the world's axes.
    eta_in, eta_out : float
        By which part the ratios of indices grow, on entry and on exit; a ratio of exactly 1 stays.
    """

    turn: tuple[float, float, float]
    eta_in: float
    eta_out: float

    def of(self, numbers: Mapping[str, ArrayLike]) -> dict[str, ArrayLike]:
        """Return a scene's numbers, moved."""
        x, y, z = self.turn
        turned = np.eye(3) + np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        moved = dict(numbers)
        for name, value in numbers.items():
            match name.rpartition(".")[2]:
                case "to_world":
                    moved[name] = turned @ np.asarray(value)
                case "to_local":
                    moved[name] = np.asarray(value) @ turned.T
                case "eta_in" | "eta_out" as side if value != 1.0:
                    moved[name] = np.asarray(value) * (1.0 + getattr(self, side))
        return moved


def trace_to_judge(
    scene: Scene, points: Array, units: Array, device: Device | str | None = None, nudge: Nudge | None = None
) -> RayPaths:
    """Trace rays as `checked_rays` returns them in double, by method auto and the exact law, at the d line.

    The program counts as one of kind "judge" in `compile_count`.
    """
    scene = scene.at_d_line()
    exact = scene if scene.numerics.snell == "exact" else scene.replace({"numerics.snell": "exact"})
    job = Job.prepare(steering(exact), "given", "legs", "auto", "double", device, kind="judge")
    if nudge is not None:
        job.change_numbers(nudge.of)
    return traced_rays(job, points, units)
