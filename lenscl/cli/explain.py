"""The command that says what a study's kernels do and leave out, or how one pixel came about: explain."""
# ruff: noqa: D301 - a backspace, not an escaped one, tells click to leave a paragraph as it is

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import click

from lenscl.cli.explain_study import explain_study
from lenscl.cli.group import json_option, many, open_study, plain, set_option, study_argument
from lenscl.cli.table import print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lenscl.accuracy.path import Event, RayPath

_MOST_EVENTS = 64  # rows of a table, the default of numerics.max_events; --json has all
_LONGEST_KEY = 20  # characters of a lens's key in a table
_WIDTH, _LABEL = 100, 11  # columns
_COLUMNS = 6  # numbers of the effects side by side


@click.command()
@study_argument
@click.option(
    "--pixel", metavar="ROW,COL",
    help="Film pixel whose ray is followed; row and column count from 0.",
)  # fmt: skip
@set_option
@json_option
def explain(study_path: Path, pixel: str | None, overrides: tuple[str, ...], as_json: bool) -> None:
    """List the effects of a kernel, or follow one pixel's ray.

    Without --pixel it prints a table of effects: in or out, whether that was asked for or derived from the scene, the
    fragment of the kernel, the cost, and the reason. The cost is measured: the scene is traced with and without the
    effect, in turn. What is derived is decided once for all points of the study.

    With --pixel it prints the path of one film pixel's ray, event by event; sweep axes are ignored. The points are
    those of the kernels that trace the study, in its method and precision. At each surface it prints the segment of
    the ray on which F is proved to change sign, the residual of F, the normal, the angles, the margin to the critical
    angle, the growth of a relative change of the start, and the values of effects. At the end it prints where the ray
    lands, a bound on the error, and, with lenscl[accuracy], the certified answer. With effects.dispersion it is the
    path at the d line.

    \b
    Example:
      lenscl explain configs/torus.toml
      lenscl explain configs/torus.toml --pixel 250,170
      lenscl explain configs/torus.toml --pixel 250,170 --set numerics.precision=single --json
    """
    from lenscl.accuracy import largest_size, planner_of
    from lenscl.accuracy.path import explain_pixel
    from lenscl.materials import D_LINE

    study = open_study(study_path, overrides)
    if pixel is None:
        explain_study(study, as_json=as_json)
        return
    row, column = _read_pixel(pixel)
    scene, size = study.scene, largest_size(study.scene, study.images)
    if scene.numerics.accuracy is not None:
        plan = planner_of().plan(scene, size)
        click.echo(plain(f"accuracy: {plan.achieved}"), err=True)
        scene = plan.combination.of(scene)
    if scene.wavelengths:
        click.echo(f"wavelength: the path is of the d line, {D_LINE:g} nm; a number as index shows another", err=True)
    path = explain_pixel(scene, row, column, size=size)
    if as_json:
        click.echo(json.dumps(path.as_json(), indent=2, allow_nan=False))
    else:
        _print(path)


def _read_pixel(text: str) -> tuple[int, int]:
    """Return row and column."""
    from lenscl.errors import StudyError

    found = re.fullmatch(r"\s*(-?\d{1,18})\s*,\s*(-?\d{1,18})\s*", text)
    if found is None:
        raise StudyError([f"--pixel: must be ROW,COL, two whole numbers from 0 such as 250,170, got {text[:40]!r}"])
    return int(found[1]), int(found[2])


def _print(path: RayPath) -> None:
    """Print a path for people, in 100 columns."""
    columns, rows = path.film
    click.echo(f"Pixel ({path.row}, {path.column}) of {rows} rows and {columns} columns")
    _print_items(_start(path))
    if path.events:
        _print_events(path)
    if path.effects:
        _print_effects(path)
    click.echo(f"\nEnds {_name(path.status)} after {many(path.total, 'event')}")
    _print_items(_end(path))


def _print_items(items: Iterator[tuple[str, str]]) -> None:
    """Print labelled texts, broken where they are too long."""
    for label, text in items:
        first = f"  {label}".ljust(_LABEL)
        lines = wrap(
            plain(text), _WIDTH, initial_indent=first, subsequent_indent=" " * _LABEL,
            break_on_hyphens=False,  # an option of a command that is given as advice stays whole
        )  # fmt: skip
        for line in lines:
            click.echo(line)


def _start(path: RayPath) -> Iterator[tuple[str, str]]:
    searches = " and ".join(dict.fromkeys(path.searches))
    rule = ", bent by the paraxial rule" if path.snell == "paraxial" else ""
    yield "traced", f"by {searches} in {path.precision} precision{rule}, on {path.device}"
    if path.precision != path.asked:
        yield "", f"{path.asked} precision leaves this ray undecided, so that it is traced again"
    where = "" if path.inside is None else f", inside {' and '.join(path.solids)}"
    where += f", in the medium of {path.inside}" if len(path.solids) > 1 else ""
    yield "starts", f"at {_spelled(path.start)}{where}"
    yield "along", _spelled(path.direction)


def _spelled(vector: Sequence[float]) -> str:
    return f"({', '.join(f'{part:.9g}' for part in vector)})"


def _print_events(path: RayPath) -> None:
    events = _shown(path.events)
    click.echo("\nWhere: the points in the world, and how far it is from the point before; scene units")
    print_table(("", "what", "lens", "x", "y", "z", "leg"), [_where(event) for event in events], 3)
    click.echo("\nMedia: whose the medium is before the surface and behind it, and their refractive indices")
    print_table(("", "before", "n", "behind", "n"), [_media(event) for event in events], 4)
    click.echo("\nBends: the unit normal, outward; angles to it in degrees, and what is left to the critical one")
    head = ("", "normal x", "y", "z", "incidence", "behind", "margin", "k")
    print_table(head, [_bends(event) for event in events], 0)
    click.echo("\nHow sure: by how much the surface is met beyond the point, proved by a change of F's sign, and F")
    click.echo("at the point; the most that rounding lets F be, and normal (rad) and k be off; growth up to here")
    head = ("", "beyond", "+-", "F", "at most", "normal", "k", "growth")
    print_table(head, [_sure(event) for event in events], 0)
    if len(events) < len(path.events):
        click.echo(f"({many(len(path.events) - len(events), 'event')} between are left out; --json has all)")


def _print_effects(path: RayPath) -> None:
    click.echo("\nEffects: what they have made of the ray behind each surface, and in the map")
    rows = [_made(f"{event.number:3}", event.effects, path.effects) for event in _shown(path.events)]
    table = [["", *_columns(path.effects)], *rows, _made("map", path.effects, path.effects)]
    for first in range(1, len(table[0]), _COLUMNS):
        head, *part = ([row[0], *row[first : first + _COLUMNS]] for row in table)
        print_table(tuple(head), part, 0)


def _columns(effects: Mapping[str, Any]) -> list[str]:
    """Return a column's head for every number that the effects add, by the names of the ray's own where there are."""
    from lenscl.effects import EFFECTS

    rows = [variant for effect in EFFECTS.values() for asked in effect.variants.values() for variant in asked]
    members = {output.name: output.members for variant in rows for output in variant.adds}
    return [member for name in effects for member in members[name]]


def _made(label: str, made: Mapping[str, Any], in_map: Mapping[str, Any]) -> list[str]:
    cells = [label]
    for name, last in in_map.items():
        cells += [f"{each:.6g}" for each in _flat(made[name])] if name in made else ["" for _ in _flat(last)]
    return cells


def _flat(value: Any) -> list[float]:
    return [each for part in value for each in _flat(part)] if isinstance(value, list) else [value]


def _shown(events: Sequence[Event]) -> list[Event]:
    """Return the first and the last events of a path that is too long."""
    if len(events) <= _MOST_EVENTS:
        return list(events)
    return [*events[: _MOST_EVENTS // 2], *events[-(_MOST_EVENTS // 2) :]]


def _short(key: str) -> str:
    key = plain(key)
    return key if len(key) <= _LONGEST_KEY else f"{key[: _LONGEST_KEY - 3]}..."


def _media(event: Event) -> list[str]:
    before, after = (_short(key) if key is not None else "around" for key in (event.before, event.after))
    return [f"{event.number:3}", before, f"{event.n_before:.6g}", after, f"{event.n_after:.6g}"]


def _where(event: Event) -> list[str]:
    return [
        f"{event.number:3}",
        event.kind if event.face is None else f"reflected by the mirrored face {plain(event.face)}",
        _short(event.lens),
        *(f"{part:.8g}" for part in event.point),
        f"{event.leg:.6g}",
    ]


def _bends(event: Event) -> list[str]:
    normal = ("?", "?", "?") if event.normal is None else (f"{part:.6f}" for part in event.normal)
    angles = [_degrees(angle) for angle in (event.incidence, event.behind)]
    none = "?" if event.incidence is None else "none"
    margin = none if event.margin is None else _degrees(event.margin)
    return [f"{event.number:3}", *normal, *angles, margin, _number(event.k, ".6g")]


def _sure(event: Event) -> list[str]:
    beyond, within = "?", "?"
    if event.bracket is not None:
        low, high = event.bracket
        beyond, within = f"{0.5 * (low + high):+.3e}", f"{0.5 * (high - low):.1e}"
    known = [_number(event.turn, ".1e"), _number(event.k_bound, ".1e"), _number(event.growth, ".3g")]
    return [f"{event.number:3}", beyond, within, _number(event.residual, "+.2e"), _number(event.allowed, ".1e"), *known]


def _degrees(angle: float | None) -> str:
    """Return an angle; a small one to a few digits of its own."""
    return _number(angle, ".4f" if angle is None or angle == 0.0 or abs(angle) >= 0.01 else ".2e")


def _number(value: float | None, form: str) -> str:
    return "?" if value is None else format(value, form)


def _end(path: RayPath) -> Iterator[tuple[str, str]]:
    if (why := _why(path)) is not None:
        yield "", why
    if path.st is not None:
        s, t = path.st
        yield "lands", f"at (s, t) = ({s:.16g}, {t:.16g}), {path.last:.9g} on"
        columns, rows = path.picture
        if path.pixel is not None:
            yield "picture", f"pixel ({path.pixel[0]}, {path.pixel[1]}) of {rows} rows and {columns} columns"
        yield "error", _error(path)
        if path.growth is not None:
            change = f"a start moved by {path.reach:.4g} a across and turned by b radians, a^2 + b^2 = e^2,"
            yield "growth", f"{path.growth:.3g}: {change} moves (s, t) by up to {path.growth:.3g} e"
    yield "proved", _proved(path)


def _why(path: RayPath) -> str | None:
    """Return what there is to say of how a ray ended, besides its status."""
    if path.last_resort:
        return "decided in twice the precision of double; of the events that took, none is shown"
    if path.status.name == "TRAPPED":
        return "numerics.max_events lets it meet no more surfaces, and there is one"
    if path.status.name == "BLOCKED":
        return "the lens is opaque"
    if path.status.name == "UNDECIDED":
        on_source = "the pixel lies on the source, so that its ray has no direction"
        return "the search cannot prove what the ray meets next" if any(path.direction) else on_source
    return "it meets no lens" if not path.total else None


def _error(path: RayPath) -> str:
    if path.error is None:
        return "no bound: rounding may decide the path, or the device has no double precision"
    return f"at most {path.error:.2g} in s and t, {path.error * max(path.picture):.2g} px of the picture; validated"


def _name(status: object) -> str:
    return getattr(status, "name", "UNDECIDED").replace("_", " ")


def _proved(path: RayPath) -> str:
    from lenscl.reference import flint_trouble

    proof = path.proof
    if proof is None:
        return f"nothing: {flint_trouble()}"
    events = many(proof.events, "event")
    if proof.status is None:
        return f"{events}; beyond, nobody can tell: {proof.reason}"
    differs = "" if proof.status is path.status and proof.events == path.total else ", which is NOT what was traced"
    text = f"{_name(proof.status)} after {events}{differs}"
    if proof.distance is None:
        return text
    rule = ", bent by the exact law," if path.snell == "paraxial" else ""
    return f"{text}; the place{rule} is at most {proof.distance:.2g} from the traced one, in s and t"
