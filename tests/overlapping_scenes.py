"""Scenes of solids that overlap, touch or lie in one another, drawn at random: 2 to 4 lenses with priorities."""

from __future__ import annotations

from typing import Any

import numpy as np
from scenes import make_scene

from lenscl.config import Scene

_BOUNDS = [[-0.5] * 3, [0.5] * 3]
_SOLIDS: tuple[dict[str, Any], ...] = (
    {"surface": "sphere", "r": 0.3},
    {"surface": "sphere", "r": 0.45},
    {"surface": "torus", "R": 0.4, "r": 0.15},
    {"surface": "ellipsoid", "a": 0.5, "b": 0.3, "c": 0.4},
    {"surface": "biconvex"},
    {"surface": "max(abs(x), abs(y), abs(z)) - 0.3", "bounds": _BOUNDS},
    {"surface": "max(x^2 + y^2 - 0.09, abs(z) - 0.25)", "bounds": _BOUNDS},
    {"surface": "max(x^2 + y^2 + z^2 - 0.16, -z)", "bounds": _BOUNDS},
    {"surface": "x^4 + y^4 + z^4 - 0.03", "bounds": _BOUNDS},
    {"surface": "x^2 + y^2 + z^2 - 0.12 - 0.02*sin(9*x)*cos(7*y)", "bounds": _BOUNDS},
)


def overlapping_scene(seed: int) -> Scene:
    """Return the scene of a seed, on a film of 24 x 24."""
    rng = np.random.default_rng(seed)
    lenses = [_lens(rng, number) for number in range(rng.integers(2, 5))]
    effects: dict[str, Any] = {"total_reflection": str(rng.choice(["auto", "auto", "end"]))}
    if rng.random() < 0.3:
        effects["fresnel"] = True
    return make_scene(
        *lenses,
        source=_source(rng),
        film={"size": [24, 24], "right": [0.9, 0.0, 0.0], "down": [0.0, -0.9, 0.0]},
        medium=float(rng.choice([1.0, 1.0, 1.33])),
        effects=effects,
        numerics={"max_events": int(rng.choice([16, 16, 5])), "snell": "paraxial" if rng.random() < 0.1 else "exact"},
    )


def _lens(rng: np.random.Generator, number: int) -> dict[str, Any]:
    lens: dict[str, Any] = dict(_SOLIDS[rng.integers(len(_SOLIDS))])
    return lens | {
        "name": f"l{number}",
        "centre": rng.uniform(-0.3, 0.3, 3).round(2).tolist() if rng.random() < 0.7 else [0.0, 0.0, 0.0],
        "rotate": [float(angle) for angle in rng.choice([0, 0, 30, 45, 90], 3)],
        "n": float(rng.choice([1.0, 1.3, 1.5, 1.5, 1.7])),
        "priority": float(rng.choice([0, 0, 0, 1, 2, -1])),
        "absorbs": bool(rng.random() < 0.12),
    }


def _source(rng: np.random.Generator) -> dict[str, Any]:
    """Return a point above the lenses, parallel light, or a point that may lie in several of them."""
    kind = rng.random()
    if kind < 0.6:
        return {"kind": "point", "at": [*rng.uniform(-0.5, 0.5, 2).tolist(), 4.0]}
    if kind < 0.8:
        return {"kind": "parallel", "direction": [*rng.uniform(-0.2, 0.2, 2).tolist(), -1.0]}
    return {"kind": "point", "at": rng.uniform(-0.1, 0.1, 3).tolist()}


def solids_of(seed: int) -> Scene:
    """Return a scene of a sphere, a torus and an ellipsoid; there are three orders of priority, and else one form."""
    rng = np.random.default_rng(seed)
    solids: tuple[dict[str, Any], ...] = (
        {"surface": "sphere", "r": rng.uniform(0.2, 0.5)},
        {"surface": "torus", "R": rng.uniform(0.3, 0.5), "r": rng.uniform(0.05, 0.25)},
        {"surface": "ellipsoid", **dict(zip("abc", rng.uniform(0.2, 0.5, 3).tolist(), strict=True))},
    )
    priorities = ((0.0, 0.0, 0.0), (2.0, 1.0, 0.0), (0.0, 5.5, 0.0))[seed % 3]
    lenses = [
        solid | {
            "name": f"l{number}", "centre": rng.uniform(-0.2, 0.2, 3).tolist(), "priority": priorities[number],
            "n": float(rng.choice([1.0, 1.3, 1.5, 1.5, 1.7])),
        }
        for number, solid in enumerate(solids)
    ]  # fmt: skip
    return make_scene(
        *lenses,
        source={"kind": "point", "at": [0.0, 0.0, 4.0] if rng.random() < 0.7 else rng.uniform(-0.1, 0.1, 3).tolist()},
        film={"size": [7, 7], "right": [0.7, 0.0, 0.0], "down": [0.0, -0.7, 0.0]},
        effects={"total_reflection": "follow"},
    )
