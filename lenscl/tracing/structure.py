"""What a scene's kernel is made of on a device: the methods of its lenses, its effects, the form of its packets.

Input: a `Scene` and a `Device`. Output: the `Structure` that the kernel is written from.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, Literal

from lenscl import codegen, device, effects, methods
from lenscl.codegen import Structure
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.effects import NESTED
from lenscl.errors import StudyError, TraceError
from lenscl.methods import Method
from lenscl.tracing.called import needs_of, stopping
from lenscl.tracing.coloured import colours_of
from lenscl.tracing.parking import can_park
from lenscl.tracing.placement import Placement

MOST_NESTED = 24  # lenses in a set of a kernel's text, or their colours: a set is a number that single precision holds
MOST_WRITTEN = 8  # lenses that stand in a kernel's text; more are records of a table
_MARCH_STEPS = 10**6  # steps through a lens's box beyond which `march` would never come home


def methods_of(scene: Scene) -> tuple[Method, ...]:
    """Return the method that searches each lens.

    Raises
    ------
    StudyError
        If the one asked for does not serve a lens.
    """
    wanted, problems = scene.numerics.method, []
    chosen: list[Method] = []
    for table, group in enumerate(scene.lenses.groups):
        lens = group.lens
        is_polynomial = lens.surface.sign_polynomial(lens.values) is not None
        method = methods.choose(
            wanted,
            is_polynomial=is_polynomial,
            is_polyhedron=bool(lens.surface.planes),
            is_joined=bool(lens.surface.polynomial_leaves),
        )
        if method is None:
            which = f'lens "{lens.name}"' if lens.name else f"lens[{table}]"
            asked = methods.METHODS[wanted]
            what = "convex polyhedra" if asked.wants_planes else "polynomials"
            what = "max and min of polynomials" if asked.wants_leaves else what
            problems.append(
                f'numerics.method: "{wanted}" searches {what}, and {which} ({lens.surface.name}) is none '
                'with these parameters; use "auto"'
            )
        else:
            chosen += [method] * len(group)
    if problems:
        raise StudyError(problems)
    return tuple(chosen)


def chosen_device(wanted: Device | str | None) -> Device:
    """Return the device that was asked for, by itself, by name, or not at all."""
    return wanted if isinstance(wanted, Device) else device.choose(wanted)


def structure_of(scene: Scene, rays: Any, ends: Any, chosen: Device) -> Structure:
    """Return what a scene's kernel is made of on a device."""
    numerics = scene.numerics
    if numerics.accuracy is not None:
        raise StudyError(
            [
                "numerics.accuracy: what meets it is to be chosen before this; `lenscl.trace` does so, or set "
                "numerics.method and numerics.precision"
            ]
        )
    if numerics.precision != "single" and not chosen.has_double:
        raise TraceError(
            f"numerics.precision: {chosen.label} has no double precision; "
            'set precision = "single", or choose another of `lenscl devices` by LENSCL_DEVICE'
        )
    width = chosen.width(codegen.carried(numerics.precision))
    needs, searched = needs_of(scene, rays_given=rays == "given"), methods_of(scene)
    reached, stops = sorted(needs.lenses), stopping(scene).holds
    nests = scene.by_priority() if NESTED in needs.facts or stops else ()
    tabled = len(nests) > MOST_NESTED if nests else len(reached) > MOST_WRITTEN
    return Structure(
        lenses={number: scene.lenses.group_of(number).lens.surface for number in reached},
        rays=rays,
        ends=ends,
        methods={number: searched[number] for number in reached},
        snell=numerics.snell,
        effects=effects.called(scene.effects, needs.facts),
        precision=numerics.precision,
        width=width,
        run=chosen.run,
        parks=can_park(chosen, width),
        source=scene.source.kind,
        nests=nests,
        stops=stops,
        tabled=tabled,
        colours=colours_of(scene) if tabled and nests else (),
        mirrors=_mirrors(scene, reached),
    )


def _mirrors(scene: Scene, reached: Collection[int]) -> tuple[tuple[int, Literal[True] | tuple[str, ...]], ...]:
    """Return which of some lenses have mirrored faces, and which, as `Structure.mirrors`."""
    if not any(group.lens.mirror for group in scene.lenses.groups):
        return ()
    found: list[tuple[int, Literal[True] | tuple[str, ...]]] = []
    for number in reached:
        lens = scene.lenses.group_of(number).lens
        if lens.mirror:
            found.append((number, True if lens.is_mirror else lens.coated))
    return tuple(found)


def check_steps(scene: Scene, structure: Structure) -> None:
    """Refuse a step so small that `march` would never come home."""
    if "step" not in structure.reads():
        return
    tables = {group.first: group for group in map(scene.lenses.group_of, structure.lenses)}
    diagonal = max(Placement.of(group.lens).diagonal() for group in tables.values())
    if diagonal > _MARCH_STEPS * scene.numerics.step:
        raise StudyError(
            [
                f"numerics.step: {scene.numerics.step:g} would take more than {_MARCH_STEPS:,} steps through a lens "
                f"{diagonal:g} across; use at least {diagonal / _MARCH_STEPS:.3g}"
            ]
        )
