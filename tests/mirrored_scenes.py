"""Scenes with mirrors, drawn at random: lenses of every kind, apart or overlapping, some faces of which are mirrors."""

from __future__ import annotations

from typing import Any

import numpy as np
from scenes import make_scene

from lenscl.config import Scene
from lenscl.lenses import face_names

_BOUNDS = [[-0.6] * 3, [0.6] * 3]
_APART = ((0.0, 0.0, 0.0), (0.95, 0.0, -0.3), (-0.3, 0.95, 0.4))
_SOLIDS: tuple[dict[str, Any], ...] = (
    {"surface": "sphere", "r": 0.4},
    {"surface": "torus", "R": 0.3, "r": 0.12},
    {"surface": "biconvex", "diameter": 0.8, "R1": 0.7, "R2": 0.9, "thickness": 0.4},
    {"surface": "meniscus", "diameter": 0.7, "R1": 0.5, "R2": 0.9, "thickness": 0.3},
    {"surface": "rod", "diameter": 0.5, "length": 0.7},
    {"surface": "drum", "diameter": 0.5, "length": 0.8},
    {"surface": "cylindrical_singlet", "width": 0.5, "height": 0.5, "thickness": 0.3},
    {"surface": "box", "a": 0.5, "b": 0.4, "c": 0.6},
    {"surface": "prism", "side": 0.6, "length": 0.5},
    {"surface": "cone", "diameter": 0.7, "height": 0.4},
    {"surface": "brilliant", "diameter": 0.9},
    {"surface": "max(x^2 + y^2 - 0.09, abs(z) - 0.25)", "bounds": _BOUNDS},
    {"surface": "max(abs(x) - 0.3, abs(y) - 0.25, x + y + z - 0.3, -z - 0.3)", "bounds": [[-1, -1, -1], [1, 1, 1.2]]},
    {"surface": "max(x^2 + y^2 + z^2 - 0.16, 0.04 - x^2 - y^2)", "bounds": _BOUNDS},
    {"surface": "max(tanh(3*(x^2 + y^2 + z^2 - 0.16)), z - 0.1, exp(-z - 0.2) - 1)", "bounds": _BOUNDS},
    {"surface": "x^4 + y^4 + z^4 - 0.03", "bounds": _BOUNDS},
)  # fmt: skip


def mirrored_scene(seed: int) -> Scene:
    """Return the scene of a seed: 1 to 3 lenses, on a film of 24 x 24; every other one has solids that may overlap."""
    rng = np.random.default_rng(seed)
    overlaps = bool(seed % 2)
    lenses = [_lens(rng, number, overlaps) for number in range(rng.integers(2 if overlaps else 1, 4))]
    source: dict[str, Any] = {"kind": "point", "at": [*rng.uniform(-0.4, 0.4, 2).tolist(), 4.0]}
    if rng.random() < 0.3:
        source = {"kind": "point", "at": rng.uniform(-0.08, 0.08, 3).tolist()}  # inside a solid, mostly
    return make_scene(
        *lenses,
        source=source,
        film={"size": [24, 24], "right": [0.9, 0.0, 0.0], "down": [0.0, -0.9, 0.0]},
        picture={"corner": [-3.0, 3.0, float(rng.choice([-2.5, 5.0, 5.0]))]},
        medium=float(rng.choice([1.0, 1.0, 1.33])),
        effects={"total_reflection": str(rng.choice(["auto", "auto", "end"]))},
        numerics={"max_events": int(rng.choice([16, 16, 5]))},
    )


def _lens(rng: np.random.Generator, number: int, overlaps: bool) -> dict[str, Any]:
    lens: dict[str, Any] = dict(_SOLIDS[rng.integers(len(_SOLIDS))]) | {"name": f"l{number}"}
    names = face_names(make_scene(lens).lenses[0].surface)
    kind = rng.random()
    lens["absorbs"] = bool(rng.random() < 0.1)
    if kind < 0.25:
        lens |= {"mirror": True, "absorbs": False}
    elif kind < 0.85:
        chosen = rng.choice(names, rng.integers(1, max(2, len(names))), replace=False)
        lens["mirror"] = [str(name) for name in chosen]
    place = rng.uniform(-0.25, 0.25, 3).round(2) if overlaps else np.array(_APART[number])
    return lens | {
        "centre": place.tolist(),
        "rotate": [float(angle) for angle in rng.choice([0, 0, 30, 45, 90, 200], 3)],
        "n": float(rng.choice([1.0, 1.3, 1.5, 1.5, 1.7])),
        "priority": float(rng.choice([0, 0, 1, -1])) if overlaps else 0.0,
    }
