"""The table of effects, and which of their variants a scene calls for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

Value = str | bool  # of a key in [effects]
# Where a kernel calls a variant: on a ray's start, behind a surface that it has met, on the picture's plane
Hook = Literal["start", "interface", "picture"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Output:
    """An array that an effect adds to a ray map.

    Attributes
    ----------
    name : str
        The map's attribute, and the kernel's buffer.
    members : tuple of str
        The members of a ray that it is written from, one number each; a single one makes an array of (rows, columns),
        several one of (rows, columns, N).
    meaning : str
        With its unit.
    """

    name: str
    members: tuple[str, ...]
    meaning: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Variant:
    """One form of an effect that a kernel can contain.

    Attributes
    ----------
    name : str
        Also the file, kernels/effects/<name>.cl. It provides a function for each hook: <name>_start(ray, scene),
        <name>_interface(ray, at, scene), <name>_picture(ray, place, scene).
    steers : bool
        Whether it changes where a ray goes or how it ends; else it only observes.
    hooks : tuple of str
        Where it is called.
    carries : tuple of str
        The numbers that a ray carries for it, members of ray_t.
    adds : tuple of Output
    """

    name: str
    steers: bool
    hooks: tuple[Hook, ...] = ("interface",)
    carries: tuple[str, ...] = ()
    adds: tuple[Output, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """One optional piece of physics: the values of its key, its variants, and when `auto` asks for it.

    A value without a variant asks for nothing.
    """

    key: str
    default: Value
    variants: Mapping[Value, Variant]  # by the value that asks for it
    auto: str | None = None  # the value that "auto" stands for; None where the key has no "auto"
    auto_reason: str = ""

    @property
    def choices(self) -> tuple[Value, ...]:
        """The values its key takes."""
        nothing = () if self.default in self.variants or self.default == "auto" else (self.default,)
        return (*nothing, *self.variants, *(("auto",) if self.auto else ()))


_TRANSMITTANCE = Output(
    name="transmittance",
    members=("transmittance",),
    meaning="share of the light's power that is refracted at every surface but where it is totally reflected",
)
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
    Effect(
        key="fresnel",
        default=False,
        variants={
            True: Variant(
                name="fresnel",
                steers=False,
                hooks=("start", "interface"),
                carries=("transmittance",),
                adds=(_TRANSMITTANCE,),
            ),
            "polarised": Variant(
                name="fresnel_polarised",
                steers=False,
                hooks=("start", "interface"),
                carries=(
                    *("transmittance", "polarised_q", "polarised_u", "polarised_v"),
                    *("across_x", "across_y", "across_z"),
                ),
                adds=(_TRANSMITTANCE,),
            ),
        },
    ),
    Effect(
        key="path_length",
        default=False,
        variants={
            True: Variant(
                name="path_length",
                steers=False,
                hooks=("start", "interface", "picture"),
                carries=("path_length",),
                adds=(
                    Output(
                        name="path_length",
                        members=("path_length",),
                        meaning="optical path, the sum of index times length, scene units",
                    ),
                ),
            ),
        },
    ),
)

EFFECTS: Mapping[str, Effect] = MappingProxyType({row.key: row for row in _ROWS})


def wanted(asked: Mapping[str, Value]) -> tuple[Variant, ...]:
    """Return the variants that a scene's `[effects]` calls for, in the order of the table.

    Parameters
    ----------
    asked : mapping
        Value by key; a key left out has its default.
    """
    found = []
    for effect in EFFECTS.values():
        value = asked.get(effect.key, effect.default)
        if value == "auto" and effect.auto is not None:
            value = effect.auto
        if value in effect.variants:
            found.append(effect.variants[value])
    return tuple(found)
