"""What the shape of a lens makes hard, where the film looks at it."""

from __future__ import annotations

from collections.abc import Iterator

from lenscl.config import Scene
from lenscl.sweep.boxes import Points
from lenscl.sweep.creases import crease_points
from lenscl.sweep.fine import fine_share
from lenscl.sweep.singular import singular_points
from lenscl.sweep.thin import thinnest
from lenscl.sweep.view import place_in_view


def shape_spots(scene: Scene, number: int) -> Iterator[tuple[str, str]]:
    """Yield (kind, message) for what is hard about one lens's shape; places are the world's, pixels the film's."""
    lens = scene.lenses[number]
    if lens.surface.promised is None and lens.surface.name == "torus" and lens.values["r"] > lens.values["R"]:
        yield (
            "spindle",
            f"r = {lens.values['r']:g} is more than R = {lens.values['R']:g}: the ring has no hole, and is a spindle "
            "with two sunken tips on its axis",
        )
    if (width := thinnest(scene, lens)) is not None and width < 1.0:
        yield (
            "thin",
            f"at its thinnest it is {width:.2g} film pixels wide: rays pass beside it, between pixel centres; "
            "raise film.size, or let the film be smaller",
        )
    elif share := fine_share(scene, number):
        yield (
            "fine",
            f"about {share:.0%} of its inside is finer than a film pixel: which details rays meet is left to chance, "
            "and neighbours land anywhere; raise film.size, let the film be smaller, or the details larger",
        )
    if (where := _seen(scene, number, singular_points(lens))) is not None:
        yield (
            "singular",
            f"its surface has no normal, or turns within a few ten thousandths of its size, {where}; "
            "rays that meet it there within rounding end undecided, those beside it land far apart",
        )
    if (where := _seen(scene, number, crease_points(lens))) is not None:
        yield (
            "crease",
            f"a face bends sharply, by abs, min or max inside a function or a product, {where}; rays that meet the "
            "crease within rounding end undecided. As max or min of smooth faces it would be an edge, and known as one",
        )


def _seen(scene: Scene, number: int, points: Points) -> str | None:
    """Say where points of a lens are, and which film pixels look at them; None where none of them is in view."""
    if not points:
        return None
    place, in_view = place_in_view(scene, number, points)
    more = f", and at {in_view - 1} more in view" if in_view > 1 else ""
    return f"{place}{more}" if in_view else None
