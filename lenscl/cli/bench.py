"""The command that measures: bench."""
# ruff: noqa: D301 - a backspace, not an escaped one, tells click to leave a paragraph as it is

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lenscl.cli.group import json_option, many, plain
from lenscl.cli.table import print_table, share

if TYPE_CHECKING:
    from lenscl.accuracy.bench import Comparison, Error, Measurement, Run

_LEAST_ROUNDS, _USUAL_ROUNDS = 3, 9
_NAMES = 3  # columns that name a row


@click.command()
@click.option(
    "--scene", "scenes", metavar="NAME", multiple=True,
    help="A benchmark scene or a part of its name, such as torus-wide, torus or wide; default: close. Repeatable.",
)  # fmt: skip
@click.option(
    "--method", "methods", metavar="NAME", multiple=True,
    help="A method, as numerics.method names it; default: auto and march. Repeatable.",
)  # fmt: skip
@click.option(
    "--precision", "precisions", type=click.Choice(["single", "double", "mixed"]), multiple=True,
    help="Default: single and double, where the device has both. Repeatable.",
)  # fmt: skip
@click.option(
    "--rounds", type=click.IntRange(min=_LEAST_ROUNDS), default=_USUAL_ROUNDS, show_default=True,
    help="How often each row is traced and timed.",
)  # fmt: skip
@click.option("--save", "name", metavar="NAME", help="Save this run under a name.")
@click.option("--force", is_flag=True, help="Let --save replace a run of the same name.")
@click.option("--compare", "base", metavar="BASE", help="Compare this run with a saved one.")
@click.option(
    "--folder", type=click.Path(path_type=Path, file_okay=False), metavar="DIR",
    help="Folder of saved runs; default: a folder in your data folder.",
)  # fmt: skip
@json_option
def bench(
    scenes: tuple[str, ...], methods: tuple[str, ...], precisions: tuple[Any, ...], rounds: int, name: str | None,
    force: bool, base: str | None, folder: Path | None, as_json: bool,
) -> None:  # fmt: skip
    """Measure time and error of a ray, and compare runs.

    Every timed launch stands between two launches of a kernel that never changes. Runs are compared by the ratio to
    it, so the speed of the machine cancels. Runs on different devices, drivers or scenes are not comparable, and the
    command says so. A run of the usual rows takes a minute or two.

    \b
    Example:
      lenscl bench --save before
      lenscl bench --compare before
      lenscl bench --scene torus --method auto --precision single --json
    """
    from datetime import UTC, datetime

    from lenscl import device
    from lenscl.accuracy.bench import Bench, Run, Store, compare, plan_rows
    from lenscl.version import program_version

    # What is wrong with the request is said before a minute has gone
    store = Store(folder)
    earlier = None if base is None else store.load(base)
    if name is not None:
        store.check_free(name, force=force)
    chosen = device.choose()
    rows, left_out = plan_rows(scenes, methods, precisions, chosen)
    for reason in left_out:
        click.echo(reason, err=True)

    measuring, measured = Bench(chosen), []
    for number, row in enumerate(rows, start=1):
        click.echo(f"{number} of {len(rows)}: {row}", err=True)
        measured.append(measuring.measure(row, rounds))
    made = datetime.now(UTC).isoformat(timespec="seconds")
    run = Run(program=program_version(), made=made, measurements=tuple(measured))
    if name is not None:
        click.echo(plain(f"saved as {store.save(name, run, force=force)}"), err=True)

    comparison = None if earlier is None else compare(earlier, run)
    if as_json:
        click.echo(json.dumps(_document(run, base, comparison), indent=2))
        return
    _print_run(run)
    if comparison is not None and earlier is not None:
        click.echo(f"\nAgainst {base}, measured {plain(earlier.made)} with {plain(earlier.program)}:\n")
        _print_comparison(comparison)


def _print_run(run: Run) -> None:
    head = (
        "scene", "method", "precision", "ns/ray", "median", "slots/ray", "steps", "x reference", "x march",
        "error median", "99 %", "largest", "floor", "unknown", "differ", "undecided", "escalated",
    )  # fmt: skip
    print_table(head, [_cells(each, run.march_of(each)) for each in run.measurements], _NAMES)
    click.echo()
    for line in _circumstances(run):
        click.echo(plain(line))


def _cells(row: Measurement, march: Measurement | None) -> list[str]:
    low, high = row.ratio_bounds
    error = row.error
    searches = "+".join(dict.fromkeys(row.searches))
    return [
        row.scene,
        row.method if row.method == searches else f"{row.method}: {searches}",
        row.precision,
        f"{row.ns_least:.1f}",
        f"{row.ns_median:.1f}",
        f"{row.slots:.0f}",
        f"{row.steps:.1f}",
        f"{row.ratio:.3f} ({low:.3f}-{high:.3f})",
        "-" if march is None else f"{row.ratio / march.ratio:.3f}",
        *(_pixels(error, each) for each in (error.pixels.median, error.pixels.high, error.pixels.largest)),
        f"{error.floor:.1e}",
        *(share(each) for each in (error.unknown, error.differ, row.undecided, row.escalated)),
    ]


def _high(error: Error) -> float | None:
    return error.pixels.high if error.compared else None


def _pixels(error: Error, value: float) -> str:
    """Return a figure of an error; a question mark where no ray was compared."""
    return f"{value:.1e}" if error.compared else "?"


def _circumstances(run: Run) -> list[str]:
    """Return what the table needs beside it to be believed."""
    first = run.measurements[0]
    about, rounds = first.circumstances, len(first.ratios)
    of_all = {each.precision: each for each in sorted(run.measurements, key=lambda each: each.peak)}
    widths = ", ".join(f"{each.circumstances.width} ({precision})" for precision, each in of_all.items())
    peaks = ", ".join(f"{each.peak / 1e9:.0f} GFLOP/s ({precision})" for precision, each in of_all.items())
    rays = ", ".join(f"{count:,}" for count in dict.fromkeys(each.circumstances.rays for each in run.measurements))
    lens_rays = {each.scene: each.error.sampled for each in run.measurements}
    against = " or ".join(dict.fromkeys(each.error.against for each in run.measurements))
    unit = many(about.units, "compute unit")
    return [
        f"device     {about.platform}: {about.device}, {about.driver}; {about.kind}, {unit}",
        f"rays       {rays} of the film; to a packet: {widths}",
        f"time       {about.state}, least and median of {many(rounds, 'round')}, by the device's clock",
        f"slots      least time x the multiply-add peak seen between the rounds, up to {peaks}",
        "steps      of a search for the next surface, in the mean; a film ray that meets a lens makes two or more",
        f"reference  the frozen kernel {about.reference_key}, launched just before and after; median, 95 % bounds",
        f"error      picture pixels, against {against}; median, 99 % and largest of rays through the lens:",
        "           " + ", ".join(f"{count} of {name}" for name, count in lens_rays.items()),
        "floor      99 % of what changing the last bit of a ray's direction does; errors below it say nothing",
        "unknown    share of these that are undecided, there or here: no error is of them",
        "differ     share of these that end otherwise than they should; undecided, escalated: of all rays",
        f"program    {run.program}",
    ]


def _print_comparison(comparison: Comparison) -> None:
    head = (
        "scene", "method", "precision", "time x", "from", "to", "", "kernel",
        "error 99 %", "was", "undecided", "was",
    )  # fmt: skip
    rows = []
    for change in comparison.changes:
        before, after = change.before, change.after
        times = (change.ratio, change.low, change.high)
        rows.append(
            [
                *after.row,
                *("-" if each is None else f"{each:.3f}" for each in times),
                change.verdict,
                "same" if change.is_same_kernel else "changed",
                *(_pixels(each.error, each.error.pixels.high) for each in (after, before)),
                *(share(each.undecided) for each in (after, before)),
            ]
        )
    if rows:
        print_table(head, rows, _NAMES)
        click.echo()
    hindered: dict[tuple[str, ...], list[str]] = {}
    for change in comparison.changes:
        if change.obstacles:
            hindered.setdefault(change.obstacles, []).append(" ".join(change.after.row))
    for obstacles, names in hindered.items():
        which = "of all rows" if len(names) == len(comparison.changes) else f"of {', '.join(names)}"
        click.echo(plain(f"The times {which} are not comparable: {'; '.join(obstacles)}"))
    comparable = [each for each in comparison.changes if not each.obstacles]
    changed = [each for each in comparable if each.verdict != "same"]
    alike = sum(each.is_same_kernel for each in changed)
    if comparable:
        by_chance = f"; {alike} of these ran the very same kernel, so the machine did that" if alike else ""
        count = f"{len(changed)} of {many(len(comparable), 'row')}"
        click.echo(f"{count} changed by more than their own spread{by_chance}")
    for rows_of_one, where in ((comparison.only_before, "the earlier run"), (comparison.only_after, "this run")):
        if rows_of_one:
            click.echo(plain(f"Only in {where}: {', '.join(' '.join(row) for row in rows_of_one)}"))


def _document(run: Run, base: str | None, comparison: Comparison | None) -> dict[str, Any]:
    """Return the run as it is saved, and the comparison under a key of its own."""
    from lenscl.accuracy.bench.store import as_json

    document: dict[str, Any] = json.loads(as_json(run))
    if comparison is None:
        return document
    changes = [
        dict(zip(("scene", "method", "precision"), each.after.row, strict=True))
        | {
            "verdict": each.verdict,
            "ratio": each.ratio,
            "low": each.low,
            "high": each.high,
            "obstacles": list(each.obstacles),
            "is_same_kernel": each.is_same_kernel,
            "error_high_pixels": {"before": _high(each.before.error), "after": _high(each.after.error)},
            "undecided": {"before": each.before.undecided, "after": each.after.undecided},
        }
        for each in comparison.changes
    ]
    only = {"only_before": list(comparison.only_before), "only_after": list(comparison.only_after)}
    return document | {"comparison": {"base": base, "changes": changes, **only}}
