"""Scenes drawn at random: lenses of every kind that do not touch, all ways to end a ray, every method and effect."""

from __future__ import annotations

from typing import Any

import numpy as np
from scenes import CATALOGUE, make_scene

from lenscl.config import Scene

EXPRESSIONS = (  # with what bounds them
    ("x^4 + y^4 + z^4 - 0.3", 0.8),
    ("max(x^2 + y^2 - 0.25, abs(z) - 0.3)", 0.7),
    ("min((x - 0.35)^2 + y^2 + z^2 - 0.08, (x + 0.35)^2 + y^2 + z^2 - 0.08)", 0.8),
    ("max(x^2 + y^2 + z^2 - 0.36, 0.09 - x^2 - y^2)", 0.7),
    ("x^2 + y^2 + z^2 - 0.3 - 0.05*sin(9*x)*cos(7*y)", 0.8),
    ("max(abs(x), max(abs(y), abs(z))) - 0.4", 0.6),
    ("sqrt(x^2 + y^2 + 2*z^2) - 0.5", 0.7),
    ("exp(x^2 + y^2 + 2*z^2) - 1.4", 0.8),
    ("abs(x)^1.5 + abs(y)^1.5 + abs(z)^1.5 - 0.3", 0.7),
)
_CELLS = ((0, 0, 1), (0, 0, 0), (0, 0, -1), (0.95, 0, 0), (-0.95, 0, 0), (0, 0.95, 0))  # centres of lenses
_RADIUS = 0.46  # of the ball round a lens in its cell: none touches another


def random_scene(seed: int) -> Scene:
    """Return the scene of a seed: 1 to 4 lenses, four in ten of them opaque, on a film of 24 x 24."""
    rng = np.random.default_rng(seed)
    places = rng.permutation(len(_CELLS))
    count = rng.choice([1, 1, 2, 3, 4])
    lenses = [_lens(rng, number, _CELLS[places[number]]) for number in range(count)]
    effects = _effects(rng)
    if "dispersion" in effects:
        for lens in lenses:
            lens["n"] = str(rng.choice(["BK7", "SF11"])) if rng.random() < 0.7 else lens["n"]
    numerics = {
        "precision": str(rng.choice(["double", "double", "single", "mixed"])),
        "max_events": int(rng.choice([16, 64, 2, 5])),
        "snell": "paraxial" if rng.random() < 0.2 else "exact",
        "method": str(rng.choice(["auto", "auto", "auto", "interval", "march"])),
    }
    return make_scene(
        *lenses,
        source=_source(rng, lenses[0]["centre"]),
        film={"size": [24, 24], "right": [0.9, 0.0, 0.0], "down": [0.0, -0.9, 0.0]},
        picture={"corner": [-3.0, 3.0, -2.5] if rng.random() < 0.85 else [-3.0, 3.0, 5.0]},
        medium=float(rng.choice([1.0, 1.0, 1.33, 2.0])),
        effects=effects,
        numerics=numerics,
    )


def random_crowd(seed: int, count: int) -> Scene:
    """Return the scene of a seed: so many lenses as `random_scene` draws them, in a grid, in all of its forms."""
    rng = np.random.default_rng(seed)
    across = np.arange(-2, 3) * 0.5
    cells = np.stack(np.meshgrid(across, across, across[1:4]), axis=-1).reshape(-1, 3)
    lenses = [_lens(rng, number, cell) for number, cell in enumerate(rng.permutation(cells)[:count])]
    for lens in lenses:
        lens |= {"stretch": np.divide(lens["stretch"], 2.0).tolist(), "absorbs": bool(rng.random() < 0.15)}
        lens |= {"absorption": [0.5, float(rng.uniform(0.0, 3.0)), 0.0]} if rng.random() < 0.3 else {}
    effects = _effects(rng)
    if "dispersion" in effects:
        for lens in lenses:
            lens["n"] = str(rng.choice(["BK7", "SF11"])) if rng.random() < 0.7 else lens["n"]
    return make_scene(
        *lenses,
        source=_source(rng, lenses[0]["centre"]),
        film={"size": [40, 40], "right": [1.2, 0.0, 0.0], "down": [0.0, -1.2, 0.0]},
        effects=effects,
        medium=float(rng.choice([1.0, 1.0, 1.33, 2.0])),
        numerics={
            "precision": str(rng.choice(["double", "double", "single", "mixed"])),
            "max_events": int(rng.choice([16, 64, 5])),
            "snell": "paraxial" if rng.random() < 0.2 else "exact",
            "method": str(rng.choice(["auto", "auto", "auto", "interval", "march"])),
        },
    )


def _lens(rng: np.random.Generator, number: int, cell: tuple[float, float, float]) -> dict[str, Any]:
    lens: dict[str, Any] = {"surface": str(rng.choice(CATALOGUE))}
    if rng.random() < 0.35:
        formula, size = EXPRESSIONS[rng.integers(len(EXPRESSIONS))]
        lens = {"surface": formula, "bounds": [[-size] * 3, [size] * 3]}
    surface = make_scene(lens).lenses[0].surface
    box = np.abs(surface.box(make_scene(lens).lenses[0].values)).max(axis=0)
    squashed = rng.choice([1.0, 0.3, 0.05], size=3, p=[0.8, 0.15, 0.05])
    return lens | {
        "name": f"l{number}",
        "rotate": rng.uniform(-180.0, 180.0, 3).round(1).tolist() if rng.random() < 0.6 else [0.0, 0.0, 0.0],
        "n": float(rng.choice([1.5, 1.5, 1.8, 1.2, 1.0, 2.4])),
        "absorbs": bool(rng.random() < 0.4),
        "stretch": (squashed * _RADIUS / np.linalg.norm(box)).tolist(),
        "centre": np.add(cell, rng.uniform(-0.01, 0.01, 3)).tolist(),
    }


def _source(rng: np.random.Generator, within: list[float]) -> dict[str, Any]:
    """Return a point above the lenses, parallel light, or a point that may lie in the first lens."""
    kind = rng.random()
    if kind < 0.6:
        return {"kind": "point", "at": [*rng.uniform(-0.5, 0.5, 2).tolist(), 4.0]}
    if kind < 0.75:
        return {"kind": "parallel", "direction": [*rng.uniform(-0.2, 0.2, 2).tolist(), -1.0]}
    return {"kind": "point", "at": np.add(within, rng.uniform(-0.02, 0.02, 3)).tolist()}


def _effects(rng: np.random.Generator) -> dict[str, Any]:
    effects: dict[str, Any] = {"total_reflection": str(rng.choice(["auto", "end", "follow"]))}
    effects["absorption"] = ("auto", True, False)[rng.choice(3, p=[0.7, 0.2, 0.1])]
    if rng.random() < 0.3:
        effects["fresnel"] = ("split", "polarised", True)[rng.integers(3)]
    some = {"path_length": True, "dispersion": 3, "antialias": "edges", "footprint": True}
    return effects | {key: value for key, value in some.items() if rng.random() < 0.15}
