"""Paint as a study says: its filter, its encoding, its colour outside."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
from lenscl.imaging import Encoding, Painter, Picture, PictureCache, formats_of, light_of
from lenscl.imaging.encoding import decode, full_scale


def refused_format(picture: Picture, image_format: str) -> str | None:
    """Say why what is painted with a picture cannot be written in a format without loss; None if it can."""
    kind = picture.pixels.dtype
    fit = list(formats_of(kind))
    if kind.kind == "u":
        fit.append("exr")  # as linear light
    if image_format in fit:
        return None
    return f"output.format: {image_format} cannot hold the picture's {kind} without loss; use {' or '.join(fit)}"


def paint_as_told(
    painter: Painter, picture: Picture, scene: Scene, image_format: str = "", pictures: PictureCache | None = None
) -> tuple[NDArray[Any], Encoding]:
    """Return a picture seen through a traced scene, and the encoding of the pixels, which is the picture's own.

    EXR holds no integers: for the format "exr" they become linear light, before they are painted where the light of
    caustics or reflections may exceed white.

    The study's encoding, if it states one, stands in place of the one that the file claims. Its `picture.outside` is
    given as shares of full scale, 1 being white, so that it serves pictures of every depth; it becomes the nearest
    code.

    A picture without colour becomes RGB where the map has several wavelengths, as its edges may get colours.

    `pictures` keeps the picture on the device for the next map of the same kind.
    """
    screen = scene.picture
    encoding = screen.encoding or picture.encoding
    outside = np.asarray(screen.outside, dtype=np.float64)
    is_integer, is_exr = picture.pixels.dtype.kind == "u", image_format == "exr"
    as_light = is_integer and is_exr and _may_exceed_white(scene)
    in_colour = painter.has_wavelengths and picture.pixels.shape[2] < 3
    if as_light:
        outside = decode(outside, encoding)
    elif is_integer:
        outside = np.rint(outside * full_scale(picture.pixels.dtype))

    def pixels() -> NDArray[Any]:
        seen = _in_colour(picture.pixels) if in_colour else picture.pixels
        return light_of(seen, encoding) if as_light else seen

    if pictures is None:
        pictures = PictureCache(painter.film.device)
    content = (picture.digest, in_colour, encoding if as_light else None)
    there = pictures.get(content, pixels, "linear" if as_light else encoding)
    painted = painter.paint(there, filter=screen.filter, outside=outside)
    if as_light:
        return painted, "linear"
    if is_exr and is_integer:
        return light_of(painted, encoding), "linear"
    return painted, encoding


def _may_exceed_white(scene: Scene) -> bool:
    return bool(scene.effects["caustics"]) or scene.effects["fresnel"] == "split"


def _in_colour(pixels: NDArray[Any]) -> NDArray[Any]:
    """Return grey pixels (H, W, C) with three equal colours; their alpha stays behind those."""
    return np.concatenate([np.repeat(pixels[..., :1], 3, axis=2), pixels[..., 1:]], axis=2)
