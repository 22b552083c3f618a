"""The registry of effects: optional physics, compiled in only when the scene calls for it.

An effect is data: the values its key in `[effects]` takes, and for each the kernel fragment that carries it out. What a
scene does not ask for leaves no text in its kernel.

>>> EFFECTS["total_reflection"].choices
('follow', 'end', 'auto')
>>> [output.name for variant in called({"path_length": True}, facts=()) for output in variant.adds]
['path_length']
"""

from __future__ import annotations

from lenscl.effects.registry import (
    EDGE_SAMPLES,
    EFFECTS,
    MOST_SAMPLES,
    NESTED,
    TOTAL,
    Effect,
    Fact,
    Hook,
    Output,
    Value,
    Variant,
    called,
)
from lenscl.effects.wavelengths import BAND, LISTED, RGB_LINES, VISIBLE, WAVELENGTH_LIMITS, is_seen, wavelengths_of

__all__ = [
    "BAND",
    "EDGE_SAMPLES",
    "EFFECTS",
    "LISTED",
    "MOST_SAMPLES",
    "NESTED",
    "RGB_LINES",
    "TOTAL",
    "VISIBLE",
    "WAVELENGTH_LIMITS",
    "Effect",
    "Fact",
    "Hook",
    "Output",
    "Value",
    "Variant",
    "called",
    "is_seen",
    "wavelengths_of",
]
