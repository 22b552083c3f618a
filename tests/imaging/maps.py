"""Ray maps made by hand: what painting reads of a map, and no more."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.device import Device
from lenscl.status import RayStatus


@dataclass(frozen=True)
class HandMadeMap:
    st: NDArray[Any]
    status: NDArray[np.uint8]
    device: Device
    added: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    samples: Any = None
    caustic: Any = None
    scene: Any = field(default_factory=lambda: SimpleNamespace(environment="picture"))


def every_pixel(width: int, height: int) -> NDArray[np.float64]:
    """Places of a film that sees the picture as it is: the centres of its own pixels."""
    s, t = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    return np.stack([s, t], axis=-1)


def landing(st: NDArray[Any], device: Device, precision: str = "float64") -> HandMadeMap:
    """A map whose statuses follow from its places, as a tracer's do."""
    st = st.astype(precision)
    inside = ((st >= 0) & (st < 1)).all(axis=-1)
    status = np.where(inside, RayStatus.PICTURE, RayStatus.OFF_PICTURE).astype(np.uint8)
    return HandMadeMap(st, status, device)


def random_pixels(rng: np.random.Generator, shape: tuple[int, ...], dtype: str) -> NDArray[Any]:
    """Pixels over the whole range of a type, a fifth of them at its ends."""
    if np.dtype(dtype).kind == "u":
        most = np.iinfo(dtype).max
        pixels = rng.integers(0, most, shape, endpoint=True).astype(dtype)
        pixels[rng.random(shape) < 0.1] = most
        pixels[rng.random(shape) < 0.1] = 0
        return pixels
    return (rng.standard_normal(shape) * 2).astype(dtype)
