"""The table of effects, and which of their variants a scene calls for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True, slots=True, kw_only=True)
class Variant:
    """One form of an effect that a kernel can contain."""

    name: str  # also the file, kernels/effects/<name>.cl, and the function <name>() that it provides
    steers: bool  # True if it changes the ray, False if it only observes


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """One optional piece of physics: the values of its key, its variants, and when `auto` asks for it."""

    key: str
    default: str | bool
    variants: Mapping[str, Variant]  # by the value that asks for it
    auto: str | None = None  # the value that "auto" stands for; None where the key has no "auto"
    auto_reason: str = ""

    @property
    def choices(self) -> tuple[str, ...]:
        """The values its key takes."""
        return (*self.variants, *(("auto",) if self.auto else ()))


_ROWS = (
    Effect(
        key="total_reflection",
        default="auto",
        variants={
            "follow": Variant(name="follow_total_reflection", steers=True),
            "end": Variant(name="end_at_total_reflection", steers=True),
        },
        auto="follow",
        auto_reason="stays in until it is proved impossible",
    ),
)

EFFECTS: Mapping[str, Effect] = MappingProxyType({row.key: row for row in _ROWS})


def wanted(asked: Mapping[str, str | bool]) -> tuple[Variant, ...]:
    """Return the variants that a scene's `[effects]` calls for, in the order of the table.

    Parameters
    ----------
    asked : mapping
        Value by key; a key left out has its default, and False asks for nothing.
    """
    found = []
    for effect in EFFECTS.values():
        value = asked.get(effect.key, effect.default)
        if value == "auto" and effect.auto is not None:
            value = effect.auto
        if isinstance(value, str):
            found.append(effect.variants[value])
    return tuple(found)
