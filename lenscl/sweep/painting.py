"""Paint as a study says: its filter, its encoding, its colour outside."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.config import Scene
from lenscl.imaging import Encoding, Painter, Picture, formats_of, light_of
from lenscl.imaging.encoding import decode


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
    painter: Painter, picture: Picture, scene: Scene, image_format: str = ""
) -> tuple[NDArray[Any], Encoding]:
    """Return a picture seen through a traced scene, and the encoding of the pixels, which is the picture's own.

    EXR holds no integers: for the format "exr" they become linear light, before they are painted where the light of
    caustics or reflections may exceed white.

    The study's encoding, if it states one, stands in place of the one that the file claims. Its `picture.outside` is
    given as shares of full scale, 1 being white, so that it serves pictures of every depth; it becomes the nearest
    code.

    A picture without colour becomes RGB where the map has several wavelengths, as its edges may get colours.
    """
    screen = scene.picture
    encoding = screen.encoding or picture.encoding
    outside = np.asarray(screen.outside, dtype=np.float64)
    if picture.pixels.dtype.kind == "u":
        outside = np.rint(outside * np.iinfo(picture.pixels.dtype).max)
    pixels = _in_colour(picture.pixels) if painter.has_wavelengths else picture.pixels
    if image_format == "exr" and pixels.dtype.kind == "u" and _may_exceed_white(scene):
        outside = decode(np.asarray(screen.outside, dtype=np.float64), encoding)
        return painter.paint(
            light_of(pixels, encoding), filter=screen.filter, encoding="linear", outside=outside
        ), "linear"
    painted = painter.paint(pixels, filter=screen.filter, encoding=encoding, outside=outside)
    if image_format == "exr" and painted.dtype.kind == "u":
        return light_of(painted, encoding), "linear"
    return painted, encoding


def _may_exceed_white(scene: Scene) -> bool:
    return bool(scene.effects["caustics"]) or scene.effects["fresnel"] == "split"


def _in_colour(pixels: NDArray[Any]) -> NDArray[Any]:
    """Return pixels (H, W, C) with three channels of colour; a grey's alpha stays behind them."""
    if pixels.shape[2] > 2:
        return pixels
    return np.concatenate([np.repeat(pixels[..., :1], 3, axis=2), pixels[..., 1:]], axis=2)
