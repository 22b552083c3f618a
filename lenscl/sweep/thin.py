"""Parts of a lens that are thinner than a film pixel, as the film sees them: rays pass beside them, unseen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Lens, Scene
from lenscl.sweep.view import is_in_view, on_film
from lenscl.tracing import Placement

Array = NDArray[np.float64]

_RING = 64  # places on a torus's ring


def thinnest(scene: Scene, lens: Lens) -> float | None:
    """Return how wide a lens is at its thinnest, in film pixels, None where that is not in view.

    The thinnest way across its box, as the film sees it; of a torus also its tube, wherever the film looks at it.
    """
    widths = [width for width in (_box(scene, lens), _tube(scene, lens)) if width is not None]
    return min(widths, default=None)


def _box(scene: Scene, lens: Lens) -> float | None:
    placement = Placement.of(lens)
    corners = on_film(scene, placement.corners())
    low, high = corners.min(axis=0), corners.max(axis=0)
    if not ((high >= 0.0) & (low <= np.array(scene.film.size))).all():  # nor where a corner is NaN
        return None
    # Of a convex figure the least width lies across one of its sides
    first, second = np.triu_indices(len(corners), 1)
    sides = corners[second] - corners[first]
    lengths = np.linalg.norm(sides, axis=1)
    sides = sides[lengths > 0.0] / lengths[lengths > 0.0, None]
    widths = np.ptp(corners @ np.stack([-sides[:, 1], sides[:, 0]]), axis=0)
    return float(widths.min()) if len(widths) else 0.0


def _tube(scene: Scene, lens: Lens) -> float | None:
    if lens.surface.promised is not None or lens.surface.name != "torus":
        return None
    placement, R, r = Placement.of(lens), lens.values["R"], lens.values["r"]
    angles = 2.0 * np.pi * np.arange(_RING) / _RING
    zero, one = np.zeros(_RING), np.ones(_RING)
    outward = np.stack([np.cos(angles), np.sin(angles), zero], axis=1)
    around = np.stack([-np.sin(angles), np.cos(angles), zero], axis=1)
    up = np.stack([zero, zero, one], axis=1)
    ring = on_film(scene, placement.centre + R * outward @ placement.to_world.T)
    along, aside, above = (
        on_film(scene, placement.centre + (R * outward + r * way) @ placement.to_world.T) - ring
        for way in (around, outward, up)
    )
    # The tube's outline is that of the circle across it, measured across the ring
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
    with np.errstate(all="ignore"):
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        widths = 2.0 * np.hypot((aside * normal).sum(axis=1), (above * normal).sum(axis=1))
    seen = is_in_view(scene, ring) & np.isfinite(widths)
    return float(widths[seen].min()) if seen.any() else None
