"""Scenes that several test modules share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import tomli_w

from lenscl import load_study, scene_from_toml
from lenscl.config import Scene

CONFIGS = Path(__file__).parent.parent / "configs"
SHAPES = ("sphere", "ellipsoid", "torus", "heart", "bifolia", "barth_sextic", "superellipsoid")
OPTICS = (
    *("biconvex", "plano_convex", "meniscus", "ball", "rod", "prism", "cone"),
    *("conic_singlet", "even_asphere_singlet"),
)
CATALOGUE = SHAPES + OPTICS


def make_scene(
    *lenses: dict[str, Any],
    source: dict[str, Any] | None = None,
    film: dict[str, Any] | None = None,
    picture: dict[str, Any] | None = None,
    medium: Any = 1.0,
    effects: dict[str, Any] | None = None,
    numerics: dict[str, Any] | None = None,
) -> Scene:
    """Return a scene that looks down the z axis from (0, 0, 4), parts replaced as given.

    The film faces z at z = 2.5, x to the right and y up, side 1.3; the picture likewise at z = -2.5, side 6.
    """
    tables = {
        "source": source or {"kind": "point", "at": [0.0, 0.0, 4.0]},
        "film": {"centre": [0.0, 0.0, 2.5], "right": [1.3, 0.0, 0.0], "down": [0.0, -1.3, 0.0], "size": [48, 48]}
        | (film or {}),
        "picture": {"corner": [-3.0, 3.0, -2.5], "right": [6.0, 0.0, 0.0], "down": [0.0, -6.0, 0.0]} | (picture or {}),
        "medium": {"n": medium},
        "lens": [{"n": 1.5} | lens for lens in lenses],
        "effects": effects or {},
        "numerics": {"max_events": 16} | (numerics or {}),
    }
    if "corner" in (film or {}):
        del tables["film"]["centre"]  # type: ignore[attr-defined]
    if "centre" in (picture or {}):
        del tables["picture"]["corner"]  # type: ignore[attr-defined]
    return scene_from_toml(tomli_w.dumps(tables))


def forerunner(name: str, size: int = 64) -> Scene:
    """Return a shipped study's scene, the forerunner's defaults, with a smaller film."""
    return load_study(CONFIGS / f"{name}.toml").scene.replace({"film.size": [size, size]})
