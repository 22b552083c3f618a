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
    from collections.abc import Iterable, Mapping, Sequence

    from lenscl.hardcases import FamilyResult, Verdict

_MOST_LINES, _MOST_OF_A_CASE = 20, 3  # of wrong answers in text; --json lists all
_METHODS = ("auto", "march", "planes", "guarded", "polynomial", "joined", "interval")
_PRECISIONS = ("single", "mixed", "double")


@click.command()
@click.option("--method", type=click.Choice(_METHODS), default="auto", show_default=True, help="Root search.")
@click.option(
    "--precision", type=click.Choice(_PRECISIONS), help="Default: double, or single where the device has no double."
)
@click.option("--device", "label", metavar="DEVICE", help="Part of a device's label, as `lenscl devices` lists them.")
@click.option("--case", "names", metavar="TEXT", multiple=True, help="Only cases whose names contain the text.")
@json_option
def hardcases(method: str, precision: str | None, label: str | None, names: tuple[str, ...], as_json: bool) -> None:
    """Run the hard-case pack and grade the answers.

    The pack holds rays that are tangent, graze, or meet the critical angle or a cusp, lenses of every shape, size and
    index, and scenes that have to be refused. Status, events and place of every ray are proved, and so is the fate of
    the ray when each number of the problem, and each point and direction on its path, is moved by 16 roundings. An
    answer is wrong if no such move explains it.

    The table has a row for each family: the rays, those decided, the worst error of a place in roundings times the
    ray's own condition (16 are allowed), and the rays that were undecided at first and traced again in a higher
    precision. Of the rays whose path rounding can change, it counts those that took an alternative path ("beside"),
    those whose answer the tried moves do not settle ("untold"), and those left undecided, with the number that is
    expected at most for the method and precision. The last column counts wrong answers. Families of later editions of
    the pack stand apart. A second table counts the reasons for undecided rays.

    Path length and absorption are judged, too, in cases that ask for them.

    If an answer is wrong, or a family has more undecided rays than expected, the exit code is 3. The march is no
    guaranteed method: it loses short chords, and they count as wrong; no number of undecided rays is expected of it.

    It takes a minute or two, and longer where kernels have to be compiled. Progress goes to standard error.

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
    families = by_family(verdicts)
    most = pack.most_undecided.get(precision, {}).get(method) if chosen.has_double else None
    if as_json:
        click.echo(json.dumps(_document(circumstances, verdicts, families, most), indent=2))
    else:
        _print(families, most)
        click.echo()
        if any(each.undecided for each in families):
            _print_reasons(families)
            click.echo()
        click.echo(plain(", ".join(f"{key} {value}" for key, value in circumstances.items())))
    too_many = [] if most is None else list(_too_many(families, most))
    for line in (*_complaints(verdicts), *too_many):
        click.echo(plain(line), err=True)
    if too_many or any(each.wrong for each in verdicts):
        raise SystemExit(SOME_FAILED)


def _print(families: Sequence[FamilyResult], most: Mapping[str, int] | None) -> None:
    """Print a row a family, a sum an edition where there are several, and one of all."""
    head = ("family", "cases", "rays", "decided", "worst error", "again", "beside", "untold", "undecided", "at most",
            "wrong")  # fmt: skip
    rows = []
    editions = sorted({each.edition for each in families})
    for edition in editions:
        some = [each for each in families if each.edition == edition]
        rows += [_row(each.family, [each], most) for each in some]
        if len(editions) > 1:
            rows.append(_row(f"edition {edition}", some, most))
    print_table(head, [*rows, _row("all", families, most)], 1)


def _row(name: str, some: Sequence[FamilyResult], most: Mapping[str, int] | None) -> tuple[str, ...]:
    rays, undecided = sum(each.rays for each in some), sum(each.undecided for each in some)
    worst = max((each.worst for each in some), default=0.0)
    return (
        name,
        str(sum(each.cases for each in some)),
        str(rays),
        str(rays - undecided - sum(each.needless for each in some)),
        f"{worst:.2g}" if rays else "",
        str(sum(each.again for each in some)),
        str(sum(each.beside for each in some)),
        str(sum(each.untold for each in some)),
        str(undecided),
        "" if most is None else str(sum(most.get(each.family, 0) for each in some)),
        str(sum(each.wrong for each in some)),
    )


def _print_reasons(families: Sequence[FamilyResult]) -> None:
    """Print why rays are undecided, family by family, and the sum of each reason."""
    rows = [(each.family, why, str(count)) for each in families for why, count in each.reasons.items()]
    for why in dict.fromkeys(why for _, why, _ in rows):
        rows.append(("all", why, str(sum(each.reasons.get(why, 0) for each in families))))
    print_table(("family", "why undecided", "rays"), rows, 2)


def _too_many(families: Sequence[FamilyResult], most: Mapping[str, int]) -> Iterable[str]:
    for each in families:
        if each.undecided > most.get(each.family, 0):
            yield (
                f"too many undecided: {each.family}: {many(each.undecided, 'ray')}, where at most "
                f"{most.get(each.family, 0)} are expected; `--case` with the names of its cases narrows it down"
            )


def _complaints(verdicts: Sequence[Verdict]) -> Iterable[str]:
    refused = [each for each in verdicts if each.refusal]
    if refused:
        yield (
            f"{many(len(refused), 'case')} left out, as the method does not serve them; "
            f"{refused[0].case.name}: {refused[0].refusal}"
        )
    told, count = 0, sum(len(each.wrong) for each in verdicts)
    for each in verdicts:
        some = each.wrong[: min(_MOST_OF_A_CASE, _MOST_LINES - told)]
        if some:
            yield f"{each.case.family}: {each.case.why}"
        yield from (f"wrong: {each.case.name}: {wrong}" for wrong in some)
        told += len(some)
    if count > told:
        yield f"and {count - told} more; --json lists all"


def _finite(value: float) -> float | None:
    """Return a number that JSON has."""
    return value if math.isfinite(value) else None


def _document(
    circumstances: dict[str, str],
    verdicts: Sequence[Verdict],
    families: Sequence[FamilyResult],
    most: Mapping[str, int] | None,
) -> dict[str, object]:
    from dataclasses import asdict

    return {
        **circumstances,
        "families": [
            {
                **asdict(each), "worst": _finite(each.worst),
                "most_undecided": None if most is None else most.get(each.family, 0),
            }
            for each in families
        ],
        "cases": [
            {
                "name": each.case.name, "family": each.case.family, "why": each.case.why, "rays": each.rays,
                "worst": _finite(each.worst), "again": each.again, "beside": each.beside, "untold": each.untold,
                "undecided": each.undecided, "reasons": dict(each.reasons), "left_out": each.refusal,
                "wrong": [{"ray": wrong.ray, "what": wrong.what} for wrong in each.wrong],
            }
            for each in verdicts
        ],
    }  # fmt: skip
