"""The command that runs the pack of hard cases: hardcases."""
# ruff: noqa: D301 - a backspace, not an escaped one, tells click to leave a paragraph as it is

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import click

from lenscl.cli.group import SOME_FAILED, json_option, many, plain
from lenscl.cli.table import print_table

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from lenscl.hardcases import FamilyResult, Verdict

_MOST_LINES, _MOST_OF_A_CASE = 20, 3  # of wrong answers in text; --json lists all
_METHODS = ("auto", "march", "guarded", "polynomial", "interval")
_PRECISIONS = ("single", "mixed", "double")


@click.command()
@click.option("--method", type=click.Choice(_METHODS), default="auto", show_default=True, help="How roots are found.")
@click.option(
    "--precision", type=click.Choice(_PRECISIONS), help="Default: double, or single where the device has no double."
)
@click.option("--device", "label", metavar="DEVICE", help="Part of a device's label, as `lenscl devices` lists them.")
@click.option("--case", "names", metavar="TEXT", multiple=True, help="Only cases whose names contain the text.")
@json_option
def hardcases(method: str, precision: str | None, label: str | None, names: tuple[str, ...], as_json: bool) -> None:
    """Run the pack of hard cases on a device, and say how its answers stand against the exact ones.

    The pack holds rays that are tangent, graze, meet the critical angle or a cusp, lenses of every shape, size and
    index, and scenes that have to be refused. Status, events and place of every ray are proved, and so is what becomes
    of them when each number of the problem, and each point and direction on the way, is moved by 16 roundings. An
    answer is wrong where no such move explains it.

    The table has a row for each family: the worst error of a place, in roundings as the ray's own condition magnifies
    them (16 are allowed). Of the rays whose path hangs on rounding, those that took one beside the exact one, those
    whose answer is not told by the moves that were tried, and those left undecided. And wrong answers: with any, the
    exit code is 3. The march is no guaranteed method: it loses short chords, and they count as wrong.

    It takes a minute or two, and longer where kernels have to be compiled; standard error says how far it is.

    \b
    Example:
      lenscl hardcases
      lenscl hardcases --method march --precision single
      lenscl hardcases --case tangent --json
    """
    from lenscl import device
    from lenscl.cli.progress import CaseProgress
    from lenscl.hardcases import by_family, load_pack, run_pack

    chosen = device.choose(label)
    precision = precision or ("double" if chosen.has_double else "single")
    pack = load_pack().having(names)
    if not pack.cases:
        raise click.BadParameter(f"no case has {' or '.join(names)} in its name", param_hint="--case")
    with CaseProgress(len(pack.cases)) as progress:
        told = run_pack(pack, method=method, precision=precision, device=chosen, report=progress.begin)
        verdicts = list(told)
    circumstances = {**chosen.circumstances(), "method": method, "precision": precision}
    if as_json:
        click.echo(json.dumps(_document(circumstances, verdicts, by_family(verdicts)), indent=2))
    else:
        _print(by_family(verdicts))
        click.echo()
        click.echo(plain(", ".join(f"{key} {value}" for key, value in circumstances.items())))
    for line in _complaints(verdicts):
        click.echo(plain(line), err=True)
    if any(each.wrong for each in verdicts):
        raise SystemExit(SOME_FAILED)


def _print(families: Sequence[FamilyResult]) -> None:
    head = ("family", "cases", "rays", "worst error", "beside", "untold", "undecided", "wrong")
    rows = [
        (each.family, *map(str, (each.cases, each.rays)), f"{each.worst:.2g}" if each.rays else "",
         *map(str, (each.beside, each.untold, each.undecided, each.wrong)))
        for each in families
    ]  # fmt: skip
    sums = [sum(int(row[k]) for row in rows) for k in (1, 2, 4, 5, 6, 7)]
    worst = max((each.worst for each in families), default=0.0)
    rows.append(("all", *map(str, sums[:2]), f"{worst:.2g}", *map(str, sums[2:])))
    print_table(head, rows, 1)


def _complaints(verdicts: Sequence[Verdict]) -> Iterable[str]:
    refused = [each for each in verdicts if each.refusal]
    if refused:
        yield (
            f"{many(len(refused), 'case')} left out, as the method does not serve them; "
            f"{refused[0].case.name}: {refused[0].refusal}"
        )
    lines = [f"wrong: {each.case.name}: {wrong}" for each in verdicts for wrong in each.wrong[:_MOST_OF_A_CASE]]
    yield from lines[:_MOST_LINES]
    count = sum(len(each.wrong) for each in verdicts)
    if count > min(len(lines), _MOST_LINES):
        yield f"and {count - min(len(lines), _MOST_LINES)} more; --json lists all"


def _finite(value: float) -> float | None:
    """Return a number that JSON has."""
    return value if math.isfinite(value) else None


def _document(
    circumstances: dict[str, str], verdicts: Sequence[Verdict], families: Sequence[FamilyResult]
) -> dict[str, object]:
    from dataclasses import asdict

    return {
        **circumstances,
        "families": [{**asdict(each), "worst": _finite(each.worst)} for each in families],
        "cases": [
            {
                "name": each.case.name, "family": each.case.family, "why": each.case.why, "rays": each.rays,
                "worst": _finite(each.worst), "beside": each.beside, "untold": each.untold,
                "undecided": each.undecided, "left_out": each.refusal,
                "wrong": [{"ray": wrong.ray, "what": wrong.what} for wrong in each.wrong],
            }
            for each in verdicts
        ],
    }  # fmt: skip
