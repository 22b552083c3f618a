"""What `lenscl explain` prints of a study: its effects, in or out, and why."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click

from lenscl.cli.group import plain
from lenscl.cli.table import print_table, share

_MOST_CHANGED = 0.01  # of the rays that end otherwise without an effect: beyond, times tell no more what it costs

if TYPE_CHECKING:
    from lenscl.accuracy.ablation import Ablation, Cost
    from lenscl.config import Scene, Study
    from lenscl.device import Device
    from lenscl.tracing import Call


def explain_study(study: Study, *, as_json: bool) -> None:
    """Print which effects are compiled into a study's kernels, which are left out, why, and what they cost."""
    from lenscl import device
    from lenscl.accuracy import largest_size, planner_of
    from lenscl.accuracy.ablation import ablate
    from lenscl.tracing import calls, study_needs, with_needs

    chosen = device.choose()
    scene = with_needs(study.scene, study_needs(study))
    if scene.numerics.accuracy is not None:
        plan = planner_of(chosen).plan(scene, largest_size(scene, study.images))
        click.echo(plain(f"accuracy: {plan.achieved}"), err=True)
        scene = plan.combination.of(scene)
    found, timed = list(calls(scene)), ablate(scene, chosen)
    if as_json:
        click.echo(json.dumps(_document(study, scene, found, timed, chosen), indent=2))
    else:
        _print(study, scene, found, timed, chosen)


def _always(scene: Scene) -> Iterator[tuple[str, bool, str, str, str]]:
    """Yield what no key asks for: its name, whether it is in, "always" or "derived", its fragment, and why."""
    from lenscl.effects import NESTED
    from lenscl.tracing import findings, reach_of, stopping, tightened

    law = scene.numerics.snell
    yield "refraction", True, "always", f"snell_{law}", f"at every entry and exit, by the {law} law"
    reached = reach_of(scene)
    tables = {group: [number for number in group.numbers if number in reached] for group in scene.lenses.groups}
    again = [scene.table_key(group) for group, some in tables.items() if some and not group.lens.surface.is_convex]
    if again:
        yield "re-entry", True, "always", "", f"a ray may meet {' and '.join(again)} again"
    else:
        yield "re-entry", False, "derived", "", "no ray that left a convex solid meets it again"
    if len(scene.lenses) > 1:
        beyond = "neither the film's rays nor any that lenses have bent get to it"
        for group, some in tables.items():
            why = reached[some[0]] if some else beyond
            if group.at is not None and some:
                why = f"{len(some):,} of its {len(group):,} places are reached, the first because {why}"
            yield scene.table_key(group), bool(some), "derived", "", why
        nested = findings(scene)[NESTED]
        yield "nested solids", nested.holds, "derived", "ray_nested" if nested.holds else "", nested.why
    for group, some in tables.items():
        box = tightened(group.lens) if some else None
        if box is not None:
            low, high = (" ".join(f"{each:.4g}" for each in corner) for corner in box)
            why = f"the bounds are far wider than the solid: rays are searched from ({low}) to ({high})"
            yield f"{scene.table_key(group)}.bounds", True, "derived", "", why
    if any(group.lens.mirror for group in scene.lenses.groups):
        mirrors = [
            f"{scene.table_key(group)}: {'all faces' if group.lens.is_mirror else ', '.join(group.lens.coated)}"
            for group, some in tables.items()
            if group.lens.mirror and some
        ]
        is_nested = findings(scene)[NESTED].holds or stopping(scene).holds
        fragment = "mirror_nested" if is_nested else "mirror"
        why = f"mirrored faces of {'; '.join(mirrors)}" if mirrors else "no ray gets to a mirrored face"
        yield "mirrors", bool(mirrors), "asked", fragment if mirrors else "", why
    stops = stopping(scene)
    yield (
        "picture stops light",
        stops.holds,
        "derived" if scene.picture.stops == "auto" else "asked",
        ("picture_stops" if stops.holds else ""),
        stops.why,
    )


def _print(study: Study, scene: Scene, found: list[Call], timed: Ablation, chosen: Device) -> None:
    rows = [
        (name, "in" if is_in else "out", decided, fragment, "", plain(why))
        for name, is_in, decided, fragment, why in _always(scene)
    ]
    for call in found:
        cost = timed.costs.get(_timed_as(call))
        rows.append(
            (
                call.effect.key,
                "in" if call.is_in else "out",
                "derived" if call.asked == "auto" else "asked" if call.is_in else "",
                call.variant.name if call.variant else "",
                (_in_seconds(cost, timed.rays) if call.is_beside else _spelled(cost)) if cost else "",
                plain(call.why),
            )
        )
    click.echo(plain(f"{study.title}: {_points(study)}"))
    click.echo()
    print_table(("effect", "", "", "fragment", "ns a ray", "why"), rows, 6)
    click.echo()
    for label, text in _circumstances(scene, found, timed, chosen).items():
        click.echo(plain(f"{label:8}{text}"))


def _timed_as(call: Call) -> str:
    return call.variant.name if call.variant else call.effect.key


def _in_seconds(cost: Cost, rays: int) -> str:
    seconds, low, high = (each * rays * 1e-9 for each in (cost.ns, cost.low, cost.high))
    return f"{seconds:+.3g} s ({low:+.3g} to {high:+.3g})"


def _spelled(cost: Cost) -> str:
    if cost.changed > _MOST_CHANGED:
        return f"changes {share(cost.changed)} of the rays"
    return f"{cost.ns:+.2f} ({cost.low:+.2f} to {cost.high:+.2f})"


def _points(study: Study) -> str:
    count = study.point_count()
    return "decided for its one point" if count == 1 else f"decided once for all {count:,} points"


def _circumstances(scene: Scene, found: list[Call], timed: Ablation, chosen: Device) -> dict[str, str]:
    from lenscl.accuracy.ablation import BESIDE_ROUNDS

    numerics, beside = scene.numerics, [call.effect.key for call in found if call.is_beside]
    by_host = "beside the kernel and on top of that, in seconds by the host's clock: median, least and most of"
    return {
        "time": f"{timed.ns:.3g} ns a ray with all that is in, warm, median of {timed.rounds} rounds; "
        "ns a ray: what each adds with all that builds on it, the median of paired differences, with its 95 % bounds",
        **({"beside": f"{' and '.join(beside)}: {by_host} {BESIDE_ROUNDS} rounds"} if beside else {}),
        "search": "; ".join(f"{key} by {name}" for key, name in _searches(scene).items()),
        "rays": f"{timed.rays:,}, method {numerics.method}, {numerics.precision} precision",
        "device": ", ".join(f"{value}" for value in chosen.circumstances().values()),
    }


def _searches(scene: Scene) -> dict[str, str]:
    """Return the method that searches the lenses of each table, by the table's key."""
    from lenscl.tracing import methods_of

    methods = methods_of(scene)
    return {scene.table_key(group): methods[group.first].name for group in scene.lenses.groups}


def _document(study: Study, scene: Scene, found: list[Call], timed: Ablation, chosen: Device) -> dict[str, Any]:
    from dataclasses import asdict

    return {
        "title": study.title,
        "points": study.point_count(),
        "effects": [
            {"effect": name, "in": is_in, "asked": None, "fragment": fragment or None, "why": why, "cost": None}
            for name, is_in, _, fragment, why in _always(scene)
        ]
        + [
            {
                "effect": call.effect.key,
                "in": call.is_in,
                "asked": call.asked,
                "fragment": call.variant.name if call.variant else None,
                "why": call.why,
                "cost": asdict(timed.costs[_timed_as(call)]) if call.is_in else None,
            }
            for call in found
        ],
        "ns": timed.ns,
        "rays": timed.rays,
        "rounds": timed.rounds,
        "method": scene.numerics.method,
        "searches": _searches(scene),
        "precision": scene.numerics.precision,
        **chosen.circumstances(),
    }
