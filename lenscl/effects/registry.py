"""The table of effects, and which of their variants a scene calls for."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, TypeGuard

from lenscl.effects import wavelengths

Value = str | int | tuple[float, ...]  # of a key in [effects]; true and false among them
MOST_SAMPLES = 16  # rays a film pixel, each way
EDGE_SAMPLES = 4  # likewise, of the pixels that antialias = "edges" refines
# What a scene may have or not, on which "auto" depends
Fact = Literal[
    "a lens is opaque",
    "a lens absorbs",
    "total reflection is possible",
    "the environment is the picture",
    "the environment is an image",
    "solids may touch or overlap",
]
# Where a kernel calls a variant: on a ray's start, behind a surface that it has met, there after all others, on the
# picture's plane where a map is made, and there whatever is made
Hook = Literal["start", "interface", "after", "picture", "landing"]


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
    shape : tuple of int, optional
        Of a pixel's numbers, where they are no plain row: an array of (rows, columns, *shape).
    """

    name: str
    members: tuple[str, ...]
    meaning: str
    shape: tuple[int, ...] | None = None

    @property
    def pixel_shape(self) -> tuple[int, ...]:
        """The shape of a pixel's numbers."""
        return self.shape or ((len(self.members),) if len(self.members) > 1 else ())


@dataclass(frozen=True, slots=True, kw_only=True)
class Variant:
    """One form of an effect that a kernel can contain.

    Attributes
    ----------
    name : str
        Also the file, kernels/effects/<name>.cl. It provides a function for each hook: <name>_start(ray, scene),
        <name>_interface(ray, at, scene), <name>_after(ray, at, scene), <name>_picture(ray, place, scene),
        <name>_landing(ray, place, scene).
    steers : bool
        Whether it changes where a ray goes or how it ends; else it only observes.
    hooks : tuple of str
        Where it is called.
    carries : tuple of str
        The numbers that a ray carries for it, members of ray_t.
    adds : tuple of Output
    reads : tuple of (str, int)
        The attributes of a lens whose numbers it reads, and how many those are: lens_<name>(scene, lens, i) has them.
    fact : str, optional
        What a scene has to have for "auto" to call for it.
    only : str, optional
        What a scene has to have for it to be called for at all.
    builds_on : tuple of str
        The variants whose functions and numbers it uses, which come before it.
    by : tuple of str
        The attributes of a kernel's structure on which its text hangs, too: it comes behind
        kernels/effects/<name>_<value>.cl of each.
    uses : tuple of str
        The files of kernels/effects that it shares with others, which stand in a kernel once, before all that use them.
    needs : tuple of str
        The functions of every surface that it calls, beyond those of the search.
    layers : bool
        Whether every ray is traced once for each of several wavelengths, in one launch: a work-item reads the numbers
        of its own one, arrays get a leading axis. Such a variant's fragment hands out the layers, in the place of
        layer_single.cl; it has no hooks.
    meets_mirrors : bool
        Whether a reflection by a mirrored face concerns it. It then sees that as a total reflection; other variants do
        not see it at all.
    """

    name: str
    steers: bool
    hooks: tuple[Hook, ...] = ("interface",)
    carries: tuple[str, ...] = ()
    adds: tuple[Output, ...] = ()
    reads: tuple[tuple[str, int], ...] = ()
    fact: Fact | None = None
    only: Fact | None = None
    builds_on: tuple[str, ...] = ()
    by: tuple[Literal["source", "snell"], ...] = ()
    uses: tuple[Literal["mirrored"], ...] = ()
    needs: tuple[Literal["hessian"], ...] = ()
    layers: bool = False
    meets_mirrors: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """One optional piece of physics: the values of its key, and the variants that each asks for.

    Attributes
    ----------
    key : str
        In `[effects]`.
    model : str
        What it computes, and whose formula that is.
    default : str, bool, int or tuple of float
    variants : mapping
        By the value that asks for them, in the order in which they are called at a surface; none where a value asks
        for nothing in the kernel.
    can_be_off : bool
        Whether False asks for nothing.
    auto : str or bool, optional
        The value whose variants "auto" takes, each where its fact holds; None where the key has no "auto".
    beside : str
        What it does beside the kernel, of which it then needs no part; empty where it is all in the kernel.
    numbers : (int, int), optional
        The least and the largest whole number that the key takes beside its words.
    listed : (int, int), optional
        The least and the largest length of a list of wavelengths that the key takes beside its words.
    counted : tuple of Variant
        What such a number, or such a list, asks for.
    """

    key: str
    model: str
    default: Value
    variants: Mapping[Value, tuple[Variant, ...]]
    can_be_off: bool = True
    auto: Value | None = None
    beside: str = ""
    numbers: tuple[int, int] | None = None
    listed: tuple[int, int] | None = None
    counted: tuple[Variant, ...] = ()

    @property
    def choices(self) -> tuple[Value, ...]:
        """The values its key takes, but for numbers and lists."""
        off = (False,) if self.can_be_off else ()
        return (*off, *self.variants, *(("auto",) if self.auto is not None else ()))

    def called(self, asked: Value, facts: Collection[str]) -> tuple[Variant, ...]:
        """Return the variants that a value calls for in a scene of which some facts hold."""
        is_auto = asked == "auto" and self.auto is not None
        return tuple(
            one
            for one in self.asked_for(asked)
            if (one.only is None or one.only in facts) and (not is_auto or one.fact is None or one.fact in facts)
        )

    def asked_for(self, value: Value) -> tuple[Variant, ...]:
        """Return the variants that a value asks for, whatever holds of the scene."""
        if value == "auto" and self.auto is not None:
            value = self.auto
        is_counted = _is_number(value) or isinstance(value, tuple)
        return self.counted if is_counted else self.variants.get(value, ())

    def takes(self, value: object) -> bool:
        """Return whether the key takes a value; of a list, whether it takes one so long."""
        if _is_number(value):
            return self.numbers is not None and self.numbers[0] <= value <= self.numbers[1]
        if isinstance(value, tuple):
            return self.listed is not None and self.listed[0] <= len(value) <= self.listed[1]
        return any(value is choice or (isinstance(choice, str) and value == choice) for choice in self.choices)


def _is_number(value: object) -> TypeGuard[int]:
    return isinstance(value, int) and not isinstance(value, bool)  # True == 1, but does not count


_WAVELENGTHS = (Variant(name="dispersion", steers=True, hooks=(), layers=True),)
_TRANSMITTANCE = Output(
    name="transmittance",
    members=("transmittance",),
    meaning="share of the light's power that is refracted at every surface but where it is totally reflected",
)
_WAYS = tuple(f"{of}_{axis}_by_{by}" for by in ("row", "column") for of in ("point", "turn") for axis in "xyz")
_JACOBIAN = ("s_by_row", "s_by_column", "t_by_row", "t_by_column")
_FRESNEL = Variant(
    name="fresnel",
    steers=False,
    hooks=("start", "interface"),
    carries=("transmittance",),
    adds=(_TRANSMITTANCE,),
)
TOTAL: Fact = "total reflection is possible"
NESTED: Fact = "solids may touch or overlap"
_ROWS = (
    Effect(
        key="absorption",
        model="Beer-Lambert: a length L inside a lens transmits exp(-a L) of red, green and blue; opaque lenses",
        default="auto",
        variants={
            True: (
                Variant(
                    name="opaque",
                    steers=True,
                    hooks=("interface", "after"),
                    reads=(("absorbs", 1),),
                    fact="a lens is opaque",
                ),
                Variant(
                    name="absorption",
                    steers=False,
                    meets_mirrors=True,
                    hooks=("start", "interface"),
                    carries=("red", "green", "blue"),
                    adds=(
                        Output(
                            name="transmission",
                            members=("red", "green", "blue"),
                            meaning="share of the light that the lenses' insides let through, red, green and blue",
                        ),
                    ),
                    reads=(("absorption", 3),),
                    fact="a lens absorbs",
                ),
            )
        },
        auto=True,
    ),
    Effect(
        key="total_reflection",
        model="where Snell's law has no solution, the ray is reflected, or it ends",
        default="auto",
        variants={
            "follow": (Variant(name="follow_total_reflection", steers=True, fact=TOTAL, uses=("mirrored",)),),
            "end": (Variant(name="end_at_total_reflection", steers=True, fact=TOTAL),),
        },
        can_be_off=False,
        auto="follow",
    ),
    Effect(
        key="fresnel",
        model="Fresnel's equations (Born & Wolf, Principles of Optics, 7th ed., sec. 1.5): transmitted power",
        default=False,
        variants={
            True: (_FRESNEL,),
            "split": (
                _FRESNEL,
                Variant(
                    name="fresnel_front",
                    steers=False,
                    builds_on=("fresnel",),
                    hooks=("start", "interface"),
                    carries=("reflectance",),
                    adds=(
                        Output(
                            name="reflectance",
                            members=("reflectance",),
                            meaning="share of the light's power that the first surface reflects, met from outside",
                        ),
                    ),
                ),
                Variant(
                    name="reflected_place",
                    steers=False,
                    builds_on=("fresnel", "fresnel_front"),
                    uses=("mirrored",),
                    hooks=("start", "interface"),
                    carries=("reflected_s", "reflected_t"),
                    adds=(
                        Output(
                            name="reflected_st",
                            members=("reflected_s", "reflected_t"),
                            meaning="where on the picture's plane the reflection lands; (-1, -1) where it does not",
                        ),
                    ),
                    only="the environment is the picture",
                ),
                Variant(
                    name="reflected_away",
                    steers=False,
                    builds_on=("fresnel", "fresnel_front"),
                    uses=("mirrored",),
                    hooks=("start", "interface"),
                    carries=("reflected_x", "reflected_y", "reflected_z"),
                    adds=(
                        Output(
                            name="reflected",
                            members=("reflected_x", "reflected_y", "reflected_z"),
                            meaning="unit direction of the reflection; 0 where there is none",
                        ),
                    ),
                    only="the environment is an image",
                ),
            ),
            "polarised": (
                Variant(
                    name="fresnel_polarised",
                    steers=False,
                    hooks=("start", "interface"),
                    carries=(
                        *("transmittance", "polarised_q", "polarised_u", "polarised_v"),
                        *("across_x", "across_y", "across_z"),
                    ),
                    adds=(_TRANSMITTANCE,),
                ),
            ),
        },
    ),
    Effect(
        key="dispersion",
        model="an index for each wavelength, by the materials' formulas",
        default=False,
        variants={"rgb": _WAVELENGTHS},
        numbers=(wavelengths.FEWEST, wavelengths.MOST),
        listed=wavelengths.LISTED,
        counted=_WAVELENGTHS,
    ),
    Effect(
        key="path_length",
        model="the sum of index times length along the ray",
        default=False,
        variants={
            True: (
                Variant(
                    name="path_length",
                    steers=False,
                    meets_mirrors=True,
                    hooks=("start", "interface", "picture"),
                    carries=("path_length",),
                    adds=(
                        Output(
                            name="path_length",
                            members=("path_length",),
                            meaning="optical path from the source to the picture's plane, scene units",
                        ),
                    ),
                ),
            )
        },
    ),
    Effect(
        key="footprint",
        model="Jacobian of the map in closed form, by ray differentials (Igehy, SIGGRAPH 1999); filters pictures",
        default=False,
        variants={
            True: (
                Variant(
                    name="footprint",
                    steers=False,
                    meets_mirrors=True,
                    hooks=("start", "interface", "landing"),
                    carries=(*_WAYS, *_JACOBIAN),
                    adds=(
                        Output(
                            name="jacobian",
                            members=_JACOBIAN,
                            meaning="d(s, t) / d(row, column) of the place on the picture, per film pixel",
                            shape=(2, 2),
                        ),
                    ),
                    by=("source", "snell"),
                    uses=("mirrored",),
                    needs=("hessian",),
                ),
            )
        },
    ),
    Effect(
        key="antialias",
        model="the mean of n x n rays a film pixel, in linear light; or only where neighbours differ",
        default=1,
        variants={"edges": ()},
        numbers=(1, MOST_SAMPLES),
        can_be_off=False,
        beside="more rays of the same kernel",
    ),
    Effect(
        key="caustics",
        model="light on the picture: tubes of rays carry the flux that the source sends through each film pixel",
        default=False,
        variants={True: ()},
        beside="the corners of the film's pixels, by the same kernel",
    ),
)

EFFECTS: Mapping[str, Effect] = MappingProxyType({row.key: row for row in _ROWS})


def called(asked: Mapping[str, Value], facts: Collection[str]) -> tuple[Variant, ...]:
    """Return the variants that a scene calls for, in the order in which a kernel has them.

    Parameters
    ----------
    asked : mapping
        The scene's `[effects]`: value by key; a key left out has its default.
    facts : collection of str
        What holds of the scene.
    """
    return tuple(
        variant
        for effect in EFFECTS.values()
        for variant in effect.called(asked.get(effect.key, effect.default), facts)
    )
