"""A wanted accuracy: `numerics.accuracy = "0.05 px"`, or `"1e-9"` in scene units."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Literal, Self

_WRITTEN = re.compile(r"\s*([0-9.eE+-]{1,40})\s*(px)?\s*")


@dataclass(frozen=True, slots=True)
class Accuracy:
    """How far off rays may land, on the picture's plane.

    It is held against the 99 % quantile of the film's rays that meet a lens and land on that plane.

    Attributes
    ----------
    value : float
        Positive and finite.
    unit : "px" or "scene units"
        Pixels of the largest picture, the larger of both directions; or the distance on the plane.

    >>> Accuracy.read("0.05 px"), str(Accuracy.read("1e-9"))
    (Accuracy(value=0.05, unit='px'), '1e-09')
    """

    value: float
    unit: Literal["px", "scene units"]

    @classmethod
    def read(cls, text: str) -> Self | None:
        """Return what a text asks for, None where it asks for nothing that makes sense."""
        match = _WRITTEN.fullmatch(text)
        try:
            value = float(match[1]) if match else 0.0
        except ValueError:
            return None
        if not (value > 0.0 and math.isfinite(value)):
            return None
        return cls(value, "px" if match and match[2] else "scene units")

    def __str__(self) -> str:
        """Return it as a study has it: equal requests, equal texts."""
        return f"{self.value!r} px" if self.unit == "px" else repr(self.value)
