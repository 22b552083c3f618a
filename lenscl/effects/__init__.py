"""The registry of effects: optional physics, compiled in only when the scene calls for it.

An effect is data: the values its key in `[effects]` takes, and for each the kernel fragment that carries it out. What a
scene does not ask for leaves no text in its kernel.

>>> EFFECTS["total_reflection"].choices
('follow', 'end', 'auto')
>>> [output.name for output in EFFECTS["path_length"].variants[True].adds]
['path_length']
"""

from __future__ import annotations

from lenscl.effects.registry import EFFECTS, Effect, Hook, Output, Value, Variant, wanted

__all__ = ["EFFECTS", "Effect", "Hook", "Output", "Value", "Variant", "wanted"]
