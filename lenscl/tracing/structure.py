"""What a scene's kernel is made of on a device: the methods of its lenses, its effects, the form of its packets.

Input: a `Scene` and a `Device`. Output: the `Structure` that the kernel is written from.
"""

from __future__ import annotations

from typing import Any

from lenscl import codegen, device, effects, methods
from lenscl.codegen import Structure
from lenscl.config import Scene
from lenscl.device import Device
from lenscl.effects import NESTED
from lenscl.errors import StudyError, TraceError
from lenscl.methods import Method
from lenscl.tracing.called import needs_of, stopping
from lenscl.tracing.parking import can_park
from lenscl.tracing.placement import Placement

MOST_NESTED = 24  # lenses in a set: a set is a whole number that single precision holds
_MARCH_STEPS = 10**6  # steps through a lens's box beyond which `march` would never come home


def methods_of(scene: Scene) -> tuple[Method, ...]:
    """Return the method that searches each lens.

    Raises
    ------
    StudyError
        If the one asked for does not serve a lens.
    """
    wanted, chosen, problems = scene.numerics.method, [], []
    for number, lens in enumerate(scene.lenses):
        is_polynomial = lens.surface.sign_polynomial(lens.values) is not None
        method = methods.choose(wanted, is_polynomial=is_polynomial, is_polyhedron=bool(lens.surface.planes))
        if method is None:
            which = f'lens "{lens.name}"' if lens.name else f"lens[{number}]"
            what = "convex polyhedra" if methods.METHODS[wanted].wants_planes else "polynomials"
            problems.append(
                f'numerics.method: "{wanted}" searches {what}, and {which} ({lens.surface.name}) is none '
                'with these parameters; use "auto"'
            )
        else:
            chosen.append(method)
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
    return Structure(
        lenses={number: scene.lenses[number].surface for number in reached},
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
        nests=_nests(scene) if NESTED in needs.facts or stops else (),
        stops=stops,
        mirrors=tuple(
            (number, None if lens.is_mirror else lens.coated)
            for number in reached
            if (lens := scene.lenses[number]).mirror
        ),
    )


def _nests(scene: Scene) -> tuple[int, ...]:
    """Return the lenses, lowest priority first.

    Raises
    ------
    StudyError
        If there are more than a set holds.
    """
    if len(scene.lenses) > MOST_NESTED:
        raise StudyError(
            [
                f"lens: {len(scene.lenses)} lenses, of which some may touch or overlap; where they do, there may be "
                f"{MOST_NESTED} at most: `lenscl explain` names those that are not proved apart"
            ]
        )
    return scene.by_priority()


def check_steps(scene: Scene, structure: Structure) -> None:
    """Refuse a step so small that `march` would never come home."""
    if "step" not in structure.reads():
        return
    diagonal = max(Placement.of(scene.lenses[number]).diagonal() for number in structure.lenses)
    if diagonal > _MARCH_STEPS * scene.numerics.step:
        raise StudyError(
            [
                f"numerics.step: {scene.numerics.step:g} would take more than {_MARCH_STEPS:,} steps through a lens "
                f"{diagonal:g} across; use at least {diagonal / _MARCH_STEPS:.3g}"
            ]
        )
