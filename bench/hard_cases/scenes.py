"""Scenes of the hard cases, as study files have them."""

from __future__ import annotations

from typing import Any

import tomli_w

Table = dict[str, Any]

UNPLACED: Table = {}
PLACED: Table = {"centre": [0.3, -0.2, 0.1], "rotate": [25.0, -40.0, 110.0], "stretch": [0.9, 1.2, 0.8]}


def lens(surface: str, n: float = 1.5, **more: Any) -> Table:
    """Return a lens table."""
    return {"surface": surface, "n": n, **more}


def user(formula: str, half: float | list[float], n: float = 1.5, **more: Any) -> Table:
    """Return the lens table of an expression, whose solid lies within so much of the origin along x, y and z."""
    reach = [half] * 3 if isinstance(half, (int, float)) else half
    return lens(formula, n, bounds=[[-float(x) for x in reach], [float(x) for x in reach]], **more)


def scene(
    *lenses: Table,
    medium: float = 1.0,
    scale: float = 1.0,
    source: Table | None = None,
    film: Table | None = None,
    picture: Table | None = None,
    effects: Table | None = None,
    numerics: Table | None = None,
) -> str:
    """Return a study: the picture of side 8 lies below the lenses, at z = -3; all lengths of screens times `scale`."""

    def along(*v: float) -> list[float]:
        return [scale * x for x in v]

    tables: Table = {
        "source": source or {"at": along(0.0, 0.0, 4.0)},
        "film": film or {"corner": along(-1, 1, 2), "right": along(2, 0, 0), "down": along(0, -2, 0), "size": [8, 8]},
        "picture": picture or {"corner": along(-4, 4, -3), "right": along(8, 0, 0), "down": along(0, -8, 0)},
        "medium": {"n": medium},
        "lens": list(lenses),
        "numerics": {"max_events": 32, "step": 0.01 * scale, **(numerics or {})},
    }
    if effects:
        tables["effects"] = effects
    return tomli_w.dumps(tables)


SLAB = "max(abs(z) - 0.25, x^2 + y^2 - 4)"  # two planes and a rim
GYROID = "max(abs(sin(3*x)*cos(3*y) + sin(3*y)*cos(3*z) + sin(3*z)*cos(3*x)) - 0.3, x^2 + y^2 + z^2 - 1)"
